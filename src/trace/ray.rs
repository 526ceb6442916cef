//! What a ray precomputes for the box, triangle and sphere tests.
//!
//! Rays are brought into a canonical form that depends on the ray alone, so that every traversal
//! method sees the same numbers:
//! - the direction is scaled by a power of two until its largest component is in `[1, 2)`; this is
//!   exact, and spares everything below overflow and underflow;
//! - an origin far outside the scene is moved along the ray to the bounds of the scene, so that
//!   rounding errors are relative to the size of the scene;
//! - components of the direction that are zero or next to nothing become tiny ones of the same
//!   sign, so that no slab test meets `0 * inf`.

use super::node::Bounds;
use super::records::{self, RayLanes};
use crate::simd::{Lanes, Mask, UintLanes, Vec3};

/// A component of the direction below this fraction of the largest is replaced by it. The angle it
/// stands for is far below the rounding of the direction.
const TINY: f32 = 1e-18;

/// The squared cosine of 25 degrees.
const NARROW: f32 = 0.82;

/// Largest absolute coordinates of a scene, and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Bounds of all primitives.
    pub bounds: Bounds,
    /// A power of two not below any absolute coordinate of the bounds.
    pub radius: f32,
    /// Boxes are grown by this much on every side. It must exceed the distance by which the
    /// triangle test can misplace an edge: projected vertices are off by at most some 5
    /// roundings of `|p - o|`, at most `6 * radius`, and the slabs' own rounding adds as much
    /// again.
    pub pad: f32,
    /// Boxes are grown by their own places and those of the rays' origins instead: the scene has
    /// things so small that they are lost in `pad`.
    pub vast: bool,
}

/// What boxes are grown by, in units of the largest coordinate.
pub const PAD: f32 = 1.0 / 262_144.0;
/// In vast scenes the box of a triangle is grown by [`PAD`] times the coordinates of the origin,
/// the largest part of `p0 - o` and the longest edge: at most by 3 times those of its corners and
/// twice those of the origin. The boxes of nodes are grown by more.
const PAD_OF_BOX: f32 = 4.0 * PAD;
pub const PAD_OF_ORIGIN: f32 = 3.0 * PAD;

impl Extent {
    pub fn new(bounds: Bounds, vast: bool) -> Self {
        let largest = largest(&bounds);
        // Rounded up to a power of two; at least the smallest for which the pad is still a normal
        // number.
        let radius = f32::from_bits((largest.to_bits() + 0x007f_ffff) & 0x7f80_0000).max(1e-20);
        Self {
            bounds,
            radius,
            pad: radius * PAD,
            vast,
        }
    }

    /// The box of a node or leaf as rays are to meet it.
    pub fn grown(&self, b: Bounds) -> Bounds {
        let pad = if self.vast {
            PAD_OF_BOX * largest(&b)
        } else {
            self.pad
        };
        b.map(|[min, max]| [min - pad, max + pad])
    }
}

/// The largest coordinate of a box.
pub fn largest(b: &Bounds) -> f32 {
    b.iter().flatten().fold(0.0, |m, x| m.max(x.abs()))
}

/// `N` rays, ready to be tested.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L: Lanes> {
    /// Origin and direction in the axes of the scene.
    pub o: Vec3<L>,
    pub d: Vec3<L>,
    /// Reciprocal direction, and origin times it, for slab tests: `t = b * rd - ord`.
    pub rd: [L; 3],
    pub ord: [L; 3],
    /// The same ray in its own order of axes.
    pub own: Sheared<L>,
    /// Lanes whose own third axis is x or y. The first axis and x, or the second and y, change
    /// places with z.
    pub swap_x: L::Mask,
    pub swap_y: L::Mask,
    /// End of the ray in the canonical form; hits must be nearer. Not positive for lanes that can
    /// hit nothing.
    pub t_max: L,
    /// `t` of the caller = `t * t_scale + t_shift`.
    pub t_scale: L,
    pub t_shift: L,
    /// Growth of boxes, see [`Extent::pad`].
    pub pad: L,
}

/// A ray whose axes are permuted so that the direction is longest along the third (Woop et al.
/// 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)).
#[derive(Clone, Copy, Debug)]
pub struct Sheared<L> {
    /// Origin.
    pub o: [L; 3],
    /// Direction, as long as that of the ray.
    pub d: [L; 3],
    /// Reciprocal direction.
    pub rd: [L; 3],
    /// Origin times reciprocal direction.
    pub ord: [L; 3],
    /// `-d[0] / d[2]` and `-d[1] / d[2]`.
    pub shear: [L; 2],
}

impl<L: Lanes> Ray<L> {
    /// Of records; lanes that are not in `list` can hit nothing.
    #[inline(always)]
    pub fn load(rays: &[records::Ray], list: &[u32], extent: &Extent) -> Self {
        let ray = RayLanes::<L>::load(rays, list);
        let live = L::Mask::from_bits((1u32 << list.len()) - 1);
        Self::new(ray.origin, ray.direction, ray.t_max, live, extent)
    }

    #[inline(always)]
    pub fn new(o: Vec3<L>, d: Vec3<L>, t_max: L, live: L::Mask, extent: &Extent) -> Self {
        let length = d.max_abs();
        let live = live
            .and(o.is_finite())
            .and(length.ge(L::splat(f32::MIN_POSITIVE)))
            .and(d.is_finite())
            .and(t_max.gt(L::zero()));
        // A harmless ray in dead lanes keeps NaN out of what follows.
        let o = o.or_zero(live);
        let one = L::one();
        let exponent = L::select(live, length, one)
            .to_bits()
            .and(L::Uint::splat(0x7f80_0000));
        // 2^e and 2^-e. The exponent of the largest floats has no normal inverse; it is capped.
        let cap = L::Uint::splat(253 << 23);
        let exponent = L::uint_select(L::uint_lt(cap, exponent), cap, exponent);
        let t_scale = L::from_bits(L::Uint::splat(254 << 23).sub(exponent));
        let d = d * t_scale;
        let d = Vec3::new(
            L::select(live, d.x, one),
            L::select(live, d.y, one),
            L::select(live, d.z, one),
        );
        let t_max = t_max * L::from_bits(exponent);

        let fill = |x: L| L::select(x.abs().lt(L::splat(TINY)), L::splat(TINY).copysign(x), x);
        let rd = [one / fill(d.x), one / fill(d.y), one / fill(d.z)];

        // Where the ray enters the bounds of the scene, for origins far outside.
        let far = o.max_abs().gt(L::splat(2.0 * extent.radius));
        let mut t_shift = L::zero();
        if far.any() {
            let o = [o.x, o.y, o.z];
            for k in 0..3 {
                let t0 = (L::splat(extent.bounds[k][0] - extent.pad) - o[k]) * rd[k];
                let t1 = (L::splat(extent.bounds[k][1] + extent.pad) - o[k]) * rd[k];
                t_shift = t_shift.max(t0.min(t1));
            }
            // A miss stays a miss wherever it starts.
            let back = t_shift * L::splat(1.0 - 16.0 * f32::EPSILON) - L::splat(extent.radius);
            t_shift = back.max(L::zero()).min(t_max).or_zero(far);
        }
        let o = Vec3::select(far, d.mul_add(t_shift, o), o);
        let t_max = t_max - t_shift;
        // Nothing is further than this: it bounds the path of the ray through the scene, and keeps
        // t finite.
        let t_max = t_max.min(L::splat(16.0 * extent.radius));
        let t_max = L::select(live.and(t_max.gt(L::zero())), t_max, L::splat(-1.0));

        let ord = [o.x * rd[0], o.y * rd[1], o.z * rd[2]];
        let (ax, ay, az) = (d.x.abs(), d.y.abs(), d.z.abs());
        let swap_x = ax.ge(ay).and(ax.gt(az));
        let swap_y = ay.gt(ax).and(ay.gt(az));
        let order = |v: [L; 3]| permute::<L>(v, swap_x, swap_y);
        let own_d = order([d.x, d.y, d.z]);
        let inverse = -one / own_d[2];
        let own = Sheared {
            o: order([o.x, o.y, o.z]),
            d: own_d,
            rd: order(rd),
            ord: order(ord),
            shear: [own_d[0] * inverse, own_d[1] * inverse],
        };
        Self {
            o,
            d,
            rd,
            ord,
            own,
            swap_x,
            swap_y,
            t_max,
            t_scale,
            t_shift,
            pad: L::splat(extent.pad),
        }
    }

    /// Lanes that can hit something.
    #[inline(always)]
    pub fn live(&self) -> L::Mask {
        self.t_max.gt(L::zero())
    }

    /// Whether all live lanes start near the first: within an eighth of the scene's radius in every
    /// axis.
    #[inline(always)]
    pub fn is_near(&self, extent: &Extent) -> bool {
        let live = self.live().bits();
        let first = live.trailing_zeros() as usize % L::N;
        let away = (self.o - Vec3::splat(self.o.lane(first))).max_abs();
        live & !away.le(L::splat(0.125 * extent.radius)).bits() == 0
    }

    /// Whether all live lanes go nearly the way of the first: within 25 degrees.
    #[inline(always)]
    pub fn is_narrow(&self) -> bool {
        let live = self.live().bits();
        let first = live.trailing_zeros() as usize % L::N;
        let axis = Vec3::splat(self.d.lane(first));
        let along = axis.dot(self.d);
        let bound = self.d.length2() * axis.length2() * L::splat(NARROW);
        let narrow = along.gt(L::zero()).and((along * along).ge(bound));
        live & !narrow.bits() == 0
    }

    /// If all live lanes agree in the signs of the direction and in their own third axis: what they
    /// agree on.
    #[inline(always)]
    pub fn agreement(&self) -> Option<Agreement> {
        let live = self.live().bits();
        let all = |mask: L::Mask| {
            let bits = mask.bits() & live;
            (bits == 0 || bits == live).then_some(bits != 0)
        };
        let negative = [
            all(self.rd[0].lt(L::zero()))?,
            all(self.rd[1].lt(L::zero()))?,
            all(self.rd[2].lt(L::zero()))?,
        ];
        let order = match (all(self.swap_x)?, all(self.swap_y)?) {
            (true, _) => [2, 1, 0],
            (_, true) => [0, 2, 1],
            _ => [0, 1, 2],
        };
        Some(Agreement {
            negative: negative.map(usize::from),
            order,
        })
    }

    /// One lane as a ray of its own.
    #[inline(always)]
    pub fn lane(&self, i: usize) -> Ray<f32> {
        let one = |v: [L; 3]| [v[0].lane(i), v[1].lane(i), v[2].lane(i)];
        let vector = |v: Vec3<L>| Vec3::new(v.x.lane(i), v.y.lane(i), v.z.lane(i));
        let is = |mask: L::Mask| mask.bits() >> i & 1 == 1;
        Ray {
            o: vector(self.o),
            d: vector(self.d),
            rd: one(self.rd),
            ord: one(self.ord),
            own: Sheared {
                o: one(self.own.o),
                d: one(self.own.d),
                rd: one(self.own.rd),
                ord: one(self.own.ord),
                shear: [self.own.shear[0].lane(i), self.own.shear[1].lane(i)],
            },
            swap_x: is(self.swap_x),
            swap_y: is(self.swap_y),
            t_max: self.t_max.lane(i),
            t_scale: self.t_scale.lane(i),
            t_shift: self.t_shift.lane(i),
            pad: self.pad.lane(i),
        }
    }

    /// [`PAD`] of the origin, for vast scenes.
    #[inline(always)]
    pub fn reach(&self) -> L {
        self.o.max_abs() * L::splat(PAD)
    }

    /// What the boxes of nodes are grown by for the origins, as distances along the rays; nothing
    /// but in vast scenes.
    #[inline(always)]
    pub fn growth<const VAST: bool>(&self) -> [L; 3] {
        if !VAST {
            return [L::zero(); 3];
        }
        let pad = self.reach() * L::splat(PAD_OF_ORIGIN / PAD);
        [
            pad * self.rd[0].abs(),
            pad * self.rd[1].abs(),
            pad * self.rd[2].abs(),
        ]
    }

    /// What the triangles' own boxes are grown by, beside what `hit` adds in vast scenes.
    #[inline(always)]
    pub fn own_pad<const VAST: bool>(&self) -> L {
        if VAST { self.reach() } else { self.pad }
    }

    /// The caller's `t`.
    #[inline(always)]
    pub fn external_t(&self, t: L) -> L {
        t.mul_add(self.t_scale, self.t_shift * self.t_scale)
    }
}

/// What the rays of a packet have in common.
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    /// 1 where the direction is negative: the near plane of a box is its maximum.
    pub negative: [usize; 3],
    /// Axes of the scene in the rays' own order.
    pub order: [usize; 3],
}

/// Components of `v` in each lane's own order of axes.
#[inline(always)]
pub fn permute<L: Lanes>(v: [L; 3], swap_x: L::Mask, swap_y: L::Mask) -> [L; 3] {
    let [x, y, z] = v;
    [
        L::select(swap_x, z, x),
        L::select(swap_y, z, y),
        L::select(swap_x, x, L::select(swap_y, y, z)),
    ]
}

/// Where rays, taken as lines, pass a box: from `near` (at least 0) to `far`; `near > far` if they
/// do not.
#[inline(always)]
pub fn slab<L: Lanes>(ray: &Sheared<L>, low: [L; 3], high: [L; 3]) -> (L, L) {
    let (mut near, mut far) = (L::zero(), L::splat(f32::MAX));
    for k in 0..3 {
        let t0 = low[k].mul_add(ray.rd[k], -ray.ord[k]);
        let t1 = high[k].mul_add(ray.rd[k], -ray.ord[k]);
        near = near.max(t0.min(t1));
        far = far.min(t0.max(t1));
    }
    (near, far)
}
