//! What pbrt-v3 says about a file and then goes on: directives in the wrong place, and things of
//! unknown type.

use super::dialect::Dialect;
use super::error::{SceneError, Site};
use super::lexer::TokenKind;
use super::loader::{Loader, Section};
use crate::surface::table;

/// Whether pbrt-v3 knows materials of this type. It makes `matte` of others, with the same
/// parameters.
pub(super) fn knows_material(kind: &str) -> bool {
    // What is made of several BSDFs, and what is not supported.
    let others = matches!(
        kind,
        "" | "none" | "translucent" | "hair" | "disney" | "mix" | "uber" | "fourier"
    );
    others || table::names(Dialect::V3).any(|name| name == kind)
}

/// Whether pbrt-v3 knows shapes of this type, or we do. It leaves others out.
pub(super) fn knows_shape(kind: &str) -> bool {
    matches!(
        kind,
        "sphere"
            | "cylinder"
            | "disk"
            | "cone"
            | "paraboloid"
            | "hyperboloid"
            | "curve"
            | "trianglemesh"
            | "plymesh"
            | "heightfield"
            | "loopsubdiv"
            | "nurbs"
            | "bilinearmesh"
    )
}

/// Whether pbrt-v3 knows lights of this type. It leaves others out.
pub(super) fn knows_light(kind: &str) -> bool {
    matches!(
        kind,
        "point" | "spot" | "goniometric" | "projection" | "distant" | "infinite" | "exinfinite"
    )
}

/// Whether pbrt-v3 makes a texture of this type, a number if not a colour. Of others the name stays
/// undefined.
pub(super) fn makes_texture(kind: &str, number: bool) -> bool {
    match kind {
        "uv" | "marble" => !number,
        _ => matches!(
            kind,
            "constant"
                | "scale"
                | "mix"
                | "bilerp"
                | "imagemap"
                | "checkerboard"
                | "dots"
                | "fbm"
                | "wrinkled"
                | "windy"
                | "ptex"
        ),
    }
}

/// On which side of `WorldBegin` a directive belongs, if it matters.
fn belongs_to(directive: &str) -> Option<Section> {
    match directive {
        "Camera" | "Film" | "Sampler" | "PixelFilter" | "Integrator" | "Accelerator"
        | "TransformTimes" | "WorldBegin" => Some(Section::Options),
        "AttributeBegin" | "AttributeEnd" | "TransformBegin" | "TransformEnd" | "ObjectBegin"
        | "ObjectEnd" | "ObjectInstance" | "Texture" | "Material" | "MakeNamedMaterial"
        | "NamedMaterial" | "LightSource" | "AreaLightSource" | "Shape" | "ReverseOrientation"
        | "WorldEnd" => Some(Section::World),
        _ => None,
    }
}

impl Loader {
    /// Steps over a v3 directive that stands on the wrong side of `WorldBegin`, as pbrt-v3 does;
    /// true if this is one.
    pub(super) fn skip_misplaced(
        &mut self,
        directive: &str,
        site: &Site,
    ) -> Result<bool, SceneError> {
        let Some(section) = belongs_to(directive) else {
            return Ok(false);
        };
        if self.dialect == Dialect::V4 || section == self.section {
            return Ok(false);
        }
        let side = match section {
            Section::Options => "before",
            _ => "after",
        };
        self.report.warn_at(
            site,
            format_args!("ignored: it belongs {side} WorldBegin, and counts only there"),
        );
        while let Some(token) = self.stream.peek()? {
            let raw = token.raw();
            let directive = raw.starts_with(|c: char| c.is_ascii_alphabetic())
                && !matches!(raw, "true" | "false");
            if token.kind == TokenKind::Word && directive {
                break;
            }
            self.stream.next_token()?;
        }
        Ok(true)
    }
}
