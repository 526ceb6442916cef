//! Bump and normal maps: what they make of normals, in pictures.

use crate::support;

use phalanx::pbrt::load_str;
use phalanx::scene::Scene;
use std::f64::consts::PI;
use std::path::Path;
use support::{BOTH, Runs, run, settings, write_pfm};

const SEEDS: u64 = 12;

/// A folder with a ramp that rises by 1 from u = 1/4 to u = 3/4, one along v, an even grey, and
/// three directions.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let grey = |v: &[f32]| v.iter().map(|v| [*v; 3]).collect::<Vec<_>>();
    write_pfm(&dir.path().join("ramp-u.pfm"), 2, &grey(&[0.0, 1.0]));
    // Row 0 is the top.
    write_pfm(&dir.path().join("ramp-v.pfm"), 1, &grey(&[1.0, 0.0]));
    write_pfm(&dir.path().join("even.pfm"), 2, &grey(&[0.7; 4]));
    write_pfm(&dir.path().join("up.pfm"), 1, &[[0.5, 0.5, 1.0]]);
    write_pfm(&dir.path().join("along.pfm"), 1, &[[0.8, 0.5, 0.9]]);
    write_pfm(&dir.path().join("across.pfm"), 1, &[[0.5, 0.2, 0.9]]);
    dir
}

fn load(dir: &Path, v4: bool, depth: u32, camera: &str, world: &str) -> Scene {
    let film = if v4 { "rgb" } else { "image" };
    let end = if v4 { "" } else { "WorldEnd\n" };
    let text = format!(
        "{camera}\nFilm \"{film}\" \"integer xresolution\" [12] \"integer yresolution\" [12]\nPixelFilter \"box\"\n\
         Integrator \"path\" \"integer maxdepth\" [{depth}]\nWorldBegin\n{world}\n{end}"
    );
    load_str(&text, "test.pbrt", dir).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// A plane of 4 by 8 with `u` along x and `v` along y, its middle seen from above; with vertex
/// normals if `normals`.
fn plane(v4: bool, normals: bool) -> String {
    let point = if v4 { "point3" } else { "point" };
    let uv = if v4 { "point2" } else { "float" };
    let n = if normals {
        "\"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]"
    } else {
        ""
    };
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"{point} P\" [-2 -4 0  2 -4 0  2 4 0  -2 4 0] \
         \"{uv} uv\" [0 0 1 0 1 1 0 1] {n}\n"
    )
}

const ABOVE: &str = "LookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [20]";

/// What a plane of albedo 0.5 reflects of a sun of irradiance 2 that shines along `from`, if its
/// shading normal is `n`.
fn reflected(n: [f64; 3], from: [f64; 3]) -> f64 {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let dot: f64 = n.iter().zip(from).map(|(a, b)| a * b).sum();
    0.5 / PI * 2.0 * dot / length(n) / length(from)
}

/// Both integrators see a plane whose shading normal is everywhere `n`.
#[track_caller]
fn expect_normal(dir: &Path, v4: bool, texture: &str, material: &str, mesh: &str, n: [f64; 3]) {
    for from in [[0.0, 0.0, 1.0], [0.6, 0.3, 1.0]] {
        let [x, y, z] = from;
        let (kind, colour) = if v4 {
            ("diffuse", "reflectance")
        } else {
            ("matte", "Kd")
        };
        let point = if v4 { "point3" } else { "point" };
        let world = format!(
            "LightSource \"distant\" \"rgb L\" [2 2 2] \"{point} from\" [{x} {y} {z}] \"{point} to\" [0 0 0]\n{texture}\
             Material \"{kind}\" \"rgb {colour}\" [.5 .5 .5] {material}\n{mesh}"
        );
        let scene = load(dir, v4, 1, ABOVE, &world);
        for integrator in BOTH {
            let runs = Runs::new(&scene, &settings(&scene, integrator, 64), SEEDS);
            let what = format!("{texture}{material} {from:?} {integrator:?}");
            for (i, region) in runs.grid(2, 2).into_iter().enumerate() {
                region.expect(reflected(n, from), &format!("{what} region {i}"));
            }
        }
    }
}

fn height(file: &str, scale: f64) -> String {
    format!(
        "Texture \"h\" \"float\" \"imagemap\" \"string filename\" \"{file}\" \"string wrap\" \"clamp\" \"float scale\" [{scale}]\n"
    )
}

/// A ramp that rises by `scale` over half of the plane's 4 by 8.
#[test]
fn a_ramp_tilts_the_plane() {
    let dir = folder();
    let bump = |v4| {
        if v4 {
            "\"texture displacement\" \"h\""
        } else {
            "\"texture bumpmap\" \"h\""
        }
    };
    let check = |v4: bool, normals: bool, file: &str, scale: f64, n: [f64; 3]| {
        let mesh = plane(v4, normals);
        expect_normal(dir.path(), v4, &height(file, scale), bump(v4), &mesh, n);
    };
    for v4 in [false, true] {
        check(v4, false, "ramp-u.pfm", 0.6, [-0.3, 0.0, 1.0]);
        check(v4, false, "ramp-v.pfm", 2.0, [0.0, -0.5, 1.0]);
    }
    // Meshes with normals: v3 takes texture coordinates for lengths, v4 the scale of u for that of
    // v.
    check(false, true, "ramp-u.pfm", 0.2, [-0.4, 0.0, 1.0]);
    check(true, true, "ramp-v.pfm", 1.0, [0.0, -0.5, 1.0]);
}

/// Tangents of vertices along y and 4 long, a little off the plane, which does not count: v4
/// measures heights by them, v3 takes their direction only.
#[test]
fn a_ramp_tilts_the_plane_along_given_tangents() {
    let dir = folder();
    for (v4, name, vector, scale, n) in [
        (false, "bumpmap", "vector", 0.2, [0.0, -0.4, 1.0]),
        (true, "displacement", "vector3", 0.6, [0.0, -0.3, 1.0]),
    ] {
        let height = height("ramp-u.pfm", scale);
        let bump = format!("\"texture {name}\" \"h\"");
        let tangents = format!("\"{vector} S\" [0 4 .5 0 4 .5 0 4 .5 0 4 .5]\n");
        for normals in [false, true] {
            let mesh = plane(v4, normals) + &tangents;
            expect_normal(dir.path(), v4, &height, &bump, &mesh, n);
        }
    }
}

#[test]
fn directions_of_a_normal_map_are_those_of_the_plane() {
    let dir = folder();
    for (file, n) in [
        ("up.pfm", [0.0, 0.0, 1.0]),
        ("along.pfm", [0.6, 0.0, 0.8]),
        ("across.pfm", [0.0, -0.6, 0.8]),
    ] {
        for normals in [false, true] {
            let material = format!("\"string normalmap\" \"{file}\"");
            let mesh = plane(true, normals);
            expect_normal(dir.path(), true, "", &material, &mesh, n);
        }
    }
}

/// Half of a mixture is perturbed, or all of it: pbrt-v4 shades each material of a mix with its own
/// normals, pbrt-v3 all lobes with those of the first.
#[test]
fn a_mixture_tilts_as_pbrt_does() {
    let dir = folder();
    let (perturbed, even) = ([-0.3, 0.0, 1.0], [0.0, 0.0, 1.0]);
    let from = [0.6, 0.3, 1.0];
    let sun = |point: &str| {
        format!(
            "LightSource \"distant\" \"rgb L\" [2 2 2] \"{point} from\" [.6 .3 1] \"{point} to\" [0 0 0]\n{}",
            height("ramp-u.pfm", 0.6)
        )
    };
    let v4 = |order: &str| {
        sun("point3")
            + "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [.5 .5 .5] \"texture displacement\" \"h\"
               MakeNamedMaterial \"b\" \"string type\" \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\n"
            + &format!("Material \"mix\" \"string materials\" [{order}] \"float amount\" .25\n")
            + &plane(true, false)
    };
    let v3 = |first: &str, second: &str| {
        sun("point")
            + "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"texture bumpmap\" \"h\"
               MakeNamedMaterial \"b\" \"string type\" \"matte\"
               MakeNamedMaterial \"ab\" \"string type\" \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\"\n"
            + &format!("Material \"mix\" \"string namedmaterial1\" \"{first}\" \"string namedmaterial2\" \"{second}\" \"rgb amount\" [.25 .25 .25]\n")
            + &plane(false, false)
    };
    // How much of it is perturbed.
    for (is_v4, world, part) in [
        (true, v4("\"a\" \"b\""), 0.75),
        (true, v4("\"b\" \"a\""), 0.25),
        (false, v3("a", "b"), 1.0),
        (false, v3("b", "a"), 0.0),
        (false, v3("ab", "b"), 1.0),
        (false, v3("b", "ab"), 0.0),
    ] {
        let truth = part * reflected(perturbed, from) + (1.0 - part) * reflected(even, from);
        let scene = load(dir.path(), is_v4, 1, ABOVE, &world);
        for integrator in BOTH {
            let runs = Runs::new(&scene, &settings(&scene, integrator, 64), SEEDS);
            for (i, region) in runs.grid(2, 2).into_iter().enumerate() {
                region.expect(truth, &format!("{world} {integrator:?} region {i}"));
            }
        }
    }
}

/// Everything with bumps that are none: the picture stays, but for rounding.
#[test]
fn even_heights_and_upright_normals_change_nothing() {
    let dir = folder();
    let mesh: String = {
        let n = 6;
        let (mut p, mut normals, mut index) = (String::new(), String::new(), String::new());
        for j in 0..=n {
            for i in 0..=n {
                let (x, y) = (f64::from(i) / 3.0 - 1.0, f64::from(j) / 3.0 - 1.0);
                p += &format!("{x} {y} {} ", 0.2 * (3.0 * x).sin() * y);
                let (a, b) = (0.6 * (3.0 * x).cos() * y, 0.2 * (3.0 * x).sin());
                normals += &format!("{} {} 1 ", -a, -b);
                if i < n && j < n {
                    let a = j * (n + 1) + i;
                    let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
                    index += &format!("{a} {b} {c} {a} {c} {d} ");
                }
            }
        }
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [{index}] \"point3 P\" [{p}] \"normal N\" [{normals}]\n"
        )
    };
    let ball = "AttributeBegin Translate -.4 .3 .5 Scale .4 .3 .4 ReverseOrientation Shape \"sphere\" AttributeEnd\n";
    let of = |roughness: &str, extra: &str| {
        let world = format!(
            "LightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n\
             AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 9 9] Translate 1 1 2 Shape \"sphere\" \"float radius\" [.3] AttributeEnd\n\
             {}Material \"conductor\" {roughness} {extra}\n{mesh}{ball}",
            height("even.pfm", 0.05)
        );
        let scene = load(dir.path(), true, 3, ABOVE, &world);
        BOTH.map(|kind| run(&scene, &settings(&scene, kind, 64)).pixels)
    };
    // Even heights turn dp/du of what is curved both ways, though not the normal: no brushed metal
    // there.
    let (even, brushed) = (
        "\"float roughness\" [.3]",
        "\"float uroughness\" [.2] \"float vroughness\" [.5]",
    );
    for (roughness, extra) in [
        (even, "\"texture displacement\" \"h\""),
        (even, "\"string normalmap\" \"up.pfm\""),
        (brushed, "\"string normalmap\" \"up.pfm\""),
    ] {
        let (plain, other) = (of(roughness, ""), of(roughness, extra));
        // Path tracing, sample by sample; what Metropolis accepts may turn on a rounding.
        let (mut sum, mut off) = (0.0, 0.0);
        for (a, b) in plain[0].iter().zip(&other[0]) {
            for c in 0..3 {
                sum += f64::from(a[c]);
                off += f64::from(a[c] - b[c]).abs();
            }
        }
        assert!(sum > 0.0 && off <= 1e-4 * sum, "{extra}: {off} of {sum}");
    }
    // A number for a height is the same everywhere: to the bit.
    assert_eq!(of(brushed, "\"float displacement\" [.3]"), of(brushed, ""));
}

#[test]
fn integrators_agree_on_the_scene_of_bumps() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bumps.pbrt");
    let mut scene = phalanx::pbrt::load(&path).unwrap_or_else(|e| panic!("{e}"));
    scene.film.width = 24;
    scene.film.height = 18;
    scene.film.crop = [0, 24, 0, 18];
    scene.integrator.max_depth = 3;
    support::expect_integrators_agree(&scene, 32, 40, [3, 3], "bumps");
}
