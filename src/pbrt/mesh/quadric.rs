//! Surfaces of revolution as triangles: parts of spheres, cylinders, cones, paraboloids and
//! hyperboloids.
//!
//! # How near they are to pbrt's surfaces
//!
//! Vertices lie on the surface and carry its exact normal, which is interpolated for shading, and
//! pbrt's `(u, v)`. A turn has [`TURN`] edges, or [`ROUND_TURN`] where the surface is curved both
//! ways. An edge is then at most `radius * (1 - cos(pi / TURN)) = 7.5e-5 radius` inside the true
//! outline (`3e-4 radius` where curved both ways). A body 500 pixels wide is drawn to within a
//! twelfth of a pixel. Interpolated normals are exact to `1e-4`. Areas, and so the powers of
//! lamps, are at most `2.5e-5` too small (`5e-4` where curved both ways). No picture shows any of
//! this before some hundred thousand samples a pixel.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::MeshData;

/// Edges of a full turn.
const TURN: f64 = 256.0;

/// The same of surfaces that are curved both ways.
const ROUND_TURN: f64 = 128.0;

/// Rows of surfaces that are straight from end to end, where `u` must be right between the ends.
const ROWS: usize = 32;

/// A profile that is turned about the `z` axis, as pbrt has it. Angles are in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quadric {
    /// The part of a sphere between two heights.
    Sphere {
        /// Positive.
        radius: f64,
        /// From low to high.
        z: [f64; 2],
    },
    /// Between two heights.
    Cylinder {
        /// Positive.
        radius: f64,
        /// From low to high.
        z: [f64; 2],
    },
    /// From its base at `z = 0` to its apex.
    Cone {
        /// Of the base.
        radius: f64,
        /// Of the apex, positive.
        height: f64,
    },
    /// Of this radius at the higher end, its apex at `z = 0`.
    Paraboloid {
        /// At the higher end.
        radius: f64,
        /// From low to high. What lies beyond the apex is not there.
        z: [f64; 2],
    },
    /// Of one sheet, through the line of a straight piece and of its height.
    Hyperboloid {
        /// Ends of the piece.
        ends: [DVec3; 2],
    },
}

/// A point of a profile before it is turned, with its normal.
struct Point {
    p: DVec3,
    n: DVec3,
    /// pbrt's `v`.
    v: f64,
}

impl Quadric {
    /// Triangles over the angles from 0 to `phi_max` (radians). The front is where pbrt's
    /// normal points, which is outside but for hyperboloids whose piece goes down.
    pub fn mesh(&self, phi_max: f64, needs_uv: bool) -> MeshData {
        let mut mesh = MeshData::default();
        let profile = self.profile(needs_uv);
        let phi_max = phi_max.min(TAU);
        let sound = |p: &Point| p.p.is_finite() && p.n.is_finite() && p.v.is_finite();
        // Not a number turns nothing.
        let turns = phi_max > 0.0;
        if profile.len() < 2 || !turns || !profile.iter().all(sound) {
            mesh.warnings.push("the shape has no area".into());
            return mesh;
        }
        let turn = match self {
            Self::Sphere { .. } | Self::Paraboloid { .. } => ROUND_TURN,
            _ => TURN,
        };
        let sectors = (turn * phi_max / TAU).ceil().max(1.0) as usize;
        revolve(&mut mesh, &profile, phi_max, sectors);
        // A piece that begins or ends on the axis at an angle has corners without an area.
        mesh.drop_degenerate();
        mesh.warnings.clear();
        mesh
    }

    fn profile(&self, needs_uv: bool) -> Vec<Point> {
        let straight = if needs_uv { ROWS } else { 1 };
        match *self {
            Self::Sphere { radius, z } => {
                let [from, to] = z.map(|z| (z / radius).clamp(-1.0, 1.0).acos());
                let rows = (ROUND_TURN * (from - to) / TAU).ceil();
                points(rows as usize, |v| {
                    let theta = from + (to - from) * v;
                    // Poles lie on the axis, where the sine of pi is not quite 0.
                    let (sin, cos) = if theta == PI {
                        (0.0, -1.0)
                    } else {
                        theta.sin_cos()
                    };
                    let n = DVec3::new(sin, 0.0, cos);
                    let p = n * radius;
                    Point { p, n, v }
                })
            }
            Self::Cylinder { radius, z } if z[1] > z[0] && radius > 0.0 => points(1, |v| Point {
                p: DVec3::new(radius, 0.0, z[0] + (z[1] - z[0]) * v),
                n: DVec3::X,
                v,
            }),
            Self::Cone { radius, height } if height > 0.0 && radius > 0.0 => {
                let n = DVec3::new(height, 0.0, radius).normalize_or_zero();
                points(straight, |v| Point {
                    p: DVec3::new(radius * (1.0 - v), 0.0, height * v),
                    n,
                    v,
                })
            }
            Self::Paraboloid { radius, z } => paraboloid(radius, z),
            Self::Hyperboloid { ends } => hyperboloid(ends),
            _ => Vec::new(),
        }
    }
}

/// Points of a profile in so many equal steps, from `v = 0` to 1.
fn points(rows: usize, at: impl Fn(f64) -> Point) -> Vec<Point> {
    (0..=rows).map(|i| at(i as f64 / rows as f64)).collect()
}

/// In equal steps of its radius, which keep their distance from the parabola the same.
fn paraboloid(radius: f64, [low, high]: [f64; 2]) -> Vec<Point> {
    if !(high > low && high != 0.0 && radius > 0.0) {
        return Vec::new();
    }
    // `z / high = (r / radius)^2`: only heights of the sign of `high` are there.
    let radius_at = |z: f64| radius * (z / high).max(0.0).sqrt();
    let [from, to] = [low, high].map(radius_at);
    // The angle that the normal turns by, in the steps of a full turn.
    let slope = |r: f64| (2.0 * high * r / (radius * radius)).atan();
    let rows = (ROUND_TURN * (slope(to) - slope(from)).abs() / TAU).ceil();
    points((rows as usize).max(1) * 2, |s| {
        let r = from + (to - from) * s;
        let z = high * (r / radius) * (r / radius);
        let z = if s == 1.0 { high } else { z };
        let n = DVec3::new(2.0 * high * r / (radius * radius), 0.0, -1.0);
        Point {
            p: DVec3::new(r, 0.0, z),
            // One that opens downwards has its outside above.
            n: n.normalize_or_zero() * high.signum(),
            v: (z - low) / (high - low),
        }
    })
}

/// pbrt-v3's, which is not what the piece passes over unless that is narrowest at `z = 0`: it is
/// the surface `a (x^2 + y^2) - c z^2 = 1` through the second end and a point beyond it on the same
/// line. The normal is that of the piece, as if it passed there.
fn hyperboloid([mut p1, mut p2]: [DVec3; 2]) -> Vec<Point> {
    // Formulas divide by the second height.
    if p2.z == 0.0 {
        std::mem::swap(&mut p1, &mut p2);
    }
    let along = p2 - p1;
    if along.z == 0.0 {
        return Vec::new();
    }
    let coefficients = coefficients(p1, p2);
    points(2 * ROWS, |v| {
        let piece = p1 + along * v;
        // An end on the axis has the angle of what is next to it.
        let near = p1 + along * v.clamp(1e-6, 1.0 - 1e-6);
        let out = near.truncate().normalize_or_zero();
        let radius = match coefficients {
            Some([a, c]) => ((1.0 + c * piece.z * piece.z) / a).max(0.0).sqrt(),
            None => piece.truncate().length(),
        };
        let around = DVec3::new(-out.y, out.x, 0.0);
        let n = around.cross(along).normalize_or_zero();
        let p = (out * radius).extend(piece.z);
        Point { p, n, v }
    })
}

/// `a` and `c` of the surface; none for a cone, which pbrt never finishes.
fn coefficients(p1: DVec3, p2: DVec3) -> Option<[f64; 2]> {
    const TRIES: usize = 64;
    let mut beyond = p1;
    (0..TRIES).find_map(|_| {
        beyond += 2.0 * (p2 - p1);
        let [far, near] = [beyond, p2].map(|p| p.truncate().length_squared());
        let heights = (beyond.z / p2.z) * (beyond.z / p2.z);
        let a = (1.0 - heights) / (far - near * heights);
        let c = (a * near - 1.0) / (p2.z * p2.z);
        // Of a cone the divisor is 0 but for rounding.
        let is_cone = (far - near * heights).abs() <= 1e-9 * far;
        (!is_cone && a.is_finite() && c.is_finite()).then_some([a, c])
    })
}

/// Turns a profile about the axis. Rows on the axis have a vertex for each sector, in its middle:
/// there is every `u` at once.
fn revolve(mesh: &mut MeshData, profile: &[Point], phi_max: f64, sectors: usize) {
    let normals = mesh.normals.get_or_insert_default();
    let uvs = mesh.uvs.get_or_insert_default();
    let size = profile
        .iter()
        .fold(0.0, |most: f64, q| most.max(q.p.length()));
    let on_axis = |q: &Point| q.p.truncate().length() <= 1e-12 * size;
    let mut place = |q: &Point, u: f64| {
        // A full turn ends where it began, to the bit.
        let phi = if u == 1.0 && phi_max == TAU {
            0.0
        } else {
            u * phi_max
        };
        let by = DVec2::from_angle(phi);
        let turned = |v: DVec3| by.rotate(v.truncate()).extend(v.z).as_vec3().to_array();
        let p = if on_axis(q) {
            DVec3::new(0.0, 0.0, q.p.z)
        } else {
            q.p
        };
        mesh.positions.push(turned(p));
        normals.push(turned(q.n));
        uvs.push([u as f32, q.v as f32]);
    };
    // The index of the first vertex of each row, and whether it is on the axis.
    let mut rows = Vec::with_capacity(profile.len());
    let mut next = 0;
    for q in profile {
        let axis = on_axis(q);
        rows.push((next, axis));
        let n = if axis { sectors } else { sectors + 1 };
        for i in 0..n {
            let shift = if axis { 0.5 } else { 0.0 };
            place(q, (i as f64 + shift) / sectors as f64);
        }
        next += n as u32;
    }
    for row in rows.windows(2) {
        let [(a, a_axis), (b, b_axis)] = [row[0], row[1]];
        for i in 0..sectors as u32 {
            if !a_axis {
                let end = if b_axis { b + i } else { b + i + 1 };
                mesh.triangles.push([a + i, a + i + 1, end]);
            }
            if !b_axis {
                mesh.triangles.push([a + i, b + i + 1, b + i]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vec(v: [f32; 3]) -> DVec3 {
        DVec3::from(v.map(f64::from))
    }

    fn area(mesh: &MeshData) -> f64 {
        let areas = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| vec(mesh.positions[v as usize]));
            (b - a).cross(c - a).length() * 0.5
        });
        areas.sum()
    }

    /// Area of a turned profile by the midpoint rule.
    fn turned(length: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let middles = (0..n).map(|i| length((f64::from(i) + 0.5) / f64::from(n)));
        middles.sum::<f64>() / f64::from(n)
    }

    /// All shapes over a third of a turn, with their areas over a full one, and what is 0 on them.
    #[allow(clippy::type_complexity)]
    fn shapes() -> Vec<(Quadric, f64, Box<dyn Fn(DVec3) -> f64>)> {
        let rho = |p: DVec3| p.truncate().length();
        let ends = [DVec3::new(1.0, -0.5, -1.0), DVec3::new(1.0, 1.0, 2.0)];
        let [p1, p2] = ends;
        let waist = turned(|v| {
            let (p, along) = (p1.lerp(p2, v), p2 - p1);
            DVec3::new(-p.y, p.x, 0.0).cross(along).length()
        });
        vec![
            (
                Quadric::Sphere {
                    radius: 2.0,
                    z: [-1.0, 2.0],
                },
                TAU * 2.0 * 3.0,
                Box::new(|p| p.length() - 2.0),
            ),
            (
                Quadric::Cylinder {
                    radius: 0.5,
                    z: [-1.0, 3.0],
                },
                TAU * 0.5 * 4.0,
                Box::new(move |p| rho(p) - 0.5),
            ),
            (
                Quadric::Cone {
                    radius: 3.0,
                    height: 4.0,
                },
                PI * 3.0 * 5.0,
                Box::new(move |p| rho(p) - 3.0 * (1.0 - p.z / 4.0)),
            ),
            (
                Quadric::Paraboloid {
                    radius: 2.0,
                    z: [0.5, 4.0],
                },
                // r = sqrt(z)
                TAU * turned(|s| (0.5 + 3.5 * s + 0.25).sqrt() * 3.5),
                Box::new(move |p| rho(p) - p.z.sqrt()),
            ),
            (
                Quadric::Hyperboloid { ends },
                TAU * waist,
                Box::new(move |p| rho(p) - rho(p1.lerp(p2, (p.z + 1.0) / 3.0))),
            ),
        ]
    }

    #[test]
    fn vertices_lie_on_the_surface_and_areas_are_right() {
        for (quadric, exact, distance) in shapes() {
            let mesh = quadric.mesh(TAU, true);
            for p in &mesh.positions {
                assert!(distance(vec(*p)).abs() < 1e-6, "{quadric:?} {p:?}");
            }
            for t in &mesh.triangles {
                let middle = t
                    .iter()
                    .map(|&v| vec(mesh.positions[v as usize]))
                    .sum::<DVec3>();
                let off = distance(middle / 3.0).abs();
                assert!(off < 1.5e-3, "{quadric:?} {off}");
            }
            let error = area(&mesh) / exact - 1.0;
            assert!(error.abs() < 6e-4, "{quadric:?} {error}");
            let third = area(&quadric.mesh(TAU / 3.0, true)) * 3.0 / exact - 1.0;
            assert!(third.abs() < 6e-4, "{quadric:?} {third}");
        }
    }

    /// Normals are those of the surface, on the side where triangles have their front; `(u, v)` are
    /// the fractions of the angle and, but for the sphere, of the height.
    #[test]
    fn normals_and_uv_are_pbrts() {
        for (quadric, _, distance) in shapes() {
            let mesh = quadric.mesh(TAU / 3.0, true);
            let (normals, uvs) = (mesh.normals.as_ref().unwrap(), mesh.uvs.as_ref().unwrap());
            let (low, high) = mesh
                .positions
                .iter()
                .fold((9.0f32, -9.0f32), |(a, b), p| (a.min(p[2]), b.max(p[2])));
            let hyperboloid = matches!(quadric, Quadric::Hyperboloid { .. });
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|v| vec(mesh.positions[v as usize]));
                let face = (b - a).cross(c - a).normalize();
                for v in t.map(|v| v as usize) {
                    let (p, n) = (vec(mesh.positions[v]), vec(normals[v]));
                    assert!(face.dot(n) > 0.998, "{quadric:?} {p}");
                    let step = |e: DVec3| distance(p + 1e-4 * e) - distance(p - 1e-4 * e);
                    let gradient = DVec3::new(step(DVec3::X), step(DVec3::Y), step(DVec3::Z));
                    if p.truncate().length() > 1e-3 {
                        let along = gradient.normalize().dot(n);
                        assert!(along > 1.0 - 1e-5, "{quadric:?} {p} {along}");
                        let turn = p.y.atan2(p.x).rem_euclid(TAU) / (TAU / 3.0);
                        let u = f64::from(uvs[v][0]);
                        assert!(
                            hyperboloid || (u - turn).abs() < 1e-5,
                            "{quadric:?} {p} {u}"
                        );
                    }
                    let height = (p.z - f64::from(low)) / f64::from(high - low);
                    if let Quadric::Sphere { .. } = quadric {
                        let theta = (p.z / 2.0).clamp(-1.0, 1.0).acos();
                        let v_here = (theta - TAU / 3.0) / (0.0 - TAU / 3.0);
                        assert!((v_here - f64::from(uvs[v][1])).abs() < 1e-3);
                    } else {
                        assert!((height - f64::from(uvs[v][1])).abs() < 1e-5);
                    }
                }
            }
        }
    }

    /// The example of pbrt's documentation, whose piece is narrowest elsewhere than at height 0.
    #[test]
    fn hyperboloids_are_narrowest_at_height_0() {
        let ends = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.8, 1.0, 0.8)];
        let mesh = Quadric::Hyperboloid { ends }.mesh(TAU, false);
        for p in &mesh.positions {
            let p = vec(*p);
            let rho = ((1.0 + 1.931_818_181_8 * p.z * p.z) / 1.363_636_363_6).sqrt();
            assert!((p.truncate().length() - rho).abs() < 1e-6, "{p}");
        }
        // The angle is counted from the piece.
        let last = mesh.positions.len() - 257;
        let [a, b] = [0, last].map(|i| vec(mesh.positions[i]));
        assert!(a.y.abs() < 1e-6 && (b - ends[1]).length() < 1e-6, "{a} {b}");
        // Cones are told by rounding errors alone.
        let ends = [DVec3::new(0.1, 0.3, 0.1), DVec3::new(0.7, 2.1, 0.7)];
        let cone = Quadric::Hyperboloid { ends }.mesh(TAU, false);
        for p in &cone.positions {
            let p = vec(*p);
            assert!(
                (p.truncate().length() - p.z * 10f64.sqrt()).abs() < 1e-6,
                "{p}"
            );
        }
    }

    #[test]
    fn full_turns_close() {
        let mesh = Quadric::Cylinder {
            radius: 1.0,
            z: [0.0, 1.0],
        }
        .mesh(TAU, false);
        assert_eq!(mesh.triangles.len(), 512);
        assert_eq!(mesh.positions[0], mesh.positions[256]);
        assert_eq!(mesh.positions[257], mesh.positions[513]);
    }

    #[test]
    fn nothing_to_draw() {
        for quadric in [
            Quadric::Sphere {
                radius: 1.0,
                z: [2.0, 3.0],
            },
            Quadric::Cylinder {
                radius: 1.0,
                z: [1.0, 1.0],
            },
            Quadric::Cone {
                radius: 1.0,
                height: -1.0,
            },
            Quadric::Paraboloid {
                radius: 1.0,
                z: [-1.0, 0.0],
            },
            Quadric::Hyperboloid {
                ends: [DVec3::X, DVec3::Y],
            },
            Quadric::Cylinder {
                radius: f64::NAN,
                z: [0.0, 1.0],
            },
        ] {
            let mesh = quadric.mesh(TAU, false);
            assert!(
                mesh.triangles.is_empty() && mesh.warnings.len() == 1,
                "{quadric:?}"
            );
        }
        let cone = Quadric::Cone {
            radius: 1.0,
            height: 1.0,
        };
        assert!(cone.mesh(0.0, false).triangles.is_empty());
    }
}
