//! Lights: choice, emission, direct sampling, and the densities of both.
//!
//! Every light answers four questions, eight lanes at a time: a point of it as seen from a surface
//! ([`LightTable::sample_direct`], `s = 1`), a ray leaving it ([`LightTable::sample_emission`], `s
//! >= 2`), and, for `s = 0`, what a camera subpath that hit it ([`LightTable::emitted`]) or escaped
//! to it ([`LightTable::escaped`]) sees and with which densities it could have been sampled.
//!
//! Densities follow Georgiev 2012 ("Implementing Vertex Connection and Merging"): for a light at a
//! finite distance the *direct* density is over area and the *emission* density over area times
//! solid angle; for one at infinity the direct density is over solid angle and the emission density
//! over solid angle times area of a disk that covers the scene. This module is the only place that
//! knows: a file for area lights, one for lights at a point, one for those at infinity.
//!
//! # Adding a light
//!
//! More than a file and a line: the goniometric light stands in fourteen files. It is data in
//! [`LightKind`](crate::scene::LightKind), and read, tolerated and weighed against others where
//! scene files are read (five files). Here it has a [`Kind`], its power and records in `build.rs`,
//! and an arm in the first two questions, in this file, which leads to the file of its group: a
//! light at a point, of a surface or at infinity. The third is answered in `area.rs`, the fourth in
//! `distant.rs`: only lights that a camera subpath can meet have an arm there. Only a light of a
//! new group needs a file of its own. Outside, memory is counted by kind in `integrate/needs.rs`,
//! `inspect` tells kinds, and `replay` has its own formulas (three files). The reason is that
//! densities of different lights are summed in one weight, lane by lane, so that lights are not
//! queued by kind as surfaces are.

mod area;
mod build;
mod choice;
mod distant;
pub(crate) mod distribution;
mod environment;
mod picture;
mod point;
mod projector;
mod records;

pub use self::choice::LightChoice;
use self::environment::Environment;
use self::picture::Picture;
use self::projector::Projector;
use self::records::{Base, BaseLanes, Place};
use crate::geometry::Geometry;
use crate::scene::NONE;
use crate::simd::{Lanes, Mask, UintLanes, Vec3};

/// The kinds of light kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Kind {
    /// One triangle of an area light.
    Triangle,
    /// An analytic sphere.
    Sphere,
    /// A triangle or sphere whose radiance an image gives.
    ImageTriangle,
    /// A sphere whose radiance an image gives.
    ImageSphere,
    /// The same intensity in all directions.
    Point,
    /// A point whose intensity falls off between two cones.
    Spot,
    /// A point whose intensity an image over all directions gives.
    Goniometric,
    /// A point that projects an image.
    Projection,
    /// At infinity, in a single direction.
    Distant,
    /// At infinity, the same radiance from everywhere.
    InfiniteConstant,
    /// At infinity, radiance from an image.
    InfiniteImage,
}

impl Kind {
    /// Every kind, in the order of its number.
    pub const ALL: [Kind; 11] = [
        Kind::Triangle,
        Kind::Sphere,
        Kind::ImageTriangle,
        Kind::ImageSphere,
        Kind::Point,
        Kind::Spot,
        Kind::Goniometric,
        Kind::Projection,
        Kind::Distant,
        Kind::InfiniteConstant,
        Kind::InfiniteImage,
    ];
    /// As `inspect` tells it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Triangle => "area light of triangles",
            Kind::Sphere => "sphere light",
            Kind::ImageTriangle => "area light of triangles with an image",
            Kind::ImageSphere => "sphere light with an image",
            Kind::Point => "point light",
            Kind::Spot => "spotlight",
            Kind::Goniometric => "goniometric light",
            Kind::Projection => "projection light",
            Kind::Distant => "distant light",
            Kind::InfiniteConstant => "constant environment",
            Kind::InfiniteImage => "environment image",
        }
    }
    /// Shines from a single point.
    pub fn is_point(self) -> bool {
        matches!(self, Kind::Point | Kind::Spot) || self.is_mapped()
    }
    /// A point whose intensity an image gives.
    fn is_mapped(self) -> bool {
        matches!(self, Kind::Goniometric | Kind::Projection)
    }
    /// Shines from the surface of a primitive.
    pub fn is_area(self) -> bool {
        matches!(
            self,
            Kind::Triangle | Kind::Sphere | Kind::ImageTriangle | Kind::ImageSphere
        )
    }
    /// No ray can meet it by chance: it is a point or a single direction.
    pub fn is_delta(self) -> bool {
        self.is_point() || self == Kind::Distant
    }
    /// Surrounds the scene: rays that escape see it.
    pub fn is_environment(self) -> bool {
        matches!(self, Kind::InfiniteConstant | Kind::InfiniteImage)
    }
}

/// All lights of a scene. There may be none: samples of such a table are not valid, whatever light
/// they are asked of.
pub struct LightTable {
    kinds: Vec<Kind>,
    base: Vec<Base>,
    place: Vec<Place>,
    environments: Vec<Environment>,
    projectors: Vec<Projector>,
    pictures: Vec<Picture>,
    /// Lights that escaping rays see.
    pub infinite: Vec<u32>,
    choice: LightChoice,
    present: Vec<Kind>,
    /// Some area lights are met by no ray.
    hides: bool,
    /// Radius of the ball that distant lights shine on.
    radius: f32,
}

/// The lanes whose lights are of one kind.
#[derive(Clone, Copy)]
struct Lot<'a, L: Lanes> {
    kind: Kind,
    /// The light of every lane.
    light: &'a [u32],
    /// Their rows of [`LightTable::base`].
    base: &'a BaseLanes<L>,
    /// Lanes of this kind; what the others get does not matter.
    mask: L::Mask,
}

/// A light seen from a surface point.
pub struct DirectSample<L: Lanes> {
    /// Unit, from the surface to the light.
    pub to_light: Vec3<L>,
    /// The end of the visibility ray (origin for distant lights: any far point).
    pub end: Vec3<L>,
    /// Radiance towards the surface, or intensity for point lights.
    pub radiance: Vec3<L>,
    /// Density over solid angle at the surface, choice included; point lights: squared distance
    /// times choice.
    pub pdf: L,
    /// What multiplies a camera subpath's `cos * (dVCM + dVC * pdf_reverse)`: emission over direct
    /// density and over the cosine at the light (Georgiev 2012, equation 45).
    pub emission_ratio: L,
    /// Sampling by chance is impossible (delta light).
    pub delta: L::Mask,
    /// Whether the light shines there at all; without it the other fields mean nothing.
    pub valid: L::Mask,
}

/// A ray leaving a light.
pub struct EmissionSample<L: Lanes> {
    /// Already off the surface by its error bound.
    pub origin: Vec3<L>,
    /// Unit.
    pub direction: Vec3<L>,
    /// Emitted radiance times cosine over all densities; zero if the sample is not valid.
    pub beta: Vec3<L>,
    /// First MIS quantities (Georgiev 2012, equations 31 and 32).
    pub d_vcm: L,
    /// 0 for a light that camera subpaths cannot meet.
    pub d_vc: L,
    /// Distances do not enter the density of the first vertex.
    pub distant: L::Mask,
    /// Whether there is such a ray; `beta` is zero without it.
    pub valid: L::Mask,
}

/// A light hit or seen by a camera subpath.
pub struct Emitted<L: Lanes> {
    /// Towards the viewer.
    pub radiance: Vec3<L>,
    /// Density of direct sampling, choice included: over area, or over solid angle for
    /// environments.
    pub direct_pdf: L,
    /// Density of emission, choice included.
    pub emission_pdf: L,
}

impl LightTable {
    /// Has the kernels of all kinds looked for in every packet, as if lights of all kinds were
    /// there; a table without lights stays as it is.
    pub fn try_every_kind(&mut self) {
        if !self.is_empty() {
            self.present = Kind::ALL.into();
        }
    }

    /// Has lights at infinity shine on a ball of at least this radius.
    pub fn cover(&mut self, radius: f32) {
        self.radius = self.radius.max(radius);
    }

    /// Every triangle and sphere of an area light is one.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }
    /// Whether the scene has no lights.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
    /// Choosing a light takes a primary sample.
    pub fn needs_choice(&self) -> bool {
        self.kinds.len() > 1
    }
    /// Kind of light number `light`.
    pub fn kind(&self, light: u32) -> Kind {
        self.kinds[light as usize]
    }

    /// The lights that primary samples choose; entries past `n` are 0.
    #[inline(always)]
    pub fn choose<L: Lanes>(&self, u: L, n: usize) -> [u32; 8] {
        if !self.needs_choice() {
            return [0; 8];
        }
        let mut chosen = [0; 8];
        for (i, light) in chosen.iter_mut().enumerate().take(n) {
            *light = self.choice.sample(u.lane(i));
        }
        chosen
    }

    /// Rays can meet it by chance.
    pub fn is_met(&self, light: u32) -> bool {
        let sides = self.base[light as usize].sides_or_falloff;
        !(self.kind(light).is_delta() || self.kind(light).is_area() && is_hidden(sides))
    }

    /// The primitive that a light is, or [`NONE`].
    pub fn primitive(&self, geometry: &Geometry, light: u32) -> u32 {
        let index = self.base[light as usize].primitive;
        match self.kinds.get(light as usize) {
            Some(Kind::Triangle | Kind::ImageTriangle) => index,
            Some(Kind::Sphere | Kind::ImageSphere) => geometry.triangles() + index,
            _ => NONE,
        }
    }

    /// The lanes whose lights are of `kind`; `None` if there are none.
    #[inline(always)]
    fn lot<'a, L: Lanes>(
        &self,
        kind: Kind,
        light: &'a [u32],
        base: &'a BaseLanes<L>,
    ) -> Option<Lot<'a, L>> {
        let mask = self.mask_of::<L>(kind, light);
        mask.any().then_some(Lot {
            kind,
            light,
            base,
            mask,
        })
    }

    #[inline(always)]
    fn mask_of<L: Lanes>(&self, kind: Kind, light: &[u32]) -> L::Mask {
        if let [only] = self.present[..] {
            return L::Mask::splat(only == kind);
        }
        let mut bits = 0;
        for (i, l) in light.iter().enumerate() {
            bits |= u32::from(self.kinds.get(*l as usize) == Some(&kind)) << i;
        }
        L::Mask::from_bits(bits)
    }

    /// Primitive or environment index per lane; 0 in lanes of other kinds, which would be out of
    /// range.
    #[inline(always)]
    fn column_bits<L: Lanes>(column: L::Uint, mask: L::Mask, n: usize) -> [u32; 8] {
        let column = L::uint_select(mask, column, L::Uint::splat(0));
        let mut bits = [0; 8];
        for (i, slot) in bits.iter_mut().enumerate().take(n) {
            *slot = column.lane(i);
        }
        bits
    }

    /// Samples a point of each lane's light as seen from `p`.
    #[inline(always)]
    pub fn sample_direct<L: Lanes>(
        &self,
        geometry: &Geometry,
        light: &[u32],
        p: Vec3<L>,
        u: [L; 2],
    ) -> DirectSample<L> {
        let mut sample = DirectSample {
            to_light: Vec3::zero(),
            end: Vec3::zero(),
            radiance: Vec3::zero(),
            pdf: L::one(),
            emission_ratio: L::zero(),
            delta: L::Mask::splat(false),
            valid: L::Mask::splat(false),
        };
        let base = BaseLanes::<L>::load(&self.base, light);
        for &kind in &self.present {
            let Some(lot) = self.lot(kind, light, &base) else {
                continue;
            };
            let mask = lot.mask;
            let one = self.direct_of(geometry, lot, p, u);
            sample = DirectSample {
                to_light: Vec3::select(mask, one.to_light, sample.to_light),
                end: Vec3::select(mask, one.end, sample.end),
                radiance: Vec3::select(mask, one.radiance, sample.radiance),
                pdf: L::select(mask, one.pdf, sample.pdf),
                emission_ratio: L::select(mask, one.emission_ratio, sample.emission_ratio),
                delta: sample.delta.or(mask.and(one.delta)),
                valid: sample.valid.or(mask.and(one.valid)),
            };
        }
        sample
    }

    #[inline(always)]
    fn direct_of<L: Lanes>(
        &self,
        geometry: &Geometry,
        lot: Lot<L>,
        p: Vec3<L>,
        u: [L; 2],
    ) -> DirectSample<L> {
        match lot.kind {
            Kind::Triangle | Kind::Sphere | Kind::ImageTriangle | Kind::ImageSphere => {
                self.direct_area(geometry, lot, p, u)
            }
            Kind::Point | Kind::Spot | Kind::Goniometric | Kind::Projection => {
                self.direct_point(lot, p)
            }
            Kind::Distant => self.direct_distant(lot, p),
            Kind::InfiniteConstant | Kind::InfiniteImage => self.direct_environment(lot, p, u),
        }
    }

    /// Samples a ray leaving each lane's light: `u[0..2]` place it, `u[2..4]` direct it.
    #[inline(always)]
    pub fn sample_emission<L: Lanes>(
        &self,
        geometry: &Geometry,
        light: &[u32],
        u: [L; 4],
    ) -> EmissionSample<L> {
        let mut sample = EmissionSample {
            origin: Vec3::zero(),
            direction: Vec3::splat([0.0, 0.0, 1.0]),
            beta: Vec3::zero(),
            d_vcm: L::zero(),
            d_vc: L::zero(),
            distant: L::Mask::splat(false),
            valid: L::Mask::splat(false),
        };
        let base = BaseLanes::<L>::load(&self.base, light);
        for &kind in &self.present {
            let Some(lot) = self.lot(kind, light, &base) else {
                continue;
            };
            let mask = lot.mask;
            let one = self.emission_of(geometry, lot, u);
            sample = EmissionSample {
                origin: Vec3::select(mask, one.origin, sample.origin),
                direction: Vec3::select(mask, one.direction, sample.direction),
                // Where the density vanishes the quotient is no number; such samples carry nothing.
                beta: Vec3::select(mask.and(one.valid), one.beta, sample.beta),
                d_vcm: L::select(mask, one.d_vcm, sample.d_vcm),
                d_vc: L::select(mask, one.d_vc, sample.d_vc),
                distant: sample.distant.or(mask.and(one.distant)),
                valid: sample.valid.or(mask.and(one.valid)),
            };
        }
        sample
    }

    #[inline(always)]
    fn emission_of<L: Lanes>(
        &self,
        geometry: &Geometry,
        lot: Lot<L>,
        u: [L; 4],
    ) -> EmissionSample<L> {
        match lot.kind {
            Kind::Triangle | Kind::Sphere | Kind::ImageTriangle | Kind::ImageSphere => {
                self.emission_area(geometry, lot, u)
            }
            Kind::Point | Kind::Spot | Kind::Goniometric | Kind::Projection => {
                self.emission_point(lot, u)
            }
            Kind::Distant => self.emission_distant(lot, u),
            Kind::InfiniteConstant | Kind::InfiniteImage => self.emission_environment(lot, u),
        }
    }
}

/// An area light that no ray meets, by what its row of [`LightTable::base`] says of its sides.
fn is_hidden(sides: f32) -> bool {
    !(0.0..=1.0).contains(&sides)
}
