//! Pictures as textures and lights use them: linear, `f32`, row 0 on top.

use super::Rgb;

/// A linear RGB image.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where it was read from, for reports.
    pub name: String,
    /// In texels.
    pub width: u32,
    /// In texels.
    pub height: u32,
    /// `width * height` texels, row by row from the top, linear sRGB.
    pub texels: Vec<Rgb>,
}
