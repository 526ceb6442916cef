//! A piece of a ray in one cell of a grid: optical depths along it, and their inverse.

use super::grid::{Cell, Cubic, integral, value};
use super::passed::{OPAQUE, Passed};
use crate::scene::{Density, Medium, Rgb};

/// How dense a medium is along a ray in one cell.
pub struct Span<'a> {
    medium: &'a Medium,
    range: [f32; 2],
    /// Length of the ray's direction.
    unit: f32,
    densities: Densities,
}

enum Densities {
    One(Cubic),
    /// Of the extinction and of the scattering.
    Channels([[Cubic; 3]; 2]),
}

impl<'a> Span<'a> {
    /// In a cell; `unit` is the length of the ray's direction.
    pub fn new(medium: &'a Medium, cell: &Cell, unit: f32) -> Self {
        let densities = match &medium.density {
            Density::Uniform => Densities::One([1.0, 0.0, 0.0, 0.0]),
            Density::Grid(grid) => Densities::One(cell.cubic(grid, 0)),
            Density::Channels {
                extinction,
                scattering,
            } => Densities::Channels(
                [extinction, scattering].map(|grid| [0, 1, 2].map(|c| cell.cubic(grid, c))),
            ),
        };
        Self {
            medium,
            range: cell.range,
            unit,
            densities,
        }
    }

    /// In units of the length of the ray's direction, as all distances here.
    pub fn length(&self) -> f32 {
        self.range[1] - self.range[0]
    }

    /// Where it starts along the ray.
    pub fn start(&self) -> f32 {
        self.range[0]
    }

    /// Length of a distance in internal space.
    pub fn unit(&self) -> f32 {
        self.unit
    }

    /// Optical depths from its start to `s` beyond it.
    pub fn depths(&self, s: f32) -> Rgb {
        let e = self.medium.extinction.map(|e| e * self.unit);
        match &self.densities {
            Densities::One(c) => {
                let d = integral(*c, s);
                e.map(|e| (e * d).min(OPAQUE))
            }
            Densities::Channels([of, _]) => {
                [0, 1, 2].map(|c| (e[c] * integral(of[c], s)).min(OPAQUE))
            }
        }
    }

    /// Extinction and scattering per internal length, `s` beyond its start.
    pub fn coefficients(&self, s: f32) -> [Rgb; 2] {
        let of = [self.medium.extinction, self.medium.scattering];
        match &self.densities {
            // Of a weight, in which these stand above and below, only the ratio counts.
            Densities::One(c) => {
                let d = value(*c, s);
                let d = if d > 0.0 { d } else { 1.0 };
                of.map(|of| of.map(|e| e * d))
            }
            Densities::Channels(cubics) => {
                [0, 1].map(|i| [0, 1, 2].map(|c| of[i][c] * value(cubics[i][c], s)))
            }
        }
    }

    /// The density `s` beyond its start, by which what is even in a medium is multiplied.
    pub fn density(&self, s: f32) -> f32 {
        match &self.densities {
            Densities::One(c) => value(*c, s),
            Densities::Channels(_) => 1.0,
        }
    }

    /// How far beyond its start the logarithm of the mean transmittance falls to `least`, which it
    /// does before its end: Newton's method, between bounds.
    pub fn invert(&self, passed: &Passed, least: f32) -> f32 {
        let (mut low, mut high) = (0.0, self.length());
        let mut s = 0.5 * high;
        for _ in 0..MOST_STEPS {
            let mut there = *passed;
            there.add(self.depths(s), true);
            let [extinction, _] = self.coefficients(s);
            let above = there.log_mean() - least;
            if above > 0.0 {
                low = s;
            } else {
                high = s;
            }
            let slope = there.slope(extinction) * self.unit;
            let next = s + above / slope;
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - s).abs() <= 2.0 * f32::EPSILON * next {
                return next;
            }
            s = next;
        }
        s
    }
}

/// Halving alone comes to the last digit.
const MOST_STEPS: usize = 32;
