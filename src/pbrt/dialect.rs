//! pbrt-v3 or pbrt-v4? The two write alike but mean different things, so it is decided before
//! anything is interpreted.

use std::collections::HashSet;
use std::path::Path;

use super::lexer::{Token, TokenKind};
use super::stream::scan;
use super::text::Text;
pub(super) use crate::scene::Dialect;
use crate::surface::table;

/// Different markers by which one dialect must lead before the rest of the text need not be read.
const CERTAIN: usize = 4;

/// Different markers after which the rest of the text is not read, either: the two are mixed at
/// random.
const ENOUGH: usize = 4096;

/// Counts the different things in the text that only one of the dialects writes. Includes are
/// looked at if the main file says nothing either way; if they do not either, it is v4 unless there
/// is a `WorldEnd`.
pub(super) fn detect(text: &Text, dir: &Path) -> Dialect {
    for with_includes in [false, true] {
        let mut tally = Tally::default();
        let includes = scan(text, dir, with_includes, &mut |token| tally.add(token));
        if tally.v3.len() != tally.v4.len() {
            return if tally.v3.len() > tally.v4.len() {
                Dialect::V3
            } else {
                Dialect::V4
            };
        }
        if !tally.v3.is_empty() {
            return if tally.world_end {
                Dialect::V3
            } else {
                Dialect::V4
            };
        }
        if !includes {
            break;
        }
    }
    Dialect::V4
}

#[derive(Default)]
struct Tally {
    v3: HashSet<String>,
    v4: HashSet<String>,
    world_end: bool,
    /// The directive or declaration just before.
    last: String,
}

impl Tally {
    /// Takes one token into account; true once the matter is settled.
    fn add(&mut self, token: &Token) -> bool {
        // Long lists of numbers carry no markers.
        if token.raw().len() > 200
            || token
                .raw()
                .starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '.')
        {
            return false;
        }
        let text = token.raw();
        let mark = match token.kind {
            TokenKind::Word => directive_marker(text),
            TokenKind::Quoted => quoted_marker(&self.last, text),
            TokenKind::Open | TokenKind::Close => return false,
        };
        self.world_end |= token.is_word("WorldEnd");
        if let Some(dialect) = mark {
            let key = format!(
                "{} {text}",
                if text.contains(' ') { "" } else { &self.last }
            );
            match dialect {
                Dialect::V3 => self.v3.insert(key),
                Dialect::V4 => self.v4.insert(key),
            };
        }
        self.last.clear();
        self.last.push_str(text);
        let (v3, v4) = (self.v3.len(), self.v4.len());
        v3.abs_diff(v4) >= CERTAIN || v3 + v4 >= ENOUGH
    }
}

fn directive_marker(word: &str) -> Option<Dialect> {
    match word {
        "WorldEnd" | "TransformBegin" | "TransformEnd" => Some(Dialect::V3),
        "true" | "false" | "Attribute" | "ColorSpace" | "Option" | "Import" => Some(Dialect::V4),
        _ => None,
    }
}

/// `text` in quotes right after `last`, which is a directive, or the declaration of the parameter
/// it is the value of.
fn quoted_marker(last: &str, text: &str) -> Option<Dialect> {
    use Dialect::{V3, V4};
    let known = |text: &str| [V3, V4].map(|dialect| table::names(dialect).any(|name| name == text));
    let material = |text: &str| match (text, known(text)) {
        // What is made of several BSDFs, and what is not supported.
        ("uber" | "translucent" | "kdsubsurface" | "fourier" | "disney", _) => Some(V3),
        ("coateddiffuse" | "coatedconductor" | "interface" | "measured", _) => Some(V4),
        (_, [true, false]) => Some(V3),
        (_, [false, true]) => Some(V4),
        _ => None,
    };
    if let Some((ty, name)) = text.split_once(' ') {
        let (ty, name) = (ty.trim(), name.trim());
        return match (ty, name) {
            ("color" | "xyz" | "point" | "vector", _) => Some(V3),
            ("point2" | "point3" | "vector2" | "vector3" | "normal3", _) => Some(V4),
            (
                _,
                "Kd" | "Ks" | "Kr" | "Kt" | "sigma" | "index" | "mapname" | "nlevels" | "xwidth"
                | "ywidth" | "trilinear",
            )
            | ("float", "uv" | "st")
            | (_, "maxsampleluminance") => Some(V3),
            (
                _,
                "reflectance" | "xradius" | "yradius" | "sensor" | "power" | "illuminance"
                | "levels",
            )
            | ("string", "filter" | "encoding") => Some(V4),
            _ => None,
        };
    }
    match last {
        "Material" => material(text),
        "Film" => match text {
            "image" => Some(V3),
            "rgb" | "gbuffer" | "spectral" => Some(V4),
            _ => None,
        },
        "Sampler" => match text {
            "random" | "02sequence" | "lowdiscrepancy" | "maxmindist" => Some(V3),
            "independent" | "paddedsobol" | "zsobol" | "pmj02bn" => Some(V4),
            _ => None,
        },
        "Integrator" => match text {
            "directlighting" | "whitted" => Some(V3),
            "volpath" | "simplepath" | "simplevolpath" | "lightpath" | "randomwalk"
            | "function" => Some(V4),
            _ => None,
        },
        "AreaLightSource" if text == "area" => Some(V3),
        "Shape" if text == "bilinearmesh" => Some(V4),
        _ if last.ends_with(" type") => material(text),
        _ if last.starts_with("bool ") && matches!(text, "true" | "false") => Some(V3),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Dialect {
        detect(&Text::held("t", text.as_bytes()), Path::new("."))
    }

    #[test]
    fn told_apart_by_what_only_one_writes() {
        for text in [
            "Film \"image\"",
            "WorldBegin WorldEnd",
            "Material \"matte\"",
            "MakeNamedMaterial \"a\" \"string type\" [ \"metal\" ]",
            "Material \"x\" \"color Kd\" [1 1 1]",
            "Shape \"trianglemesh\" \"point P\" [0 0 0]",
            "Material \"x\" \"bool remaproughness\" [\"false\"]",
        ] {
            assert_eq!(of(text), Dialect::V3, "{text}");
        }
        for text in [
            "Film \"rgb\"",
            "Material \"diffuse\"",
            "MakeNamedMaterial \"a\" \"string type\" \"conductor\"",
            "Shape \"x\" \"point3 P\" [0 0 0]",
            "Material \"x\" \"bool remaproughness\" false",
            "Option \"integer seed\" 1",
            "",
            "# Film \"image\"",
            "LightSource \"infinite\"",
        ] {
            assert_eq!(of(text), Dialect::V4, "{text}");
        }
    }

    #[test]
    fn includes_decide_what_the_main_file_leaves_open() {
        let dir = tempfile::tempdir().expect("a folder");
        std::fs::write(dir.path().join("a.pbrt"), "Material \"matte\"").expect("written");
        let main = |text: &str| Text::held("t", text.as_bytes());
        assert_eq!(detect(&main("Include \"a.pbrt\""), dir.path()), Dialect::V3);
        assert_eq!(
            detect(&main("Film \"rgb\" Include \"a.pbrt\""), dir.path()),
            Dialect::V4
        );
    }
}
