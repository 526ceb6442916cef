//! What robustness costs: variants with a switch on ([`crate::switches`]) beside those that differ in nothing else.

use super::fit::Estimate;
use super::plan::{Label, Turn, Variant, names};
use super::run::{Options, Run, Subject};
use serde::Serialize;

/// Name of the label of a variant's switches.
pub const SWITCH: &str = "switch";

/// A variant with a switch, over the one without. Runs of both are paired by budget and seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SwitchFigures {
    /// Index of the variant, and of the one without the switch.
    pub variant: usize,
    pub robust: usize,
    pub name: String,
    /// Mutations or samples a second, over those of the robust variant, at the larger half of the budgets: above 1, what robustness costs.
    pub throughput: Option<Estimate>,
    /// Error times work, over that of the robust variant, at the largest budget: above 1, what robustness saves.
    pub error: Option<Estimate>,
    /// Brightness of the picture over that of the robust one, less 1, at the largest budget.
    pub brightness: Option<Estimate>,
    /// Mean over all values of the difference of both mean pictures, over the robust one: bias, and what noise the seeds leave.
    pub difference: Option<f64>,
}

/// Pictures of the largest budget, summed over seeds; empty if no variant has a switch.
#[derive(Default)]
pub(super) struct Pictures {
    /// By variant.
    sums: Vec<Vec<[f64; 3]>>,
    brightness: Vec<Brightness>,
}

struct Brightness {
    variant: usize,
    round: u64,
    mean: f64,
}

impl Pictures {
    pub fn of(variants: &[Variant]) -> Self {
        let any = variants.iter().any(|v| !v.settings.switches.is_none());
        Self {
            sums: vec![Vec::new(); if any { variants.len() } else { 0 }],
            brightness: Vec::new(),
        }
    }

    pub fn add(&mut self, turn: &Turn, options: &Options, pixels: &[[f32; 3]]) {
        let Some(sums) = self.sums.get_mut(turn.variant) else {
            return;
        };
        if turn.budget + 1 != options.budgets.count {
            return;
        }
        sums.resize(pixels.len(), [0.0; 3]);
        let mut whole = 0.0;
        for (sum, pixel) in sums.iter_mut().zip(pixels) {
            for (sum, v) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(*v);
                whole += f64::from(*v);
            }
        }
        self.brightness.push(Brightness {
            variant: turn.variant,
            round: turn.round,
            mean: whole / (3 * pixels.len()).max(1) as f64,
        });
    }

    fn of_variant(&self, variant: usize) -> impl Iterator<Item = &Brightness> {
        self.brightness.iter().filter(move |b| b.variant == variant)
    }

    fn brightness(&self, variant: usize, robust: usize) -> Option<Estimate> {
        let relative = |b: &Brightness| {
            let other = self.of_variant(robust).find(|o| o.round == b.round)?;
            let difference = b.mean / other.mean - 1.0;
            difference.is_finite().then_some(difference)
        };
        mean(self.of_variant(variant).filter_map(relative).collect())
    }

    fn difference(&self, variant: usize, robust: usize) -> Option<f64> {
        let mean = |variant: usize| {
            let n = self.of_variant(variant).count() as f64;
            let sums = self.sums.get(variant)?;
            let all: Vec<f64> = sums.as_flattened().iter().map(|s| s / n).collect();
            (!all.is_empty()).then_some(all)
        };
        let (own, other) = (mean(variant)?, mean(robust)?);
        // A hundredth of the mean stands below black: a relative difference from nothing says nothing.
        let least = 0.01 * other.iter().sum::<f64>() / other.len() as f64;
        let differences = own.iter().zip(&other);
        let sum: f64 = differences
            .map(|(a, b)| (a - b).abs() / (b + least).max(f64::MIN_POSITIVE))
            .sum();
        let difference = sum / own.len() as f64;
        difference.is_finite().then_some(difference)
    }
}

/// The figures of a scene's variants that have a switch.
pub(super) fn figures(
    subject: &Subject,
    options: &Options,
    runs: &[Run],
    pictures: &Pictures,
) -> Vec<SwitchFigures> {
    let names = names(&subject.variants);
    let last = options.budgets.count.saturating_sub(1);
    let large = options.budgets.count / 2;
    let switched = subject.variants.iter().enumerate();
    let switched = switched.filter(|(_, v)| !v.settings.switches.is_none());
    let figures = switched.filter_map(|(variant, v)| {
        let robust = partner(&subject.variants, v)?;
        Some(SwitchFigures {
            variant,
            robust,
            name: names[variant].clone(),
            throughput: ratio(runs, variant, robust, large, |r| {
                r.effort as f64 / r.render_seconds
            }),
            error: ratio(runs, variant, robust, last, |r| {
                r.relmse_corrected * r.effort as f64
            }),
            brightness: pictures.brightness(variant, robust),
            difference: pictures.difference(variant, robust),
        })
    });
    figures.collect()
}

/// The variant with the same labels and no switch.
fn partner(variants: &[Variant], variant: &Variant) -> Option<usize> {
    let others = |v: &Variant| -> Vec<Label> {
        let labels = v.labels.iter().filter(|l| l.name != SWITCH);
        labels.cloned().collect()
    };
    let wanted = others(variant);
    (variants.iter()).position(|v| v.settings.switches.is_none() && others(v) == wanted)
}

/// Geometric mean of the ratios of a value over pairs of runs, from a budget on.
fn ratio(
    runs: &[Run],
    variant: usize,
    robust: usize,
    from: usize,
    value: impl Fn(&Run) -> f64,
) -> Option<Estimate> {
    let own = (runs.iter()).filter(|r| r.variant == variant && r.budget >= from);
    let logs = own.filter_map(|run| {
        let same = |r: &&Run| (r.variant, r.budget, r.seed) == (robust, run.budget, run.seed);
        let other = runs.iter().find(same)?;
        // Errors less the reference's may be negative, and have no logarithm.
        let log = value(run).log10() - value(other).log10();
        log.is_finite().then_some(log)
    });
    Some(mean(logs.collect())?.exp10())
}

fn mean(values: Vec<f64>) -> Option<Estimate> {
    (!values.is_empty()).then(|| Estimate::mean(&values))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run that takes so long for 8 mutations a pixel.
    fn run(variant: usize, budget: usize, seed: u64, seconds: f64, error: f64) -> Run {
        Run {
            variant,
            budget,
            seed,
            effort: 8,
            seconds,
            build_seconds: 0.0,
            bootstrap_seconds: 0.0,
            render_seconds: seconds,
            mutations: 0,
            samples: 0,
            rays: 0,
            relmse: error,
            relmse_corrected: error,
            within_reference_error: false,
        }
    }

    #[test]
    fn switches_are_paired_by_budget_and_seed() {
        // A machine that is ten times slower for the second seed; the third has no partner.
        let runs = [
            run(0, 0, 1, 1.0, 0.1),
            run(0, 1, 1, 2.0, 0.1),
            run(1, 1, 1, 1.0, 0.2),
            run(1, 1, 2, 10.0, 0.1),
            run(0, 1, 2, 20.0, 0.05),
            run(1, 1, 3, 1e6, 1.0),
            run(1, 0, 1, 1e-6, 1.0),
        ];
        let throughput = |r: &Run| r.effort as f64 / r.render_seconds;
        let paired = ratio(&runs, 1, 0, 1, throughput).unwrap();
        assert!((paired.value - 2.0).abs() < 1e-9);
        assert!(paired.stderr.unwrap() < 1e-9);
        let error = ratio(&runs, 1, 0, 1, |r| r.relmse_corrected).unwrap();
        assert!((error.value - 2.0).abs() < 1e-9);
        assert!(ratio(&runs, 1, 0, 1, |_| -1.0).is_none());
        assert!(ratio(&runs, 1, 0, 1, |_| 0.0).is_none());
        assert!(ratio(&runs, 2, 0, 0, throughput).is_none());
    }

    #[test]
    fn pictures_of_switches_are_compared_at_equal_seeds() {
        let of = |variant: usize, round: u64, mean: f64| Brightness {
            variant,
            round,
            mean,
        };
        let pictures = Pictures {
            sums: vec![vec![[2.0; 3]; 4], vec![[2.0, 2.0, 2.2]; 4]],
            brightness: vec![of(0, 0, 0.5), of(1, 0, 0.55), of(1, 1, 1.65), of(0, 1, 1.5)],
        };
        let brightness = pictures.brightness(1, 0).unwrap();
        assert!((brightness.value - 0.1).abs() < 1e-9);
        assert!(brightness.stderr.unwrap() < 1e-9);
        let difference = pictures.difference(1, 0).unwrap();
        assert!((difference - 0.1 / 1.01 / 3.0).abs() < 1e-9);
        assert_eq!(pictures.difference(2, 0), None);
        assert_eq!(Pictures::default().brightness(1, 0), None);
    }
}
