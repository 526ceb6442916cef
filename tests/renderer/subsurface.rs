//! Light below surfaces: profiles against their integrals, pictures against f64 integrals of the
//! same model, and samplers against each other.

use crate::support;

use phalanx::integrate::{RenderError, Settings, Silent, render};
use phalanx::pbrt::load_str;
use phalanx::plan::{BELOW_BOUNCE, BELOW_RADIUS, Layout, Pair};
use phalanx::scene::{IntegratorKind, PathSamplerKind};
use phalanx::simd::Width;
use phalanx::surface::diffusion_table::{DiffusionTable, first_moment};
use phalanx::transport::World;
use std::f64::consts::{PI, TAU};
use support::dialect::to_v4;
use support::{Runs, head, run, scene, settings};

/// The part of a profile that is sampled.
const REACHED: f64 = 0.999;
/// Where tables end, in mean free paths.
const END: f64 = 202.85;
const OVER_PT: IntegratorKind = IntegratorKind::Pssmlt(PathSamplerKind::Pt);

/// The integral of a profile over a plane at a distance, in mean free paths, as far as `reach`.
fn over_plane(table: &DiffusionTable, albedo: f64, distance: f64, reach: f64) -> f64 {
    let row = table.between(albedo);
    let n = 20_000;
    // Even steps of the logarithm, from far below the first node on.
    let [low, high] = [1e-6f64.max(distance), reach].map(f64::ln);
    let step = (high - low) / f64::from(n);
    let at = |i: i32| (low + (f64::from(i) + 0.5) * step).exp();
    // `r dr` of the plane is `d dd` of the distance in space.
    (0..n)
        .map(|i| TAU * at(i).powi(2) * step * table.per_area(&row, at(i)))
        .sum()
}

#[test]
fn profiles_integrate_to_their_effective_albedos() {
    for (g, eta) in [(0.0, 1.33), (0.0, 1.0), (0.7, 1.5), (-0.5, 1.2)] {
        let table = DiffusionTable::new(g, eta);
        let mut last = -1.0;
        for i in 0..=20 {
            let albedo = f64::from(i) / 20.0;
            let row = table.between(albedo);
            let effective = table.effective_albedo(&row);
            assert!(effective > last, "{albedo}: {effective}");
            last = effective;
            let integral = over_plane(&table, albedo, 0.0, END);
            assert!(
                (integral - effective).abs() < 1e-4,
                "{integral} {effective}"
            );
            if i == 0 {
                continue;
            }
            let back = table.albedo_of(effective);
            assert!((back - albedo).abs() < 1e-6, "{albedo} {back}");
            for u in [0.0, 0.1, 0.5, 0.9, REACHED] {
                let within = over_plane(&table, albedo, 0.0, table.radius(&row, u).max(2e-6));
                assert!((within - u * effective).abs() < 1e-4, "{u}: {within}");
            }
        }
        assert_eq!(table.albedo_of(2.0), 1.0);
        assert_eq!(table.albedo_of(-1.0), 0.0);
    }
}

/// Figures that the formulas of pbrt-v3 gave where they were compiled by themselves, in `f32`.
#[test]
fn effective_albedos_are_those_of_pbrt() {
    let figures = [
        (0.0, 1.33, [0.211304, 0.654216, 0.936759, 1.019343]),
        (0.7, 1.5, [0.043078, 0.342241, 0.768835, 0.919357]),
    ];
    for (g, eta, expected) in figures {
        let table = DiffusionTable::new(g, eta);
        for (i, expected) in [22, 55, 88, 99].into_iter().zip(expected) {
            let albedo = (1.0 - (-8.0 * f64::from(i) / 99.0).exp()) / (1.0 - (-8.0f64).exp());
            let effective = table.effective_albedo(&table.between(albedo));
            assert!(
                (effective - expected).abs() < 2e-5,
                "{effective} {expected}"
            );
        }
    }
}

/// Fresnel reflectance at a cosine from outside.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let s = (cos - eta * t) / (cos + eta * t);
    let p = (eta * cos - t) / (eta * cos + t);
    0.5 * (s * s + p * p)
}

/// Light of a direction that comes out towards the camera, per irradiance.
fn exits(cos: f64, eta: f64) -> f64 {
    (1.0 - fresnel(cos, eta)) / (PI * (1.0 - 2.0 * first_moment(1.0 / eta)))
}

/// What comes out under a white sky.
fn under_the_sky(eta: f64) -> f64 {
    let n = 10_000;
    let cos = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
    let sum: f64 = (0..n).map(|i| cos(i) * exits(cos(i), eta)).sum();
    TAU * sum / f64::from(n)
}

/// A camera of parallel rays above the origin sees `[-w, w]` by `[-h, h]` of a plane.
fn from_above(width: u32, height: u32, [w, h]: [f64; 2]) -> String {
    let camera = format!(
        "LookAt 0 0 20  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [{} {w} {} {h}]",
        -w, -h
    );
    head(width, height, 1, &camera).replace("\"mlt\"", "\"path\"")
}

fn plane(z: f64) -> String {
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" \
         [-900 -900 {z} 900 -900 {z} 900 900 {z} -900 900 {z}]\n"
    )
}

/// Slabs under a white sky, thick ones and one as thin as a mean free path, whose probes meet both
/// sides of it. What is said to reflect `Kd` does so, but for the interface.
#[test]
fn slabs_reflect_what_the_model_says() {
    let media = |albedo: [f64; 3]| {
        let rgb = |f: &dyn Fn(f64) -> f64| albedo.map(f).map(|v| v.to_string()).join(" ");
        format!(
            "\"subsurface\" \"rgb sigma_a\" [{}] \"rgb sigma_s\" [{}] \"float scale\" 0.5",
            rgb(&|a| 2.0 * (1.0 - a)),
            rgb(&|a| 2.0 * a)
        )
    };
    let kd = [0.2, 0.5, 0.8];
    let by_kd = "\"kdsubsurface\" \"rgb Kd\" [.2 .5 .8] \"rgb mfp\" [2 2 2] \"float scale\" 0.5";
    let plain = DiffusionTable::new(0.0, 1.0);
    let back = kd.map(|kd| plain.albedo_of(kd));
    let inverted = DiffusionTable::new(0.0, 1.4);
    let back_inverted = kd.map(|kd| inverted.albedo_of(kd));
    for (material, eta, albedo, thickness) in [
        (by_kd.to_owned(), 1.0, back, None),
        (by_kd.to_owned(), 1.4, back_inverted, None),
        (media([0.5, 0.9, 1.0]), 1.33, [0.5, 0.9, 1.0], None),
        (media([0.5, 0.9, 1.0]), 1.33, [0.5, 0.9, 1.0], Some(1.0)),
    ] {
        let other = thickness.map_or(String::new(), |z: f64| {
            format!("ReverseOrientation\n{}", plane(-z))
        });
        let text = from_above(4, 4, [1.0; 2])
            + &format!(
                "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial {material} \"float eta\" {eta}\n{}{other}WorldEnd\n",
                plane(0.0)
            );
        let scene = scene(&text);
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 512), 12);
        let table = DiffusionTable::new(0.0, eta);
        let reach = albedo.map(|a| table.reach(&table.between(a)));
        let reach = reach.into_iter().fold(0.0, f64::max);
        let r = fresnel(1.0, eta);
        for c in 0..3 {
            let mut below = over_plane(&table, albedo[c], 0.0, reach);
            below += thickness.map_or(0.0, |z| over_plane(&table, albedo[c], z, reach));
            let truth = r + (1.0 - r) * below * under_the_sky(eta);
            runs.whole(c)
                .expect(truth, &format!("{material}, channel {c}"));
            if eta == 1.0 {
                // But for the fit of the moment at 1, and the part that is cut off.
                assert!((truth / kd[c] - 1.0).abs() < 0.006, "{truth}");
            }
        }
    }
}

/// The points of a sphere within a distance of one of them have the area that they have in a plane:
/// under a white sky it is as bright as a slab whose light is cut off at its diameter.
#[test]
fn spheres_reflect_what_the_model_says() {
    const ETA: f64 = 1.4;
    let albedo = [0.5, 0.9, 0.999];
    for (radius, instances) in [(0.4, false), (1.5, true)] {
        let sphere = format!("Shape \"sphere\" \"float radius\" {radius}\n");
        let body = match instances {
            true => format!(
                "ObjectBegin \"body\"\n{sphere}Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [90 0 0 90 1 0 91 0 0]\nObjectEnd\n\
                 ObjectInstance \"body\" AttributeBegin Translate 50 0 0 ObjectInstance \"body\" AttributeEnd\n"
            ),
            false => sphere,
        };
        let text = from_above(2, 2, [0.01; 2])
            + &format!(
                "LightSource \"infinite\" \"rgb L\" [1 1 1]\n\
                 Material \"subsurface\" \"rgb sigma_a\" [.5 .1 .001] \"rgb sigma_s\" [.5 .9 .999] \"float eta\" {ETA}\n{body}WorldEnd\n"
            );
        let scene = scene(&text);
        let runs = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 8192), 12);
        let table = DiffusionTable::new(0.0, f64::from(ETA as f32));
        let reach = albedo.map(|a| table.reach(&table.between(a)));
        let reach = reach.into_iter().fold(0.0, f64::max).min(2.0 * radius);
        let r = fresnel(1.0, ETA);
        for (c, albedo) in albedo.into_iter().enumerate() {
            let below = over_plane(&table, albedo, 0.0, reach);
            let truth = r + (1.0 - r) * below * under_the_sky(ETA);
            let what = format!("sphere {radius}, channel {c}");
            runs.whole(c).expect_among(6, truth, &what);
        }
    }
}

/// A spot in the middle of a slab: the light around it falls off as the profile does.
#[test]
fn light_around_a_beam_falls_off_by_the_profile() {
    const ETA: f64 = 1.3;
    const PIXELS: usize = 8;
    let text = from_above(PIXELS as u32, 1, [4.0, 0.5])
        + "LightSource \"spot\" \"rgb I\" [9 9 9] \"point from\" [0 0 1] \"point to\" [0 0 0]
           \"float coneangle\" 26.565051 \"float conedeltaangle\" 0.01
           Material \"subsurface\" \"rgb sigma_a\" [.5 .1 .02] \"rgb sigma_s\" [.5 .9 1.2] \"float eta\" 1.3 \"float g\" 0.2\n"
        + &plane(0.0)
        + "WorldEnd\n";
    let scene = scene(&text);
    let settings = settings(&scene, IntegratorKind::Pt, 4096);
    let runs = Runs::new(&scene, &settings, 12);
    let table = DiffusionTable::new(f64::from(0.2f32), f64::from(1.3f32));
    for (c, [a, s]) in [[0.5, 0.5], [0.1, 0.9], [0.02, 1.2]]
        .into_iter()
        .enumerate()
    {
        let (extinction, row) = (a + s, table.between(s / (a + s)));
        let lit = |x: f64, y: f64| {
            let (n, mut sum) = (40, 0.0);
            for i in 0..n * n {
                let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
                let (r, phi) = (0.5 * at(i % n), TAU * at(i / n));
                let d2 = 1.0 + r * r;
                let cos = 1.0 / d2.sqrt();
                let irradiance = 9.0 * cos / d2;
                let distance = (x - r * phi.cos()).hypot(y - r * phi.sin());
                let profile = table.per_area(&row, distance * extinction) * extinction.powi(2);
                sum += r * irradiance * exits(cos, ETA) * profile;
            }
            sum * 0.5 * TAU / f64::from(n * n)
        };
        for pixel in 0..PIXELS {
            let (n, mut mean) = (16, 0.0);
            for i in 0..n * n {
                let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
                mean += lit(pixel as f64 - 4.0 + at(i % n), at(i / n) - 0.5) / f64::from(n * n);
            }
            let truth = (1.0 - fresnel(1.0, ETA)) * mean;
            let region = [pixel as u32, pixel as u32 + 1, 0, 1];
            let what = format!("pixel {pixel}, channel {c}");
            runs.region(region, c)
                .expect_among(3 * PIXELS, truth, &what);
        }
    }
}

/// Spheres and a textured box in a room with a lamp, one of them an object that is seen twice.
fn shelf(width: u32, height: u32, depth: u32) -> String {
    head(
        width,
        height,
        depth,
        "LookAt 0 -5 2  0 0 .6  0 0 1\nCamera \"perspective\" \"float fov\" [38]",
    ) + "LightSource \"infinite\" \"rgb L\" [.2 .2 .3]
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [20 18 15] Translate 1 2 3 Shape \"sphere\" \"float radius\" .4 AttributeEnd
         Material \"matte\" \"rgb Kd\" [.6 .6 .6]
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-6 -6 0 6 -6 0 6 6 0 -6 6 0]
         Texture \"checks\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.8 .5 .3] \"rgb tex2\" [.2 .5 .7] \"float uscale\" 4 \"float vscale\" 4
         Material \"kdsubsurface\" \"texture Kd\" \"checks\" \"rgb mfp\" [.2 .1 .05] \"float uroughness\" .3 \"float vroughness\" .3
         AttributeBegin Translate -1 0 .6 Shape \"sphere\" \"float radius\" .6 AttributeEnd
         Material \"subsurface\" \"rgb sigma_a\" [.1 .2 .6] \"rgb sigma_s\" [8 9 10]
         AttributeBegin Translate .9 0 .5 Shape \"sphere\" \"float radius\" .5 AttributeEnd
         AttributeBegin Translate .9 .2 1.2 Shape \"sphere\" \"float radius\" .3 AttributeEnd\nWorldEnd\n"
}

#[test]
fn chains_make_the_path_tracers_picture() {
    let scene = scene(&shelf(16, 12, 4));
    let [pt, chains] = [(IntegratorKind::Pt, 48), (OVER_PT, 48)].map(|(kind, effort)| {
        let runs = Runs::new(&scene, &settings(&scene, kind, effort), 16);
        runs.show(&format!("subsurface-{kind:?}"));
        runs
    });
    for (i, (a, b)) in chains.grid(4, 3).iter().zip(pt.grid(4, 3)).enumerate() {
        let what = format!("region {}, channel {}", i / 3, i % 3);
        a.expect_same_among(36, &b, &what);
    }
}

/// In fog that is next to nothing a scene is what it is without.
#[test]
fn thin_fog_changes_nothing() {
    let clear = shelf(12, 9, 3);
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \
               \"rgb sigma_s\" [1e-7 1e-7 1e-7]\nMediumInterface \"\" \"fog\"\nLookAt";
    let foggy = clear.replacen("LookAt", fog, 1);
    let [clear, foggy] = [clear, foggy].map(|text| {
        let scene = scene(&text);
        Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 48), 12)
    });
    for (i, (a, b)) in foggy.grid(2, 2).iter().zip(clear.grid(2, 2)).enumerate() {
        let what = format!("region {}, channel {}", i / 3, i % 3);
        a.expect_same_among(12, &b, &what);
    }
}

#[test]
fn lanes_and_textures_change_no_bit() {
    let text = shelf(16, 12, 5);
    for kind in [IntegratorKind::Pt, OVER_PT] {
        let pictures = |text: &str| {
            let scene = scene(text);
            [Width::One, Width::Eight].map(|lanes| {
                let settings = Settings {
                    lanes,
                    ..settings(&scene, kind, 8)
                };
                run(&scene, &settings).pixels
            })
        };
        let [one, eight] = pictures(&text);
        assert!(one == eight, "{kind:?}");
        // What differs from hit to hit and what does not are found in two ways.
        let even = text.replace("[.2 .5 .7]", "[.8 .5 .3]");
        let constant = even.replace("\"texture Kd\" \"checks\"", "\"rgb Kd\" [.8 .5 .3]");
        assert_ne!(even, text);
        assert_ne!(constant, even);
        let [a, b] = [even, constant].map(|text| pictures(&text));
        assert!(a == b, "{kind:?}");
        assert!(a[0] != one, "{kind:?}");
    }
}

/// Both dialects describe one material, and the same picture.
#[test]
fn dialects_agree() {
    let text = from_above(4, 4, [1.0; 2])
        + "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial \"subsurface\" \"string name\" \"Skin1\" \"float scale\" 2\n"
        + &plane(0.0)
        + "WorldEnd\n";
    let v3 = scene(&text);
    let v4 = scene(&to_v4(&text));
    let [a, b] = [&v3, &v4].map(|scene| {
        let settings = settings(scene, IntegratorKind::Pt, 4);
        run(scene, &settings).pixels
    });
    assert!(a == b);
    assert!(a[0][0] > a[0][2] && a[0][2] > 0.0, "{:?}", a[0]);
}

/// Primary samples of light below surfaces are spread two by two, each dimension once.
#[test]
fn samples_are_paired() {
    let scene = scene(&shelf(4, 4, 3));
    let layout = Layout::unidirectional(&World::new(&scene, 3).plan, 3);
    let pairs = layout.pairs();
    let mut all: Vec<usize> = (pairs.iter())
        .flat_map(|pair| [Some(pair.first), pair.second])
        .flatten()
        .collect();
    all.sort_unstable();
    assert_eq!(all, Vec::from_iter(0..layout.total));
    for vertex in 0..3 {
        let at = layout.below + vertex * layout.strides.below;
        for first in [BELOW_RADIUS, BELOW_BOUNCE, layout.below_point()] {
            let (first, second) = (at + first, Some(at + first + 1));
            assert!(pairs.contains(&Pair { first, second }));
        }
    }
}

#[test]
fn integrators_that_cannot_are_replaced() {
    let with = |integrator: &str| {
        let text = shelf(4, 4, 2);
        let from = text.find("Integrator").expect("an integrator");
        let to = from + text[from..].find('\n').expect("its end");
        format!("{}{integrator}{}", &text[..from], &text[to..])
    };
    for (name, kind) in [
        ("path", IntegratorKind::Pt),
        ("volpath", IntegratorKind::Pt),
        ("bdpt", IntegratorKind::Pt),
        ("mlt", OVER_PT),
        ("", IntegratorKind::Pt),
    ] {
        let line = match name {
            "" => String::new(),
            name => format!("Integrator \"{name}\""),
        };
        let scene = load_str(&with(&line), "wax.pbrt", ".".as_ref()).expect("a scene");
        assert_eq!(scene.integrator.kind, kind, "{name}");
        let replaced = matches!(name, "bdpt" | "mlt");
        assert_eq!(
            scene.warnings.len(),
            usize::from(replaced),
            "{:?}",
            scene.warnings
        );
        assert!(scene.warnings.iter().all(|w| w.contains("subsurface")));
        for kind in [
            IntegratorKind::Bdpt,
            IntegratorKind::Mmlt,
            IntegratorKind::Auto,
        ] {
            let error = render(&scene, &settings(&scene, kind, 1), &Silent);
            assert!(
                matches!(error, Err(RenderError::Settings(why)) if why.contains("pssmlt over pt"))
            );
        }
    }
}

#[test]
fn mistakes_say_where_they_are() {
    for (material, expected) in [
        ("\"subsurface\" \"float eta\" 0.5", "\"eta\""),
        ("\"kdsubsurface\" \"float g\" 2", "\"g\""),
        (
            "\"mix\" \"string namedmaterial1\" \"m\" \"string namedmaterial2\" \"m\"",
            "within a mixture",
        ),
    ] {
        let text = head(4, 4, 2, "Camera \"perspective\"")
            + &format!(
                "MakeNamedMaterial \"m\" \"string type\" \"subsurface\"\nMaterial {material}\nShape \"sphere\"\nWorldEnd\n"
            );
        let error = load_str(&text, "t.pbrt", ".".as_ref())
            .expect_err("an error")
            .to_string();
        assert!(
            error.starts_with("t.pbrt:7:") && error.contains(expected),
            "{error}"
        );
    }
    let text = head(4, 4, 2, "Camera \"perspective\"")
        + "Material \"subsurface\" \"string name\" \"Wax\"\nShape \"sphere\"\nWorldEnd\n";
    let scene = scene(&text);
    assert!(
        scene.warnings[0].contains("no medium named \"Wax\""),
        "{:?}",
        scene.warnings
    );
    let error = load_str(&to_v4(&text), "t.pbrt", ".".as_ref()).expect_err("an error");
    assert!(
        error.to_string().contains("no medium named \"Wax\""),
        "{error}"
    );
}
