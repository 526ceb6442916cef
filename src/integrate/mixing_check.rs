//! Whether the chains have seen all of the light, and what the user is told if they have not.
//!
//! Three things can go wrong in a picture that looks smooth: chains disagree with each other (split
//! R-hat), a chain stays where it is (stuck chains), or no chain has been where there is light. The
//! last is what large steps find out: they are independent samples of the whole picture, so tile by
//! tile their mean must be that of the chains.

use super::chance::FEW;
use super::depth_stats::{CrossCheck, DepthStats, MATTERS, MIXED, Missed, named};
use super::error::{Groups, Tiles};
use super::normalisation::{Chains, Light, sums_of};
use super::{Run, Stats};
use crate::chain::mixing::{Mixing, Stuck};
use crate::chain::monitor::{Monitor, TileMoments, UNITS};
use crate::film::{GROUPS, Tiling};

/// Standard errors that are beyond chance, for a million comparisons.
const BEYOND_CHANCE: f64 = 6.0;
/// Standard error of a tile's mean from which on a patch of its size is seen: about twice what is
/// just noticeable.
const VISIBLE: f64 = 0.03;
/// Large steps with light that make a mean in a tile.
const ENOUGH: u64 = 16;

/// Figures of every depth that has chains.
pub(super) fn depths(chains: &Chains, light: &Light) -> Vec<DepthStats> {
    let of_chains: f64 = light.estimates.iter().map(|e| e.mean()).sum();
    let total = of_chains + light.beside;
    let mut list = Vec::new();
    for (index, estimate) in light.estimates.iter().enumerate() {
        let own = || chains.iter().filter(|(a, _)| a.index == index);
        let Some((a, first)) = own().next() else {
            continue;
        };
        let monitors: Vec<&Monitor> = own().filter_map(|(_, batch)| batch.monitor()).collect();
        let b = estimate.mean();
        let depth = a.sampler.depth();
        list.push(DepthStats {
            depth,
            b,
            b_stderr: estimate.error2().sqrt(),
            share: if total > 0.0 { b / total } else { 0.0 },
            effective: estimate.effective(),
            chains: a.chains,
            mutations: own()
                .map(|(_, batch)| u64::from(batch.iterations()) * batch.len() as u64)
                .sum(),
            sigma: a.proposals.sigma,
            large_step_probability: a.proposals.large_step_probability,
            mixing: Mixing::of(depth, first.iterations(), &monitors),
        });
    }
    list
}

/// Fills in what is known of errors and mixing, and warns. `beside` is the layer of light that
/// others than chains bring.
pub(super) fn judge(
    run: &Run,
    tiling: &Tiling,
    (chains, light): (&Chains, &Light),
    beside: Option<Groups>,
    stats: &mut Stats,
    warnings: &mut Vec<String>,
) {
    let depths = depths(chains, light);
    let all = light.scales.len();
    let sums = all_weights(chains, all, tiling);
    let layers = layers_of((chains, light), &sums, beside);
    let (tiles, whole) = tiles_of(tiling, (chains, light), &sums, &layers);
    let check = cross_check(run, tiling, chains, &layers[..all], whole.then_some(&tiles));

    let important = || depths.iter().filter(|d| d.share >= MATTERS);
    let worst = |values: Vec<f64>, than: fn(f64, f64) -> f64| values.into_iter().reduce(than);
    stats.rhat = worst(
        important().filter_map(|d| d.mixing.rhat).collect(),
        f64::max,
    );
    stats.ess = worst(important().filter_map(|d| d.mixing.ess).collect(), f64::min);
    // A sixteenth of the mutations of every depth is recorded, of either kind the same part.
    let dark = |of: fn(&Mixing) -> Option<f64>| {
        let known = depths
            .iter()
            .filter_map(|d| Some((of(&d.mixing)?, d.mutations as f64)));
        let (sum, all) = known.fold((0.0, 0.0), |(sum, all), (part, n)| {
            (sum + part * n, all + n)
        });
        (all > 0.0).then(|| sum / all)
    };
    stats.dark_small = dark(|m| m.dark_small);
    stats.dark_large = dark(|m| m.dark_large);
    stats.stuck_chains = depths.iter().map(|d| d.mixing.stuck.len() as u64).sum();
    let disagreement = apart(&depths, &tiles, tiling);
    stats.apart = disagreement.is_some();
    warnings.extend(disagreement);
    warnings.extend(few(&depths));
    warnings.extend(stuck(tiling, chains, light, &depths, &tiles));
    warnings.extend(missed(&check));
    stats.depths = depths;
    stats.tiles = Some(tiles);
    stats.cross_check = Some(check);
}

/// Weights in the tiles of all layers.
fn all_weights(chains: &Chains, layers: usize, tiling: &Tiling) -> Vec<Vec<[f64; GROUPS]>> {
    (0..layers)
        .map(|l| tile_weights(chains, l, tiling))
        .collect()
}

/// Layers of chains, and that of others.
fn layers_of<'a>(
    (chains, light): (&Chains, &Light),
    sums: &'a [Vec<[f64; GROUPS]>],
    beside: Option<Groups<'a>>,
) -> Vec<Groups<'a>> {
    let layer = |(layer, sums)| Groups {
        sums,
        thrown: thrown(chains, layer),
        scale: light.scales[layer],
        relative_variance: light.relative_variance[layer],
    };
    let of_chains = sums.iter().map(Vec::as_slice).enumerate().map(layer);
    of_chains.chain(beside).collect()
}

/// Tiles of the picture, and whether large steps are in it as well.
fn tiles_of(
    tiling: &Tiling,
    (chains, light): (&Chains, &Light),
    sums: &[Vec<[f64; GROUPS]>],
    layers: &[Groups],
) -> (Tiles, bool) {
    let Some(sums) = with_large_steps(chains, light, sums) else {
        return (Tiles::of(tiling, layers), false);
    };
    let both = Groups {
        sums: &sums,
        scale: 1.0,
        relative_variance: light.relative_variance[0] * light.of_chains().powi(2),
        ..layers[0]
    };
    (Tiles::of(tiling, &[both]), true)
}

/// Whether it is known of all depths that matter that their chains agree, or that it does not show
/// that they do not.
pub(super) fn agree(
    tiling: &Tiling,
    (chains, light): (&Chains, &Light),
    beside: Option<Groups>,
) -> bool {
    let depths = depths(chains, light);
    if depths.iter().any(|d| !d.is_told()) {
        return false;
    }
    if depths.iter().all(|d| d.apart().is_none()) {
        return true;
    }
    let sums = all_weights(chains, light.scales.len(), tiling);
    let layers = layers_of((chains, light), &sums, beside);
    let (tiles, _) = tiles_of(tiling, (chains, light), &sums, &layers);
    tiles.stderr.is_some() && uncertain(&tiles).next().is_none()
}

/// Tiles whose mean is off by what can be seen, with their relative standard errors.
fn uncertain(tiles: &Tiles) -> impl Iterator<Item = (usize, f64)> {
    let stderr = tiles.stderr.iter().flatten();
    let relative = (stderr.zip(&tiles.mean)).map(|(stderr, mean)| stderr / mean);
    (relative.enumerate()).filter(|(_, error)| *error > VISIBLE)
}

/// What each group of chains has left in each tile, as states and as large steps, in radiance times
/// pixels; `None` if large steps are not splatted. Both come from the same chains: added up group
/// by group, their scatter is that of the sum.
fn with_large_steps(
    chains: &Chains,
    light: &Light,
    sums: &[Vec<[f64; GROUPS]>],
) -> Option<Vec<[f64; GROUPS]>> {
    let (a, _) = chains.first()?;
    let also = a.independent?;
    let [of_states, of_large] = [a.layer, also].map(|layer| (&sums[layer], light.scales[layer]));
    let add = |(states, large): (&[f64; GROUPS], &[f64; GROUPS])| {
        std::array::from_fn(|g| states[g] * of_states.1 + large[g] * of_large.1)
    };
    Some(of_states.0.iter().zip(of_large.0).map(add).collect())
}

/// Weight that each group of chains has thrown into a layer, all told.
fn thrown(chains: &Chains, layer: usize) -> [f64; GROUPS] {
    let mut thrown = [0.0; GROUPS];
    for (a, batch) in chains.iter().filter(|(a, _)| a.layer == layer) {
        for group in batch.monitor().iter().flat_map(|m| m.groups()) {
            let steps = group.chains.len() as f64 * f64::from(batch.iterations());
            thrown[usize::from(group.group)] += steps * a.share;
        }
    }
    thrown
}

/// Weight that each group of chains has left in each tile.
fn tile_weights(chains: &Chains, layer: usize, tiling: &Tiling) -> Vec<[f64; GROUPS]> {
    let mut tiles = vec![[0.0; GROUPS]; tiling.len()];
    for (a, batch) in chains {
        for group in batch.monitor().iter().flat_map(|m| m.groups()) {
            for (tile, sum) in tiles.iter_mut().zip(sums_of(a, group, layer)) {
                tile[usize::from(group.group)] += *sum as f64 / UNITS * a.share;
            }
        }
    }
    tiles
}

/// `whole` is the picture's tiles if it has large steps in it: they and the states are compared as
/// they are weighed against each other, and told with what the former add.
fn cross_check(
    run: &Run,
    tiling: &Tiling,
    chains: &Chains,
    layers: &[Groups],
    whole: Option<&Tiles>,
) -> CrossCheck {
    let mut check = CrossCheck::default();
    let area = run.world.camera.region.area();
    for (layer, groups) in layers.iter().enumerate() {
        let mut large = vec![TileMoments::default(); tiling.len()];
        let own = || chains.iter().filter(|(a, _)| a.layer == layer);
        let first = own().next().map(|(a, _)| a);
        // The sums of depths that share a layer are one.
        if own().any(|(a, _)| Some(a.index) != first.map(|a| a.index)) {
            continue;
        }
        let mut steps = 0;
        for (_, batch) in own() {
            let Some(monitor) = batch.monitor() else {
                continue;
            };
            steps += batch.counts.large;
            for (to, from) in large.iter_mut().zip(monitor.large()) {
                to.count += from.count;
                to.sum += from.sum;
                to.squares += from.squares;
            }
        }
        let (Some(first), true) = (first, steps > 1) else {
            continue;
        };
        let by_chains = Tiles::of(tiling, std::slice::from_ref(groups));
        let n = steps as f64;
        for (tile, moments) in large.iter().enumerate().filter(|(_, m)| m.count >= ENOUGH) {
            check.compared += 1;
            let per_pixel = area / f64::from(tiling.pixels(tile));
            let mean = moments.sum / n * per_pixel;
            let variance = (moments.squares / n - (moments.sum / n).powi(2)).max(0.0) / n;
            let own = by_chains.stderr.as_ref().map_or(0.0, |s| s[tile]);
            let error = (variance * per_pixel * per_pixel + own * own).sqrt();
            let lack = mean - by_chains.mean[tile];
            if lack <= BEYOND_CHANCE * error {
                continue;
            }
            check.missed += 1;
            let scale = f64::from(run.film.scale);
            let told = whole.unwrap_or(&by_chains).mean[tile];
            let found = Missed {
                depth: first.sampler.depth(),
                tile: tiling.bounds(tile),
                chains: told * scale,
                large_steps: whole.map_or(mean, |_| told + lack) * scale,
                deviation: lack / error,
            };
            let lack = |m: &Missed| m.large_steps - m.chains;
            if check
                .worst
                .as_ref()
                .is_none_or(|worst| lack(worst) < lack(&found))
            {
                check.worst = Some(found);
            }
        }
    }
    check
}

fn apart(depths: &[DepthStats], tiles: &Tiles, tiling: &Tiling) -> Option<String> {
    let all = || depths.iter().filter_map(|d| Some((d.apart()?, d)));
    let (rhat, depth) = all().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let others = match all().count() - 1 {
        0 => String::new(),
        1 => ", and those of another depth".into(),
        n => format!(", and those of {n} other depths"),
    };
    let strategy = depth.worst_strategy().map_or(String::new(), |(s, t)| {
        format!(", least of all in strategy (s, t) = ({s}, {t})")
    });
    // What tiles say is told by chains that share nothing, mixed or not.
    let visible: Vec<(usize, f64)> = uncertain(tiles).collect();
    let (tile, error) = visible.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let [x0, x1, y0, y1] = tiling.bounds(*tile);
    let worth = depth.mixing.ess.map_or(String::new(), |ess| {
        format!(
            "; their light, {:.0} % of the picture's, is worth {ess:.0} independent samples",
            100.0 * depth.share
        )
    });
    Some(format!(
        "chains disagree: those of {} have not mixed (split R-hat {rhat:.2}, should be below {MIXED}){strategy}{others}{worth}; the picture \
         can be smooth and wrong: {} of {} tiles are off by more than {:.0} %, the most at pixels {x0}-{}, {y0}-{} (standard error \
         {:.1} % there): more mutations are needed",
        named(depth.depth),
        visible.len(),
        tiles.mean.len(),
        100.0 * VISIBLE,
        x1 - 1,
        y1 - 1,
        100.0 * error
    ))
}

/// Depths that matter whose brightness is that of few paths.
fn few(depths: &[DepthStats]) -> Option<String> {
    let few = |d: &&DepthStats| d.share >= MATTERS && d.effective < FEW;
    let worst = (depths.iter().filter(few)).max_by(|a, b| a.share.total_cmp(&b.share))?;
    let others = match depths.iter().filter(few).count() - 1 {
        0 => String::new(),
        n => format!(", as does that of {n} more"),
    };
    Some(format!(
        "the light of {}, {:.0} % of the picture's, rests on as few as {:.0} independent paths{others}: how bright it is is hardly known, and \
         the error with it; more --bootstrap or larger --large-step would help",
        named(worst.depth),
        100.0 * worst.share,
        worst.effective.ceil()
    ))
}

/// Chains that stayed in one state for so long that it shows: a pixel gets more from it than from
/// all else.
fn stuck(
    tiling: &Tiling,
    chains: &Chains,
    light: &Light,
    depths: &[DepthStats],
    tiles: &Tiles,
) -> Option<String> {
    let mut spots: Vec<(f64, Option<u32>, &Stuck)> = Vec::new();
    for d in depths {
        let own = chains.iter().find(|(a, _)| a.sampler.depth() == d.depth);
        let layer = own.map_or(0, |(a, _)| a.layer);
        for stuck in &d.mixing.stuck {
            let around = tiles.mean[tiling.index([stuck.x, stuck.y])];
            let excess = f64::from(stuck.iterations) * light.scales[layer] / around;
            if excess > 1.0 {
                spots.push((excess, d.depth, stuck));
            }
        }
    }
    let (excess, depth, worst) = spots.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let strategy = worst.s.zip(worst.t).map_or(String::new(), |(s, t)| {
        format!(", strategy (s, t) = ({s}, {t})")
    });
    Some(format!(
        "{} stuck for more than a tenth of the render, the worst of {}{strategy}, at pixel {}, {}: expect a spot there, about {:.0} times as bright as its surroundings",
        match spots.len() {
            1 => "a chain was".into(),
            n => format!("{n} chains were"),
        },
        named(*depth),
        worst.x as u32,
        worst.y as u32,
        1.0 + excess
    ))
}

fn missed(check: &CrossCheck) -> Option<String> {
    let worst = check.worst.as_ref()?;
    let [x0, x1, y0, y1] = worst.tile;
    Some(format!(
        "chains miss light that independent samples find, in {} of {} tiles and depths, the most of it at {}, pixels {x0}-{}, {y0}-{}: \
         {:.3} of {:.3} ({:.0} standard errors); more mutations or a larger --large-step would help",
        check.missed,
        check.compared,
        named(worst.depth),
        x1 - 1,
        y1 - 1,
        worst.chains,
        worst.large_steps,
        worst.deviation
    ))
}
