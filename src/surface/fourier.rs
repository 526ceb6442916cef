//! Surfaces of tabulated Fourier series (pbrt-v3's `fourier`): [`FourierTable`] in lanes.
//!
//! Values are those of the camera's direction `wo` and the light's `wi`; with [`Mode::Importance`]
//! the two change places, so that both kinds of walk see one function even where a table is not
//! quite reciprocal. Look-ups are bound by memory: they go lane by lane, in `f64`.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::fourier_table::FourierTable;
use super::tabulated::Tabulated;
use super::tabulated_bsdf;
use crate::simd::{Lanes, Vec3};

/// Row: name of a [`FourierTable`].
pub struct Fourier;

type V = [f64; 3];

/// Value of one pair of directions, and both densities.
#[derive(Clone, Copy, Default)]
struct Pair {
    f: [f32; 3],
    pdf: f32,
    reverse: f32,
}

/// Cosine of the azimuth between the projections of two directions; 1 where one has none.
fn cos_azimuth(a: V, b: V) -> f64 {
    let norm = a[0].hypot(a[1]) * b[0].hypot(b[1]);
    match norm > 0.0 {
        true => ((a[0] * b[0] + a[1] * b[1]) / norm).clamp(-1.0, 1.0),
        false => 1.0,
    }
}

fn pair(table: &FourierTable, wo: V, wi: V, mode: Mode) -> Pair {
    // Towards the light `-wi` is where it goes: the azimuth between is that of both pairs.
    let cos_phi = -cos_azimuth(wo, wi);
    let forth = table.value(-wi[2], wo[2], cos_phi);
    let back = table.value(-wo[2], wi[2], cos_phi);
    let density = |value: V, mu_o: f64| {
        let total = table.total(mu_o);
        match total > 0.0 && value[0] > 0.0 {
            true => (value[0] / total) as f32,
            false => 0.0,
        }
    };
    let (value, light) = match mode {
        Mode::Radiance => (forth, wi[2]),
        Mode::Importance => (back, wo[2]),
    };
    let mut scale = 1.0 / light.abs();
    if wo[2] * wi[2] < 0.0 {
        scale *= table.radiance_scale(-light);
    }
    let f = table.rgb(value).map(|v| (v * scale) as f32);
    Pair {
        f: if f.iter().all(|v| v.is_finite()) {
            f
        } else {
            [0.0; 3]
        },
        pdf: density(forth, wo[2]),
        reverse: density(back, wi[2]),
    }
}

fn wide(w: [f32; 3]) -> V {
    w.map(f64::from)
}

/// A unit direction for a walk that comes along `wo`; zero if there is none.
fn sampled(table: &FourierTable, wo: V, u: [f64; 2]) -> [f32; 3] {
    let Some([mu_i, phi]) = table.sample(wo[2], u) else {
        return [0.0; 3];
    };
    let flat = wo[0].hypot(wo[1]);
    let [x, y] = match flat > 0.0 {
        true => [wo[0] / flat, wo[1] / flat],
        false => [1.0, 0.0],
    };
    let (sin, cos) = phi.sin_cos();
    let r = (1.0 - mu_i * mu_i).max(0.0).sqrt();
    [-r * (cos * x - sin * y), -r * (sin * x + cos * y), -mu_i].map(|v| v as f32)
}

fn gathered<L: Lanes>(pairs: &[Pair; 8]) -> BsdfValue<L> {
    let f = |c: usize| L::from_fn(|i| pairs[i].f[c]);
    BsdfValue {
        f: Vec3::new(f(0), f(1), f(2)),
        pdf: L::from_fn(|i| pairs[i].pdf),
        pdf_reverse: L::from_fn(|i| pairs[i].reverse),
    }
}

impl Bsdf for Fourier {
    const NAME: &'static str = "Fourier series";
    const DELTA: bool = false;
    const LOBES: bool = false;
    const WHOLE: bool = true;

    /// Without a table there is nothing.
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        Self::sample_in(&Tabulated::default(), row, wo, u, mode)
    }

    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, mode: Mode) -> BsdfValue<L> {
        Self::eval_in(&Tabulated::default(), row, wo, wi, mode)
    }

    fn sample_in<L: Lanes>(
        tables: &Tabulated,
        row: &[L; 8],
        wo: Vec3<L>,
        u: [L; 3],
        mode: Mode,
    ) -> BsdfSample<L> {
        tabulated_bsdf::sample::<Self, L>(tables, row, wo, mode, |lane| {
            let table = tables.get::<FourierTable>(row[0].lane(lane))?;
            let u = [u[0].lane(lane).into(), u[1].lane(lane).into()];
            Some(sampled(table, wide(wo.lane(lane)), u))
        })
    }

    fn eval_in<L: Lanes>(
        tables: &Tabulated,
        row: &[L; 8],
        wo: Vec3<L>,
        wi: Vec3<L>,
        mode: Mode,
    ) -> BsdfValue<L> {
        let mut pairs = [Pair::default(); 8];
        for (lane, found) in pairs.iter_mut().enumerate().take(L::N) {
            let (wo, wi) = (wide(wo.lane(lane)), wide(wi.lane(lane)));
            if let Some(table) = tables.get::<FourierTable>(row[0].lane(lane))
                && wo[2] * wi[2] != 0.0
            {
                *found = pair(table, wo, wi, mode);
            }
        }
        gathered(&pairs)
    }
}
