//! Tiles of the picture: where errors are told place by place.

use crate::simd::{Lanes, UintLanes};

/// Pixels along each side of a tile; those at the right and the bottom may be smaller.
pub const TILE: u32 = 16;

/// Independent groups, of chains of a depth or of passes over the picture, whose sums are kept
/// apart tile by tile.
pub const GROUPS: usize = 16;

/// Passes over a picture whose samples are independent: a pass and those that come a multiple of
/// this after it share out each pixel among them. Even passes and odd ones are independent.
pub const SEQUENCES: usize = 4;

/// The tiles of a crop window, row by row from its top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiling {
    /// `[x0, x1, y0, y1]` of the crop window, in pixels.
    crop: [i32; 4],
    /// Tiles from left to right.
    pub columns: usize,
    /// Tiles from top to bottom.
    pub rows: usize,
}

impl Tiling {
    /// Of a crop window `[x0, x1, y0, y1]` in pixels, whose ends are not in it.
    pub fn new(crop: [u32; 4]) -> Self {
        let [x0, x1, y0, y1] = crop;
        let count = |n: u32| n.div_ceil(TILE) as usize;
        Self {
            crop: crop.map(|v| v as i32),
            columns: count(x1 - x0),
            rows: count(y1 - y0),
        }
    }

    /// Tiles in all.
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }
    /// True of an empty crop window.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Column and row of the tile at raster position `[x, y]` (in pixels), or of the nearest to it.
    #[inline(always)]
    pub fn at(&self, [x, y]: [f32; 2]) -> [usize; 2] {
        let [x0, x1, y0, y1] = self.crop;
        let x = (x as i32).clamp(x0, x1 - 1) - x0;
        let y = (y as i32).clamp(y0, y1 - 1) - y0;
        [x, y].map(|v| v as usize / TILE as usize)
    }

    /// [`Self::at`] as an index.
    #[inline(always)]
    pub fn index(&self, raster: [f32; 2]) -> usize {
        let [column, row] = self.at(raster);
        row * self.columns + column
    }

    /// [`Self::index`] in lanes, as bits. Raster positions are finite.
    #[inline(always)]
    pub fn indices<L: Lanes>(&self, x: L, y: L) -> L::Uint {
        let [x0, x1, y0, y1] = self.crop.map(|v| v as f32);
        let tile = |v: L, low: f32, high: f32| {
            let inside = v.max(L::splat(low)).min(L::splat(high - 1.0)) - L::splat(low);
            (inside * L::splat(1.0 / TILE as f32)).floor()
        };
        // Exact: there are fewer than 2^22 tiles.
        let index = tile(y, y0, y1).mul_add(L::splat(self.columns as f32), tile(x, x0, x1));
        // Beside 2^23 the last bit is worth 1.
        let beside = (index + L::splat(8_388_608.0)).to_bits();
        beside.and(L::Uint::splat(0x7f_ffff))
    }

    /// Raster positions `[x0, x1, y0, y1]` of the pixels of a tile.
    pub fn bounds(&self, tile: usize) -> [u32; 4] {
        let [x0, x1, y0, y1] = self.crop.map(|v| v as u32);
        let x = x0 + (tile % self.columns) as u32 * TILE;
        let y = y0 + (tile / self.columns) as u32 * TILE;
        [x, (x + TILE).min(x1), y, (y + TILE).min(y1)]
    }

    /// Number of pixels of a tile.
    pub fn pixels(&self, tile: usize) -> u32 {
        let [x0, x1, y0, y1] = self.bounds(tile);
        (x1 - x0) * (y1 - y0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_the_crop_window_once() {
        let crop = [5, 5 + 40, 3, 3 + 33];
        let tiling = Tiling::new(crop);
        assert_eq!((tiling.columns, tiling.rows), (3, 3));
        let mut count = vec![0; tiling.len()];
        for y in crop[2]..crop[3] {
            for x in crop[0]..crop[1] {
                let tile = tiling.index([x as f32 + 0.5, y as f32 + 0.5]);
                let [x0, x1, y0, y1] = tiling.bounds(tile);
                assert!((x0..x1).contains(&x) && (y0..y1).contains(&y));
                count[tile] += 1;
            }
        }
        for (tile, n) in count.iter().enumerate() {
            assert_eq!(*n, tiling.pixels(tile));
        }
        for raster in [
            [5.0, 3.0],
            [44.9, 35.9],
            [20.99, 19.0],
            [-7.0, 1e6],
            [21.0, 18.9],
        ] {
            let lanes = tiling.indices::<f32>(raster[0], raster[1]).lane(0);
            assert_eq!(lanes as usize, tiling.index(raster), "{raster:?}");
        }
        // Filters reach samples beyond the window.
        assert_eq!(tiling.index([-3.0, 0.0]), 0);
        assert_eq!(tiling.index([1e9, 1e9]), 8);
    }
}
