//! The camera: rays from raster positions, raster positions of points, and the density that both
//! share.
//!
//! Raster space has `x` to the right and `y` down, pixel `(i, j)` covering `[i, i+1) x [j, j+1)`.
//! Camera subpaths sample raster positions uniformly over the *sampled region* of the film
//! ([`Region`]); the importance of a strategy with `t = 1` is normalised over the same region, so
//! that crops and wide filters keep both consistent.
//!
//! # Adding a camera
//!
//! More than a file and a line: the orthographic camera stands in seven files. It is a
//! [`Projection`], read where scene files are read; here it has its rays and its density; the plan
//! has an effect for it, so that other scenes do not pay; `inspect` tells it, and `replay` has its
//! own formulas (two files). There is one camera in a scene and there are few kinds, so that no
//! table would be shorter than these matches.

pub mod lenses;
mod region;
mod sphere;

use self::lenses::Optics;
pub use self::region::Region;
use self::sphere::Sphere;
use crate::scene::{self, Projection, SphereMap};
use crate::simd::{Lanes, Mask, Vec3, math};
use std::sync::Arc;

/// A camera prepared for sampling.
#[derive(Clone, Debug)]
pub struct Camera {
    projection: Projection,
    to_world: [[f32; 4]; 3],
    to_camera: [[f32; 4]; 3],
    /// Screen = `screen_origin + raster * screen_per_pixel`.
    screen_origin: [f32; 2],
    screen_per_pixel: [f32; 2],
    /// One over the area of the region on the screen.
    inv_area: f32,
    lens_radius: f32,
    focal_distance: f32,
    /// Read only by a camera that sees every direction.
    sphere: Sphere,
    /// Set if the camera has a system of lenses.
    optics: Option<Arc<Optics>>,
    /// Raster positions that camera subpaths sample, and that `t = 1` may reach.
    pub region: Region,
}

/// A ray leaving the camera.
pub struct CameraRay<L> {
    /// Internal space: the camera's position, or a point of its lens or film plane.
    pub origin: Vec3<L>,
    /// Unit.
    pub direction: Vec3<L>,
    /// Density of the first vertex: per solid angle (perspective, sphere), or per area of the film
    /// plane (orthographic, where the density over area at a surface is this times the cosine,
    /// whatever the distance). 1 with a system of lenses, to which nothing is joined.
    pub pdf: L,
    /// What the light that arrives along it is multiplied by: 1 but with a system of lenses, where
    /// it may be 0.
    pub weight: L,
}

/// A point joined to the camera (`t = 1`).
pub struct CameraConnection<L: Lanes> {
    /// Where the ray meets the lens.
    pub origin: Vec3<L>,
    /// Unit, from the point to the camera.
    pub to_camera: Vec3<L>,
    /// Raster position, in pixels, where the point is seen.
    pub raster: (L, L),
    /// Density over area that a camera subpath has at the point, without the cosine there: `pdf /
    /// distance^2` (perspective, sphere) or `pdf` (orthographic). It is also the factor that
    /// importance contributes, since both are normalised alike.
    pub pdf: L,
    /// False behind the camera and outside the region; the other fields mean nothing there.
    pub valid: L::Mask,
}

impl Camera {
    /// Of a scene's camera and film; the film gives the region and the size of a pixel.
    pub fn new(camera: &scene::Camera, film: &scene::Film) -> Self {
        let region = Region::of(film);
        let optics = match &camera.projection {
            Projection::Lenses(lenses) => Some(lenses),
            _ => None,
        };
        let [x0, x1, y0, y1] = match optics {
            // The film itself, on which the picture is upside down.
            Some(lenses) => {
                let (w, h) = (f64::from(film.width), f64::from(film.height));
                let half = lenses.diagonal / 2.0 / w.hypot(h);
                let (x, y) = ((w * half) as f32, (h * half) as f32);
                [x, -x, y, -y]
            }
            None => camera.screen,
        };
        let per_pixel = [
            (x1 - x0) / film.width as f32,
            -(y1 - y0) / film.height as f32,
        ];
        let area = (per_pixel[0] * per_pixel[1]).abs() * region.width * region.height;
        let m = camera.to_world;
        // Rigid up to reflection: the inverse of the linear part is its transpose.
        let to_camera = std::array::from_fn(|r| {
            let column = [m[0][r], m[1][r], m[2][r]];
            let t = -(column[0] * m[0][3] + column[1] * m[1][3] + column[2] * m[2][3]);
            [column[0], column[1], column[2], t]
        });
        Self {
            projection: camera.projection.clone(),
            to_world: m,
            to_camera,
            screen_origin: [x0, y1],
            screen_per_pixel: per_pixel,
            inv_area: 1.0 / area,
            lens_radius: camera.lens_radius,
            focal_distance: camera.focal_distance,
            sphere: Sphere::new(
                match camera.projection {
                    Projection::Sphere(map) => map,
                    _ => SphereMap::EqualArea,
                },
                film.width,
                film.height,
                region,
            ),
            optics: optics.map(|lenses| Arc::new(Optics::new(lenses))),
            region,
        }
    }

    /// True if the lens takes two primary samples.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0 || self.optics.is_some()
    }

    /// True if points can be joined to it (`t = 1`).
    pub fn connects(&self) -> bool {
        self.optics.is_none()
    }

    /// True if [`Self::connect`] reads its two primary samples: for a point on the lens, or for one
    /// of several places on the film.
    pub fn connects_by_choice(&self) -> bool {
        (self.has_lens() && self.connects()) || (self.sphere_map().is_some() && self.sphere.wraps)
    }

    /// Set if the camera sees every direction.
    pub fn sphere_map(&self) -> Option<SphereMap> {
        match self.projection {
            Projection::Sphere(map) => Some(map),
            _ => None,
        }
    }

    /// True if `pdf` values are per area on a plane and distances to the camera leave densities
    /// alone.
    pub fn is_parallel(&self) -> bool {
        self.projection == Projection::Orthographic
    }

    /// True of the plainest camera there is: perspective, without a lens.
    pub fn is_pinhole(&self) -> bool {
        !(self.has_lens() || self.is_parallel() || self.sphere_map().is_some())
    }

    /// Where the camera stands, internal space.
    pub fn position(&self) -> [f32; 3] {
        [
            self.to_world[0][3],
            self.to_world[1][3],
            self.to_world[2][3],
        ]
    }

    /// The ray through raster `(x, y)`; `lens` are two primary samples, read only if
    /// [`Self::has_lens`]. `PINHOLE` may be true if [`Self::is_pinhole`].
    #[inline(always)]
    pub fn ray<L: Lanes, const PINHOLE: bool>(&self, x: L, y: L, lens: (L, L)) -> CameraRay<L> {
        if !PINHOLE && self.sphere_map().is_some() {
            let (direction, pdf) = self.sphere.direction(x, y);
            return CameraRay {
                origin: Vec3::splat(self.position()),
                direction: direction.transform_vector(&self.to_world).normalize(),
                pdf,
                weight: L::one(),
            };
        }
        let sx = x.mul_add(
            L::splat(self.screen_per_pixel[0]),
            L::splat(self.screen_origin[0]),
        );
        let sy = y.mul_add(
            L::splat(self.screen_per_pixel[1]),
            L::splat(self.screen_origin[1]),
        );
        if !PINHOLE && let Some(optics) = &self.optics {
            let ray = optics.ray(sx, sy, lens);
            return CameraRay {
                origin: ray.origin.transform_point(&self.to_world),
                direction: ray.direction.transform_vector(&self.to_world),
                pdf: L::one(),
                weight: ray.weight,
            };
        }
        if !PINHOLE && self.is_parallel() {
            return CameraRay {
                origin: Vec3::new(sx, sy, L::zero()).transform_point(&self.to_world),
                direction: Vec3::splat([0.0, 0.0, 1.0]).transform_vector(&self.to_world),
                pdf: L::splat(self.inv_area),
                weight: L::one(),
            };
        }
        let through = Vec3::new(sx, sy, L::one());
        let (origin, direction) = if !PINHOLE && self.has_lens() {
            let lens = self.lens_point(lens);
            let focus = through * L::splat(self.focal_distance);
            (lens, (focus - lens).normalize())
        } else {
            (Vec3::zero(), through.normalize())
        };
        let pdf = self.solid_angle_pdf(direction.z);
        CameraRay {
            origin: origin.transform_point(&self.to_world),
            direction: direction.transform_vector(&self.to_world),
            pdf,
            weight: L::one(),
        }
    }

    /// Joins `p` to the camera, if it [`connects`](Self::connects). Invalid behind the camera and
    /// outside the region. `lens` are two
    /// primary samples, read only if [`Self::connects_by_choice`]. `PINHOLE` may be true if
    /// [`Self::is_pinhole`].
    #[inline(always)]
    pub fn connect<L: Lanes, const PINHOLE: bool>(
        &self,
        p: Vec3<L>,
        lens: (L, L),
    ) -> CameraConnection<L> {
        if !PINHOLE && self.sphere_map().is_some() {
            return self.connect_sphere(p, lens.0);
        }
        let q = p.transform_point(&self.to_camera);
        if !PINHOLE && self.is_parallel() {
            let raster = self.raster(q.x, q.y);
            let origin = Vec3::new(q.x, q.y, L::zero()).transform_point(&self.to_world);
            return CameraConnection {
                origin,
                to_camera: Vec3::splat([0.0, 0.0, -1.0]).transform_vector(&self.to_world),
                raster,
                pdf: L::splat(self.inv_area),
                valid: q
                    .z
                    .gt(L::zero())
                    .and(self.region.contains(raster.0, raster.1)),
            };
        }
        let lens = if !PINHOLE && self.has_lens() {
            self.lens_point(lens)
        } else {
            Vec3::zero()
        };
        let v = q - lens;
        let on_screen = if !PINHOLE && self.has_lens() {
            // Where the ray crosses the plane in focus, seen from the centre of the lens.
            let focus = v.mul_add(L::splat(self.focal_distance) / v.z, lens);
            focus * L::splat(1.0 / self.focal_distance)
        } else {
            v * (L::one() / v.z)
        };
        let raster = self.raster(on_screen.x, on_screen.y);
        let d2 = v.length2();
        let inv_d = L::one() / d2.sqrt();
        let cos = v.z * inv_d;
        let valid = cos
            .gt(L::zero())
            .and(self.region.contains(raster.0, raster.1));
        CameraConnection {
            origin: lens.transform_point(&self.to_world),
            to_camera: -(v * inv_d).transform_vector(&self.to_world),
            raster,
            pdf: (self.solid_angle_pdf(cos) / d2).or_zero(valid),
            valid,
        }
    }

    #[inline(always)]
    fn connect_sphere<L: Lanes>(&self, p: Vec3<L>, choice: L) -> CameraConnection<L> {
        let origin = Vec3::splat(self.position());
        let v = p - origin;
        let d2 = v.length2();
        let w = v * (L::one() / d2.sqrt());
        let (raster, pdf, valid) =
            (self.sphere).raster(w.transform_vector(&self.to_camera), choice);
        let valid = valid.and(d2.gt(L::zero()));
        CameraConnection {
            origin,
            to_camera: -w,
            raster,
            pdf: (pdf / d2).or_zero(valid),
            valid,
        }
    }

    /// Uniform over the region on the screen plane, as a density over solid angle (pbrt-v3, section
    /// 16.1.1).
    #[inline(always)]
    fn solid_angle_pdf<L: Lanes>(&self, cos: L) -> L {
        L::splat(self.inv_area) / (cos * cos * cos)
    }

    #[inline(always)]
    fn raster<L: Lanes>(&self, sx: L, sy: L) -> (L, L) {
        (
            (sx - L::splat(self.screen_origin[0])) / L::splat(self.screen_per_pixel[0]),
            (sy - L::splat(self.screen_origin[1])) / L::splat(self.screen_per_pixel[1]),
        )
    }

    #[inline(always)]
    fn lens_point<L: Lanes>(&self, u: (L, L)) -> Vec3<L> {
        let (x, y) = math::concentric_disk(u.0, u.1);
        let r = L::splat(self.lens_radius);
        Vec3::new(x * r, y * r, L::zero())
    }
}
