//! Light transport over batches of paths: subpaths walked in lockstep, joined, and weighed.
//! `src/transport/README.md` follows one path through all of it: read that first.
//!
//! 1. A [`World`] is a scene prepared for transport: tables that kernels read, and the tracer.
//! 2. [`Paths`] is the workspace of a batch: tables of [`records`], one per path. Beside a ray, a
//!    hit and a flight it keeps the *endpoint* of each subpath; no other vertex, since a
//!    multiplexed path connects only its endpoints ([`mis`] says why that suffices).
//! 3. The stages, one a file, say in their signatures what they read and write: `start` makes the
//!    first rays, `trace` finds what they hit, `arrive` makes endpoints of hits, `scatter` sends
//!    them on by queue, one per BSDF kind, `connect` joins endpoints with one visibility ray, and
//!    `weigh` weighs what they carry.
//! 4. [`sides`] says what shading normals make of reflection and transmission.
//! 5. `media` ends rays in media, and says how much of them passes.
//! 6. `subsurface` has camera subpaths go in by one point of a surface and come out by another.
//! 7. [`wavelength`] turns the contributions of paths that were dispersed into light of one
//!    wavelength.
//! 8. [`evaluate`] drives the waves: primary samples in, contribution and raster position out.
//!    [`bidirectional`] does so where all vertices are joined; it sets endpoints aside, vertex by
//!    vertex.
//! 9. [`path_sampler`] names the ways of evaluation that chains can march over.
//! 10. `share` divides contributions among independent samples and chains.
//! 11. [`probe`] lets others listen to paths on their way; renders pay nothing for it.
//!
//! No stage knows about chains, acceptance or pixels. Only `path_sampler` and `share` know that
//! there are chains, and no more.

pub mod alpha_mask;
mod arrive;
mod below;
pub mod bidirectional;
mod bidirectional_layout;
mod chance;
pub mod clock;
mod connect;
mod dispersion;
mod endpoints;
pub mod evaluate;
mod flying;
mod kept;
mod list;
mod media;
pub mod mis;
pub mod path_sampler;
pub mod paths;
pub mod probe;
pub mod records;
pub mod samples;
mod scatter;
mod share;
mod side;
pub mod sides;
mod sort;
mod start;
mod strategy;
mod subsurface;
pub mod survey;
mod trace;
pub mod wavelength;
mod weigh;

pub use self::path_sampler::PathSampler;
pub use self::paths::Paths;
pub use self::probe::Probe;
pub use self::records::Splat;

use crate::camera::Camera;
use crate::geometry::{Geometry, Wanted};
use crate::light::LightTable;
use crate::medium::MediumTable;
use crate::plan::{Chance, Effect, Effects, Forced, Plan};
use crate::scene::{Scene, Sides};
use crate::simd::Row;
use crate::surface::{AlphaMasks, MaterialTable};
use crate::trace::Tracer;
use std::ops::Deref;
use std::sync::Arc;
use wavelength::Wavelengths;

/// A scene prepared for transport: what is in it, and a camera.
pub struct World<'a> {
    contents: Arc<Contents<'a>>,
    /// Rays and importance.
    pub camera: Camera,
}

impl<'a> Deref for World<'a> {
    type Target = Contents<'a>;

    fn deref(&self) -> &Contents<'a> {
        &self.contents
    }
}

/// What any camera sees of a scene.
pub struct Contents<'a> {
    /// Surface points.
    pub geometry: Geometry<'a>,
    /// BSDFs and their parameter rows.
    pub materials: MaterialTable<'a>,
    /// What is cut out of shapes.
    pub alpha_masks: AlphaMasks<'a>,
    /// Emission.
    pub lights: LightTable,
    /// Closest hits and visibility.
    pub tracer: Tracer,
    /// What of all this the scene calls for.
    pub plan: Plan,
    /// Light that is found only by chance, if there can be any.
    pub chance: Option<Chance>,
    /// If some index of refraction depends on the wavelength.
    pub wavelengths: Option<Wavelengths>,
    /// What fills the space between surfaces.
    pub media: MediumTable<'a>,
    /// Some medium emits light.
    emits: bool,
    /// Parameter row of the first medium's phase function.
    first_phase: u32,
    /// What hit points must compute.
    pub wanted: Wanted,
    /// By whose rule reflections are told from transmissions, pbrt-v3's or pbrt-v4's; `None`
    /// without shading normals.
    pub sides: Option<Sides>,
}

impl<'a> World<'a> {
    /// Builds the tracer and every table; `max_depth` is the largest number of scattering events.
    pub fn new(scene: &'a Scene, max_depth: u32) -> Self {
        Self::with_forced(scene, max_depth, &[])
    }

    /// With effects turned on that the scene does not call for.
    pub fn with_forced(scene: &'a Scene, max_depth: u32, forced: &[Forced]) -> Self {
        let geometry = Geometry::new(scene);
        let mut materials = MaterialTable::new(scene);
        let mut lights = LightTable::new(scene, &geometry);
        let camera = Camera::new(&scene.camera, &scene.film);
        let media = MediumTable::new(scene, geometry.radius);
        if let Some(radius) = media.ball() {
            lights.cover(radius);
        }
        let mut effects = Effects::of(scene, &materials, &lights);
        let perturbed = effects.has(Effect::ShadingNormals) || effects.has(Effect::Bumps);
        let sides = perturbed.then_some(scene.sides);
        effects.force(forced);
        let on = |group| forced.contains(&group) || forced.contains(&Forced::All);
        if on(Forced::Textures) {
            materials.evaluate_per_hit();
        }
        if on(Forced::Lights) {
            lights.try_every_kind();
        }
        let first_phase = materials.rows.len() as u32;
        let row = |g: f32| Row([g, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        materials.rows.extend(media.cosines().map(row));
        let wanted = effects.wanted();
        let plan = Plan::new(effects, max_depth);
        // The shortest such path scatters twice, and media are met everywhere.
        let hides = plan.hits_lights && plan.connectable && max_depth > 1 && !plan.media;
        let chance = || Chance::of(scene, &materials, &lights, &geometry);
        let contents = Contents {
            chance: hides.then(chance).flatten(),
            wavelengths: plan.dispersion.then(Wavelengths::new),
            media,
            emits: scene.media.emits(),
            first_phase,
            plan,
            wanted,
            sides,
            tracer: Tracer::build(scene),
            alpha_masks: AlphaMasks::new(scene),
            geometry,
            materials,
            lights,
        };
        Self {
            contents: Arc::new(contents),
            camera,
        }
    }

    /// The same, seen by another camera.
    pub fn seen_by(&self, camera: Camera) -> Self {
        Self {
            contents: Arc::clone(&self.contents),
            camera,
        }
    }
}

impl Contents<'_> {
    /// Nothing emits light, so that every picture is black.
    pub fn is_unlit(&self) -> bool {
        self.lights.is_empty() && !self.emits
    }

    /// Light that media emit is met by camera subpaths alone.
    pub fn has_glowing_media(&self) -> bool {
        self.emits
    }
}
