//! Triangles, spheres, what they share, and what is cut out of them.

use super::texture::Param;
use crate::simd::record::record;

record! {
    /// One mesh vertex. It is written by loaders, and read by the tracer's build and by
    /// [`crate::geometry`].
    pub struct Vertex / VertexLanes {
        /// Position, internal space.
        p: [f32; 3],
        /// Shading normal of any length, interpolated before it is normalised, or zero where the
        /// mesh has none (the geometric normal then serves).
        n: [f32; 3],
        /// Texture coordinates.
        uv: [f32; 2],
    }
}

/// One triangle. Its front side is the one `cross(p1 - p0, p2 - p0)` points to (orientation,
/// handedness of transforms and, where given, vertex normals are already folded into the order of
/// the vertices).
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(16))]
pub struct Triangle {
    /// Indices into [`Scene::vertices`](super::Scene::vertices).
    pub v: [u32; 3],
    /// Index into [`Scene::shapes`](super::Scene::shapes).
    pub shape: u32,
}

/// An analytic sphere (or ellipsoid): the image of the unit sphere under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Unit sphere to internal space, three rows of a 3x4 matrix.
    pub to_world: [[f32; 4]; 3],
    /// Its inverse.
    pub to_unit: [[f32; 4]; 3],
    /// +1 if the outside is the front, -1 if the inside is (`ReverseOrientation`).
    pub facing: f32,
    /// Index into [`Scene::shapes`](super::Scene::shapes).
    pub shape: u32,
}

/// What all primitives of one `Shape` directive share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Index into [`Scene::materials`](super::Scene::materials).
    pub material: u32,
    /// Index into [`Scene::lights`](super::Scene::lights) of the light of this shape's first
    /// primitive, or [`NONE`](super::NONE). Primitive `i` of an emissive shape has light
    /// `light + i`.
    pub light: u32,
    /// First primitive of this shape in its table (triangles or spheres).
    pub first: u32,
    /// Index into [`Scene::alphas`](super::Scene::alphas), or [`NONE`](super::NONE): nothing is
    /// cut out of it.
    pub alpha: u32,
    /// Index into [`Media::boundaries`](super::Media::boundaries), or [`NONE`](super::NONE): one
    /// medium is on both sides.
    pub boundary: u32,
}

/// What is cut out of shapes. Never a constant that leaves all of a shape or nothing, but beside
/// shadows of their own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alpha {
    /// A number.
    pub value: Param,
    /// What the number means.
    pub test: AlphaTest,
    /// v3: rays that only ask whether something is in the way pass where this is 0, too.
    pub shadow: Option<Param>,
}

/// How a number says whether the surface is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaTest {
    /// pbrt-v3: the surface is there wherever the value is not 0.
    NotZero,
    /// pbrt-v4: the value is the part of the surface that is there.
    Fraction,
}
