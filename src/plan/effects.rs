//! The effects that a scene calls for, each with the reason. Everything else in a
//! [`Plan`](super::Plan) follows from this set.

use super::forced::Forced;
use super::surfaces::Surfaces;
use crate::geometry::Wanted;
use crate::light::{self, LightTable};
use crate::scene::{Material, Medium, NONE, Projection, Scene, Shape};
use crate::surface::{Kind, MaterialTable};
use serde::Serialize;
use std::collections::BTreeMap;

/// Something that some scenes need and others do not, and that costs time where it is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Effect {
    /// A BSDF kernel with a queue of its own.
    Surface(Kind),
    /// A third primary sample per bounce, which chooses among the lobes of a BSDF.
    Lobes,
    /// Parameter rows evaluated per hit.
    Textures,
    /// Texture coordinates at hits.
    TextureCoordinates,
    /// A tangent at hits, for anisotropic lobes.
    Tangents,
    /// Shading normals that differ from the geometric ones.
    ShadingNormals,
    /// Points and geometric normals for textures that are functions of them.
    SolidTextures,
    /// Bump and normal maps.
    Bumps,
    /// Rays that go on where they meet what is cut out.
    AlphaMasks,
    /// Lights of which parts are cut out.
    MaskedLights,
    /// A primary sample that chooses the wavelength of a path.
    Dispersion,
    /// A primary sample per surface vertex that chooses the component of a mixture.
    Mixtures,
    /// A primary sample per ray that places a vertex in a medium, and optical depths.
    Media,
    /// Light that comes out of surfaces elsewhere than it went in: probes, and primary samples for
    /// them. Nothing is joined to a path that goes there but a light, so that only path tracing
    /// makes such paths.
    Subsurface,
    /// Analytic spheres beside triangles.
    Spheres,
    /// Surfaces that are tested in `f64`, see [`scene::large`](crate::scene::large).
    LargeSurfaces,
    /// Objects that are kept once and seen in several places.
    Instances,
    /// A kernel that samples lights of a kind.
    Light(light::Kind),
    /// A primary sample that chooses a light.
    LightChoice,
    /// Two primary samples that choose a point of the lens.
    Lens,
    /// A camera of parallel rays.
    Orthographic,
    /// A camera that sees every direction.
    Panorama,
    /// A camera with a system of lenses, to which nothing can be joined.
    LensSystem,
    /// Some surface scatters light: there are paths of more than one ray.
    Bounces,
    /// Light can scatter more than once: surfaces that scatter see each other.
    MoreBounces,
    /// Camera subpaths can meet lights: `s = 0`.
    EmitterHits,
    /// Camera subpaths can be joined to lights, and light subpaths to the camera: `s = 1` and `t =
    /// 1`.
    Connections,
    /// Camera subpaths can be joined to light subpaths: `s >= 2`, `t >= 2`.
    Joins,
}

impl Effect {
    /// As `inspect` tells it; unlike [`Forced::name`] not a word of the command line.
    pub fn name(self) -> &'static str {
        match self {
            Effect::Surface(kind) => kind.name(),
            Effect::Lobes => "choice of lobe",
            Effect::Textures => "textures",
            Effect::Tangents => "tangents",
            Effect::ShadingNormals => "shading normals",
            Effect::TextureCoordinates => "texture coordinates",
            Effect::SolidTextures => "solid textures",
            Effect::Bumps => "bump and normal maps",
            Effect::AlphaMasks => "cut-outs",
            Effect::MaskedLights => "cut-outs of lights",
            Effect::Dispersion => "dispersion",
            Effect::Mixtures => "mixtures",
            Effect::Media => "media",
            Effect::Subsurface => "subsurface scattering",
            Effect::Spheres => "spheres",
            Effect::LargeSurfaces => "large surfaces",
            Effect::Instances => "instances",
            Effect::Light(kind) => kind.name(),
            Effect::LightChoice => "choice of light",
            Effect::Lens => "lens",
            Effect::Orthographic => "orthographic camera",
            Effect::Panorama => "camera of every direction",
            Effect::LensSystem => "system of lenses",
            Effect::Bounces => "paths with bounces",
            Effect::MoreBounces => "paths of two or more bounces",
            Effect::EmitterHits => "lights met by chance (s = 0)",
            Effect::Connections => "connections (s = 1, t = 1)",
            Effect::Joins => "joined subpaths (s, t >= 2)",
        }
    }

    /// What [`Forced`] calls it; a camera is of one kind.
    pub fn group(self) -> Option<Forced> {
        Some(match self {
            Effect::Surface(_) => Forced::Surfaces,
            Effect::Lobes => Forced::Lobes,
            Effect::Textures | Effect::TextureCoordinates | Effect::SolidTextures => {
                Forced::Textures
            }
            Effect::Bumps => Forced::Bumps,
            Effect::AlphaMasks | Effect::MaskedLights => Forced::AlphaMasks,
            Effect::Dispersion => Forced::Dispersion,
            Effect::Mixtures => Forced::Mixtures,
            Effect::Tangents => Forced::Tangents,
            Effect::ShadingNormals => Forced::Normals,
            Effect::Spheres | Effect::LargeSurfaces => Forced::Spheres,
            Effect::Light(_) => Forced::Lights,
            Effect::LightChoice => Forced::LightChoice,
            Effect::Lens => Forced::Lens,
            // Without media there is nothing that vertices could be placed in, and without objects
            // nothing that could be seen.
            Effect::Media
            | Effect::Subsurface
            | Effect::Instances
            | Effect::Orthographic
            | Effect::Panorama
            | Effect::LensSystem => {
                return None;
            }
            Effect::Bounces
            | Effect::MoreBounces
            | Effect::EmitterHits
            | Effect::Connections
            | Effect::Joins => Forced::Strategies,
        })
    }

    /// Every effect there is.
    pub fn all() -> impl Iterator<Item = Effect> {
        let single = [
            Effect::Lobes,
            Effect::Textures,
            Effect::TextureCoordinates,
            Effect::SolidTextures,
            Effect::Tangents,
            Effect::ShadingNormals,
            Effect::Bumps,
            Effect::AlphaMasks,
            Effect::MaskedLights,
            Effect::Dispersion,
            Effect::Mixtures,
            Effect::Media,
            Effect::Subsurface,
            Effect::Spheres,
            Effect::LargeSurfaces,
            Effect::Instances,
            Effect::LightChoice,
            Effect::Lens,
            Effect::Orthographic,
            Effect::Panorama,
            Effect::LensSystem,
            Effect::Bounces,
            Effect::MoreBounces,
            Effect::EmitterHits,
            Effect::Connections,
            Effect::Joins,
        ];
        let surfaces = Kind::ALL.into_iter().map(Effect::Surface);
        let lights = light::Kind::ALL.into_iter().map(Effect::Light);
        surfaces.chain(lights).chain(single)
    }
}

/// A set of effects, and why each is in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    reasons: BTreeMap<Effect, String>,
}

/// A member of [`Effects`], for reports.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Member {
    /// [`Effect::name`].
    pub effect: &'static str,
    /// Such as `material "Pot1", scene.pbrt:42`.
    pub reason: String,
}

impl Effects {
    /// What the tables of a scene call for.
    pub fn of(scene: &Scene, materials: &MaterialTable, lights: &LightTable) -> Self {
        let mut effects = Self::default();
        effects.surfaces(scene, materials);
        effects.media(scene);
        effects.shapes(scene);
        effects.paths(scene, materials);
        effects.lights(scene, lights);
        let directive = || "the Camera directive".into();
        match scene.camera.projection {
            Projection::Perspective => {}
            Projection::Orthographic => effects.add(Effect::Orthographic, directive),
            Projection::Sphere(_) => effects.add(Effect::Panorama, directive),
            Projection::Lenses(_) => {
                effects.add(Effect::LensSystem, directive);
                effects.add(Effect::Lens, directive);
            }
        }
        if scene.camera.lens_radius > 0.0 {
            effects.add(Effect::Lens, || "the camera's lensradius".into());
        }
        effects
    }

    /// Only the first reason is kept.
    fn add(&mut self, effect: Effect, reason: impl FnOnce() -> String) {
        self.reasons.entry(effect).or_insert_with(reason);
    }

    /// A medium is something that scatters, in which all points see each other.
    fn media(&mut self, scene: &Scene) {
        let Some(first) = scene.media.list.first() else {
            return;
        };
        self.add(Effect::Media, || filling(first));
        if let Some(shines) = scene.media.list.iter().find(|m| m.shines()) {
            self.add(Effect::EmitterHits, || filling(shines));
        }
        let Some(medium) = scene.media.list.iter().find(|m| m.scatters()) else {
            return;
        };
        let why = || filling(medium);
        self.add(Effect::Surface(Kind::HenyeyGreenstein), why);
        self.add(Effect::Bounces, why);
        self.add(Effect::MoreBounces, why);
        if !scene.lights.is_empty() {
            self.add(Effect::Connections, why);
            self.add(Effect::Joins, why);
        }
    }

    fn surfaces(&mut self, scene: &Scene, materials: &MaterialTable) {
        let mut used = vec![false; scene.materials.len()];
        for shape in &scene.shapes {
            used[shape.material as usize] = true;
        }
        for (i, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            if materials.entries[i].mixture {
                self.add(Effect::Mixtures, || named(&scene.materials[i]));
                self.evaluated(scene, materials, i);
            }
            for part in materials.components(i) {
                self.surface(scene, materials, part);
            }
        }
    }

    /// A material that is no mixture.
    fn surface(&mut self, scene: &Scene, materials: &MaterialTable, index: usize) {
        let (entry, material) = (&materials.entries[index], &scene.materials[index]);
        let why = || named(material);
        self.add(Effect::Surface(entry.kind), why);
        if entry.kind.has_lobes() {
            self.add(Effect::Lobes, why);
        }
        if entry.subsurface {
            self.add(Effect::Surface(Kind::SubsurfaceExit), why);
            self.add(Effect::Subsurface, || {
                format!(
                    "{}: paths are traced (pt, pssmlt over pt), nothing else is joined below",
                    why()
                )
            });
        }
        if entry.anisotropic {
            self.add(Effect::Tangents, why);
        }
        if entry.dispersive {
            self.add(Effect::Dispersion, why);
        }
        if material.bump.is_some() {
            self.add(Effect::Bumps, why);
        }
        self.evaluated(scene, materials, index);
    }

    /// What is looked up at hits.
    fn evaluated(&mut self, scene: &Scene, materials: &MaterialTable, index: usize) {
        if !materials.entries[index].textured {
            return;
        }
        let why = || named(&scene.materials[index]);
        self.add(Effect::Textures, why);
        if materials.uses_uv {
            self.add(Effect::TextureCoordinates, why);
        }
        if materials.uses_point {
            self.add(Effect::SolidTextures, why);
        }
    }

    /// Which paths there can be.
    fn paths(&mut self, scene: &Scene, materials: &MaterialTable) {
        let all = Surfaces::of(scene, materials, |_| true);
        let open = |m: usize| {
            let entry = &materials.entries[m];
            !entry.kind.is_delta() || entry.subsurface
        };
        let open = Surfaces::of(scene, materials, open);
        for (is, effect, reason) in [
            (all.scatter, Effect::Bounces, "a surface that is not black"),
            (
                all.face,
                Effect::MoreBounces,
                "such surfaces do not all lie in one plane",
            ),
            (
                open.scatter && !scene.lights.is_empty(),
                Effect::Connections,
                "a BSDF that is not a delta",
            ),
            (
                open.face && !scene.lights.is_empty() && !self.has(Effect::Subsurface),
                Effect::Joins,
                "such surfaces do not all lie in one plane",
            ),
        ] {
            if is {
                self.add(effect, || reason.into());
            }
        }
    }

    fn shapes(&mut self, scene: &Scene) {
        if !scene.spheres.is_empty() {
            self.add(Effect::Spheres, || match scene.spheres.len() {
                1 => "one sphere".into(),
                n => format!("{n} spheres"),
            });
        }
        if !scene.large.is_empty() {
            self.add(Effect::LargeSurfaces, || match scene.large.len() {
                1 => "one is thousands of times larger than other things".into(),
                n => {
                    format!("{n} are thousands of times larger than other things, or next to such")
                }
            });
        }
        if !scene.instances.is_empty() {
            self.add(Effect::Instances, || {
                let (places, objects) = (&scene.instances.placed, &scene.instances.objects);
                format!("{} objects in {} places", objects.len(), places.len())
            });
        }
        let cut = |s: &&Shape| s.alpha != NONE;
        let masked_lights = scene.shapes.iter().filter(cut).any(|s| s.light != NONE);
        match scene.shapes.iter().filter(cut).count() {
            0 => {}
            n => self.add(Effect::AlphaMasks, || format!("{n} shapes with alpha")),
        }
        if masked_lights {
            self.add(Effect::MaskedLights, || "a light with alpha".into());
        }
        let smooth = || scene.vertices.iter().filter(|v| v.n != [0.0; 3]);
        if smooth().next().is_some() {
            self.add(Effect::ShadingNormals, || {
                format!("{} vertices have normals", smooth().count())
            });
        }
    }

    fn lights(&mut self, scene: &Scene, table: &LightTable) {
        for (i, light) in scene.lights.iter().enumerate() {
            let kind = table.kind(i as u32);
            let why = || format!("light, {}", light.origin);
            self.add(Effect::Light(kind), why);
            if table.is_met(i as u32) {
                self.add(Effect::EmitterHits, why);
            }
        }
        if table.needs_choice() {
            self.add(Effect::LightChoice, || {
                format!("{} lights (a triangle or sphere each)", table.len())
            });
        }
    }

    /// Whether the scene calls for the effect, or it was forced.
    pub fn has(&self, effect: Effect) -> bool {
        self.reasons.contains_key(&effect)
    }

    /// The BSDF kernels, in order.
    pub fn kinds(&self) -> Vec<Kind> {
        let kind = |effect: &Effect| match effect {
            Effect::Surface(kind) => Some(*kind),
            _ => None,
        };
        self.reasons.keys().filter_map(kind).collect()
    }

    /// What hit points must compute.
    pub fn wanted(&self) -> Wanted {
        Wanted {
            uv: self.has(Effect::TextureCoordinates),
            tangent: self.has(Effect::Tangents),
            normals: self.has(Effect::ShadingNormals),
            spheres: self.has(Effect::Spheres),
            large: self.has(Effect::LargeSurfaces),
            instances: self.has(Effect::Instances),
        }
    }

    /// Adds the effects of `groups`.
    pub fn force(&mut self, groups: &[Forced]) {
        let all = groups.contains(&Forced::All);
        let chosen = |e: &Effect| e.group().is_some_and(|g| all || groups.contains(&g));
        for effect in Effect::all().filter(chosen) {
            self.add(effect, || "forced".into());
        }
    }

    /// All of them with their reasons, in the order of [`Effect`].
    pub fn members(&self) -> Vec<Member> {
        let member = |(effect, reason): (&Effect, &String)| Member {
            effect: effect.name(),
            reason: reason.clone(),
        };
        self.reasons.iter().map(member).collect()
    }

    /// Names of what the scene does without.
    pub fn absent(&self) -> Vec<&'static str> {
        let absent = Effect::all().filter(|e| !self.has(*e));
        absent.map(Effect::name).collect()
    }
}

/// `medium "fog", scene.pbrt:12`
fn filling(medium: &Medium) -> String {
    format!("medium \"{}\", {}", medium.name, medium.origin)
}

/// `material "Pot1", scene.pbrt:42`
fn named(material: &Material) -> String {
    match (material.name.as_str(), material.origin.as_str()) {
        (name, "") => format!("material \"{name}\""),
        (name, origin) => format!("material \"{name}\", {origin}"),
    }
}
