//! Lights.

use glam::Vec3;

use super::Rgb;

/// A light. Power-like values are linear sRGB with every `scale`, `power` and unit conversion
/// already applied.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Where it was made (`scene.pbrt:42`), for reports.
    pub origin: String,
    /// What shines, and how.
    pub kind: LightKind,
}

/// Kinds of lights; all places and directions in internal space.
// What the fields mean stands at each kind.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Lambertian emission of one triangle, radiance `l` from its front (both sides if
    /// `two_sided`).
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
    /// v4: emission of one triangle by an image, radiance `scale * image(u, v)`, negative texels as
    /// 0; bilinear, clamped to its border, row 0 at `v = 1`.
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
    /// As pbrt: intensity `i` times `smoothstep`-like falloff between two cones around unit `axis`.
    /// An angle is kept as one minus its cosine: of a narrow cone, `f32` holds nothing in the
    /// cosine itself.
    Spot {
        p: Vec3,
        axis: Vec3,
        i: Rgb,
        versine_total: f32,
        versine_full: f32,
        falloff: SpotFalloff,
    },
    /// Intensity `scale * image(direction)` at `p`, negative texels as 0; `to_light` are the rows
    /// of the rotation from internal to light space (`y` and `z` already exchanged, as pbrt has
    /// it). A v3 map is looked up bilinearly, a v4 map at the nearest texel.
    Goniometric {
        p: Vec3,
        image: u32,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        layout: EnvLayout,
    },
    /// Intensity `scale * image(x, y)` at `p` towards the light space direction `(x, y, 1)`, the
    /// image filling `|x| <= extent[0]`, `|y| <= extent[1]` with row 0 at `y = -extent[1]`; 0
    /// outside, negative texels as 0. `to_light` are the rows of the rotation from internal to
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
    /// Light travelling along unit `direction` (from the light into the scene) with irradiance `l`
    /// on a facing surface.
    Distant { direction: Vec3, l: Rgb },
    /// Constant radiance from everywhere outside.
    InfiniteConstant { l: Rgb },
    /// Radiance `scale * image(direction)`; `to_light` are the rows of the rotation from internal
    /// to light space.
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

/// How the spot's smooth edge is shaped between `versine_total` (0) and `versine_full` (1), `x`
/// linear in the cosine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SpotFalloff {
    /// pbrt-v3: `x^4`.
    V3,
    /// pbrt-v4: `smoothstep(x)`.
    V4,
}

/// How an image is laid over all directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnvLayout {
    /// v3: `u = phi / 2 pi`, `v = theta / pi`, `z` up, row 0 at `theta = 0`.
    LatLong,
    /// v4: square equal-area octahedral map (Clarberg 2008).
    EqualArea,
}

impl EnvLayout {
    /// How pbrt looks such maps up. A bilinear look-up takes a lat-long map to be repeated both
    /// ways, so that the poles meet.
    pub fn filtering(self) -> Filtering {
        match self {
            EnvLayout::LatLong => Filtering::Bilinear,
            EnvLayout::EqualArea => Filtering::Nearest,
        }
    }
}
