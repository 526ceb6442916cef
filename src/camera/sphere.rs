//! Cameras that see every direction: the raster plane wrapped around the sphere.
//!
//! The frame covers the sphere once, and the plane beyond its border covers it again, as a filter
//! reaching over the border must see it: columns follow each other round the horizon, rows go on
//! over a pole. Either map repeats with twice the frame's width and height; within that period a
//! direction has four places, one on each [`Sheet`]. A region that is larger than the frame
//! therefore sees some directions more than once. Such a direction has the density of all its
//! places together, and a path joined to the camera chooses one of them uniformly, which is what a
//! camera subpath does.

use super::region::Region;
use crate::scene::SphereMap;
use crate::simd::{Lanes, Mask, Vec3, math};
use std::f32::consts::{FRAC_1_PI, PI};

/// Where a period of the plane has a place of the frame again: `sign * place + offset` in both
/// coordinates.
#[derive(Clone, Copy, Debug, Default)]
struct Sheet {
    sign: [f32; 2],
    offset: [f32; 2],
}

/// A sphere map over a film.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sphere {
    map: SphereMap,
    /// Of the frame, in pixels.
    size: [f32; 2],
    region: Region,
    sheets: [Sheet; 4],
    /// Density over solid angle of one place, times the sine of its polar angle on an
    /// equirectangular map.
    density: f32,
    /// The region is not within the frame.
    pub wraps: bool,
}

impl Sphere {
    pub fn new(map: SphereMap, width: u32, height: u32, region: Region) -> Self {
        let size = [width as f32, height as f32];
        let [w, h] = size;
        let sheet = |sign, offset| Sheet { sign, offset };
        // Over a pole the other half of the circle goes on; over an edge of the octahedral square
        // its other half, turned round.
        let sheets = match map {
            SphereMap::Equirectangular => [
                sheet([1.0, 1.0], [0.0, 0.0]),
                sheet([1.0, 1.0], [w, 0.0]),
                sheet([1.0, -1.0], [0.5 * w, 0.0]),
                sheet([1.0, -1.0], [1.5 * w, 0.0]),
            ],
            SphereMap::EqualArea => [
                sheet([1.0, 1.0], [0.0, 0.0]),
                sheet([1.0, 1.0], [w, h]),
                sheet([-1.0, -1.0], [w, 0.0]),
                sheet([-1.0, -1.0], [0.0, h]),
            ],
        };
        let pixel = match map {
            SphereMap::Equirectangular => 2.0 * PI * PI / (w * h),
            SphereMap::EqualArea => 4.0 * PI / (w * h),
        };
        let inside = region.x0 >= 0.0
            && region.y0 >= 0.0
            && region.x0 + region.width <= w
            && region.y0 + region.height <= h;
        Self {
            map,
            size,
            region,
            sheets,
            density: 1.0 / (pixel * region.area() as f32),
            wraps: !inside,
        }
    }

    /// Unit direction in camera space of a place of the plane, and its density over solid angle.
    #[inline(always)]
    pub fn direction<L: Lanes>(&self, x: L, y: L) -> (Vec3<L>, L) {
        let (u, v) = (x / L::splat(self.size[0]), y / L::splat(self.size[1]));
        let one = L::one();
        match self.map {
            SphereMap::Equirectangular => {
                let turn = u - u.floor();
                // Half turns to [-1/2, 1/2): exact near both poles.
                let half = v * L::splat(0.5);
                let half = half - (half + L::splat(0.5)).floor();
                let (sin_p, cos_p) = math::sin_cos_turns(turn);
                let (sin_t, cos_t) = math::sin_cos_turns(half);
                let w = Vec3::new(sin_t * cos_p, cos_t, sin_t * sin_p);
                let over = half.lt(L::zero());
                let base = (
                    turn + L::splat(0.5).or_zero(over),
                    half.abs() * L::splat(2.0),
                );
                (w, self.pdf(base, sin_t.abs()))
            }
            SphereMap::EqualArea => {
                let (i, j) = (u.floor(), v.floor());
                let (u, v) = (u - i, v - j);
                let sum = (i + j) * L::splat(0.5);
                let odd = sum.floor().lt(sum);
                let u = L::select(odd, one - u, u);
                let v = L::select(odd, one - v, v);
                (equal_area_sphere(u, v), self.pdf((u, v), one))
            }
        }
    }

    /// The place in the frame, in `[0, 1]` both ways, that looks along unit `d`, and the sine that
    /// its density is divided by.
    #[inline(always)]
    fn place<L: Lanes>(&self, d: Vec3<L>) -> ((L, L), L) {
        match self.map {
            SphereMap::Equirectangular => {
                let sin = d.z.mul_add(d.z, d.x * d.x).sqrt();
                let turn = math::atan2(d.z, d.x) * L::splat(0.5 * FRAC_1_PI);
                let v = math::atan2(sin, d.y) * L::splat(FRAC_1_PI);
                ((turn - turn.floor(), v), sin)
            }
            SphereMap::EqualArea => (equal_area_square(d), L::one()),
        }
    }

    /// Density over solid angle of the direction with the place `base` in the frame.
    #[inline(always)]
    fn pdf<L: Lanes>(&self, base: (L, L), sin: L) -> L {
        let one = L::splat(self.density) / sin;
        if self.wraps {
            one * self.count(base).max(L::one())
        } else {
            one
        }
    }

    /// How many places in the region show what the frame shows at `base`.
    #[inline(always)]
    fn count<L: Lanes>(&self, base: (L, L)) -> L {
        let mut count = L::zero();
        for sheet in &self.sheets {
            let (x, y) = (self.column(sheet, base.0), self.row(sheet, base.1));
            count = x.2.mul_add(y.2, count);
        }
        count
    }

    #[inline(always)]
    fn column<L: Lanes>(&self, sheet: &Sheet, u: L) -> (L, L, L) {
        let at = (u * L::splat(self.size[0]))
            .mul_add(L::splat(sheet.sign[0]), L::splat(sheet.offset[0]));
        repeats(at, 2.0 * self.size[0], self.region.x0, self.region.width)
    }

    #[inline(always)]
    fn row<L: Lanes>(&self, sheet: &Sheet, v: L) -> (L, L, L) {
        let at = (v * L::splat(self.size[1]))
            .mul_add(L::splat(sheet.sign[1]), L::splat(sheet.offset[1]));
        repeats(at, 2.0 * self.size[1], self.region.y0, self.region.height)
    }

    /// A place of the region that looks along unit `d`, and the density of `d` over solid angle;
    /// `choice` in `[0, 1)` decides between places if the region [`wraps`](Self::wraps).
    #[inline(always)]
    pub fn raster<L: Lanes>(&self, d: Vec3<L>, choice: L) -> ((L, L), L, L::Mask) {
        let (base, sin) = self.place(d);
        let defined = sin.gt(L::zero());
        let one = L::splat(self.density) / sin;
        if !self.wraps {
            let x = base.0 * L::splat(self.size[0]);
            let y = base.1 * L::splat(self.size[1]);
            let valid = defined.and(self.region.contains(x, y));
            return ((x, y), one, valid);
        }
        let count = self.count(base);
        let mut left = (choice * count)
            .floor()
            .min(count - L::one())
            .max(L::zero());
        let (mut x, mut y) = (L::zero(), L::zero());
        for sheet in &self.sheets {
            let (x0, dx, nx) = self.column(sheet, base.0);
            let (y0, dy, ny) = self.row(sheet, base.1);
            let here = left.ge(L::zero()).and(left.lt(nx * ny));
            // Whole numbers, far below the precision of a quotient.
            let row = ((left + L::splat(0.5)) / nx.max(L::one())).floor();
            let column = left - row * nx;
            x = L::select(here, column.mul_add(dx, x0), x);
            y = L::select(here, row.mul_add(dy, y0), y);
            left -= nx * ny;
        }
        let valid = defined.and(count.gt(L::zero()));
        ((x, y), one * count, valid)
    }
}

/// The places `at + k period` in `[start, start + width)`: the first, the period, and how many.
#[inline(always)]
fn repeats<L: Lanes>(at: L, period: f32, start: f32, width: f32) -> (L, L, L) {
    let below = |end: f32| -((at - L::splat(end)) / L::splat(period)).floor();
    let first = below(start);
    let count = below(start + width) - first;
    let period = L::splat(period);
    (first.mul_add(period, at), period, count)
}

/// Unit square to unit sphere, with `y` up.
#[inline(always)]
fn equal_area_sphere<L: Lanes>(u: L, v: L) -> Vec3<L> {
    let (one, two) = (L::one(), L::splat(2.0));
    let (u, v) = (u.mul_add(two, -one), v.mul_add(two, -one));
    let (a, b) = (u.abs(), v.abs());
    let signed = one - (a + b);
    let r = one - signed.abs();
    let skew = L::select(r.gt(L::zero()), (b - a) / r, L::zero());
    // Eighths of a turn.
    let (sin, cos) = math::sin_cos_turns((skew + one) * L::splat(0.125));
    let up = (one - r * r).copysign(signed);
    let s = r * (two - r * r).max(L::zero()).sqrt();
    Vec3::new((cos * s).copysign(u), up, (sin * s).copysign(v))
}

/// The inverse of [`equal_area_sphere`].
#[inline(always)]
fn equal_area_square<L: Lanes>(d: Vec3<L>) -> (L, L) {
    let (one, half) = (L::one(), L::splat(0.5));
    let (x, z) = (d.x.abs(), d.z.abs());
    // sqrt(1 - |y|) without the difference.
    let r = (x.mul_add(x, z * z) / (one + d.y.abs())).sqrt();
    let v = math::atan2(z, x) * L::splat(2.0 * FRAC_1_PI) * r;
    let u = r - v;
    let below = d.y.lt(L::zero());
    let (u, v) = (L::select(below, one - v, u), L::select(below, one - u, v));
    let square = |c: L, sign: L| c.copysign(sign).mul_add(half, half);
    (square(u, d.x), square(v, d.z))
}
