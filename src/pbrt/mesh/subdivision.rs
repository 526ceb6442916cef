//! Loop subdivision surfaces, as pbrt's `loopsubdiv`.
//!
//! Weights are those of pbrt: Loop's masks with Warren's `beta` (C. Loop, 1987; J. Warren, 1995;
//! Hoppe et al. 1994 for boundaries and tangents). After the last level every vertex moves to its
//! limit position and gets the limit surface's normal.
//!
//! Connectivity is half-edges by number: `3 * face + k` runs from corner `k` of the face to the
//! next one, and `opposite` is its twin. One level splits a face into three corner faces and a
//! middle one; the twins of the children follow from those of the parents by arithmetic, so only
//! the input is ever searched.

use std::collections::HashMap;

use glam::DVec3;

use super::{MAX_TRIANGLES, MeshData, narrow_normals};

/// No twin: the half-edge is on the boundary.
const NONE: u32 = u32::MAX;

struct Mesh {
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    opposite: Vec<u32>,
}

/// A vertex's neighbours, counter-clockwise; from one end of the boundary to the other if it is on
/// it.
struct Ring {
    neighbours: Vec<DVec3>,
    boundary: bool,
}

fn next(half: u32) -> u32 {
    if half % 3 == 2 { half - 2 } else { half + 1 }
}

fn previous(half: u32) -> u32 {
    if half.is_multiple_of(3) {
        half + 2
    } else {
        half - 1
    }
}

/// Subdivides `levels` times and moves the vertices to the limit surface. Vertices that no face
/// uses are left out.
///
/// Normals point as pbrt's do: to the side from which the faces of the control mesh run
/// *clockwise*, so that a shape that takes its orientation from its normals has pbrt's.
pub fn loop_subdivide(levels: u32, p: &[[f32; 3]], indices: &[u32]) -> Result<MeshData, String> {
    let mut mesh = Mesh::new(p, indices)?;
    let triangles = 1u64
        .checked_shl(2 * levels.min(31))
        .and_then(|f| f.checked_mul(mesh.faces.len() as u64));
    if levels > 31 || triangles.is_none_or(|n| n > MAX_TRIANGLES) {
        let faces = mesh.faces.len();
        return Err(format!(
            "{levels} levels of {faces} faces are more than {MAX_TRIANGLES} triangles"
        ));
    }
    for _ in 0..levels {
        mesh = mesh.subdivide();
    }

    let outgoing = mesh.outgoing();
    let mut data = MeshData::default();
    let mut normals = Vec::with_capacity(mesh.positions.len());
    let mut ring = Ring {
        neighbours: Vec::new(),
        boundary: false,
    };
    for (&start, &position) in outgoing.iter().zip(&mesh.positions) {
        mesh.ring(start, &mut ring);
        data.positions.push(ring.limit(position).as_vec3().into());
    }
    // pbrt takes the normals from the rings of limit positions.
    let limits = data.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    mesh.positions = limits.collect();
    for (&start, &position) in outgoing.iter().zip(&mesh.positions) {
        mesh.ring(start, &mut ring);
        normals.push(ring.normal(position));
    }
    data.normals = Some(narrow_normals(&normals));
    data.triangles = mesh.faces;
    data.drop_degenerate();
    Ok(data)
}

impl Mesh {
    fn new(p: &[[f32; 3]], indices: &[u32]) -> Result<Self, String> {
        if indices.is_empty() || !indices.len().is_multiple_of(3) {
            return Err(format!("{} indices are not triangles", indices.len()));
        }
        if indices.len() as u64 > 3 * MAX_TRIANGLES {
            return Err(format!("more than {MAX_TRIANGLES} triangles"));
        }
        // Only vertices in use are kept: the others have no ring.
        let mut kept = vec![NONE; p.len()];
        let mut positions = Vec::new();
        let mut faces = Vec::with_capacity(indices.len() / 3);
        for face in indices.chunks_exact(3) {
            if face[0] == face[1] || face[1] == face[2] || face[2] == face[0] {
                return Err(format!(
                    "a face uses vertex {} twice",
                    if face[0] == face[1] { face[0] } else { face[2] }
                ));
            }
            let mut corners = [0; 3];
            for (corner, &i) in corners.iter_mut().zip(face) {
                let Some(position) = p.get(i as usize) else {
                    return Err(format!(
                        "index {i} is out of range, there are {} vertices",
                        p.len()
                    ));
                };
                if kept[i as usize] == NONE {
                    kept[i as usize] = positions.len() as u32;
                    positions.push(DVec3::from(position.map(f64::from)));
                }
                *corner = kept[i as usize];
            }
            faces.push(corners);
        }

        let mut mesh = Mesh {
            positions,
            faces,
            opposite: Vec::new(),
        };
        mesh.connect()?;
        Ok(mesh)
    }

    /// Finds the twins and rejects what is not an oriented surface.
    fn connect(&mut self) -> Result<(), String> {
        let halves = 3 * self.faces.len() as u32;
        let mut by_ends = HashMap::with_capacity(halves as usize);
        for half in 0..halves {
            if by_ends
                .insert((self.origin(half), self.origin(next(half))), half)
                .is_some()
            {
                return Err(
                    "an edge has more than two faces, or neighbours of opposite orientation".into(),
                );
            }
        }
        self.opposite = (0..halves)
            .map(|half| {
                by_ends
                    .get(&(self.origin(next(half)), self.origin(half)))
                    .copied()
                    .unwrap_or(NONE)
            })
            .collect();

        // One fan a vertex: walking round it must meet all of its faces.
        let mut corners = vec![0u32; self.positions.len()];
        for &v in self.faces.iter().flatten() {
            corners[v as usize] += 1;
        }
        for (&start, &expected) in self.outgoing().iter().zip(&corners) {
            let mut met = 1;
            let mut half = self.opposite[previous(start) as usize];
            while half != NONE && half != start {
                met += 1;
                half = self.opposite[previous(half) as usize];
            }
            if met != expected {
                return Err("surfaces touch in a single vertex".into());
            }
        }
        Ok(())
    }

    fn origin(&self, half: u32) -> u32 {
        self.faces[(half / 3) as usize][(half % 3) as usize]
    }

    /// For every vertex a half-edge that leaves it; on the boundary the one along it.
    fn outgoing(&self) -> Vec<u32> {
        let mut outgoing = vec![NONE; self.positions.len()];
        for half in 0..self.opposite.len() as u32 {
            let entry = &mut outgoing[self.origin(half) as usize];
            if *entry == NONE || self.opposite[half as usize] == NONE {
                *entry = half;
            }
        }
        outgoing
    }

    /// The ring of the vertex that `start`, one of [`Mesh::outgoing`], leaves.
    fn ring(&self, start: u32, ring: &mut Ring) {
        let at = |half: u32| self.positions[self.origin(half) as usize];
        ring.neighbours.clear();
        ring.boundary = self.opposite[start as usize] == NONE;
        let mut half = start;
        loop {
            ring.neighbours.push(at(next(half)));
            let incoming = previous(half);
            half = self.opposite[incoming as usize];
            if half == NONE {
                ring.neighbours.push(at(incoming));
                return;
            }
            if half == start {
                return;
            }
        }
    }

    fn subdivide(&self) -> Mesh {
        let mut ring = Ring {
            neighbours: Vec::new(),
            boundary: false,
        };
        let mut positions: Vec<DVec3> = Vec::with_capacity(4 * self.positions.len());
        for (&start, &position) in self.outgoing().iter().zip(&self.positions) {
            self.ring(start, &mut ring);
            positions.push(ring.even(position));
        }

        // New vertices on edges, numbered where the twin with the lower number comes by.
        let mut on_edge = vec![NONE; self.opposite.len()];
        for half in 0..self.opposite.len() as u32 {
            let twin = self.opposite[half as usize];
            if twin < half {
                on_edge[half as usize] = on_edge[twin as usize];
                continue;
            }
            on_edge[half as usize] = positions.len() as u32;
            let at = |half: u32| self.positions[self.origin(half) as usize];
            let ends = at(half) + at(next(half));
            positions.push(if twin == NONE {
                0.5 * ends
            } else {
                0.375 * ends + 0.125 * (at(previous(half)) + at(previous(twin)))
            });
        }

        let mut faces = Vec::with_capacity(4 * self.faces.len());
        let mut opposite = Vec::with_capacity(12 * self.faces.len());
        // Children of face `f`: `4 f + k` at corner `k` (corner, new vertex ahead, new vertex
        // behind), `4 f + 3` in the middle.
        let child = |half: u32, edge: u32| 3 * (4 * (half / 3) + half % 3) + edge;
        for (f, face) in self.faces.iter().enumerate() {
            let first = 3 * f as u32;
            let middle = 3 * (4 * f as u32 + 3);
            let e = [0, 1, 2].map(|k| on_edge[first as usize + k]);
            for k in 0..3 {
                let half = first + k as u32;
                faces.push([face[k], e[k], e[(k + 2) % 3]]);
                let ahead = self.opposite[half as usize];
                let behind = self.opposite[previous(half) as usize];
                // The half of an edge next to a corner is the twin's half next to its own end.
                opposite.push(if ahead == NONE {
                    NONE
                } else {
                    child(next(ahead), 2)
                });
                opposite.push(middle + (k as u32 + 2) % 3);
                opposite.push(if behind == NONE {
                    NONE
                } else {
                    child(behind, 0)
                });
            }
            faces.push(e);
            // Edge j of the middle face, from e[j] to e[j + 1], cuts off corner j + 1.
            opposite.extend([1, 2, 0].map(|k| child(first + k, 1)));
        }
        Mesh {
            positions,
            faces,
            opposite,
        }
    }
}

/// Warren's weight of a neighbour.
fn beta(valence: usize) -> f64 {
    if valence == 3 {
        3.0 / 16.0
    } else {
        3.0 / (8.0 * valence as f64)
    }
}

impl Ring {
    fn ends(&self) -> (DVec3, DVec3) {
        (
            self.neighbours[0],
            self.neighbours[self.neighbours.len() - 1],
        )
    }

    fn interior(&self, centre: DVec3, weight: f64) -> DVec3 {
        let sum: DVec3 = self.neighbours.iter().sum();
        centre * (1.0 - weight * self.neighbours.len() as f64) + sum * weight
    }

    fn along_boundary(&self, centre: DVec3, weight: f64) -> DVec3 {
        let (a, b) = self.ends();
        centre * (1.0 - 2.0 * weight) + (a + b) * weight
    }

    /// An old vertex at the next level.
    fn even(&self, centre: DVec3) -> DVec3 {
        if self.boundary {
            self.along_boundary(centre, 1.0 / 8.0)
        } else {
            // For six neighbours this is Loop's 1 / 16.
            self.interior(centre, beta(self.neighbours.len()))
        }
    }

    /// Where the vertex goes after infinitely many levels.
    fn limit(&self, centre: DVec3) -> DVec3 {
        if self.boundary {
            self.along_boundary(centre, 1.0 / 5.0)
        } else {
            let valence = self.neighbours.len();
            self.interior(centre, 1.0 / (valence as f64 + 3.0 / (8.0 * beta(valence))))
        }
    }

    /// Cross product of two tangents of the limit surface, in pbrt's order and, as there, not
    /// normalised; zero if they are parallel.
    fn normal(&self, centre: DVec3) -> DVec3 {
        let ring = &self.neighbours;
        let n = ring.len();
        let (along, across) = if !self.boundary {
            let step = std::f64::consts::TAU / n as f64;
            let mut sums = (DVec3::ZERO, DVec3::ZERO);
            for (i, &p) in ring.iter().enumerate() {
                let (sin, cos) = (step * i as f64).sin_cos();
                sums.0 += cos * (p - centre);
                sums.1 += sin * (p - centre);
            }
            // pbrt walks interior rings clockwise.
            (sums.0, -sums.1)
        } else {
            let (first, last) = self.ends();
            let across = match n {
                2 => first + last - 2.0 * centre,
                3 => ring[1] - centre,
                4 => -first + 2.0 * ring[1] + 2.0 * ring[2] - last - 2.0 * centre,
                _ => {
                    let theta = std::f64::consts::PI / (n - 1) as f64;
                    let inner = ring[1..n - 1].iter().enumerate().map(|(i, &p)| {
                        (2.0 - 2.0 * theta.cos()) * (theta * (i + 1) as f64).sin() * (p - centre)
                    });
                    inner.sum::<DVec3>() - theta.sin() * (first + last - 2.0 * centre)
                }
            };
            (last - first, across)
        };
        along.cross(across)
    }
}

#[cfg(test)]
mod tests;
