//! Small scenes that between them have every material, light and camera.

#[path = "../support/dialect.rs"]
mod dialect;
// Fuzz targets include this file by its path: so does it its own.
#[path = "scenes/materials.rs"]
mod materials;
#[path = "scenes/parts.rs"]
mod parts;

use self::materials::*;
use self::parts::{area, crooked_walls, front, lamp, sphere, walls, wave, wedge};
use phalanx::film::output::{Picture, write};
use phalanx::pbrt::load_str;
use phalanx::scene::{Light, LightKind, MaterialKind, Param, Scene};
use phalanx::surface::{DielectricMaterial, MirrorMaterial};
use std::path::{Path, PathBuf};

const LOOK: &str = "LookAt 0 0.1 -2.6  0 0 0  0 1 0\n";
const INSIDE: &str = "LookAt 0 0.1 -0.9  0 -0.1 0  0 1 0\n";
const FILM: &str = "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 12 \"string filename\" \"x.pfm\"\nPixelFilter \"box\"\n";
const PINHOLE: &str = "Camera \"perspective\" \"float fov\" 50\n";
const LENS: &str = "Camera \"perspective\" \"float fov\" 50 \"float lensradius\" 0.1 \"float focaldistance\" 2.5\n";
const WIDE: &str = "Camera \"perspective\" \"float fov\" 90\n";
const PARALLEL: &str = "Camera \"orthographic\" \"float screenwindow\" [-0.9 0.9 -0.9 0.9]\n";

fn text_of(view: &str, world: &str) -> String {
    format!("{view}WorldBegin\n{world}WorldEnd\n")
}

fn load(text: &str, dir: &Path) -> Scene {
    load_str(text, "test.pbrt", dir).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// An environment with a smooth sky and a small sun.
pub fn sky(width: u32, height: u32) -> Picture {
    let pixels = (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let sun = if x == width / 3 && y == height / 4 {
                30.0
            } else {
                0.0
            };
            let base = 0.3 + 0.7 * (y as f32 / height as f32);
            [base + sun, 0.5 * base + sun, 0.2 + 0.03 * x as f32 + sun]
        })
        .collect();
    Picture {
        width,
        height,
        offset: [0, 0],
        full: [width, height],
        pixels,
    }
}

/// Every scene of the transport tests, by name.
pub fn all() -> Vec<(&'static str, Scene)> {
    let dir = tempfile::tempdir().expect("a temporary directory");
    write_images(dir.path());
    let load = |(name, text): (_, String)| (name, load(&text, dir.path()));
    texts().into_iter().map(load).collect()
}

/// The same as files in a folder.
pub fn write_all(dir: &Path) -> Vec<PathBuf> {
    std::fs::create_dir_all(dir).expect("a folder");
    write_images(dir);
    let file = |(i, (_, text)): (usize, (&str, String))| {
        let path = dir.join(format!("{i}.pbrt"));
        std::fs::write(&path, text).expect("a written scene");
        path
    };
    texts().into_iter().enumerate().map(file).collect()
}

fn write_images(dir: &Path) {
    for (name, width, height) in [("sky", 16, 8), ("square", 12, 12), ("slide", 7, 5)] {
        let path = dir.join(format!("{name}.pfm"));
        write(
            &path,
            &sky(width, height),
            &[],
            &phalanx::formats::tone::Display::LINEAR,
        )
        .expect("a written image");
    }
}

/// Names and scene files.
fn texts() -> Vec<(&'static str, String)> {
    let build = |name: &'static str, view: String, world: String| {
        let film = if view.contains("Film") { "" } else { FILM };
        (name, text_of(&format!("{view}{film}"), &world))
    };
    let crooked = |materials| {
        crooked_walls(materials)
            + MATTE
            + &area("5 4 3", false, &lamp())
            + "LightSource \"infinite\" \"rgb L\" [.3 .4 .5]\n"
    };
    vec![
        build(
            "diffuse box, lamp",
            format!("{LOOK}{PINHOLE}"),
            walls([ROUGH, MATTE, MATTE, BLUE, ROUGH]) + MATTE + &area("5 4 3", false, &lamp()),
        ),
        build(
            "glossy box, lens, sphere light and two-sided lamp",
            format!("{LOOK}{LENS}"),
            walls([PLASTIC, MATTE, METAL, MATTE, PLASTIC])
                + MATTE
                + &area("2 2 3", true, &lamp())
                + &area("6 5 4", false, &sphere(0.3, -0.2, 0.2, 0.25, MATTE)),
        ),
        build(
            "closed box, specular things",
            format!("{INSIDE}{WIDE}"),
            walls([MATTE, MATTE, MIRROR, ROUGH, STEEL])
                + &front(BLUE)
                + &sphere(-0.4, -0.5, 0.2, 0.45, GLASS)
                + &sphere(0.5, -0.5, 0.3, 0.4, STEEL)
                + &sphere(-0.4, -0.5, 0.2, 0.2, PLASTIC)
                + MATTE
                + &area("5 4 3", false, &lamp()),
        ),
        build(
            "point, spot and distant lights on a smooth mesh",
            format!("{LOOK}{PINHOLE}"),
            format!(
                "LightSource \"point\" \"rgb I\" [2 1 1] \"point from\" [0.3 0.6 -0.4]
                 LightSource \"spot\" \"rgb I\" [4 5 6] \"point from\" [-0.5 0.8 -0.5] \"point to\" [0 -1 0.2] \"float coneangle\" 50 \"float conedeltaangle\" 30
                 LightSource \"distant\" \"rgb L\" [1 1.5 1] \"point from\" [0.2 1 -1.5] \"point to\" [0 0 0]
                 {}
                 AttributeBegin {PLASTIC} Translate 0 -0.5 0 {} AttributeEnd
                 {}",
                walls([MATTE, MATTE, ROUGH, MIRROR, MATTE]),
                wave(6),
                sphere(0.4, 0.2, 0.4, 0.3, METAL),
            ),
        ),
        build(
            "constant sky, lens, glass and brushed metal",
            format!("{LOOK}{LENS}"),
            format!(
                "LightSource \"infinite\" \"rgb L\" [1 1.2 1.5]
                 AttributeBegin {BRUSHED} Translate 0 -0.8 0 {} AttributeEnd
                 {}{}{}",
                wave(6),
                sphere(-0.5, 0.0, 0.0, 0.4, GLASS),
                sphere(0.5, 0.1, 0.2, 0.4, PLASTIC),
                area("4 4 4", true, &sphere(0.0, 0.6, 0.5, 0.2, MATTE)),
            ),
        ),
        build(
            "image sky, parallel camera, smooth meshes",
            format!("LookAt 0.4 1.2 -2.5  0 -0.3 0  0 1 0\n{PARALLEL}"),
            format!(
                "AttributeBegin Rotate 30 0 1 1 LightSource \"infinite\" \"string mapname\" \"sky.pfm\" AttributeEnd
                 AttributeBegin {MATTE} Translate 0 -0.6 0 {0} AttributeEnd
                 AttributeBegin {METAL} Translate 0 -0.2 0.7 Rotate -70 1 0 0 Scale 0.6 1 0.6 {0} AttributeEnd
                 {1}{2}",
                wave(5),
                sphere(-0.4, 0.1, -0.1, 0.35, GLASS),
                sphere(0.5, 0.1, 0.1, 0.3, MIRROR),
            ),
        ),
        build(
            "lamp in a glass ball, wedge",
            format!("{LOOK}{PINHOLE}"),
            walls([MATTE, MATTE, ROUGH, MATTE, BLUE])
                + &sphere(0.4, 0.2, 0.0, 0.45, GLASS)
                + &area("9 8 7", false, &sphere(0.4, 0.2, 0.0, 0.2, MATTE))
                + &format!(
                    "AttributeBegin\n{GLASS}\nTranslate -0.3 -0.8 0\n{}AttributeEnd\n",
                    wedge()
                ),
        ),
        build(
            "ellipsoid light, mirrored and cropped view",
            format!(
                "Scale -1 1 1\n{LOOK}{PINHOLE}Film \"image\" \"integer xresolution\" 20 \"integer yresolution\" 16 \"float cropwindow\" [0.2 0.9 0.1 0.8] PixelFilter \"gaussian\" \"float xwidth\" 1.5 \"float ywidth\" 2\n"
            ),
            format!(
                "{}AttributeBegin {MATTE} AreaLightSource \"diffuse\" \"rgb L\" [5 5 4] Translate 0 0.5 0 Scale 0.6 0.1 0.3 Shape \"sphere\" \"float radius\" 1 AttributeEnd
                 AttributeBegin {PLASTIC} Translate 0 -0.6 0 Scale 0.7 1 0.7 {} AttributeEnd
                 {}",
                walls([MATTE, BLUE, ROUGH, METAL, MATTE]),
                wave(5),
                sphere(0.6, -0.1, 0.3, 0.3, GLASS),
            ),
        ),
        build(
            "lacquer and a paper ball",
            format!("{LOOK}{PINHOLE}"),
            walls([LACQUER, MATTE, MATTE, BLUE, MATTE])
                + &sphere(-0.3, 0.3, 0.2, 0.4, SHADE)
                + MATTE
                + &area("5 4 3", false, &lamp())
                + &format!(
                    "AttributeBegin\n{LACQUER}\nTranslate 0.3 -0.4 0 Scale 0.6 1 0.6\n{}AttributeEnd\n",
                    wave(5)
                ),
        ),
        build(
            "marble, dots and creases",
            format!("{LOOK}{PINHOLE}"),
            format!(
                "TransformBegin Scale 4 4 4 Rotate 40 1 1 0
                 Texture \"marble\" \"spectrum\" \"marble\" \"float variation\" 3
                 Texture \"creases\" \"float\" \"wrinkled\" \"integer octaves\" 4
                 TransformEnd
                 Texture \"dots\" \"spectrum\" \"dots\" \"float uscale\" 5 \"float vscale\" 5 \"texture inside\" \"marble\" \"rgb outside\" [.2 .1 .4]
                 Texture \"globe\" \"spectrum\" \"bilerp\" \"string mapping\" \"spherical\" \"rgb v00\" [.7 .6 .2] \"rgb v01\" [.2 .3 .6] \"rgb v10\" [.1 .1 .1] \"rgb v11\" [.5 .2 .2]
                 {}{}{}",
                walls([STONE, MATTE, DOTTED, BLUE, STONE]),
                sphere(0.2, -0.3, 0.2, 0.5, CREASED),
                MATTE.to_owned() + &area("5 4 3", false, &lamp()),
            ),
        ),
        in_v4(build(
            "sheets",
            format!("{LOOK}{LENS}"),
            walls([MATTE, MATTE, MATTE, BLUE, MATTE])
                + &format!(
                    "AttributeBegin\n{PANE}\nTranslate 0 -0.1 -0.4 Rotate -60 1 0 0 Scale 0.8 1 0.8\n{}AttributeEnd\n",
                    wave(4)
                )
                + &format!(
                    "AttributeBegin\n{PAPER}\nTranslate 0 0.6 0 Scale 0.8 1 0.8\n{}AttributeEnd\n",
                    wave(5)
                )
                + MATTE
                + &area("5 4 3", true, &lamp()),
        )),
        build(
            "goniometric lamp and a slide",
            format!("{LOOK}{PINHOLE}"),
            walls([PLASTIC, MATTE, ROUGH, BLUE, MATTE])
                + &format!(
                    "AttributeBegin Translate 0.3 0.5 0 Rotate 40 1 2 0 LightSource \"goniometric\" \"string mapname\" \"sky.pfm\" \"rgb I\" [1 1 0.8] AttributeEnd
                     AttributeBegin Translate -0.4 0.6 -0.6 Rotate 65 1 0.2 0 LightSource \"projection\" \"string mapname\" \"slide.pfm\" \"float fov\" 50 AttributeEnd
                     {}{}",
                    sphere(-0.4, -0.4, 0.2, 0.4, GLASS),
                    sphere(0.5, -0.4, 0.3, 0.35, METAL),
                ),
        ),
        in_v4(build(
            "image lamps and a slide",
            format!("{LOOK}{LENS}"),
            walls([MATTE, MATTE, MATTE, BLUE, MATTE])
                + &format!(
                    "AttributeBegin Translate -0.4 0.5 -0.6 Rotate 70 1 -0.2 0 LightSource \"projection\" \"string filename\" \"slide.pfm\" \"float power\" 6 \"float fov\" 60 AttributeEnd
                     AttributeBegin Translate 0.6 0.3 -0.3 LightSource \"goniometric\" \"string filename\" \"square.pfm\" \"float power\" 8 AttributeEnd
                     AttributeBegin
                     {MATTE}
                     AreaLightSource \"diffuse\" \"string filename\" \"slide.pfm\" \"float scale\" 2 \"bool twosided\" \"true\"
                     Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-0.6 0.7 -0.4 0.5 0.8 -0.4 0.5 0.6 0.5 -0.6 0.6 0.4] \"float uv\" [0 0 1 0.1 0.9 1.2 -0.1 1]
                     AreaLightSource \"diffuse\" \"string filename\" \"sky.pfm\" \"float power\" 5
                     Translate 0.2 -0.4 0.2 Rotate 50 1 1 0 Shape \"sphere\" \"float radius\" 0.3
                     AttributeEnd
                     {}",
                    sphere(-0.5, -0.5, 0.2, 0.4, PAPER),
                ),
        )),
        build(
            "frosted ball around a lamp and frosted smooth mesh, clear wedge",
            format!("{LOOK}{PINHOLE}"),
            format!(
                "{}{}{}AttributeBegin {GLASS} Translate -0.3 -0.7 -0.2 {} AttributeEnd
                 AttributeBegin {FROSTED} Translate 0 0.2 -0.8 Rotate 80 1 0 0 Scale 0.8 1 0.6 {} AttributeEnd\n",
                walls([MATTE, MATTE, ROUGH, PLASTIC, BLUE]),
                sphere(0.4, 0.2, 0.2, 0.4, FROSTED),
                area("9 8 7", false, &sphere(0.4, 0.2, 0.2, 0.15, MATTE)),
                wedge(),
                wave(5),
            ),
        ),
        in_v4(build(
            "coated balls and walls",
            format!("{LOOK}{PINHOLE}"),
            walls([COATED, MATTE, POLISHED, BRONZE, MATTE])
                + &sphere(-0.5, -0.5, 0.1, 0.4, VARNISHED)
                + &sphere(0.5, -0.6, 0.0, 0.35, CHROME)
                + MATTE
                + &area("5 4 3", false, &lamp())
                + &format!(
                    "AttributeBegin\n{BRONZE}\nTranslate 0.2 0.2 0.3 Scale 0.5 1 0.5\n{}AttributeEnd\n",
                    wave(5)
                ),
        )),
        in_v4(build(
            "dispersing glass: frosted ball around a lamp, clear wedge and ball, foil",
            format!("{LOOK}{PINHOLE}"),
            format!(
                "{}{}{}{}AttributeBegin {CRYSTAL} Translate -0.3 -0.8 -0.1 {} AttributeEnd
                 AttributeBegin {FOIL} Translate 0 0.2 -0.8 Rotate 80 1 0 0 Scale 0.6 1 0.4 {} AttributeEnd\n",
                walls([MATTE, MATTE, MATTE, BLUE, MATTE]),
                sphere(0.4, 0.2, 0.2, 0.4, HAZE),
                area("9 8 7", false, &sphere(0.4, 0.2, 0.2, 0.15, MATTE)),
                sphere(-0.5, 0.3, 0.3, 0.3, CRYSTAL),
                wedge(),
                wave(4),
            ),
        )),
        build(
            "mixtures, specular in part, textured, nested and emitting",
            format!("{LOOK}{PINHOLE}"),
            MIXTURES.to_string()
                + &walls([
                    MATTE,
                    MATTE,
                    "NamedMaterial \"polished\"",
                    BLUE,
                    "NamedMaterial \"nested\"",
                ])
                + &sphere(-0.4, -0.4, 0.2, 0.4, "NamedMaterial \"veil\"")
                + "NamedMaterial \"polished\"\n"
                + &area("5 4 3", true, &lamp())
                + &format!(
                    "AttributeBegin\nNamedMaterial \"nested\"\nTranslate 0.4 -0.5 0 Scale 0.6 1 0.6\n{}AttributeEnd\n",
                    wave(5)
                ),
        ),
        build(
            "panorama of a room",
            "LookAt 0.2 0.1 -0.3  0.5 0 0.4  0.1 1 0\nCamera \"environment\"\nFilm \"image\" \"integer xresolution\" 16 \"integer yresolution\" 8\nPixelFilter \"gaussian\" \"float xwidth\" 2.5 \"float ywidth\" 2\n".into(),
            walls([ROUGH, MATTE, PLASTIC, BLUE, MATTE])
                + &front(BLUE)
                + &sphere(0.5, -0.5, 0.3, 0.3, GLASS)
                + MATTE
                + &area("5 4 3", false, &lamp()),
        ),
        in_v4(build(
            "part of an equal-area panorama",
            "Scale 1 -1 1\nLookAt 0.1 0.2 -0.2  -0.5 0.3 0.4  0 1 0\nCamera \"spherical\"\nFilm \"image\" \"integer xresolution\" 14 \"integer yresolution\" 12 \"float cropwindow\" [0.4 1 0 0.7]\nPixelFilter \"triangle\" \"float xradius\" 1.5 \"float yradius\" 2\n".into(),
            format!(
                "LightSource \"infinite\" \"rgb L\" [1 1.2 1.5]\n{}",
                walls([MATTE, ROUGH, MATTE, BLUE, MATTE])
                    + &sphere(-0.4, -0.3, 0.4, 0.3, MATTE)
                    + MATTE
                    + &area("5 4 3", true, &lamp())
            ),
        )),
        in_v4(build(
            "cut-outs",
            format!("{LOOK}{PINHOLE}"),
            CHECKS.to_string()
                + &walls([MATTE, MATTE, MATTE, BLUE, MATTE])
                + &format!(
                    "AttributeBegin\n{BLUE}\nTranslate 0 0.3 0 Scale 0.8 1 0.8\n{}AttributeEnd\n",
                    wave(4).replace("\n", " \"texture alpha\" \"checks\"\n")
                )
                + &sphere(-0.4, -0.5, 0.0, 0.4, MATTE).replace("radius\" 0.4", "radius\" 0.4 \"float alpha\" 0.6")
                + &sphere(0.4, -0.4, 0.2, 0.35, PAPER)
                    .replace("radius\" 0.35", "radius\" 0.35 \"texture alpha\" \"checks\"")
                + MATTE
                + &area(
                    "8 7 5",
                    true,
                    &lamp().replace("\n", " \"texture alpha\" \"checks\"\n"),
                )
                + &area(
                    "2 2 3",
                    false,
                    &sphere(0.6, 0.3, -0.4, 0.2, MATTE)
                        .replace("radius\" 0.2", "radius\" 0.2 \"texture alpha\" \"checks\""),
                ),
        )),
        build(
            "bumps",
            format!("{LOOK}{PINHOLE}"),
            format!(
                "Texture \"heights\" \"float\" \"imagemap\" \"string filename\" \"sky.pfm\" \"float scale\" 0.1\n\
                 {}AttributeBegin {MATTE} {BUMPY} Translate 0 -0.7 0 {} AttributeEnd\n{}{}{MATTE}\n{}",
                walls([MATTE, MATTE, &format!("{BLUE} {BUMPY}"), BLUE, MATTE]),
                wave(5),
                sphere(-0.4, 0.1, 0.2, 0.35, &format!("{PLASTIC} {BUMPY}")),
                sphere(0.45, 0.0, 0.1, 0.35, &format!("{BRUSHED} {BUMPY}")),
                area("5 4 3", false, &lamp()),
            ),
        ),
        build(
            "crooked normals, plastic, matte and glass",
            format!("{LOOK}{PINHOLE}"),
            crooked([PLASTIC, ROUGH, FROSTED]),
        ),
        build(
            "crooked normals, coat, metal and leaf",
            format!("{LOOK}{PINHOLE}"),
            crooked([LACQUER, METAL, SHADE]),
        ),
        in_v4(build(
            "crooked normals, v4",
            format!("{LOOK}{PINHOLE}"),
            crooked([MATTE, MATTE, BLUE]),
        )),
    ]
}

fn in_v4((name, text): (&'static str, String)) -> (&'static str, String) {
    (name, dialect::to_v4(&text))
}

/// A closed diffuse box with a lamp inside.
pub fn furnace(albedo: f32) -> Scene {
    let m = format!("Material \"matte\" \"rgb Kd\" [{albedo} {albedo} {albedo}]");
    let world = walls([&m; 5]) + &front(&m) + &area("1 1 1", false, &lamp());
    let text = text_of(&format!("{INSIDE}{WIDE}{FILM}"), &world);
    load(&text, Path::new("."))
}

/// Light from a point that a mirror throws on a surface is out of a path tracer's reach, not of
/// light subpaths': such scenes lose their delta materials.
pub fn without_delta_caustics(scene: &mut Scene) {
    let point_like = |l: &Light| {
        matches!(
            l.kind,
            LightKind::Point { .. }
                | LightKind::Spot { .. }
                | LightKind::Goniometric { .. }
                | LightKind::Projection { .. }
                | LightKind::Distant { .. }
        )
    };
    if !scene.lights.iter().any(point_like) {
        return;
    }
    for m in &mut scene.materials {
        let of_mirror = m.kind.get::<MirrorMaterial>().map(|m| m.reflectance);
        let of_glass = m.kind.get::<DielectricMaterial>().map(|m| m.reflectance);
        if let Some(reflectance) = of_mirror.or(of_glass) {
            m.kind = MaterialKind::from(phalanx::surface::DiffuseMaterial {
                reflectance,
                sigma: Param::Constant([0.0; 3]),
            });
        }
    }
}
