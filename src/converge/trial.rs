//! What variants cost on this machine, by trial.

use super::plan::{BudgetUnit, Cost, names, with_effort};
use super::subject::{Options, Subject};
use super::watch::{StudyStep, Watch, whole};
use crate::integrate::{RenderError, Settings};
use crate::scene::Scene;

/// Longest trial run; the shortest is the first budget, if it is less.
const TRIAL_SECONDS: f64 = 0.5;
/// Trial runs of full length. The fastest counts: what else a machine does makes runs slower, never
/// faster.
const TRIALS: u32 = 3;

/// What each variant of a scene costs; nothing is tried where budgets are efforts. `None`: stopped.
pub(super) fn costs(
    scene: usize,
    subject: &Subject,
    options: &Options,
    watch: &dyn Watch,
) -> Result<Option<Vec<Cost>>, RenderError> {
    let mut costs = Vec::new();
    for (variant, v) in subject.variants.iter().enumerate() {
        watch.begins(StudyStep::Trial { scene, variant });
        match trial(&subject.scene, &v.settings, options, watch)? {
            Some(cost) => costs.push(cost),
            None => return Ok(None),
        }
    }
    Ok(Some(costs))
}

/// Renders with growing effort until a clock can measure it.
pub(super) fn trial(
    scene: &Scene,
    settings: &Settings,
    options: &Options,
    watch: &dyn Watch,
) -> Result<Option<Cost>, RenderError> {
    if options.budgets.unit == BudgetUnit::Effort {
        return Ok(Some(Cost::default()));
    }
    let enough = options.budgets.first.min(TRIAL_SECONDS);
    let mut effort = 1;
    let mut best = Cost {
        start_seconds: f64::INFINITY,
        seconds_per_effort: f64::INFINITY,
    };
    let mut long_enough = 0;
    while long_enough < TRIALS {
        let Some(done) = whole(scene, &with_effort(settings, effort), watch)? else {
            return Ok(None);
        };
        let rendering = done.stats.render_seconds.max(1e-6);
        let start = done.stats.build_seconds + done.stats.bootstrap_seconds;
        best.start_seconds = best.start_seconds.min(start);
        // A picture of nothing takes no time however often it is asked for.
        if rendering < enough && effort < 1 << 20 && long_enough == 0 {
            let growth = (1.2 * enough / rendering).clamp(2.0, 16.0);
            effort = (effort as f64 * growth).ceil() as u64;
            continue;
        }
        best.seconds_per_effort = best.seconds_per_effort.min(rendering / effort as f64);
        long_enough += 1;
    }
    Ok(Some(best))
}

/// Says which budgets are left out, and why.
pub(super) fn slow_starts(
    subject: &Subject,
    options: &Options,
    costs: &[Cost],
    warnings: &mut Vec<String>,
) {
    let names = names(&subject.variants);
    let budgets = &options.budgets;
    for (name, cost) in names.iter().zip(costs) {
        let left_out = (0..budgets.count)
            .filter(|i| budgets.is_too_small(*i, cost))
            .count();
        if left_out > 0 {
            let s = if left_out == 1 { "" } else { "s" };
            warnings.push(format!(
                "{}: {name} takes {:.2} s at least, and leaves out the first budget{s} of {}",
                subject.name,
                cost.seconds(1),
                (0..left_out)
                    .map(|i| format!("{} s", budgets.get(i)))
                    .collect::<Vec<_>>()
                    .join(", "),
            ));
        }
    }
}
