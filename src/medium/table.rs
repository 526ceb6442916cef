//! The media of a scene, as rays ask about them.

use super::glow;
use super::grid::walk;
use super::passed::{Passed, depths};
use super::span::Span;
use super::travel::{Piece, Scattered, Travel};
use crate::scene::{Density, LightKind, MaterialKind, Media, Medium, NONE, Scene};

/// The media of a scene.
pub struct MediumTable<'a> {
    /// Borrowed from the scene.
    pub media: &'a Media,
    /// Media without borders of their own end at a ball of this radius around the origin, if there
    /// are lights at infinity: without an end no light would reach them.
    ball: Option<f32>,
    /// Of each material of the scene, whether surfaces of it are mere borders between media.
    borders: Vec<bool>,
    /// There are such surfaces.
    pub has_borders: bool,
}

impl<'a> MediumTable<'a> {
    /// Borrows the media of a scene whose bounds have this radius around the origin.
    pub fn new(scene: &'a Scene, radius: f32) -> Self {
        let borders: Vec<bool> = (scene.materials.iter())
            .map(|m| m.kind == MaterialKind::Interface)
            .collect();
        let has_borders = (scene.shapes.iter())
            .any(|s| s.boundary != NONE && borders.get(s.material as usize) == Some(&true));
        Self {
            borders,
            has_borders,
            ..Self::of(&scene.media, ball(scene, radius))
        }
    }

    /// Of media alone, which end at a ball of this radius.
    pub fn of(media: &'a Media, ball: Option<f32>) -> Self {
        Self {
            media,
            ball,
            borders: Vec::new(),
            has_borders: false,
        }
    }

    /// Nothing is scattered at surfaces of this material.
    pub fn is_border(&self, material: u32) -> bool {
        self.borders.get(material as usize) == Some(&true)
    }

    /// Where media without borders end, if they have to.
    pub fn ball(&self) -> Option<f32> {
        self.ball
    }

    /// Mean cosines of the phase functions, by medium.
    pub fn cosines(&self) -> impl Iterator<Item = f32> {
        self.media.list.iter().map(|medium| medium.g)
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
            Density::Grid(grid)
            | Density::Channels {
                extinction: grid, ..
            } => grid,
        };
        let scatters = medium.scatters();
        let glows = travel.glow.is_some() && medium.shines();
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
            if glows {
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
        let scatters = medium.scatters();
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
        if travel.glow.is_some() && medium.shines() {
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
        if a.is_nan() || a <= 0.0 {
            // It goes nowhere.
            return piece.range;
        }
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

/// Where media without borders end, if there are lights at infinity: at a ball around the origin
/// that is twice as large as the scene, and that holds the camera. In pbrt light from infinity has
/// come twice the radius of the scene through them.
fn ball(scene: &Scene, radius: f32) -> Option<f32> {
    let media = &scene.media;
    let at_infinity = scene.lights.iter().any(|light| {
        matches!(
            light.kind,
            LightKind::Distant { .. }
                | LightKind::InfiniteConstant { .. }
                | LightKind::InfiniteImage { .. }
        )
    });
    let around = media.camera != NONE
        || media.lights.iter().flatten().any(|medium| *medium != NONE)
        || media.boundaries.iter().any(|[outside, _]| *outside != NONE);
    if !at_infinity || !around {
        return None;
    }
    let eye = scene.camera.to_world.map(|row| row[3]);
    let distance = (eye[0] * eye[0] + eye[1] * eye[1] + eye[2] * eye[2]).sqrt();
    Some((2.0 * radius).max(1.25 * distance))
}
