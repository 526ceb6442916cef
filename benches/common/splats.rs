//! Splats for films.

/// A colour in linear sRGB, and a raster position in pixels.
pub type Splat = ([f32; 3], [f32; 2]);

/// So many splats of random colours all over a square film; many logs' worth, so that the same
/// pixels do not come again at once.
pub fn splats(side: u32, count: usize) -> Vec<Splat> {
    let mut state = 0x5eed_u64;
    let mut unit = || {
        // xorshift64*.
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / 16_777_216.0
    };
    let side = side as f32;
    let one = |_| {
        let (r, g, x, y) = (unit(), unit(), side * unit(), side * unit());
        ([r, g, 3.0 - r - g], [x, y])
    };
    (0..count).map(one).collect()
}
