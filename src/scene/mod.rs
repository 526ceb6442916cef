//! What a scene file says, as plain tables without behaviour.
//!
//! Every table is in *internal space*: the world of the scene file, translated so that the centre of its bounds is the
//! origin (or the small things, if they are far from it) and scaled by a power of two so that all lies within a radius in `[0.5, 1]` ([`Space`]). Both keep `f32` honest far
//! from the origin and at any scale, and nothing downstream needs an absolute epsilon. Radiance is unchanged by it;
//! quantities with a unit of area in them (intensity of point-like lights) are scaled at load.

mod budget;
pub mod film;
pub mod image;
pub mod large;
mod loading;
pub mod material;
pub mod parameters;
pub mod pbrt;
pub mod ply;
pub mod shapes;
pub mod spectrum;
pub mod texture;

use crate::simd::record::record;
use glam::{DVec3, Vec2, Vec3};
use std::path::PathBuf;

pub use self::image::Image;
pub use self::large::Large;
pub use self::loading::Loading;
pub use self::material::{
    Bump, Component, Description, MAX_COMPONENTS, MAX_NESTING, Material, MaterialKind, Remap,
    Roughness, SMOOTH_ALPHA, Tangents, Weight, is_smooth,
};
pub use self::parameters::{Dialect, Parameters};
pub use self::pbrt::{SceneError, load, load_str, load_within};
pub use self::texture::{
    Mapping, MarbleSpline, Octaves, Param, Texture, ToTexture, UvMapping, Wrap,
};

/// "No such entry" in every `u32` index of these tables.
pub const NONE: u32 = u32::MAX;

/// Linear sRGB (Rec. 709 primaries, D65 white).
pub type Rgb = [f32; 3];

record! {
    /// One mesh vertex. It is written by loaders, and read by the tracer's build and by [`crate::geometry`].
    pub struct Vertex / VertexLanes {
        /// Position, internal space.
        p: [f32; 3],
        /// Shading normal of any length, interpolated before it is normalised, or zero where the mesh has none (the geometric
        /// normal then serves).
        n: [f32; 3],
        /// Texture coordinates.
        uv: [f32; 2],
    }
}

/// One triangle. Its front side is the one `cross(p1 - p0, p2 - p0)` points to (orientation, handedness of transforms
/// and, where given, vertex normals are already folded into the order of the vertices).
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(16))]
pub struct Triangle {
    /// Indices into [`Scene::vertices`].
    pub v: [u32; 3],
    /// Index into [`Scene::shapes`].
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
    /// Index into [`Scene::shapes`].
    pub shape: u32,
}

/// What all primitives of one `Shape` directive share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Index into [`Scene::materials`].
    pub material: u32,
    /// Index into [`Scene::lights`] of the light of this shape's first primitive, or [`NONE`]. Primitive `i` of an emissive
    /// shape has light `light + i`.
    pub light: u32,
    /// First primitive of this shape in its table (triangles or spheres).
    pub first: u32,
    /// Index into [`Scene::alphas`], or [`NONE`]: nothing is cut out of it.
    pub alpha: u32,
}

/// What is cut out of shapes. Never a constant that leaves all of a shape or nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alpha {
    /// A number.
    pub value: Param,
    pub test: AlphaTest,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaTest {
    /// pbrt-v3: the surface is there wherever the value is not 0.
    NotZero,
    /// pbrt-v4: the value is the part of the surface that is there.
    Fraction,
}

/// A light. Power-like values are linear sRGB with every `scale`, `power` and unit conversion already applied.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Where it was made (`scene.pbrt:42`), for reports.
    pub origin: String,
    pub kind: LightKind,
}

#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Lambertian emission of one triangle, radiance `l` from its front (both sides if `two_sided`).
    Triangle {
        triangle: u32,
        l: Rgb,
        two_sided: bool,
    },
    /// The same for one analytic sphere.
    Sphere {
        sphere: u32,
        l: Rgb,
        two_sided: bool,
    },
    /// v4: emission of one triangle by an image, radiance `scale * image(u, v)`, negative texels as 0; bilinear, clamped to its border, row 0 at
    /// `v = 1`.
    ImageTriangle {
        triangle: u32,
        image: u32,
        scale: f32,
        two_sided: bool,
    },
    /// The same for one analytic sphere.
    ImageSphere {
        sphere: u32,
        image: u32,
        scale: f32,
        two_sided: bool,
    },
    /// Intensity `i` (W/sr, per internal length squared) at `p`.
    Point { p: Vec3, i: Rgb },
    /// As pbrt: intensity `i` times `smoothstep`-like falloff between two cones around unit `axis`. An angle is kept as one minus its
    /// cosine: of a narrow cone, `f32` holds nothing in the cosine itself.
    Spot {
        p: Vec3,
        axis: Vec3,
        i: Rgb,
        versine_total: f32,
        versine_full: f32,
        falloff: SpotFalloff,
    },
    /// Intensity `scale * image(direction)` at `p`, negative texels as 0; `to_light` are the rows of the rotation from internal to light space (`y` and
    /// `z` already exchanged, as pbrt has it). A v3 map is looked up bilinearly, a v4 map at the nearest texel.
    Goniometric {
        p: Vec3,
        image: u32,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        layout: EnvLayout,
    },
    /// Intensity `scale * image(x, y)` at `p` towards the light space direction `(x, y, 1)`, the image filling `|x| <= extent[0]`,
    /// `|y| <= extent[1]` with row 0 at `y = -extent[1]`; 0 outside, negative texels as 0. `to_light` are the rows of the rotation from internal to
    /// light space. Bilinear look-ups take the image to be repeated beyond its border.
    Projection {
        p: Vec3,
        image: u32,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        /// Tangents of half the angles of view.
        extent: [f32; 2],
        filtering: Filtering,
    },
    /// Light travelling along unit `direction` (from the light into the scene) with irradiance `l` on a facing surface.
    Distant { direction: Vec3, l: Rgb },
    /// Constant radiance from everywhere outside.
    InfiniteConstant { l: Rgb },
    /// Radiance `scale * image(direction)`; `to_light` are the rows of the rotation from internal to light space.
    InfiniteImage {
        image: u32,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        layout: EnvLayout,
    },
}

/// How a light's image is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filtering {
    /// pbrt-v4's lights.
    Nearest,
    /// pbrt-v3's.
    Bilinear,
}

/// How the spot's smooth edge is shaped between `versine_total` (0) and `versine_full` (1), `x` linear in the cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpotFalloff {
    /// pbrt-v3: `x^4`.
    V3,
    /// pbrt-v4: `smoothstep(x)`.
    V4,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvLayout {
    /// v3: `u = phi / 2 pi`, `v = theta / pi`, `z` up, row 0 at `theta = 0`.
    LatLong,
    /// v4: square equal-area octahedral map (Clarberg 2008).
    EqualArea,
}

impl EnvLayout {
    /// How pbrt looks such maps up. A bilinear look-up takes a lat-long map to be repeated both ways, so that the poles meet.
    pub fn filtering(self) -> Filtering {
        match self {
            EnvLayout::LatLong => Filtering::Bilinear,
            EnvLayout::EqualArea => Filtering::Nearest,
        }
    }
}

/// The camera. Its space is pbrt's: it looks along `+z`, `y` up, `x` to the right (left-handed), unit length internal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub projection: Projection,
    /// Camera to internal space: three rows of a 3x4 matrix; the linear part is orthonormal (perhaps mirrored).
    pub to_world: [[f32; 4]; 3],
    /// Screen window `[x0, x1, y0, y1]` that the full film shows: on the plane `z = 1` for a perspective (already
    /// times `tan(fov / 2)`), in internal lengths for an orthographic camera; without meaning for a sphere. Raster `y` runs down, screen
    /// `y` up.
    pub screen: [f32; 4],
    /// Radius of the lens, internal length; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance of the plane in focus along `z`, internal length.
    pub focal_distance: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Projection {
    Perspective,
    Orthographic,
    /// Every direction around a point; there is neither a screen nor a lens.
    Sphere(SphereMap),
}

/// How the whole film maps to directions; raster coordinates `u`, `v` from 0 to 1, `y` up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SphereMap {
    /// Azimuth `2 pi u` from `x` towards `z`, angle `pi v` from `y`.
    Equirectangular,
    /// Octahedral (Clarberg 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"): `y` in the middle, `-y` at the corners.
    EqualArea,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Full resolution.
    pub width: u32,
    pub height: u32,
    /// `[x0, x1, y0, y1]`: the pixels rendered are `[x0, x1)` by `[y0, y1)`, from the crop window as pbrt rounds it (ceil of both ends).
    pub crop: [u32; 4],
    pub filename: Option<String>,
    pub filter: Filter,
    /// Factor on all values written (v3 `scale`; v4 imaging ratio, the time the shutter is open times `iso / 100`, 1 by default).
    pub scale: f32,
    /// Linear sRGB to what is written, if that is something else: rows of a matrix.
    pub colour: Option<[[f32; 3]; 3]>,
    /// `x y` of the red, green, blue and white that are written, if they are not those of sRGB.
    pub chromaticities: Option<[f32; 8]>,
    /// What samples are cut down to; chains never are.
    pub clamp: Option<Clamp>,
}

/// The most that one sample may bring to a pixel, in units of the film's input: brighter ones keep their colour and lose the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Clamp {
    /// Of luminance (v3 `maxsampleluminance`).
    Luminance(f32),
    /// Of X, Y or Z, whichever is largest: what pbrt-v4's default sensor sees (`maxcomponentvalue`).
    Xyz(f32),
}

impl Clamp {
    /// The same for light that is so much brighter.
    pub fn scaled(self, factor: f32) -> Self {
        match self {
            Clamp::Luminance(most) => Clamp::Luminance(most * factor),
            Clamp::Xyz(most) => Clamp::Xyz(most * factor),
        }
    }

    /// What is left of a sample.
    pub fn of(self, colour: Rgb) -> Rgb {
        let [r, g, b] = colour;
        let y = spectrum::luminance(colour);
        let (value, most) = match self {
            Clamp::Luminance(most) => (y, most),
            Clamp::Xyz(most) => {
                let x = 0.412453 * r + 0.357580 * g + 0.180423 * b;
                let z = 0.019334 * r + 0.119193 * g + 0.950227 * b;
                (x.max(y).max(z), most)
            }
        };
        match value > most {
            true => colour.map(|c| c * (most / value)),
            false => colour,
        }
    }
}

/// Reconstruction filter; radii in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    pub radius: Vec2,
    pub kind: FilterKind,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FilterKind {
    Box,
    Triangle,
    /// v3: `exp(-alpha x^2)` minus its value at the radius. v4's `sigma` is `alpha = 1 / (2 sigma^2)`.
    Gaussian {
        alpha: f32,
    },
    Mitchell {
        b: f32,
        c: f32,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        tau: f32,
    },
}

/// The `Integrator` directive, reduced to what Phalanx can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegratorSettings {
    pub kind: IntegratorKind,
    pub max_depth: u32,
    /// From `Sampler "integer pixelsamples"` (integrators of independent samples).
    pub pixel_samples: u32,
    pub mutations_per_pixel: u64,
    pub chains: u64,
    pub bootstrap_samples: u64,
    pub large_step_probability: f32,
    pub sigma: f32,
    /// A picture of each bidirectional strategy is wanted, too (`bdpt`).
    pub strategies: bool,
    /// Of the random numbers.
    pub seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    Mmlt,
    Pt,
    Lt,
    Bdpt,
    /// Over a host.
    Pssmlt(HostKind),
}

impl IntegratorKind {
    pub const ALL: [Self; 6] = [
        Self::Mmlt,
        Self::Pt,
        Self::Lt,
        Self::Bdpt,
        Self::Pssmlt(HostKind::Bdpt),
        Self::Pssmlt(HostKind::Pt),
    ];

    /// As flags and figures have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mmlt => "mmlt",
            Self::Pt => "pt",
            Self::Lt => "lt",
            Self::Bdpt => "bdpt",
            Self::Pssmlt(HostKind::Bdpt) => "pssmlt-bdpt",
            Self::Pssmlt(HostKind::Pt) => "pssmlt-pt",
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Mmlt => "multiplexed Metropolis light transport",
            Self::Pt => "path tracing",
            Self::Lt => "light tracing",
            Self::Bdpt => "bidirectional path tracing",
            Self::Pssmlt(HostKind::Bdpt) => {
                "primary sample space Metropolis light transport over bidirectional path tracing"
            }
            Self::Pssmlt(HostKind::Pt) => {
                "primary sample space Metropolis light transport over path tracing"
            }
        }
    }

    /// True if it mutates paths; the others make independent samples.
    pub fn mutates(self) -> bool {
        matches!(self, Self::Mmlt | Self::Pssmlt(_))
    }
}

/// Whose samples are mutated ([`IntegratorKind::Pssmlt`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HostKind {
    Bdpt,
    Pt,
}

impl HostKind {
    pub const ALL: [Self; 2] = [Self::Bdpt, Self::Pt];
}

impl Default for IntegratorSettings {
    /// pbrt's defaults for `Integrator "mlt"`, but for the chains: pbrt's 1000 would leave lanes empty, and a chain started from the
    /// bootstrap is in equilibrium however few steps it makes.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Mmlt,
            max_depth: 5,
            pixel_samples: 16,
            mutations_per_pixel: 100,
            chains: 8192,
            bootstrap_samples: 100_000,
            large_step_probability: 0.3,
            sigma: 0.01,
            strategies: false,
            seed: 0,
        }
    }
}

/// The map from the file's world to internal space: `x_internal = (x_world - centre) * scale`, `scale` a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    pub centre: DVec3,
    pub scale: f64,
}

/// What decides whether two directions are on one side of a surface, where its shading normal is not its true one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The true normal, as in pbrt-v3.
    Geometric,
    /// The shading normal, as in pbrt-v4.
    Shading,
}

/// Everything a scene file says.
#[derive(Clone, Debug)]
pub struct Scene {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<Triangle>,
    pub spheres: Vec<Sphere>,
    pub shapes: Vec<Shape>,
    pub alphas: Vec<Alpha>,
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub images: Vec<Image>,
    pub lights: Vec<Light>,
    pub camera: Camera,
    pub film: Film,
    pub integrator: IntegratorSettings,
    pub space: Space,
    /// Of surfaces with shading normals.
    pub sides: Sides,
    /// What is kept in `f64` as well; empty in most scenes.
    pub large: Large,
    /// Bounds of all geometry in internal space, `[min, max]`; both zero if there is none.
    pub bounds: [Vec3; 2],
    /// Every file it was read from: text, meshes, images, spectra.
    pub files: Vec<PathBuf>,
    /// Things ignored or replaced at load, ready to print, each with file and line.
    pub warnings: Vec<String>,
}

impl Scene {
    /// An area light that shines and that no ray meets: its shape has no surface.
    pub fn is_hidden(&self, light: &LightKind) -> bool {
        let shape = match light {
            LightKind::Triangle { triangle, .. } | LightKind::ImageTriangle { triangle, .. } => {
                self.triangles[*triangle as usize].shape
            }
            LightKind::Sphere { sphere, .. } | LightKind::ImageSphere { sphere, .. } => {
                self.spheres[*sphere as usize].shape
            }
            _ => return false,
        };
        let material = self.shapes[shape as usize].material;
        (self.materials.get(material as usize)).is_some_and(|m| m.kind == MaterialKind::Interface)
    }

    /// Memory of its tables, in bytes.
    pub fn bytes(&self) -> u64 {
        let texels = self.images.iter().map(|i| size_of_val(&i.texels[..]));
        let tables = size_of_val(&self.vertices[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.shapes[..])
            + size_of_val(&self.alphas[..])
            + size_of_val(&self.materials[..])
            + size_of_val(&self.textures[..])
            + size_of_val(&self.lights[..]);
        let descriptions = self.materials.iter().map(|m| m.kind.bytes());
        (tables + texels.sum::<usize>() + descriptions.sum::<usize>()) as u64
    }
}
