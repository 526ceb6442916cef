//! Pictures as PNG in data URIs: what was rendered, and maps of where it is wrong.

use crate::converge::gallery::Shown;
use crate::formats::srgb;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};

/// matplotlib's viridis (Smith and van der Walt 2015, CC0) at equal steps: even in lightness, for
/// eyes of every kind and in grey.
pub const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// Decades that a scale shows.
const DECADES: f64 = 4.0;

/// A logarithmic scale of errors, the same for all maps of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// log10 of what the last colour stands for, and all above it.
    pub high: f64,
}

impl Scale {
    /// One error in a thousand, over all maps, may lie above.
    pub fn of(maps: &[Shown]) -> Self {
        let mut errors: Vec<f32> = (maps.iter().flat_map(|m| &m.errors).copied())
            .filter(|e| e.is_finite())
            .collect();
        let high = if errors.is_empty() {
            0.0
        } else {
            let rank = (errors.len() - 1) * 999 / 1000;
            let (_, value, _) = errors.select_nth_unstable_by(rank, f32::total_cmp);
            f64::from(*value).max(1e-12).log10().ceil()
        };
        Self { high }
    }

    pub fn low(&self) -> f64 {
        self.high - DECADES
    }

    fn color(&self, error: f32) -> [u8; 3] {
        // No error at all is the first colour; what is not a number stands out.
        if error.is_nan() {
            return [255, 0, 255];
        }
        let part = (f64::from(error).log10() - self.low()) / DECADES;
        let place = part.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
        let index = (place as usize).min(VIRIDIS.len() - 2);
        let between = place - index as f64;
        std::array::from_fn(|c| {
            let [a, b] = [VIRIDIS[index][c], VIRIDIS[index + 1][c]].map(f64::from);
            (a + (b - a) * between).round() as u8
        })
    }
}

/// A map of errors.
pub fn map(errors: &[f32], width: u32, height: u32, scale: Scale) -> Result<String, String> {
    let bytes: Vec<u8> = errors.iter().flat_map(|e| scale.color(*e)).collect();
    data_uri(&bytes, width, height)
}

/// A picture in sRGB, brightened by `exposure` stops.
pub fn picture(
    pixels: &[[f32; 3]],
    width: u32,
    height: u32,
    exposure: f32,
) -> Result<String, String> {
    let factor = exposure.exp2();
    let bytes: Vec<u8> = pixels
        .as_flattened()
        .iter()
        .map(|v| srgb::encode_u8(v * factor))
        .collect();
    data_uri(&bytes, width, height)
}

fn data_uri(bytes: &[u8], width: u32, height: u32) -> Result<String, String> {
    if bytes.is_empty() || bytes.len() as u64 != 3 * u64::from(width) * u64::from(height) {
        return Err(format!(
            "{} bytes do not fill {width} x {height} pixels",
            bytes.len()
        ));
    }
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(bytes, width, height, ExtendedColorType::Rgb8)
        .map_err(|e| e.to_string())?;
    Ok(format!("data:image/png;base64,{}", STANDARD.encode(png)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_scale_for_all() {
        let shown = |errors: Vec<f32>| Shown {
            pixels: Vec::new(),
            errors,
            runs: 1,
            seconds: 1.0,
            relmse_corrected: 0.0,
        };
        let scale = Scale::of(&[shown(vec![0.02; 500]), shown(vec![0.3; 500])]);
        assert_eq!((scale.low(), scale.high), (-4.0, 0.0));
        assert_eq!(Scale::of(&[]), Scale { high: 0.0 });
        assert_eq!(Scale::of(&[shown(vec![0.0; 4])]).high, -12.0);
        assert_eq!(scale.color(0.0), VIRIDIS[0]);
        assert_eq!(scale.color(1e-2), VIRIDIS[4]);
        assert_eq!(scale.color(f32::INFINITY), VIRIDIS[8]);
    }

    #[test]
    fn pictures_survive_their_encoding() {
        let uri = picture(&[[0.0; 3], [0.5, 0.0, 0.0]], 2, 1, 1.0).unwrap();
        let png = STANDARD
            .decode(uri.strip_prefix("data:image/png;base64,").unwrap())
            .unwrap();
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(image.into_raw(), [0, 0, 0, 255, 0, 0]);
        assert!(
            picture(&[], 0, 0, 0.0).is_err() && map(&[0.0], 2, 1, Scale { high: 0.0 }).is_err()
        );
    }
}
