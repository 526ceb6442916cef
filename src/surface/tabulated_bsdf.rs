//! What BSDFs share that are all in the table they name.

use std::sync::Arc;

use super::bsdf::{Bsdf, BsdfSample, Mode};
use super::tabulated::Tabulated;
use crate::scene::Parameters;
use crate::simd::{Lanes, Vec3};

/// Reads the table of a material from the file that a parameter names.
///
/// # Errors
/// No file, a file of more than `most` bytes, and what `parse` finds wrong with it.
pub(super) fn read<T, P: Parameters>(
    set: &P,
    parameter: &str,
    most: u64,
    parse: impl FnOnce(&[u8]) -> Result<T, String>,
) -> Result<Arc<T>, P::Error> {
    let Some(bytes) = set.file(parameter, most)? else {
        return Err(set.error(format_args!("needs a \"string {parameter}\"")));
    };
    let table = parse(&bytes).map_err(|why| set.error(format_args!("its file {why}")))?;
    Ok(Arc::new(table))
}

/// The row of a BSDF that is all in the table it names.
pub(super) fn row(name: f32) -> [f32; 8] {
    [name, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
}

/// A sample in the direction that each lane finds by itself, weighed by what `B` evaluates there;
/// a lane that finds none has 0.
pub(super) fn sample<B: Bsdf, L: Lanes>(
    tables: &Tabulated,
    row: &[L; 8],
    wo: Vec3<L>,
    mode: Mode,
    direction: impl Fn(usize) -> Option<[f32; 3]>,
) -> BsdfSample<L> {
    let mut found = [[0.0; 3]; 8];
    for (lane, found) in found.iter_mut().enumerate().take(L::N) {
        *found = direction(lane).unwrap_or_default();
    }
    let along = |c: usize| L::from_fn(|i| found[i][c]);
    let wi = Vec3::new(along(0), along(1), along(2));
    let value = B::eval_in(tables, row, wo, wi, mode);
    let weight = value.f * (wi.z.abs() / value.pdf);
    let valid = value.pdf.gt(L::zero());
    BsdfSample {
        wi,
        throughput: weight.or_zero(valid),
        pdf: value.pdf,
        pdf_reverse: value.pdf_reverse,
    }
}
