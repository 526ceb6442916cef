//! The directions that primary samples stand for where a path scatters, in `f64`.

use super::coated;
use super::microfacet::unpacked_alphas;
use super::path::PathVertex;
use super::reference::{axes, exchanges, twin};
use super::vector::*;
use super::warp::{self, from_axes};
use crate::scene::Sides;
use crate::surface::Kind;

/// What the path in `f32` did at a vertex, which says which lobe it took.
#[derive(Clone, Copy, Debug)]
pub struct Taken {
    /// Its normals there.
    pub ng: V,
    /// Unit shading normal.
    pub ns: V,
    /// Unit, where it came from.
    pub wo: V,
    /// Unit, where it went, if it went on.
    pub wi: Option<V>,
}

/// The direction that a BSDF samples for a path arriving along `wo`.
pub fn bend(sides: Option<Sides>, v: &PathVertex, wo: V, u: [f64; 3], taken: Taken) -> V {
    let (s, t) = axes(v);
    let exchanges = exchanges(sides, v);
    let wo = [dot(wo, s), dot(wo, t), dot(wo, v.ns)];
    let row = v.row.map(f64::from);
    let (x, y, z) = (wo[0], wo[1], wo[2]);
    let up = [x, y, z.abs()];
    let glossy = || mirrored(up, visible_normal(up, row[6], row[7], u));
    // On the side of `wo`.
    let with_side = |w: V| [w[0], w[1], w[2] * 1f64.copysign(z)];
    // The side that the sample in `f32` went to.
    let reflected = || {
        // Of two twins, the true normal tells which lobe they are of.
        let ns = if exchanges { taken.ng } else { taken.ns };
        let side = |w: V| dot(w, ns) > 0.0;
        taken.wi.is_some_and(|wi| side(wi) == side(taken.wo))
    };
    let wi = match v.kind {
        Kind::Diffuse | Kind::OrenNayar | Kind::CoatedDiffuseBase => {
            with_side(warp::hemisphere(u[0], u[1]))
        }
        Kind::Mirror | Kind::SmoothConductor | Kind::Coat | Kind::CoatedMirror => [-x, -y, z],
        Kind::RoughConductor => with_side(glossy()),
        Kind::Plastic => with_side(if u[2] < plastic_diffuse_share(&row) {
            warp::hemisphere(u[0], u[1])
        } else {
            glossy()
        }),
        Kind::Substrate => with_side(if u[2] < 0.5 {
            warp::hemisphere(u[0], u[1])
        } else {
            glossy()
        }),
        Kind::CoatedDiffuse => {
            let (ax, ay) = unpacked_alphas(row[4]);
            with_side(if u[2] < coated::diffuse_share(&row, up[2]) {
                warp::hemisphere(u[0], u[1])
            } else {
                mirrored(up, visible_normal(up, ax, ay, u))
            })
        }
        Kind::CoatedConductor | Kind::CoatedConductorBase => {
            with_side(coated_conductor(v.kind, &row, up, u))
        }
        Kind::DiffuseTransmission => {
            let w = with_side(warp::hemisphere(u[0], u[1]));
            [w[0], w[1], if reflected() { w[2] } else { -w[2] }]
        }
        Kind::ThinDielectric if reflected() => [-x, -y, z],
        Kind::ThinDielectric => [-x, -y, -z],
        Kind::RoughDielectric => with_side(rough_dielectric(&row, wo, u, reflected())),
        Kind::SmoothDielectric if reflected() => [-x, -y, z],
        Kind::SmoothDielectric => {
            let eta = if z > 0.0 { row[6] } else { 1.0 / row[6] };
            let sin2 = (x * x + y * y) / (eta * eta);
            let cos = (1.0 - sin2).max(0.0).sqrt();
            [-x / eta, -y / eta, -cos.copysign(z)]
        }
        // What the kernel said, of kinds without a formula here; unreachable while all have one.
        #[allow(unreachable_patterns)]
        _ => taken
            .wi
            .map_or([-x, -y, z], |w| [dot(w, s), dot(w, t), dot(w, v.ns)]),
    };
    let sampled = |w: V| {
        let w = unit(from_axes([s, t, v.ns], w));
        let off = taken.wi.map_or([0.0; 3], |wi| sub(w, wi));
        (w, dot(off, off))
    };
    let (mut w, off) = sampled(wi);
    if exchanges {
        let ng = [dot(v.ng, s), dot(v.ng, t), dot(v.ng, v.ns)];
        let (other, less) = sampled(twin(wi, ng));
        if less < off {
            w = other;
        }
    }
    w
}

/// `w` mirrored at `h`.
fn mirrored(w: V, h: V) -> V {
    sub(scale(h, 2.0 * dot(w, h)), w)
}

/// How often plastic samples its Lambertian lobe.
fn plastic_diffuse_share(row: &[f64; 8]) -> f64 {
    let black = |at: usize| row[at..at + 3].iter().all(|c| *c <= 0.0);
    match (black(0), black(3)) {
        (true, _) => 0.0,
        (false, true) => 1.0,
        (false, false) => 0.5,
    }
}

/// In the upper hemisphere, as `up` is.
fn coated_conductor(kind: Kind, row: &[f64; 8], up: V, u: [f64; 3]) -> V {
    let [metal, diffuse, _] = coated::conductor_shares(kind, row, up);
    if u[2] < metal {
        let eta = row[3];
        let (x, y) = (up[0] / eta, up[1] / eta);
        let p = [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()];
        let (ax, ay) = coated::sampled_alphas(kind, row, up[2], p[2]);
        let q = mirrored(p, visible_normal(p, ax, ay, u));
        let (x, y) = (q[0] * eta, q[1] * eta);
        [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()]
    } else if u[2] < metal + diffuse {
        warp::hemisphere(u[0], u[1])
    } else {
        let (ax, ay) = unpacked_alphas(row[4]);
        mirrored(up, visible_normal(up, ax, ay, u))
    }
}

/// In the upper hemisphere if it is reflected.
fn rough_dielectric(row: &[f64; 8], wo: V, u: [f64; 3], reflected: bool) -> V {
    let up = [wo[0], wo[1], wo[2].abs()];
    let (ax, ay) = unpacked_alphas(row[7]);
    let h = visible_normal(up, ax, ay, u);
    let c = dot(up, h);
    if reflected {
        sub(scale(h, 2.0 * c), up)
    } else {
        // Walter et al. 2007, equation 40.
        let eta = if wo[2] > 0.0 { 1.0 / row[6] } else { row[6] };
        let root = (1.0 + eta * eta * (c * c - 1.0)).max(0.0).sqrt();
        sub(scale(h, eta * c - root), scale(up, eta))
    }
}

/// A visible normal of the Trowbridge-Reitz distribution (Heitz 2018, listing 1).
fn visible_normal(wo: V, ax: f64, ay: f64, u: [f64; 3]) -> V {
    let stretched = unit([wo[0] * ax, wo[1] * ay, wo[2]]);
    let planar = stretched[0].hypot(stretched[1]);
    let t1 = if planar > 1e-15 {
        [-stretched[1] / planar, stretched[0] / planar, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let t2 = cross(stretched, t1);
    let (a, b) = warp::disk(u[0], u[1]);
    let s = (1.0 + stretched[2]) / 2.0;
    let b = (1.0 - s) * (1.0 - a * a).max(0.0).sqrt() + s * b;
    let c = (1.0 - a * a - b * b).max(0.0).sqrt();
    let n = from_axes([t1, t2, stretched], [a, b, c]);
    unit([n[0] * ax, n[1] * ay, n[2].max(1e-6)])
}
