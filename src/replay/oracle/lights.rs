//! Where a path meets its light, in `f64`: what the light emits, and the densities of choosing the
//! place and of emitting along the path.

use super::known::Oracle;
use super::path::End;
use super::texels::bilinear;
use super::vector::*;
use crate::scene::{LightKind, Sphere, SpotFalloff};
use std::f64::consts::{PI, TAU};

/// The light's end of a path.
pub struct EndPoint {
    /// `None` at infinity.
    pub position: Option<V>,
    /// Unit, towards the front, of an area light.
    pub normal: Option<V>,
    /// To a light at infinity.
    pub direction: V,
    /// Density of choosing it: over area, discrete, or over solid angle. Choice of the light
    /// included.
    pub pdf: f64,
    /// No ray can meet it.
    pub is_delta: bool,
}

impl EndPoint {
    /// Of what cannot be: an end on a light of another kind.
    fn nowhere() -> Self {
        Self {
            position: None,
            normal: None,
            direction: [0.0, 0.0, 1.0],
            pdf: 0.0,
            is_delta: true,
        }
    }
}

impl Oracle<'_> {
    fn light(&self, light: u32) -> Option<&LightKind> {
        self.scene.lights.get(light as usize).map(|l| &l.kind)
    }

    fn choice_of(&self, light: u32) -> f64 {
        self.choice.get(light as usize).copied().unwrap_or(0.0)
    }

    pub(super) fn corners(&self, triangle: u32) -> [V; 3] {
        (self.scene.triangles[triangle as usize].v).map(|i| wide(self.scene.vertices[i as usize].p))
    }

    /// The point of an area light that `p` was moved off, to start or end a ray.
    pub(in crate::replay) fn on_light(&self, light: u32, p: V) -> V {
        match self.light(light) {
            Some(
                LightKind::Triangle { triangle, .. } | LightKind::ImageTriangle { triangle, .. },
            ) => {
                let [a, b, c] = self.corners(*triangle);
                let n = unit(cross(sub(b, a), sub(c, a)));
                sub(p, scale(n, dot(sub(p, a), n)))
            }
            Some(LightKind::Sphere { sphere, .. } | LightKind::ImageSphere { sphere, .. }) => {
                let sphere = &self.scene.spheres[*sphere as usize];
                // Back along the normal, by Newton's step; what remains is of second order.
                let m = sphere.to_unit.map(|r| wide([r[0], r[1], r[2]]));
                let w = transform_point(&sphere.to_unit, p);
                let slope = [0, 1, 2].map(|c| dot([m[0][c], m[1][c], m[2][c]], unit(w)));
                let near = sub(p, scale(slope, (length(w) - 1.0) / dot(slope, slope)));
                transform_point(
                    &sphere.to_world,
                    unit(transform_point(&sphere.to_unit, near)),
                )
            }
            _ => p,
        }
    }

    pub(super) fn end(&self, end: &End) -> EndPoint {
        let light = end.light();
        let choice = self.choice_of(light);
        match (*end, self.light(light)) {
            (
                End::Area { p, .. },
                Some(
                    LightKind::Triangle { triangle, .. }
                    | LightKind::ImageTriangle { triangle, .. },
                ),
            ) => {
                let [a, b, c] = self.corners(*triangle);
                let n = cross(sub(b, a), sub(c, a));
                EndPoint {
                    position: Some(p),
                    normal: Some(unit(n)),
                    direction: [0.0; 3],
                    pdf: choice * 2.0 / length(n),
                    is_delta: !self.is_met(light),
                }
            }
            (
                End::Area { p, .. },
                Some(LightKind::Sphere { sphere, .. } | LightKind::ImageSphere { sphere, .. }),
            ) => {
                let sphere = &self.scene.spheres[*sphere as usize];
                let (normal, pdf) = ellipsoid(sphere, p);
                EndPoint {
                    position: Some(p),
                    normal: Some(normal),
                    direction: [0.0; 3],
                    pdf: choice * pdf,
                    is_delta: !self.is_met(light),
                }
            }
            (
                End::Point { .. },
                Some(
                    LightKind::Point { p, .. }
                    | LightKind::Spot { p, .. }
                    | LightKind::Goniometric { p, .. }
                    | LightKind::Projection { p, .. },
                ),
            ) => EndPoint {
                position: Some(wide(p.to_array())),
                normal: None,
                direction: [0.0; 3],
                pdf: choice,
                is_delta: true,
            },
            (End::Distant { .. }, Some(LightKind::Distant { direction, .. })) => EndPoint {
                position: None,
                normal: None,
                direction: scale(wide(direction.to_array()), -1.0),
                pdf: choice,
                is_delta: true,
            },
            (End::Sky { direction, .. }, Some(_)) => EndPoint {
                position: None,
                normal: None,
                direction,
                pdf: choice * self.sky(light, direction).1,
                is_delta: false,
            },
            _ => EndPoint::nowhere(),
        }
    }

    fn sky(&self, light: u32, direction: V) -> (V, f64) {
        match self.skies.get(light as usize) {
            Some(Some(sky)) => sky.seen(direction),
            _ => ([0.0; 3], 0.0),
        }
    }

    /// What an image shows at a point of an area light.
    fn shown(&self, light: u32, image: u32, p: V) -> V {
        let uv = match self.light(light) {
            Some(LightKind::ImageTriangle { triangle, .. }) => {
                let [a, b, c] = self.corners(*triangle);
                let (e1, e2, q) = (sub(b, a), sub(c, a), sub(p, a));
                let n = cross(e1, e2);
                let b1 = dot(cross(q, e2), n) / dot(n, n);
                let b2 = dot(cross(e1, q), n) / dot(n, n);
                let of = |i: u32| self.scene.vertices[i as usize].uv.map(f64::from);
                let [a, b, c] = self.scene.triangles[*triangle as usize].v.map(of);
                [0, 1].map(|k| a[k] + b1 * (b[k] - a[k]) + b2 * (c[k] - a[k]))
            }
            Some(LightKind::ImageSphere { sphere, .. }) => {
                let sphere = &self.scene.spheres[*sphere as usize];
                let w = unit(transform_point(&sphere.to_unit, p));
                let turns = w[1].atan2(w[0]) / TAU;
                [
                    turns.rem_euclid(1.0),
                    1.0 - w[0].hypot(w[1]).atan2(w[2]) / PI,
                ]
            }
            _ => return [0.0; 3],
        };
        let Some(image) = self.scene.images.get(image as usize) else {
            return [0.0; 3];
        };
        let (w, h) = (i64::from(image.width), i64::from(image.height));
        let texel = |x: i64, y: i64| {
            wide(image.texels[(y.clamp(0, h - 1) * w + x.clamp(0, w - 1)) as usize])
        };
        let x = uv[0] * w as f64 - 0.5;
        let y = (1.0 - uv[1]) * h as f64 - 0.5;
        bilinear(texel, x, y).map(|c| c.max(0.0))
    }

    /// Radiance (intensity, irradiance) that leaves a light along unit `w`, and the density of
    /// emitting it (for lights at infinity, of the place on the disk that covers the scene).
    pub(super) fn emission(&self, end: &End, point: &EndPoint, w: V) -> (V, f64) {
        let disk = 1.0 / (PI * self.radius.powi(2));
        let light = end.light();
        match (end, self.light(light)) {
            (
                End::Area { .. },
                Some(
                    LightKind::Triangle { l, two_sided, .. }
                    | LightKind::Sphere { l, two_sided, .. },
                ),
            ) => lambertian(point, w, wide(*l), *two_sided),
            (
                End::Area { p, .. },
                Some(
                    LightKind::ImageTriangle {
                        image,
                        scale: s,
                        two_sided,
                        ..
                    }
                    | LightKind::ImageSphere {
                        image,
                        scale: s,
                        two_sided,
                        ..
                    },
                ),
            ) => {
                let l = scale(self.shown(light, *image, *p), f64::from(*s));
                lambertian(point, w, l, *two_sided)
            }
            (
                End::Point { .. },
                Some(LightKind::Goniometric { .. } | LightKind::Projection { .. }),
            ) => self.sky(light, w),
            (End::Point { .. }, Some(LightKind::Point { i, .. })) => (wide(*i), 0.5 / TAU),
            (
                End::Point { .. },
                Some(LightKind::Spot {
                    axis,
                    i,
                    versine_total,
                    versine_full,
                    falloff,
                    ..
                }),
            ) => {
                let (total, full) = (f64::from(*versine_total), f64::from(*versine_full));
                let chord = sub(w, unit(wide(axis.to_array())));
                let versine = dot(chord, chord) / 2.0;
                let x = if full < total {
                    ((total - versine) / (total - full)).clamp(0.0, 1.0)
                } else {
                    f64::from(u8::from(versine <= total))
                };
                let factor = match falloff {
                    SpotFalloff::V3 => x.powi(4),
                    SpotFalloff::V4 => x * x * (3.0 - 2.0 * x),
                };
                (scale(wide(*i), factor), 1.0 / (TAU * total))
            }
            (End::Distant { .. }, Some(LightKind::Distant { l, .. })) => (wide(*l), disk),
            (End::Sky { direction, .. }, _) => (self.sky(light, *direction).0, disk),
            _ => ([0.0; 3], 0.0),
        }
    }
}

/// Radiance towards unit `w` and density of emitting it.
fn lambertian(point: &EndPoint, w: V, l: V, two_sided: bool) -> (V, f64) {
    let cos = point.normal.map_or(0.0, |n| dot(w, n));
    let lit = cos > 0.0 || two_sided;
    let sides = if two_sided { 2.0 } else { 1.0 };
    (if lit { l } else { [0.0; 3] }, cos.abs() / (sides * PI))
}

/// Unit normal of a sphere or ellipsoid at a point of it, towards its front, and the density over
/// area of points that are uniform on the unit sphere behind it.
pub(super) fn ellipsoid(sphere: &Sphere, p: V) -> (V, f64) {
    let m = sphere.to_unit.map(|r| wide([r[0], r[1], r[2]]));
    let column = |c: usize| [m[0][c], m[1][c], m[2][c]];
    // The gradient of |M^-1 p|; areas grow by |M^-T w| / |det M^-1|.
    let w = unit(transform_point(&sphere.to_unit, p));
    let n = [0, 1, 2].map(|c| dot(column(c), w));
    let det = dot(column(0), cross(column(1), column(2))).abs();
    let normal = scale(unit(n), sphere.facing.into());
    (normal, det / length(n) / (2.0 * TAU))
}
