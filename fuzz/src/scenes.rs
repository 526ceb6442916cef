//! Small scenes of odd but valid parts: huge, tiny and collapsed transforms, needles, fields of
//! view of almost nothing. Those that load are sound, and paths through them are numbers; some are
//! rendered.
//!
//! Input: the choices that [`Unstructured`] makes of it.

use arbitrary::{Result, Unstructured};
use phalanx::integrate::{Settings, Silent, render};
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, Scene};

use super::{files, sound};

/// Numbers that are a limit of something, and ordinary ones.
const NUMBERS: [&str; 28] = [
    "0",
    "1",
    "-1",
    "2",
    "-2",
    "0.5",
    "3",
    "10",
    "90",
    "180",
    "1e-3",
    "-1e-3",
    "1e-6",
    "1e-10",
    "1e-20",
    "1e-30",
    "1e-38",
    "1e-45",
    "1e5",
    "1e10",
    "-1e10",
    "1e15",
    "1e20",
    "1e30",
    "3e38",
    "-3e38",
    "1e100",
    "0.9999999",
];

/// In templates, `#` is a number, `%` one between 0 and 1, `$` a few of either sort that stay in
/// sight of the camera.
const TRANSFORMS: [&str; 8] = [
    "Translate $ $ $",
    "Translate # # #",
    "Scale # # #",
    "Scale $ $ $",
    "Scale % % %",
    "Rotate # # # #",
    "Rotate $ 0 0 1",
    "ConcatTransform [$ # $ 0  $ $ # 0  # $ $ 0  $ $ $ 1]",
];

const OPTIONS: [&str; 7] = [
    "PixelFilter \"gaussian\"",
    "PixelFilter \"mitchell\"",
    "PixelFilter \"sinc\"",
    "PixelFilter \"box\"",
    "PixelFilter \"triangle\"",
    "Integrator \"path\" \"integer maxdepth\" 3",
    "Integrator \"mlt\" \"integer maxdepth\" 3 \"float sigma\" #",
];

const CAMERAS: [&str; 6] = [
    "LookAt 0 0 -3  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 50",
    "LookAt 0 0 -3  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" # \"float lensradius\" # \"float focaldistance\" #",
    "LookAt $ $ $  $ $ $  0 1 0 Camera \"perspective\" \"float lensradius\" % \"float focaldistance\" 3",
    "LookAt # # #  $ $ $  # # # Camera \"perspective\" \"float screenwindow\" [# # # #]",
    "Scale # # # LookAt 0 0 -3  0 0 0  0 1 0 Camera \"perspective\" \"float frameaspectratio\" #",
    "LookAt 0 0 -3  0 0 0  0 1 0 Camera \"orthographic\" \"float screenwindow\" [-1 # # 1]",
];

const LIGHTS: [[&str; 7]; 2] = [
    [
        "LightSource \"point\" \"rgb I\" [# # #] \"point from\" [$ $ $]",
        "LightSource \"point\" \"rgb I\" [1 1 1] \"point from\" [# # #]",
        "LightSource \"spot\" \"rgb I\" [# 1 1] \"point from\" [$ 2 $] \"point to\" [# $ $] \"float coneangle\" # \"float conedeltaangle\" #",
        "LightSource \"distant\" \"rgb L\" [# 1 1] \"point from\" [# $ $] \"point to\" [$ # $]",
        "LightSource \"infinite\" \"rgb L\" [# # #]",
        "LightSource \"infinite\" \"rgb scale\" [# 1 1] \"string mapname\" \"a.pfm\"",
        "LightSource \"infinite\" \"rgb L\" [1 1 1]",
    ],
    [
        "LightSource \"point\" \"float power\" # \"point3 from\" [$ $ $]",
        "LightSource \"point\" \"blackbody I\" # \"float scale\" # \"point3 from\" [# # #]",
        "LightSource \"spot\" \"float power\" # \"point3 from\" [$ 2 $] \"point3 to\" [# $ $] \"float coneangle\" # \"float conedeltaangle\" #",
        "LightSource \"distant\" \"float illuminance\" # \"point3 from\" [# $ $] \"point3 to\" [$ # $]",
        "LightSource \"infinite\" \"rgb L\" [# # #] \"float illuminance\" #",
        "LightSource \"infinite\" \"float scale\" # \"string filename\" \"square.pfm\"",
        "LightSource \"infinite\"",
    ],
];

const AREA_LIGHTS: [&str; 4] = [
    "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]",
    "AreaLightSource \"diffuse\" \"rgb L\" [# # #] \"bool twosided\" true",
    "AreaLightSource \"diffuse\" \"float power\" #",
    "AreaLightSource \"diffuse\" \"float scale\" #",
];

/// Texture `t` is a colour, `f` a number.
const TEXTURES: [[&str; 14]; 2] = [
    [
        "Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"a.pfm\" \"float uscale\" # \"float udelta\" #",
        "Texture \"t\" \"color\" \"checkerboard\" \"float uscale\" # \"float vscale\" # \"rgb tex1\" [# # #]",
        "Texture \"t\" \"color\" \"mix\" \"texture amount\" \"f\" \"rgb tex1\" [# # #]",
        "Texture \"f\" \"float\" \"checkerboard\" \"float uscale\" 10 \"float tex1\" # \"float tex2\" #",
        "Texture \"f\" \"float\" \"scale\" \"texture tex1\" \"f\" \"float tex2\" #",
        "Texture \"t\" \"color\" \"dots\" \"string mapping\" \"spherical\" \"rgb inside\" [# # #]",
        "Texture \"t\" \"color\" \"bilerp\" \"string mapping\" \"cylindrical\" \"rgb v00\" [# # #]",
        "Texture \"t\" \"color\" \"uv\" \"string mapping\" \"planar\" \"vector v1\" [# # #] \"vector v2\" [# # #] \"float udelta\" #",
        "Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"a.pfm\" \"string mapping\" \"planar\" \"vector v1\" [# # #]",
        "TransformBegin Rotate # # # # Scale # # # Texture \"t\" \"color\" \"marble\" \"float scale\" # \"float variation\" # TransformEnd",
        "Texture \"t\" \"color\" \"checkerboard\" \"integer dimension\" 3 \"rgb tex1\" [# # #]",
        "Texture \"f\" \"float\" \"fbm\" \"integer octaves\" 5 \"float roughness\" #",
        "TransformBegin Scale # # # Texture \"f\" \"float\" \"wrinkled\" \"float roughness\" # TransformEnd",
        "TransformBegin Translate # # # Texture \"f\" \"float\" \"windy\" TransformEnd",
    ],
    [
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.pfm\" \"float scale\" # \"bool invert\" true",
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" # \"float vscale\" # \"rgb tex1\" [# # #]",
        "Texture \"t\" \"spectrum\" \"mix\" \"texture amount\" \"f\" \"rgb tex1\" [# # #]",
        "Texture \"f\" \"float\" \"checkerboard\" \"float uscale\" 10 \"float tex1\" # \"float tex2\" #",
        "Texture \"f\" \"float\" \"scale\" \"texture tex\" \"f\" \"float scale\" #",
        "Texture \"t\" \"spectrum\" \"dots\" \"string mapping\" \"spherical\" \"rgb inside\" [# # #]",
        "Texture \"t\" \"spectrum\" \"bilerp\" \"string mapping\" \"cylindrical\" \"rgb v00\" [# # #]",
        "Texture \"t\" \"spectrum\" \"directionmix\" \"vector3 dir\" [# # #] \"rgb tex1\" [# # #]",
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.pfm\" \"string mapping\" \"planar\" \"vector3 v1\" [# # #]",
        "AttributeBegin Rotate # # # # Scale # # # Texture \"t\" \"spectrum\" \"marble\" \"float scale\" # \"float variation\" # AttributeEnd",
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"integer dimension\" 3 \"rgb tex1\" [# # #]",
        "Texture \"f\" \"float\" \"fbm\" \"integer octaves\" 5 \"float roughness\" #",
        "AttributeBegin Scale # # # Texture \"f\" \"float\" \"wrinkled\" \"float roughness\" # AttributeEnd",
        "AttributeBegin Translate # # # Texture \"f\" \"float\" \"windy\" AttributeEnd",
    ],
];

const MATERIALS: [[&str; 13]; 2] = [
    [
        "Material \"matte\" \"rgb Kd\" [% % %]",
        "Material \"matte\" \"rgb Kd\" [# # #] \"float sigma\" #",
        "Material \"matte\" \"texture Kd\" \"t\"",
        "Material \"mirror\" \"rgb Kr\" [# % %]",
        "Material \"glass\" \"float eta\" #",
        "Material \"glass\" \"rgb Kr\" [# # #] \"rgb Kt\" [# # #] \"texture eta\" \"f\"",
        "Material \"glass\" \"float eta\" # \"float uroughness\" # \"float vroughness\" # \"bool remaproughness\" \"false\"",
        "Material \"glass\" \"texture eta\" \"f\" \"texture uroughness\" \"f\"",
        "Material \"metal\" \"rgb eta\" [# # #] \"rgb k\" [# # #] \"float roughness\" #",
        "Material \"metal\" \"float uroughness\" # \"float vroughness\" # \"bool remaproughness\" \"false\"",
        "Material \"plastic\" \"rgb Kd\" [# # #] \"rgb Ks\" [# # #] \"float roughness\" #",
        "Material \"plastic\" \"texture Kd\" \"t\" \"texture roughness\" \"f\" \"bool remaproughness\" \"false\"",
        "Material \"\"",
    ],
    [
        "Material \"diffuse\" \"rgb reflectance\" [% % %]",
        "Material \"diffuse\" \"texture reflectance\" \"t\"",
        "Material \"diffuse\" \"rgb reflectance\" [# # #]",
        "Material \"conductor\" \"rgb reflectance\" [# # #] \"float roughness\" #",
        "Material \"conductor\" \"rgb eta\" [# # #] \"rgb k\" [# # #] \"float uroughness\" # \"float vroughness\" #",
        "Material \"conductor\" \"texture reflectance\" \"t\" \"texture roughness\" \"f\" \"bool remaproughness\" false",
        "Material \"conductor\" \"float roughness\" 0",
        "Material \"dielectric\" \"float eta\" #",
        "Material \"dielectric\" \"float eta\" # \"float roughness\" #",
        "Material \"dielectric\" \"spectrum eta\" \"glass-BK7\"",
        "Material \"dielectric\" \"texture roughness\" \"f\" \"bool remaproughness\" false",
        "Material \"dielectric\"",
        "Material \"interface\"",
    ],
];

const SHAPES: [[&str; 10]; 2] = [
    [
        "Shape \"sphere\" \"float radius\" #",
        "Shape \"sphere\"",
        "Shape \"disk\" \"float radius\" # \"float innerradius\" # \"float height\" # \"float phimax\" #",
        "Shape \"trianglemesh\" \"point P\" [$ $ $  $ $ $  $ $ $] \"integer indices\" [0 1 2]",
        "Shape \"trianglemesh\" \"point P\" [# # #  # # #  # # #] \"integer indices\" [0 1 2]",
        "Shape \"trianglemesh\" \"point P\" [-2 -1 -2  2 -1 -2  2 -1 2  -2 -1 2] \"integer indices\" [0 1 2 0 2 3] \"normal N\" [# # # $ $ $ $ $ $ # # #] \"float uv\" [# # % % % % % %]",
        "Shape \"trianglemesh\" \"point P\" [0 0 0  1 0 0  1 # 0  0 # #  $ # $] \"integer indices\" [0 1 2 2 1 3 3 4 0]",
        "Shape \"loopsubdiv\" \"integer levels\" 1 \"point P\" [$ $ $ # $ $ $ # $ $ $ #] \"integer indices\" [0 1 2 1 3 2]",
        "Shape \"plymesh\" \"string filename\" \"a.ply\"",
        "ObjectBegin \"o\" Shape \"sphere\" \"float radius\" % ObjectEnd Scale # % $ ObjectInstance \"o\"",
    ],
    [
        "Shape \"sphere\" \"float radius\" #",
        "Shape \"sphere\"",
        "Shape \"disk\" \"float radius\" # \"float innerradius\" # \"float height\" # \"float phimax\" #",
        "Shape \"trianglemesh\" \"point3 P\" [$ $ $  $ $ $  $ $ $]",
        "Shape \"trianglemesh\" \"point3 P\" [# # #  # # #  # # #]",
        "Shape \"trianglemesh\" \"point3 P\" [-2 -1 -2  2 -1 -2  2 -1 2  -2 -1 2] \"integer indices\" [0 1 2 0 2 3] \"normal N\" [# # # $ $ $ $ $ $ # # #] \"point2 uv\" [# # % % % % % %]",
        "Shape \"bilinearmesh\" \"point3 P\" [$ $ $ $ $ # # $ $ $ $ $]",
        "Shape \"loopsubdiv\" \"integer levels\" 1 \"point3 P\" [$ $ $ # $ $ $ # $ $ $ #] \"integer indices\" [0 1 2 1 3 2]",
        "Shape \"plymesh\" \"string filename\" \"a.ply\"",
        "ObjectBegin \"o\" Shape \"sphere\" \"float radius\" % ObjectEnd Scale # % $ ObjectInstance \"o\"",
    ],
];

pub fn check(data: &[u8]) {
    let mut choices = Unstructured::new(data);
    let (Ok(text), Ok(whole)) = (scene(&mut choices), choices.ratio(1, 16)) else {
        return;
    };
    let Ok(scene) = load_str(&text, "scene.pbrt", &files::dir()) else {
        return;
    };
    // Shown with a failure.
    let _text = Shown(&text);
    sound::tables(&scene);
    sound::a_few_paths(&scene);
    if whole {
        picture(&scene);
    }
}

/// Prints the scene when a check of it panics.
struct Shown<'a>(&'a str);

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("{}", self.0);
        }
    }
}

fn picture(scene: &Scene) {
    for kind in IntegratorKind::ALL {
        let mut settings = Settings::of(scene);
        settings.integrator = kind;
        settings.threads = 1;
        settings.max_depth = 3;
        settings.bootstrap = 64;
        settings.chains = 16;
        settings.mutations_per_pixel = 2;
        settings.samples_per_pixel = 2;
        settings.error_layers = true;
        if let Ok(render) = render(scene, &settings, &Silent) {
            let values = render.pixels.iter().flatten();
            assert!(values.clone().all(|v| !v.is_nan()), "{kind:?}");
        }
    }
}

fn scene(u: &mut Unstructured) -> Result<String> {
    let v4 = usize::from(u.arbitrary::<bool>()?);
    let mut text = String::new();
    let film = ["image", "rgb"][v4];
    text += &format!("Film \"{film}\" \"integer xresolution\" 8 \"integer yresolution\" 6\n");
    some(u, 0..=2, &OPTIONS, &mut text)?;
    some(u, 1..=1, &CAMERAS, &mut text)?;
    text += "WorldBegin\n";
    for kind in ["color", "float"] {
        let (name, class) = if kind == "color" {
            ("t", ["color", "spectrum"][v4])
        } else {
            ("f", "float")
        };
        text += &format!("Texture \"{name}\" \"{class}\" \"checkerboard\"\n");
    }
    some(u, 0..=2, &TEXTURES[v4], &mut text)?;
    some(u, 0..=2, &LIGHTS[v4], &mut text)?;
    for _ in 0..u.int_in_range(1..=4)? {
        text += "AttributeBegin\n";
        some(u, 0..=2, &TRANSFORMS, &mut text)?;
        some(u, 0..=1, &MATERIALS[v4], &mut text)?;
        some(u, 0..=1, &AREA_LIGHTS, &mut text)?;
        if u.ratio(1, 8)? {
            text += "ReverseOrientation\n";
        }
        some(u, 1..=1, &SHAPES[v4], &mut text)?;
        text += "AttributeEnd\n";
    }
    if v4 == 0 {
        text += "WorldEnd\n";
    }
    Ok(text)
}

/// Adds lines made from templates.
fn some(
    u: &mut Unstructured,
    count: std::ops::RangeInclusive<u8>,
    templates: &[&str],
    text: &mut String,
) -> Result<()> {
    for _ in 0..u.int_in_range(count)? {
        for c in u.choose(templates)?.chars() {
            match c {
                '#' => text.push_str(&number(u)?),
                '%' => text.push_str(&(f32::from(u.arbitrary::<u8>()?) / 255.0).to_string()),
                '$' => text.push_str(&(f32::from(u.arbitrary::<i8>()?) / 32.0).to_string()),
                c => text.push(c),
            }
        }
        text.push('\n');
    }
    Ok(())
}

fn number(u: &mut Unstructured) -> Result<String> {
    Ok(match u.int_in_range(0..=NUMBERS.len() + 4)? {
        i if i < NUMBERS.len() => NUMBERS[i].to_owned(),
        _ => {
            let any = f32::from_bits(u.arbitrary()?);
            format!("{:e}", if any.is_finite() { any } else { 0.0 })
        }
    })
}
