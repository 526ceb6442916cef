//! What renders know of wavelengths: indices of refraction that depend on them, and what light of
//! one is worth in red, green and blue.

mod curve;
mod index;
mod observer;
mod response;
mod rgb;

pub use self::curve::{Sample, interpolate};
pub use self::index::IndexCurve;
pub use self::observer::{CIE_1931, CIE_FIRST, ILLUMINANT_D65};
pub use self::response::{FIRST, LAST, responses, spectral_white};
pub use self::rgb::{luminance, xyz_to_rgb};
