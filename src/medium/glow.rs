//! Light that media emit along a ray.

use super::passed::{Passed, depths, exp};
use super::span::Span;
use super::travel::{Piece, Travel, through};
use crate::scene::{Emission, Medium, Rgb};

/// Abscissae and weights of Gauss and Legendre on `[0, 1]`.
const POINTS: [(f32, f32); 3] = [
    (0.112_701_67, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_3, 5.0 / 18.0),
];

/// Parts of a piece, at most; each has an optical depth of about 1.
const MOST_PARTS: f32 = 64.0;

/// Adds what a medium without grids emits along a length, before that is passed.
pub(super) fn add_evenly(medium: &Medium, length: f32, scatters: bool, travel: &mut Travel) {
    let Emission::Even(emission) = medium.emission else {
        return;
    };
    let straight = travel.is_straight();
    let start = through(&travel.passed, straight);
    let e = medium.extinction;
    let mut sum = [0.0; 3];
    if straight || !scatters {
        // Exponentials, in closed form.
        for c in 0..3 {
            sum[c] = start[c] * emission[c] * falling(e[c], length);
        }
    } else if e == [e[0]; 3] && travel.passed.is_grey() {
        // What passes is as much as comes so far.
        for c in 0..3 {
            sum[c] = start[c] * emission[c] * length;
        }
    } else {
        let at = |s: f32| {
            let mut there = travel.passed;
            there.add(depths(e, s), scatters);
            (there, emission)
        };
        sum = integrate(length, depths(e, length), straight, at);
    }
    add_to(travel, sum);
}

/// Adds what a medium emits in one cell of its grid, up to `end`, before that is passed.
pub(super) fn add(
    medium: &Medium,
    piece: &Piece,
    span: &Span,
    end: f32,
    scatters: bool,
    travel: &mut Travel,
) {
    let at = |s: f32| {
        let mut there = travel.passed;
        there.add(span.depths(s), scatters);
        let t = span.start() + s;
        let p = [0, 1, 2].map(|k| piece.direction[k].mul_add(t, piece.origin[k]));
        let density = span.density(s) * span.unit();
        (there, emitted(&medium.emission, p).map(|e| e * density))
    };
    let sum = integrate(end, span.depths(end), travel.is_straight(), at);
    add_to(travel, sum);
}

/// The integral of what is emitted times what passes, from 0 to `end`, where the optical depths are
/// `depths`. Exact where nothing is emitted; elsewhere to some digits.
fn integrate(end: f32, depths: Rgb, straight: bool, at: impl Fn(f32) -> (Passed, Rgb)) -> Rgb {
    let deepest = depths[0].max(depths[1]).max(depths[2]);
    let parts = deepest.ceil().clamp(1.0, MOST_PARTS);
    let width = end / parts;
    let mut sum = [0.0; 3];
    for part in 0..parts as u32 {
        for (x, weight) in POINTS {
            let (passed, emission) = at((part as f32 + x) * width);
            if emission == [0.0; 3] {
                continue;
            }
            let through = through(&passed, straight);
            for c in 0..3 {
                sum[c] += through[c] * emission[c] * (weight * width);
            }
        }
    }
    sum
}

/// The integral of `exp(-e x)` from 0 to `length`, which may be infinite if `e` is not 0.
fn falling(e: f32, length: f32) -> f32 {
    if e <= 0.0 {
        // What absorbs nothing emits nothing, however long it is.
        return if length.is_finite() { length } else { 0.0 };
    }
    let depth = e * length;
    if depth <= 1e-3 {
        // Its first terms, as the difference loses its digits.
        return length * (1.0 - 0.5 * depth);
    }
    (1.0 - exp(-depth)) / e
}

/// Per length, but for the density.
fn emitted(emission: &Emission, p: [f32; 3]) -> Rgb {
    match emission {
        Emission::Dark => [0.0; 3],
        Emission::Even(emission) => *emission,
        Emission::Grid {
            absorption,
            radiance,
            grid,
        } => [0, 1, 2].map(|c| absorption[c] * radiance[c] * grid.at(p, c)),
        Emission::Product { radiance, grids } => {
            [0, 1, 2].map(|c| radiance[c] * grids[0].at(p, c) * grids[1].at(p, c))
        }
        Emission::BlackBody {
            absorption,
            grids: [temperature, factor],
            scale,
            offset,
            table,
        } => {
            let kelvin = (temperature.at(p, 0) - offset) * scale;
            if kelvin.is_nan() || kelvin <= 100.0 || table.len() < 2 {
                return [0.0; 3];
            }
            let x = (kelvin / Emission::KELVIN_STEP).min((table.len() - 1) as f32);
            let i = (x as usize).min(table.len() - 2);
            let part = x - i as f32;
            let mix = |c: usize| (table[i + 1][c] - table[i][c]).mul_add(part, table[i][c]);
            let factor = factor.at(p, 0);
            [0, 1, 2].map(|c| absorption[c] * factor * mix(c))
        }
    }
}

fn add_to(travel: &mut Travel, sum: Rgb) {
    if let Some(glow) = &mut travel.glow {
        for c in 0..3 {
            glow[c] += sum[c];
        }
    }
}
