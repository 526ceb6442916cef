//! Bump and normal maps: shading normals of a surface that is rougher than its geometry.
//!
//! 1. A bump map is a height along the normal (Blinn 1978, "Simulation of Wrinkled Surfaces";
//!    pbrt-v4, section 10.5.3). Its derivatives are finite differences over 0.0005 in `u` and in
//!    `v`, what pbrt takes where a ray has no differentials; none has any here.
//! 2. A normal map is a direction in the tangent space of the surface (pbrt-v4, section 10.5.2).
//!
//! The height is in units of the scene file. On meshes with vertex normals the directions in which
//! it is measured have length 1 in v3 and the length of dp/du in v4, as in pbrt. Other than in
//! pbrt-v3, hills are hills there, too: its tangents of such meshes point backwards.
//!
//! What is looked up is apart from what is made of it, so that the same look-up can be followed in
//! double precision.

use super::texture::image::bilinear;
use super::texture::{self, Place};
use crate::geometry::Derivatives;
use crate::scene::{Bump, Image, Tangents, Texture, Wrap};
use glam::DVec3;

/// How far apart heights are looked up, in texture coordinates.
const STEP: f32 = 0.0005;

/// What was looked up at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Perturbation {
    /// A bump map's; internal lengths.
    Height {
        /// Along the normal.
        height: f64,
        /// Change of the height along `u`.
        by_u: f64,
        /// Change of the height along `v`.
        by_v: f64,
    },
    /// Along dp/du, across it, and along the normal; of any length.
    Direction([f64; 3]),
}

/// A shading frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerturbedFrame {
    /// Unit normal.
    pub ns: DVec3,
    /// Along increasing `u`, of any length.
    pub tangent: DVec3,
}

/// The axes in which a bump is measured: dp/du and dp/dv as shading has them, internal lengths.
/// `unit` is the length of one unit of the scene file.
fn axes(bump: &Bump, d: &Derivatives, ns: DVec3, unit: f64) -> [DVec3; 2] {
    let t = ns.cross(d.dpdu);
    let length = t.length();
    if !(length > 0.0 && d.dpdv.length_squared() > 0.0) {
        // Any directions will do, as in pbrt.
        let (s, t) = ns.any_orthonormal_pair();
        return [s * unit, t * unit];
    }
    if !d.smooth {
        return [d.dpdu, d.dpdv];
    }
    let s = t.cross(ns);
    match bump {
        Bump::Height {
            tangents: Tangents::Unit,
            ..
        } => [s * (unit / length), t * (unit / length)],
        _ => [s, t],
    }
}

/// Looks up what `bump` says at `place`.
pub fn look_up(
    textures: &[Texture],
    images: &[Image],
    bump: &Bump,
    place: &Place,
    d: &Derivatives,
    ns: DVec3,
    unit: f64,
) -> Perturbation {
    match *bump {
        Bump::Normal { image } => {
            let [u, v] = place.uv;
            let rgb = bilinear(&images[image as usize], u, v, Wrap::Repeat);
            Perturbation::Direction(rgb.map(|c| 2.0 * f64::from(c) - 1.0))
        }
        Bump::Height { height, .. } => {
            let at =
                |place: &Place| f64::from(texture::evaluate(textures, images, height, place)[0]);
            let here = at(place);
            let axes = axes(bump, d, ns, unit);
            let slope = |axis: usize| {
                let mut there = *place;
                there.uv[axis] += STEP;
                // What rounding has left of the step.
                let step = f64::from(there.uv[axis]) - f64::from(place.uv[axis]);
                let p = DVec3::from(place.p.map(f64::from)) + axes[axis] * f64::from(STEP);
                there.p = p.as_vec3().to_array();
                if step > 0.0 {
                    unit * (at(&there) - here) / step
                } else {
                    0.0
                }
            };
            Perturbation::Height {
                height: unit * here,
                by_u: slope(0),
                by_v: slope(1),
            }
        }
    }
}

/// The shading frame with a perturbation on a surface of shading normal `ns` and geometric normal
/// `ng`. Where that is not defined, the surface stays as it is.
pub fn perturb(
    bump: &Bump,
    perturbation: &Perturbation,
    d: &Derivatives,
    [ns, ng]: [DVec3; 2],
    unit: f64,
) -> PerturbedFrame {
    let [s, t] = axes(bump, d, ns, unit);
    let (n, tangent) = match *perturbation {
        Perturbation::Height { height, by_u, by_v } => {
            let by_u = s + ns * by_u + d.dndu * height;
            let by_v = t + ns * by_v + d.dndv * height;
            (normalized(by_u).cross(normalized(by_v)), by_u)
        }
        Perturbation::Direction([x, y, z]) => {
            let along = normalized(s - ns * ns.dot(s));
            let n = along * x + ns.cross(along) * y + ns * z;
            let n = normalized(n);
            (n, s - n * n.dot(s))
        }
    };
    let n = normalized(n);
    let tangent = normalized(tangent);
    if !(n.is_finite() && tangent.is_finite()) || n == DVec3::ZERO {
        return PerturbedFrame {
            ns,
            tangent: normalized(s),
        };
    }
    // pbrt's Faceforward; the true normal is on the side of the vertices' normals already.
    let side = if ns.dot(ng) < 0.0 { -ng } else { ng };
    let n = if n.dot(side) < 0.0 { -n } else { n };
    PerturbedFrame { ns: n, tangent }
}

/// Unit, whatever the length; zero if that is 0.
fn normalized(v: DVec3) -> DVec3 {
    let largest = v.abs().max_element();
    if largest > 0.0 {
        (v / largest).normalize()
    } else {
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mapping, Param, UvMapping};

    const PLANE: Derivatives = Derivatives {
        dpdu: DVec3::new(2.0, 0.0, 0.0),
        dpdv: DVec3::new(0.0, 4.0, 0.0),
        dndu: DVec3::ZERO,
        dndv: DVec3::ZERO,
        smooth: false,
    };
    const BUMP: Bump = Bump::Height {
        height: Param::Constant([0.0; 3]),
        tangents: Tangents::LikeU,
    };

    fn perturbed(perturbation: Perturbation, d: &Derivatives, n: DVec3) -> DVec3 {
        perturb(&BUMP, &perturbation, d, [n, n], 1.0).ns
    }

    /// On a plane of 2 by 4 a height of `a u + b v` is the graph of `a x / 2 + b y / 4`.
    #[test]
    fn slopes_tilt_the_normal_of_a_plane() {
        for (a, b) in [(0.0, 0.0), (1.0, 0.0), (0.5, -3.0), (-20.0, 8.0)] {
            let perturbation = Perturbation::Height {
                height: 7.0,
                by_u: a,
                by_v: b,
            };
            let expected = DVec3::new(-a / 2.0, -b / 4.0, 1.0).normalize();
            assert!(perturbed(perturbation, &PLANE, DVec3::Z).distance(expected) < 1e-12);
            // Texture coordinates the other way round are the same surface, and from below hills
            // are hollows.
            let mirrored = Derivatives {
                dpdv: -PLANE.dpdv,
                ..PLANE
            };
            let across = DVec3::new(-a / 2.0, b / 4.0, 1.0).normalize();
            assert!(perturbed(perturbation, &mirrored, DVec3::Z).distance(across) < 1e-12);
            let below = DVec3::new(-a / 2.0, -b / 4.0, -1.0).normalize();
            assert!(perturbed(perturbation, &PLANE, -DVec3::Z).distance(below) < 1e-12);
        }
    }

    /// A sphere blown up evenly keeps its normals.
    #[test]
    fn even_heights_change_nothing() {
        let w = DVec3::new(0.48, -0.6, 0.64);
        let (s, t) = (
            DVec3::new(0.6, 0.48, 0.0),
            w.cross(DVec3::new(0.6, 0.48, 0.0)),
        );
        let round = Derivatives {
            dpdu: s * 3.0,
            dpdv: t * 2.0,
            dndu: s * 3.0,
            dndv: t * 2.0,
            smooth: false,
        };
        let perturbation = Perturbation::Height {
            height: 0.3,
            by_u: 0.0,
            by_v: 0.0,
        };
        for d in [
            round,
            Derivatives {
                smooth: true,
                ..round
            },
        ] {
            assert!(perturbed(perturbation, &d, w).distance(w) < 1e-12);
        }
    }

    #[test]
    fn directions_are_those_of_tangent_space() {
        let direction = |x, y, z| perturbed(Perturbation::Direction([x, y, z]), &PLANE, DVec3::Z);
        assert_eq!(direction(0.0, 0.0, 1.0), DVec3::Z);
        let expected = DVec3::new(0.6, 0.0, 0.8);
        assert!(direction(3.0, 0.0, 4.0).distance(expected) < 1e-12);
        let expected = DVec3::new(0.0, -0.6, 0.8);
        assert!(direction(0.0, -3.0, 4.0).distance(expected) < 1e-12);
        // Below the surface is not where light is: the other way.
        let expected = DVec3::new(-0.6, 0.0, 0.8);
        assert!(direction(3.0, 0.0, -4.0).distance(expected) < 1e-12);
        // Nothing to go by.
        assert_eq!(direction(0.0, 0.0, 0.0), DVec3::Z);
        assert_eq!(direction(f64::NAN, 0.0, 0.0), DVec3::Z);
    }

    #[test]
    fn texture_coordinates_without_direction_do_no_harm() {
        let flat = Derivatives {
            dpdu: DVec3::ZERO,
            dpdv: DVec3::ZERO,
            ..PLANE
        };
        for perturbation in [
            Perturbation::Height {
                height: 1.0,
                by_u: 0.0,
                by_v: 0.0,
            },
            Perturbation::Direction([0.0, 0.0, 1.0]),
        ] {
            assert!(perturbed(perturbation, &flat, DVec3::Y).distance(DVec3::Y) < 1e-12);
        }
    }

    #[test]
    fn heights_are_looked_up_a_step_apart() {
        // A texel is a hundredth of u wide, and higher by 1 than the one before.
        let image = Image {
            name: String::new(),
            width: 100,
            height: 1,
            texels: (0..100).map(|i| [i as f32; 3]).collect(),
        };
        let texture = Texture::Image {
            image: 0,
            mapping: Mapping::Uv(UvMapping {
                su: 1.0,
                sv: 1.0,
                du: 0.0,
                dv: 0.0,
            }),
            wrap: Wrap::Repeat,
            scale: 1.0,
            invert: false,
        };
        let bump = Bump::Height {
            height: Param::Texture(0),
            tangents: Tangents::LikeU,
        };
        let place = Place {
            uv: [0.3, 0.5],
            ..Place::default()
        };
        let perturbation = look_up(&[texture], &[image], &bump, &place, &PLANE, DVec3::Z, 0.5);
        let Perturbation::Height { height, by_u, by_v } = perturbation else {
            panic!("{perturbation:?}");
        };
        // 100 per u, and half of it in internal lengths.
        assert!((height - 0.5 * 29.5).abs() < 1e-5, "{height}");
        assert!((by_u - 50.0).abs() < 0.2, "{by_u}");
        assert_eq!(by_v, 0.0);
    }
}
