//! Values at some wavelengths, and what is between them.

/// (wavelength in nanometres, value)
pub type Sample = (f32, f32);

/// Linear interpolation, held constant beyond both ends. `spectrum` is sorted and not empty.
pub fn interpolate(spectrum: &[Sample], lambda: f64) -> f64 {
    let above = spectrum.partition_point(|s| (s.0 as f64) < lambda);
    let Some(&(l1, v1)) = spectrum.get(above) else {
        return spectrum[spectrum.len() - 1].1 as f64;
    };
    if above == 0 {
        return v1 as f64;
    }
    let (l0, v0) = spectrum[above - 1];
    let t = (lambda - l0 as f64) / (l1 as f64 - l0 as f64);
    v0 as f64 + t * (v1 as f64 - v0 as f64)
}
