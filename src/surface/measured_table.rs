//! Measured reflection in a parameterisation that follows it (Dupuy and Jakob 2018, "An Adaptive
//! Parameterization for Efficient Material Acquisition and Rendering"; files of the RGL material
//! database, as pbrt-v4 reads them).
//!
//! A half vector is a place on the unit square. The distribution of visible normals of the
//! measured surface warps another square onto it, on which the spectra are tabulated; and a warp
//! by their luminance samples that.

use super::tensor::Tensors;
use super::warp::{Grid, Warp};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What is in a file, spectra reduced to RGB.
#[derive(Debug, PartialEq)]
pub struct MeasuredTable {
    ndf: Grid,
    sigma: Grid,
    vndf: Warp,
    luminance: Warp,
    /// Three channels.
    colour: Grid,
    isotropic: bool,
}

type V = [f64; 3];

/// Least of what densities are divided by at the pole, as in pbrt.
const LEAST: f64 = 1e-6;

/// Polar coordinates: zenith angle and azimuth.
fn angles(w: V) -> [f64; 2] {
    [w[0].hypot(w[1]).atan2(w[2]), w[1].atan2(w[0])]
}

fn square(theta: f64, phi: f64) -> [f64; 2] {
    let v = phi / TAU + 0.5;
    [(theta / FRAC_PI_2).max(0.0).sqrt(), v - v.floor()]
}

/// Density over solid angle of `wi`, over that on the square of half vectors.
fn jacobian(cos: f64, u: f64, sin_m: f64) -> f64 {
    4.0 * cos * (2.0 * PI * PI * u * sin_m).max(LEAST)
}

impl MeasuredTable {
    /// From the bytes of a file. `reduce` has, for each wavelength (nm), what a reflectance that is
    /// 1 there and falls to 0 at its neighbours is in RGB.
    pub fn parse(
        bytes: &[u8],
        reduce: impl Fn(&[f32]) -> Result<Vec<[f64; 3]>, String>,
    ) -> Result<Self, String> {
        let file = Tensors::parse(bytes)?;
        let (theta, [thetas]) = file.floats::<1>("theta_i")?;
        let (phi, [phis]) = file.floats::<1>("phi_i")?;
        let (wavelengths, [bands]) = file.floats::<1>("wavelengths")?;
        let plane = |name: &str| -> Result<Grid, String> {
            let (data, [ny, nx]) = file.floats::<2>(name)?;
            Grid::new(data, [nx, ny], [vec![0.0], vec![0.0]], 1)
        };
        let (ndf, sigma) = (plane("ndf")?, plane("sigma")?);
        let warp = |name: &str| -> Result<Warp, String> {
            let (data, [a, b, ny, nx]) = file.floats::<4>(name)?;
            if [a, b] != [phis, thetas] {
                return Err(format!("has an array \"{name}\" for other angles"));
            }
            Warp::new(Grid::new(data, [nx, ny], [phi.clone(), theta.clone()], 1)?)
        };
        let (vndf, luminance) = (warp("vndf")?, warp("luminance")?);
        let (spectra, shape) = file.floats::<5>("spectra")?;
        let [a, b, c, ny, nx] = shape;
        if [a, b, c] != [phis, thetas, bands] || bands == 0 {
            return Err("has an array \"spectra\" for other angles or wavelengths".into());
        }
        let isotropic = phis <= 2;
        if !isotropic && ((phi[phis - 1] - phi[0]) as f64 / TAU - 1.0).abs() > 0.3 {
            return Err("has azimuths of a part of the circle, which pbrt does not read".into());
        }
        let weights = reduce(&wavelengths)?;
        let cells = nx * ny;
        let mut colour = Vec::with_capacity(3 * phis * thetas * cells);
        for slice in spectra.chunks_exact((bands * cells).max(1)) {
            for channel in 0..3 {
                colour.extend((0..cells).map(|cell| {
                    let band = |(k, w): (usize, &[f64; 3])| {
                        w[channel] * f64::from(slice[k * cells + cell])
                    };
                    weights.iter().enumerate().map(band).sum::<f64>() as f32
                }));
            }
        }
        Ok(Self {
            ndf,
            sigma,
            vndf,
            luminance,
            colour: Grid::new(colour, [nx, ny], [phi, theta], 3)?,
            isotropic,
        })
    }

    /// The place of a half vector, for light along a direction of this azimuth.
    fn place(&self, m: V, phi_o: f64) -> [f64; 2] {
        let [theta, phi] = angles(m);
        square(theta, if self.isotropic { phi - phi_o } else { phi })
    }

    /// Value for two directions in the upper hemisphere, that of the camera first, and the density
    /// of samples from there.
    pub fn value(&self, o: V, i: V) -> (V, f64) {
        let sum: V = std::array::from_fn(|k| o[k] + i[k]);
        let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
        if length <= 0.0 {
            return ([0.0; 3], 0.0);
        }
        let m = sum.map(|x| x / length);
        let [theta_o, phi_o] = angles(o);
        let at = self.place(m, phi_o);
        let slices = self.vndf.slices([phi_o, theta_o]);
        let (sample, density) = self.vndf.invert(&slices, at);
        let one = self.ndf.slices([0.0; 2]);
        let sigma = self.sigma.value(&one, 0, square(theta_o, phi_o));
        let scale = self.ndf.value(&one, 0, at) / (4.0 * sigma * i[2]);
        let colour = |c: usize| self.colour.value(&slices, c, sample).max(0.0) * scale;
        let cos = (o[0] * m[0] + o[1] * m[1] + o[2] * m[2]).max(0.0);
        let lost = jacobian(cos, at[0], m[0].hypot(m[1]));
        let pdf = density * self.luminance.density(&slices, sample) / lost;
        let f = [colour(0), colour(1), colour(2)];
        let sound = |x: f64| x.is_finite() && x >= 0.0;
        match f.iter().all(|v| sound(*v)) && sound(pdf) {
            true => (f, pdf),
            false => ([0.0; 3], 0.0),
        }
    }

    /// A direction for light along `o`, which is in the upper hemisphere.
    pub fn sample(&self, o: V, u: [f64; 2]) -> Option<V> {
        let [theta_o, phi_o] = angles(o);
        let slices = self.vndf.slices([phi_o, theta_o]);
        let sample = self.luminance.sample(&slices, u);
        let [x, y] = self.vndf.sample(&slices, sample);
        let turned = (2.0 * y - 1.0) * PI;
        let phi = if self.isotropic {
            turned + phi_o
        } else {
            turned
        };
        let (sin, cos) = (x * x * FRAC_PI_2).sin_cos();
        let m = [sin * phi.cos(), sin * phi.sin(), cos];
        let along = 2.0 * (o[0] * m[0] + o[1] * m[1] + o[2] * m[2]);
        let i: V = std::array::from_fn(|k| along * m[k] - o[k]);
        (i[2] > 0.0).then_some(i)
    }
}
