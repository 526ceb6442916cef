//! Surfaces of several BSDFs: pictures known in closed form, and pictures that another material or
//! the other integrator gives.

use crate::support;

use phalanx::integrate::{Settings, Width};
use phalanx::scene::{IntegratorKind, Scene};
use support::{BOTH, Runs, expect_integrators_agree, head, inward_box, run, scene, settings};

const SEEDS: u64 = 16;

/// Inside everything, looking askew.
const INSIDE: &str =
    "LookAt 0.2 -0.1 0.3  -0.4 0.5 -0.6  0 1 0\nCamera \"perspective\" \"float fov\" [70]";

/// In front of a square that fills the view.
const FRONT: &str = "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [25]";

fn named(name: &str, material: &str) -> String {
    format!("MakeNamedMaterial \"{name}\" \"string type\" {material}\n")
}

fn mix(name: &str, [a, b]: [&str; 2], amount: &str) -> String {
    named(
        name,
        &format!(
            "\"mix\" \"string namedmaterial1\" \"{a}\" \"string namedmaterial2\" \"{b}\" {amount}"
        ),
    )
}

/// A few named materials, some of them mixtures.
fn palette() -> String {
    "Texture \"checks\" \"spectrum\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 3 \"rgb tex1\" [1 .8 .1] \"rgb tex2\" [0 .1 .9]\n"
        .to_string()
        + &named("red", "\"matte\" \"rgb Kd\" [.8 .2 .1]")
        + &named("green", "\"matte\" \"rgb Kd\" [.3 .7 .2] \"float sigma\" 30")
        + &named("plastic", "\"plastic\" \"rgb Kd\" [.2 .3 .4] \"rgb Ks\" [.5 .5 .5] \"float roughness\" .3")
        + &named("mirror", "\"mirror\" \"rgb Kr\" [.9 .8 .7]")
        + &named("glass", "\"glass\" \"float index\" 1.5")
        + &mix("coloured", ["red", "green"], "\"rgb amount\" [.2 .9 0]")
        + &mix("checked", ["mirror", "red"], "\"texture amount\" \"checks\"")
        + &mix("veil", ["glass", "plastic"], "\"rgb amount\" [.7 .7 .7]")
        + &mix("nested", ["checked", "veil"], "\"rgb amount\" [.4 .5 .6]")
}

/// A closed vessel whose walls emit `l` and are of `material`.
fn vessel(depth: u32, material: &str, l: [f64; 3]) -> Scene {
    scene(
        &(head(12, 9, depth, INSIDE)
            + &palette()
            + &format!(
                "NamedMaterial \"{material}\"\nAreaLightSource \"diffuse\" \"rgb L\" [{} {} {}]\n{}WorldEnd\n",
                l[0],
                l[1],
                l[2],
                inward_box([-1.0, 0.7, -0.8, 1.0, -1.0, 1.2])
            )),
    )
}

/// Two squares that stand on the floor of a lit room.
fn room(extra: &str, material: &str) -> Scene {
    scene(
        &(head(16, 12, 5, "LookAt 0 0.2 -3  0 -0.1 0  0 1 0\nCamera \"perspective\" \"float fov\" [48]")
            + &palette()
            + extra
            + &format!(
                "Material \"matte\" \"rgb Kd\" [.6 .6 .6]
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -1 -2  -2 -1 2  2 -1 2  2 -1 -2]
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -1 2  -2 2 2  2 2 2  2 -1 2]
                 AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4]
                 Translate 0 1.5 -.5 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" .7 AttributeEnd
                 AttributeBegin {material} Translate -.6 -.3 0 Shape \"sphere\" \"float radius\" .6 AttributeEnd
                 AttributeBegin {material} Rotate 20 0 1 0
                 Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [.1 -1 0  .1 .6 0  1.2 .6 0  1.2 -1 0] \"float uv\" [0 0 0 1 1 1 1 0] AttributeEnd
                 WorldEnd\n"
            )),
    )
}

/// Fails unless path tracing sees the same in both.
#[track_caller]
fn expect_same_picture(a: &Scene, b: &Scene, effort: u64, what: &str) {
    let [a, b] = [(a, 0), (b, 100)].map(|(scene, seed)| {
        let settings = settings(scene, IntegratorKind::Pt, effort);
        let runs = Runs::new(scene, &Settings { seed, ..settings }, SEEDS);
        runs.show(&format!("{what}-{seed}"));
        runs
    });
    for (i, (a, b)) in a.grid(3, 3).iter().zip(b.grid(3, 3)).enumerate() {
        let what = format!("{what}, region {}, channel {}", i / 3, i % 3);
        a.expect_same(&b, &what);
    }
}

/// Every wall of a mixture emits and reflects: radiance of depth `k` is `L rho^k`, `rho` the mixed
/// colour. What the walls emit is not multiplied by any share.
#[test]
fn furnace_of_a_coloured_mixture() {
    let l = [1.0, 2.0, 4.0];
    // Two Lambertian materials.
    let mixed = mix("grey", ["red", "blue"], "\"rgb amount\" [.25 .5 .75]");
    let rho: [f64; 3] = std::array::from_fn(|c| {
        let (a, b, w) = ([0.8, 0.2, 0.1][c], [0.1, 0.2, 0.9][c], [0.25, 0.5, 0.75][c]);
        w * a + (1.0 - w) * b
    });
    for depth in [0, 1, 3] {
        let text = head(12, 9, depth, INSIDE)
            + &palette()
            + &named("blue", "\"matte\" \"rgb Kd\" [.1 .2 .9]")
            + &mixed
            + "NamedMaterial \"grey\"\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 4]\n"
            + &inward_box([-1.0, 0.7, -0.8, 1.0, -1.0, 1.2])
            + "WorldEnd\n";
        let scene = scene(&text);
        for kind in BOTH {
            let runs = Runs::new(&scene, &settings(&scene, kind, 64), SEEDS);
            for c in 0..3 {
                let truth: f64 = (0..=depth as i32).map(|k| l[c] * rho[c].powi(k)).sum();
                let what = format!("{kind:?}, depth {depth}, channel {c}");
                runs.whole(c).expect(truth, &what);
            }
        }
    }
}

/// Walls that are partly mirrors, of one albedo: still a furnace, now with paths that no connection
/// can make.
#[test]
fn furnace_of_diffuse_and_mirror() {
    let text = head(12, 9, 4, INSIDE)
        + &named("m", "\"mirror\" \"rgb Kr\" [.6 .6 .6]")
        + &named("d", "\"matte\" \"rgb Kd\" [.6 .6 .6]")
        + &mix("both", ["m", "d"], "\"rgb amount\" [.3 .5 .9]")
        + "NamedMaterial \"both\"\nAreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n"
        + &inward_box([-1.0, 0.7, -0.8, 1.0, -1.0, 1.2])
        + "WorldEnd\n";
    let scene = scene(&text);
    let truth: f64 = (0..=4).map(|k| 0.6f64.powi(k)).sum();
    for kind in BOTH {
        let runs = Runs::new(&scene, &settings(&scene, kind, 64), SEEDS);
        for c in 0..3 {
            let what = format!("{kind:?}, channel {c}");
            runs.whole(c).expect(truth, &what);
        }
    }
}

/// A mixture of equal materials with a grey weight is that material, path by path: to the rounding
/// of shares near 1.
#[test]
fn a_mixture_of_one_material_is_that_material() {
    let extra = mix("same", ["red", "red"], "\"rgb amount\" [.3 .3 .3]");
    let a = room(&extra, "NamedMaterial \"same\"");
    let b = room("", "NamedMaterial \"red\"");
    expect_same_picture(&a, &b, 32, "red and red");
}

#[test]
fn amounts_of_0_and_1_are_the_one_material() {
    for (amount, one) in [(1, "plastic"), (0, "glass")] {
        let extra = mix(
            "all",
            ["plastic", "glass"],
            &format!("\"rgb amount\" [{0} {0} {0}]", amount),
        );
        let a = room(&extra, "NamedMaterial \"all\"");
        let b = room("", &format!("NamedMaterial \"{one}\""));
        expect_same_picture(&a, &b, 32, one);
    }
}

/// Two Lambertian materials make a Lambertian one of the mixed colour; a mixture of mixtures, too.
#[test]
fn mixed_mattes_are_a_matte_of_the_mixed_colour() {
    let extra = named("blue", "\"matte\" \"rgb Kd\" [.1 .2 .9]")
        + &mix("purple", ["red", "blue"], "\"rgb amount\" [.25 .5 .75]")
        + &mix("pale", ["purple", "white"], "\"rgb amount\" [.5 .4 .3]");
    let extra = named("white", "\"matte\" \"rgb Kd\" [1 1 1]") + &extra;
    let [r, g, b]: [f64; 3] = std::array::from_fn(|c| {
        let (red, blue) = ([0.8, 0.2, 0.1][c], [0.1, 0.2, 0.9][c]);
        let (w, v) = ([0.25, 0.5, 0.75][c], [0.5, 0.4, 0.3][c]);
        v * (w * red + (1.0 - w) * blue) + 1.0 - v
    });
    let a = room(&extra, "NamedMaterial \"pale\"");
    let b = room("", &format!("Material \"matte\" \"rgb Kd\" [{r} {g} {b}]"));
    expect_same_picture(&a, &b, 32, "pale");
}

/// The left half of a square is all of one material, the right half of the other; v4 has the weight
/// of the second.
#[test]
fn a_checkered_amount_shows_one_material_a_field() {
    let world = |checks: &str, materials: &str| {
        format!(
            "{checks}\n{materials}\nLightSource \"distant\" \"rgb L\" [3 3 3] \"point3 from\" [0 0 -1] \"point3 to\" [0 0 0]\n"
        )
    };
    let square = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [-1 -1 0  -1 1 0  1 1 0  1 -1 0] \"point2 uv\" [0 0 0 .4 2 .4 2 0]\n";
    let v4 = FRONT.to_string()
        + "\nFilm \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nPixelFilter \"box\"\nIntegrator \"path\" \"integer maxdepth\" 1\nWorldBegin\n"
        + &world(
            "Texture \"c\" \"float\" \"checkerboard\" \"float tex1\" 1 \"float tex2\" 0",
            "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [.8 .1 .1]
             MakeNamedMaterial \"b\" \"string type\" \"diffuse\" \"rgb reflectance\" [.1 .8 .4]
             Material \"mix\" \"string materials\" [\"a\" \"b\"] \"texture amount\" \"c\"",
        )
        + square;
    let v3 = FRONT.to_string()
        + "\nFilm \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\nPixelFilter \"box\"\nIntegrator \"path\" \"integer maxdepth\" 1\nWorldBegin\n"
        + &world(
            "Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 1 1] \"rgb tex2\" [0 0 0]",
            "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [.8 .1 .1]
             MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [.1 .8 .4]
             Material \"mix\" \"string namedmaterial1\" \"b\" \"string namedmaterial2\" \"a\" \"texture amount\" \"c\"",
        )
        .replace("point3 from", "point from")
        .replace("point3 to", "point to")
        + &square.replace("point3 P", "point P").replace("point2 uv", "float uv")
        + "WorldEnd\n";
    for (text, name) in [(v4, "v4"), (v3, "v3")] {
        let scene = scene(&text);
        let picture = run(&scene, &settings(&scene, IntegratorKind::Pt, 4));
        let at = |x: usize| picture.pixels[4 * 8 + x];
        for (pixel, rho) in [(at(1), [0.1, 0.8, 0.4]), (at(6), [0.8, 0.1, 0.1])] {
            for c in 0..3 {
                let truth = 3.0 * rho[c] / std::f32::consts::PI;
                let off = (pixel[c] - truth).abs();
                assert!(off < 1e-4 * truth, "{name}: {pixel:?} is not {rho:?}");
            }
        }
    }
}

/// An uber of one lobe is the material of that lobe.
#[test]
fn an_uber_of_one_lobe_is_that_material() {
    let black = "\"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0]";
    for (uber, other, name) in [
        (
            "\"rgb Kd\" [.3 .5 .7] \"rgb Ks\" [0 0 0]".to_string(),
            "\"matte\" \"rgb Kd\" [.3 .5 .7]",
            "matte",
        ),
        (
            format!("{black} \"rgb Kr\" [1 .9 .8] \"rgb Kt\" [.8 .9 1] \"float index\" 1.4"),
            "\"glass\" \"rgb Kr\" [1 .9 .8] \"rgb Kt\" [.8 .9 1] \"float index\" 1.4",
            "glass",
        ),
        (
            "\"rgb Kd\" [0 0 0] \"rgb Ks\" [.9 .8 .7] \"float roughness\" .2".to_string(),
            "\"glass\" \"rgb Kr\" [.9 .8 .7] \"rgb Kt\" [0 0 0] \"float uroughness\" .2 \"float vroughness\" .2",
            "gloss",
        ),
        // Opacity scales: half of it passes straight on, as through a sheet of index 1.
        (
            "\"rgb Kd\" [.6 .6 .6] \"rgb Ks\" [0 0 0] \"rgb opacity\" [.5 .25 .125]".to_string(),
            "\"mix\" \"string namedmaterial1\" \"air\" \"string namedmaterial2\" \"dull\" \"rgb amount\" [.5 .75 .875]",
            "opacity",
        ),
    ] {
        let extra = named("air", "\"glass\" \"float index\" 1")
            + &named("dull", "\"matte\" \"rgb Kd\" [.6 .6 .6]");
        let a = room(&extra, &format!("Material \"uber\" {uber}"));
        let b = room(&extra, &format!("Material {other}"));
        expect_same_picture(&a, &b, 32, name);
    }
}

/// A convex ball in front of the camera, and light of radiance 1 from everywhere.
fn ball(material: &str) -> Scene {
    scene(
        &(head(12, 9, 12, FRONT)
            + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
            + &format!("Material {material}\nShape \"sphere\" \"float radius\" [2]\nWorldEnd\n")),
    )
}

/// White paint and what its opacity lets pass lose nothing between them: all that is missing is
/// what is still in the ball after the last event. No lobes of an uber that add up to less than 1
/// gain anything.
#[test]
fn ubers_keep_the_energy_that_they_should() {
    let opacity = [0.3, 0.5, 0.6];
    let scene = ball("\"uber\" \"rgb Kd\" [1 1 1] \"rgb Ks\" [0 0 0] \"rgb opacity\" [.3 .5 .6]");
    for kind in BOTH {
        let runs = Runs::new(&scene, &settings(&scene, kind, 64), SEEDS);
        for (c, opacity) in opacity.into_iter().enumerate() {
            let truth = 1.0 - (1.0 - opacity) * f64::powi(opacity, 11);
            runs.whole(c)
                .expect(truth, &format!("{kind:?}, channel {c}"));
        }
    }
    let scene = ball(
        "\"uber\" \"rgb Kd\" [.4 .4 .4] \"rgb Ks\" [.3 .3 .3] \"rgb Kr\" [.3 .3 .3] \"rgb opacity\" [.3 .5 .8]",
    );
    let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 64), SEEDS);
    for c in 0..3 {
        let seen = runs.whole(c);
        assert!(seen.mean <= 1.0 + 6.0 * seen.error, "{seen:?}");
    }
}

/// Mixtures that are specular in part, textured and nested ones; and emitting ones.
#[test]
fn integrators_agree() {
    for name in ["coloured", "checked", "veil", "nested"] {
        let scene = room("", &format!("NamedMaterial \"{name}\""));
        expect_integrators_agree(&scene, 32, 48, [3, 3], name);
    }
    let lobes =
        "\"rgb Kd\" [.3 .4 .5] \"rgb Ks\" [.4 .3 .2] \"rgb Kr\" [.5 .5 .5] \"rgb Kt\" [.3 .2 .4]";
    for (name, material) in [
        (
            "uber",
            format!("\"uber\" {lobes} \"rgb opacity\" [.6 .7 .8] \"float roughness\" .3"),
        ),
        (
            "translucent",
            "\"translucent\" \"rgb Kd\" [.8 .6 .4] \"rgb Ks\" [.5 .6 .7] \"float roughness\" .4"
                .to_string(),
        ),
    ] {
        let scene = room("", &format!("Material {material}"));
        expect_integrators_agree(&scene, 32, 48, [3, 3], name);
    }
    let scene = vessel(3, "nested", [1.0, 0.5, 2.0]);
    expect_integrators_agree(&scene, 16, 48, [3, 3], "vessel");
}

/// A room of pbrt-v4, with a material of dispersive glass, a bumped one, and mixtures of them; its
/// heights need points and coordinates.
fn detailed(depth: u32, material: &str) -> Scene {
    scene(&format!(
        r#"LookAt 0 0.2 -3  0 -0.1 0  0 1 0
        Camera "perspective" "float fov" [48]
        Film "rgb" "integer xresolution" 16 "integer yresolution" 12
        PixelFilter "box"
        Integrator "path" "integer maxdepth" {depth}
        WorldBegin
        Texture "waves" "float" "checkerboard" "integer dimension" 3 "float tex1" 0.3 "float tex2" 0.8
        Texture "dents" "float" "bilerp" "float v00" 0 "float v01" 0.4 "float v10" 0.3 "float v11" 0
        MakeNamedMaterial "glass" "string type" "dielectric" "spectrum eta" [400 1.9 700 1.4]
        MakeNamedMaterial "dented" "string type" "diffuse" "rgb reflectance" [.7 .5 .3] "texture displacement" "dents"
        MakeNamedMaterial "metal" "string type" "conductor" "rgb reflectance" [.5 .7 .9] "float roughness" .3
        MakeNamedMaterial "both" "string type" "mix" "string materials" ["dented" "glass"] "texture amount" "waves"
        MakeNamedMaterial "all" "string type" "mix" "string materials" ["both" "metal"] "float amount" .4
        MakeNamedMaterial "clear" "string type" "mix" "string materials" ["glass" "glass"] "float amount" .4
        Material "diffuse" "rgb reflectance" [.6 .6 .6]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-2 -1 -2  -2 -1 2  2 -1 2  2 -1 -2]
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [-2 -1 2  -2 2 2  2 2 2  2 -1 2]
        AttributeBegin
        AreaLightSource "diffuse" "rgb L" [6 5 4]
        Translate 0 1.5 -.5 Rotate 90 1 0 0 Shape "disk" "float radius" .7
        AttributeEnd
        NamedMaterial "{material}"
        AttributeBegin Translate -.6 -.3 0 Shape "sphere" "float radius" .6 AttributeEnd
        Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point3 P" [.1 -1 .1  .1 .6 .1  1.2 .6 -.3  1.2 -1 -.3] "point2 uv" [0 0 0 1 1 1 1 0]
        "#
    ))
}

/// Components that tilt normals, and that disperse light.
#[test]
fn integrators_agree_on_bumped_and_dispersive_components() {
    for name in ["both", "all"] {
        let scene = detailed(4, name);
        expect_integrators_agree(&scene, 32, 48, [3, 3], name);
    }
}

/// Paths through a component have a wavelength if they would have one through that material alone.
#[test]
fn a_mixture_of_one_dispersive_glass_is_that_glass() {
    expect_same_picture(&detailed(4, "clear"), &detailed(4, "glass"), 128, "clear");
}

#[test]
fn bits_do_not_depend_on_lanes_or_batches() {
    for scene in [room("", "NamedMaterial \"nested\""), detailed(4, "all")] {
        same_bits(&scene);
    }
}

fn same_bits(scene: &Scene) {
    for kind in BOTH {
        let settings = settings(scene, kind, 8);
        let bits = |settings: &Settings| {
            let pixels = run(scene, settings).pixels;
            pixels
                .iter()
                .flatten()
                .map(|v| v.to_bits())
                .collect::<Vec<_>>()
        };
        let first = bits(&settings);
        assert!(first.iter().any(|b| *b != 0));
        for (lanes, batch, threads) in [(Width::One, None, 1), (Width::Eight, Some(64), 2)] {
            let other = Settings {
                lanes,
                batch,
                threads,
                ..settings.clone()
            };
            assert!(bits(&other) == first, "{kind:?}, {lanes:?}, {batch:?}");
        }
    }
}
