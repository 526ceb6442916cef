//! Parameters of `disney` materials, and pbrt-v3's formulas in `f64`.

use phalanx::replay::bsdf::dielectric;
use phalanx::replay::vector::*;
use phalanx::surface::disney_row::{Parts, Values};
use phalanx::surface::{Kind, Mode};
use std::f64::consts::PI;

/// Materials, from plain ones to those of all lobes.
pub fn rows() -> Vec<(Kind, Values)> {
    let plain = Values {
        colour: [0.8, 0.4, 0.1],
        eta: 1.5,
        roughness: 0.5,
        sheen_tint: 0.5,
        gloss: 1.0,
        ..Values::default()
    };
    let all = Values {
        metallic: 0.3,
        transmission: 0.4,
        specular_tint: 0.6,
        anisotropic: 0.7,
        sheen: 0.8,
        clearcoat: 1.5,
        gloss: 0.0,
        flatness: 0.4,
        through: 0.3,
        roughness: 0.7,
        ..plain
    };
    vec![
        (Kind::Disney, plain),
        (Kind::Disney, all),
        (Kind::DisneyThin, all),
        (
            Kind::Disney,
            Values {
                metallic: 1.0,
                anisotropic: 0.9,
                ..plain
            },
        ),
        (
            Kind::Disney,
            Values {
                clearcoat: 1.0,
                roughness: 1.0,
                ..plain
            },
        ),
        (
            Kind::Disney,
            Values {
                transmission: 1.0,
                eta: 1.3,
                ..plain
            },
        ),
        (
            Kind::DisneyThin,
            Values {
                flatness: 1.0,
                through: 1.0,
                roughness: 0.9,
                ..plain
            },
        ),
        (
            Kind::DisneyThin,
            Values {
                transmission: 0.8,
                eta: 2.0,
                roughness: 0.6,
                colour: [0.0, 1.2, 0.4],
                ..plain
            },
        ),
        (
            Kind::Disney,
            Values {
                roughness: 0.1,
                clearcoat: 0.5,
                ..plain
            },
        ),
        (
            Kind::Disney,
            Values {
                colour: [0.0; 3],
                sheen: 2.0,
                ..plain
            },
        ),
    ]
}

fn lerp(t: f64, a: f64, b: f64) -> f64 {
    (1.0 - t) * a + t * b
}

fn schlick(cos: f64) -> f64 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// What pbrt-v3 (`materials/disney.cpp`) adds up for two directions, of what the row holds.
pub fn formulas(kind: Kind, row: &[f32; 8], o: V, i: V, mode: Mode) -> V {
    let p = Parts::<f32>::of(row);
    let thin = kind == Kind::DisneyThin;
    let c: V = [p.colour.x, p.colour.y, p.colour.z].map(f64::from);
    let [eta, rough, metallic, strans] =
        [p.eta, p.roughness, p.metallic, p.transmission].map(f64::from);
    let (flat, dt) = (f64::from(p.flatness), f64::from(p.through));
    let luminance = 0.212_671 * c[0] + 0.715_16 * c[1] + 0.072_169 * c[2];
    let tint = if luminance > 0.0 {
        scale(c, 1.0 / luminance)
    } else {
        [1.0; 3]
    };
    let dw = (1.0 - metallic) * (1.0 - strans);
    let aspect = (1.0 - 0.9 * f64::from(p.anisotropic)).sqrt();
    let alphas = |rough: f64| {
        [
            (rough * rough / aspect).max(1e-3),
            (rough * rough * aspect).max(1e-3),
        ]
    };
    let (zo, zi) = (o[2].abs(), i[2].abs());
    let normals = |h: V, [ax, ay]: [f64; 2]| {
        let s = (h[0] / ax).powi(2) + (h[1] / ay).powi(2) + h[2] * h[2];
        1.0 / (PI * ax * ay * s * s)
    };
    let lambda = |w: V, [ax, ay]: [f64; 2]| {
        let slope2 = ((w[0] * ax).powi(2) + (w[1] * ay).powi(2)) / (w[2] * w[2]);
        (-1.0 + (1.0 + slope2).sqrt()) / 2.0
    };
    if o[2] * i[2] < 0.0 {
        let from_outside = o[2] > 0.0;
        let ratio = if from_outside { eta } else { 1.0 / eta };
        let mut h = unit(add(o, scale(i, ratio)));
        if h[2] < 0.0 {
            h = scale(h, -1.0);
        }
        let a = alphas(if thin {
            (0.65 * eta - 0.35) * rough
        } else {
            rough
        });
        let (lo, li) = (lambda(o, a), lambda(i, a));
        let masking = match thin {
            true => 1.0 / (1.0 + lo + li),
            false => 1.0 / ((1.0 + lo) * (1.0 + li)),
        };
        let (oh, ih) = (dot(o, h), dot(i, h));
        let mut f = [0.0; 3];
        // Where pbrt-v3 sees the back of a microfacet, there is nothing, as its samples have it.
        if oh * ih < 0.0 && oh * o[2] > 0.0 {
            let index = if oh > 0.0 { eta } else { 1.0 / eta };
            let reflected = dielectric(oh.abs(), index).0;
            let factor = match mode {
                Mode::Radiance => 1.0 / ratio,
                Mode::Importance => 1.0,
            };
            let denominator = (oh + ratio * ih).powi(2) * zo * zi;
            let value = (1.0 - reflected) * normals(h, a) * masking * (ratio * factor).powi(2);
            let value = value * (ih * oh).abs() / denominator;
            f = c.map(|c| strans * c.sqrt() * value);
        }
        if thin {
            f = add(f, scale(c, dt / PI));
        }
        return f;
    }
    let h = unit(add(o, i));
    let d = dot(i, h);
    let (so, si) = (schlick(zo), schlick(zi));
    let mut diffuse = dw / PI * (1.0 - so / 2.0) * (1.0 - si / 2.0);
    if thin {
        let fss90 = d * d * rough;
        let fss = lerp(so, 1.0, fss90) * lerp(si, 1.0, fss90);
        let ss = 1.25 * (fss * (1.0 / (zo + zi) - 0.5) + 0.5);
        diffuse = diffuse * (1.0 - flat) * (1.0 - dt) + dw * flat * (1.0 - dt) / PI * ss;
    }
    let rr = 2.0 * rough * d * d;
    diffuse += dw / PI * rr * (so + si + so * si * (rr - 1.0));
    let a = alphas(rough);
    let masking = 1.0 / ((1.0 + lambda(o, a)) * (1.0 + lambda(i, a)));
    let microfacets = normals(h, a) * masking / (4.0 * zo * zi);
    let outside = h[2] > 0.0;
    let glass = dielectric(d, if outside { eta } else { 1.0 / eta }).0;
    let weight = if outside { schlick(d) } else { 1.0 };
    let r0 = ((eta - 1.0) / (eta + 1.0)).powi(2);
    let gloss = f64::from(p.coat_alpha).powi(2);
    let coat_normals = (gloss - 1.0) / (PI * gloss.ln() * (1.0 + (gloss - 1.0) * h[2] * h[2]));
    let smith = |z: f64| 1.0 / (z + (0.0625 + z * z - 0.0625 * z * z).sqrt());
    let coat = f64::from(p.clearcoat) * smith(zo) * smith(zi) * coat_normals / 4.0
        * lerp(schlick(d), 0.04, 1.0);
    std::array::from_fn(|k| {
        let tinted = r0 * lerp(f64::from(p.specular_tint), 1.0, tint[k]);
        let r0 = lerp(metallic, tinted, c[k]);
        let fresnel = lerp(metallic, glass, lerp(weight, r0, 1.0));
        let sheen = lerp(f64::from(p.sheen_tint), 1.0, tint[k]) * f64::from(p.sheen) * dw;
        c[k] * diffuse + sheen * schlick(d) + fresnel * microfacets + coat
    })
}
