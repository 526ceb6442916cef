//! What all Metropolis integrators share: bootstrap, chains in lockstep, and their splats made a
//! picture.
//!
//! A [`Method`] is a list of samplers. Every sampler has its own integral, its own chains, and (up
//! to [`LAYERS`]) its own layer of the film. Mutations are shared out to samplers in proportion to
//! the bootstrap's integrals ([`super::schedule`]); [`super::normalisation`] makes sums of splats
//! radiance.

mod begun;
mod gather;
mod seen;

use self::begun::{Begun, bootstrap};
pub(super) use self::begun::{Ready, ready};
use self::gather::{all, gather};
use self::seen::{add_error, add_picture, mean, picture, see};
use super::chance::{self, ChanceStats, Trials};
use super::error::{Looks, relmse};
use super::method::Method;
use super::normalisation::{Chains, Light};
use super::run::Wants;
use super::sampled::Sampling;
use super::schedule::saved::{Batches, load_budgets, save_batches};
use super::schedule::{ChainBudget, Held, March, Start, density};
use super::state::Made;
use super::{EndedBy, ROUND, Render, Run, Stats, mixing_check, per_second};
use crate::chain::bootstrap::Estimate;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::film::{FilterTable, Half, SplatFilm, Tiling};
use crate::simd::Lanes;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// From the bootstrap on, or from a state.
pub(super) fn render<L: Lanes>(
    run: &Run,
    method: &Method,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let wanted = mutations(run, run.settings.mutations_per_pixel);
    if !from.is_empty() {
        return resumed::<L>(run, method, wanted, None, from);
    }
    let start = Instant::now();
    let ready = Ready::new(run, bootstrap::<L>(run, method), start);
    together::<L>(run, method, ready, wanted, None)
}

/// Mutations that come to so many per pixel.
pub(super) fn mutations(run: &Run, per_pixel: u64) -> f64 {
    (per_pixel as f64 * run.world.camera.region.area()).ceil()
}

/// Marches chains for `wanted` mutations, with samples `beside` them for the rest of the light.
pub(super) fn together<L: Lanes>(
    run: &Run,
    method: &Method,
    ready: Ready,
    wanted: f64,
    beside: Option<&mut Sampling>,
) -> Result<Render, Malformed> {
    let (begun, budgets, starts) = Begun::new::<L>(run, method, ready, wanted);
    let film = film(run, method, &budgets, &starts);
    let since = Instant::now();
    let tiling = Tiling::new(run.film.crop);
    let march = March::new::<L>(run, &budgets, &starts, &tiling);
    go_on::<L>(run, method, &begun, film, march, beside, since)
}

/// The same from where they stood when their state was kept, or the states of all shards.
pub(super) fn resumed<L: Lanes>(
    run: &Run,
    method: &Method,
    wanted: f64,
    mut beside: Option<&mut Sampling>,
    from: &mut [Reader],
) -> Result<Render, Malformed> {
    let since = Instant::now();
    let begun = Begun::load(from)?;
    let budgets = load_budgets(run, method, wanted, from)?;
    let layers = Method::layers(method.samplers.len(), method.combined);
    let filter = FilterTable::new(&run.film.filter, run.film.crop);
    let judged = run.settings.estimate_error;
    let load = match run.team().leads() {
        true => SplatFilm::load,
        // The sums are those of the first.
        false => SplatFilm::load_plan,
    };
    let mut films = (from.iter_mut()).map(|from| load(filter.clone(), layers, judged, from));
    let first = films.next();
    let mut film = first.ok_or_else(|| Malformed::new("there is no state"))??;
    films.try_for_each(|more| film.absorb(more?))?;
    let tiling = Tiling::new(run.film.crop);
    let march = March::load(run, &budgets, &tiling, from)?;
    if let Some(beside) = &mut beside {
        beside.load(from)?;
    }
    from.iter().try_for_each(Reader::end)?;
    go_on::<L>(run, method, &begun, film, march, beside, since)
}

/// What a state of chains is made of.
#[derive(Clone, Copy)]
struct Parts<'a> {
    run: &'a Run<'a>,
    begun: &'a Begun,
    film: &'a SplatFilm,
    budgets: &'a [ChainBudget],
    /// When this process began.
    since: Instant,
}

impl Parts<'_> {
    /// For which chains have marched.
    fn seconds(&self) -> f64 {
        self.begun.render_seconds + self.since.elapsed().as_secs_f64()
    }

    /// Writes all that [`resumed`] reads of the first process of a team.
    fn save(&self, batches: &Batches, beside: Option<&Sampling>, to: &mut Writer) -> Made {
        self.save_begun(to);
        self.film.save(to);
        save_batches(batches, to);
        let samples = beside.map_or(0, |beside| beside.save(to).samples);
        made(batches, samples)
    }

    /// The same of another: there are no sums in it.
    fn save_start(&self, batches: &Batches, beside: Option<&Sampling>, to: &mut Writer) {
        self.save_begun(to);
        self.film.save_plan(to);
        save_batches(batches, to);
        if let Some(beside) = beside {
            beside.save_start(to);
        }
    }

    fn save_begun(&self, to: &mut Writer) {
        self.begun.save(self.seconds(), to);
        to.count(self.budgets.len());
        self.budgets.iter().for_each(|a| a.save(to));
    }

    /// What is between two rounds: whoever wants to see it sees what all processes have made. Says
    /// whether it is good enough.
    fn look(
        &self,
        held: &Held,
        mut beside: Option<&mut Sampling>,
        looks: &mut Looks,
    ) -> Result<bool, Malformed> {
        let begin = Instant::now();
        let (run, film) = (self.run, self.film);
        let judged = run.settings.shard.is_none()
            && run.settings.estimate_error
            && beside.as_deref().is_none_or(Sampling::is_judged);
        let wants = Wants::ask(run, judged && looks.is_due());
        if wants.is_nothing() {
            return Ok(false);
        }
        let own: Batches = held.iter().map(|(a, to, b)| (*a, *to, &**b)).collect();
        let others = gather(run, self.budgets, film, &own, beside.as_deref_mut())?;
        let mut reached = false;
        if run.team().leads() {
            let batches = all(own, &others);
            let chains: Chains = batches.iter().map(|(a, _, b)| (*a, *b)).collect();
            let beside = beside.as_deref();
            run.show(wants.picture, |judged| {
                see(run, film, &chains, beside, judged)
            });
            if wants.state {
                run.keep(false, |to| self.save(&batches, beside, to));
            }
            if wants.error {
                reached = good_enough(run, film, &chains, beside);
                looks.looked(begin);
            }
        }
        Ok(run.team().agree(u8::from(reached)) == 1)
    }
}

/// How far chains and samples are.
fn made(batches: &Batches, samples: u64) -> Made {
    let (mut made, mut wanted) = (0, 0);
    for (a, _, batch) in batches {
        let chains = batch.len() as u64;
        made += u64::from(batch.iterations()) * chains;
        wanted += u64::from(a.iterations) * chains;
    }
    Made {
        mutations: made,
        samples,
        part: (made as f64 / wanted.max(1) as f64).min(1.0),
        ..Made::default()
    }
}

/// Marches chains to the end, and makes a picture of what they have splatted; `since` is when this
/// process began it. Only the first process of a team has the picture.
fn go_on<L: Lanes>(
    run: &Run,
    method: &Method,
    begun: &Begun,
    film: SplatFilm,
    mut march: March,
    beside: Option<&mut Sampling>,
    since: Instant,
) -> Result<Render, Malformed> {
    let settings = run.settings;
    let run = &Run {
        keeps: run.keeps && !begun.is_stopped(),
        ..*run
    };
    let budgets = march.budgets();
    let parts = Parts {
        run,
        begun,
        film: &film,
        budgets,
        since,
    };
    run.lead(|to| {
        let held = march.held();
        let batches = held.iter().map(|(a, half, b)| (*a, *half, &**b)).collect();
        parts.save_start(&batches, beside.as_deref(), to);
    });
    march.deal();
    let mut looks = Looks::new();
    // What a stop has kept of the bootstrap is worth a first round.
    let least = begun
        .short
        .or(begun.untuned)
        .map_or(Duration::ZERO, |_| ROUND);
    let samples = RefCell::new(beside);
    let advance = |part| {
        if let Some(samples) = &mut *samples.borrow_mut() {
            samples.advance_to(part);
        }
    };
    let ended_by = march.march::<L>(&film, least, advance, |held| {
        parts.look(held, samples.borrow_mut().as_deref_mut(), &mut looks)
    })?;
    if ended_by == EndedBy::Effort {
        // Chains advance the samples as they go, but there may be none.
        advance(1.0);
    }
    let mut beside = samples.into_inner();
    let mut warnings = march.warned();
    let mut batches = march.finish();
    let own = batches.iter().map(|(a, to, b)| (*a, *to, b)).collect();
    let others = gather(run, budgets, &film, &own, beside.as_deref_mut())?;
    if !run.team().leads() {
        return Ok(Render::nothing());
    }
    let beside = beside.map(|samples| &*samples);
    batches.extend(others);
    batches.sort_by_key(|(a, _, batch)| (a.index, batch.first()));
    if run.is_kept(true) {
        let batches = batches.iter().map(|(a, to, b)| (*a, *to, b)).collect();
        run.keep(true, |to| parts.save(&batches, beside, to));
    }
    let mut counts = begun.counts;
    let mut mutations = 0;
    for (_, to, batch) in &mut batches {
        batch.flush(&film, *to);
        counts.merge(&batch.counts);
        mutations += u64::from(batch.iterations()) * batch.len() as u64;
    }

    let chains: Chains = batches.iter().map(|(a, _, batch)| (*a, batch)).collect();
    run.show(run.observer.wants_picture(true), |judged| {
        see(run, &film, &chains, beside, judged)
    });
    let mut light = Light::of(run, film.layers(), &chains);
    let (pixels, beside_mean) = picture(&film, &light, beside);
    light.beside = beside_mean;
    let judged = settings.estimate_error && beside.is_none_or(Sampling::is_judged);
    let deviation =
        (judged && settings.error_layers).then(|| deviation(&film, &light, beside, pixels.len()));
    let made = mutations > 0 || beside.is_some();
    let relmse = (judged && made).then(|| relmse_of(run, &film, &light, beside));
    let render_seconds = parts.seconds();
    drop(film);
    let (width, height) = run.size();
    let [offset, full] = run.window();
    let (acceptance_large, acceptance_small) = counts.acceptance();
    let lit = light.beside > 0.0;
    warnings.extend(begun.warnings(run, method, !batches.is_empty(), lit));
    // Not by `sum`, by which nothing comes to -0.
    let sum = |of: fn(&Estimate) -> f64| light.estimates.iter().fold(0.0, |sum, e| sum + of(e));
    let mut stats = Stats {
        integrator: method.name.into(),
        mutations,
        mutations_per_second: per_second(mutations, render_seconds),
        rays: counts.rays,
        bootstrap_seconds: begun.bootstrap_seconds,
        render_seconds,
        acceptance_large,
        acceptance_small,
        b: sum(Estimate::mean),
        b_stderr: sum(Estimate::error2).sqrt(),
        rejected_nonfinite: counts.rejected,
        relmse,
        ..Stats::default()
    };
    let sums = beside.map(|b| (b, b.tile_sums()));
    if let Some((beside, sums)) = &sums {
        add_samples(&mut stats, beside);
        stats.b += light.beside;
        stats.b_stderr = stats.b_stderr.hypot(beside.mean_error(sums));
        warnings.extend(beside.warned());
    }
    if settings.estimate_error {
        let layer = sums.as_ref().map(|(beside, sums)| beside.layer(sums));
        let of = (&chains, &light);
        let tiling = Tiling::new(run.film.crop);
        mixing_check::judge(run, &tiling, of, layer, &mut stats, &mut warnings);
        stats.chance = chances(run, &chains, beside, stats.b);
        warnings.extend(stats.chance.iter().filter_map(ChanceStats::warning));
    }
    Ok(Render {
        stats,
        pixels,
        width,
        height,
        offset,
        full,
        warnings,
        deviation,
        strategies: Vec::new(),
        ended_by: begun.short.unwrap_or(ended_by),
    })
}

/// What samples beside chains have taken.
fn add_samples(stats: &mut Stats, beside: &Sampling) {
    let made = beside.counts();
    stats.samples = made.samples;
    stats.samples_per_second = per_second(made.samples, stats.render_seconds);
    stats.rays += made.rays;
    stats.rejected_nonfinite += made.rejected;
}

/// What chains, by their large steps, and samples beside them have found of light that only chance
/// finds.
fn chances(run: &Run, chains: &Chains, beside: Option<&Sampling>, b: f64) -> Vec<ChanceStats> {
    let mut depths: BTreeMap<usize, Trials> = BTreeMap::new();
    for (a, batch) in chains {
        // The shortest such path scatters twice; others try it as often as they choose it.
        let chosen = match (a.sampler.plan(), a.sampler.depth()) {
            (Some(plan), Some(2..)) => 1.0 / f64::from(plan.choice.factor(0)),
            (None, None) => 1.0,
            _ => continue,
        };
        let trials = depths.entry(a.index).or_default();
        trials.chosen = chosen;
        trials.paths += batch.counts.large as f64;
        let monitor = batch.monitor();
        (monitor.iter()).for_each(|m| trials.found.merge(m.found()));
    }
    let depths: Vec<Trials> = depths.into_values().collect();
    let samples = beside.map(Sampling::trials);
    chance::judge(run.hidden, &depths, samples.as_ref(), b)
}

/// Standard errors of all pixels.
fn deviation(
    film: &SplatFilm,
    light: &Light,
    beside: Option<&Sampling>,
    pixels: usize,
) -> Vec<[f32; 3]> {
    let scales = light.of_film(&light.scales);
    let mut deviation = film.resolve_with_error(0..pixels, &scales).1;
    if let Some(beside) = beside {
        let [_, more] = beside.with_error(0..pixels, 1.0);
        add_error(&mut deviation, &more);
    }
    deviation
}

/// Estimated relMSE of the picture so far, as it will be written.
fn relmse_of(run: &Run, film: &SplatFilm, light: &Light, beside: Option<&Sampling>) -> f64 {
    let (width, height) = run.size();
    let width = width as usize;
    let scale = f64::from(run.film.scale);
    let radiance: Vec<f64> = light.scales.iter().map(|s| s * scale).collect();
    relmse(width, height as usize, |rows| {
        let pixels = rows.start * width..rows.end * width;
        let scales = light.of_film(&radiance);
        let (mut picture, mut deviation) = film.resolve_with_error(pixels.clone(), &scales);
        if let Some(beside) = beside {
            let [more, error] = beside.with_error(pixels, run.film.scale);
            add_picture(&mut picture, &more);
            add_error(&mut deviation, &error);
        }
        (picture, deviation)
    })
}

fn film(run: &Run, method: &Method, budgets: &[ChainBudget], starts: &[Start]) -> SplatFilm {
    let layers = Method::layers(method.samplers.len(), method.combined);
    let filter = FilterTable::new(&run.film.filter, run.film.crop);
    let most = (budgets.iter())
        .map(|a| f64::from(a.iterations) * a.chains as f64)
        .sum();
    if !run.settings.estimate_error {
        return SplatFilm::new(filter, layers, most);
    }
    // The scales that the layers would have at the end if the bootstrap knew all about the light.
    let half = |layer: usize| {
        let members = budgets.iter().zip(starts);
        // Large steps are as many as their probability says, and weigh as much.
        let members = members.filter(|(a, _)| a.layer == layer || a.independent == Some(layer));
        members.fold(Half::default(), |half, (a, start)| Half {
            scale: (half.scale).max(density(a) / f64::from(a.iterations.max(1))),
            part: start.half(),
        })
    };
    SplatFilm::judged(filter, most, (0..layers).map(half).collect())
}

/// Looks at the error, tells the observer, and says whether the target is reached.
fn good_enough(run: &Run, film: &SplatFilm, chains: &Chains, beside: Option<&Sampling>) -> bool {
    let mut light = Light::of(run, film.layers(), chains);
    if let Some(beside) = beside {
        light.beside = mean(&beside.picture());
    }
    let error = relmse_of(run, film, &light, beside).sqrt();
    run.observer.error(error);
    let reached = run
        .settings
        .target_error
        .is_some_and(|target| error <= target);
    let tiling = Tiling::new(run.film.crop);
    let agree = || {
        let sums = beside.map(|b| (b, b.tile_sums()));
        let layer = sums.as_ref().map(|(beside, sums)| beside.layer(sums));
        mixing_check::agree(&tiling, (chains, &light), layer)
    };
    reached
        && agree()
        && (chances(run, chains, beside, light.of_chains() + light.beside).iter())
            .all(ChanceStats::is_known)
}
