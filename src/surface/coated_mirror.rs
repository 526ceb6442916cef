//! Smooth coats: what one reflects by itself, and one over a smooth conductor, of which the sum
//! over all bounces is exact.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, Mode};
use super::{fresnel, mirror};
use crate::simd::{Lanes, UintLanes, Vec3, math};

/// A smooth coat's own reflection. Row: eta (inside over outside).
pub struct Coat;

/// Smooth conductor under a smooth coat. Row: conductor eta (3), k (3), both relative to the coat,
/// coat eta, thickness with the number of bounces in its last eight bits
/// ([`pack_bounces`](super::coated_rows::pack_bounces)).
pub struct Mirror;

impl Bsdf for Coat {
    const NAME: &'static str = "coat";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        let reflectance = fresnel::dielectric(wo.z.abs(), row[0]).reflectance;
        mirror::reflect(wo, Vec3::splat([1.0; 3]) * reflectance)
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}

/// `1 + x + ... + x^(count - 1)` for counts below 256, without the difference of `1 - x`.
#[inline(always)]
fn power_sum<L: Lanes>(x: L, count: L::Uint) -> L {
    let (mut sum, mut power) = (L::zero(), L::one());
    let mut bits = count.shl::<24>();
    for _ in 0..8 {
        sum = sum.mul_add(power, sum);
        power = power * power;
        let odd = L::uint_eq(bits.shr::<31>(), L::Uint::splat(1));
        sum = L::select(odd, sum.mul_add(x, L::one()), sum);
        power = L::select(odd, power * x, power);
        bits = bits.shl::<1>();
    }
    sum
}

impl Bsdf for Mirror {
    const NAME: &'static str = "coated mirror";
    const DELTA: bool = true;
    const LOBES: bool = false;

    #[inline(always)]
    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, _: [L; 3], _: Mode) -> BsdfSample<L> {
        let boundary = fresnel::dielectric(wo.z.abs(), row[6]);
        let inside = boundary.cos_t.gt(L::zero());
        let cos = L::select(inside, boundary.cos_t, L::one());
        let metal = fresnel::conductor(
            cos,
            Vec3::new(row[0], row[1], row[2]),
            Vec3::new(row[3], row[4], row[5]),
        );
        let r = boundary.reflectance;
        let way = math::exp(row[7] * L::splat(-2.0) / cos);
        let through = ((L::one() - r) * (L::one() - r)).or_zero(inside);
        let count = row[7].to_bits().and(L::Uint::splat(0xff));
        let channel = |metal: L| {
            let once = metal * way;
            (through * once).mul_add(power_sum(r * once, count), r)
        };
        mirror::reflect(
            wo,
            Vec3::new(channel(metal.x), channel(metal.y), channel(metal.z)),
        )
    }

    #[inline(always)]
    fn eval<L: Lanes>(_: &[L; 8], _: Vec3<L>, _: Vec3<L>, _: Mode) -> BsdfValue<L> {
        BsdfValue::black()
    }
}
