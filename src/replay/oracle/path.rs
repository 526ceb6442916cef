//! A path as geometry: surface vertices between the camera and a light, in `f64`, whatever found
//! them.

use super::vector::V;
use crate::surface::Kind;
use crate::surface::bump::Perturbation;

/// A vertex on a surface; internal space.
#[derive(Clone, Debug)]
pub struct PathVertex {
    /// Position.
    pub p: V,
    /// Distance along the normal within which the true surface lies.
    pub error: f64,
    /// Unit geometric normal, towards the front.
    pub ng: V,
    /// Unit shading normal.
    pub ns: V,
    /// Barycentric coordinates that the tracer reported; of no meaning on spheres.
    pub surface: [f32; 2],
    /// Along increasing `u`, of any length; zero where no BSDF asks for it.
    pub tangent: V,
    /// Kernel of its BSDF; of a mixture, of the component that was chosen.
    pub kind: Kind,
    /// Parameters of the BSDF.
    pub row: [f32; 8],
    /// What the BSDF is multiplied by: of a component of a mixture its weight over the probability
    /// of choosing it, which all strategies have in common ([`mixture`](crate::surface::mixture));
    /// else 1.
    pub share: [f32; 3],
    /// The index of refraction depends on the wavelength.
    pub dispersive: bool,
    /// The light that the primitive is, or [`NONE`](crate::scene::NONE).
    pub light: u32,
    /// Triangles first, then spheres.
    pub primitive: u32,
    /// Index into the scene's materials.
    pub material: u32,
    /// What its bump or normal map says, as looked up in `f32`.
    pub perturbation: Option<Perturbation>,
}

/// Where a path meets its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// On an area light.
    Area {
        /// Index into the scene's lights.
        light: u32,
        /// Position, internal space.
        p: V,
    },
    /// At a light without area.
    Point {
        /// Index into the scene's lights.
        light: u32,
    },
    /// At infinity, in the light's only direction.
    Distant {
        /// Index into the scene's lights.
        light: u32,
    },
    /// Unit direction from the scene to the sky.
    Sky {
        /// Index into the scene's lights.
        light: u32,
        /// Unit.
        direction: V,
    },
}

impl End {
    /// Index into the scene's lights.
    pub fn light(&self) -> u32 {
        match *self {
            End::Area { light, .. }
            | End::Point { light }
            | End::Distant { light }
            | End::Sky { light, .. } => light,
        }
    }
}

/// A path from the camera to a light.
#[derive(Clone, Debug)]
pub struct Path {
    /// Light vertices of the strategy that made it.
    pub s: u32,
    /// Where it meets the lens.
    pub camera: V,
    /// `x1 ..= xk`.
    pub surface: Vec<PathVertex>,
    /// On the light.
    pub end: End,
    /// What its light is multiplied by: 1, or the colour of its wavelength if it was dispersed.
    pub colour: V,
}
