//! The transfer curve of sRGB (IEC 61966-2-1), the only place it is written down.

/// Encoded value in `[0, 1]` to linear.
pub fn decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear value to encoded; not clamped.
pub fn encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear value to the nearest 8-bit code; clamped, NaN is black.
pub fn encode_u8(linear: f32) -> u8 {
    // `as` saturates and takes NaN to 0.
    (encode(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_a_round_trip() {
        for code in 0..=255u8 {
            assert_eq!(encode_u8(decode(code as f32 / 255.0)), code);
        }
    }

    #[test]
    fn known_values_and_edges() {
        assert!((decode(0.5) - 0.214_041).abs() < 1e-6);
        assert!((encode(0.18) - 0.461_356).abs() < 1e-5);
        assert_eq!(decode(1.0), 1.0);
        assert_eq!(
            [f32::NAN, -1.0, 2.0, f32::INFINITY].map(encode_u8),
            [0, 0, 255, 255]
        );
    }
}
