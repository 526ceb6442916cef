//! Emissive triangles and spheres: Lambertian, of one radiance or of one that an image gives by
//! texture coordinates.

use super::records::BaseLanes;
use super::{DirectSample, EmissionSample, Emitted, Kind, LightTable, Lot};
use crate::geometry::{AreaSample, Geometry};
use crate::simd::{Frame, Lanes, Mask, Vec3, math};
use crate::trace::offset;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

impl LightTable {
    #[inline(always)]
    pub(super) fn direct_area<L: Lanes>(
        &self,
        geometry: &Geometry,
        lot: Lot<L>,
        p: Vec3<L>,
        u: [L; 2],
    ) -> DirectSample<L> {
        let base = lot.base;
        let point = self.area_point(geometry, lot, u);
        let v = point.p - p;
        let d2 = v.length2();
        let w = v * (L::one() / d2.sqrt());
        let cos = -w.dot(point.ng);
        let two_sided = base.sides_or_falloff.gt(L::zero());
        let lit = cos.gt(L::zero()).or(two_sided.and(cos.lt(L::zero())));
        let abs = cos.abs();
        let sides = L::select(two_sided, L::splat(2.0), L::one());
        let (radiance, shown) = self.shown(lot, point.uv);
        DirectSample {
            to_light: w,
            end: offset::leave(point.p, point.error, point.ng, -w),
            radiance,
            pdf: base.choice * point.pdf * d2 / abs,
            // (pA cos / (sides pi)) / (pA d2 / cos) / cos
            emission_ratio: abs * L::splat(FRAC_1_PI) / (sides * d2),
            delta: self.hidden(base),
            valid: lit.and(d2.gt(L::zero())).and(shown),
        }
    }

    #[inline(always)]
    pub(super) fn emission_area<L: Lanes>(
        &self,
        geometry: &Geometry,
        lot: Lot<L>,
        u: [L; 4],
    ) -> EmissionSample<L> {
        let base = lot.base;
        let point = self.area_point(geometry, lot, [u[0], u[1]]);
        let two_sided = base.sides_or_falloff.gt(L::zero());
        // Both sides: the first half of a sample is the front, the second the back.
        let half = u[2] * L::splat(2.0);
        let back = two_sided.and(half.ge(L::one()));
        let folded = L::select(back, half - L::one(), half);
        let local = math::cosine_hemisphere(L::select(two_sided, folded, u[2]), u[3]);
        let n = Vec3::select(back, -point.ng, point.ng);
        let direction = Frame::new(n).to_world(local);
        let solid = L::select(two_sided, L::splat(TAU), L::splat(PI));
        let scale = solid / point.pdf * (L::one() / base.choice);
        let (radiance, shown) = self.shown(lot, point.uv);
        EmissionSample {
            origin: offset::leave(point.p, point.error, n, n),
            direction,
            beta: radiance * scale,
            d_vcm: solid / local.z,
            // No path starts at the camera and meets what is hidden.
            d_vc: scale.or_zero(self.hidden(base).not()),
            distant: L::Mask::splat(false),
            valid: local.z.gt(L::zero()).and(shown),
        }
    }

    /// Lanes whose lights no ray meets.
    #[inline(always)]
    fn hidden<L: Lanes>(&self, base: &BaseLanes<L>) -> L::Mask {
        if !self.hides {
            return L::Mask::splat(false);
        }
        let sides = base.sides_or_falloff;
        L::zero().gt(sides).or(sides.gt(L::one()))
    }

    /// Some light has an image, so that [`Self::emitted`] looks at `surface`.
    #[inline(always)]
    pub fn has_pictures(&self) -> bool {
        !self.pictures.is_empty()
    }

    /// What a camera subpath sees of area lights it hit: `p` on the light, `cos` of the viewing
    /// direction against its front normal. `surface` are the barycentric coordinates that the
    /// tracer reported; only lights that have an image look at them.
    #[inline(always)]
    pub fn emitted<L: Lanes>(
        &self,
        geometry: &Geometry,
        light: &[u32],
        p: Vec3<L>,
        cos: L,
        surface: [L; 2],
    ) -> Emitted<L> {
        let base = BaseLanes::<L>::load(&self.base, light);
        let mut triangle = self.mask_of::<L>(Kind::Triangle, light);
        let mut sphere = self.mask_of::<L>(Kind::Sphere, light);
        let mut colour = base.colour;
        if self.has_pictures() {
            for kind in [Kind::ImageTriangle, Kind::ImageSphere] {
                let Some(lot) = self.lot(kind, light, &base) else {
                    continue;
                };
                let mask = lot.mask;
                let prim = Self::column_bits::<L>(base.primitive, mask, light.len());
                let uv = if kind == Kind::ImageTriangle {
                    triangle = triangle.or(mask);
                    geometry.triangle_uv(&prim[..light.len()], surface[0], surface[1])
                } else {
                    sphere = sphere.or(mask);
                    geometry.sphere_uv(&prim[..light.len()], p)
                };
                colour = Vec3::select(mask, self.shown(lot, uv).0, colour);
            }
        }
        let mut pdf = base.inv_area.or_zero(triangle);
        if sphere.any() {
            let prim = Self::column_bits::<L>(base.primitive, sphere, light.len());
            pdf = L::select(sphere, geometry.sphere_pdf(&prim[..light.len()], p), pdf);
        }
        let two_sided = base.sides_or_falloff.gt(L::zero());
        let lit = cos.gt(L::zero()).or(two_sided.and(cos.lt(L::zero())));
        let inv_solid = L::select(two_sided, L::splat(0.5 * FRAC_1_PI), L::splat(FRAC_1_PI));
        let direct = base.choice * pdf;
        Emitted {
            radiance: colour.or_zero(lit),
            direct_pdf: direct,
            emission_pdf: direct * cos.abs() * inv_solid,
        }
    }

    #[inline(always)]
    fn area_point<L: Lanes>(&self, geometry: &Geometry, lot: Lot<L>, u: [L; 2]) -> AreaSample<L> {
        let n = lot.light.len();
        let prim = Self::column_bits::<L>(lot.base.primitive, lot.mask, n);
        let textured = matches!(lot.kind, Kind::ImageTriangle | Kind::ImageSphere);
        match lot.kind {
            Kind::Triangle | Kind::ImageTriangle => {
                geometry.sample_triangles(&prim[..n], u[0], u[1], lot.base.inv_area, textured)
            }
            _ => geometry.sample_spheres(&prim[..n], u[0], u[1], textured),
        }
    }

    /// Radiance at texture coordinates, and where it is not zero. Lights without an image are lit
    /// all over.
    #[inline(always)]
    fn shown<L: Lanes>(&self, lot: Lot<L>, uv: [L; 2]) -> (Vec3<L>, L::Mask) {
        let base = lot.base;
        let colour = base.colour;
        if !matches!(lot.kind, Kind::ImageTriangle | Kind::ImageSphere) {
            return (colour, L::Mask::splat(true));
        }
        let n = lot.light.len();
        let index = Self::column_bits::<L>(base.image, lot.mask, n);
        let mut out = [[0.0f32; 3]; 8];
        for i in (0..n).filter(|i| lot.mask.bits() >> i & 1 != 0) {
            out[i] = self.pictures[index[i] as usize].at(uv[0].lane(i), uv[1].lane(i));
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        let shown = colour.mul_elem(Vec3::new(column(0), column(1), column(2)));
        let most = shown.x.max(shown.y).max(shown.z);
        (shown, most.gt(L::zero()))
    }
}
