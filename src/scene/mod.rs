//! What is rendered, as plain tables without behaviour. They know no files: [`pbrt`](crate::pbrt)
//! fills them.
//!
//! Every table is in *internal space*: the world of the scene file, translated so that the centre
//! of its bounds is the origin (or the small things, if they are far from it) and scaled by a power
//! of two so that all lies within a radius in `[0.5, 1]` ([`Space`]). Both keep `f32` honest far
//! from the origin and at any scale, and nothing downstream needs an absolute epsilon. Radiance is
//! unchanged by it; quantities with a unit of area in them (intensity of point-like lights) are
//! scaled at load.

pub mod camera;
pub mod film;
pub mod image;
pub mod instance;
pub mod integrator;
pub mod large;
pub mod lenses;
pub mod light;
pub mod material;
pub mod medium;
pub mod parameters;
mod resize;
pub mod shape;
pub mod spectrum;
pub mod texture;
mod whole;

pub use self::camera::{Camera, Projection, SphereMap};
pub use self::film::{Clamp, Film, FilmError, Filter, FilterKind};
pub use self::image::Image;
pub use self::instance::{Instance, Instances, Object};
pub use self::integrator::{IntegratorKind, IntegratorSettings, PathSamplerKind};
pub use self::large::Large;
pub use self::light::{EnvLayout, Filtering, Light, LightKind, SpotFalloff};
pub use self::material::{
    Bump, Component, Description, MAX_COMPONENTS, MAX_NESTING, Material, MaterialKind, Remap,
    Roughness, SMOOTH_ALPHA, Tangents, Weight, is_smooth,
};
pub use self::medium::{Density, Emission, Grid, Media, Medium};
pub use self::parameters::{Dialect, Parameters};
pub use self::shape::{Alpha, AlphaTest, Shape, Sphere, Triangle, Vertex, VertexLanes};
pub use self::texture::{
    Mapping, MarbleSpline, Octaves, Param, Texture, ToTexture, UvMapping, Wrap,
};
pub use self::whole::{Scene, Sides, Space};

/// "No such entry" in every `u32` index of these tables.
pub const NONE: u32 = u32::MAX;

/// Linear sRGB (Rec. 709 primaries, D65 white).
pub type Rgb = [f32; 3];
