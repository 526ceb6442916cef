//! The data, on one page: every record that passes between the stages of transport.
//!
//! | record | one per | written by | read by |
//! |---|---|---|---|
//! | [`Ray`] | path | starts, scattering, links | [`trace`](crate::trace), arrival, escapes |
//! | [`Hit`] | path | [`trace`](crate::trace) | arrival, lights hit by chance |
//! | [`Flight`] | path | starts, scattering | arrival, escapes |
//! | [`EndpointPlace`] | path and side | arrival | scattering, links, emitter hits |
//! | [`EndpointFrame`] | path and side | arrival | scattering, links, emitter hits |
//! | [`EndpointEnergy`] | path and side | arrival | scattering, links, emitter hits |
//! | [`Link`] | path | links | BSDFs along links, weights |
//! | [`LightEnd`] | path | links, `s = 1` | weights, `s = 1` |
//! | [`LensEnd`] | path | links, `t = 1` | weights, `t = 1` |
//! | [`EndpointValue`] | path and side | BSDFs along links | weights |
//! | [`Contribution`] | path | weights | the sum, once visibility is known |
//! | [`Splat`] | path | many, see below | whoever asked for the paths |
//!
//! A splat is filled in piece by piece. `choose_strategies` writes `s`; `start_camera`, and where
//! `t = 1` `link_lens`, the raster position. Lights met by chance and the sum over visible
//! connections add to the colour. At the end `settle` replaces a colour that is no number, and
//! `share::leave` takes away what independent samples bring.
//!
//! What is no record of lanes lies beside these tables, in [`Paths`](crate::transport::Paths):
//!
//! | table | one per | written by | read by |
//! |---|---|---|---|
//! | `s`, `t` | path | `choose_strategies` | waves, scattering, weights |
//! | `rays.blocked` | path | `trace_visibility` | the sum |
//! | `endpoints.kind` | path and side | arrival | queues: which BSDF |
//! | `parameters.rows` | material; slot, path and side | `Paths::new`; arrival | BSDFs |
//! | `lists` | stage | every stage | the next one: which paths |
//!
//! A path is one lane of a batch; the two sides are those of the camera and of the lights. Lengths
//! are of internal space (the scene, centred and scaled at load), as positions are; directions are
//! unit vectors of it unless said otherwise. Densities are per solid angle (steradians) unless said
//! otherwise. Light is linear sRGB.
//!
//! What only some scenes have is not here: it is in tables of its own, which are empty elsewhere,
//! as wavelengths are (`dispersion.rs`), and only kernels of a plan that calls for it read or write
//! them. What is to come has its place:
//! - *time* is one number a path, for all of its rays: a table beside the wavelengths, and the free
//!   column of [`Ray`] for the tracer;
//! - the *instance* that was hit is found by the tracer: a free column of [`Hit`];
//! - all 24 columns of an endpoint are taken, so that its instance is a fourth record, in a table
//!   of its own that is as long as the others only where the plan calls for it, as are the media on
//!   its sides.

use super::mis::Joint;
use crate::simd::Lanes;
use crate::simd::record::record;

pub use crate::trace::{Hit, HitLanes, Ray, RayLanes};

record! {
    /// A subpath on its way from its latest vertex to the next.
    pub struct Flight / FlightLanes {
        /// Throughput: what it carries per unit of what it started with.
        beta: [f32; 3],
        /// Running sum of [`Partial`](super::mis::Partial).
        d_vcm: f32,
        /// Running sum of [`Partial`](super::mis::Partial).
        d_vc: f32,
        /// 1 on a first hop from infinity or along parallel rays (orthographic cameras), whose
        /// length does not change densities; else 0.
        distant: f32,
        /// The medium that it is in, or [`NONE`](crate::scene::NONE); 0 in a scene without media.
        medium: u32,
        /// 1 if it has scattered at a surface that is not specular, else 0; kept only where
        /// [`Chance`](crate::plan::Chance) asks for it.
        open: f32,
    }
}

record! {
    /// The latest vertex of a subpath, its endpoint: where it is.
    pub struct EndpointPlace / EndpointPlaceLanes {
        /// Position.
        p: [f32; 3],
        /// How far along the normal `p` may be off, a length.
        error: f32,
        /// Towards the previous vertex.
        wo: [f32; 3],
        /// Running sum of [`Partial`](super::mis::Partial).
        d_vcm: f32,
    }
}

record! {
    /// The endpoint of a subpath: which way it looks.
    pub struct EndpointFrame / EndpointFrameLanes {
        /// Geometric normal, a unit vector.
        ng: [f32; 3],
        /// Row of the BSDF's parameters.
        params: u32,
        /// Shading normal, a unit vector.
        ns: [f32; 3],
        /// Running sum of [`Partial`](super::mis::Partial).
        d_vc: f32,
    }
}

record! {
    /// The endpoint of a subpath: throughput, and the primitive hit.
    pub struct EndpointEnergy / EndpointEnergyLanes {
        /// Throughput up to here, without what the endpoint scatters. Where a mixture's component
        /// was chosen its share is in it, from `weigh_components` on.
        beta: [f32; 3],
        /// Index of the primitive, as in [`Hit`].
        primitive: u32,
        /// First axis of the shading frame, of any length; 0 where it does not matter.
        tangent: [f32; 3],
        /// The light that the primitive is, or [`NONE`](crate::scene::NONE).
        light: u32,
    }
}

record! {
    /// What joins the two ends of a path.
    pub struct Link / LinkLanes {
        /// From the camera's side to the light's.
        w: [f32; 3],
        /// Squared length between two endpoints; 1 to a light or the lens, whose densities already
        /// include the distance.
        distance2: f32,
    } free 4
}

record! {
    /// The far end of a link from a camera subpath: a point on a light (`s = 1`).
    pub struct LightEnd / LightEndLanes {
        /// Radiance towards the camera's endpoint, or intensity for point lights.
        radiance: [f32; 3],
        /// Density over solid angle at the camera's endpoint, choice included; point lights:
        /// squared distance times choice; distant lights: choice.
        pdf: f32,
        /// Density of a light subpath from there over `pdf`, see
        /// [`DirectSample`](crate::light::DirectSample).
        emission_ratio: f32,
        /// 1 if a camera subpath can meet it by chance; else 0.
        hittable: f32,
    } free 2
}

record! {
    /// The far end of a link from a light subpath: a point on the lens (`t = 1`).
    pub struct LensEnd / LensEndLanes {
        /// Importance along the link. Times the cosine at the light's endpoint it is the density of
        /// the raster position, per area there.
        pdf: f32,
    } free 7
}

record! {
    /// What an endpoint makes of a link.
    pub struct EndpointValue / EndpointValueLanes {
        /// Throughput times BSDF times cosine.
        beta: [f32; 3],
        /// Density of the link's direction.
        pdf: f32,
        /// Strategies further back, see [`Partial::back`](super::mis::Partial::back).
        back: f32,
        /// Absolute cosine between the link and the geometric normal.
        cos: f32,
    } free 2
}

record! {
    /// What a strategy adds to a path's splat, if nothing is in the way.
    pub struct Contribution / ContributionLanes {
        /// With its weight among all strategies.
        weighted: [f32; 3],
        /// Without; 0 unless the pictures of single strategies are asked for (`--strategies`).
        unweighted: [f32; 3],
    } free 2
}

record! {
    /// What became of a path.
    pub struct Splat / SplatLanes {
        /// Contribution: radiance over the density of the path, MIS weight and choice of strategy
        /// included. 0 if the path carries no light.
        rgb: [f32; 3],
        /// Raster position it contributes to, in pixels.
        raster: [f32; 2],
        /// Light vertices of its strategy.
        s: u32,
        /// 1 if the contribution was not finite, or negative, and was replaced by 0; else 0.
        rejected: u32,
        /// One more than the lamp that the path has met and that only chance could have met (see
        /// [`Chance`](crate::plan::Chance)); 0 for none.
        chance: u32,
    }
}

impl Splat {
    /// A path that carries `rgb` to `raster`.
    pub fn new(rgb: [f32; 3], raster: [f32; 2]) -> Self {
        Self {
            rgb,
            raster,
            ..Self::default()
        }
    }
}

impl Contribution {
    /// Adds to both.
    #[inline(always)]
    pub fn add(&mut self, weighted: [f32; 3], unweighted: [f32; 3]) {
        for c in 0..3 {
            self.weighted[c] += weighted[c];
            self.unweighted[c] += unweighted[c];
        }
    }
}

impl<L: Lanes> EndpointValueLanes<L> {
    /// What weights need.
    #[inline(always)]
    pub fn joint(&self) -> Joint<L> {
        Joint {
            pdf: self.pdf,
            back: self.back,
            cos: self.cos,
        }
    }
}
