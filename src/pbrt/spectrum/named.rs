//! Spectra that scenes have by name.

use super::glass::glass_index;
use super::reduce::{Meaning, reduce, unit_light};
use crate::scene::spectrum::{IndexCurve, Sample, interpolate};

/// pbrt-v4's named spectra.
///
/// - `metal-{Ag,Al,Au,Cu,CuZn,MgO,TiO2}-{eta,k}`: reduced like a reflectance (see the top of
///   `spectrum`);
/// - `glass-...`: the index at the helium d line (587.6 nm), near the maximum of the eye, the same
///   in all channels, as there is no dispersion in RGB;
/// - `stdillum-{A,D50,D65,F1...F12}`, `illum-acesD60`: luminance 1, as pbrt-v4 normalises them.
///
/// Spectral responses of cameras are not colours: `None`, see [`is_sensor`].
pub fn named(name: &str) -> Option<[f32; 3]> {
    if let Some(rest) = name.strip_prefix("metal-") {
        let (element, quantity) = rest.split_once('-')?;
        return Some(reduce(metal(element, quantity)?, Meaning::Reflectance));
    }
    if let Some(glass) = glass_index(name) {
        return Some([glass.at_d() as f32; 3]);
    }
    illuminant(name).map(|s| unit_light(|l| interpolate(s, l)))
}

/// The colour of a measured metal by the file name pbrt-v3 scenes use (`spds/metals/Au.eta.spd`,
/// any folder), for scenes that come without the file. Reduced as pbrt-v3 does
/// ([`Meaning::OfV3`]); `Cu.eta.spd` and `Cu.k.spd` are pbrt-v3's defaults of `metal`.
pub fn named_spd_file(path: &str) -> Option<[f32; 3]> {
    let file = path.rsplit(['/', '\\']).next()?;
    let (element, quantity) = file.strip_suffix(".spd")?.split_once('.')?;
    Some(reduce(metal(element, quantity)?, Meaning::OfV3))
}

/// True of the names that pbrt-v4 gives to the responses of cameras' sensors: `canon_eos_100d_r`
/// and so on.
pub fn is_sensor(name: &str) -> bool {
    let makers = ["canon_", "hasselblad_", "nikon_", "sony_"];
    makers.iter().any(|m| name.starts_with(m))
        && ["_r", "_g", "_b"].iter().any(|c| name.ends_with(c))
}

pub(super) fn metal(element: &str, quantity: &str) -> Option<&'static [Sample]> {
    use super::metals::*;
    let (eta, k): (&[Sample], &[Sample]) = match element {
        "Ag" => (&AG_ETA, &AG_K),
        "Al" => (&AL_ETA, &AL_K),
        "Au" => (&AU_ETA, &AU_K),
        "Cu" => (&CU_ETA, &CU_K),
        "CuZn" => (&CUZN_ETA, &CUZN_K),
        "MgO" => (&MGO_ETA, &MGO_K),
        "TiO2" => (&TIO2_ETA, &TIO2_K),
        _ => return None,
    };
    match quantity {
        "eta" => Some(eta),
        "k" => Some(k),
        _ => None,
    }
}

fn illuminant(name: &str) -> Option<&'static [Sample]> {
    use super::illuminants::*;
    use crate::scene::spectrum::ILLUMINANT_D65;
    Some(match name {
        "stdillum-A" => &ILLUMINANT_A,
        "stdillum-D50" => &ILLUMINANT_D50,
        "stdillum-D65" => &ILLUMINANT_D65,
        "illum-acesD60" => &ILLUMINANT_D60,
        "stdillum-F1" => &ILLUMINANT_F1,
        "stdillum-F2" => &ILLUMINANT_F2,
        "stdillum-F3" => &ILLUMINANT_F3,
        "stdillum-F4" => &ILLUMINANT_F4,
        "stdillum-F5" => &ILLUMINANT_F5,
        "stdillum-F6" => &ILLUMINANT_F6,
        "stdillum-F7" => &ILLUMINANT_F7,
        "stdillum-F8" => &ILLUMINANT_F8,
        "stdillum-F9" => &ILLUMINANT_F9,
        "stdillum-F10" => &ILLUMINANT_F10,
        "stdillum-F11" => &ILLUMINANT_F11,
        "stdillum-F12" => &ILLUMINANT_F12,
        _ => return None,
    })
}

/// pbrt-v4's named spectra as indices of refraction over the wavelength: glasses, and what it has
/// of metals.
pub fn named_index(name: &str) -> Option<IndexCurve> {
    if let Some(rest) = name.strip_prefix("metal-") {
        let (element, quantity) = rest.split_once('-')?;
        return Some(IndexCurve::of_samples(metal(element, quantity)?));
    }
    glass_index(name).map(|glass| IndexCurve::of(|nm| glass.at(nm)))
}
