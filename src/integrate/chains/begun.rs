//! What a render by chains has come to before its chains march.

use crate::chain::bootstrap::Bootstrap;
use crate::chain::counts::Counts;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::integrate::bootstraps::{Bootstraps, bootstraps};
use crate::integrate::method::Method;
use crate::integrate::schedule::{ChainBudget, Start, chain_budgets};
use crate::integrate::tuning::{self, Tuned};
use crate::integrate::{EndedBy, Phase, Run, black_reason};
use crate::simd::Lanes;
use std::time::Instant;

/// The bootstrap of a method, and what has become of it.
pub(in crate::integrate) struct Ready {
    /// None if nothing is known of the whole picture.
    pub bootstraps: Vec<Bootstrap>,
    pub counts: Counts,
    /// What has cut it short, and after which part of its paths.
    pub short: Option<EndedBy>,
    pub part: f64,
    pub start: Instant,
}

impl Ready {
    pub fn new(run: &Run, bootstraps: Bootstraps, start: Instant) -> Self {
        let mut counts = Counts::default();
        for b in &bootstraps.samplers {
            counts.rejected += b.rejected;
            counts.rays += b.rays;
        }
        let part = bootstraps.part(run.settings.bootstrap);
        let short = bootstraps.ended_by;
        let void = bootstraps.is_void();
        Self {
            bootstraps: if void {
                Vec::new()
            } else {
                bootstraps.samplers
            },
            counts,
            short,
            part,
            start,
        }
    }
}

/// What is told of bootstrap and tuning.
pub(super) struct Begun {
    /// Of the bootstrap and the tuning.
    pub counts: Counts,
    /// What has cut the bootstrap short, and after which part of its paths.
    pub short: Option<EndedBy>,
    part: f64,
    /// The same of the tuning.
    pub untuned: Option<EndedBy>,
    tuned: f64,
    pub bootstrap_seconds: f64,
    /// Seconds that an earlier process has had its chains march.
    pub render_seconds: f64,
}

impl Begun {
    /// Tunes chains that make `wanted` mutations in all, and finds their first states.
    pub fn new<L: Lanes>(
        run: &Run,
        method: &Method,
        ready: Ready,
        wanted: f64,
    ) -> (Self, Vec<ChainBudget>, Vec<Start>) {
        let Ready {
            bootstraps,
            mut counts,
            short,
            part,
            start,
        } = ready;
        let mut budgets = chain_budgets(run, method, &bootstraps, wanted);
        let tuned = tune::<L>(run, method, &mut budgets, &bootstraps, short);
        counts.rays += tuned.rays;
        let bootstrap_seconds = start.elapsed().as_secs_f64();
        let starts = (budgets.iter())
            .map(|a| Start::new(run, a, &bootstraps))
            .collect();
        let begun = Self {
            counts,
            short,
            part,
            untuned: tuned.ended_by,
            tuned: tuned.part,
            bootstrap_seconds,
            render_seconds: 0.0,
        };
        (begun, budgets, starts)
    }

    /// A stop has cut it short: a render that was not stopped would have gone on elsewhere.
    pub fn is_stopped(&self) -> bool {
        [self.short, self.untuned].contains(&Some(EndedBy::Observer))
    }

    /// What is worth a warning. `chains` says that there are any, `lit` that others bring light.
    pub fn warnings(&self, run: &Run, method: &Method, chains: bool, lit: bool) -> Vec<String> {
        let mut warnings: Vec<String> = (self.short.iter())
            .map(|by| cut_short(*by, self.part))
            .collect();
        if self.short.is_none() && !chains && !lit {
            warnings.push(dark_reason(run, method));
        }
        if self.tuned < 1.0 && chains {
            warnings.push(badly_tuned(self.tuned));
        }
        warnings
    }

    /// Writes it; chains have marched for so many seconds in all.
    pub fn save(&self, seconds: f64, to: &mut Writer) {
        let Self {
            counts,
            short,
            part,
            untuned,
            tuned,
            bootstrap_seconds,
            render_seconds: _,
        } = self;
        to.value(*counts);
        for by in [short, untuned] {
            to.option(*by, |to, by| to.flag(by == EndedBy::Time));
        }
        to.value([*part, *tuned, *bootstrap_seconds, seconds]);
    }

    /// Reads it. That of all shards but for their time, which adds up, is the same.
    pub fn load(from: &mut [Reader]) -> Result<Self, Malformed> {
        let mut all = from.iter_mut().map(Self::load_one);
        let first = all.next();
        let mut begun = first.ok_or_else(|| Malformed::new("there is no state"))??;
        for other in all {
            let other = other?;
            let same = other.counts == begun.counts && other.short == begun.short;
            Malformed::unless(same, "shards began otherwise")?;
            begun.bootstrap_seconds += other.bootstrap_seconds;
            begun.render_seconds += other.render_seconds;
        }
        Ok(begun)
    }

    fn load_one(from: &mut Reader) -> Result<Self, Malformed> {
        let counts = from.value()?;
        let by = |from: &mut Reader| {
            Ok(match from.flag()? {
                true => EndedBy::Time,
                false => EndedBy::Observer,
            })
        };
        let short = from.option(by)?;
        let untuned = from.option(by)?;
        let [part, tuned, bootstrap_seconds, render_seconds] = from.value()?;
        let right =
            (0.0..1e12).contains(&bootstrap_seconds) && (0.0..1e12).contains(&render_seconds);
        Malformed::unless(right, "a time is out of range")?;
        Ok(Self {
            counts,
            short,
            part,
            untuned,
            tuned,
            bootstrap_seconds,
            render_seconds,
        })
    }
}

fn badly_tuned(part: f64) -> String {
    format!(
        "stopped after {:.0} % of the mutations that tune others: sigma and the probability of large steps are less certain than usual",
        100.0 * part
    )
}

fn cut_short(by: EndedBy, part: f64) -> String {
    let by = match by {
        EndedBy::Time => "--time ended",
        _ => "stopped",
    };
    format!(
        "{by} the bootstrap after {:.2} % of its paths: the brightness of the picture is less certain than usual",
        100.0 * part
    )
}

/// Whether to go on to the chains that count: they need half of the time.
pub(in crate::integrate) fn ready(run: &Run) -> Option<EndedBy> {
    let limit = run.settings.time.map(|limit| limit / 2);
    let late = limit.is_some_and(|limit| run.start.elapsed() >= limit);
    if run.observer.stop() {
        Some(EndedBy::Observer)
    } else {
        late.then_some(EndedBy::Time)
    }
}

/// Tunes the chains, unless the bootstrap has been cut short by `short`.
fn tune<L: Lanes>(
    run: &Run,
    method: &Method,
    budgets: &mut [ChainBudget],
    bootstraps: &[Bootstrap],
    short: Option<EndedBy>,
) -> Tuned {
    let samplers = method.samplers.len();
    let before = run.settings.bootstrap * samplers as u64;
    let own = tuning::mutations(run, samplers);
    let progress = |part: f64| {
        let done = before + (own as f64 * part) as u64;
        (run.observer).progress(Phase::Bootstrap, done, before + own);
    };
    let ended = || short.or_else(|| ready(run));
    tuning::tune::<L>(run, budgets, bootstraps, &ended, progress)
}

fn dark_reason(run: &Run, method: &Method) -> String {
    if run.settings.bootstrap >= 100_000 || run.world.is_unlit() {
        return black_reason(run, "no bootstrap path");
    }
    let per_depth = if method.samplers.len() > 1 {
        " per depth"
    } else {
        ""
    };
    let paths = format!(
        "none of the {} bootstrap paths{per_depth}",
        run.settings.bootstrap
    );
    black_reason(run, &paths) + "; more bootstrap samples may find some"
}

pub(super) fn bootstrap<L: Lanes>(run: &Run, method: &Method) -> Bootstraps {
    let later = tuning::mutations(run, method.samplers.len());
    let progress = |done, total| (run.observer).progress(Phase::Bootstrap, done, total + later);
    bootstraps::<L>(
        run.world,
        &method.samplers,
        run.settings,
        &|| ready(run),
        progress,
    )
}
