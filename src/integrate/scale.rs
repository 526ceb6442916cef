//! From radiance to the film's units: its scale, and its matrix of colours.

/// Multiplies pixels by the film's scale and its matrix of colours. Values beyond `f32` are set to
/// its largest number, so that bright pixels stay numbers; returns how many.
pub(super) fn bring_to_scale(
    pixels: &mut [[f32; 3]],
    scale: f32,
    colour: Option<&[[f32; 3]; 3]>,
) -> u64 {
    const MOST: f64 = f32::MAX as f64;
    let mut beyond = 0;
    for pixel in pixels {
        let mut values = pixel.map(|v| f64::from(v).clamp(-MOST, MOST) * f64::from(scale));
        if let Some(m) = colour {
            values = m.map(|row| dot(row.map(f64::from), values));
        }
        *pixel = values.map(|v| {
            beyond += u64::from(v.abs() > MOST);
            v.clamp(-MOST, MOST) as f32
        });
    }
    beyond
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Standard errors of channels that a matrix mixes. How they vary together is not known: the larger
/// of what it is for channels that do so fully, as noise mostly does, and not at all.
pub(super) fn mixed_deviation(matrix: &[[f32; 3]; 3], deviation: [f32; 3]) -> [f32; 3] {
    let deviation = deviation.map(f64::from);
    matrix.map(|row| {
        let row = row.map(f64::from);
        let together = dot(row, deviation).abs();
        let apart = dot(row.map(|v| v * v), deviation.map(|d| d * d)).sqrt();
        together.max(apart).min(f32::MAX.into()) as f32
    })
}
