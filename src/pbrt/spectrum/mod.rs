//! Spectra reduced to linear sRGB at load. Nothing downstream knows wavelengths but what disperses
//! light ([`scene::spectrum`](crate::scene::spectrum)).
//!
//! Every reduction integrates against the CIE 1931 2-degree observer in steps of 1 nm from 360 to
//! 830 nm and converts XYZ to Rec. 709 primaries with the matrix pbrt-v3 uses. They differ in what
//! counts as white:
//!
//! - a *reflectance* of pbrt-v4 is seen under D65 and divided by the same integral of a perfect
//!   white, so a constant `c` becomes `(c, c, c)`;
//! - an *illuminant* keeps its own colour and magnitude: X, Y, Z are divided by the integral of the
//!   observer's Y, as pbrt-v3 does, so a constant 1 becomes `(1.2049, 0.9482, 0.9093)`;
//! - an *index* (eta or k of a metal) reduces like a reflectance in pbrt-v4 scenes, where it must
//!   stand in for a spectral render: Fresnel reflectances of Cu, Ag, Al, MgO, TiO2 then lie within
//!   0.01 of the integrated ones;
//! - pbrt-v3, whose own build is RGB, puts all of these through the illuminant's formula:
//!   [`named_spd_file`] and [`Meaning::OfV3`] reproduce that.

mod blackbody;
mod file;
mod glass;
mod illuminants;
mod metals;
mod named;
mod reduce;
#[cfg(test)]
mod tests;

pub use self::blackbody::{
    blackbody, blackbody_medium, blackbody_reflectance, blackbody_v3, daylight, white_of_d60,
};
pub use self::file::read_spd;
pub use self::glass::{Sellmeier, glass_index};
pub use self::named::{is_sensor, named, named_index, named_spd_file};
pub use self::reduce::{Meaning, bounded_samples, hats, index_samples, light_samples, samples};
