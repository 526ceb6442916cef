//! How the entries of a film hold their sums: as integers, unless a bench build asks for the rounding of other films
//! ([`crate::switches`]). The entries are the same words whatever they hold.

use crate::switches::{self, Switch};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// Fixed point: exact.
    Fixed,
    /// Bits of an `f64`.
    Double,
    /// Bits of an `f32`.
    Single,
}

impl Format {
    /// That of the render under way.
    #[inline(always)]
    pub fn now() -> Self {
        if switches::on(Switch::FilmF32) {
            Self::Single
        } else if switches::on(Switch::FilmF64) {
            Self::Double
        } else {
            Self::Fixed
        }
    }

    /// What an entry of a film of bounded splats holds, in its units.
    #[inline(always)]
    pub fn value(self, entry: i64) -> f64 {
        match self {
            Self::Fixed => entry as f64,
            Self::Double => f64::from_bits(entry as u64),
            Self::Single => f64::from(f32::from_bits(entry as u32)),
        }
    }

    /// Adds to the bits of a floating-point sum, rounded as the format rounds.
    #[inline(always)]
    pub fn add(self, bits: u64, value: f64) -> u64 {
        match self {
            Self::Single => u64::from((f32::from_bits(bits as u32) + value as f32).to_bits()),
            _ => (f64::from_bits(bits) + value).to_bits(),
        }
    }
}
