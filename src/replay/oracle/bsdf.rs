//! The scattering functions once more: `f64`, textbook forms, not those of the renderer.

pub use super::microfacet::{
    Value, conductor, dielectric, ggx_brdf, ggx_d, ggx_lambda, ggx_pdf, ggx_refraction, sheet,
    unpacked_alphas,
};

use super::coated;
use super::vector::{V, add, dot, scale, unit};
use crate::simd::Vec3;
use crate::surface::{Kind, Mode, Tabulated};
use std::f64::consts::PI;

/// Rough glass: reflection as of a metal, but for the Fresnel term, which also chooses the lobe; or
/// refraction.
fn rough_dielectric(row: &[f64; 8], wo: V, wi: V, mode: Mode) -> Value {
    let (ax, ay) = unpacked_alphas(row[7]);
    let index = |w: V| if w[2] > 0.0 { 1.0 } else { row[6] };
    let (eta_o, eta_i) = (index(wo), index(wi));
    if wo[2] * wi[2] > 0.0 {
        // The far side is the one that neither direction is on.
        let eta = if wo[2] > 0.0 { row[6] } else { 1.0 / row[6] };
        let up = |w: V| [w[0], w[1], w[2].abs()];
        let (o, i) = (up(wo), up(wi));
        let r = dielectric(dot(o, unit(add(o, i))).clamp(0.0, 1.0), eta).0;
        let brdf = ggx_brdf(o, i, ax, ay);
        return Value {
            f: std::array::from_fn(|c| row[c] * r * brdf),
            pdf: r * ggx_pdf(o, i, ax, ay),
            pdf_reverse: r * ggx_pdf(i, o, ax, ay),
        };
    }
    let (i, o) = ((wi, eta_i), (wo, eta_o));
    let [radiance, reverse, pdf] = ggx_refraction(i, o, ax, ay);
    let f = match mode {
        Mode::Radiance => radiance,
        // Light comes from `wo`.
        Mode::Importance => ggx_refraction(o, i, ax, ay)[0],
    };
    Value {
        f: std::array::from_fn(|c| row[3 + c] * f),
        pdf,
        pdf_reverse: reverse,
    }
}

/// Share of reflections among the samples of a diffuse sheet: by the largest channels.
pub fn reflected_share(row: &[f64; 8]) -> f64 {
    let most = |at: usize| row[at..at + 3].iter().copied().fold(0.0, f64::max);
    let (r, t) = (most(0), most(3));
    if r + t > 0.0 { r / (r + t) } else { 1.0 }
}

fn diffuse_transmission(row: &[f64; 8], zo: f64, zi: f64) -> Value {
    let share = reflected_share(row);
    let (at, share) = match zo * zi {
        side if side > 0.0 => (0, share),
        side if side < 0.0 => (3, 1.0 - share),
        _ => (0, 0.0),
    };
    let albedo: V = if zo * zi == 0.0 {
        [0.0; 3]
    } else {
        [row[at], row[at + 1], row[at + 2]]
    };
    Value {
        f: albedo.map(|a| a / PI),
        pdf: share * zi.abs() / PI,
        pdf_reverse: share * zo.abs() / PI,
    }
}

/// pbrt-v3's: 1.5 outside and 1 inside.
fn plastic_index(front: bool) -> f64 {
    if front { f64::from(1.0f32 / 1.5) } else { 1.5 }
}

/// pbrt-v3's value where the true normal disagrees with the shading normal (its `BSDF::f` and the
/// functions that it calls): of reflection if the directions are on different sides of the latter,
/// of transmission if on the same.
pub fn across(kind: Kind, row: &[f64; 8], wo: V, wi: V) -> V {
    let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
    let reflects = wo[2] * wi[2] < 0.0;
    let (zo, zi) = (wo[2].abs(), wi[2].abs());
    let sum = add(wo, wi);
    let h = unit(sum);
    let h = scale(h, 1f64.copysign(h[2]));
    let c = dot(wi, h);
    let torrance_sparrow = |ax: f64, ay: f64, share: f64| {
        let g = 1.0 / (1.0 + ggx_lambda(wo, ax, ay) + ggx_lambda(wi, ax, ay));
        ggx_d(h, ax, ay) * g * share / (4.0 * zo * zi)
    };
    match kind {
        Kind::DiffuseTransmission if !reflects => rgb(3).map(|t| t / PI),
        _ if !reflects => [0.0; 3],
        Kind::Diffuse | Kind::DiffuseTransmission => rgb(0).map(|r| r / PI),
        Kind::OrenNayar => {
            let (ti, to) = (zi.min(1.0).acos(), zo.min(1.0).acos());
            let dphi = wi[1].atan2(wi[0]) - wo[1].atan2(wo[0]);
            let (alpha, beta) = (ti.max(to), ti.min(to));
            let g = row[3] + row[4] * dphi.cos().max(0.0) * alpha.sin() * beta.tan();
            rgb(0).map(|r| r * g / PI)
        }
        Kind::RoughConductor => std::array::from_fn(|i| {
            torrance_sparrow(row[6], row[7], conductor(c.abs(), row[i], row[3 + i]))
        }),
        Kind::RoughDielectric => {
            let (ax, ay) = unpacked_alphas(row[7]);
            let eta = if c > 0.0 { row[6] } else { 1.0 / row[6] };
            let share = dielectric(c.abs(), eta).0;
            rgb(0).map(|r| r * torrance_sparrow(ax, ay, share))
        }
        Kind::Plastic => {
            let share = dielectric(c.abs(), plastic_index(c > 0.0)).0;
            let glossy = torrance_sparrow(row[6], row[7], share);
            std::array::from_fn(|i| row[i] / PI + row[3 + i] * glossy)
        }
        Kind::Substrate if row[..6].iter().any(|x| *x > 0.0) => {
            let under = |z: f64| 1.0 - (1.0 - z / 2.0).powi(5);
            let d = ggx_d(h, row[6], row[7]);
            std::array::from_fn(|i| {
                let (rd, rs) = (row[i], row[3 + i]);
                let base = 28.0 / (23.0 * PI) * rd * (1.0 - rs) * under(zi) * under(zo);
                let schlick = rs + (1.0 - c.abs()).powi(5) * (1.0 - rs);
                base + schlick * d / (4.0 * c.abs() * zi.max(zo))
            })
        }
        _ => [0.0; 3],
    }
}

/// [`eval_in`] of a kind without tables.
pub fn eval(kind: Kind, row: &[f64; 8], wo: V, wi: V, mode: Mode) -> Value {
    eval_in(&Tabulated::default(), kind, row, [wo, wi], mode)
}

/// Value and densities for two unit directions in the shading frame, both away from the surface.
/// `row` are the BSDF's parameters; a BSDF without formulas here is evaluated by its kernel.
pub fn eval_in(
    tables: &Tabulated,
    kind: Kind,
    row: &[f64; 8],
    [wo, wi]: [V; 2],
    mode: Mode,
) -> Value {
    let dark = Value {
        f: [0.0; 3],
        pdf: 0.0,
        pdf_reverse: 0.0,
    };
    if !kind.is_delta() && !has_formulas(kind) {
        return of_kernel(tables, kind, row, [wo, wi], mode);
    }
    if kind == Kind::DiffuseTransmission {
        return diffuse_transmission(row, wo[2], wi[2]);
    }
    if kind == Kind::RoughDielectric && wo[2] * wi[2] != 0.0 {
        return rough_dielectric(row, wo, wi, mode);
    }
    if kind.is_delta() || wo[2] * wi[2] <= 0.0 {
        return dark;
    }
    let up = |w: V| [w[0], w[1], w[2].abs()];
    let front = wo[2] > 0.0;
    let (wo, wi) = (up(wo), up(wi));
    let h = unit(add(wo, wi));
    let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
    match kind {
        Kind::Diffuse => Value {
            f: rgb(0).map(|r| r / PI),
            pdf: wi[2] / PI,
            pdf_reverse: wo[2] / PI,
        },
        Kind::OrenNayar => {
            // Angles, as in the paper.
            let (ti, to) = (wi[2].min(1.0).acos(), wo[2].min(1.0).acos());
            let dphi = wi[1].atan2(wi[0]) - wo[1].atan2(wo[0]);
            let (alpha, beta) = (ti.max(to), ti.min(to));
            let g = row[3] + row[4] * dphi.cos().max(0.0) * alpha.sin() * beta.tan();
            Value {
                f: rgb(0).map(|r| r * g / PI),
                pdf: wi[2] / PI,
                pdf_reverse: wo[2] / PI,
            }
        }
        Kind::RoughConductor => {
            let (ax, ay) = (row[6], row[7]);
            let (eta, k) = (rgb(0), rgb(3));
            let brdf = ggx_brdf(wo, wi, ax, ay);
            let c = dot(wo, h).clamp(0.0, 1.0);
            Value {
                f: std::array::from_fn(|i| brdf * conductor(c, eta[i], k[i])),
                pdf: ggx_pdf(wo, wi, ax, ay),
                pdf_reverse: ggx_pdf(wi, wo, ax, ay),
            }
        }
        Kind::Plastic => plastic(row, wo, wi, front),
        Kind::Substrate => substrate(row, wo, wi),
        Kind::CoatedDiffuse
        | Kind::CoatedDiffuseBase
        | Kind::CoatedConductor
        | Kind::CoatedConductorBase => coated::eval(kind, row, wo, wi),
        _ => dark,
    }
}

/// In the upper hemisphere; from the front its Fresnel term is another.
fn plastic(row: &[f64; 8], wo: V, wi: V, front: bool) -> Value {
    let h = unit(add(wo, wi));
    let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
    let (ax, ay) = (row[6], row[7]);
    let (diffuse, specular) = (rgb(0), rgb(3));
    let c = dot(wo, h).clamp(0.0, 1.0);
    let glossy = ggx_brdf(wo, wi, ax, ay) * dielectric(c, plastic_index(front)).0;
    let p = match (diffuse == [0.0; 3], specular == [0.0; 3]) {
        (_, true) if diffuse != [0.0; 3] => 1.0,
        (true, _) => 0.0,
        _ => 0.5,
    };
    Value {
        f: std::array::from_fn(|i| diffuse[i] / PI + specular[i] * glossy),
        pdf: p * wi[2] / PI + (1.0 - p) * ggx_pdf(wo, wi, ax, ay),
        pdf_reverse: p * wo[2] / PI + (1.0 - p) * ggx_pdf(wi, wo, ax, ay),
    }
}

/// In the upper hemisphere.
fn substrate(row: &[f64; 8], wo: V, wi: V) -> Value {
    let h = unit(add(wo, wi));
    let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
    let (ax, ay) = (row[6], row[7]);
    let (rd, rs) = (rgb(0), rgb(3));
    let under = |w: V| 1.0 - (1.0 - w[2] / 2.0).powi(5);
    // Equal but for rounding.
    let c = 0.5 * (dot(wo, h) + dot(wi, h));
    let black = row[..6].iter().all(|x| *x <= 0.0);
    let f = |i: usize| {
        let base = 28.0 / (23.0 * PI) * rd[i] * (1.0 - rs[i]) * under(wi) * under(wo);
        let schlick = rs[i] + (1.0 - c).powi(5) * (1.0 - rs[i]);
        base + schlick * ggx_d(h, ax, ay) / (4.0 * c * wi[2].max(wo[2]))
    };
    Value {
        f: std::array::from_fn(|i| if black { 0.0 } else { f(i) }),
        pdf: 0.5 * (wi[2] / PI + ggx_pdf(wo, wi, ax, ay)),
        pdf_reverse: 0.5 * (wo[2] / PI + ggx_pdf(wi, wo, ax, ay)),
    }
}

/// Whether the formulas of a kind that is not a delta are here. Of others the kernel in `f32`
/// itself is asked, and is compared with itself.
fn has_formulas(kind: Kind) -> bool {
    matches!(
        kind,
        Kind::Diffuse
            | Kind::OrenNayar
            | Kind::RoughConductor
            | Kind::RoughDielectric
            | Kind::Plastic
            | Kind::DiffuseTransmission
            | Kind::Substrate
            | Kind::CoatedDiffuse
            | Kind::CoatedDiffuseBase
            | Kind::CoatedConductor
            | Kind::CoatedConductorBase
    )
}

/// The same of a delta: its value times the cosine and its densities both ways, of the lobe that
/// leads up or down; all but the probability of the lobe.
pub fn delta_of_kernel(kind: Kind, row: &[f64; 8], wo: V, up: bool) -> (V, f64, f64) {
    let [x, y, z] = wo.map(|x| x as f32);
    let row = row.map(|x| x as f32);
    // The lobes are the ends of what the choice among them may be.
    let ends = [0.0, 1.0 - f32::EPSILON];
    let lobes = ends.map(|u| kind.sample(&row, Vec3::new(x, y, z), [0.5, 0.5, u], Mode::Radiance));
    let lobe = lobes.iter().find(|lobe| (lobe.wi.z > 0.0) == up);
    lobe.map_or(([0.0; 3], 1.0, 1.0), |lobe| {
        let weight = lobe.throughput.lane(0).map(f64::from);
        (weight, lobe.pdf.into(), lobe.pdf_reverse.into())
    })
}

fn of_kernel(
    tables: &Tabulated,
    kind: Kind,
    row: &[f64; 8],
    directions: [V; 2],
    mode: Mode,
) -> Value {
    let narrow = directions.map(|[x, y, z]| Vec3::new(x as f32, y as f32, z as f32));
    let value = kind.eval_in(tables, &row.map(|x| x as f32), narrow, mode);
    Value {
        f: value.f.lane(0).map(f64::from),
        pdf: value.pdf.into(),
        pdf_reverse: value.pdf_reverse.into(),
    }
}
