//! The rays and points that primary samples stand for, at both ends of a path, in `f64`.

use super::known::Oracle;
use super::lights::ellipsoid;
use super::path::End;
use super::vector::*;
use super::{panorama, warp};
use crate::scene::{LightKind, Projection};
use std::f64::consts::TAU;

/// Origin and unit direction.
pub type Ray = (V, V);

impl Oracle<'_> {
    /// The point of the lens, in the camera's space.
    pub(in crate::replay) fn lens_point(&self, u: f64, v: f64) -> V {
        let camera = &self.scene.camera;
        if !self.lens {
            return [0.0; 3];
        }
        let (x, y) = warp::disk(u, v);
        let r = f64::from(camera.lens_radius);
        [r * x, r * y, 0.0]
    }

    /// The ray that two raster samples and a point of the lens stand for.
    pub(in crate::replay) fn camera_ray(&self, [u, v]: [f64; 2], lens: V) -> Ray {
        let (camera, film) = (&self.scene.camera, &self.scene.film);
        let region = self.region;
        let x = u * f64::from(region.width) + f64::from(region.x0);
        let y = v * f64::from(region.height) + f64::from(region.y0);
        let [x0, x1, y0, y1] = camera.screen.map(f64::from);
        let sx = x0 + x * (x1 - x0) / f64::from(film.width);
        let sy = y1 - y * (y1 - y0) / f64::from(film.height);
        let (origin, direction) = match &camera.projection {
            Projection::Orthographic => ([sx, sy, 0.0], [0.0, 0.0, 1.0]),
            Projection::Perspective if self.lens => {
                let focus = scale([sx, sy, 1.0], camera.focal_distance.into());
                (lens, sub(focus, lens))
            }
            Projection::Perspective => ([0.0; 3], [sx, sy, 1.0]),
            Projection::Sphere(map) => {
                let (u, v) = (x / f64::from(film.width), y / f64::from(film.height));
                ([0.0; 3], panorama::direction(*map, u, v))
            }
            // Out of scope.
            Projection::Lenses(_) => ([0.0; 3], [0.0, 0.0, 1.0]),
        };
        (
            transform_point(&camera.to_world, origin),
            unit(transform_vector(&camera.to_world, direction)),
        )
    }

    /// A point of the camera's space in internal space.
    pub(in crate::replay) fn camera_point(&self, p: V) -> V {
        transform_point(&self.scene.camera.to_world, p)
    }

    /// A point of an area light, and its unit normal.
    fn area_point(&self, light: u32, [u, v]: [f64; 2]) -> Option<(V, V, bool)> {
        match self.scene.lights.get(light as usize)?.kind {
            LightKind::Triangle {
                triangle,
                two_sided,
                ..
            }
            | LightKind::ImageTriangle {
                triangle,
                two_sided,
                ..
            } => {
                let [a, b, c] = self.corners(triangle);
                let (e1, e2) = (sub(b, a), sub(c, a));
                let root = u.sqrt();
                let p = add(a, add(scale(e1, v * root), scale(e2, 1.0 - root)));
                Some((p, unit(cross(e1, e2)), two_sided))
            }
            LightKind::Sphere {
                sphere, two_sided, ..
            }
            | LightKind::ImageSphere {
                sphere, two_sided, ..
            } => {
                let sphere = self.scene.spheres.get(sphere as usize)?;
                let p = transform_point(&sphere.to_world, warp::sphere(u, v));
                Some((p, ellipsoid(sphere, p).0, two_sided))
            }
            _ => None,
        }
    }

    /// `s = 1`: the end that two primary samples stand for, on the light of `end`.
    pub(in crate::replay) fn chosen_point(&self, end: End, u: [f64; 2]) -> Option<End> {
        Some(match end {
            End::Area { light, .. } => End::Area {
                light,
                p: self.area_point(light, u)?.0,
            },
            End::Sky { light, .. } => End::Sky {
                light,
                direction: self.skies.get(light as usize)?.as_ref()?.sample(u[0], u[1]),
            },
            delta => delta,
        })
    }

    /// `s >= 2`: the ray that four primary samples stand for, and where it leaves the light of
    /// `end`.
    pub(in crate::replay) fn emitted_ray(&self, end: End, u: [f64; 4]) -> Option<(Ray, End)> {
        match (end, &self.scene.lights.get(end.light() as usize)?.kind) {
            (End::Area { light, .. }, _) => {
                let (p, front, two_sided) = self.area_point(light, [u[0], u[1]])?;
                let back = two_sided && 2.0 * u[2] >= 1.0;
                let folded = match (two_sided, back) {
                    (false, _) => u[2],
                    (true, false) => 2.0 * u[2],
                    (true, true) => 2.0 * u[2] - 1.0,
                };
                let n = if back { scale(front, -1.0) } else { front };
                let direction = warp::around(n, warp::hemisphere(folded, u[3]));
                Some(((p, direction), End::Area { light, p }))
            }
            (_, LightKind::Point { p, .. }) => {
                Some(((wide(p.to_array()), warp::sphere(u[2], u[3])), end))
            }
            (
                _,
                LightKind::Spot {
                    p,
                    axis,
                    versine_total,
                    ..
                },
            ) => {
                let drop = u[2] * f64::from(*versine_total);
                let (z, r) = (1.0 - drop, (drop * (2.0 - drop)).max(0.0).sqrt());
                let (sin, cos) = (TAU * u[3]).sin_cos();
                let direction = warp::around(unit(wide(axis.to_array())), [r * cos, r * sin, z]);
                Some(((wide(p.to_array()), direction), end))
            }
            (
                End::Point { light },
                LightKind::Goniometric { p, .. } | LightKind::Projection { p, .. },
            ) => {
                let map = self.skies.get(light as usize)?.as_ref()?;
                Some(((wide(p.to_array()), map.sample(u[2], u[3])), end))
            }
            (_, LightKind::Distant { direction, .. }) => {
                let d = unit(wide(direction.to_array()));
                Some(((self.disk_point(d, u), d), end))
            }
            (End::Sky { light, .. }, _) => {
                let w = self.skies.get(light as usize)?.as_ref()?.sample(u[2], u[3]);
                let d = scale(w, -1.0);
                Some((
                    (self.disk_point(d, u), d),
                    End::Sky {
                        light,
                        direction: w,
                    },
                ))
            }
            _ => None,
        }
    }

    /// On the disk outside the scene that faces it along `direction`.
    fn disk_point(&self, direction: V, u: [f64; 4]) -> V {
        let r = self.radius;
        let (x, y) = warp::disk(u[0], u[1]);
        warp::around(direction, [r * x, r * y, -r])
    }
}
