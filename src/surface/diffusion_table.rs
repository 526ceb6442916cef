//! How far from where it went in light comes out of a medium that fills a half space: photon beam
//! diffusion (Habel, Christensen and Jarosz 2013), tabulated as in pbrt (3rd edition, sections 11.4
//! and 15.5).
//!
//! Lengths are in mean free paths. A profile is `2 pi r` times the light that comes out at the
//! distance `r`, per area there, so that its integral over `r` is all that comes out.

use super::spline::{self, Segment};
use std::f64::consts::{FRAC_1_PI, TAU};

const ALBEDOS: usize = 100;
const RADII: usize = 64;
/// Depths that integrals along the beam are sums over.
const DEPTHS: usize = 100;
/// The part of a profile that is sampled: the rest is so far out that probes would have to reach
/// across the scene for it. pbrt cuts profiles at the same place.
const REACHED: f64 = 0.999;

/// Profiles by single-scattering albedo, of one phase function and index of refraction.
#[derive(Debug)]
pub struct DiffusionTable {
    albedos: Vec<f64>,
    radii: Vec<f64>,
    /// By albedo, then by radius.
    profiles: Vec<[f64; RADII]>,
    /// Their integrals up to each radius.
    sums: Vec<[f64; RADII]>,
    /// Their integrals.
    effective: Vec<f64>,
}

/// A row of the table between its albedos.
#[derive(Clone, Copy, Debug)]
pub struct Between {
    first: usize,
    weights: [f64; 4],
}

impl DiffusionTable {
    /// Of a mean cosine and an index of refraction, at least 1.
    pub fn new(g: f64, eta: f64) -> Self {
        let albedo = |i: usize| {
            let x = i as f64 / (ALBEDOS - 1) as f64;
            (1.0 - (-8.0 * x).exp()) / (1.0 - (-8.0f64).exp())
        };
        let albedos: Vec<f64> = (0..ALBEDOS).map(albedo).collect();
        let radius = |i: usize| match i {
            0 => 0.0,
            _ => 2.5e-3 * 1.2f64.powi(i as i32 - 1),
        };
        let radii: Vec<f64> = (0..RADII).map(radius).collect();
        let mut table = Self {
            profiles: Vec::with_capacity(ALBEDOS),
            sums: Vec::with_capacity(ALBEDOS),
            effective: Vec::with_capacity(ALBEDOS),
            albedos,
            radii,
        };
        for &albedo in &table.albedos {
            let medium = Medium::new(albedo, g, eta);
            let profile: [f64; RADII] = std::array::from_fn(|j| {
                let r = table.radii[j];
                TAU * r * (medium.once(r) + medium.often(r))
            });
            let (mut sum, mut sums) = (0.0, [0.0; RADII]);
            for i in 0..RADII - 1 {
                let segment = Segment::new(&table.radii, i, |j| profile[j]);
                sum += segment.width * segment.integral(1.0);
                sums[i + 1] = sum;
            }
            table.profiles.push(profile);
            table.sums.push(sums);
            table.effective.push(sum);
        }
        table
    }

    /// The row of an albedo from 0 to 1.
    pub fn between(&self, albedo: f64) -> Between {
        let albedo = albedo.clamp(0.0, 1.0);
        let first = spline::interval(&self.albedos, albedo).unwrap_or(0);
        let weights = spline::weights(&self.albedos, first, albedo);
        Between { first, weights }
    }

    fn mixed(&self, row: &Between, value: impl Fn(usize) -> f64) -> f64 {
        let nodes = (0..4).filter(|k| row.weights[*k] != 0.0);
        nodes
            .map(|k| row.weights[k] * value((row.first + k).saturating_sub(1)))
            .sum()
    }

    /// The part of the light that comes out again.
    pub fn effective_albedo(&self, row: &Between) -> f64 {
        self.mixed(row, |i| self.effective[i])
    }

    /// The single-scattering albedo of which such a part comes out again; the largest there is if
    /// none has as much.
    pub fn albedo_of(&self, effective: f64) -> f64 {
        let Some(i) = spline::interval(&self.effective, effective) else {
            return match effective < self.effective[0] {
                true => self.albedos[0],
                false => self.albedos[ALBEDOS - 1],
            };
        };
        let segment = Segment::new(&self.albedos, i, |j| self.effective[j]);
        self.albedos[i] + segment.width * segment.find_value(effective)
    }

    /// A profile over `2 pi r`: what comes out per area; 0 beyond the table.
    pub fn per_area(&self, row: &Between, r: f64) -> f64 {
        let Some(i) = spline::interval(&self.radii, r) else {
            return 0.0;
        };
        let segment = self.segment(row, i);
        let value = segment.value((r - self.radii[i]) / segment.width);
        if r > 0.0 {
            (value / (TAU * r)).max(0.0)
        } else {
            0.0
        }
    }

    /// The distance that a part `u` of a profile is within.
    pub fn radius(&self, row: &Between, u: f64) -> f64 {
        let target = u * self.effective_albedo(row);
        let sum = |j: usize| self.mixed(row, |i| self.sums[i][j]);
        let (mut low, mut high) = (0, RADII - 1);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if sum(middle) <= target {
                low = middle;
            } else {
                high = middle;
            }
        }
        let segment = self.segment(row, low);
        self.radii[low] + segment.width * segment.find_integral((target - sum(low)) / segment.width)
    }

    /// Where profiles are cut off.
    pub fn reach(&self, row: &Between) -> f64 {
        self.radius(row, REACHED)
    }

    fn segment(&self, row: &Between, i: usize) -> Segment {
        Segment::new(&self.radii, i, |j| self.mixed(row, |k| self.profiles[k][j]))
    }
}

/// A half space of extinction 1 below an interface.
struct Medium {
    albedo: f64,
    g: f64,
    eta: f64,
    /// Scattering as if it were isotropic, and extinction with it.
    reduced: [f64; 2],
    /// Coefficient of diffusion (Grosjean 1956).
    diffusion: f64,
    /// How fast fluence falls off.
    transport: f64,
    /// Depth at which fluence vanishes, twice as far outside as the boundary is from it.
    beyond: f64,
    /// Parts of fluence and of vector irradiance that leave.
    exits: [f64; 2],
}

impl Medium {
    fn new(albedo: f64, g: f64, eta: f64) -> Self {
        let absorption = 1.0 - albedo;
        let scattering = albedo * (1.0 - g);
        let extinction = absorption + scattering;
        let diffusion = (2.0 * absorption + scattering) / (3.0 * extinction * extinction);
        let (first, second) = (first_moment(eta), second_moment(eta));
        Self {
            albedo,
            g,
            eta,
            reduced: [scattering, extinction],
            diffusion,
            transport: (absorption / diffusion).sqrt(),
            beyond: -2.0 * diffusion * (1.0 + 3.0 * second) / (1.0 - 2.0 * first),
            exits: [0.25 * (1.0 - 2.0 * first), 0.5 * (1.0 - 3.0 * second)],
        }
    }

    /// Optical depths that a beam is as likely to be scattered between.
    fn depths() -> impl Iterator<Item = f64> {
        (0..DEPTHS).map(|i| -(1.0 - (i as f64 + 0.5) / DEPTHS as f64).ln())
    }

    /// Light that was scattered more than once: a source along the beam, and its mirror image.
    fn often(&self, r: f64) -> f64 {
        let [scattering, extinction] = self.reduced;
        let tr = self.transport;
        let albedo = scattering / extinction;
        let sum: f64 = Self::depths()
            .map(|depth| {
                let real = depth / extinction;
                let image = 2.0 * self.beyond - real;
                let [to_real, to_image] = [real, image].map(|z| r.hypot(z));
                let fall = |d: f64| (-tr * d).exp() / d;
                let fluence = (fall(to_real) - fall(to_image)) / self.diffusion;
                let flow = |z: f64, d: f64| z * (1.0 + tr * d) * fall(d) / (d * d);
                let irradiance = flow(real, to_real) - flow(image, to_image);
                // The correction of the source near the beam (their equation 12).
                let kappa = 1.0 - (-2.0 * extinction * (to_real + real)).exp();
                kappa * (fluence * self.exits[0] + irradiance * self.exits[1])
            })
            .sum();
        albedo * albedo * sum / (2.0 * TAU) / DEPTHS as f64
    }

    /// Light that was scattered once, and leaves by an angle below the critical one.
    fn once(&self, r: f64) -> f64 {
        let critical = r * (self.eta * self.eta - 1.0).sqrt();
        let sum: f64 = Self::depths()
            .map(|depth| {
                let depth = critical + depth;
                let d = r.hypot(depth);
                let cos = depth / d;
                let leaves = 1.0 - reflectance_inside(cos, self.eta);
                let phase = henyey_greenstein(cos, self.g);
                (-(d + critical)).exp() / (d * d) * phase * leaves * cos
            })
            .sum();
        self.albedo * sum / DEPTHS as f64
    }
}

/// `cos` is that of the angle between the direction out and the way back.
fn henyey_greenstein(cos: f64, g: f64) -> f64 {
    let d = 1.0 + g * g + 2.0 * g * cos;
    FRAC_1_PI / 4.0 * (1.0 - g * g) / (d * d.sqrt())
}

/// Fresnel reflectance of a boundary met from within.
fn reflectance_inside(cos: f64, eta: f64) -> f64 {
    let sin2 = eta * eta * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let out = (1.0 - sin2).sqrt();
    let parallel = (cos - eta * out) / (cos + eta * out);
    let perpendicular = (eta * cos - out) / (eta * cos + out);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// The integral of Fresnel reflectance times cosine over the cosine, by d'Eon and Irving's fit
/// (2011).
pub fn first_moment(eta: f64) -> f64 {
    let fit: [f64; 6] = if eta < 1.0 {
        [0.45966, -1.73965, 3.37668, -3.904945, 2.49277, -0.68441]
    } else {
        [-4.61686, 11.1136, -10.4646, 5.11455, -1.27198, 0.12746]
    };
    fit.iter().rev().fold(0.0, |sum, c| sum * eta + c)
}

/// The same of the squared cosine.
fn second_moment(eta: f64) -> f64 {
    let horner = |fit: &[f64], x: f64| fit.iter().rev().fold(0.0, |sum, c| sum * x + c);
    if eta < 1.0 {
        horner(&[0.27614, -0.8735, 1.12077, -0.65095, 0.07883, 0.0486], eta)
    } else {
        let rising = [-547.033, 404.557, -189.519, 54.9327, -9.00603, 0.63942];
        horner(&rising, eta) + horner(&[0.0, 458.843, -218.725, 45.3087], 1.0 / eta)
    }
}
