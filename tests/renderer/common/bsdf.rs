//! The kernels of all kinds of BSDF over lists of directions, and how rounding of a cosine shakes a
//! formula.

use phalanx::surface::coated_conductor::Layers;
use phalanx::surface::{Kind, coat::Interface, coated_diffuse, microfacet::pack_alphas};

/// Row of a Lambertian surface under a rough coat.
#[allow(dead_code)]
pub fn coated_diffuse(colour: [f32; 3], eta: f32, alphas: [f32; 2], thickness: f32) -> [f32; 8] {
    let interface = Interface::of(alphas, eta, thickness);
    let scale = interface.scale * interface.scale;
    let [r, g, b] = colour.map(|c| scale * coated_diffuse::base_of(c, eta, interface.internal, 5));
    let [t, u, v] = interface.packed;
    [r, g, b, eta, pack_alphas(alphas[0], alphas[1]), t, u, v]
}

/// Row of copper under a coat, smooth if it has no alphas.
#[allow(dead_code)]
pub fn coated_copper(eta: f32, coat: Option<[f32; 2]>, conductor: [f32; 2]) -> [f32; 8] {
    let relative = |x: [f32; 3]| x.map(|x| x / eta);
    let layers = Layers {
        eta: relative([0.2, 0.92, 1.4]),
        k: relative([3.9, 2.4, 2.1]),
        coat_eta: eta,
        coat,
        conductor,
        thickness: 0.01,
        bounces: 5,
    };
    layers.row()
}

/// Largest change of `f` if its argument moves by a few ulps of 1: what rounding of the cosine may
/// do.
pub fn shaken(f: impl Fn(f64) -> f64, x: f64) -> f64 {
    let d = 4.0 * f64::from(f32::EPSILON);
    [-d, -d / 8.0, d / 8.0, d]
        .into_iter()
        .map(|d| (f((x + d).clamp(0.0, 1.0)) - f(x)).abs())
        .fold(0.0, f64::max)
}

/// Samples or evaluates the kernel of a kind, in packets.
pub struct Kernels;

pub type Sampled = ([f32; 3], [f32; 3], f32, f32);
pub type Evaluated = ([f32; 3], f32, f32);

impl Kernels {
    pub fn sample<L: phalanx::simd::Lanes>(
        kind: Kind,
        row: &[f32; 8],
        wo: &[[f32; 3]],
        u: &[[f32; 3]],
        mode: phalanx::surface::Mode,
    ) -> Vec<Sampled> {
        let mut out = Vec::with_capacity(wo.len());
        for (wo, u) in wo.chunks(L::N).zip(u.chunks(L::N)) {
            let last = wo.len() - 1;
            let column = |v: &[[f32; 3]], c: usize| L::from_fn(|i| v[i.min(last)][c]);
            let w = phalanx::simd::Vec3::new(column(wo, 0), column(wo, 1), column(wo, 2));
            let s = kind.sample(
                &row.map(L::splat),
                w,
                [column(u, 0), column(u, 1), column(u, 2)],
                mode,
            );
            out.extend((0..wo.len()).map(|i| {
                (
                    s.wi.lane(i),
                    s.throughput.lane(i),
                    s.pdf.lane(i),
                    s.pdf_reverse.lane(i),
                )
            }));
        }
        out
    }
    pub fn eval<L: phalanx::simd::Lanes>(
        kind: Kind,
        row: &[f32; 8],
        wo: &[[f32; 3]],
        wi: &[[f32; 3]],
        mode: phalanx::surface::Mode,
    ) -> Vec<Evaluated> {
        let mut out = Vec::with_capacity(wo.len());
        for (wo, wi) in wo.chunks(L::N).zip(wi.chunks(L::N)) {
            let last = wo.len() - 1;
            let vec = |v: &[[f32; 3]]| {
                let c = |c: usize| L::from_fn(|i| v[i.min(last)][c]);
                phalanx::simd::Vec3::new(c(0), c(1), c(2))
            };
            let v = kind.eval(&row.map(L::splat), [vec(wo), vec(wi)], mode);
            out.extend((0..wo.len()).map(|i| (v.f.lane(i), v.pdf.lane(i), v.pdf_reverse.lane(i))));
        }
        out
    }
}
