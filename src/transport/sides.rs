//! Which side of a surface directions are on, where its shading normal is not its true one.
//!
//! The two normals can disagree about whether a pair of directions is a reflection or a
//! transmission ([`Sides`]):
//!
//! * pbrt-v4 asks the shading normal alone. Light may so pass through a surface that only reflects.
//! * pbrt-v3 asks the true normal, and then its scattering functions, which know of the shading
//!   normal alone, for their value of that kind ([`Bsdf::across`]). There is light in all
//!   directions of the true side, and none from the other.
//!
//! Neither asks about delta lobes. The cosine is against the shading normal in both, whatever its
//! sign.
//!
//! What pbrt-v3's functions are worth where the normals disagree must be sampled, too, or only some
//! strategies would find it. A direction that is sampled there is exchanged for its *twin*: its
//! mirror image in the shading surface if that lies on the other true side, its opposite if not.
//! Where the normals disagree about a direction they disagree about its twin; on which true side it
//! is changes, and so it is of the lobe that was sampled. Twins of twins are the directions
//! themselves, and solid angles stay what they are, so that the density of a direction is that of
//! its twin.

use crate::geometry::shading_frame;
use crate::scene::Sides;
use crate::simd::{Frame, Lanes, Mask, Vec3};
use crate::surface::{Bsdf, BsdfSample, BsdfValue, Mode, Tabulated};

/// The normals at a vertex, and its tangent.
pub struct Normals<L: Lanes> {
    /// Geometric, unit, towards the front.
    pub ng: Vec3<L>,
    /// For shading, unit.
    pub ns: Vec3<L>,
    /// First axis of the shading frame, of any length; 0 where it does not matter.
    pub tangent: Vec3<L>,
}

impl<L: Lanes> Normals<L> {
    #[inline(always)]
    fn differ(&self) -> L::Mask {
        let (a, b) = (self.ng, self.ns);
        a.x.eq(b.x).and(a.y.eq(b.y)).and(a.z.eq(b.z)).not()
    }
}

/// Two directions, in the world and in the shading frame.
struct Pair<L: Lanes> {
    world: [Vec3<L>; 2],
    local: [Vec3<L>; 2],
}

impl<L: Lanes> Pair<L> {
    /// One normal says reflection, the other transmission.
    #[inline(always)]
    fn is_disputed(&self, ng: Vec3<L>) -> L::Mask {
        let shading = (self.local[0].z * self.local[1].z).gt(L::zero());
        let truly = (self.world[0].dot(ng) * self.world[1].dot(ng)).gt(L::zero());
        shading.and_not(truly).or(truly.and_not(shading))
    }
}

/// Veach's correction for shading normals on light subpaths: the cosine factor at a vertex is
/// `|wi . ng| |wo . ns| / |wo . ng|` instead of `|wi . ns|` (Veach 1997, section 5.3; `wo` towards
/// the light). 0 where undefined.
#[inline(always)]
pub fn adjoint_cosine<L: Lanes>(wi_ng: L, wo_ns: L, wo_ng: L) -> L {
    let den = wo_ng.abs();
    (wi_ng.abs() * wo_ns.abs() / den).or_zero(den.gt(L::zero()))
}

/// True where `wo` and `wi` lie on sides of the true surface that agree with the sides of the
/// shading surface: otherwise light would leak through, or a closed surface be seen from behind.
#[inline(always)]
pub fn sides_agree<L: Lanes>(wo: Vec3<L>, wi: Vec3<L>, ng: Vec3<L>, ns: Vec3<L>) -> L::Mask {
    let agree = |w: Vec3<L>| (w.dot(ng) * w.dot(ns)).gt(L::zero());
    agree(wo).and(agree(wi))
}

/// The value of a BSDF for two directions of the world; `f` is 0 where nothing goes from one to the
/// other.
#[inline(always)]
pub fn eval<B: Bsdf, L: Lanes>(
    sides: Option<Sides>,
    tables: &Tabulated,
    row: &[L; 8],
    normals: &Normals<L>,
    [wo, wi]: [Vec3<L>; 2],
    mode: Mode,
) -> BsdfValue<L> {
    if B::MEDIUM {
        return B::eval(row, wo, wi, mode);
    }
    let frame = shading_frame(normals.ns, normals.tangent);
    let local = [frame.to_local(wo), frame.to_local(wi)];
    let mut value = B::eval_in(tables, row, local[0], local[1], mode);
    let agree = sides_agree(wo, wi, normals.ng, normals.ns);
    let valid = match sides {
        _ if B::WHOLE => L::Mask::splat(true),
        None => agree,
        Some(Sides::Shading) => agree.or(normals.differ()),
        Some(Sides::Geometric) => {
            let world = [wo, wi];
            let disputed = Pair { world, local }.is_disputed(normals.ng);
            if B::ACROSS && disputed.any() {
                let other = across::<B, L>(row, frame.to_local(normals.ng), local, mode);
                value = choose(disputed, other, value);
                L::Mask::splat(true)
            } else {
                disputed.not()
            }
        }
    };
    value.f = value.f.or_zero(valid);
    value
}

/// A sampled direction, in the world, and whether there is one.
pub struct Sampled<L: Lanes> {
    /// Unit.
    pub wi: Vec3<L>,
    /// What the BSDF says of it; its own direction is in the shading frame.
    pub sample: BsdfSample<L>,
    /// Without it the path ends.
    pub valid: L::Mask,
}

/// Samples a direction of the world.
#[inline(always)]
pub fn sample<B: Bsdf, L: Lanes>(
    sides: Option<Sides>,
    tables: &Tabulated,
    row: &[L; 8],
    normals: &Normals<L>,
    wo: Vec3<L>,
    u: [L; 3],
    mode: Mode,
) -> Sampled<L> {
    if B::MEDIUM {
        let sample = B::sample(row, wo, u, mode);
        return Sampled {
            wi: sample.wi,
            sample,
            valid: L::Mask::splat(true),
        };
    }
    let frame = shading_frame(normals.ns, normals.tangent);
    let from = frame.to_local(wo);
    let mut sample = B::sample_in(tables, row, from, u, mode);
    let mut wi = frame.to_world(sample.wi).normalize();
    let agree = sides_agree(wo, wi, normals.ng, normals.ns);
    let seen = from.z.eq(L::zero()).not();
    let valid = match sides {
        _ if B::WHOLE => seen,
        None => agree,
        Some(Sides::Geometric) if !B::DELTA => {
            let pair = Pair {
                world: [wo, wi],
                local: [from, sample.wi],
            };
            let disputed = pair.is_disputed(normals.ng);
            if B::ACROSS && disputed.any() {
                let other = exchanged::<B, L>(row, &frame, normals.ng, from, &sample, mode);
                wi = Vec3::select(disputed, frame.to_world(other.wi).normalize(), wi);
                sample = BsdfSample {
                    wi: Vec3::select(disputed, other.wi, sample.wi),
                    throughput: Vec3::select(disputed, other.throughput, sample.throughput),
                    pdf: L::select(disputed, other.pdf, sample.pdf),
                    pdf_reverse: L::select(disputed, other.pdf_reverse, sample.pdf_reverse),
                };
                seen
            } else {
                seen.and_not(disputed)
            }
        }
        Some(_) => agree.or(normals.differ()).and(seen),
    };
    Sampled { wi, sample, valid }
}

#[inline(always)]
fn choose<L: Lanes>(mask: L::Mask, a: BsdfValue<L>, b: BsdfValue<L>) -> BsdfValue<L> {
    BsdfValue {
        f: Vec3::select(mask, a.f, b.f),
        pdf: L::select(mask, a.pdf, b.pdf),
        pdf_reverse: L::select(mask, a.pdf_reverse, b.pdf_reverse),
    }
}

/// The twin of a direction; `ng` is the true normal, in the shading frame like the direction.
#[inline(always)]
fn twin<L: Lanes>(w: Vec3<L>, ng: Vec3<L>) -> Vec3<L> {
    let mirrored = Vec3::new(w.x, w.y, -w.z);
    let crosses = (mirrored.dot(ng) * w.dot(ng)).lt(L::zero());
    Vec3::select(crosses, mirrored, -w)
}

/// Value and densities for directions about which the normals disagree. Few are: this stays out of
/// the way.
#[cold]
#[inline(never)]
fn across<B: Bsdf, L: Lanes>(
    row: &[L; 8],
    ng: Vec3<L>,
    [wo, wi]: [Vec3<L>; 2],
    mode: Mode,
) -> BsdfValue<L> {
    let seen = wo.z.eq(L::zero()).or(wi.z.eq(L::zero())).not();
    BsdfValue {
        f: B::across(row, wo, wi).or_zero(seen),
        pdf: B::eval(row, wo, twin(wi, ng), mode).pdf,
        pdf_reverse: B::eval(row, twin(wo, ng), wi, mode).pdf_reverse,
    }
}

/// The twin of a sample about which the normals disagree. A failed sample stays one.
#[cold]
#[inline(never)]
fn exchanged<B: Bsdf, L: Lanes>(
    row: &[L; 8],
    frame: &Frame<L>,
    ng: Vec3<L>,
    wo: Vec3<L>,
    sample: &BsdfSample<L>,
    mode: Mode,
) -> BsdfSample<L> {
    let ng = frame.to_local(ng);
    let wi = twin(sample.wi, ng);
    let value = across::<B, L>(row, ng, [wo, wi], mode);
    let w = sample.throughput;
    let sampled = w.x.max(w.y).max(w.z).gt(L::zero());
    let valid = value.pdf.gt(L::zero()).and(sampled);
    BsdfSample {
        wi,
        throughput: (value.f * (wi.z.abs() / value.pdf)).or_zero(valid),
        pdf: value.pdf,
        pdf_reverse: value.pdf_reverse,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::f32x8;
    use crate::surface::conductor::Rough as Metal;
    use crate::surface::diffuse::{Diffuse, OrenNayar};
    use crate::surface::diffuse_transmission::DiffuseTransmission;
    use crate::surface::microfacet::pack_alphas;
    use crate::surface::plastic::Plastic;
    use crate::surface::rough_dielectric::Rough as Glass;
    use crate::surface::substrate::Substrate;

    fn unit(x: f32, y: f32, z: f32) -> Vec3<f32> {
        Vec3::new(x, y, z).normalize()
    }

    /// Perturbed a little, far, across and away.
    fn normals() -> [Normals<f32>; 4] {
        let ng = unit(0.1, -0.2, 1.0);
        [
            (0.3, 0.2, 1.0),
            (1.0, 0.3, 0.4),
            (1.0, 0.1, 0.0),
            (0.4, 0.2, -1.0),
        ]
        .map(|(x, y, z)| Normals {
            ng,
            ns: unit(x, y, z),
            tangent: Vec3::zero(),
        })
    }

    fn evenly(i: u32) -> [f32; 3] {
        crate::surface::coat::evenly(i as usize)
    }

    /// Samples have the density and the value that evaluation gives, and the mean of the density
    /// over all directions is that of the samples there are: nothing is sampled twice or left
    /// out.
    fn check<B: Bsdf>(row: &[f32; 8], whole: bool, name: &str) {
        let n = 40_000;
        for (k, normals) in normals().iter().enumerate() {
            for wo in [
                unit(0.1, 0.5, 1.0),
                unit(-1.0, 0.2, 0.15),
                unit(0.5, -0.6, -0.4),
            ] {
                let what = format!("{name}, normal {k}, {wo:?}");
                let sides = Some(Sides::Geometric);
                let mode = Mode::Radiance;
                let (mut there, mut energy, mut disputed) = (0.0f64, [0.0f64; 2], 0);
                for i in 0..n {
                    let u = evenly(i);
                    let s =
                        sample::<B, f32>(sides, &Tabulated::default(), row, normals, wo, u, mode);
                    if s.valid && s.sample.throughput.y > 0.0 {
                        let v = eval::<B, f32>(
                            sides,
                            &Tabulated::default(),
                            row,
                            normals,
                            [wo, s.wi],
                            mode,
                        );
                        let cos = s.wi.dot(normals.ns).abs();
                        energy[0] += f64::from(s.sample.throughput.y) / f64::from(n);
                        let world = [wo, s.wi];
                        let frame = shading_frame(normals.ns, normals.tangent);
                        let local = world.map(|w| frame.to_local(w));
                        disputed += u32::from(Pair { world, local }.is_disputed(normals.ng));
                        if cos < 1e-3 || wo.dot(normals.ns).abs() < 1e-3 {
                            continue;
                        }
                        let near = |a: f32, b: f32| (a - b).abs() <= 0.02 * a.abs().max(b.abs());
                        assert!(
                            near(s.sample.pdf, v.pdf),
                            "{what}: {} {}",
                            s.sample.pdf,
                            v.pdf
                        );
                        assert!(near(s.sample.pdf_reverse, v.pdf_reverse), "{what}");
                        let (f, w) = (v.f.y * cos / v.pdf, s.sample.throughput.y);
                        assert!(near(f, w), "{what}: {f} {w}");
                    }
                    // Uniform over the sphere.
                    let z = 1.0 - 2.0 * u[0];
                    let wi = crate::surface::coat::direction(z, u[1]);
                    let v =
                        eval::<B, f32>(sides, &Tabulated::default(), row, normals, [wo, wi], mode);
                    let wide = std::f64::consts::TAU * 2.0 / f64::from(n);
                    there += f64::from(v.pdf) * wide;
                    energy[1] += f64::from(v.f.y * wi.dot(normals.ns).abs()) * wide;
                    let back =
                        eval::<B, f32>(sides, &Tabulated::default(), row, normals, [wi, wo], mode);
                    let reverse = (v.pdf_reverse - back.pdf).abs();
                    assert!(
                        reverse <= 1e-3 * (1.0 + back.pdf.abs()),
                        "{what}: {reverse}"
                    );
                    let lane = |v: Vec3<f32>| Vec3::<f32x8>::splat(v.lane(0));
                    if i < 200 {
                        let eight = Normals {
                            ng: lane(normals.ng),
                            ns: lane(normals.ns),
                            tangent: Vec3::zero(),
                        };
                        let row8 = row.map(f32x8::splat);
                        let w = eval::<B, f32x8>(
                            sides,
                            &Tabulated::default(),
                            &row8,
                            &eight,
                            [lane(wo), lane(wi)],
                            mode,
                        );
                        assert_eq!(w.f.lane(3), v.f.lane(0), "{what}");
                    }
                }
                assert!(!whole || (there - 1.0).abs() < 0.03, "{what}: {there}");
                let [sampled, all] = energy;
                assert!(
                    (sampled - all).abs() < 0.03 * all + 0.003,
                    "{what}: {sampled} {all}"
                );
                assert!(k == 0 || disputed > 0 || wo.z < 0.0 || !whole, "{what}");
            }
        }
    }

    #[test]
    fn samples_where_normals_disagree_are_those_of_their_densities() {
        check::<Diffuse>(&[0.7; 8], true, "diffuse");
        check::<OrenNayar>(&[0.7, 0.7, 0.7, 0.8, 0.3, 0.0, 0.0, 0.0], true, "rough");
        let both = [0.3, 0.3, 0.3, 0.5, 0.5, 0.5, 0.5, 0.5];
        check::<DiffuseTransmission>(&both, true, "leaf");
        check::<Plastic>(&both, false, "plastic");
        check::<Substrate>(&both, false, "substrate");
        check::<Metal>(&[0.2, 0.9, 1.4, 3.9, 2.4, 2.1, 0.6, 0.6], false, "metal");
        let glass = [1.0, 1.0, 1.0, 0.8, 0.8, 0.8, 1.5, pack_alphas(0.6, 0.6)];
        check::<Glass>(&glass, false, "glass");
    }

    /// A Lambertian surface reflects its albedo of a white world, from whatever side and whatever
    /// its normals.
    #[test]
    fn white_worlds_make_no_difference_to_normals() {
        for normals in normals() {
            for wo in [
                unit(0.1, 0.5, 1.0),
                unit(-1.0, 0.2, 0.15),
                unit(0.5, -0.6, -0.4),
            ] {
                let mut sum = 0.0;
                for i in 0..2000 {
                    let row = [0.7; 8];
                    let sides = Some(Sides::Geometric);
                    let s = sample::<Diffuse, f32>(
                        sides,
                        &Tabulated::default(),
                        &row,
                        &normals,
                        wo,
                        evenly(i),
                        Mode::Radiance,
                    );
                    assert!(s.valid);
                    let side = s.wi.dot(normals.ng) * wo.dot(normals.ng);
                    assert!(side >= 0.0, "through the surface");
                    sum += s.sample.throughput.y / 2000.0;
                }
                assert!((sum - 0.7).abs() < 1e-3, "{sum}");
            }
        }
    }
}
