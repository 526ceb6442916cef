//! Isotropic BSDFs as series of cosines of the azimuth, one for each pair of zenith angles (Jakob,
//! d'Eon, Jakob and Marschner 2014, "A Comprehensive Framework for Rendering Layered Materials";
//! files of layerlab, as pbrt-v3 reads them).
//!
//! With `mu_i`, `mu_o` the cosines of `-wi` and of `wo`, and `phi` the azimuth between these, the
//! value times `|mu_i|` is `sum_k a_k(mu_i, mu_o) cos(k phi)`. Coefficients are interpolated by
//! Catmull-Rom splines in both cosines. There are one or three channels: luminance, red and blue.

use std::f64::consts::{PI, TAU};

/// Cosines at most: a million series.
const MOST_MU: usize = 1 << 12;

/// Bytes of the head.
const HEAD: usize = 64;

/// What is in a file.
#[derive(Debug, PartialEq)]
pub struct FourierTable {
    /// Cosines, rising from -1 to 1.
    mu: Vec<f32>,
    /// Integrals of the means over azimuths up to each `mu_i`, rows of equal `mu_o`.
    cdf: Vec<f32>,
    /// First coefficient and their number, of each channel, for each pair.
    series: Vec<[u32; 2]>,
    coefficients: Vec<f32>,
    channels: usize,
    /// Index of refraction of the lower side over the upper.
    eta: f32,
}

/// Four nodes around a place, and their weights.
#[derive(Clone, Copy)]
struct Nodes {
    at: [usize; 4],
    weight: [f64; 4],
}

/// What a pair of directions has: channels of `f |mu_i|`, luminance first.
pub type Value = [f64; 3];

fn words(bytes: &[u8], count: usize) -> impl Iterator<Item = u32> + '_ {
    let words = bytes.chunks_exact(4).take(count);
    words.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

impl FourierTable {
    /// From the bytes of a file; or what is wrong with it.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let Some((head, rest)) = bytes.split_at_checked(HEAD) else {
            return Err("is too short for a Fourier BSDF".into());
        };
        if &head[..8] != b"SCATFUN\x01" {
            return Err("is no Fourier BSDF (\"SCATFUN\", version 1)".into());
        }
        let word: Vec<u32> = words(&head[8..], 14).collect();
        let [flags, mu, coefficients, _, channels, bases] =
            [0, 1, 2, 3, 4, 5].map(|i| word[i] as usize);
        let eta = f32::from_bits(word[9]);
        if flags != 1 || bases != 1 || !matches!(channels, 1 | 3) {
            return Err(format!(
                "is a Fourier BSDF of a kind that pbrt does not read either \
                 (flags {flags}, {bases} bases, {channels} channels)"
            ));
        }
        if !(2..=MOST_MU).contains(&mu) {
            return Err(format!("has {mu} cosines; 2 to {MOST_MU} are possible"));
        }
        let needed = mu + 3 * mu * mu + coefficients;
        if rest.len() / 4 < needed {
            return Err(format!(
                "is cut short: {needed} numbers should follow its head, {} do",
                rest.len() / 4
            ));
        }
        let mut from = 0;
        let mut take = |count: usize| {
            let part = &rest[4 * from..];
            from += count;
            words(part, count)
        };
        let floats = |w: u32| f32::from_bits(w);
        let table = Self {
            mu: take(mu).map(floats).collect(),
            cdf: take(mu * mu).map(floats).collect(),
            series: {
                let all: Vec<u32> = take(2 * mu * mu).collect();
                all.chunks_exact(2).map(|s| [s[0], s[1]]).collect()
            },
            coefficients: take(coefficients).map(floats).collect(),
            channels,
            eta,
        };
        table.check()?;
        Ok(table)
    }

    fn check(&self) -> Result<(), String> {
        let finite = |v: &[f32]| v.iter().all(|x| x.is_finite());
        if !(finite(&self.mu) && finite(&self.cdf) && finite(&self.coefficients)) {
            return Err("has values that are no numbers".into());
        }
        if !(self.eta > 0.0 && self.eta.is_finite()) {
            return Err(format!("has an index of refraction of {}", self.eta));
        }
        // Two may be equal, where there is a step, yet not at the ends.
        let n = self.mu.len();
        let ends = self.mu[0] < self.mu[1] && self.mu[n - 2] < self.mu[n - 1];
        let rises = |w: &[f32]| w[0] <= w[1] && w[1] <= w[2] && w[0] < w[2];
        if !(ends && self.mu.windows(3).all(rises)) {
            return Err("has cosines that do not rise".into());
        }
        let all = self.coefficients.len() as u64;
        let fits = |s: &[u32; 2]| u64::from(s[0]) + u64::from(s[1]) * self.channels as u64 <= all;
        match self.series.iter().all(fits) {
            true => Ok(()),
            false => Err("has series beyond its coefficients".into()),
        }
    }

    /// Of a refracted ray that comes up (`mu_i > 0`), squared: index of the side that it comes
    /// from over that where it goes, inverted.
    pub fn radiance_scale(&self, mu_i: f64) -> f64 {
        let eta = f64::from(self.eta);
        if mu_i > 0.0 {
            1.0 / (eta * eta)
        } else {
            eta * eta
        }
    }

    fn node(&self, i: usize) -> f64 {
        self.mu[i].into()
    }

    /// Catmull-Rom weights; `None` beyond the ends.
    fn nodes(&self, x: f64) -> Option<Nodes> {
        let n = self.mu.len();
        if !(x >= self.node(0) && x <= self.node(n - 1)) {
            return None;
        }
        let right = self
            .mu
            .partition_point(|m| f64::from(*m) <= x)
            .clamp(1, n - 1);
        let i = right - 1;
        let (x0, x1) = (self.node(i), self.node(right));
        let width = x1 - x0;
        let t = (x - x0) / width;
        let (t2, t3) = (t * t, t * t * t);
        let mut w = [0.0, 2.0 * t3 - 3.0 * t2 + 1.0, 3.0 * t2 - 2.0 * t3, 0.0];
        let (first, last) = (t3 - 2.0 * t2 + t, t3 - t2);
        if i > 0 {
            let slope = first * width / (x1 - self.node(i - 1));
            w[0] -= slope;
            w[2] += slope;
        } else {
            w[1] -= first;
            w[2] += first;
        }
        if right + 1 < n {
            let slope = last * width / (self.node(right + 1) - x0);
            w[1] -= slope;
            w[3] += slope;
        } else {
            w[1] -= last;
            w[2] += last;
        }
        Some(Nodes {
            at: [i.saturating_sub(1), i, right, (right + 1).min(n - 1)],
            weight: w,
        })
    }

    /// The series of a pair of cosines, and its weight.
    fn series<'a>(
        &'a self,
        i: &'a Nodes,
        o: &'a Nodes,
    ) -> impl Iterator<Item = (f64, [&'a [f32]; 3])> + 'a {
        let pairs = (0..16).map(|k| (k / 4, k % 4));
        pairs.filter_map(|(b, a)| {
            let weight = i.weight[a] * o.weight[b];
            let [first, count] = self.series[o.at[b] * self.mu.len() + i.at[a]];
            let (first, count) = (first as usize, count as usize);
            let channel = |c: usize| match c < self.channels {
                true => &self.coefficients[first + c * count..first + (c + 1) * count],
                false => &[][..],
            };
            (weight != 0.0 && count > 0).then(|| (weight, [channel(0), channel(1), channel(2)]))
        })
    }

    /// `f |mu_i|` for the cosines and that of the azimuth between; 0 beyond the table.
    pub fn value(&self, mu_i: f64, mu_o: f64, cos_phi: f64) -> Value {
        let (Some(i), Some(o)) = (self.nodes(mu_i), self.nodes(mu_o)) else {
            return [0.0; 3];
        };
        let mut value = [0.0; 3];
        for (weight, channels) in self.series(&i, &o) {
            for (value, series) in value.iter_mut().zip(channels) {
                *value += weight * cosines(series, cos_phi);
            }
        }
        value
    }

    /// Red, green and blue of what [`Self::value`] says.
    pub fn rgb(&self, [y, r, b]: Value) -> [f64; 3] {
        let y = y.max(0.0);
        if self.channels == 1 {
            return [y; 3];
        }
        // Luminance is that of linear sRGB.
        let g = 1.39829 * y - 0.100913 * b - 0.297375 * r;
        [r.max(0.0), g.max(0.0), b.max(0.0)]
    }

    /// An entry of a table with rows of equal `mu_o`, interpolated between these.
    fn column(&self, o: &Nodes, i: usize, entry: impl Fn(usize) -> f64) -> f64 {
        let n = self.mu.len();
        (0..4).map(|k| o.weight[k] * entry(o.at[k] * n + i)).sum()
    }

    fn cdf_at(&self, o: &Nodes, i: usize) -> f64 {
        self.column(o, i, |at| self.cdf[at].into())
    }

    /// Mean over azimuths.
    fn mean_at(&self, o: &Nodes, i: usize) -> f64 {
        self.column(o, i, |at| {
            let [first, count] = self.series[at];
            match count {
                0 => 0.0,
                _ => self.coefficients[first as usize].into(),
            }
        })
    }

    /// All that goes on from `mu_o`: what values are divided by to be densities.
    pub fn total(&self, mu_o: f64) -> f64 {
        let Some(o) = self.nodes(mu_o) else {
            return 0.0;
        };
        TAU * self.cdf_at(&o, self.mu.len() - 1).max(0.0)
    }

    /// `mu_i` and the azimuth to `-wi`, as [`Self::value`] over [`Self::total`] distributes them.
    pub fn sample(&self, mu_o: f64, u: [f64; 2]) -> Option<[f64; 2]> {
        let o = self.nodes(mu_o)?;
        let mu_i = self.sample_mu(&o, u[1])?;
        let i = self.nodes(mu_i)?;
        let mut luminance: Vec<f64> = Vec::new();
        for (weight, [series, ..]) in self.series(&i, &o) {
            luminance.resize(luminance.len().max(series.len()), 0.0);
            for (a, s) in luminance.iter_mut().zip(series) {
                *a += weight * f64::from(*s);
            }
        }
        Some([mu_i, sample_azimuth(&luminance, u[0])?])
    }

    fn sample_mu(&self, o: &Nodes, u: f64) -> Option<f64> {
        let n = self.mu.len();
        let all = self.cdf_at(o, n - 1);
        if all <= 0.0 {
            return None;
        }
        let u = u * all;
        // The last interval that begins at or below.
        let (mut low, mut high) = (0, n - 1);
        while high - low > 1 {
            let middle = low.midpoint(high);
            match self.cdf_at(o, middle) <= u {
                true => low = middle,
                false => high = middle,
            }
        }
        let (x0, x1) = (self.node(low), self.node(high));
        let width = x1 - x0;
        let f = |i: usize| self.mean_at(o, i);
        let (f0, f1) = (f(low), f(high));
        let d0 = match low {
            0 => f1 - f0,
            _ => width * (f1 - f(low - 1)) / (x1 - self.node(low - 1)),
        };
        let d1 = match high + 1 < n {
            false => f1 - f0,
            true => width * (f(high + 1) - f0) / (self.node(high + 1) - x0),
        };
        let wanted = (u - self.cdf_at(o, low)) / width;
        // The spline in Horner's form, and its integral.
        let (c2, c3) = (3.0 * (f1 - f0) - 2.0 * d0 - d1, d0 + d1 + 2.0 * (f0 - f1));
        let value = |t: f64| f0 + t * (d0 + t * (c2 + t * c3));
        let integral = |t: f64| t * (f0 + t * (d0 / 2.0 + t * (c2 / 3.0 + t * c3 / 4.0)));
        let t = invert(wanted, [0.0, 1.0], integral, value);
        Some((x0 + width * t).clamp(x0, x1))
    }
}

/// `sum_k a_k cos(k phi)`.
fn cosines(a: &[f32], cos: f64) -> f64 {
    let (mut before, mut here, mut sum) = (cos, 1.0, 0.0);
    for a in a {
        sum += f64::from(*a) * here;
        (before, here) = (here, 2.0 * cos * here - before);
    }
    sum
}

/// Where a rising function is `wanted`, by Newton's steps kept within what is known.
fn invert(
    wanted: f64,
    [mut low, mut high]: [f64; 2],
    integral: impl Fn(f64) -> f64,
    value: impl Fn(f64) -> f64,
) -> f64 {
    let mut t = 0.5 * (low + high);
    for _ in 0..48 {
        let off = integral(t) - wanted;
        if off > 0.0 {
            high = t;
        } else {
            low = t;
        }
        if high - low < 1e-12 {
            break;
        }
        let next = t - off / value(t);
        t = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
    }
    t
}

/// An azimuth distributed as the series, `None` if that has no mean.
fn sample_azimuth(a: &[f64], u: f64) -> Option<f64> {
    let mean = *a.first()?;
    if mean <= 0.0 {
        return None;
    }
    // The series is even: half the range, and a side.
    let (u, flip) = match u < 0.5 {
        true => (2.0 * u, false),
        false => (2.0 - 2.0 * u, true),
    };
    let integral = |phi: f64| {
        let (sin, cos) = phi.sin_cos();
        let (mut before, mut here, mut sum) = (-sin, 0.0, mean * phi);
        for (k, a) in a.iter().enumerate().skip(1) {
            (before, here) = (here, 2.0 * cos * here - before);
            sum += a / k as f64 * here;
        }
        sum
    };
    let value = |phi: f64| {
        let cos = phi.cos();
        let (mut before, mut here, mut sum) = (cos, 1.0, 0.0);
        for a in a {
            sum += a * here;
            (before, here) = (here, 2.0 * cos * here - before);
        }
        sum
    };
    let phi = invert(u * mean * PI, [0.0, PI], integral, value);
    Some(if flip { TAU - phi } else { phi })
}
