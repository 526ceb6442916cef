//! Parameter rows of pbrt-v3's `disney` material: thirteen numbers and a colour in eight floats.

use crate::simd::{Lanes, UintLanes, Vec3};

/// What a row says, before it is packed. Shares are within [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Values {
    /// 0 or more.
    pub colour: [f32; 3],
    /// Index of refraction.
    pub eta: f32,
    /// A share.
    pub roughness: f32,
    /// How much is metal; a share.
    pub metallic: f32,
    /// How much is refracted instead of being diffuse; a share.
    pub transmission: f32,
    /// How much the colour tints the reflection of what is no metal; a share.
    pub specular_tint: f32,
    /// A share.
    pub anisotropic: f32,
    /// 0 or more.
    pub sheen: f32,
    /// A share.
    pub sheen_tint: f32,
    /// 0 or more.
    pub clearcoat: f32,
    /// A share.
    pub gloss: f32,
    /// Of thin sheets: how much of the diffuse light looks as if it came out elsewhere; a share.
    pub flatness: f32,
    /// Of thin sheets: how much diffuse light comes out at the other side; a share.
    pub through: f32,
}

/// The largest weight of a lobe.
pub const GREATEST_WEIGHT: f32 = 1e3;

/// Steps between 0 and 1 of numbers that are packed.
const STEPS: f32 = 32_000.0;
/// With this the upper bits never are those of a float that is 0, subnormal or none.
const BIAS: u32 = 256;

/// Two numbers of [0, 1] in the bits of one float, right to 1/64000.
fn pack(first: f32, second: f32) -> f32 {
    let steps = |x: f32| (x.clamp(0.0, 1.0) * STEPS).round() as u32;
    f32::from_bits((steps(first) + BIAS) << 16 | steps(second))
}

#[inline(always)]
fn unpack<L: Lanes>(packed: L) -> [L; 2] {
    let bits = packed.to_bits();
    let share = |steps: L::Uint| L::from_uint24(steps) / L::splat(STEPS);
    [
        share(bits.shr::<16>().sub(L::Uint::splat(BIAS))),
        share(bits.and(L::Uint::splat(0xffff))),
    ]
}

/// Weights of any size as shares: [`weight`] is the inverse.
fn share_of(weight: f32) -> f32 {
    let weight = weight.clamp(0.0, GREATEST_WEIGHT);
    weight / (1.0 + weight)
}

#[inline(always)]
fn weight<L: Lanes>(share: L) -> L {
    share / (L::one() - share)
}

impl Values {
    /// The row. Colours are packed by their roots, so that dark ones keep their digits.
    pub fn row(&self) -> [f32; 8] {
        let [r, g, b] = self.colour.map(|c| share_of(c.max(0.0).sqrt()));
        [
            self.eta,
            pack(r, g),
            pack(b, self.roughness),
            pack(self.metallic, self.transmission),
            pack(self.specular_tint, self.anisotropic),
            pack(share_of(self.sheen), self.sheen_tint),
            pack(share_of(self.clearcoat), self.gloss),
            pack(self.flatness, self.through),
        ]
    }
}

/// What a row says, lane by lane: as [`Values`], but for the clearcoat.
pub struct Parts<L> {
    /// 0 or more.
    pub colour: Vec3<L>,
    /// [`Values::eta`].
    pub eta: L,
    /// [`Values::roughness`].
    pub roughness: L,
    /// [`Values::metallic`].
    pub metallic: L,
    /// [`Values::transmission`].
    pub transmission: L,
    /// [`Values::specular_tint`].
    pub specular_tint: L,
    /// [`Values::anisotropic`].
    pub anisotropic: L,
    /// [`Values::sheen`].
    pub sheen: L,
    /// [`Values::sheen_tint`].
    pub sheen_tint: L,
    /// [`Values::clearcoat`].
    pub clearcoat: L,
    /// Roughness of the clearcoat.
    pub coat_alpha: L,
    /// [`Values::flatness`].
    pub flatness: L,
    /// [`Values::through`].
    pub through: L,
}

impl<L: Lanes> Parts<L> {
    /// Unpacked.
    #[inline(always)]
    pub fn of(row: &[L; 8]) -> Self {
        let square = |root: L| weight(root) * weight(root);
        let ([r, g], [b, roughness]) = (unpack(row[1]), unpack(row[2]));
        let [r, g, b] = [r, g, b].map(square);
        let [metallic, transmission] = unpack(row[3]);
        let [specular_tint, anisotropic] = unpack(row[4]);
        let [sheen, sheen_tint] = unpack(row[5]);
        let [clearcoat, gloss] = unpack(row[6]);
        let [flatness, through] = unpack(row[7]);
        Self {
            colour: Vec3::new(r, g, b),
            eta: row[0],
            roughness,
            metallic,
            transmission,
            specular_tint,
            anisotropic,
            sheen: weight(sheen),
            sheen_tint,
            clearcoat: weight(clearcoat),
            coat_alpha: L::splat(0.1) - L::splat(0.099) * gloss,
            flatness,
            through,
        }
    }

    /// Weight of the diffuse lobes.
    #[inline(always)]
    pub fn diffuse(&self) -> L {
        (L::one() - self.metallic) * (L::one() - self.transmission)
    }

    /// Reflectance at normal incidence of what is no metal.
    #[inline(always)]
    pub fn r0(&self) -> L {
        let root = (self.eta - L::one()) / (self.eta + L::one());
        root * root
    }

    /// White to the degree `1 - tint`, the rest of the hue of the colour.
    #[inline(always)]
    pub fn tinted(&self, tint: L) -> Vec3<L> {
        let c = self.colour;
        let [r, g, b] = [0.212_671, 0.715_16, 0.072_169].map(L::splat);
        let luminance = r * c.x + g * c.y + b * c.z;
        let some = luminance.gt(L::zero());
        let scale = L::one() / L::select(some, luminance, L::one());
        let white = Vec3::splat([1.0; 3]);
        let hue = Vec3::select(some, c * scale, white);
        white * (L::one() - tint) + hue * tint
    }
}
