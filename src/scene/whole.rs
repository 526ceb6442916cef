//! All tables of a scene together.

use std::path::PathBuf;

use glam::{DVec3, Vec3};

use super::camera::Camera;
use super::film::Film;
use super::image::Image;
use super::integrator::IntegratorSettings;
use super::large::Large;
use super::light::{Light, LightKind};
use super::material::{Material, MaterialKind};
use super::shape::{Alpha, Shape, Sphere, Triangle, Vertex};
use super::texture::Texture;

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
        (tables + texels.sum::<usize>()) as u64
    }
}
