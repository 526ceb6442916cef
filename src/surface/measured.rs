//! Measured surfaces (pbrt-v4's `measured`): [`MeasuredTable`] in lanes.
//!
//! Values are those of the camera's direction and the light's, in this order, in either mode, so
//! that both kinds of walk see one function: tables are reciprocal only nearly.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use super::diffuse::same_side;
use super::measured_table::MeasuredTable;
use super::packing::{At, BsdfMaterial, Shared};
use super::tabulated::Tabulated;
use super::tabulated_bsdf;
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Vec3};
use std::sync::Arc;

/// Row: name of a [`MeasuredTable`].
pub struct Measured;

type V = [f64; 3];

/// Turned so that `wo` is in the upper hemisphere, as pbrt does.
fn up(wo: [f32; 3], w: [f32; 3]) -> V {
    let sign = if wo[2] < 0.0 { -1.0 } else { 1.0 };
    w.map(|x| sign * f64::from(x))
}

impl Bsdf for Measured {
    const NAME: &'static str = "measured";
    const DELTA: bool = false;
    const LOBES: bool = false;

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
            let o = wo.lane(lane);
            let u = [u[0].lane(lane).into(), u[1].lane(lane).into()];
            let table = tables.get::<MeasuredTable>(row[0].lane(lane))?;
            let found = table.sample(up(o, o), u)?;
            Some(found.map(|x| if o[2] < 0.0 { -x as f32 } else { x as f32 }))
        })
    }

    fn eval_in<L: Lanes>(
        tables: &Tabulated,
        row: &[L; 8],
        wo: Vec3<L>,
        wi: Vec3<L>,
        mode: Mode,
    ) -> BsdfValue<L> {
        let valid = same_side(wo, wi);
        let mut found = [([0.0; 3], 0.0, 0.0); 8];
        for (lane, found) in found.iter_mut().enumerate().take(L::N) {
            let (o, i) = (wo.lane(lane), wi.lane(lane));
            let Some(table) = tables.get::<MeasuredTable>(row[0].lane(lane)) else {
                continue;
            };
            if o[2] * i[2] > 0.0 {
                let (wo, wi) = (up(o, o), up(o, i));
                let (forth, back) = (table.value(wo, wi), table.value(wi, wo));
                let f = match mode {
                    Mode::Radiance => forth.0,
                    Mode::Importance => back.0,
                };
                *found = (f, forth.1, back.1);
            }
        }
        let f = |c: usize| L::from_fn(|i| found[i].0[c] as f32);
        let f = Vec3::new(f(0), f(1), f(2));
        let finite = (f.x + f.y + f.z).is_finite();
        BsdfValue {
            f: f.or_zero(finite).or_zero(valid),
            pdf: L::from_fn(|i| found[i].1 as f32),
            pdf_reverse: L::from_fn(|i| found[i].2 as f32),
        }
    }
}

/// Largest file that is read.
const MOST_BYTES: u64 = 1 << 31;

/// v4 `measured`.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredMaterial {
    /// What its file has.
    pub table: Arc<MeasuredTable>,
}

impl Description for MeasuredMaterial {
    fn params(&self) -> Vec<Param> {
        Vec::new()
    }

    /// Some are, and what is not loses nothing by a tangent.
    fn is_anisotropic(&self) -> bool {
        true
    }
}

impl BsdfMaterial for MeasuredMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V4, "measured")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let parse = |bytes: &[u8]| MeasuredTable::parse(bytes, |nm| set.hats(nm));
        let table = tabulated_bsdf::read(set, "filename", MOST_BYTES, parse)?;
        Ok(Self { table })
    }

    /// What rows call the table.
    type Tables = f32;

    fn tables(&self, shared: &mut Shared) -> f32 {
        shared.tabulated.name_of(&self.table)
    }

    fn kernel(&self) -> Kernel {
        Kernel::of::<Measured>()
    }

    fn row(&self, name: &f32, _: &At) -> [f32; 8] {
        tabulated_bsdf::row(*name)
    }
}
