//! Pieces of rays through grids: cell after cell, in each of which what is interpolated is a cubic
//! polynomial along the ray, whose integral is exact.

use super::travel::Piece;
use crate::scene::Grid;

/// What a ray meets in one cell.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Where the ray enters and leaves it, in units of the ray's direction's length.
    pub range: [f32; 2],
    /// Indices of the sample at its lowest corner.
    corner: [i32; 3],
    /// Where the ray enters, relative to that corner.
    enter: [f32; 3],
    /// How that changes along the ray.
    slope: [f32; 3],
}

/// Density along a piece of a ray: `c[0] + c[1] s + c[2] s^2 + c[3] s^3` at `s` beyond its start.
pub type Cubic = [f32; 4];

/// The integral of a cubic from its start to `s`.
pub fn integral(c: Cubic, s: f32) -> f32 {
    let inner = (c[3] * 0.25).mul_add(s, c[2] * (1.0 / 3.0));
    inner.mul_add(s, c[1] * 0.5).mul_add(s, c[0]).max(0.0) * s
}

/// A cubic `s` beyond its start; never below 0.
pub fn value(c: Cubic, s: f32) -> f32 {
    (c[3].mul_add(s, c[2]).mul_add(s, c[1]).mul_add(s, c[0])).max(0.0)
}

impl Cell {
    /// What is interpolated in it of channel `channel` of a grid, along the ray.
    pub fn cubic(&self, grid: &Grid, channel: usize) -> Cubic {
        let [i, j, k] = self.corner;
        let at = |x, y, z| grid.sample([i + x, j + y, k + z], channel);
        let v000 = at(0, 0, 0);
        let v100 = at(1, 0, 0);
        let v010 = at(0, 1, 0);
        let v110 = at(1, 1, 0);
        let v001 = at(0, 0, 1);
        let v101 = at(1, 0, 1);
        let v011 = at(0, 1, 1);
        let v111 = at(1, 1, 1);
        if (v000 == 0.0)
            & (v100 == 0.0)
            & (v010 == 0.0)
            & (v110 == 0.0)
            & (v001 == 0.0)
            & (v101 == 0.0)
            & (v011 == 0.0)
            & (v111 == 0.0)
        {
            return [0.0; 4];
        }
        let ([x, y, z], [u, v, w]) = (self.enter, self.slope);
        // Linear in x, with coefficients of y and z; then y, then z, all of them linear in s.
        let along_x = |a: f32, b: f32| [(b - a).mul_add(x, a), (b - a) * u];
        let mix = |a: [f32; 2], b: [f32; 2]| {
            let d = [b[0] - a[0], b[1] - a[1]];
            [
                d[0].mul_add(y, a[0]),
                d[1].mul_add(y, a[1]) + d[0] * v,
                d[1] * v,
            ]
        };
        let low = mix(along_x(v000, v100), along_x(v010, v110));
        let high = mix(along_x(v001, v101), along_x(v011, v111));
        let d = [high[0] - low[0], high[1] - low[1], high[2] - low[2]];
        [
            d[0].mul_add(z, low[0]),
            d[1].mul_add(z, low[1]) + d[0] * w,
            d[2].mul_add(z, low[2]) + d[1] * w,
            d[2] * w,
        ]
    }
}

/// Whether a walk goes on.
pub type GoesOn = bool;

/// Tells `see` of the cells of a grid that a piece of a ray crosses, in order, as long as it wants
/// to know.
pub fn walk(grid: &Grid, piece: &Piece, mut see: impl FnMut(&Cell) -> GoesOn) {
    let row = |m: &[f32; 4], v: [f32; 3]| m[0].mul_add(v[0], m[1].mul_add(v[1], m[2] * v[2]));
    let o = [0, 1, 2].map(|k| row(&grid.to_grid[k], piece.origin) + grid.to_grid[k][3]);
    let d = [0, 1, 2].map(|k| row(&grid.to_grid[k], piece.direction));
    let Some([start, end]) = clip(grid, piece.range, o, d) else {
        return;
    };
    let at = |t: f32| [0, 1, 2].map(|k| d[k].mul_add(t, o[k]));
    let size = grid.size.map(|n| n as i32);
    let enter = at(start);
    let mut corner = [0, 1, 2].map(|k| (enter[k].floor() as i32).clamp(-1, size[k] - 1));
    let mut t = start;
    // Every step crosses a plane of the grid.
    let most = 4 + size.iter().map(|n| *n as usize + 2).sum::<usize>();
    for _ in 0..most {
        let mut next = end;
        let mut axis = None;
        for k in 0..3 {
            let plane = match d[k] {
                d if d > 0.0 => corner[k] + 1,
                d if d < 0.0 => corner[k],
                _ => continue,
            };
            let crossing = (plane as f32 - o[k]) / d[k];
            if crossing < next {
                next = crossing;
                axis = Some(k);
            }
        }
        let next = next.max(t);
        let p = at(t);
        let cell = Cell {
            range: [t, next],
            corner,
            enter: [0, 1, 2].map(|k| (p[k] - corner[k] as f32).clamp(0.0, 1.0)),
            slope: d,
        };
        if next > t && !see(&cell) {
            return;
        }
        let Some(axis) = axis else {
            return;
        };
        corner[axis] += if d[axis] > 0.0 { 1 } else { -1 };
        if corner[axis] < -1 || corner[axis] >= size[axis] {
            return;
        }
        t = next;
    }
}

/// The part of a range in which a ray is inside a grid.
fn clip(grid: &Grid, [start, end]: [f32; 2], o: [f32; 3], d: [f32; 3]) -> Option<[f32; 2]> {
    let (mut low, mut high) = (start, end);
    for k in 0..3 {
        let sides = [grid.bounds[0][k], grid.bounds[1][k]];
        if d[k] == 0.0 {
            if o[k] < sides[0] || o[k] > sides[1] {
                return None;
            }
            continue;
        }
        let [a, b] = sides.map(|side| (side - o[k]) / d[k]);
        low = low.max(a.min(b));
        high = high.min(a.max(b));
    }
    // A range that is not a number is empty, too.
    (low < high).then_some([low, high])
}
