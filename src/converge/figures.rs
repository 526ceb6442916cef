//! What is said of a variant: errors by budget, the line through them, and the times and
//! efficiencies that follow.

use super::fit::{Estimate, Line};
use super::plan::{Cost, Label, effort_unit, names};
use super::reference::ReferenceFigures;
use super::subject::{Options, Run, Subject};
use serde::Serialize;

/// Errors that times are given for.
pub const TARGETS: [f64; 3] = [1e-1, 1e-2, 1e-3];

/// Names and units are those of the JSON that `phalanx converge` writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SceneFigures {
    pub scene: String,
    pub width: u32,
    pub height: u32,
    pub reference: ReferenceFigures,
    pub variants: Vec<VariantFigures>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VariantFigures {
    pub name: String,
    pub labels: Vec<Label>,
    /// What the unit of efforts is.
    pub effort_unit: &'static str,
    /// What the trial run found; zeros if there was none.
    pub cost: Cost,
    /// Budgets that have runs.
    pub budgets: Vec<BudgetFigures>,
    /// Error over seconds of rendering, without the start; through the means of those budgets that
    /// the reference is good enough for.
    pub line: Option<Line>,
    pub slope: Option<Estimate>,
    pub targets: Vec<TargetFigures>,
    /// `1 / (relmse * seconds)` at the largest budget the reference is good enough for.
    pub efficiency: Option<Estimate>,
    /// `efficiency` over that of the first variant.
    pub gain: Option<Estimate>,
}

/// Means over seeds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BudgetFigures {
    /// Seconds or effort, as planned.
    pub budget: f64,
    pub effort: u64,
    pub runs: usize,
    pub seconds: Estimate,
    pub relmse: Estimate,
    pub relmse_corrected: Estimate,
    /// The reference's own error is the larger part of `relmse`.
    pub within_reference_error: bool,
    /// Those of `runs` that came with a warning.
    pub warned: usize,
}

impl BudgetFigures {
    /// A line may go through it.
    fn is_clear(&self) -> bool {
        !self.within_reference_error && self.relmse_corrected.value > 0.0
    }
}

/// Time to an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TargetFigures {
    pub relmse: f64,
    /// Start, and render time along the line; `None` if there is none, or it does not fall.
    pub seconds: Option<Estimate>,
    /// Outside the times that the line was fitted to.
    pub extrapolated: bool,
}

/// The figures of a scene from its runs.
pub fn scene_figures(
    subject: &Subject,
    options: &Options,
    costs: &[Cost],
    reference: &ReferenceFigures,
    runs: &[Run],
) -> SceneFigures {
    let names = names(&subject.variants);
    let mut variants: Vec<VariantFigures> = (subject.variants.iter().enumerate())
        .map(|(i, variant)| {
            let own: Vec<&Run> = runs.iter().filter(|r| r.variant == i).collect();
            let budget = |i| options.budgets.get(i);
            let statistics = statistics(&own, reference, budget, options.budgets.count);
            VariantFigures {
                name: names[i].clone(),
                labels: variant.labels.clone(),
                effort_unit: effort_unit(variant.settings.integrator),
                cost: costs.get(i).copied().unwrap_or_default(),
                budgets: statistics.budgets,
                line: statistics.line,
                slope: statistics.slope,
                targets: statistics.targets,
                efficiency: statistics.efficiency,
                gain: None,
            }
        })
        .collect();
    let first = variants.first().and_then(|v| v.efficiency);
    for variant in variants.iter_mut().skip(1) {
        variant.gain = variant
            .efficiency
            .zip(first)
            .map(|(own, first)| own.ratio(first));
    }
    let [x0, x1, y0, y1] = subject.scene.film.crop;
    SceneFigures {
        scene: subject.name.clone(),
        width: x1 - x0,
        height: y1 - y0,
        reference: reference.clone(),
        variants,
    }
}

struct Statistics {
    budgets: Vec<BudgetFigures>,
    line: Option<Line>,
    slope: Option<Estimate>,
    targets: Vec<TargetFigures>,
    efficiency: Option<Estimate>,
}

/// Over the seeds of a budget.
struct Means {
    start: f64,
    seconds: f64,
    error: f64,
}

/// Of one variant's runs. Errors are means over seeds before they are logarithms: single runs may
/// be negative, and a mean of logarithms is not the logarithm of the mean. Lines go through errors
/// over the time after the start (tree and bootstrap), which is what a longer render has more of;
/// times to an error have the start added again.
fn statistics(
    runs: &[&Run],
    reference: &ReferenceFigures,
    budget: impl Fn(usize) -> f64,
    count: usize,
) -> Statistics {
    let at = |i: usize| runs.iter().filter(move |r| r.budget == i);
    let (budgets, clear) = by_budget(runs, reference, budget, count);
    let mut seeds: Vec<u64> = runs.iter().map(|r| r.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    // Mean start, whole time and error at a budget, without one seed.
    let mean = |i: usize, out: Option<u64>| {
        let kept: Vec<&&Run> = at(i).filter(|r| Some(r.seed) != out).collect();
        let of =
            |value: fn(&Run) -> f64| kept.iter().map(|r| value(r)).sum::<f64>() / kept.len() as f64;
        let point = Means {
            start: of(Run::start_seconds),
            seconds: of(|r| r.seconds),
            error: of(|r| r.relmse_corrected),
        };
        (!kept.is_empty() && point.error > 0.0).then_some(point)
    };
    let points =
        |out: Option<u64>| -> Vec<Means> { clear.iter().filter_map(|c| mean(c.0, out)).collect() };
    let line = |points: &[Means]| {
        let logs = points.iter().map(|p| (p.seconds - p.start, p.error));
        Line::fit(&logs.collect::<Vec<_>>())
    };
    let reach = |relmse: f64, out: Option<u64>| {
        let points = points(out);
        let start = points.iter().map(|p| p.start).sum::<f64>() / points.len() as f64;
        Some((start + line(&points)?.reach(relmse)?).log10())
    };
    let times = || clear.iter().map(|c| c.1);
    let (least, most) = (
        times().fold(f64::INFINITY, f64::min),
        times().fold(0.0, f64::max),
    );
    let target = |relmse: f64| {
        let seconds = Estimate::jackknife(&seeds, |out| reach(relmse, out));
        let seconds = seconds.map(Estimate::exp10);
        TargetFigures {
            relmse,
            seconds,
            extrapolated: seconds.is_some_and(|s| !(least..=most).contains(&s.value)),
        }
    };
    let efficiency = |out: Option<u64>| {
        let p = mean(clear.last()?.0, out)?;
        let efficiency = -(p.seconds * p.error).log10();
        efficiency.is_finite().then_some(efficiency)
    };
    Statistics {
        line: line(&points(None)),
        slope: Estimate::jackknife(&seeds, |out| Some(line(&points(out))?.slope)),
        targets: TARGETS.map(target).into(),
        efficiency: Estimate::jackknife(&seeds, efficiency).map(Estimate::exp10),
        budgets,
    }
}

/// Figures of every budget that has runs; and where the error is clear, the index and mean time.
fn by_budget(
    runs: &[&Run],
    reference: &ReferenceFigures,
    budget: impl Fn(usize) -> f64,
    count: usize,
) -> (Vec<BudgetFigures>, Vec<(usize, f64)>) {
    let at = |i: usize| runs.iter().filter(move |r| r.budget == i);
    let mut budgets = Vec::new();
    let mut clear = Vec::new();
    for i in 0..count {
        let Some(first) = at(i).next() else {
            continue;
        };
        let of =
            |value: fn(&Run) -> f64| Estimate::mean(&at(i).map(|r| value(r)).collect::<Vec<f64>>());
        let corrected = of(|r| r.relmse_corrected);
        let figures = BudgetFigures {
            budget: budget(i),
            effort: first.effort,
            runs: at(i).count(),
            seconds: of(|r| r.seconds),
            relmse: of(|r| r.relmse),
            relmse_corrected: corrected,
            within_reference_error: reference.drowns(corrected.value),
            warned: at(i).filter(|r| !r.warnings.is_empty()).count(),
        };
        if figures.is_clear() {
            clear.push((i, figures.seconds.value));
        }
        budgets.push(figures);
    }
    (budgets, clear)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs whose corrected error is `0.04 / seconds * scatter[seed]`, from 1 to 8 seconds.
    fn runs(scatter: &[f64], reference: f64) -> Vec<Run> {
        let run = |budget: usize, seed: usize| {
            let seconds = 2f64.powi(budget as i32);
            let corrected = 0.04 / seconds * scatter[seed];
            Run {
                variant: 0,
                budget,
                seed: seed as u64,
                effort: 1 << budget,
                seconds,
                build_seconds: 0.0,
                bootstrap_seconds: 0.0,
                render_seconds: seconds,
                mutations: 0,
                samples: 0,
                rays: 0,
                relmse: corrected + reference,
                relmse_corrected: corrected,
                within_reference_error: corrected <= reference,
                warnings: vec!["stuck".into(); usize::from(budget == 1 && seed == 0)],
            }
        };
        let seeds = 0..scatter.len();
        (0..4)
            .flat_map(|budget| seeds.clone().map(move |seed| run(budget, seed)))
            .collect()
    }

    fn figures(runs: &[Run], reference: f64) -> Statistics {
        let reference = ReferenceFigures {
            relmse: Some(reference),
            ..ReferenceFigures::default()
        };
        let runs: Vec<&Run> = runs.iter().collect();
        statistics(&runs, &reference, |i| 2f64.powi(i as i32), 4)
    }

    #[test]
    fn times_inside_and_outside_what_was_measured() {
        let s = figures(&runs(&[0.9, 1.0, 1.1], 0.0), 0.0);
        assert!((s.slope.unwrap().value + 1.0).abs() < 1e-9);
        let times: Vec<f64> = s.targets.iter().map(|t| t.seconds.unwrap().value).collect();
        for (time, expected) in times.iter().zip([0.4, 4.0, 40.0]) {
            assert!((time / expected - 1.0).abs() < 1e-9, "{times:?}");
        }
        let extrapolated: Vec<bool> = s.targets.iter().map(|t| t.extrapolated).collect();
        assert_eq!(extrapolated, [true, false, true]);
        let efficiency = s.efficiency.unwrap();
        assert!((efficiency.value - 25.0).abs() < 1e-9);
        // Errors that scatter by 10 % leave 5.8 % for the mean of three.
        let relative = efficiency.relative().unwrap();
        assert!((0.05..0.07).contains(&relative), "{relative}");
    }

    #[test]
    fn the_start_bends_no_line() {
        let mut all = runs(&[1.0, 1.0], 0.0);
        for run in &mut all {
            run.bootstrap_seconds = 2.0;
            run.seconds += 2.0;
        }
        let s = figures(&all, 0.0);
        assert!((s.slope.unwrap().value + 1.0).abs() < 1e-9);
        let time = |i: usize| s.targets[i].seconds.unwrap().value;
        assert!((time(0) - 2.4).abs() < 1e-9 && (time(1) - 6.0).abs() < 1e-9);
    }

    #[test]
    fn what_the_reference_cannot_tell_is_left_out() {
        // Errors 0.04, 0.02, 0.01, 0.005: the last is within 0.006.
        let s = figures(&runs(&[1.0, 1.0], 0.006), 0.006);
        let warned: Vec<usize> = s.budgets.iter().map(|b| b.warned).collect();
        assert_eq!(warned, [0, 1, 0, 0]);
        let marks: Vec<bool> = s.budgets.iter().map(|b| b.within_reference_error).collect();
        assert_eq!(marks, [false, false, false, true]);
        assert!((s.line.unwrap().slope + 1.0).abs() < 1e-9);
        // Nothing is left of a worse reference.
        let s = figures(&runs(&[1.0, 1.0], 0.03), 0.03);
        assert_eq!((s.line, s.slope, s.targets[1].seconds), (None, None, None));
        assert!(s.efficiency.is_some());
        assert!(figures(&runs(&[1.0], 1.0), 1.0).efficiency.is_none());
    }

    #[test]
    fn one_seed_has_no_error_and_no_run_no_figures() {
        let s = figures(&runs(&[1.0], 0.0), 0.0);
        assert_eq!(s.slope.unwrap().stderr, None);
        assert_eq!(s.targets[1].seconds.unwrap().stderr, None);
        let s = figures(&[], 0.0);
        assert!(s.budgets.is_empty() && s.line.is_none() && s.efficiency.is_none());
    }

    #[test]
    fn negative_errors_draw_no_line() {
        let mut all = runs(&[1.0, 1.0], 0.0);
        for run in &mut all {
            run.relmse_corrected *= -1.0;
        }
        let s = figures(&all, 0.0);
        assert!(s.line.is_none() && s.targets.iter().all(|t| t.seconds.is_none()));
    }
}
