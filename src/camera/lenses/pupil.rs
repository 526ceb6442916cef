//! Bounds of the exit pupil, as pbrt finds them: the box of all points of a grid in the rear plane
//! that see the scene, and two steps of the grid more.
//!
//! No ray is lost outside of them, so pictures depend on bounds only by
//! [`LensWeighting::Simple`](crate::scene::lenses::LensWeighting::Simple), which divides by the
//! area in the middle of the film. So that one has as many points as pbrt's; the others have as
//! many as it takes.

use crate::scene::lenses::Lenses;
use crate::simd::{Lanes, Mask, Vec3, f32x8};

/// pbrt's number of points.
const POINTS: u32 = 1 << 20;

/// Enough to find a pupil that is not tiny.
const FEW: u32 = 1 << 16;

/// Points that must have come through if there are few.
const ENOUGH: u32 = 256;

/// How much of the rays from these points in these unit directions comes through the lenses.
pub(super) type Passes<'a> = &'a dyn Fn(Vec3<f32x8>, Vec3<f32x8>) -> f32x8;

/// `[x0, x1, y0, y1]` for `count` rings of the film; `None` where nothing comes through.
pub(super) fn bounds(
    passes: Passes,
    lenses: &Lenses,
    count: usize,
    exact: bool,
) -> Vec<Option<[f64; 4]>> {
    let half = lenses.diagonal / 2.0;
    // The square around the rear lens, half as large again.
    let last = lenses.elements.last();
    let [reach, rear] = last.map_or([0.0; 2], |e| [1.5 * e.aperture_radius, e.thickness]);
    let ring = |i: usize, points: u32| {
        let [from, to] = [i, i + 1].map(|i| i as f64 / count as f64 * half);
        bound(passes, [from, to], [reach, rear], points)
    };
    (0..count)
        .map(|i| match (exact && i == 0).then(|| ring(i, POINTS)) {
            Some(found) => found.0,
            None => match ring(i, FEW) {
                (bounds, seen) if seen >= ENOUGH => bounds,
                _ => ring(i, POINTS).0,
            },
        })
        .collect()
}

/// The bounds, and how many points have come through.
fn bound(
    passes: Passes,
    [from, to]: [f64; 2],
    [reach, rear]: [f64; 2],
    points: u32,
) -> (Option<[f64; 4]>, u32) {
    let mut bounds = [
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ];
    let mut seen = 0;
    for first in (0..points).step_by(f32x8::N) {
        let along = |f: &dyn Fn(u32) -> f64| f32x8::from_fn(|i| f(first + i as u32) as f32);
        let film = Vec3::new(
            along(&|i| from + (to - from) * (f64::from(i) + 0.5) / f64::from(points)),
            f32x8::zero(),
            f32x8::zero(),
        );
        let x = along(&|i| reach * (2.0 * in_base_2(i) - 1.0));
        let y = along(&|i| reach * (2.0 * in_base_3(i) - 1.0));
        let [x0, x1, y0, y1] = bounds.map(f32x8::splat);
        let known = (x.ge(x0).and(x.le(x1))).and(y.ge(y0).and(y.le(y1)));
        if known.all() {
            seen += f32x8::N as u32;
            continue;
        }
        let rear = Vec3::new(x, y, f32x8::splat(rear as f32));
        let passed = passes(film, (rear - film).normalize());
        let through = passed.gt(f32x8::zero()).bits();
        seen += through.count_ones();
        for i in (0..f32x8::N).filter(|i| through >> i & 1 != 0) {
            let (x, y) = (x.lane(i), y.lane(i));
            let [x0, x1, y0, y1] = bounds;
            bounds = [x0.min(x), x1.max(x), y0.min(y), y1.max(y)];
        }
    }
    let step = 2.0 * (8.0f64.sqrt() * reach) / f64::from(points).sqrt();
    let [x0, x1, y0, y1] = bounds.map(f64::from);
    let grown = [x0 - step, x1 + step, y0 - step, y1 + step];
    ((seen > 0).then_some(grown), seen)
}

/// The digits of `i` behind the point, last one first.
fn in_base_2(i: u32) -> f64 {
    f64::from(i.reverse_bits()) / (1u64 << 32) as f64
}

fn in_base_3(mut i: u32) -> f64 {
    let (mut value, mut place) = (0.0, 1.0 / 3.0);
    while i > 0 {
        value += f64::from(i % 3) * place;
        i /= 3;
        place /= 3.0;
    }
    value
}
