//! Lights: choice, emission, direct sampling, and the densities of both.
//!
//! Every light answers four questions, eight lanes at a time: a point of it as seen from a surface ([`LightTable::sample_direct`], `s = 1`),
//! a ray leaving it ([`LightTable::sample_emission`], `s >= 2`), and, for `s = 0`, what a camera subpath that hit it
//! ([`LightTable::emitted`]) or escaped to it ([`LightTable::escaped`]) sees and with which densities it could have been sampled.
//!
//! Densities follow Georgiev 2012 ("Implementing Vertex Connection and Merging"): for a light at a finite distance the *direct* density is
//! over area and the *emission* density over area times solid angle; for one at infinity the direct density is over solid angle and the
//! emission density over solid angle times area of a disk that covers the scene. This file is the only place that knows.

mod choice;
mod environment;

pub use self::choice::LightChoice;
use self::environment::Environment;
use crate::geometry::{AreaSample, Geometry};
use crate::scene::{LightKind, Rgb, Scene, SpotFalloff};
use crate::simd::{Frame, Lanes, Mask, Row, UintLanes, Vec3, math};
use crate::trace::offset;
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// The kinds of light kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    Triangle,
    Sphere,
    Point,
    Spot,
    Distant,
    InfiniteConstant,
    InfiniteImage,
}

impl Kind {
    const ALL: [Kind; 7] = [
        Kind::Triangle,
        Kind::Sphere,
        Kind::Point,
        Kind::Spot,
        Kind::Distant,
        Kind::InfiniteConstant,
        Kind::InfiniteImage,
    ];
    pub fn is_delta(self) -> bool {
        matches!(self, Kind::Point | Kind::Spot | Kind::Distant)
    }
    /// Surrounds the scene: rays that escape see it.
    pub fn is_environment(self) -> bool {
        matches!(self, Kind::InfiniteConstant | Kind::InfiniteImage)
    }
}

/// All lights of a scene.
pub struct LightTable {
    kinds: Vec<Kind>,
    /// `[probability of choice, r, g, b, two-sided or falloff, primitive (bits), environment (bits), 1 / area of a triangle]`.
    base: Vec<Row>,
    /// `[position or direction (3), axis (3), cos total, cos falloff]`.
    place: Vec<Row>,
    environments: Vec<Environment>,
    /// Lights that escaping rays see.
    pub infinite: Vec<u32>,
    choice: LightChoice,
    present: Vec<Kind>,
    /// Radius of the ball that distant lights shine on.
    radius: f32,
}

/// A light seen from a surface point.
pub struct DirectSample<L: Lanes> {
    /// Unit, from the surface to the light.
    pub to_light: Vec3<L>,
    /// The end of the visibility ray (origin for distant lights: any far point).
    pub target: Vec3<L>,
    /// Radiance towards the surface, or intensity for point lights.
    pub radiance: Vec3<L>,
    /// Density over solid angle at the surface, choice included; point lights: squared distance times choice.
    pub pdf: L,
    /// What multiplies a camera subpath's `cos * (dVCM + dVC * pdf_reverse)`: emission over direct density and over the cosine at the
    /// light (Georgiev 2012, equation 45).
    pub emission_ratio: L,
    /// Sampling by chance is impossible (delta light).
    pub delta: L::Mask,
    pub valid: L::Mask,
}

/// A ray leaving a light.
pub struct EmissionSample<L: Lanes> {
    /// Already off the surface by its error bound.
    pub origin: Vec3<L>,
    /// Unit.
    pub direction: Vec3<L>,
    /// Emitted radiance times cosine over all densities.
    pub beta: Vec3<L>,
    /// First MIS quantities (Georgiev 2012, equations 31 and 32).
    pub d_vcm: L,
    pub d_vc: L,
    /// Distances do not enter the density of the first vertex.
    pub distant: L::Mask,
    pub valid: L::Mask,
}

/// A light hit or seen by a camera subpath.
pub struct Emitted<L: Lanes> {
    /// Towards the viewer.
    pub radiance: Vec3<L>,
    /// Density of direct sampling, choice included: over area, or over solid angle for environments.
    pub direct_pdf: L,
    /// Density of emission, choice included.
    pub emission_pdf: L,
}

impl LightTable {
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let radius = geometry.radius;
        let mut table = Self {
            kinds: Vec::new(),
            base: Vec::new(),
            place: Vec::new(),
            environments: Vec::new(),
            infinite: Vec::new(),
            choice: LightChoice::new(&[]),
            present: Vec::new(),
            radius,
        };
        let powers: Vec<f64> = (scene.lights.iter())
            .map(|light| table.push(scene, geometry, &light.kind))
            .collect();
        table.choice = LightChoice::new(&powers);
        for (i, row) in table.base.iter_mut().enumerate() {
            row.0[0] = table.choice.probability(i);
        }
        table.present = (Kind::ALL.into_iter())
            .filter(|k| table.kinds.contains(k))
            .collect();
        table
    }

    /// Appends a light; returns its power (W, internal units), by which lights are chosen.
    fn push(&mut self, scene: &Scene, geometry: &Geometry, light: &LightKind) -> f64 {
        let disk = f64::from(PI * self.radius * self.radius);
        let mut place = [0.0; 8];
        let mut extra = 0.0;
        let mut inv_area = 0.0;
        let mut prim = 0;
        let (kind, colour, factor) = match light {
            LightKind::Triangle {
                triangle,
                l,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *triangle;
                let sides = f64::from(1.0 + extra);
                let area = geometry.triangle_area(*triangle);
                inv_area = 1.0 / area;
                let area = f64::from(area);
                (Kind::Triangle, *l, sides * area * f64::from(PI))
            }
            LightKind::Sphere {
                sphere,
                l,
                two_sided,
            } => {
                extra = f32::from(u8::from(*two_sided));
                prim = *sphere;
                let sides = f64::from(1.0 + extra);
                let area = f64::from(geometry.sphere_area(*sphere));
                (Kind::Sphere, *l, sides * area * f64::from(PI))
            }
            LightKind::Point { p, i } => {
                place[..3].copy_from_slice(&p.to_array());
                (Kind::Point, *i, f64::from(2.0 * TAU))
            }
            LightKind::Spot {
                p,
                axis,
                i,
                cos_total,
                cos_falloff,
                falloff,
            } => {
                place[..3].copy_from_slice(&p.to_array());
                place[3..6].copy_from_slice(&axis.to_array());
                place[6] = *cos_total;
                place[7] = *cos_falloff;
                extra = if *falloff == SpotFalloff::V3 {
                    0.0
                } else {
                    1.0
                };
                let cone = f64::from(TAU) * (1.0 - 0.5 * f64::from(cos_total + cos_falloff));
                (Kind::Spot, *i, cone)
            }
            LightKind::Distant { direction, l } => {
                place[..3].copy_from_slice(&direction.to_array());
                (Kind::Distant, *l, disk)
            }
            LightKind::InfiniteConstant { l } => {
                (Kind::InfiniteConstant, *l, disk * f64::from(2.0 * TAU))
            }
            LightKind::InfiniteImage {
                image,
                scale,
                to_light,
                layout,
            } => {
                let map =
                    Environment::new(&scene.images[*image as usize], *scale, *to_light, *layout);
                let mean = map.mean();
                self.environments.push(map);
                (Kind::InfiniteImage, mean, disk * f64::from(2.0 * TAU))
            }
        };
        if kind.is_environment() {
            self.infinite.push(self.kinds.len() as u32);
        }
        let environment = self.environments.len().saturating_sub(1) as u32;
        self.base.push(Row([
            0.0,
            colour[0],
            colour[1],
            colour[2],
            extra,
            f32::from_bits(prim),
            f32::from_bits(environment),
            inv_area,
        ]));
        self.place.push(Row(place));
        self.kinds.push(kind);
        factor * f64::from((colour[0] + colour[1] + colour[2]) / 3.0)
    }

    pub fn len(&self) -> usize {
        self.kinds.len()
    }
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }
    /// Choosing a light takes a primary sample.
    pub fn needs_choice(&self) -> bool {
        self.kinds.len() > 1
    }
    /// Some light can be met by chance (`s = 0` carries light).
    pub fn any_non_delta(&self) -> bool {
        self.kinds.iter().any(|k| !k.is_delta())
    }
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

    #[inline(always)]
    fn mask_of<L: Lanes>(&self, kind: Kind, light: &[u32]) -> L::Mask {
        if let [only] = self.present[..] {
            return L::Mask::splat(only == kind);
        }
        let mut bits = 0;
        for (i, l) in light.iter().enumerate() {
            bits |= u32::from(self.kinds[*l as usize] == kind) << i;
        }
        L::Mask::from_bits(bits)
    }

    /// Primitive or environment index per lane; 0 in lanes of other kinds, which would be out of range.
    #[inline(always)]
    fn column_bits<L: Lanes>(column: L, mask: L::Mask, n: usize) -> [u32; 8] {
        let column = L::uint_select(mask, column.to_bits(), L::Uint::splat(0));
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
            target: Vec3::zero(),
            radiance: Vec3::zero(),
            pdf: L::one(),
            emission_ratio: L::zero(),
            delta: L::Mask::splat(false),
            valid: L::Mask::splat(false),
        };
        let base = L::load_rows(&self.base, light);
        for &kind in &self.present {
            let mask = self.mask_of::<L>(kind, light);
            if !mask.any() {
                continue;
            }
            let one = self.direct_of(kind, geometry, light, &base, mask, p, u);
            sample = DirectSample {
                to_light: Vec3::select(mask, one.to_light, sample.to_light),
                target: Vec3::select(mask, one.target, sample.target),
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
    #[allow(clippy::too_many_arguments)]
    fn direct_of<L: Lanes>(
        &self,
        kind: Kind,
        geometry: &Geometry,
        light: &[u32],
        base: &[L; 8],
        mask: L::Mask,
        p: Vec3<L>,
        u: [L; 2],
    ) -> DirectSample<L> {
        let choice = base[0];
        let colour = Vec3::new(base[1], base[2], base[3]);
        let yes = L::Mask::splat(true);
        match kind {
            Kind::Triangle | Kind::Sphere => {
                let point = self.area_point(kind, geometry, base, mask, light.len(), u);
                let v = point.p - p;
                let d2 = v.length2();
                let w = v * (L::one() / d2.sqrt());
                let cos = -w.dot(point.ng);
                let two_sided = base[4].gt(L::zero());
                let lit = cos.gt(L::zero()).or(two_sided.and(cos.lt(L::zero())));
                let abs = cos.abs();
                let sides = L::select(two_sided, L::splat(2.0), L::one());
                DirectSample {
                    to_light: w,
                    target: offset::leave(point.p, point.error, point.ng, -w),
                    radiance: colour,
                    pdf: choice * point.pdf * d2 / abs,
                    // (pA cos / (sides pi)) / (pA d2 / cos) / cos
                    emission_ratio: abs * L::splat(FRAC_1_PI) / (sides * d2),
                    delta: yes.not(),
                    valid: lit.and(d2.gt(L::zero())),
                }
            }
            Kind::Point | Kind::Spot => {
                let place = L::load_rows(&self.place, light);
                let at = Vec3::new(place[0], place[1], place[2]);
                let v = at - p;
                let d2 = v.length2();
                let w = v * (L::one() / d2.sqrt());
                let (factor, pdf) = self.directional(kind, &place, base, -w);
                DirectSample {
                    to_light: w,
                    target: at,
                    radiance: colour * factor,
                    pdf: choice * d2,
                    emission_ratio: pdf / d2,
                    delta: yes,
                    valid: factor.gt(L::zero()).and(d2.gt(L::zero())),
                }
            }
            Kind::Distant => {
                let place = L::load_rows(&self.place, light);
                let w = -Vec3::new(place[0], place[1], place[2]);
                DirectSample {
                    to_light: w,
                    target: w.mul_add(self.far(), p),
                    radiance: colour,
                    pdf: choice,
                    emission_ratio: self.inv_disk(),
                    delta: yes,
                    valid: yes,
                }
            }
            Kind::InfiniteConstant | Kind::InfiniteImage => {
                let (w, radiance, pdf) = self.environment_sample(kind, base, mask, light.len(), u);
                DirectSample {
                    to_light: w,
                    target: w.mul_add(self.far(), p),
                    radiance,
                    pdf: choice * pdf,
                    emission_ratio: self.inv_disk(),
                    delta: yes.not(),
                    valid: pdf.gt(L::zero()),
                }
            }
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
        let base = L::load_rows(&self.base, light);
        for &kind in &self.present {
            let mask = self.mask_of::<L>(kind, light);
            if !mask.any() {
                continue;
            }
            let one = self.emission_of(kind, geometry, light, &base, mask, u);
            sample = EmissionSample {
                origin: Vec3::select(mask, one.origin, sample.origin),
                direction: Vec3::select(mask, one.direction, sample.direction),
                beta: Vec3::select(mask, one.beta, sample.beta),
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
        kind: Kind,
        geometry: &Geometry,
        light: &[u32],
        base: &[L; 8],
        mask: L::Mask,
        u: [L; 4],
    ) -> EmissionSample<L> {
        let inv_choice = L::one() / base[0];
        let colour = Vec3::new(base[1], base[2], base[3]);
        let yes = L::Mask::splat(true);
        match kind {
            Kind::Triangle | Kind::Sphere => {
                let point = self.area_point(kind, geometry, base, mask, light.len(), [u[0], u[1]]);
                let two_sided = base[4].gt(L::zero());
                // Both sides: the first half of a sample is the front, the second the back.
                let half = u[2] * L::splat(2.0);
                let back = two_sided.and(half.ge(L::one()));
                let folded = L::select(back, half - L::one(), half);
                let local = math::cosine_hemisphere(L::select(two_sided, folded, u[2]), u[3]);
                let n = Vec3::select(back, -point.ng, point.ng);
                let direction = Frame::new(n).to_world(local);
                let solid = L::select(two_sided, L::splat(TAU), L::splat(PI));
                let scale = solid / point.pdf * inv_choice;
                EmissionSample {
                    origin: offset::leave(point.p, point.error, n, n),
                    direction,
                    beta: colour * scale,
                    d_vcm: solid / local.z,
                    d_vc: scale,
                    distant: yes.not(),
                    valid: local.z.gt(L::zero()),
                }
            }
            Kind::Point | Kind::Spot => {
                let place = L::load_rows(&self.place, light);
                let direction = if kind == Kind::Point {
                    math::uniform_sphere(u[2], u[3])
                } else {
                    // Uniform in the cone.
                    let drop = L::one() - place[6];
                    let z = L::one() - u[2] * drop;
                    let r = ((L::one() - z) * (L::one() + z)).max(L::zero()).sqrt();
                    let (sin, cos) = math::sin_cos_turns(u[3]);
                    Frame::new(Vec3::new(place[3], place[4], place[5])).to_world(Vec3::new(
                        r * cos,
                        r * sin,
                        z,
                    ))
                };
                let (factor, pdf) = self.directional(kind, &place, base, direction);
                EmissionSample {
                    origin: Vec3::new(place[0], place[1], place[2]),
                    direction,
                    beta: colour * (factor / pdf * inv_choice),
                    d_vcm: L::one() / pdf,
                    d_vc: L::zero(),
                    distant: yes.not(),
                    valid: factor.gt(L::zero()),
                }
            }
            Kind::Distant => {
                let place = L::load_rows(&self.place, light);
                let direction = Vec3::new(place[0], place[1], place[2]);
                EmissionSample {
                    origin: self.disk_point(direction, u),
                    direction,
                    beta: colour * (inv_choice / self.inv_disk()),
                    d_vcm: L::one() / self.inv_disk(),
                    d_vc: L::zero(),
                    distant: yes,
                    valid: yes,
                }
            }
            Kind::InfiniteConstant | Kind::InfiniteImage => {
                let (w, radiance, pdf) =
                    self.environment_sample(kind, base, mask, light.len(), [u[2], u[3]]);
                let inv_density = L::one() / (self.inv_disk::<L>() * pdf);
                EmissionSample {
                    origin: self.disk_point(-w, u),
                    direction: -w,
                    beta: radiance * (inv_density * inv_choice),
                    d_vcm: L::one() / self.inv_disk(),
                    d_vc: inv_density * inv_choice,
                    distant: yes,
                    valid: pdf.gt(L::zero()),
                }
            }
        }
    }

    /// What a camera subpath sees of area lights it hit: `p` on the light, `cos` of the viewing direction against its front normal.
    #[inline(always)]
    pub fn emitted<L: Lanes>(
        &self,
        geometry: &Geometry,
        light: &[u32],
        p: Vec3<L>,
        cos: L,
    ) -> Emitted<L> {
        let base = L::load_rows(&self.base, light);
        let triangle = self.mask_of::<L>(Kind::Triangle, light);
        let sphere = self.mask_of::<L>(Kind::Sphere, light);
        let mut pdf = base[7].or_zero(triangle);
        if sphere.any() {
            let prim = Self::column_bits(base[5], sphere, light.len());
            pdf = L::select(sphere, geometry.sphere_pdf(&prim[..light.len()], p), pdf);
        }
        let two_sided = base[4].gt(L::zero());
        let lit = cos.gt(L::zero()).or(two_sided.and(cos.lt(L::zero())));
        let inv_solid = L::select(two_sided, L::splat(0.5 * FRAC_1_PI), L::splat(FRAC_1_PI));
        let direct = base[0] * pdf;
        Emitted {
            radiance: Vec3::new(base[1], base[2], base[3]).or_zero(lit),
            direct_pdf: direct,
            emission_pdf: direct * cos.abs() * inv_solid,
        }
    }

    /// What rays escaping along unit `direction` see of one environment.
    #[inline(always)]
    pub fn escaped<L: Lanes>(&self, light: u32, direction: Vec3<L>) -> Emitted<L> {
        let base = &self.base[light as usize].0;
        let (radiance, pdf) = match self.kinds[light as usize] {
            Kind::InfiniteImage => {
                let map = &self.environments[base[6].to_bits() as usize];
                map.radiance_and_pdf(direction)
            }
            _ => (
                Vec3::splat([base[1], base[2], base[3]]),
                L::splat(0.5 / TAU),
            ),
        };
        let direct = pdf * L::splat(base[0]);
        Emitted {
            radiance,
            direct_pdf: direct,
            emission_pdf: direct * self.inv_disk(),
        }
    }

    #[inline(always)]
    fn area_point<L: Lanes>(
        &self,
        kind: Kind,
        geometry: &Geometry,
        base: &[L; 8],
        mask: L::Mask,
        n: usize,
        u: [L; 2],
    ) -> AreaSample<L> {
        let prim = Self::column_bits(base[5], mask, n);
        if kind == Kind::Triangle {
            geometry.sample_triangles(&prim[..n], u[0], u[1], base[7])
        } else {
            geometry.sample_spheres(&prim[..n], u[0], u[1])
        }
    }

    /// Intensity factor of a point-like light towards `w`, and the density over solid angle that emission samples it with.
    #[inline(always)]
    fn directional<L: Lanes>(
        &self,
        kind: Kind,
        place: &[L; 8],
        base: &[L; 8],
        w: Vec3<L>,
    ) -> (L, L) {
        if kind == Kind::Point {
            return (L::one(), L::splat(0.5 / TAU));
        }
        let cos = w.dot(Vec3::new(place[3], place[4], place[5]));
        let (total, full) = (place[6], place[7]);
        let span = full - total;
        let x = L::select(
            span.gt(L::zero()),
            (cos - total) / span,
            L::select(cos.ge(full), L::one(), L::zero()),
        );
        let x = x.max(L::zero()).min(L::one());
        let smooth = x * x * L::splat(-2.0).mul_add(x, L::splat(3.0));
        let quartic = (x * x) * (x * x);
        let factor = L::select(base[4].gt(L::zero()), smooth, quartic);
        let pdf = L::splat(1.0 / TAU) / (L::one() - total);
        (factor, pdf)
    }

    /// Direction to the light, radiance, density over solid angle.
    #[inline(always)]
    fn environment_sample<L: Lanes>(
        &self,
        kind: Kind,
        base: &[L; 8],
        mask: L::Mask,
        n: usize,
        u: [L; 2],
    ) -> (Vec3<L>, Vec3<L>, L) {
        if kind == Kind::InfiniteConstant {
            let w = math::uniform_sphere(u[0], u[1]);
            let radiance = Vec3::new(base[1], base[2], base[3]);
            return (w, radiance, L::splat(0.5 / TAU));
        }
        let index = Self::column_bits(base[6], mask, n);
        let mut out = [[0.0f32; 7]; 8];
        for i in (0..n).filter(|i| mask.bits() >> i & 1 != 0) {
            let map = &self.environments[index[i] as usize];
            let w = map.sample([u[0].lane(i), u[1].lane(i)]);
            let (radiance, pdf) = map.radiance_and_pdf(Vec3::<f32>::splat(w));
            out[i] = [w[0], w[1], w[2], radiance.x, radiance.y, radiance.z, pdf];
        }
        let column = |c: usize| L::from_fn(|i| out[i][c]);
        (
            Vec3::new(column(0), column(1), column(2)),
            Vec3::new(column(3), column(4), column(5)),
            column(6),
        )
    }

    /// A point of the disk outside the scene that faces it along `direction`.
    #[inline(always)]
    fn disk_point<L: Lanes>(&self, direction: Vec3<L>, u: [L; 4]) -> Vec3<L> {
        let r = L::splat(self.radius);
        let (x, y) = math::concentric_disk(u[0], u[1]);
        Frame::new(direction).to_world(Vec3::new(x * r, y * r, -r))
    }

    /// One over the area of that disk.
    #[inline(always)]
    fn inv_disk<L: Lanes>(&self) -> L {
        L::splat(FRAC_1_PI / (self.radius * self.radius))
    }

    /// Beyond the scene from any surface.
    #[inline(always)]
    fn far<L: Lanes>(&self) -> L {
        L::splat(3.0 * self.radius)
    }
}

/// Mean of the channels, the measure of power here and of a path's contribution in the chains.
pub fn mean(colour: Rgb) -> f32 {
    (colour[0] + colour[1] + colour[2]) / 3.0
}
