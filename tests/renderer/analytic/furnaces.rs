//! Bodies under a white sky: what each material reflects and lets through, by quadrature.

use super::{both, expect_uniform};
use crate::support;
use crate::support::dialect::to_v4;
use crate::support::{Estimate, head};
use std::f64::consts::PI;

/// Fresnel reflectance of a dielectric (index inside over outside) at a cosine.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let sin2 = (1.0 - cos * cos) / (eta * eta);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin2).sqrt();
    let s = (cos - eta * t) / (cos + eta * t);
    let p = (eta * cos - t) / (eta * cos + t);
    0.5 * (s * s + p * p)
}

/// Fresnel reflectance of a conductor `eta + i k` at a cosine, by complex arithmetic written out
/// (Born and Wolf, section 14.2).
fn fresnel_conductor(cos: f64, eta: f64, k: f64) -> f64 {
    let (c2, s2) = (cos * cos, 1.0 - cos * cos);
    let t0 = eta * eta - k * k - s2;
    let a2b2 = (t0 * t0 + 4.0 * eta * eta * k * k).sqrt();
    let a = (0.5 * (a2b2 + t0)).max(0.0).sqrt();
    let rs = (a2b2 + c2 - 2.0 * a * cos) / (a2b2 + c2 + 2.0 * a * cos);
    let t = c2 * a2b2 + s2 * s2;
    let rp = rs * (t - 2.0 * a * cos * s2) / (t + 2.0 * a * cos * s2);
    0.5 * (rs + rp)
}

/// The mean over a square picture of a function of the cosine at which the camera of
/// [`under_a_sky`] meets its unit sphere.
fn mean_over_sphere(f: impl Fn(f64) -> f64) -> f64 {
    let n = 600;
    let half = (HALF_FOV * PI / 180.0).tan();
    let mut sum = 0.0;
    for j in 0..n {
        for i in 0..n {
            let at = |k: i32| half * (2.0 * (f64::from(k) + 0.5) / f64::from(n) - 1.0);
            let (x, y) = (at(i), at(j));
            let length = (x * x + y * y + 1.0).sqrt();
            // From 5 away, the ray passes the centre at distance 5 sin(angle).
            let sin2 = 25.0 * (x * x + y * y) / (length * length);
            sum += f((1.0 - sin2).sqrt());
        }
    }
    sum / f64::from(n * n)
}

const HALF_FOV: f64 = 7.0;

/// A sphere of some material fills the picture, the sky around it is 1.
fn under_a_sky(material: &str, depth: u32) -> String {
    let camera = format!(
        "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [{}]",
        2.0 * HALF_FOV
    );
    head(10, 10, depth, &camera)
        + &format!(
            "LightSource \"infinite\" \"rgb L\" [1 1 1]\nMaterial {material}\nShape \"sphere\" \"float radius\" [1]\n"
        )
}

/// Nothing is lost in a white furnace but what Fresnel's equations and the largest depth say.
#[test]
fn white_furnace_of_smooth_materials() {
    both(
        &under_a_sky("\"mirror\" \"rgb Kr\" [1 1 1]", 1),
        32,
        "white mirror",
        |runs, name| {
            expect_uniform(runs, [1.0; 3], name);
        },
    );
    both(
        &under_a_sky("\"matte\" \"rgb Kd\" [1 1 1]", 1),
        32,
        "white diffuse",
        |runs, name| {
            expect_uniform(runs, [1.0; 3], name);
        },
    );
    // A chord makes equal angles at both ends: of what enters, `R` stays in at every bounce.
    for depth in [1, 2, 3, 6] {
        both(
            &under_a_sky("\"glass\" \"float index\" [1.5]", depth),
            64,
            &format!("glass depth {depth}"),
            |runs, name| {
                let truth = mean_over_sphere(|cos| {
                    let r = fresnel(cos, 1.5);
                    let out: f64 = (2..=depth)
                        .map(|k| (1.0 - r).powi(2) * r.powi(k as i32 - 2))
                        .sum();
                    r + out
                });
                for c in 0..3 {
                    runs.whole(c).expect(truth, name);
                }
            },
        );
    }
    // Straight lines through a hollow ball are chords too.
    for depth in [1, 2, 3, 6] {
        both(
            &to_v4(&under_a_sky(
                "\"thindielectric\" \"float eta\" [1.5]",
                depth,
            )),
            64,
            &format!("hollow glass ball depth {depth}"),
            |runs, name| {
                let truth = mean_over_sphere(|cos| {
                    let r = fresnel(cos, 1.5);
                    let r = r + (1.0 - r).powi(2) * r / (1.0 - r * r);
                    let through: f64 = (2..=depth)
                        .map(|k| (1.0 - r).powi(2) * r.powi(k as i32 - 2))
                        .sum();
                    r + through
                });
                for c in 0..3 {
                    runs.whole(c).expect(truth, name);
                }
            },
        );
    }
    let metal = "\"metal\" \"rgb eta\" [0.2 0.9 1.5] \"rgb k\" [3.9 2.5 7] \"float roughness\" [0] \"bool remaproughness\" \"false\"";
    both(&under_a_sky(metal, 1), 32, "smooth metal", |runs, name| {
        for (c, (eta, k)) in [(0.2, 3.9), (0.9, 2.5), (1.5, 7.0)].into_iter().enumerate() {
            let truth = mean_over_sphere(|cos| fresnel_conductor(cos, eta, k));
            runs.whole(c).expect(truth, &format!("{name} channel {c}"));
        }
    });
}

/// What a rough conductor of alpha (Trowbridge-Reitz, height-correlated Smith masking, one bounce)
/// reflects of a sky of 1: the integral over half vectors, which are drawn in proportion to the
/// distribution of normals, on a grid.
fn rough_conductor(cos: f64, alpha: f64, eta: f64, k: f64) -> f64 {
    let lambda = |c: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 - c * c) / (c * c)).sqrt() - 1.0);
    let (n, sin) = (64, (1.0 - cos * cos).sqrt());
    let mut sum = 0.0;
    for i in 0..n {
        let u = (f64::from(i) + 0.5) / f64::from(n);
        let ch = 1.0 / (1.0 + alpha * alpha * u / (1.0 - u)).sqrt();
        let sh = (1.0 - ch * ch).sqrt();
        for j in 0..n {
            let phi = PI * (f64::from(j) + 0.5) / f64::from(n);
            let oh = cos * ch + sin * sh * phi.cos();
            let out = 2.0 * oh * ch - cos;
            if oh > 0.0 && out > 0.0 {
                let g = 1.0 / (1.0 + lambda(cos) + lambda(out));
                sum += fresnel_conductor(oh, eta, k) * g * oh / (cos * ch);
            }
        }
    }
    sum / f64::from(n * n)
}

/// Rough metal reflects what one bounce between microfacets does, and the less the rougher it is;
/// nothing reflects more than it receives.
#[test]
fn white_furnace_of_rough_materials() {
    for alpha in [0.003, 0.1, 0.5, 1.0] {
        let metal = format!(
            "\"metal\" \"rgb eta\" [0.2 0.9 1.5] \"rgb k\" [3.9 2.5 7] \"float roughness\" [{alpha}] \"bool remaproughness\" \"false\""
        );
        let truths = [(0.2, 3.9), (0.9, 2.5), (1.5, 7.0)].map(|(eta, k)| {
            // Smooth in the cosine: a table will do.
            let table: Vec<f64> = (0..=64)
                .map(|i| rough_conductor((f64::from(i) / 64.0).max(1e-3), alpha, eta, k))
                .collect();
            mean_over_sphere(|cos| {
                let x = 64.0 * cos;
                let i = (x as usize).min(63);
                let f = x - i as f64;
                (1.0 - f) * table[i] + f * table[i + 1]
            })
        });
        both(
            &under_a_sky(&metal, 1),
            64,
            &format!("metal of alpha {alpha}"),
            |runs, name| {
                for (c, truth) in truths.into_iter().enumerate() {
                    let whole = runs.whole(c);
                    // What the grids of the integral leave.
                    let error = whole.error.hypot(2e-4 * truth);
                    Estimate { error, ..whole }.expect(truth, &format!("{name} channel {c}"));
                }
            },
        );
    }
    for roughness in [0.01, 0.3] {
        let plastic = format!(
            "\"plastic\" \"rgb Kd\" [.4 .4 .4] \"rgb Ks\" [.5 .5 .5] \"float roughness\" [{roughness}]"
        );
        both(
            &under_a_sky(&plastic, 1),
            64,
            &format!("plastic of roughness {roughness}"),
            |runs, name| {
                let whole = runs.whole(0);
                println!("{name}: {:.5} +- {:.5}", whole.mean, whole.error);
                // The diffuse lobe is whole, the glossy one at most what it is given.
                let slack = support::reach(whole.freedom) * whole.error;
                assert!(
                    whole.mean + slack >= 0.4 && whole.mean - slack <= 0.9,
                    "{name}: {whole:?}"
                );
            },
        );
    }
}

/// A paper ball under a white sky is as bright as the sky, but for what paths of more events would
/// carry: inside it is lit evenly, `t` after one event and `t + r` times the light of one event
/// less after more.
#[test]
fn white_furnace_of_a_paper_ball() {
    let (r, t) = (0.3, 0.6);
    let v3 = "\"translucent\" \"rgb Ks\" [0 0 0] \"rgb Kd\" [1 1 1] \"rgb reflect\" [.3 .3 .3] \"rgb transmit\" [.6 .6 .6]";
    let v4 = "\"diffusetransmission\" \"rgb reflectance\" [.15 .15 .15] \"rgb transmittance\" [.3 .3 .3] \"float scale\" [2]";
    for depth in [1, 2, 3, 6] {
        let inside = (1..depth).fold(0.0, |light, _| t + r * light);
        let truth = r + t * inside;
        let texts = [under_a_sky(v3, depth), to_v4(&under_a_sky(v4, depth))];
        for (text, dialect) in texts.iter().zip(["v3", "v4"]) {
            let name = format!("paper ball {dialect} depth {depth}");
            both(text, 64, &name, |runs, name| {
                expect_uniform(runs, [truth; 3], name);
            });
        }
    }
}
