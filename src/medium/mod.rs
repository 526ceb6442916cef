//! Media: where light is scattered between surfaces, and how much of it passes.
//!
//! 1. [`MediumTable`] borrows the media of a scene. It knows neither surfaces nor rays' hits: it is
//!    asked about a piece of a ray that lies in one medium.
//! 2. The optical depth of such a piece is integrated exactly; it is no random number
//!    ([`MediumTable::pass`]).
//! 3. Where a ray is scattered is the inverse of a function of one primary sample `u`
//!    ([`MediumTable::scatter`]): the place where the mean transmittance over the channels, from
//!    the start of the ray, is `1 - u`. The density of that is the mean over the channels of
//!    `extinction * transmittance`, as of a distance sampled in a channel that is chosen at random
//!    and weighed against the others (pbrt-v3, section 15.2.1), but no channel is chosen: a small
//!    change of the sample is a small change of the path, whatever the colour of the medium.
//! 4. Media that do not scatter are passed, and take away what they absorb.
//! 5. What a medium emits is integrated along the pieces that a ray passes ([`Travel::glow`]), as
//!    far as it comes: over the probability that it comes so far, which makes up for the rest.
//! 6. In a [`grid`] the ray goes from cell to cell. What is interpolated in a cell is a cubic
//!    polynomial along the ray, so that its integral is exact; it is inverted by Newton's method.
//! 7. [`henyey_greenstein`] is the phase function.

mod glow;
pub mod grid;
pub mod henyey_greenstein;
mod passed;
mod span;

use self::grid::walk;
pub use self::passed::{Passed, ln_1m};
use self::span::Span;
use crate::scene::{Density, Emission, Media, Medium, NONE, Rgb};

/// A piece of a ray: `origin + t direction` for `t` in a range.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Where the ray starts.
    pub origin: [f32; 3],
    /// Where it goes, of any length but 0.
    pub direction: [f32; 3],
    /// Where the piece starts and ends, in units of the direction's length. The end may be
    /// infinite.
    pub range: [f32; 2],
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
pub struct Travel {
    /// What it has passed so far.
    pub passed: Passed,
    /// It is scattered where the logarithm of its mean transmittance falls to this: `ln(1 - u)` of
    /// a primary sample `u`. Negative infinity if it is not scattered.
    pub least: f32,
    /// What it has been lit with on its way by media, over the probability that it came to there;
    /// `None` if nobody asks.
    pub glow: Option<Rgb>,
}

/// Where a ray is scattered in a medium.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// How far along it, in units of its direction's length.
    pub t: f32,
    /// Scattering times transmittance over the density of the distance.
    pub weight: Rgb,
}

/// Optical depths beyond this let nothing pass.
const OPAQUE: f32 = 1e30;

/// The media of a scene.
pub struct MediumTable<'a> {
    /// Borrowed from the scene.
    pub media: &'a Media,
    /// Media without borders of their own end at a ball of this radius around the origin, if there
    /// are lights at infinity: without an end no light would reach them.
    ball: Option<f32>,
}

impl Travel {
    /// Of a ray that leaves its vertex; `least` as in [`Travel::least`].
    pub fn new(least: f32, glows: bool) -> Self {
        Self {
            passed: Passed::default(),
            least,
            glow: glows.then_some([0.0; 3]),
        }
    }

    /// It is not scattered.
    pub fn is_straight(&self) -> bool {
        self.least == -f32::INFINITY
    }

    /// Its vertex sends light back, `beta` times what it was lit with.
    pub fn light(&mut self, beta: Rgb) {
        if let Some(glow) = &mut self.glow {
            for c in 0..3 {
                glow[c] *= beta[c];
            }
        }
    }

    /// What it carries, if nothing has scattered it: transmittance over the probability of that.
    pub fn through(&self) -> Rgb {
        through(&self.passed, self.is_straight())
    }
}

fn through(passed: &Passed, straight: bool) -> Rgb {
    if straight {
        passed.transmittance()
    } else {
        passed.through()
    }
}

impl<'a> MediumTable<'a> {
    /// Borrows the scene's media. `ball` is the radius at which they end.
    pub fn new(media: &'a Media, ball: Option<f32>) -> Self {
        Self { media, ball }
    }

    /// Whether light can be scattered in a medium.
    fn scatters(&self, medium: &Medium) -> bool {
        medium.scattering != [0.0; 3]
    }

    /// Adds the optical depth of a piece of a ray to what it has passed.
    pub fn pass(&self, medium: u32, piece: &Piece, passed: &mut Passed) {
        let mut travel = Travel {
            passed: *passed,
            ..Travel::new(-f32::INFINITY, false)
        };
        self.scatter(medium, piece, &mut travel);
        *passed = travel.passed;
    }

    /// Where a ray is scattered on a piece of it; otherwise the piece is passed.
    pub fn scatter(&self, medium: u32, piece: &Piece, travel: &mut Travel) -> Option<Scattered> {
        if medium == NONE {
            return None;
        }
        let medium = &self.media.list[medium as usize];
        let grid = match &medium.density {
            Density::Uniform => return self.scatter_evenly(medium, piece, travel),
            Density::Grid(grid) | Density::Channels { extinction: grid, .. } => grid,
        };
        let scatters = self.scatters(medium);
        let unit = length(piece.direction);
        let mut found = None;
        walk(grid, piece, |cell| {
            let span = Span::new(medium, cell, unit);
            let mut beyond = travel.passed;
            beyond.add(span.depths(span.length()), scatters);
            let passes = !scatters || beyond.log_mean() >= travel.least;
            let to = if passes {
                span.length()
            } else {
                span.invert(&travel.passed, travel.least)
            };
            if travel.glow.is_some() && medium.emission != Emission::Dark {
                glow::add(medium, piece, &span, to, scatters, travel);
            }
            if passes {
                travel.passed = beyond;
                return true;
            }
            travel.passed.add(span.depths(to), scatters);
            let [extinction, scattering] = span.coefficients(to);
            found = Some(Scattered {
                t: span.start() + to,
                weight: travel.passed.scattered(extinction, scattering),
            });
            false
        });
        found
    }

    fn scatter_evenly(
        &self,
        medium: &Medium,
        piece: &Piece,
        travel: &mut Travel,
    ) -> Option<Scattered> {
        let scatters = self.scatters(medium);
        let [start, end] = self.inside(piece);
        let unit = length(piece.direction);
        let whole = (end - start) * unit;
        let mut beyond = travel.passed;
        beyond.add(depths(medium.extinction, whole), scatters);
        let passes = !scatters || beyond.log_mean() >= travel.least;
        let distance = if passes {
            whole
        } else {
            let inverse = travel.passed.invert(medium.extinction, travel.least);
            inverse.min(whole)
        };
        if travel.glow.is_some() && medium.emission != Emission::Dark {
            glow::add_evenly(medium, distance, scatters, travel);
        }
        if passes {
            travel.passed = beyond;
            return None;
        }
        let passed = &mut travel.passed;
        passed.add(depths(medium.extinction, distance), scatters);
        Some(Scattered {
            t: (start + distance / unit).clamp(piece.range[0], piece.range[1]),
            weight: passed.scattered(medium.extinction, medium.scattering),
        })
    }

    /// The part of a piece that lies in a medium without borders.
    fn inside(&self, piece: &Piece) -> [f32; 2] {
        let [start, end] = piece.range;
        let Some(radius) = self.ball else {
            return piece.range;
        };
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [o, d] = [piece.origin, piece.direction];
        let (a, b) = (dot(d, d), dot(o, d));
        // The point of the ray next to the centre, and half of the chord.
        let middle = -b / a;
        let p = [0, 1, 2].map(|k| d[k].mul_add(middle, o[k]));
        let half = ((radius * radius - dot(p, p)).max(0.0) / a).sqrt();
        let low = (middle - half).clamp(start, end);
        [low, (middle + half).clamp(low, end)]
    }
}

fn length(d: [f32; 3]) -> f32 {
    (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
}

/// Optical depths of a length.
fn depths(extinction: Rgb, length: f32) -> Rgb {
    // Of a vacuum 0, also if the length is infinite.
    extinction.map(|e| {
        if e > 0.0 {
            (e * length).min(OPAQUE)
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests;
