//! The tables of a scene's lights, and their powers.

use super::choice::LightChoice;
use super::environment::Environment;
use super::picture::Picture;
use super::projector::Projector;
use super::records::{Base, Place};
use super::{Kind, LightTable};
use crate::geometry::Geometry;
use crate::scene::{LightKind, Scene, SpotFalloff};
use std::f32::consts::{PI, TAU};

impl LightTable {
    /// Of all lights of a scene; `geometry` has the areas of their primitives.
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let radius = geometry.radius;
        let mut table = Self {
            kinds: Vec::new(),
            base: Vec::new(),
            place: Vec::new(),
            environments: Vec::new(),
            projectors: Vec::new(),
            pictures: Vec::new(),
            infinite: Vec::new(),
            choice: LightChoice::new(&[]),
            present: Vec::new(),
            hides: false,
            radius,
        };
        let powers: Vec<f64> = (scene.lights.iter())
            .map(|light| table.push(scene, geometry, &light.kind))
            .collect();
        table.choice = LightChoice::new(&powers);
        for (i, base) in table.base.iter_mut().enumerate() {
            base.choice = table.choice.probability(i);
        }
        table.present = (Kind::ALL.into_iter())
            .filter(|k| table.kinds.contains(k))
            .collect();
        if table.is_empty() {
            // Kernels read the row of light 0 before they know whether there is one.
            table.base.push(Base::default());
            table.place.push(Place::default());
        }
        table
    }

    /// Appends a light; returns its power (W, internal units), by which lights are chosen.
    fn push(&mut self, scene: &Scene, geometry: &Geometry, light: &LightKind) -> f64 {
        let disk = f64::from(PI * self.radius * self.radius);
        let mut place = Place::default();
        let mut extra = 0.0;
        let mut inv_area = 0.0;
        let mut prim = 0;
        let mut index = 0;
        let (kind, colour, factor) = match light {
            LightKind::Triangle {
                triangle,
                l,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *triangle;
                let sides = f64::from(1.0 + extra);
                let area = geometry.triangle_area(*triangle);
                inv_area = 1.0 / area;
                let area = f64::from(area);
                (Kind::Triangle, *l, sides * area * f64::from(PI))
            }
            LightKind::Sphere {
                sphere,
                l,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *sphere;
                let sides = f64::from(1.0 + extra);
                let area = f64::from(geometry.sphere_area(*sphere));
                (Kind::Sphere, *l, sides * area * f64::from(PI))
            }
            LightKind::ImageTriangle {
                triangle,
                image,
                scale,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *triangle;
                index = self.picture(scene, *image);
                let area = geometry.triangle_area(*triangle);
                inv_area = 1.0 / area;
                let corner = |i: u32| scene.vertices[i as usize].uv;
                let corners = scene.triangles[*triangle as usize].v.map(corner);
                let mean = self.pictures[index as usize].mean_over_triangle(corners);
                let factor = f64::from(1.0 + extra) * f64::from(area) * f64::from(PI);
                (Kind::ImageTriangle, [*scale; 3], factor * mean)
            }
            LightKind::ImageSphere {
                sphere,
                image,
                scale,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *sphere;
                index = self.picture(scene, *image);
                let area = geometry.sphere_area(*sphere);
                let mean = self.pictures[index as usize].mean_over_sphere();
                let factor = f64::from(1.0 + extra) * f64::from(area) * f64::from(PI);
                (Kind::ImageSphere, [*scale; 3], factor * mean)
            }
            LightKind::Point { p, i } => {
                place.p = p.to_array();
                (Kind::Point, *i, f64::from(2.0 * TAU))
            }
            LightKind::Spot {
                p,
                axis,
                i,
                versine_total,
                versine_full,
                falloff,
            } => {
                place.p = p.to_array();
                place.axis = axis.to_array();
                place.versine_total = *versine_total;
                place.versine_full = *versine_full;
                extra = if *falloff == SpotFalloff::V3 {
                    0.0
                } else {
                    1.0
                };
                let cone = f64::from(PI) * f64::from(versine_total + versine_full);
                (Kind::Spot, *i, cone)
            }
            LightKind::Goniometric {
                p,
                image,
                scale,
                to_light,
                layout,
            } => {
                place.p = p.to_array();
                let image = &scene.images[*image as usize];
                let filtering = layout.filtering();
                let map = Environment::new(image, *scale, *to_light, *layout, filtering);
                let mean = map.mean();
                index = self.environments.len() as u32;
                self.environments.push(map);
                (Kind::Goniometric, mean, f64::from(2.0 * TAU))
            }
            LightKind::Projection {
                p,
                image,
                scale,
                to_light,
                extent,
                filtering,
            } => {
                place.p = p.to_array();
                let image = &scene.images[*image as usize];
                let projector = Projector::new(image, *scale, *to_light, *extent, *filtering);
                let flux = projector.flux().map(|c| c as f32);
                index = self.projectors.len() as u32;
                self.projectors.push(projector);
                (Kind::Projection, flux, 1.0)
            }
            LightKind::Distant { direction, l } => {
                place.p = direction.to_array();
                (Kind::Distant, *l, disk)
            }
            LightKind::InfiniteConstant { l } => {
                (Kind::InfiniteConstant, *l, disk * f64::from(2.0 * TAU))
            }
            LightKind::InfiniteImage {
                image,
                scale,
                to_light,
                layout,
            } => {
                let image = &scene.images[*image as usize];
                let filtering = layout.filtering();
                let map = Environment::new(image, *scale, *to_light, *layout, filtering);
                let mean = map.mean();
                index = self.environments.len() as u32;
                self.environments.push(map);
                (Kind::InfiniteImage, mean, disk * f64::from(2.0 * TAU))
            }
        };
        if kind.is_area() && scene.is_hidden(light) {
            self.hides = true;
            extra = if extra > 0.0 { 2.0 } else { -1.0 };
        }
        if kind.is_environment() {
            self.infinite.push(self.kinds.len() as u32);
        }
        self.base.push(Base {
            choice: 0.0,
            colour,
            sides_or_falloff: extra,
            primitive: prim,
            image: index,
            inv_area,
        });
        self.place.push(place);
        self.kinds.push(kind);
        factor * f64::from((colour[0] + colour[1] + colour[2]) / 3.0)
    }
    /// The copy of an image that area lights show, made once for all of them.
    fn picture(&mut self, scene: &Scene, image: u32) -> u32 {
        let known = self.pictures.iter().position(|p| p.image == image);
        let index = known.unwrap_or_else(|| {
            let picture = Picture::new(image, &scene.images[image as usize]);
            self.pictures.push(picture);
            self.pictures.len() - 1
        });
        index as u32
    }
}
