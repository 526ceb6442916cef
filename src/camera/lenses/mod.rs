//! Rays from points of a film through a system of lenses (Kolb, Mitchell and Hanrahan 1995;
//! pbrt-v3, section 6.4): the `realistic` camera.
//!
//! A point on the film sends rays to a rectangle in the plane of the rear vertex, which holds the
//! exit pupil as seen from there (`pupil.rs`); those that the lenses let through are the camera's.
//! Nothing is joined to this camera: which points of the rear plane see a point of the scene has no
//! closed form, so that strategies with `t = 1` do not exist, as in pbrt.

pub mod focus;
mod pupil;

use crate::scene::lenses::{LensElement, LensWeighting, Lenses, StopMask};
use crate::simd::{Lanes, Mask, Vec3};

/// A surface, from the film to the scene.
#[derive(Clone, Copy, Debug)]
struct Surface {
    /// From the vertex before it, or from the film.
    gap: f32,
    /// One over the radius of its sphere, positive if the centre is on the film's side.
    curvature: f32,
    /// Square of its radius around the axis.
    radius2: f32,
    /// Index on the film's side over that on the scene's; 0 for a stop, which bends nothing.
    ratio: f32,
}

/// A system of lenses prepared for rays.
#[derive(Clone, Debug)]
pub(super) struct Optics {
    surfaces: Vec<Surface>,
    mask: Option<StopMask>,
    /// One over the radius of the stop.
    inv_stop: f32,
    /// Of the rear vertex.
    rear: f32,
    /// Of the front vertex.
    front: f32,
    /// Pupils per unit of distance from the middle of the film.
    pupils_per_length: f32,
    /// Rectangles in the rear plane, by the distance of the film's point from the axis, for points
    /// on the `x` axis.
    pupils: Vec<Pupil>,
    /// Internal length of a unit of the camera's space.
    unit: f32,
}

/// A rectangle in the rear plane.
#[derive(Clone, Copy, Debug, Default)]
struct Pupil {
    low: [f32; 2],
    size: [f32; 2],
    /// What the fourth power of the cosine is multiplied by.
    gain: f32,
}

/// A ray that leaves the front lens.
pub(super) struct LensRay<L> {
    /// The camera's space, internal lengths.
    pub origin: Vec3<L>,
    /// Unit.
    pub direction: Vec3<L>,
    /// 0 if it does not come through.
    pub weight: L,
}

/// Pupils from the middle of the film to its corner.
const PUPILS: usize = 64;

/// The exit pupils of lenses that are complete but for them ([`Lenses::pupils`]). Takes some tenths
/// of a second.
pub fn exit_pupils(lenses: &Lenses) -> Vec<Option<[f64; 4]>> {
    let mut optics = Optics::new(lenses);
    if optics.mask.take().is_some() {
        // Pupils are turned with the point of the film, a mask is not: all that it may let through
        // is within the circle around its square.
        let stops = optics.surfaces.iter_mut().filter(|s| s.ratio == 0.0);
        stops.for_each(|stop| stop.radius2 *= 2.0);
    }
    let simple = lenses.weighting == LensWeighting::Simple;
    let passes = |film, direction| optics.pass(film, direction).2;
    pupil::bounds(&passes, lenses, PUPILS, simple)
}

impl Optics {
    pub fn new(lenses: &Lenses) -> Self {
        let elements = &lenses.elements;
        let stop = elements.iter().find(|e| e.curvature_radius == 0.0);
        let rear = elements.last().map_or(0.0, |e| e.thickness);
        let area = |b: &[f64; 4]| (b[1] - b[0]) * (b[3] - b[2]);
        let factor = match lenses.weighting {
            LensWeighting::Irradiance(time) => f64::from(time) / (rear * rear),
            LensWeighting::Simple => {
                let middle = lenses.pupils.first().copied().flatten();
                1.0 / middle.as_ref().map_or(1.0, area)
            }
        };
        let pupil = |bounds: &Option<[f64; 4]>| match bounds {
            None => Pupil::default(),
            Some(b) => Pupil {
                low: [b[0] as f32, b[2] as f32],
                size: [(b[1] - b[0]) as f32, (b[3] - b[2]) as f32],
                gain: (area(b) * factor) as f32,
            },
        };
        Self {
            surfaces: surfaces(elements),
            mask: lenses.mask.clone(),
            inv_stop: stop.map_or(0.0, |e| (1.0 / e.aperture_radius) as f32),
            rear: rear as f32,
            front: elements.iter().map(|e| e.thickness).sum::<f64>() as f32,
            pupils_per_length: (lenses.pupils.len() as f64 / (lenses.diagonal / 2.0)) as f32,
            pupils: lenses.pupils.iter().map(pupil).collect(),
            unit: lenses.unit,
        }
    }

    /// The ray that a point of the film, in the camera's space, and two primary samples stand for.
    #[inline(always)]
    pub fn ray<L: Lanes>(&self, x: L, y: L, u: (L, L)) -> LensRay<L> {
        let r = x.mul_add(x, y * y).sqrt();
        let ring = (r * L::splat(self.pupils_per_length)).floor();
        let pupil = |of: &dyn Fn(&Pupil) -> f32| {
            let at = |i: usize| {
                self.pupils
                    .get(ring.lane(i) as usize)
                    .or(self.pupils.last())
            };
            L::from_fn(|i| at(i).map_or(0.0, of))
        };
        let px = u.0.mul_add(pupil(&|p| p.size[0]), pupil(&|p| p.low[0]));
        let py = u.1.mul_add(pupil(&|p| p.size[1]), pupil(&|p| p.low[1]));
        // Pupils are those of points on the x axis.
        let off = r.gt(L::zero());
        let sin = L::select(off, y / r, L::zero());
        let cos = L::select(off, x / r, L::one());
        let rear = Vec3::new(
            cos * px - sin * py,
            sin.mul_add(px, cos * py),
            L::splat(self.rear),
        );
        let film = Vec3::new(x, y, L::zero());
        let direction = (rear - film).normalize();
        let cos2 = direction.z * direction.z;
        let (origin, direction, passed) = self.pass(film, direction);
        let weight = cos2 * cos2 * pupil(&|p| p.gain) * passed;
        LensRay {
            origin: origin * L::splat(self.unit),
            direction,
            weight,
        }
    }

    /// Follows unit `d` from `o`, on the film or behind the lenses, to the front: where it leaves,
    /// its direction, and how much of it comes through.
    #[inline(always)]
    fn pass<L: Lanes>(&self, mut o: Vec3<L>, mut d: Vec3<L>) -> (Vec3<L>, Vec3<L>, L) {
        let mut passed = L::one();
        for surface in &self.surfaces {
            // From here on relative to the vertex.
            o.z -= L::splat(surface.gap);
            let to_plane = -o.z / d.z;
            let mut ok = d.z.gt(L::zero());
            if surface.ratio == 0.0 {
                ok = ok.and(to_plane.ge(L::zero()));
                o = d.mul_add(to_plane, o);
                o.z = L::zero();
                let share = match &self.mask {
                    Some(mask) => mask.at(o.x, o.y, self.inv_stop),
                    None => L::one().or_zero(is_within(o, surface.radius2)),
                };
                passed *= share.or_zero(ok);
            } else {
                // The sphere is c p^2 + 2 z = 0: from the plane of the vertex on, the root that
                // stays near it, without a difference of large numbers.
                let c = L::splat(surface.curvature);
                let x = d.x.mul_add(to_plane, o.x);
                let y = d.y.mul_add(to_plane, o.y);
                let b = c.mul_add(x.mul_add(d.x, y * d.y), d.z);
                let excess = c * x.mul_add(x, y * y);
                let square = b * b - c * excess;
                let root = square.max(L::zero()).sqrt();
                let beyond = -excess / (b + root);
                ok = ok
                    .and(square.ge(L::zero()))
                    .and((to_plane + beyond).ge(L::zero()));
                o = Vec3::new(d.x.mul_add(beyond, x), d.y.mul_add(beyond, y), d.z * beyond);
                ok = ok.and(is_within(o, surface.radius2));
                // Unit, to the film; its cosine with the ray is the root.
                let n = Vec3::new(c * o.x, c * o.y, c.mul_add(o.z, L::one()));
                let ratio = L::splat(surface.ratio);
                let sin2 = ratio * ratio * (L::one() - root * root);
                let cos = (L::one() - sin2).max(L::zero()).sqrt();
                ok = ok.and(sin2.lt(L::one()));
                d = (d * ratio + n * (cos - ratio * root)).normalize();
                passed = passed.or_zero(ok);
            }
        }
        o.z += L::splat(self.front);
        let sound = d.is_finite().and(o.is_finite());
        let straight = Vec3::splat([0.0, 0.0, 1.0]);
        (
            o.or_zero(sound),
            Vec3::select(sound, d, straight),
            passed.or_zero(sound),
        )
    }
}

/// From the film to the scene.
fn surfaces(elements: &[LensElement]) -> Vec<Surface> {
    let index = |eta: f64| if eta == 0.0 { 1.0 } else { eta };
    let surface = |i: usize| {
        let e = &elements[i];
        let before = i.checked_sub(1).map_or(1.0, |i| index(elements[i].eta));
        let [curvature, ratio] = match e.curvature_radius {
            0.0 => [0.0; 2],
            radius => [1.0 / radius, index(e.eta) / before],
        };
        Surface {
            gap: e.thickness as f32,
            curvature: curvature as f32,
            radius2: (e.aperture_radius * e.aperture_radius) as f32,
            ratio: ratio as f32,
        }
    };
    (0..elements.len()).rev().map(surface).collect()
}

#[inline(always)]
fn is_within<L: Lanes>(p: Vec3<L>, radius2: f32) -> L::Mask {
    p.x.mul_add(p.x, p.y * p.y).le(L::splat(radius2))
}

impl StopMask {
    /// What it lets through at a point of the stop, of whose radius `inv_stop` is the inverse.
    #[inline(always)]
    fn at<L: Lanes>(&self, x: L, y: L, inv_stop: f32) -> L {
        L::from_fn(|i| self.texel(x.lane(i) * inv_stop, y.lane(i) * inv_stop))
    }

    fn texel(&self, x: f32, y: f32) -> f32 {
        if !(x.abs() <= 2.0 && y.abs() <= 2.0) {
            return 0.0;
        }
        let place = |v: f32, n: u32| (v + 1.0) * 0.5 * n as f32 - 0.5;
        let (x, y) = (place(x, self.width), place(y, self.height));
        let (i, j) = (x.floor(), y.floor());
        let (fx, fy) = (x - i, y - j);
        let at = |i: f32, j: f32| {
            let inside = i >= 0.0 && j >= 0.0 && i < self.width as f32 && j < self.height as f32;
            let index = || j as usize * self.width as usize + i as usize;
            if inside { self.texels[index()] } else { 0.0 }
        };
        let row = |j: f32| at(i, j) * (1.0 - fx) + at(i + 1.0, j) * fx;
        row(j) * (1.0 - fy) + row(j + 1.0) * fy
    }
}
