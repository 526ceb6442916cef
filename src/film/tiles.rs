//! Tiles of the picture: where errors are told place by place.

/// Pixels along each side of a tile; those at the right and the bottom may be smaller.
pub const TILE: u32 = 16;

/// The tiles of a crop window, row by row from its top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiling {
    /// `[x0, x1, y0, y1]` of the crop window, in pixels.
    crop: [i32; 4],
    pub columns: usize,
    pub rows: usize,
}

impl Tiling {
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

    /// Rows of tiles that pixels `first..end` of the crop window, counted row by row, lie in.
    pub(super) fn rows_of(&self, first: usize, end: usize) -> std::ops::Range<usize> {
        let width = (self.crop[1] - self.crop[0]) as usize;
        let row = |pixel: usize| pixel / width / TILE as usize;
        row(first)..row(end - 1) + 1
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
        // Filters reach samples beyond the window.
        assert_eq!(tiling.index([-3.0, 0.0]), 0);
        assert_eq!(tiling.index([1e9, 1e9]), 8);
        assert_eq!(tiling.rows_of(0, 40 * 16), 0..1);
        assert_eq!(tiling.rows_of(40 * 15, 40 * 16 + 1), 0..2);
    }
}
