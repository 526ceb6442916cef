//! Where on the raster plane samples fall.

use crate::scene;
use crate::simd::{Lanes, Mask};

/// The part of the raster plane that samples fall in: the crop window grown by what the filter
/// reaches beyond it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Left edge, in pixels; inside.
    pub x0: f32,
    /// Upper edge, in pixels; inside.
    pub y0: f32,
    /// In pixels.
    pub width: f32,
    /// In pixels.
    pub height: f32,
}

impl Region {
    /// The region of a film: every raster position that reaches a pixel of the crop window.
    pub fn of(film: &scene::Film) -> Self {
        let [x0, x1, y0, y1] = film.crop.map(|v| v as f32);
        let (gx, gy) = (film.filter.radius.x - 0.5, film.filter.radius.y - 0.5);
        let (gx, gy) = (gx.max(0.0), gy.max(0.0));
        Self {
            x0: x0 - gx,
            y0: y0 - gy,
            width: x1 - x0 + 2.0 * gx,
            height: y1 - y0 + 2.0 * gy,
        }
    }

    /// In square pixels.
    pub fn area(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// Raster position of two primary samples.
    #[inline(always)]
    pub fn place<L: Lanes>(&self, u: L, v: L) -> (L, L) {
        (
            u.mul_add(L::splat(self.width), L::splat(self.x0)),
            v.mul_add(L::splat(self.height), L::splat(self.y0)),
        )
    }

    /// Whether it holds a raster position.
    #[inline(always)]
    pub(super) fn contains<L: Lanes>(&self, x: L, y: L) -> L::Mask {
        let inside_x = x
            .ge(L::splat(self.x0))
            .and(x.lt(L::splat(self.x0 + self.width)));
        let inside_y = y
            .ge(L::splat(self.y0))
            .and(y.lt(L::splat(self.y0 + self.height)));
        inside_x.and(inside_y)
    }
}
