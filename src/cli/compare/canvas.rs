//! A picture to draw and write on, in 8-bit sRGB.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::formats::{Picture, srgb};

pub type Color = [u8; 3];

pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

/// Sizes of text.
#[derive(Clone, Copy)]
pub enum Text {
    Small,
    Large,
}

impl Text {
    fn raster(self) -> RasterHeight {
        match self {
            Self::Small => RasterHeight::Size16,
            Self::Large => RasterHeight::Size32,
        }
    }

    /// Pixels from line to line.
    pub fn height(self) -> usize {
        self.raster().val()
    }

    /// Pixels of a line of text.
    pub fn width(self, text: &str) -> usize {
        text.chars().count() * get_raster_width(FontWeight::Regular, self.raster())
    }
}

impl Canvas {
    pub fn new(width: usize, height: usize, color: Color) -> Self {
        Self {
            width,
            height,
            pixels: vec![color; width * height],
        }
    }

    /// Nothing happens outside of the canvas.
    pub fn set(&mut self, x: usize, y: usize, color: Color) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = color;
        }
    }

    pub fn fill(&mut self, [x, y]: [usize; 2], [width, height]: [usize; 2], color: Color) {
        for row in y..y + height {
            (x..x + width).for_each(|column| self.set(column, row, color));
        }
    }

    /// Writes a line whose left top is at `(x, y)`; characters that the font lacks are gaps.
    pub fn write(&mut self, [x, y]: [usize; 2], text: &str, size: Text, color: Color) {
        let step = size.width(" ");
        for (i, c) in text.chars().enumerate() {
            let Some(glyph) = get_raster(c, FontWeight::Regular, size.raster()) else {
                continue;
            };
            for (row, coverages) in glyph.rows().enumerate() {
                for (column, coverage) in coverages.iter().enumerate() {
                    self.blend(x + i * step + column, y + row, color, *coverage);
                }
            }
        }
    }

    fn blend(&mut self, x: usize, y: usize, color: Color, coverage: u8) {
        if x < self.width && y < self.height {
            let pixel = &mut self.pixels[y * self.width + x];
            let c = u32::from(coverage);
            for (below, above) in pixel.iter_mut().zip(color) {
                *below = ((u32::from(*below) * (255 - c) + u32::from(above) * c) / 255) as u8;
            }
        }
    }

    /// As linear values whose 8-bit sRGB is what was drawn.
    pub fn picture(&self) -> Picture {
        let decode = |code: u8| srgb::decode(f32::from(code) / 255.0);
        let size = [self.width as u32, self.height as u32];
        Picture {
            width: size[0],
            height: size[1],
            offset: [0; 2],
            full: size,
            pixels: self.pixels.iter().map(|p| p.map(decode)).collect(),
        }
    }
}
