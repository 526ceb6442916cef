//! What a path is worth, from its vertices alone, in `f64`.
//!
//! * The measurement contribution `F` with respect to the product of areas of the surface vertices:
//!   importance (the camera's density), BSDFs with cosines against *shading* normals towards the
//!   light, and `|cos ng| / d^2` per segment. If something on it disperses light, times the colour
//!   of its wavelength, which all strategies share.
//! * The density `p_s` of the path under every strategy `s`, with respect to the same measure. A
//!   direction sampled with density `p` (solid angle) makes a density `p |cos ng| / d^2` at the
//!   vertex it arrives at, cosines against *geometric* normals. The vertex on an environment is its
//!   direction (solid angle); a light from infinity arrives with density `|cos ng| / (pi R^2)`. A
//!   vertex on a delta BSDF has the same delta distribution in every strategy, up to a factor that
//!   depends on the direction of the walk (below); a strategy that would have to connect it has
//!   density 0.
//!
//! Refraction of solid angles at a delta vertex: `p(back) / p(forth) = (n_o^2 cos_o) / (n_t^2
//! cos_t)`, since `n_o^2 cos_o dw_o = n_t^2 cos_t dw_t`. The balance heuristic gives the path the
//! value `F / sum p_s`, whatever strategy sampled it.
//!
//! Products are kept as logarithms: those of a path of hundreds of vertices are beyond `f64`.

use super::known::Oracle;
use super::lights::EndPoint;
use super::path::{Path, PathVertex};
use super::vector::*;
use super::{bsdf, coated, panorama};
use crate::scene::{Projection, Sides};
use crate::surface::{Kind, Mode, Tabulated};

/// What [`Oracle::reference`] finds.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Unit directions along the path, from the camera; the last one leads to the light.
    pub towards: Vec<V>,
    /// The BSDF at each surface vertex.
    pub joints: Vec<Joint>,
    /// Density of the camera's ray over solid angle, or over area of the film plane if it is
    /// orthographic.
    pub camera_pdf: f64,
    /// Throughput of a light subpath that has left the light along the path.
    pub emitted_beta: V,
    /// Logarithms of `F` and of `p_s` for `s = 0 ..= k + 1`.
    log_contribution: V,
    log_density: Vec<f64>,
}

/// A BSDF on a path: `wo` to the camera, `wi` to the light.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// `f |cos ns|` towards the light, radiance mode; the weight of a delta lobe.
    pub f_cos: V,
    /// Density over solid angle of `wi` given `wo`; of a delta lobe 1.
    pub forth: f64,
    /// Density over solid angle of `wo` given `wi`; of a delta lobe the ratio of the two.
    pub back: f64,
    /// Absolute cosine against the geometric normal, towards the camera.
    pub cos_in: f64,
    /// The same towards the light.
    pub cos_out: f64,
}

impl Reference {
    /// `F` with respect to the product of areas.
    pub fn contribution(&self) -> V {
        self.log_contribution.map(f64::exp)
    }

    /// `p_s`.
    pub fn density(&self, s: u32) -> f64 {
        self.log_p(s).exp()
    }

    fn log_p(&self, s: u32) -> f64 {
        let p = self.log_density.get(s as usize);
        p.copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// Logarithm of the sum of all densities.
    fn log_sum(&self) -> f64 {
        let most = (self.log_density.iter()).fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        if most == f64::NEG_INFINITY {
            return most;
        }
        let sum: f64 = self.log_density.iter().map(|p| (p - most).exp()).sum();
        most + sum.ln()
    }

    /// `F / sum p_s`: what the renderer reports, times the probability of the strategy.
    pub fn rgb(&self) -> V {
        let sum = self.log_sum();
        self.log_contribution.map(|f| {
            if f > f64::NEG_INFINITY {
                (f - sum).exp()
            } else {
                0.0
            }
        })
    }

    /// The mean of its channels.
    pub fn value(&self) -> f64 {
        mean(self.rgb())
    }

    /// The MIS weight `p_s / sum`; 0 of a path that no strategy makes.
    pub fn weight(&self, s: u32) -> f64 {
        let p = self.log_p(s);
        if p > f64::NEG_INFINITY {
            (p - self.log_sum()).exp()
        } else {
            0.0
        }
    }

    /// Throughput of a camera subpath arriving at surface vertex `j`.
    pub fn camera_beta(&self, j: usize) -> V {
        let joints = self.joints.iter().take(j);
        joints.fold([1.0; 3], |beta, joint| {
            std::array::from_fn(|c| beta[c] * joint.f_cos[c] / joint.forth)
        })
    }

    /// What a light subpath's throughput is multiplied by at surface vertex `j`.
    pub fn light_factor(&self, j: usize) -> V {
        let joint = &self.joints[j];
        scale(joint.f_cos, joint.cos_in / (joint.cos_out * joint.back))
    }

    /// Throughput of a light subpath arriving at surface vertex `j`.
    pub fn light_beta(&self, j: usize) -> V {
        (j + 1..self.joints.len())
            .rev()
            .fold(self.emitted_beta, |beta, i| {
                let factor = self.light_factor(i);
                std::array::from_fn(|c| beta[c] * factor[c])
            })
    }
}

impl Oracle<'_> {
    /// Contribution and densities of a path under the given strategies.
    pub fn reference(&self, path: &Path, strategies: &[u32]) -> Reference {
        let k = path.surface.len();
        let x = &path.surface;
        let end = self.end(&path.end);
        let (towards, inv_d2) = self.segments(path, &end);
        let joints: Vec<Joint> = (0..k)
            .map(|j| {
                joint(
                    (self.sides, self.tables),
                    &x[j],
                    scale(towards[j], -1.0),
                    towards[j + 1],
                )
            })
            .collect();
        let end_cos = |w: V| end.normal.map_or(1.0, |n| dot(w, n).abs());
        let leaving = scale(towards[k], -1.0);
        let (emitted, emission_pdf) = self.emission(&path.end, &end, leaving);
        let camera_pdf = self.camera_pdf(towards[0]);

        // Density over area at a vertex per density over solid angle; where k = 0 the camera sees
        // the light itself.
        let arrive = |j: usize| match joints.get(j) {
            Some(joint) => (joint.cos_in * inv_d2[j]).ln(),
            None => (end_cos(towards[k]) * inv_d2[k]).ln(),
        };
        let arrive: Vec<f64> = (0..=k).map(arrive).collect();
        let mut log_contribution: V = std::array::from_fn(|c| {
            emitted[c].ln() + path.colour[c].ln() + camera_pdf.ln() + arrive[0]
        });
        for (j, joint) in joints.iter().enumerate() {
            for (value, f_cos) in log_contribution.iter_mut().zip(joint.f_cos) {
                *value += f_cos.ln() + arrive[j + 1];
            }
        }
        // Densities over area of vertices as a camera subpath and as a light subpath make them.
        let mut forth = Vec::with_capacity(k + 1);
        let mut back = Vec::with_capacity(k);
        for j in 0..=k {
            let direction = if j == 0 {
                camera_pdf
            } else {
                joints[j - 1].forth
            };
            forth.push(direction.ln() + arrive[j]);
        }
        for j in 0..k {
            // inv_d2 is 1 where the light is at infinity, and the emission density that of the
            // disk.
            let direction = joints.get(j + 1).map_or(emission_pdf, |next| next.back);
            back.push((direction * joints[j].cos_out * inv_d2[j + 1]).ln());
        }
        let log_density = (0..=k as u32 + 1)
            .map(|s| match strategies.contains(&s) {
                true => log_density(x, &end, s, &forth, &back),
                false => f64::NEG_INFINITY,
            })
            .collect();
        let emission = match end.normal {
            Some(_) => end_cos(towards[k]) / (end.pdf * emission_pdf),
            None => 1.0 / (end.pdf * emission_pdf),
        };
        Reference {
            towards,
            joints,
            camera_pdf,
            emitted_beta: scale(emitted, emission),
            log_contribution: log_contribution
                .map(|f| if f.is_nan() { f64::NEG_INFINITY } else { f }),
            log_density,
        }
    }

    /// Unit directions from the camera to the light, segment by segment, and one over the squares
    /// of their lengths; 1 where distances do not change densities.
    fn segments(&self, path: &Path, end: &EndPoint) -> (Vec<V>, Vec<f64>) {
        let k = path.surface.len();
        let mut towards: Vec<V> = Vec::with_capacity(k + 1);
        let mut inv_d2: Vec<f64> = Vec::with_capacity(k + 1);
        let mut from = path.camera;
        for to in path.surface.iter().map(|v| Some(v.p)).chain([end.position]) {
            match to {
                Some(p) => {
                    let v = sub(p, from);
                    towards.push(unit(v));
                    inv_d2.push(1.0 / dot(v, v));
                    from = p;
                }
                None => {
                    towards.push(end.direction);
                    inv_d2.push(1.0);
                }
            }
        }
        if self.scene.camera.projection == Projection::Orthographic {
            towards[0] = self.axis();
            inv_d2[0] = 1.0;
        }
        (towards, inv_d2)
    }

    fn axis(&self) -> V {
        let m = &self.scene.camera.to_world;
        wide([m[0][2], m[1][2], m[2][2]])
    }

    /// Density of camera rays: uniform over the sampled region of the screen, on the plane `z = 1`
    /// of a perspective camera, or of the sphere.
    fn camera_pdf(&self, direction: V) -> f64 {
        let film = &self.scene.film;
        if let Projection::Sphere(map) = self.scene.camera.projection {
            let m = self.scene.camera.to_world;
            // Its columns are orthonormal.
            let local = [0, 1, 2].map(|c| dot(direction, wide([m[0][c], m[1][c], m[2][c]])));
            return panorama::density(map, film, &self.region, local);
        }
        let [x0, x1, y0, y1] = self.scene.camera.screen.map(f64::from);
        let region = self.region;
        let pixel = (x1 - x0) / f64::from(film.width) * (y1 - y0) / f64::from(film.height);
        let area = pixel.abs() * f64::from(region.width) * f64::from(region.height);
        if self.scene.camera.projection == Projection::Orthographic {
            1.0 / area
        } else {
            1.0 / (area * dot(direction, self.axis()).powi(3))
        }
    }
}

/// Logarithm of the density of a path with surface vertices `x` under the strategy of `s` light
/// vertices, from those of its vertices as a camera subpath (`forth`) and as a light subpath
/// (`back`) make them.
fn log_density(x: &[PathVertex], end: &EndPoint, s: u32, forth: &[f64], back: &[f64]) -> f64 {
    let delta = |j: usize| x[j].kind.is_delta();
    let t = x.len() + 2 - s as usize;
    // Vertices x_{t-1} and x_t are joined; x_0 and the light can always be.
    let joined = s >= 1 && (t >= 2 && delta(t - 2) || s >= 2 && delta(t - 1));
    if joined || s == 0 && end.is_delta {
        return f64::NEG_INFINITY;
    }
    let mut p: f64 = forth[..t - 1].iter().sum();
    if s >= 1 {
        p += end.pdf.ln();
    }
    if s >= 2 {
        p += back[t - 1..].iter().sum::<f64>();
    }
    // A product with 0 in it is 0, whatever else is infinite.
    if p.is_nan() { f64::NEG_INFINITY } else { p }
}

fn joint((sides, tables): (Option<Sides>, &Tabulated), v: &PathVertex, wo: V, wi: V) -> Joint {
    let row = v.row.map(f64::from);
    let (co, ci) = (dot(wo, v.ns), dot(wi, v.ns));
    let rgb = |at: usize| [row[at], row[at + 1], row[at + 2]];
    let lobe = |f_cos: V, back: f64| (f_cos, 1.0, back);
    let (f_cos, forth, back) = match v.kind {
        Kind::Mirror => lobe(rgb(0), 1.0),
        Kind::SmoothConductor => {
            let f = |c: usize| bsdf::conductor(co.abs(), row[c], row[3 + c]);
            lobe([0, 1, 2].map(f), 1.0)
        }
        // The probability of the lobe is in every density and in the value: left out.
        Kind::SmoothDielectric if co * ci > 0.0 => lobe(rgb(0), 1.0),
        Kind::SmoothDielectric => {
            let eta = if co > 0.0 { row[6] } else { 1.0 / row[6] };
            let bend = 1.0 / (eta * eta);
            lobe(scale(rgb(3), bend), (co / ci).abs() * bend)
        }
        Kind::ThinDielectric => lobe([1.0; 3], 1.0),
        Kind::Coat => lobe([bsdf::dielectric(co.abs(), row[0]).0; 3], 1.0),
        Kind::CoatedMirror => lobe([0, 1, 2].map(|c| coated::mirror(&row, co.abs(), c)), 1.0),
        kind if kind.is_delta() => {
            let (s, t) = axes(v);
            let local = |w: V| [dot(w, s), dot(w, t), dot(w, v.ns)];
            bsdf::delta_of_kernel(kind, &row, local(wo), ci > 0.0)
        }
        _ => {
            let (s, t) = axes(v);
            let local = |w: V| [dot(w, s), dot(w, t), dot(w, v.ns)];
            let (o, i) = (local(wo), local(wi));
            let eval = |o: V, i: V| bsdf::eval_in(tables, v.kind, &row, [o, i], Mode::Radiance);
            if exchanges(sides, v) && is_disputed(v, wo, wi) {
                let other = |w: V| twin(w, local(v.ng));
                let f = bsdf::across(v.kind, &row, o, i);
                let pdf = eval(o, other(i)).pdf;
                (scale(f, ci.abs()), pdf, eval(other(o), i).pdf_reverse)
            } else {
                let value = eval(o, i);
                (scale(value.f, ci.abs()), value.pdf, value.pdf_reverse)
            }
        }
    };
    let delta = v.kind.is_delta();
    let valid = co * ci != 0.0
        && match sides {
            _ if v.kind.is_whole() => true,
            None => sides_agree(wo, wi, v),
            Some(Sides::Geometric) if !delta => true,
            Some(_) => v.ns != v.ng || sides_agree(wo, wi, v),
        };
    Joint {
        f_cos: if valid {
            std::array::from_fn(|c| f_cos[c] * f64::from(v.share[c]))
        } else {
            [0.0; 3]
        },
        forth,
        back,
        cos_in: dot(wo, v.ng).abs(),
        cos_out: dot(wi, v.ng).abs(),
    }
}

/// Whether a direction about which the normals disagree is exchanged for its twin.
pub(super) fn exchanges(sides: Option<Sides>, v: &PathVertex) -> bool {
    sides == Some(Sides::Geometric) && !v.kind.is_delta() && !v.kind.is_whole()
}

/// Axes of the shading frame; where there is no tangent any will do.
pub(super) fn axes(v: &PathVertex) -> (V, V) {
    let tangent = sub(v.tangent, scale(v.ns, dot(v.ns, v.tangent)));
    let s = if dot(tangent, tangent) > 1e-10 * dot(v.tangent, v.tangent) {
        unit(tangent)
    } else {
        super::warp::frame(v.ns)[0]
    };
    (s, cross(v.ns, s))
}

/// The true and the shading normal disagree whether this is a reflection.
pub(super) fn is_disputed(v: &PathVertex, wo: V, wi: V) -> bool {
    let reflects = |n: V| dot(wo, n) * dot(wi, n) > 0.0;
    reflects(v.ng) != reflects(v.ns)
}

/// The direction that has the same density where the normals disagree
/// ([`sides`](crate::transport::sides)); all in the shading frame.
pub(super) fn twin(w: V, ng: V) -> V {
    let mirrored = [w[0], w[1], -w[2]];
    if dot(mirrored, ng) * dot(w, ng) < 0.0 {
        mirrored
    } else {
        scale(w, -1.0)
    }
}

/// Reflection stays on the side it came from, transmission leaves it, for the true and for the
/// shading surface.
pub(super) fn sides_agree(wo: V, wi: V, v: &PathVertex) -> bool {
    let agree = |w: V| dot(w, v.ng) * dot(w, v.ns) > 0.0;
    agree(wo) && agree(wi)
}
