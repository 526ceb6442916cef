//! Curves as triangles: hair, grass and ribbons.
//!
//! # How near they are to pbrt's curves
//!
//! pbrt meets a `flat` or `cylinder` curve where a ray passes its axis at less than half its
//! width, a sheet that faces whoever looks. Such a shape has no triangles, and no two directions
//! see the same normal on it: strategies from the camera and from the light would not agree. Here
//! both kinds are tubes, with the normals that pbrt gives `cylinder` curves. A tube covers what the
//! sheet covers from every side. Its sides are few, an odd number, which has nearly one width from
//! everywhere, and as wide as it takes for the width to be right in the mean over all directions.
//!
//! A thick curve ([`Look`]) has smooth normals. Hair, of which millions are seen together, has
//! five flat sides, turned about its axis at random: widths and normals are then those of a round
//! tube in the mean over hairs, whatever it is made of.
//!
//! On an opaque `flat` curve that makes this difference: pbrt's normal is that of the sheet, so a
//! matte curve under one lamp is brighter there with the lamp behind the eye (4 / pi times), and
//! dark sooner as the lamp goes round. Over all directions of light, as under a sky, both reflect
//! the same. What scatters through a curve does so twice here, at both walls of the tube.
//!
//! A curve of a fibre (`hair`) scatters as a whole, so light is to meet it once, from whatever
//! side it comes: it is a strip, pi / 2 as wide, which is right in the mean over its turns about
//! its axis. Those are at random, and change slowly on the way. What it looks like does not depend
//! on its normals.
//!
//! A `ribbon` is a strip, as in pbrt. Steps along thick curves and ribbons keep them within a
//! twentieth of their width, which is pbrt's own rule; hair is kept within a quarter.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{MeshData, Room};
use crate::simd::rng;

/// Steps along a piece at most, as in pbrt.
const MOST_STEPS: f64 = 1024.0;

/// Normals of a ribbon turn by no more than this in a step (radians).
const TURN: f64 = 0.1;

/// Fibres turn about their axis by so much for every width of their length, and by no more than
/// this in a step (radians): a strip that is turned faster is not along its axis at its edges.
const FIBRE_TURN: [f64; 2] = [0.02, 0.5];

/// Memory of a vertex here and in a mesh, and of the two triangles that come with it.
const VERTEX_BYTES: u64 = 128;

/// One cubic piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePiece {
    /// Bézier control points.
    pub points: [DVec3; 4],
    /// At its ends.
    pub widths: [f64; 2],
    /// Normals at its ends, for a ribbon.
    pub normals: Option<[DVec3; 2]>,
}

/// How a curve's control points are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// Pieces share their end points.
    Bezier,
    /// Uniform; every further point makes a further piece.
    BSpline,
}

impl Basis {
    /// Bézier control points of cubic pieces, of a curve of degree 2 or 3; or what is wrong.
    pub fn pieces(self, degree: usize, points: &[DVec3]) -> Result<Vec<[DVec3; 4]>, String> {
        let n = points.len();
        let fits = match self {
            Self::Bezier => n > degree && (n - 1).is_multiple_of(degree),
            Self::BSpline => n > degree,
        };
        if !fits {
            let rule = match self {
                Self::Bezier => format!("1 and a multiple of {degree}"),
                Self::BSpline => format!("{} or more", degree + 1),
            };
            return Err(format!("has {n} control points, must have {rule}"));
        }
        let step = match self {
            Self::Bezier => degree,
            Self::BSpline => 1,
        };
        let windows = points.windows(degree + 1).step_by(step);
        Ok(windows.map(|p| self.cubic(p)).collect())
    }

    fn cubic(self, p: &[DVec3]) -> [DVec3; 4] {
        let third = |a: DVec3, b: DVec3| a.lerp(b, 1.0 / 3.0);
        let middle = |a: DVec3, b: DVec3| a.lerp(b, 0.5);
        let raised = |a: DVec3, b: DVec3, c: DVec3| [a, third(b, a), third(b, c), c];
        match (self, p) {
            (Self::Bezier, &[a, b, c]) => raised(a, b, c),
            (Self::Bezier, &[a, b, c, d]) => [a, b, c, d],
            (Self::BSpline, &[a, b, c]) => raised(middle(a, b), b, middle(b, c)),
            (Self::BSpline, &[a, b, c, d]) => {
                let (first, last) = (third(b, c), third(c, b));
                [
                    middle(third(b, a), first),
                    first,
                    last,
                    middle(last, third(c, d)),
                ]
            }
            _ => [DVec3::ZERO; 4],
        }
    }
}

impl CurvePiece {
    fn at(&self, u: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        let (ab, bc, cd) = (a.lerp(b, u), b.lerp(c, u), c.lerp(d, u));
        ab.lerp(bc, u).lerp(bc.lerp(cd, u), u)
    }

    /// Unit direction; that of the whole piece where it stands still.
    fn tangent(&self, u: f64) -> DVec3 {
        let [a, b, c, d] = self.points;
        let (ab, bc, cd) = (b - a, c - b, d - c);
        let along = ab.lerp(bc, u).lerp(bc.lerp(cd, u), u);
        let along = along.try_normalize();
        along.unwrap_or_else(|| (d - a).try_normalize().unwrap_or(DVec3::X))
    }

    fn width(&self, u: f64) -> f64 {
        self.widths[0] * (1.0 - u) + self.widths[1] * u
    }

    /// The normal of a ribbon, turned evenly from end to end.
    fn normal(&self, [n0, n1]: [DVec3; 2], u: f64) -> DVec3 {
        let angle = self.turn([n0, n1]);
        let sin = angle.sin();
        if sin < 1e-6 {
            return n0.lerp(n1, u);
        }
        (n0 * ((1.0 - u) * angle).sin() + n1 * (u * angle).sin()) / sin
    }

    fn turn(&self, [n0, n1]: [DVec3; 2]) -> f64 {
        n0.dot(n1).clamp(0.0, 1.0).acos()
    }

    /// Steps that keep it within a part of its width.
    fn steps(&self, flatness: f64) -> usize {
        let p = self.points;
        let bend = |i: usize| (p[i] - 2.0 * p[i + 1] + p[i + 2]).length();
        let width = self.widths[0].max(self.widths[1]);
        let by_bend = (0.75 * bend(0).max(bend(1)) / (flatness * width)).sqrt();
        // Tubes show where they turn, however thick they are.
        let by_turn = 4.0 * self.tangent(0.0).angle_between(self.tangent(1.0));
        let by_normals = self.normals.map_or(0.0, |n| self.turn(n) / TURN);
        let steps = by_bend.max(by_turn).max(by_normals).ceil();
        steps.clamp(1.0, MOST_STEPS) as usize
    }

    fn length(&self) -> f64 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Look {
    /// Sides of a tube.
    sides: usize,
    smooth: bool,
    /// What it may differ from its own course, as a part of its width.
    flatness: f64,
}

impl Look {
    /// By its length in widths: hair is seen from afar, a hose from near.
    fn of(length: f64) -> Self {
        let (sides, smooth, flatness) = match length {
            20.0.. => (5, false, 0.25),
            5.0.. => (11, true, 0.05),
            _ => (23, true, 0.05),
        };
        Self {
            sides,
            smooth,
            flatness,
        }
    }

    /// That of a fibre.
    fn of_fibre(length: f64) -> Self {
        Self {
            sides: 1,
            smooth: false,
            flatness: Self::of(length).flatness,
        }
    }

    const RIBBON: Self = Self {
        sides: 1,
        smooth: true,
        flatness: 0.05,
    };
}

/// A direction across a tube that begins at `p` along `t`; at random, the same for the same place.
fn start(p: DVec3, t: DVec3) -> DVec3 {
    let [x, y, z] = p.as_vec3().to_array().map(f32::to_bits);
    let [word, ..] = rng::hash::<f32>([x, y, z, 0]);
    let turn = TAU * f64::from(rng::unit_float::<f32>(word));
    let (a, b) = t.any_orthonormal_pair();
    a * turn.cos() + b * turn.sin()
}

/// The mesh of all pieces of a curve: a strip if they have normals or if it is a `fibre`, otherwise
/// a tube without ends. `u` runs over each piece, `v` across: on a tube from 0 to 1 and back.
pub fn curve(pieces: &[CurvePiece], fibre: bool, room: Room<'_>) -> Result<MeshData, String> {
    let mut mesh = MeshData {
        normals: Some(Vec::new()),
        uvs: Some(Vec::new()),
        ..Default::default()
    };
    let length: f64 = pieces.iter().map(CurvePiece::length).sum();
    let width = (pieces.iter()).fold(0.0f64, |w, p| w.max(p.widths[0]).max(p.widths[1]));
    if !(length > 0.0 && length.is_finite() && width > 0.0 && width.is_finite()) {
        mesh.warnings.push("the curve has no area".into());
        return Ok(mesh);
    }
    let look = match pieces[0].normals {
        Some(_) => Look::RIBBON,
        None if fibre => Look::of_fibre(length / width),
        None => Look::of(length / width),
    };
    let sides = look.sides;
    let mut across = start(pieces[0].points[0], pieces[0].tangent(0.0));
    for piece in pieces {
        let steps = piece.steps(look.flatness);
        room(VERTEX_BYTES * (steps as u64 + 1) * (sides as u64 + 1))?;
        let first = mesh.positions.len() as u32;
        for i in 0..=steps {
            let u = i as f64 / steps as f64;
            let t = piece.tangent(u);
            match piece.normals {
                Some(normals) => strip_at(&mut mesh, piece, u, piece.normal(normals, u)),
                None => {
                    // Carried along, it turns no more than the curve does.
                    let left = across - t * across.dot(t);
                    across = left.try_normalize().unwrap_or(t.any_orthonormal_vector());
                    if !fibre {
                        ring_at(&mut mesh, piece, u, [across, t.cross(across)], sides);
                        continue;
                    }
                    if i > 0 {
                        let widths = piece.length() / (steps as f64 * width);
                        let (sin, cos) = (FIBRE_TURN[0] * widths).min(FIBRE_TURN[1]).sin_cos();
                        across = across * cos + t.cross(across) * sin;
                    }
                    across_at(&mut mesh, piece, u, across, 0.5 * PI);
                }
            }
        }
        join(&mut mesh, first, steps as u32, sides as u32);
    }
    if !look.smooth {
        mesh.normals = None;
    }
    mesh.drop_degenerate();
    mesh.warnings.clear();
    Ok(mesh)
}

fn push(mesh: &mut MeshData, p: DVec3, n: DVec3, uv: DVec2) {
    mesh.positions.push(p.as_vec3().to_array());
    let normals = mesh.normals.get_or_insert_default();
    normals.push(n.normalize_or_zero().as_vec3().to_array());
    let uvs = mesh.uvs.get_or_insert_default();
    uvs.push(uv.as_vec2().to_array());
}

fn strip_at(mesh: &mut MeshData, piece: &CurvePiece, u: f64, n: DVec3) {
    let t = piece.tangent(u);
    across_at(mesh, piece, u, n.cross(t).normalize_or_zero(), 1.0);
}

/// The edges of a strip along `b`, by a factor wider than the curve.
fn across_at(mesh: &mut MeshData, piece: &CurvePiece, u: f64, b: DVec3, wider: f64) {
    let n = piece.tangent(u).cross(b);
    for v in [0.0, 1.0] {
        let p = piece.at(u) + b * ((v - 0.5) * wider * piece.width(u));
        push(mesh, p, n, DVec2::new(u, v));
    }
}

fn ring_at(mesh: &mut MeshData, piece: &CurvePiece, u: f64, [x, y]: [DVec3; 2], sides: usize) {
    // The mean width of a convex outline is its perimeter over pi.
    let half = PI / sides as f64;
    let radius = 0.5 * piece.width(u) * half / half.sin();
    for i in 0..=sides {
        let part = i as f64 / sides as f64;
        // Turned backwards, which has the front outside.
        let (sin, cos) = if i == sides {
            (0.0, 1.0)
        } else {
            (-TAU * part).sin_cos()
        };
        let n = x * cos + y * sin;
        let v = 1.0 - (2.0 * part - 1.0).abs();
        push(mesh, piece.at(u) + n * radius, n, DVec2::new(u, v));
    }
}

/// Triangles between the rows of a piece, each of so many sides.
fn join(mesh: &mut MeshData, first: u32, steps: u32, sides: u32) {
    for i in 0..steps {
        for j in 0..sides {
            let a = first + i * (sides + 1) + j;
            let [b, c, d] = [a + sides + 1, a + sides + 2, a + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vec(v: [f32; 3]) -> DVec3 {
        DVec3::from(v.map(f64::from))
    }

    fn mesh(pieces: &[CurvePiece]) -> MeshData {
        curve(pieces, false, &mut |_| Ok(())).unwrap()
    }

    fn arc(normals: Option<[DVec3; 2]>) -> CurvePiece {
        let k = 4.0 / 3.0 * (2f64.sqrt() - 1.0);
        let [x, y] = [DVec3::X, DVec3::Y];
        CurvePiece {
            points: [x, x + k * y, y + k * x, y],
            widths: [0.02, 0.01],
            normals,
        }
    }

    /// A point and a direction of a B-spline are those of its basis functions.
    #[test]
    fn bases_become_cubic_pieces() {
        let p = [[0.0, 0.0], [1.0, 3.0], [4.0, -1.0], [5.0, 2.0], [7.0, 7.0]];
        let p = p.map(|[x, y]| DVec3::new(x, y, x * y));
        let piece = |points: [DVec3; 4]| CurvePiece {
            points,
            widths: [1.0; 2],
            normals: None,
        };
        let near = |a: DVec3, b: DVec3| assert!((a - b).length() < 1e-12, "{a} {b}");
        let cubic = Basis::BSpline.pieces(3, &p).unwrap();
        assert_eq!(cubic.len(), 2);
        near(piece(cubic[0]).at(0.0), (p[0] + 4.0 * p[1] + p[2]) / 6.0);
        near(piece(cubic[0]).at(1.0), piece(cubic[1]).at(0.0));
        let at_half = (p[0] + 23.0 * p[1] + 23.0 * p[2] + p[3]) / 48.0;
        near(piece(cubic[0]).at(0.5), at_half);
        let square = Basis::BSpline.pieces(2, &p[..4]).unwrap();
        near(piece(square[0]).at(0.5), (p[0] + 6.0 * p[1] + p[2]) / 8.0);
        near(piece(square[1]).at(1.0), (p[2] + p[3]) / 2.0);
        let two = Basis::Bezier.pieces(2, &p).unwrap();
        near(piece(two[1]).at(0.5), (p[2] + 2.0 * p[3] + p[4]) / 4.0);
        assert_eq!(
            Basis::Bezier.pieces(3, &p[..4]).unwrap(),
            [[p[0], p[1], p[2], p[3]]]
        );
        assert!(
            Basis::Bezier
                .pieces(3, &p)
                .unwrap_err()
                .contains("5 control points")
        );
        assert!(Basis::BSpline.pieces(3, &p[..3]).is_err());
    }

    #[test]
    fn tubes_surround_their_axis() {
        let mut piece = arc(None);
        piece.widths = [0.2, 0.1];
        let mesh = mesh(&[piece]);
        let (normals, uvs) = (mesh.normals.as_ref().unwrap(), mesh.uvs.as_ref().unwrap());
        for (i, p) in mesh.positions.iter().enumerate() {
            let p = vec(*p);
            let axis = p.truncate().normalize().extend(0.0);
            let half = 0.5 * (0.2 - 0.1 * f64::from(uvs[i][0]));
            let r = (p - axis).length() / half;
            // Bézier points are off the circle by 2.7e-4.
            assert!((1.0..1.03).contains(&r), "{p} {r}");
            assert!((p - axis).normalize().dot(vec(normals[i])) > 0.99);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| vec(mesh.positions[v as usize]));
            let face = (b - a).cross(c - a).normalize();
            assert!(t.iter().all(|&v| face.dot(vec(normals[v as usize])) > 0.8));
        }
    }

    /// Seen from all around, the width is right in the mean; so is the area of a cylinder.
    #[test]
    fn tubes_have_the_area_of_what_they_stand_for() {
        for (width, sides) in [(0.7, 23), (0.5, 11), (0.1, 5)] {
            let straight = CurvePiece {
                points: [0.0, 1.0, 2.0, 3.0].map(|z| DVec3::new(0.0, 0.0, z)),
                widths: [width; 2],
                normals: None,
            };
            let mesh = mesh(&[straight]);
            assert_eq!(mesh.triangles.len(), 2 * sides);
            assert_eq!(mesh.normals.is_some(), sides > 5);
            let areas = mesh.triangles.iter().map(|t| {
                let [a, b, c] = t.map(|v| vec(mesh.positions[v as usize]));
                (b - a).cross(c - a).length() * 0.5
            });
            let area: f64 = areas.sum();
            assert!((area / (3.0 * width * PI) - 1.0).abs() < 1e-5, "{area}");
        }
    }

    /// A fibre is a strip along its axis, seen as wide as the curve is in the mean over its turns.
    #[test]
    fn fibres_are_met_once() {
        let straight = CurvePiece {
            points: [0.0, 1.0, 2.0, 3.0].map(|z| DVec3::new(0.0, 0.0, z)),
            widths: [0.01; 2],
            normals: None,
        };
        let one = |piece| curve(&[piece], true, &mut |_| Ok(())).unwrap();
        let mesh = one(straight);
        assert_eq!(mesh.triangles.len(), 2);
        for (p, uv) in mesh.positions.iter().zip(mesh.uvs.as_ref().unwrap()) {
            let [r, side] = [f64::from(p[0]).hypot(p[1].into()), f64::from(uv[1])];
            assert!((r - 0.25 * PI * 0.01).abs() < 1e-8 && (side == 0.0 || side == 1.0));
        }
        // Turns are spread evenly: the mean over many is that over a circle.
        let mut width = 0.0;
        for i in 0..2000 {
            let at = DVec3::new(f64::from(i), 0.3, 0.0);
            let mesh = one(CurvePiece {
                points: straight.points.map(|p| p + at),
                ..straight
            });
            let [a, b] = [0, 1].map(|i| vec(mesh.positions[i]));
            width += (b - a).y.abs() / 2000.0;
        }
        assert!((width / 0.01 - 1.0).abs() < 0.05, "{width}");
        assert!(one(arc(None)).triangles.len() > 2);
    }

    #[test]
    fn ribbons_are_strips_along_their_normals() {
        let normals = [DVec3::Z, DVec3::new(-0.6, 0.0, 0.8)];
        let piece = arc(Some(normals));
        let mesh = mesh(&[piece]);
        let uvs = mesh.uvs.as_ref().unwrap();
        for (pair, uv) in mesh.positions.chunks_exact(2).zip(uvs.chunks_exact(2)) {
            let [a, b] = [vec(pair[0]), vec(pair[1])];
            let u = f64::from(uv[0][0]);
            assert!((a.distance(b) - piece.width(u)).abs() < 1e-6);
            assert_eq!([uv[0][1], uv[1][1]], [0.0, 1.0]);
            let n = piece.normal(normals, u);
            assert!(n.is_normalized() && n.dot(b - a).abs() < 1e-6);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| vec(mesh.positions[v as usize]));
            assert!((b - a).cross(c - a).normalize().z > 0.5);
        }
    }

    #[test]
    fn nothing_to_draw() {
        let mut piece = arc(None);
        piece.widths = [0.0; 2];
        let still = CurvePiece {
            points: [DVec3::ONE; 4],
            ..arc(None)
        };
        for piece in [piece, still] {
            let mesh = mesh(&[piece]);
            assert!(mesh.triangles.is_empty() && mesh.warnings.len() == 1);
        }
        assert!(mesh(&[]).triangles.is_empty());
        let none = curve(&[arc(None)], false, &mut |_| Err("no room".into()));
        assert_eq!(none.unwrap_err(), "no room");
    }
}
