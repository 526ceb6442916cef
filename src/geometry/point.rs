//! Points on surfaces as rays find them, and as lights emit from them.

use crate::simd::{Lanes, Vec3};

/// What a hit point needs beyond position and geometric normal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Texture coordinates.
    pub uv: bool,
    /// A tangent along increasing `u`.
    pub tangent: bool,
    /// Shading normals that differ from the geometric ones.
    pub normals: bool,
    /// The scene has spheres.
    pub spheres: bool,
    /// The scene has large surfaces.
    pub large: bool,
    /// The scene has instances.
    pub instances: bool,
}

impl Wanted {
    /// More than places and geometric normals of triangles.
    pub fn any(self) -> bool {
        self != Self::default()
    }
}

/// Surface points; internal space.
pub struct SurfacePoint<L: Lanes> {
    /// Position.
    pub p: Vec3<L>,
    /// Distance along the normal within which the true surface lies.
    pub error: L,
    /// Unit geometric normal, towards the front.
    pub ng: Vec3<L>,
    /// Unit shading normal.
    pub ns: Vec3<L>,
    /// Zero unless wanted.
    pub uv: [L; 2],
    /// Along increasing `u`, not normalised; zero unless wanted, or where it is undefined.
    pub tangent: Vec3<L>,
}

/// A point to emit from, and its density over area.
pub struct AreaSample<L: Lanes> {
    /// Position, internal space.
    pub p: Vec3<L>,
    /// Distance along the normal within which the true surface lies.
    pub error: L,
    /// Unit, towards the front.
    pub ng: Vec3<L>,
    /// Per internal area.
    pub pdf: L,
    /// Zero unless asked for.
    pub uv: [L; 2],
}
