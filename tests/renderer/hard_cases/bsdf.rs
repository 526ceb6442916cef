//! Rows 7, 8, 23, 24, 30 and 37: surfaces.
//!
//! `tests/renderer/scenes_hard.rs` has smooth meshes and floors under glass by both integrators
//! (rows 7 and 8), `tests/renderer/analytic.rs` furnaces of every material and glass slabs before
//! an emitter (rows 8 and 30), `tests/renderer/bsdf.rs` sampling against densities, values against
//! `f64` and albedos at every roughness (row 23), and the Fresnel equations of metals.

use super::COMPARISONS;
use super::dialect::to_v4;
use crate::common::bsdf::{Kernels, shaken};
use crate::common::stats::{Mean, Random};
use crate::support::stage::{CAMERA, lamp};
use crate::support::{Estimate, Runs, head, inward_box, run, scene, settings, standard_errors};
use phalanx::replay::bsdf;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::simd::{Lanes, f32x8};
use phalanx::surface::microfacet::pack_alphas;
use phalanx::surface::{Kind, Mode, fresnel};
use phalanx::transport::sides::adjoint_cosine;

const EPSILON: f64 = f32::EPSILON as f64;

/// Row 7: shading normals from the light's side. Where the light grazes the true surface the
/// adjoint correction divides by a cosine of 0: nothing is reflected there.
#[test]
fn adjoint_corrections_are_finite() {
    for wo_ng in [0.0f32, -0.0] {
        for wi_ng in [0.0, 1e-30, 0.5, 1.0] {
            for wo_ns in [0.0, 0.5, 1.0] {
                assert_eq!(adjoint_cosine(wi_ng, wo_ns, wo_ng), 0.0);
                let wide = |x: f32| f32x8::splat(x);
                assert_eq!(
                    adjoint_cosine(wide(wi_ng), wide(wo_ns), wide(wo_ng)).lane(5),
                    0.0
                );
            }
        }
    }
    // Of a surface that is what it seems, it is the cosine.
    for c in [1e-7f32, 0.1, 0.7, 1.0] {
        assert!((adjoint_cosine(0.3, c, c) - 0.3).abs() < 1e-7);
    }
}

/// A floor of albedo 0.7 whose normals are tilted by `degrees`, seen from where it should look like
/// any other; `v4` says the dialect.
fn tilted_floor(v4: bool, degrees: f64, depth: u32, light: &str) -> Scene {
    let view = "LookAt 0 -5 3  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" [10]";
    let (sin, cos) = degrees.to_radians().sin_cos();
    let normals = format!("0 {sin} {cos} ").repeat(4);
    let text = head(4, 4, depth, view)
        + light
        + "Material \"matte\" \"rgb Kd\" [.7 .7 .7]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 0 9 -9 0 9 9 0 -9 9 0]\n"
        + &format!("\"normal N\" [{normals}]\n");
    scene(&if v4 { to_v4(&text) } else { text })
}

const FOUR: [IntegratorKind; 4] = [
    IntegratorKind::Pt,
    IntegratorKind::Lt,
    IntegratorKind::Bdpt,
    IntegratorKind::Mmlt,
];

/// Rows 7 and 37: normals at right angles to the face, and facing away. A Lambertian surface under
/// the same sky everywhere is as bright as its albedo, wherever its shading normal points: in v3
/// light comes from the upper side of the face, in v4 from the side of the shading normal that the
/// eye is on.
#[test]
fn skies_over_floors_of_any_normal() {
    for v4 in [false, true] {
        for degrees in [0.0, 25.0, 60.0, 90.0, 120.0, 175.0] {
            let sky = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
            let scene = tilted_floor(v4, degrees, 1, sky);
            for kind in FOUR {
                let runs = Runs::new(&scene, &settings(&scene, kind, 256), 16);
                let what = format!("v4 {v4}, {degrees} degrees, {kind:?}");
                runs.whole(1).expect_among(COMPARISONS, 0.7, &what);
            }
        }
    }
}

/// The same under suns above and below the floor.
#[test]
fn suns_over_floors_of_any_normal() {
    for v4 in [false, true] {
        for degrees in [0.0, 25.0, 60.0, 89.0, 120.0, 175.0f64] {
            for sun in [[0.3f64, 0.2, 0.9], [-0.2, -0.6, 0.4], [0.1, 0.4, -0.5]] {
                let [x, y, z] = sun;
                let light = format!(
                    "LightSource \"distant\" \"point from\" [{x} {y} {z}] \"point to\" [0 0 0] \"rgb L\" [1 1 1]\n"
                );
                let scene = tilted_floor(v4, degrees, 1, &light);
                let (sin, cos) = degrees.to_radians().sin_cos();
                let against = |[_, y, z]: [f64; 3]| y * sin + z * cos;
                let seen = if v4 {
                    against([0.0, -5.0, 3.0]) * against(sun) > 0.0
                } else {
                    z > 0.0
                };
                let length = (x * x + y * y + z * z).sqrt();
                let lit = 0.7 / std::f64::consts::PI * against(sun).abs() / length;
                let truth = if seen { lit } else { 0.0 };
                for kind in FOUR {
                    let runs = Runs::new(&scene, &settings(&scene, kind, 128), 8);
                    let what = format!("v4 {v4}, {degrees} degrees, {sun:?}, {kind:?}");
                    runs.whole(1).expect_among(COMPARISONS, truth, &what);
                }
            }
        }
    }
}

/// v3's plastic from behind reflects as glass does from outside, where from the front it reflects
/// as glass from inside.
#[test]
fn plastic_from_behind() {
    let gloss = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.25, 0.25];
    let glass = |eta: f32| [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, eta, pack_alphas(0.25, 0.25)];
    let mut random = Random(37);
    for _ in 0..200 {
        let [o, i] = [0, 1].map(|_| random.direction().map(|x| x as f32));
        let up = |w: [f32; 3]| [w[0], w[1], w[2].abs().max(0.01)];
        let down = |w: [f32; 3]| [w[0], w[1], -up(w)[2]];
        let value = |kind, row: &[f32; 8], o, i| {
            Kernels::eval::<f32>(kind, row, &[o], &[i], Mode::Radiance)[0].0[1]
        };
        let front = value(Kind::Plastic, &gloss, up(o), up(i));
        let back = value(Kind::Plastic, &gloss, down(o), down(i));
        let inner = value(Kind::RoughDielectric, &glass(1.0 / 1.5), up(o), up(i));
        let outer = value(Kind::RoughDielectric, &glass(1.5), up(o), up(i));
        assert!(
            (front - inner).abs() <= 1e-3 * inner,
            "{front} is not {inner}"
        );
        assert!(
            (back - outer).abs() <= 1e-3 * outer,
            "{back} is not {outer}"
        );
    }
}

/// pbrt-v3's `plastic` in `f64`, as its source has it: what the glossy lobe of `Ks` 1 reflects of a
/// sky of 1 at this cosine, by its half vectors. From the front the boundary leads from 1.5 to 1,
/// from behind from 1 to 1.5.
fn v3_gloss(cos: f64, roughness: f64, front: bool) -> f64 {
    let x = roughness.ln();
    let alpha = 1.62142 + x * (0.819_955 + x * (0.1734 + x * (0.017_120_1 + x * 0.000_640_711)));
    let [from, to] = if front { [1.5, 1.0] } else { [1.0, 1.5] };
    let fresnel = |c: f64| {
        let s = from / to * (1.0 - c * c).max(0.0).sqrt();
        let t = (1.0 - s * s).max(0.0).sqrt();
        let [p, q] = [
            (to * c - from * t) / (to * c + from * t),
            (from * c - to * t) / (from * c + to * t),
        ];
        if s >= 1.0 { 1.0 } else { 0.5 * (p * p + q * q) }
    };
    // 1 + 2 Lambda.
    let slope = |z: f64| (1.0 + alpha * alpha * (1.0 / (z * z) - 1.0)).sqrt();
    let sin = (1.0 - cos * cos).sqrt();
    let (across, around) = (120, 64);
    let mut sum = 0.0;
    for i in 0..across {
        // Uniform over the projected distribution, but finer at its ends.
        let t = (f64::from(i) + 0.5) / f64::from(across);
        let (u, weight) = (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t));
        let z = (1.0 + alpha * alpha * u / (1.0 - u)).sqrt().recip();
        let r = (1.0 - z * z).sqrt();
        for j in 0..around {
            let phi = std::f64::consts::PI * (f64::from(j) + 0.5) / f64::from(around);
            let along = sin * r * phi.cos() + cos * z;
            let wi = 2.0 * along * z - cos;
            if along > 0.0 && wi > 0.0 {
                let masking = 2.0 / (slope(cos) + slope(wi));
                sum += weight * fresnel(along) * masking * along / (cos * z);
            }
        }
    }
    sum / f64::from(across * around)
}

/// v3's plastic under a sky: the exact mean of a picture of a wide plane, from behind and from the
/// front.
#[test]
fn plastic_reflects_as_much_as_the_integral() {
    let (kd, ks, roughness, n) = (0.1, 0.7, 0.1, 24);
    let view = "LookAt 1 3 6  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [35]";
    let half = 17.5f64.to_radians().tan();
    let forward = -glam::DVec3::new(1.0, 3.0, 6.0).normalize();
    let right = forward.cross(glam::DVec3::Y).normalize();
    let up = right.cross(forward);
    for (front, indices, known) in [
        (false, "0 1 2 0 2 3", 0.1393),
        (true, "0 2 1 0 3 2", 0.4477),
    ] {
        let mut truth = 0.0;
        for i in 0..n * n {
            let place = |i: i32| half * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0);
            let d = forward + place(i % n) * right + place(i / n) * up;
            let share = v3_gloss(-d.normalize().y, roughness, front);
            truth += (kd + ks * share) / f64::from(n * n);
        }
        assert!((truth / known - 1.0).abs() < 1e-3, "{truth}");
        let scene = scene(
            &(head(16, 16, 5, view)
                + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
                + &format!(
                    "Material \"plastic\" \"rgb Kd\" [{kd} {kd} {kd}]\n\
                     \"rgb Ks\" [{ks} {ks} {ks}] \"float roughness\" [{roughness}]\n\
                     Shape \"trianglemesh\" \"integer indices\" [{indices}]\n\
                     \"point P\" [-900 0 -900 900 0 -900 900 0 900 -900 0 900]\n"
                )),
        );
        for kind in [IntegratorKind::Pt, IntegratorKind::Mmlt] {
            let runs = Runs::new(&scene, &settings(&scene, kind, 128), 12);
            let what = format!("front {front}, {kind:?}");
            runs.whole(1).expect_among(COMPARISONS, truth, &what);
        }
    }
}

/// Row 8: radiance is scaled by the square of the index at a boundary, importance is not.
#[test]
fn radiance_is_compressed_in_glass_and_importance_is_not() {
    for eta in [0.7f32, 1.0, 1.5, 3.0] {
        let row = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, eta, 0.0];
        for (side, ratio) in [(1.0, eta), (-1.0, 1.0 / eta)] {
            let wo = [0.1, 0.2, side * (1.0f32 - 0.05).sqrt()];
            // The last number chooses refraction.
            let u = [0.5, 0.5, 1.0 - f32::EPSILON];
            let [radiance, importance] = [Mode::Radiance, Mode::Importance].map(|mode| {
                Kernels::sample::<f32>(Kind::SmoothDielectric, &row, &[wo], &[u], mode)[0]
            });
            assert!(radiance.0[2] * side < 0.0, "eta {eta}: not refracted");
            assert_eq!(radiance.0, importance.0);
            let got = importance.1[1] / radiance.1[1];
            assert!(
                (got / (ratio * ratio) - 1.0).abs() < 1e-6,
                "eta {eta}: {got}"
            );
        }
    }
}

/// Mean weight of reflections, and its error.
fn albedo(kind: Kind, row: &[f32; 8], cos: f64, n: usize) -> Mean {
    let mut random = Random(23);
    let wo = [(1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32];
    let u: Vec<[f32; 3]> = (0..n)
        .map(|_| std::array::from_fn(|_| random.uniform()))
        .collect();
    let mut mean = Mean::default();
    for (_, weight, ..) in Kernels::sample::<f32x8>(kind, row, &vec![wo; n], &u, Mode::Radiance) {
        assert!(weight.iter().all(|w| w.is_finite() && *w >= 0.0));
        mean.add(f64::from(weight[0]));
    }
    mean
}

/// Row 23: roughness from 0 up. As a metal gets smooth its albedo goes to that of the mirror, at
/// every angle and in steps that the roughness bounds; below the least roughness it is one. It
/// never reflects more than it receives.
#[test]
fn metals_become_mirrors() {
    let n = 40_000;
    let metal = |alpha: f32| [0.2, 0.9, 1.4, 3.9, 2.4, 2.1, alpha, alpha];
    for cos in [1.0, 0.7, 0.3, 0.1, 0.02] {
        let mirror = albedo(Kind::SmoothConductor, &metal(0.0), cos, 1).mean();
        let mut last = mirror;
        let mut before = 0.0f32;
        for alpha in [
            1e-3f32, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0,
        ] {
            let got = albedo(Kind::RoughConductor, &metal(alpha), cos, n);
            let reach = standard_errors(COMPARISONS, 1e4) * got.error();
            assert!(got.mean() <= 1.0 + reach + 1e-5, "{alpha} {cos}");
            // A lobe of this width loses what goes below the horizon: continuous, with a slope of
            // the order of 1 / cos.
            let step = 2.0 * f64::from(alpha - before) * (1.0 + 0.2 / cos);
            assert!(
                (got.mean() - last).abs() <= step + reach + 1e-5,
                "alpha {alpha}, cos {cos}: {} after {last}",
                got.mean()
            );
            (last, before) = (got.mean(), alpha);
        }
    }
}

/// Row 23: a material's roughness from 0 to 1 in a scene: the picture changes little from step to
/// step around the least roughness, where rough turns to smooth, and stays finite below.
#[test]
fn roughness_is_continuous_where_rough_turns_smooth() {
    let ball = |alpha: f64| {
        let text = head(12, 9, 3, CAMERA)
            + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
            + &format!(
                "Material \"metal\" \"float roughness\" [{alpha}] \"bool remaproughness\" \"false\"\n"
            )
            + "AttributeBegin\nTranslate 0 .8 0\nShape \"sphere\" \"float radius\" [1.2]\nAttributeEnd\n";
        let scene = scene(&text);
        Runs::new(&scene, &settings(&scene, IntegratorKind::Mmlt, 128), 24).whole(1)
    };
    let smooth = ball(0.0);
    for alpha in [1e-30, 1e-6, 0.9e-3, 1.1e-3, 2e-3] {
        let mut rough = ball(alpha);
        // The sky is the same everywhere: only what a lobe loses below the horizon differs, a part
        // of its width.
        rough.error = rough.error.hypot(alpha * smooth.mean / 6.0);
        rough.expect_same_among(COMPARISONS, &smooth, &format!("roughness {alpha}"));
    }
}

/// Row 24: extreme indices, total reflection, the critical angle: against `f64`.
#[test]
fn fresnel_of_dielectrics() {
    let floor = 8.0 * EPSILON;
    for step in 0..=360 {
        let eta = 0.4 + 0.01 * f64::from(step);
        // 1 itself and its neighbours too.
        for eta in [
            eta as f32,
            if step == 60 { 1.0 } else { eta as f32 },
            1.0001,
            0.9999,
        ] {
            let eta64 = f64::from(eta);
            let critical = (1.0 - eta64 * eta64).max(0.0).sqrt();
            let sweep = (0..=100).map(|i| f64::from(i) / 100.0);
            let near = [1e-3, 1e-5, 1e-6, 1e-7];
            let close = near
                .iter()
                .flat_map(|d| [critical - d, critical + d, *d, 1.0 - d]);
            for c in sweep.chain(close).filter(|c| (0.0..=1.0).contains(c)) {
                let c = c as f32;
                let got = fresnel::dielectric::<f32>(c, eta);
                let (want, cos_t) = bsdf::dielectric(c.into(), eta64);
                let slack = shaken(|x| bsdf::dielectric(x, eta64).0, c.into());
                assert!(
                    (f64::from(got.reflectance) - want).abs() <= slack + floor,
                    "eta {eta}, cos {c}: {} is {want}",
                    got.reflectance
                );
                assert!((0.0..=1.0).contains(&got.reflectance));
                // cos_t^2 is right to ulps, whatever its root is.
                let square = f64::from(got.cos_t).powi(2) - cos_t * cos_t;
                let scale = 1.0 + (1.0 / eta64).powi(2);
                assert!(
                    square.abs() <= floor * scale,
                    "eta {eta}, cos {c}: {}",
                    got.cos_t
                );
            }
        }
    }
}

/// Row 24: glass of index 1 is not there, and of an index of 1.0001 nearly not, whatever the angle.
#[test]
fn glass_of_index_1_is_invisible() {
    let render = |glass: &str| {
        let pane = if glass.is_empty() {
            String::new()
        } else {
            format!(
                "AttributeBegin\nMaterial \"glass\" \"float eta\" [{glass}]\nReverseOrientation\n"
            ) + &inward_box([-1.5, 1.5, 0.1, 1.6, 1.2, 2.0])
                + "AttributeEnd\n"
        };
        let lights = "LightSource \"infinite\" \"rgb L\" [.2 .3 .5]\n";
        // Two events more, for the pane.
        let depth = if pane.is_empty() { 0 } else { 2 };
        let scene = scene(&(head(12, 9, depth, CAMERA) + lights + &lamp("[8 8 8]") + &pane));
        Runs::new(&scene, &settings(&scene, IntegratorKind::Mmlt, 128), 24)
    };
    let nothing = render("");
    for eta in ["1", "1.0001", "0.9999"] {
        let glass = render(eta);
        for (i, (a, b)) in glass.grid(2, 2).iter().zip(nothing.grid(2, 2)).enumerate() {
            a.expect_same_among(COMPARISONS, &b, &format!("index {eta}, part {i}"));
        }
    }
}

/// Row 30: energy, depth by depth. In a closed box whose walls emit 1, what is scattered `k` times
/// is the albedo to the `k`: nothing is lost in any depth that another makes up for.
/// `tests/renderer/analytic.rs` has whole pictures of all materials.
#[test]
fn furnaces_depth_by_depth() {
    let white = [
        ("\"matte\" \"rgb Kd\" [1 1 1]", 1.0),
        ("\"matte\" \"rgb Kd\" [.5 .5 .5]", 0.5),
        ("\"mirror\" \"rgb Kr\" [1 1 1]", 1.0),
        ("\"plastic\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [0 0 0]", 0.5),
    ];
    for (material, albedo) in white {
        let view = "LookAt 0 0 0  1 .2 .3  0 1 0\nCamera \"perspective\" \"float fov\" [60]";
        let text = head(8, 8, 5, view)
            + &format!("AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\nMaterial {material}\n")
            + &inward_box([-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]);
        let scene = scene(&text);
        let settings = settings(&scene, IntegratorKind::Mmlt, 64);
        let mut depths = vec![vec![]; 6];
        for seed in 1..=24 {
            let render = run(
                &scene,
                &phalanx::integrate::Settings {
                    seed,
                    ..settings.clone()
                },
            );
            for d in &render.stats.depths {
                depths[d.depth.unwrap() as usize].push(d.b);
            }
        }
        for (k, b) in depths.iter().enumerate() {
            let truth = f64::powi(albedo, k as i32);
            Estimate::of(b).expect_among(COMPARISONS, truth, &format!("{material}, depth {k}"));
        }
    }
}
