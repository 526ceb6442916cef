//! What scene files say of surfaces of tabulated Fourier series.

use super::bsdf::Kernel;
use super::fourier::Fourier;
use super::fourier_table::FourierTable;
use super::packing::{At, BsdfMaterial, Shared};
use super::tabulated_bsdf;
use crate::scene::{Description, Dialect, Param, Parameters};
use std::sync::Arc;

/// Largest file that is read.
const MOST_BYTES: u64 = 1 << 30;

/// v3 `fourier`.
#[derive(Clone, Debug, PartialEq)]
pub struct FourierMaterial {
    /// What its file has.
    pub table: Arc<FourierTable>,
}

impl Description for FourierMaterial {
    fn params(&self) -> Vec<Param> {
        Vec::new()
    }
}

impl BsdfMaterial for FourierMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V3, "fourier")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let table = tabulated_bsdf::read(set, "bsdffile", MOST_BYTES, FourierTable::parse)?;
        Ok(Self { table })
    }

    /// What rows call the table.
    type Tables = f32;

    fn tables(&self, shared: &mut Shared) -> f32 {
        shared.tabulated.name_of(&self.table)
    }

    fn kernel(&self) -> Kernel {
        Kernel::of::<Fourier>()
    }

    fn row(&self, name: &f32, _: &At) -> [f32; 8] {
        tabulated_bsdf::row(*name)
    }
}
