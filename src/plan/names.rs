//! What plans call materials and media.

use crate::scene::{Material, Medium};

/// `medium "fog", scene.pbrt:12`
pub(super) fn filling(medium: &Medium) -> String {
    format!("medium \"{}\", {}", medium.name, medium.origin)
}

/// `material "Pot1", scene.pbrt:42`
pub(super) fn named(material: &Material) -> String {
    match (material.name.as_str(), material.origin.as_str()) {
        (name, "") => format!("material \"{name}\""),
        (name, origin) => format!("material \"{name}\", {origin}"),
    }
}
