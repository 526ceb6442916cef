//! The same path once more in `f64`, from its primary samples: not only weighed but walked in double precision.
//!
//! Every decision is the one that the walk in `f32` took (strategy, light, lobe, primitive hit); what varies smoothly between decisions
//! (rays, intersections with the known primitive, normals, sampled directions) is computed in `f64`. Numbers of the scene count as exact
//! as they are in `f32`; the parameters of a textured BSDF, and the index of a dispersive one, are
//! those that `f32` looked up.

use super::bsdf::unpacked_alphas;
use super::coated;
use super::lights::ellipsoid;
use super::panorama;
use super::path::{End, Path, Vertex};
use super::recorder::Recorder;
use super::reference::{axes, twin};
use super::vector::*;
use super::walk::{Step, Subpath, Walk};
use super::warp;
use crate::plan::DepthPlan;
use crate::scene::{LightKind, Projection, Sides};
use crate::surface::Kind;
use std::f64::consts::TAU;

/// Origin and unit direction.
type Ray = (V, V);

impl Recorder<'_> {
    /// The paths of `walk`, which `samples` stand for, in double precision. `None` where the decisions cannot be followed: the primitive
    /// that `f32` hit is not met any more.
    pub fn retrace(&self, plan: &DepthPlan, samples: &[f32], walk: &Walk) -> Option<Vec<Path>> {
        let at = &plan.layout;
        let u = |d: usize| f64::from(samples.get(d).copied().unwrap_or(0.0));
        let bounce = |base: usize, j: usize| {
            let d = base + j * at.per_bounce;
            [
                u(d),
                u(d + 1),
                if at.per_bounce > 2 { u(d + 2) } else { 0.0 },
            ]
        };
        let lens = |d: usize| self.lens_point(u(d), u(d + 1));
        let mut camera = [0.0; 3];
        let mut seen = Vec::new();
        let mut left = None;
        if let Some(subpath) = &walk.camera {
            let ray = self.camera_ray([u(at.raster), u(at.raster + 1)], lens(at.lens));
            camera = ray.0;
            let samples = |j| bounce(at.camera_bounce, j);
            let escapes = walk
                .meetings
                .iter()
                .any(|m| walk.s == 0 && matches!(m.end, End::Sky { .. }));
            (seen, left) = self.follow(ray, &subpath.steps, &samples, escapes)?;
        }
        let mut lit = Vec::new();
        let mut ends = Vec::new();
        for meeting in &walk.meetings {
            ends.push(match (walk.s, meeting.end) {
                (0, End::Area { light, .. }) => End::Area {
                    light,
                    p: seen.pop()?.p,
                },
                (0, End::Sky { light, .. }) => End::Sky {
                    light,
                    direction: left?,
                },
                (1, end) => self.chosen_point(end, [u(at.connection), u(at.connection + 1)])?,
                (_, end) => {
                    let numbers = [0, 1, 2, 3].map(|c| u(at.emission + c));
                    let subpath: &Subpath = walk.light.as_ref()?;
                    let (ray, end) = self.emitted_ray(end, numbers)?;
                    let samples = |j| bounce(at.light_bounce, j);
                    lit = self.follow(ray, &subpath.steps, &samples, false)?.0;
                    end
                }
            });
        }
        if walk.t == 1 {
            camera = transform_point(&self.scene.camera.to_world, lens(at.connection));
        }
        lit.reverse();
        seen.extend(lit);
        let colour = walk.colour_of(&seen);
        let path = |end| Path {
            s: walk.s,
            camera,
            surface: seen.clone(),
            end,
            colour,
        };
        Some(ends.into_iter().map(path).collect())
    }

    /// The vertices of `steps` along the ray, and the direction in which the subpath goes on if it `leaves`.
    fn follow(
        &self,
        mut ray: Ray,
        steps: &[Step],
        samples: &dyn Fn(usize) -> [f64; 3],
        leaves: bool,
    ) -> Option<(Vec<Vertex>, Option<V>)> {
        let mut vertices = Vec::with_capacity(steps.len());
        for (j, step) in steps.iter().enumerate() {
            let v = self.hit(ray, &step.vertex)?;
            if j + 1 < steps.len() || leaves {
                ray = (
                    v.p,
                    bend(self.world.sides, &v, scale(ray.1, -1.0), samples(j), step),
                );
            }
            vertices.push(v);
        }
        Some((vertices, leaves.then_some(ray.1)))
    }

    fn lens_point(&self, u: f64, v: f64) -> V {
        let camera = &self.scene.camera;
        if !self.world.plan.lens {
            return [0.0; 3];
        }
        let (x, y) = warp::disk(u, v);
        let r = f64::from(camera.lens_radius);
        [r * x, r * y, 0.0]
    }

    fn camera_ray(&self, [u, v]: [f64; 2], lens: V) -> Ray {
        let (camera, film) = (&self.scene.camera, &self.scene.film);
        let region = self.world.camera.region;
        let x = u * f64::from(region.width) + f64::from(region.x0);
        let y = v * f64::from(region.height) + f64::from(region.y0);
        let [x0, x1, y0, y1] = camera.screen.map(f64::from);
        let sx = x0 + x * (x1 - x0) / f64::from(film.width);
        let sy = y1 - y * (y1 - y0) / f64::from(film.height);
        let (origin, direction) = match camera.projection {
            Projection::Orthographic => ([sx, sy, 0.0], [0.0, 0.0, 1.0]),
            Projection::Perspective if self.world.plan.lens => {
                let focus = scale([sx, sy, 1.0], camera.focal_distance.into());
                (lens, sub(focus, lens))
            }
            Projection::Perspective => ([0.0; 3], [sx, sy, 1.0]),
            Projection::Sphere(map) => {
                let (u, v) = (x / f64::from(film.width), y / f64::from(film.height));
                ([0.0; 3], panorama::direction(map, u, v))
            }
        };
        (
            transform_point(&camera.to_world, origin),
            unit(transform_vector(&camera.to_world, direction)),
        )
    }

    /// Where a ray meets the primitive that `near` lies on.
    fn hit(&self, ray: Ray, near: &Vertex) -> Option<Vertex> {
        let triangles = self.scene.triangles.len() as u32;
        let v = if near.primitive < triangles {
            self.hit_triangle(ray, near)
        } else {
            self.hit_sphere(ray, near, near.primitive - triangles)
        }?;
        v.p.iter().all(|x| x.is_finite()).then_some(v)
    }

    fn hit_triangle(&self, (o, d): Ray, near: &Vertex) -> Option<Vertex> {
        let indices = self.scene.triangles.get(near.primitive as usize)?.v;
        let [a, b, c] = self.corners(near.primitive);
        let (e1, e2) = (sub(b, a), sub(c, a));
        let n = cross(e1, e2);
        let t = dot(sub(a, o), n) / dot(d, n);
        if t.is_nan() || t <= 0.0 {
            return None;
        }
        let p = add(o, scale(d, t));
        let from = sub(p, a);
        let area = dot(n, n);
        let (b1, b2) = (
            dot(cross(from, e2), n) / area,
            dot(cross(e1, from), n) / area,
        );
        let corner = indices.map(|i| self.scene.vertices[i as usize]);
        let weights = [1.0 - b1 - b2, b1, b2];
        let mut smooth = [0.0; 3];
        for (corner, weight) in corner.iter().zip(weights) {
            smooth = add(smooth, scale(wide(corner.n), weight));
        }
        let ng = unit(n);
        let [uv0, uv1, uv2] = corner.map(|v| v.uv.map(f64::from));
        let (du1, dv1) = (uv1[0] - uv0[0], uv1[1] - uv0[1]);
        let (du2, dv2) = (uv2[0] - uv0[0], uv2[1] - uv0[1]);
        let det = du1 * dv2 - dv1 * du2;
        let tangent = if self.world.wanted.tangent && det != 0.0 {
            scale(sub(scale(e1, dv2), scale(e2, dv1)), 1f64.copysign(det))
        } else {
            [0.0; 3]
        };
        let v = Vertex {
            p,
            ng,
            ns: if dot(smooth, smooth) > 0.0 {
                unit(smooth)
            } else {
                ng
            },
            tangent,
            ..near.clone()
        };
        Some(self.tilted(v, [b1, b2]))
    }

    /// With the shading frame that its bump or normal map makes of it.
    fn tilted(&self, v: Vertex, b: [f64; 2]) -> Vertex {
        let Some(relief) = v.relief else {
            return v;
        };
        let world = self.world;
        let d = world.geometry.derivatives(v.primitive, b, v.p.into());
        let normals = [v.ns.into(), v.ng.into()];
        match (world.materials).tilt(v.material as usize, &relief, &d, normals) {
            Some(tilted) => Vertex {
                ns: tilted.ns.to_array(),
                tangent: tilted.tangent.to_array(),
                ..v
            },
            None => v,
        }
    }

    fn hit_sphere(&self, (o, d): Ray, near: &Vertex, index: u32) -> Option<Vertex> {
        let sphere = self.scene.spheres.get(index as usize)?;
        let (o, d) = (
            transform_point(&sphere.to_unit, o),
            transform_vector(&sphere.to_unit, d),
        );
        let (a, b) = (dot(d, d), dot(o, d));
        // A ray that only touches it in f32 may miss it by a rounding.
        let c = dot(o, o) - 1.0;
        let root = (b * b - a * c).max(0.0).sqrt();
        let q = -b - root.copysign(b);
        let there = transform_point(&sphere.to_unit, near.p);
        let at = |t: f64| unit(add(o, scale(d, t)));
        let miss = |t: f64| {
            let off = sub(at(t), there);
            if t > 0.0 {
                dot(off, off)
            } else {
                f64::INFINITY
            }
        };
        let (t0, t1) = (c / q, q / a);
        let t = if miss(t0) <= miss(t1) { t0 } else { t1 };
        if t.is_nan() || t <= 0.0 {
            return None;
        }
        let w = at(t);
        let p = transform_point(&sphere.to_world, w);
        let (n, _) = ellipsoid(sphere, p);
        let v = Vertex {
            p,
            ng: n,
            ns: n,
            tangent: if self.world.wanted.tangent {
                transform_vector(&sphere.to_world, [-w[1], w[0], 0.0])
            } else {
                [0.0; 3]
            },
            ..near.clone()
        };
        Some(self.tilted(v, [0.0; 2]))
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
    fn chosen_point(&self, end: End, u: [f64; 2]) -> Option<End> {
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

    /// `s >= 2`: the ray that four primary samples stand for, and where it leaves the light of `end`.
    fn emitted_ray(&self, end: End, u: [f64; 4]) -> Option<(Ray, End)> {
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
                let direction = around(n, warp::hemisphere(folded, u[3]));
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
                let direction = around(unit(wide(axis.to_array())), [r * cos, r * sin, z]);
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
        let r = f64::from(self.world.geometry.radius);
        let (x, y) = warp::disk(u[0], u[1]);
        around(direction, [r * x, r * y, -r])
    }
}

/// From the axes around `n`.
fn around(n: V, local: V) -> V {
    let [s, t, n] = warp::frame(n);
    from_axes([s, t, n], local)
}

fn from_axes([s, t, n]: [V; 3], local: V) -> V {
    add(
        scale(s, local[0]),
        add(scale(t, local[1]), scale(n, local[2])),
    )
}

/// The direction that a BSDF samples for a path arriving along `wo`; `step` says which lobe.
fn bend(sides: Option<Sides>, v: &Vertex, wo: V, u: [f64; 3], step: &Step) -> V {
    let (s, t) = axes(v);
    let exchanges = sides == Some(Sides::Geometric) && !v.kind.is_delta();
    let wo = [dot(wo, s), dot(wo, t), dot(wo, v.ns)];
    let row = v.row.map(f64::from);
    let (x, y, z) = (wo[0], wo[1], wo[2]);
    let up = [x, y, z.abs()];
    let glossy = || {
        let h = visible_normal(up, row[6], row[7], u);
        sub(scale(h, 2.0 * dot(up, h)), up)
    };
    let mirrored = |w: V, h: V| sub(scale(h, 2.0 * dot(w, h)), w);
    // On the side of `wo`.
    let with_side = |w: V| [w[0], w[1], w[2] * 1f64.copysign(z)];
    // The side that the sample in `f32` went to.
    let reflected = || {
        // Of two twins, the true normal tells which lobe they are of.
        let ns = if exchanges {
            step.vertex.ng
        } else {
            step.vertex.ns
        };
        let side = |w: [f32; 3]| dot(wide(w), ns) > 0.0;
        step.sampled.is_some_and(|s| side(s.wi) == side(step.wo))
    };
    let wi = match v.kind {
        Kind::Diffuse | Kind::OrenNayar | Kind::CoatedDiffuseBase => {
            with_side(warp::hemisphere(u[0], u[1]))
        }
        Kind::Mirror | Kind::SmoothConductor | Kind::Coat | Kind::CoatedMirror => [-x, -y, z],
        Kind::RoughConductor => with_side(glossy()),
        Kind::Plastic => {
            let black = |at: usize| row[at..at + 3].iter().all(|c| *c <= 0.0);
            let diffuse = match (black(0), black(3)) {
                (true, _) => 0.0,
                (false, true) => 1.0,
                (false, false) => 0.5,
            };
            with_side(if u[2] < diffuse {
                warp::hemisphere(u[0], u[1])
            } else {
                glossy()
            })
        }
        Kind::Substrate => with_side(if u[2] < 0.5 {
            warp::hemisphere(u[0], u[1])
        } else {
            glossy()
        }),
        Kind::CoatedDiffuse => {
            let (ax, ay) = unpacked_alphas(row[4]);
            with_side(if u[2] < coated::diffuse_share(&row, up[2]) {
                warp::hemisphere(u[0], u[1])
            } else {
                mirrored(up, visible_normal(up, ax, ay, u))
            })
        }
        Kind::CoatedConductor | Kind::CoatedConductorBase => {
            let [metal, diffuse, _] = coated::conductor_shares(v.kind, &row, up);
            with_side(if u[2] < metal {
                let eta = row[3];
                let (x, y) = (x / eta, y / eta);
                let p = [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()];
                let (ax, ay) = coated::sampled_alphas(v.kind, &row, up[2], p[2]);
                let q = mirrored(p, visible_normal(p, ax, ay, u));
                let (x, y) = (q[0] * eta, q[1] * eta);
                [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()]
            } else if u[2] < metal + diffuse {
                warp::hemisphere(u[0], u[1])
            } else {
                let (ax, ay) = unpacked_alphas(row[4]);
                mirrored(up, visible_normal(up, ax, ay, u))
            })
        }
        Kind::DiffuseTransmission => {
            let w = with_side(warp::hemisphere(u[0], u[1]));
            [w[0], w[1], if reflected() { w[2] } else { -w[2] }]
        }
        Kind::ThinDielectric if reflected() => [-x, -y, z],
        Kind::ThinDielectric => [-x, -y, -z],
        Kind::RoughDielectric => {
            let (ax, ay) = unpacked_alphas(row[7]);
            let h = visible_normal(up, ax, ay, u);
            let c = dot(up, h);
            with_side(if reflected() {
                sub(scale(h, 2.0 * c), up)
            } else {
                // Walter et al. 2007, equation 40.
                let eta = if z > 0.0 { 1.0 / row[6] } else { row[6] };
                let root = (1.0 + eta * eta * (c * c - 1.0)).max(0.0).sqrt();
                sub(scale(h, eta * c - root), scale(up, eta))
            })
        }
        Kind::SmoothDielectric => {
            if reflected() {
                [-x, -y, z]
            } else {
                let eta = if z > 0.0 { row[6] } else { 1.0 / row[6] };
                let sin2 = (x * x + y * y) / (eta * eta);
                [
                    -x / eta,
                    -y / eta,
                    -(1.0 - sin2).max(0.0).sqrt().copysign(z),
                ]
            }
        }
    };
    let sampled = |w: V| {
        let w = unit(from_axes([s, t, v.ns], w));
        let off = step.sampled.map_or([0.0; 3], |s| sub(w, wide(s.wi)));
        (w, dot(off, off))
    };
    let (mut w, off) = sampled(wi);
    if exchanges {
        let ng = [dot(v.ng, s), dot(v.ng, t), dot(v.ng, v.ns)];
        let (other, less) = sampled(twin(wi, ng));
        if less < off {
            w = other;
        }
    }
    w
}

/// A visible normal of the Trowbridge-Reitz distribution (Heitz 2018, listing 1).
fn visible_normal(wo: V, ax: f64, ay: f64, u: [f64; 3]) -> V {
    let stretched = unit([wo[0] * ax, wo[1] * ay, wo[2]]);
    let planar = stretched[0].hypot(stretched[1]);
    let t1 = if planar > 1e-15 {
        [-stretched[1] / planar, stretched[0] / planar, 0.0]
    } else {
        [1.0, 0.0, 0.0]
    };
    let t2 = cross(stretched, t1);
    let (a, b) = warp::disk(u[0], u[1]);
    let s = (1.0 + stretched[2]) / 2.0;
    let b = (1.0 - s) * (1.0 - a * a).max(0.0).sqrt() + s * b;
    let c = (1.0 - a * a - b * b).max(0.0).sqrt();
    let n = from_axes([t1, t2, stretched], [a, b, c]);
    unit([n[0] * ax, n[1] * ay, n[2].max(1e-6)])
}
