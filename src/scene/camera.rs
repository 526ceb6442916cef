//! The camera.

use super::lenses::Lenses;
use std::sync::Arc;

/// The camera. Its space is pbrt's: it looks along `+z`, `y` up, `x` to the right (left-handed),
/// unit length internal.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// How directions become places on the film.
    pub projection: Projection,
    /// Camera to internal space: three rows of a 3x4 matrix; the linear part is orthonormal
    /// (perhaps mirrored).
    pub to_world: [[f32; 4]; 3],
    /// Screen window `[x0, x1, y0, y1]` that the full film shows: on the plane `z = 1` for a
    /// perspective (already times `tan(fov / 2)`), in internal lengths for an orthographic
    /// camera; without meaning for a sphere and for lenses. Raster `y` runs down, screen `y` up.
    pub screen: [f32; 4],
    /// Radius of the lens, internal length; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus along `z`, internal length.
    pub focal_distance: f32,
}

/// How a camera maps directions.
#[derive(Clone, Debug, PartialEq)]
pub enum Projection {
    /// Straight lines through the eye.
    Perspective,
    /// All rays along `z`.
    Orthographic,
    /// Every direction around a point; there is neither a screen nor a lens.
    Sphere(SphereMap),
    /// From points of a film through a system of lenses.
    Lenses(Arc<Lenses>),
}

/// How the whole film maps to directions; raster coordinates `u`, `v` from 0 to 1, `y` up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphereMap {
    /// Azimuth `2 pi u` from `x` towards `z`, angle `pi v` from `y`.
    Equirectangular,
    /// Octahedral (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"): `y` in
    /// the middle, `-y` at the corners.
    EqualArea,
}
