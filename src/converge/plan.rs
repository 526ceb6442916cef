//! What runs: variants, budgets, and in which order.

use crate::integrate::Settings;
use crate::scene::IntegratorKind;
use serde::Serialize;

/// One value of one axis, as tables and files call it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Label {
    /// Of the axis.
    pub name: &'static str,
    pub value: String,
}

/// One combination of an integrator and settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// The integrator first, then one for each axis that means something to it.
    pub labels: Vec<Label>,
    pub settings: Settings,
}

impl Variant {
    pub fn label(&self, name: &str) -> Option<&str> {
        let label = self.labels.iter().find(|l| l.name == name);
        label.map(|l| l.value.as_str())
    }
}

/// Name of the label that every variant has.
pub const INTEGRATOR: &str = "integrator";

/// A setting that is swept.
pub struct Axis {
    pub name: &'static str,
    /// Which integrators it means something to; the others get no variants of it.
    pub applies: fn(IntegratorKind) -> bool,
    pub values: Vec<Choice>,
}

/// One value of an axis.
pub struct Choice {
    pub text: String,
    pub set: Box<dyn Fn(&mut Settings)>,
}

impl Axis {
    /// `values` in the order given, each once.
    pub fn new<T: Copy + 'static>(
        name: &'static str,
        applies: fn(IntegratorKind) -> bool,
        values: &[T],
        text: impl Fn(T) -> String,
        set: fn(&mut Settings, T),
    ) -> Self {
        let mut choices: Vec<Choice> = Vec::new();
        for &value in values {
            let text = text(value);
            if choices.iter().all(|c| c.text != text) {
                let set = Box::new(move |s: &mut Settings| set(s, value));
                choices.push(Choice { text, set });
            }
        }
        Self {
            name,
            applies,
            values: choices,
        }
    }
}

/// What the effort of an integrator counts, per pixel.
pub fn effort_unit(kind: IntegratorKind) -> &'static str {
    match kind.mutates() {
        true => "mutations/pixel",
        false => "samples/pixel",
    }
}

/// Most mutations or samples per pixel: what the path tracer can count.
pub const MAX_EFFORT: u64 = u32::MAX as u64;

/// `settings` with so many mutations or samples per pixel, and no other end.
pub fn with_effort(settings: &Settings, effort: u64) -> Settings {
    let mut settings = settings.clone();
    settings.time = None;
    let effort = effort.clamp(1, MAX_EFFORT);
    match settings.integrator.mutates() {
        true => settings.mutations_per_pixel = effort,
        false => settings.samples_per_pixel = effort,
    }
    settings
}

/// Every combination of an integrator and the axes that mean something to it; the last axis changes
/// fastest.
pub fn variants(base: &Settings, kinds: &[IntegratorKind], axes: &[Axis]) -> Vec<Variant> {
    let mut all: Vec<Variant> = Vec::new();
    for &kind in kinds {
        let label = Label {
            name: INTEGRATOR,
            value: kind.name().into(),
        };
        let mut some = vec![Variant {
            labels: vec![label],
            settings: Settings {
                integrator: kind,
                ..base.clone()
            },
        }];
        for axis in axes.iter().filter(|a| (a.applies)(kind)) {
            if axis.values.is_empty() {
                continue;
            }
            let combine = |variant: &Variant| -> Vec<Variant> {
                let with = |choice: &Choice| {
                    let mut variant = variant.clone();
                    (choice.set)(&mut variant.settings);
                    variant.labels.push(Label {
                        name: axis.name,
                        value: choice.text.clone(),
                    });
                    variant
                };
                axis.values.iter().map(with).collect()
            };
            some = some.iter().flat_map(combine).collect();
        }
        all.extend(
            some.into_iter()
                .filter(|v| !all.contains(v))
                .collect::<Vec<_>>(),
        );
    }
    all
}

/// What variants are called beside each other: the integrator, and the labels in which variants of
/// one integrator differ.
pub fn names(variants: &[Variant]) -> Vec<String> {
    let differs = |variant: &Variant, label: &Label| {
        let kin = |v: &&Variant| v.label(INTEGRATOR) == variant.label(INTEGRATOR);
        (variants.iter().filter(kin)).any(|v| v.label(label.name) != Some(&label.value))
    };
    let name = |variant: &Variant| {
        let parts = variant.labels.iter().filter_map(|label| match label.name {
            INTEGRATOR => Some(label.value.clone()),
            _ if differs(variant, label) => Some(format!("{} {}", label.name, label.value)),
            _ => None,
        });
        parts.collect::<Vec<_>>().join(", ")
    };
    variants.iter().map(name).collect()
}

/// What every variant may spend: `first * 2^i` for `i` in `0..count`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Budgets {
    pub unit: BudgetUnit,
    pub first: f64,
    pub count: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum BudgetUnit {
    /// Wall-clock time of tree, bootstrap and render, by the cost that a trial run has found.
    Seconds,
    /// Mutations or samples per pixel, whatever time they take.
    Effort,
}

impl Budgets {
    pub fn get(&self, i: usize) -> f64 {
        self.first * (i as f64).exp2()
    }

    /// As messages say it.
    pub fn named(&self, i: usize) -> String {
        let amount = (self.get(i) * 1e6).round() / 1e6;
        match self.unit {
            BudgetUnit::Seconds => format!("{amount} s"),
            BudgetUnit::Effort => format!("{amount} a pixel"),
        }
    }

    /// The sum of all budgets.
    pub fn total(&self) -> f64 {
        (0..self.count).map(|i| self.get(i)).sum()
    }

    /// A variant with this cost cannot even start in budget `i`, and others are larger.
    pub fn is_too_small(&self, i: usize, cost: &Cost) -> bool {
        let least = cost.seconds(1);
        self.unit == BudgetUnit::Seconds && i + 1 < self.count && self.get(i) < least
    }

    /// The effort that `amount`, in the budgets' unit, buys.
    pub fn effort(&self, amount: f64, cost: &Cost) -> u64 {
        let effort = match self.unit {
            BudgetUnit::Seconds => (amount - cost.start_seconds) / cost.seconds_per_effort,
            BudgetUnit::Effort => amount,
        };
        // The conversion saturates, and takes NaN to 0.
        (effort.round() as u64).clamp(1, MAX_EFFORT)
    }
}

/// What a variant costs on this machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// Tree and bootstrap.
    pub start_seconds: f64,
    /// One mutation or sample of every pixel; 0 is unknown.
    pub seconds_per_effort: f64,
}

impl Cost {
    pub fn seconds(&self, effort: u64) -> f64 {
        self.start_seconds + self.seconds_per_effort * effort as f64
    }
}

/// A run to be done, by indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    pub budget: usize,
    /// Which of the seeds.
    pub round: u64,
    pub scene: usize,
    pub variant: usize,
}

/// All runs. Each round, of one seed, goes through all budgets, and in each the variants of a scene
/// take turns, another one first each time: a machine that becomes slower does so for all variants
/// and all budgets, and what is left of that is in the scatter over seeds. With all seeds of a
/// budget in a row it would be in the slopes, unseen.
pub fn order(budgets: usize, seeds: u64, variants: &[usize]) -> Vec<Turn> {
    let mut turns = Vec::new();
    for round in 0..seeds {
        for budget in 0..budgets {
            for (scene, &count) in variants.iter().enumerate() {
                let shift = (budget as u64 + round) as usize;
                turns.extend((0..count).map(|i| Turn {
                    budget,
                    round,
                    scene,
                    variant: (i + shift) % count,
                }));
            }
        }
    }
    turns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Width;

    fn base() -> Settings {
        let text = "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\nWorldEnd\n";
        let scene = crate::pbrt::load_str(text, "a.pbrt", "".as_ref()).unwrap();
        Settings::of(&scene)
    }

    fn axes() -> Vec<Axis> {
        let mmlt = |kind| kind == IntegratorKind::Mmlt;
        let lanes = |w: Width| w.lanes().to_string();
        vec![
            Axis::new(
                "lanes",
                |_| true,
                &[Width::One, Width::Eight],
                lanes,
                |s, v| s.lanes = v,
            ),
            Axis::new(
                "large step",
                mmlt,
                &[0.1, 0.3, 0.1],
                |p: f32| p.to_string(),
                |s, v| {
                    s.large_step_probability = v;
                },
            ),
            Axis::new(
                "sigma",
                mmlt,
                &[],
                |p: f32| p.to_string(),
                |s, v| s.sigma = v,
            ),
        ]
    }

    #[test]
    fn axes_multiply_only_what_they_mean_something_to() {
        let kinds = [IntegratorKind::Pt, IntegratorKind::Mmlt, IntegratorKind::Pt];
        let all = variants(&base(), &kinds, &axes());
        let expected = [
            "pt, lanes 1",
            "pt, lanes 8",
            "mmlt, lanes 1, large step 0.1",
            "mmlt, lanes 1, large step 0.3",
            "mmlt, lanes 8, large step 0.1",
            "mmlt, lanes 8, large step 0.3",
        ];
        assert_eq!(names(&all), expected);
        let last = &all[5].settings;
        assert_eq!(
            (last.lanes, last.large_step_probability),
            (Width::Eight, 0.3)
        );
        assert_eq!(all[0].settings.integrator, IntegratorKind::Pt);
        assert_eq!(all[5].label("large step"), Some("0.3"));
    }

    #[test]
    fn names_leave_out_what_is_the_same() {
        let one = [Axis::new(
            "lanes",
            |_| true,
            &[8],
            |v: i32| v.to_string(),
            |_, _| {},
        )];
        let kinds = [IntegratorKind::Pt, IntegratorKind::Mmlt];
        assert_eq!(names(&variants(&base(), &kinds, &one)), ["pt", "mmlt"]);
    }

    #[test]
    fn budgets_double_and_buy_effort() {
        let cost = Cost {
            start_seconds: 0.5,
            seconds_per_effort: 0.25,
        };
        let budgets = Budgets {
            unit: BudgetUnit::Seconds,
            first: 1.0,
            count: 4,
        };
        let efforts: Vec<u64> = (0..4)
            .map(|i| budgets.effort(budgets.get(i), &cost))
            .collect();
        assert_eq!(efforts, [2, 6, 14, 30]);
        for (i, effort) in efforts.iter().enumerate() {
            assert!((cost.seconds(*effort) - budgets.get(i)).abs() <= cost.seconds_per_effort);
        }
        assert_eq!(budgets.total(), 15.0);
        let slow = Cost {
            start_seconds: 100.0,
            ..cost
        };
        let too_small = |cost| {
            (0..4)
                .map(|i| budgets.is_too_small(i, cost))
                .collect::<Vec<_>>()
        };
        assert_eq!(too_small(&cost), [false; 4]);
        assert_eq!(too_small(&slow), [true, true, true, false]);
        // Less than the start takes, and costs that are nothing.
        assert_eq!(budgets.effort(0.1, &cost), 1);
        assert_eq!(budgets.effort(1.0, &Cost::default()), MAX_EFFORT);
        assert_eq!(budgets.effort(0.0, &Cost::default()), 1);
        let by_effort = Budgets {
            unit: BudgetUnit::Effort,
            ..budgets
        };
        assert_eq!(by_effort.effort(by_effort.get(3), &cost), 8);
    }

    #[test]
    fn every_run_has_its_turn_and_none_its_place() {
        let turns = order(3, 2, &[3, 1]);
        assert_eq!(turns.len(), 3 * 2 * 4);
        for (i, turn) in turns.iter().enumerate() {
            assert!(!turns[..i].contains(turn));
        }
        assert!(turns.is_sorted_by_key(|t| (t.round, t.budget)));
        let firsts: Vec<usize> = turns.chunks(4).map(|part| part[0].variant).collect();
        assert_eq!(firsts, [0, 1, 2, 1, 2, 0]);
    }
}
