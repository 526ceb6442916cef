//! Coated surfaces against pbrt-v4's random walk between their layers, which they stand for in
//! closed form: how far apart they are.

mod walk;

use self::walk::{Base, Layers, smooth};
use crate::common;

use common::bsdf::Kernels;
use common::stats::{FALSE_ALARM, Mean, Random, normal_quantile};
use phalanx::pbrt::load_str;
use phalanx::replay::bsdf::dielectric;
use phalanx::replay::vector::*;
use phalanx::simd::f32x8;
use phalanx::surface::{Kind, MaterialTable, Mode};
use std::f64::consts::PI;

fn at(mu: f64, phi: f64) -> V {
    let r = (1.0 - mu * mu).sqrt();
    [r * phi.cos(), r * phi.sin(), mu]
}

/// Albedo of the kernel by its own sampling.
fn albedo(kind: Kind, row: &[f32; 8], mu: f64, n: usize, random: &mut Random) -> Mean {
    let wo = vec![narrow(at(mu, 0.3)); n];
    let u: Vec<[f32; 3]> = (0..n)
        .map(|_| std::array::from_fn(|_| random.uniform()))
        .collect();
    let mut mean = Mean::default();
    for (_, weight, ..) in Kernels::sample::<f32x8>(kind, row, &wo, &u, Mode::Radiance) {
        mean.add(weight[1].into());
    }
    mean
}

const COSINES: [f64; 5] = [1.0, 0.7, 0.4, 0.2, 0.1];

/// Distances of albedos: of each cosine.
fn albedo_distances(layers: Layers, random: &mut Random) -> [(f64, f64); 5] {
    let (kind, row) = layers.row();
    COSINES.map(|mu| {
        let n = 8_000;
        let ours = albedo(kind, &row, mu, n, random);
        let mut theirs = Mean::default();
        for _ in 0..n {
            theirs.add(layers.sampled(at(mu, 0.3), random));
        }
        let mut base = ours.mean();
        if smooth(layers.alpha) && kind != Kind::CoatedMirror {
            base += dielectric(mu, layers.eta).0;
        }
        (base - theirs.mean(), ours.error().hypot(theirs.error()))
    })
}

fn diffuse_cases() -> Vec<Layers> {
    let mut cases = Vec::new();
    for eta in [1.3, 1.5, 2.0] {
        for alpha in [0.0, 0.1, 0.3, 0.6] {
            for rho in [0.1, 0.5, 0.9] {
                cases.push(Layers {
                    alpha,
                    eta,
                    thickness: 0.01,
                    base: Base::Diffuse(rho),
                    max_depth: 10,
                });
            }
        }
    }
    cases
}

fn conductor_cases() -> Vec<Layers> {
    let mut cases = Vec::new();
    for eta in [1.3, 1.5, 2.0] {
        for alpha in [0.0, 0.1, 0.3, 0.6] {
            for below in [0.0, 0.1, 0.3, 0.6] {
                cases.push(Layers {
                    alpha,
                    eta,
                    thickness: 0.01,
                    base: Base::Conductor {
                        eta: 0.9 / eta,
                        k: 2.4 / eta,
                        alpha: below,
                    },
                    max_depth: 10,
                });
            }
        }
    }
    cases
}

/// Prints the distances of albedos and returns the largest, of what is beyond the statistical
/// error.
fn table(cases: &[Layers], random: &mut Random) -> f64 {
    let tail = normal_quantile(FALSE_ALARM);
    let mut worst = 0.0f64;
    for layers in cases {
        let base = match layers.base {
            Base::Diffuse(rho) => format!("rho {rho:4}"),
            Base::Conductor { alpha, .. } => format!("alpha {alpha:4}"),
        };
        let distances = albedo_distances(*layers, random);
        let row: Vec<String> = distances
            .iter()
            .map(|(d, e)| format!("{d:+.4} ({e:.4})"))
            .collect();
        println!(
            "eta {:3} coat {:4} {base}: {}",
            layers.eta,
            layers.alpha,
            row.join(" ")
        );
        for (distance, error) in distances {
            worst = worst.max(distance.abs() - tail * error);
        }
    }
    println!("beyond noise: {worst:.4}");
    worst
}

#[test]
fn albedos_of_coated_diffuse_surfaces_are_those_of_the_random_walk() {
    let worst = table(&diffuse_cases(), &mut Random(1));
    assert!(worst < 0.002, "{worst}");
}

#[test]
fn albedos_of_coated_conductors_are_near_those_of_the_random_walk() {
    let worst = table(&conductor_cases(), &mut Random(2));
    assert!(worst < 0.03, "{worst}");
}

/// Largest distance of values, in parts of what a white diffuse surface has, in directions around
/// and away from the mirror's; the largest relative one; and the bias of pbrt's weights. All of
/// what is beyond statistical error.
fn value_distance(layers: Layers, random: &mut Random) -> [f64; 3] {
    let (kind, row) = layers.row();
    let tail = normal_quantile(FALSE_ALARM);
    let [mut worst, mut relative, mut bias] = [0.0f64; 3];
    for (mo, mi, phi) in [
        (0.9, 0.9, 3.0),
        (0.9, 0.5, 3.1),
        (0.7, 0.7, 1.5),
        (0.6, 0.3, 2.6),
        (0.4, 0.4, 3.0),
        (0.2, 0.5, 0.5),
        (0.9, 0.2, 0.0),
    ] {
        let (wo, wi) = (at(mo, 0.0), at(mi, phi));
        let value =
            Kernels::eval::<f32x8>(kind, &row, &[narrow(wo)], &[narrow(wi)], Mode::Radiance)[0].0
                [1];
        let mut mean = |as_pbrt: bool| {
            let mut mean = Mean::default();
            for _ in 0..4_000 {
                mean.add(layers.walk(wo, wi, as_pbrt, random) / (layers.eta * layers.eta));
            }
            mean
        };
        let right = mean(false);
        let theirs = right.mean() + layers.gloss(wo, wi);
        let distance = (f64::from(value) - theirs).abs() - tail * right.error();
        worst = worst.max(PI * distance);
        relative = relative.max(distance / theirs);
        let pbrt = mean(true);
        let error = tail * right.error().hypot(pbrt.error());
        bias = bias.max(((pbrt.mean() - right.mean()).abs() - error) / theirs);
    }
    [worst, relative, bias]
}

#[test]
fn values_of_coated_diffuse_surfaces_are_those_of_the_random_walk() {
    let mut random = Random(3);
    let mut worst = [0.0f64; 3];
    for layers in diffuse_cases() {
        let distances = value_distance(layers, &mut random);
        worst = std::array::from_fn(|i| worst[i].max(distances[i]));
    }
    println!("{worst:?}");
    assert!(worst[0] < 0.01, "{worst:?}");
}

#[test]
fn values_of_coated_conductors_are_near_those_of_the_random_walk() {
    let mut random = Random(4);
    for layers in conductor_cases() {
        if layers.row().0 == Kind::CoatedMirror {
            continue;
        }
        let [d, r, _] = value_distance(layers, &mut random);
        let Base::Conductor { alpha, .. } = layers.base else {
            continue;
        };
        println!(
            "eta {} coat {} alpha {alpha}: {d:.4} of a white surface's, {r:.3} of its own",
            layers.eta, layers.alpha
        );
        if smooth(layers.alpha) && alpha >= 0.3 {
            assert!(r < 0.2, "{r}");
        }
        if alpha >= 0.6 {
            assert!(d < 0.12 && r < 0.25, "{d} {r}");
        }
    }
}

/// A white base under a clear coat, as many bounces as it takes: smooth coats lose nothing, rough
/// ones what microfacets send into each other.
#[test]
fn white_under_a_clear_coat_stays_white() {
    let mut random = Random(5);
    let tail = normal_quantile(FALSE_ALARM);
    for (alpha, least) in [(0.0, 1.0), (0.1, 0.88), (0.3, 0.6), (0.6, 0.4)] {
        let layers = Layers {
            alpha,
            eta: 1.5,
            thickness: 0.0,
            base: Base::Diffuse(1.0),
            max_depth: 2000,
        };
        let (kind, row) = layers.row();
        let all = COSINES.map(|mu| {
            let mean = albedo(kind, &row, mu, 8000, &mut random);
            let mut sum = mean.mean();
            if smooth(alpha) {
                sum += dielectric(mu, layers.eta).0;
            }
            let reach = tail * mean.error() + 1e-3;
            assert!(
                sum <= 1.0 + reach && sum >= least - reach,
                "{alpha} {mu}: {sum}"
            );
            sum
        });
        println!("alpha {alpha}: {all:.4?}");
    }
}

/// The kernel and row of a material's coated part, evaluated at a hit if it has textures.
fn evaluated(material: &str) -> (Kind, [f32; 8]) {
    let textures = "Texture \"f\" \"float\" \"checkerboard\" \"float tex1\" FLOAT \"float tex2\" FLOAT\n\
                    Texture \"c\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [.7 .6 .4] \"rgb tex2\" [.7 .6 .4]\n";
    let float = material.rsplit(' ').next().unwrap_or_default();
    let textures = textures.replace("FLOAT", if float.is_empty() { "0" } else { float });
    let material = material.strip_suffix(float).unwrap_or(material);
    let text = format!(
        "Camera \"perspective\"\nWorldBegin\n{textures}Material {material}\nShape \"sphere\"\n"
    );
    let scene = load_str(&text, "coat.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let table = MaterialTable::new(&scene);
    let coated = |kind: Kind| kind >= Kind::CoatedDiffuse;
    let found = table
        .entries
        .iter()
        .position(|e| coated(e.kind) && !e.mixture);
    let index = found.expect("a coated material");
    let row = table.evaluate(index, &Default::default(), 0.0);
    (table.entries[index].kind, row.0)
}

/// A texture that is the same everywhere is as good as a constant: rows of both have the same
/// values but for what interpolation between tabulated roughnesses leaves.
#[test]
fn textures_on_coats_are_those_of_constants() {
    let white = "\"rgb reflectance\" [.7 .6 .4]";
    let cases = [
        (
            "\"coateddiffuse\" \"rgb reflectance\" [.7 .6 .4] \"float roughness\" R",
            "\"coateddiffuse\" \"texture reflectance\" \"c\" \"texture roughness\" \"f\" R",
            0.01,
        ),
        (
            "\"coatedconductor\" \"float conductor.roughness\" .1 W \"float interface.roughness\" R",
            "\"coatedconductor\" \"float conductor.roughness\" .1 \"texture reflectance\" \"c\" \"texture interface.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W \"float interface.roughness\" .1 \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"float interface.roughness\" .1 \"texture conductor.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W \"float interface.roughness\" R \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"texture interface.roughness\" \"f\" \"texture conductor.roughness\" \"f\" R",
            0.05,
        ),
        (
            "\"coatedconductor\" W \"float conductor.roughness\" R",
            "\"coatedconductor\" \"texture reflectance\" \"c\" \"texture conductor.roughness\" \"f\" R",
            0.04,
        ),
        (
            "\"coatedconductor\" W",
            "\"coatedconductor\" \"texture reflectance\" \"c\" R",
            1e-4,
        ),
    ];
    for (constant, textured, bound) in cases {
        for roughness in ["0.04", "0.13", "0.3"] {
            let fill = |text: &str| text.replace('W', white).replace('R', roughness);
            let (kind, row) = evaluated(&(fill(constant) + " "));
            let (same, other) = evaluated(&fill(textured));
            assert_eq!(kind, same, "{textured}");
            if kind == Kind::CoatedMirror {
                assert_eq!(row, other);
                continue;
            }
            for (mo, mi, phi) in [
                (1.0, 0.9, 3.0),
                (0.8, 0.8, 3.1),
                (0.5, 0.3, 2.8),
                (0.3, 0.6, 0.5),
            ] {
                let value = |row| {
                    let (wo, wi) = (narrow(at(mo, 0.0)), narrow(at(mi, phi)));
                    Kernels::eval::<f32x8>(kind, row, &[wo], &[wi], Mode::Radiance)[0].0
                };
                let (a, b) = (value(&row), value(&other));
                for c in 0..3 {
                    let off = (a[c] - b[c]).abs();
                    assert!(
                        off <= bound * (a[c] + 0.03),
                        "{textured} {roughness}: {a:?} {b:?}"
                    );
                }
            }
        }
    }
}

/// What cannot be looked up in a texture is said so.
#[test]
fn textures_that_coats_cannot_have() {
    for (material, given) in [
        ("coateddiffuse", "\"texture thickness\" \"f\""),
        ("coateddiffuse", "\"texture albedo\" \"c\""),
    ] {
        let text = format!(
            "Camera \"perspective\"\nWorldBegin\nTexture \"f\" \"float\" \"checkerboard\"\nTexture \"c\" \"spectrum\" \"checkerboard\"\nMaterial \"{material}\" {given}\nShape \"sphere\"\n"
        );
        let error = load_str(&text, "coat.pbrt", ".".as_ref())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("not supported") && error.contains("coat.pbrt:5"),
            "{error}"
        );
    }
}

/// Over smooth metal under a rough coat: the whole lobe, against the walk's mean over sun and eye
/// around a ball. What is left is the shape's error.
#[test]
fn lobes_over_smooth_metal_have_the_shape_of_the_walk() {
    let mut random = Random(6);
    let light = unit([1.0, 2.0, 2.0]);
    for (alpha, eta) in [(0.2f64.sqrt(), 1.5), (0.2, 1.5), (0.3, 1.3), (0.3, 2.0)] {
        let k = 2.0 * 0.9f64.sqrt() / 0.1f64.sqrt();
        let layers = Layers {
            alpha,
            eta,
            thickness: 0.01,
            base: Base::Conductor {
                eta: 1.0 / eta,
                k: k / eta,
                alpha: 0.0,
            },
            max_depth: 10,
        };
        let (kind, row) = layers.row();
        let n = 14;
        let [mut ours, mut theirs, mut apart] = [0.0f64; 3];
        for i in 0..n * n {
            let x = (2 * (i % n) + 1) as f64 / n as f64 - 1.0;
            let y = (2 * (i / n) + 1) as f64 / n as f64 - 1.0;
            let square = 1.0 - x * x - y * y;
            if square < 0.02 {
                continue;
            }
            let normal = [x, y, square.sqrt()];
            let cos = dot(normal, light);
            if cos <= 0.02 {
                continue;
            }
            let s = unit(cross(normal, [0.0, 1.0, 0.1]));
            let t = cross(normal, s);
            let local = |w: V| [dot(w, s), dot(w, t), dot(w, normal)];
            let (wo, wi) = (local([0.0, 0.0, 1.0]), local(light));
            let value =
                Kernels::eval::<f32x8>(kind, &row, &[narrow(wo)], &[narrow(wi)], Mode::Radiance);
            let a = f64::from(value[0].0[1]) * cos;
            let walks = 800;
            let sum: f64 = (0..walks)
                .map(|_| layers.walk(wo, wi, false, &mut random))
                .sum();
            let b = (sum / f64::from(walks) / (eta * eta) + layers.gloss(wo, wi)) * cos;
            ours += a;
            theirs += b;
            apart += (a - b).abs();
        }
        println!(
            "alpha {alpha:.3} eta {eta}: {:.3} of the walk's, {:.3} apart",
            ours / theirs,
            apart / theirs
        );
        assert!(
            (ours / theirs - 1.0).abs() < 0.05,
            "{alpha} {eta}: {}",
            ours / theirs
        );
        assert!(apart < 0.12 * theirs, "{alpha} {eta}: {}", apart / theirs);
    }
}
