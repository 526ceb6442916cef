//! How much light there is, and what that makes of the film's sums. The picture is
//!
//! ```text
//! sum over k of  b_k * A / N_k * sum of splats of sampler k
//! ```
//!
//! with `b_k` the integral of sampler `k`, `A` the sampled raster area in pixels and `N_k` the
//! mutations made by chains of that sampler, whatever their number: rounding and early stops cost
//! no energy. `b_k` is the mean target of all uniform samples there are: the bootstrap's, and every
//! large step's ([`Estimate`]; pbrt-v3, section 16.4.3, uses the first alone).
//!
//! If the method combines them, large steps are splatted as independent samples, too
//! ([`Batch::combine`]), to one more layer of the film, which adds
//!
//! ```text
//! c * A / (p N) * sum of splats of large steps
//! ```
//!
//! with `p` their probability and `c = p b` of the bootstrap. Not divided by their number but by
//! its expectation: that is unbiased also where there are few of them, or none.

use super::Run;
use super::schedule::{ChainBudget, density, layer_of};
use crate::chain::batch::Batch;
use crate::chain::bootstrap::Estimate;
use crate::chain::monitor::{GroupTiles, UNITS};
use crate::film::Scales;

/// Batches of chains that have made the same number of iterations as others of their layer.
pub(super) type Chains<'a> = Vec<(&'a ChainBudget, &'a Batch)>;

/// How much light there is, and how it gets from the film into the picture.
pub(super) struct Light {
    /// By sampler: the integrals `b_k`.
    pub estimates: Vec<Estimate>,
    /// By layer of the film: what turns its sums into radiance, and the squared relative standard
    /// error of that.
    pub scales: Vec<f64>,
    pub relative_variance: Vec<f64>,
    /// What all splats of each layer weigh; 0 if errors are not estimated.
    weights: Vec<f64>,
    /// Mean radiance of light that others bring to the picture.
    pub beside: f64,
}

impl Light {
    pub fn of(run: &Run, layers: usize, chains: &Chains) -> Self {
        let estimates = estimate(chains);
        let area = run.world.camera.region.area();
        let scale = |layer| {
            let scale = layer_scale(chains, &estimates, layer);
            (scale + independent_scale(chains, layer)) * area
        };
        let relative = |layer: usize| {
            let samplers = estimates.iter().enumerate();
            let of_layer = samplers.filter(|(sampler, _)| layer_of(*sampler) == layer);
            let (b, error2) = of_layer.fold((0.0, 0.0), |(b, error2), (_, e)| {
                (b + e.mean(), error2 + e.error2() * widened(e.effective()))
            });
            if b > 0.0 { error2 / (b * b) } else { 0.0 }
        };
        Self {
            scales: (0..layers).map(scale).collect(),
            relative_variance: (0..layers).map(relative).collect(),
            weights: weights(chains, layers),
            beside: 0.0,
            estimates,
        }
    }

    /// Part of the picture's light that the states of chains have brought; the rest is that of
    /// large steps as independent samples.
    pub fn of_chains(&self) -> f64 {
        let light = |(weight, scale): (&f64, &f64)| weight * scale;
        let layers = || self.weights.iter().zip(&self.scales);
        let all: f64 = layers().map(light).sum();
        // Only the scales of chains are uncertain.
        let uncertain = layers()
            .zip(&self.relative_variance)
            .filter(|(_, v)| **v > 0.0);
        let chains: f64 = uncertain.map(|(layer, _)| light(layer)).sum();
        if all > 0.0 { chains / all } else { 0.0 }
    }

    /// As the film takes it, with `radiance` in place of the scales.
    pub fn of_film<'a>(&'a self, radiance: &'a [f64]) -> Scales<'a> {
        Scales {
            radiance,
            relative_variance: &self.relative_variance,
            light: &self.weights,
        }
    }
}

/// Variance of Student's t of so many samples, of which a variance of their own has been estimated:
/// what few samples that carry the light say of their mean is too good by so much. It has none
/// below two; there the factor ends.
fn widened(effective: f64) -> f64 {
    let n = effective.max(2.5);
    n / (n - 2.0)
}

/// All independent samples of each sampler: the bootstrap's and the large steps'.
fn estimate(chains: &Chains) -> Vec<Estimate> {
    let samplers = chains.iter().map(|(a, _)| a.index + 1).max();
    let mut estimates = vec![Estimate::default(); samplers.unwrap_or(0)];
    for (a, _) in chains {
        estimates[a.index] = a.bootstrap;
    }
    for (a, batch) in chains {
        for chain in batch.large_moments() {
            estimates[a.index].later.merge(&chain);
        }
    }
    estimates
}

/// Factor of a layer of chains: its samplers' integral over their weighted mutations; 0 for others.
fn layer_scale(chains: &Chains, estimates: &[Estimate], layer: usize) -> f64 {
    let members = || chains.iter().filter(|(a, _)| a.layer == layer);
    // Chains of a layer have all made the same number of iterations.
    let done = members().next().map_or(0, |(_, batch)| batch.iterations());
    let densest = members().map(|(a, _)| density(a)).fold(0.0, f64::max);
    // A sampler has several batches, in a row.
    let (mut boot, mut refined, mut last) = (0.0, 0.0, None);
    for (a, _) in members() {
        if last != Some(a.index) {
            boot += a.bootstrap.mean();
            refined += estimates[a.index].mean();
            last = Some(a.index);
        }
    }
    if boot > 0.0 && done > 0 {
        densest / f64::from(done) * refined / boot
    } else {
        0.0
    }
}

/// Factor of a layer of large steps: the constant they are weighed with over their expected number;
/// 0 for others.
fn independent_scale(chains: &Chains, layer: usize) -> f64 {
    let members = || (chains.iter()).filter(|(a, _)| a.independent == Some(layer));
    let Some((a, _)) = members().next() else {
        return 0.0;
    };
    let mutations: f64 = members()
        .map(|(_, batch)| f64::from(batch.iterations()) * batch.len() as f64)
        .sum();
    let expected = a.large_step_probability() * mutations;
    if expected > 0.0 {
        f64::from(a.constant()) / expected
    } else {
        0.0
    }
}

/// What all splats of each layer weigh.
fn weights(chains: &Chains, layers: usize) -> Vec<f64> {
    let mut weights = vec![0.0; layers];
    for (a, batch) in chains {
        let groups = batch.monitor().map_or(&[][..], |m| m.groups());
        for layer in std::iter::once(a.layer).chain(a.independent) {
            let sum: u64 = groups.iter().flat_map(|g| sums_of(a, g, layer)).sum();
            weights[layer] += sum as f64 / UNITS * a.share;
        }
    }
    weights
}

/// What a group of chains has left in each tile of a layer.
pub(super) fn sums_of<'a>(a: &ChainBudget, group: &'a GroupTiles, layer: usize) -> &'a [u64] {
    match layer {
        _ if a.layer == layer => &group.sums,
        _ if a.independent == Some(layer) => &group.independent,
        _ => &[],
    }
}
