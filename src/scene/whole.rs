//! All tables of a scene together.

use std::ops::Range;
use std::path::PathBuf;

use glam::{DVec3, Vec3};

use super::camera::Camera;
use super::film::Film;
use super::image::Image;
use super::instance::Instances;
use super::integrator::IntegratorSettings;
use super::large::Large;
use super::light::{Light, LightKind};
use super::material::{Material, MaterialKind};
use super::medium::Media;
use super::shape::{Alpha, Shape, Sphere, Triangle, Vertex};
use super::texture::Texture;

/// The map from the file's world to internal space: `x_internal = (x_world - centre) * scale`,
/// `scale` a power of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// World space of the file.
    pub centre: DVec3,
    /// A power of two, internal lengths per length of the file.
    pub scale: f64,
}

/// What decides whether two directions are on one side of a surface, where its shading normal is
/// not its true one.
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
    /// Of all meshes.
    pub vertices: Vec<Vertex>,
    /// Tangents of vertices, internal lengths, in place of dp/du (pbrt's `S`); zero where the mesh
    /// has none. Vertices beyond its end have none.
    pub tangents: Vec<[f32; 3]>,
    /// Of all meshes, shape by shape.
    pub triangles: Vec<Triangle>,
    /// Analytic ones, shape by shape.
    pub spheres: Vec<Sphere>,
    /// One for each `Shape` directive that has primitives.
    pub shapes: Vec<Shape>,
    /// What is cut out of shapes.
    pub alphas: Vec<Alpha>,
    /// Components of mixtures come before them.
    pub materials: Vec<Material>,
    /// Children come before their parents.
    pub textures: Vec<Texture>,
    /// Of textures and of lights.
    pub images: Vec<Image>,
    /// Those of emissive primitives among them, one a primitive.
    pub lights: Vec<Light>,
    /// What fills the space between surfaces.
    pub media: Media,
    /// The only one.
    pub camera: Camera,
    /// What it looks onto.
    pub film: Film,
    /// What the file asks for.
    pub integrator: IntegratorSettings,
    /// Where internal space lies in that of the file.
    pub space: Space,
    /// Of surfaces with shading normals.
    pub sides: Sides,
    /// Reflectances and transmittances count as at most this: 1 in v4; what v3 is given above 1
    /// makes light.
    pub brightest: f32,
    /// What is kept in `f64` as well; empty in most scenes.
    pub large: Large,
    /// What is kept once and seen in several places; empty in most scenes.
    pub instances: Instances,
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

    /// The triangles that are in their place, not those of objects.
    pub fn own_triangles(&self) -> Range<u32> {
        let first = self.instances.objects.first();
        0..first.map_or(self.triangles.len() as u32, |o| o.triangles.start)
    }

    /// The spheres that are in their place, not those of objects.
    pub fn own_spheres(&self) -> Range<u32> {
        let first = self.instances.objects.first();
        0..first.map_or(self.spheres.len() as u32, |o| o.spheres.start)
    }

    /// Memory of its tables, in bytes.
    pub fn bytes(&self) -> u64 {
        let texels = self.images.iter().map(|i| size_of_val(&i.texels[..]));
        let tables = size_of_val(&self.vertices[..])
            + size_of_val(&self.tangents[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.spheres[..])
            + size_of_val(&self.shapes[..])
            + size_of_val(&self.alphas[..])
            + size_of_val(&self.materials[..])
            + size_of_val(&self.textures[..])
            + size_of_val(&self.lights[..])
            + self.instances.bytes()
            + self.media.bytes();
        (tables + texels.sum::<usize>()) as u64
    }
}
