//! The last line of a render: how good the picture is, and what a better one would take.

use std::time::Duration;

use clap::ValueEnum;

use super::args::values::Quality;
use super::units;
use crate::integrate::{EndedBy, MIXED, Render, Stats};

/// What is known of the picture's error, and what ended the render if something cut it short;
/// `None` if nothing is to be said.
pub fn verdict(render: &Render, target: Option<f64>) -> Option<String> {
    let end = match render.ended_by {
        EndedBy::Effort => None,
        EndedBy::Time => Some("ended by --time"),
        EndedBy::Target => Some("ended by --target-error"),
        EndedBy::Observer => Some("stopped"),
    };
    let error = render.stats.relative_error.map(|error| {
        let reached = render.ended_by == EndedBy::Target;
        quality(&render.stats, error, target.filter(|_| !reached))
    });
    let parts: Vec<String> = error.into_iter().chain(end.map(str::to_owned)).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// An error, and how much longer the next better one takes: the target that has been missed, or
/// the next that has a name.
fn quality(stats: &Stats, error: f64, missed: Option<f64>) -> String {
    let name = |error: f64| {
        let mut best = Quality::value_variants().iter().rev();
        let named = best.find(|quality| error <= quality.error());
        let value = named.and_then(Quality::to_possible_value);
        value.map_or(String::new(), |value| format!(" ({})", value.get_name()))
    };
    // What may be missing beside the error is no error of what is there.
    let missing = (stats.chance.iter().filter(|c| !c.is_known()))
        .map(|c| c.missing)
        .reduce(f64::max);
    let mut line = match missing {
        None => format!("relative error {}{}", units::percent(error), name(error)),
        Some(missing) => format!(
            "relative error at least {}: up to {:.0} % of all light may be missing",
            units::percent(error),
            100.0 * missing
        ),
    };
    let unmixed = stats.rhat.filter(|rhat| *rhat > MIXED && stats.apart);
    if let Some(rhat) = unmixed {
        line += &format!(", by chains that have not mixed (split R-hat {rhat:.2})");
    }
    let mut goals = Quality::value_variants().iter().map(|next| next.error());
    let goal = missed.or(goals.find(|next| error > *next));
    if missed.is_some() {
        line += "; the target is not reached";
    }
    let Some(goal) = goal.filter(|goal| error > *goal && unmixed.is_none() && missing.is_none())
    else {
        return line;
    };
    // The square of the error falls with the work.
    let times = (error / goal).powi(2);
    let taken = stats.bootstrap_seconds + stats.render_seconds;
    let Ok(time) = Duration::try_from_secs_f64(taken * times) else {
        return line;
    };
    let times = match times < 9.95 {
        true => format!("{times:.1}"),
        false => format!("{times:.0}"),
    };
    let (goal, name) = (units::digits(100.0 * goal, 3), name(goal));
    line + &format!(
        "; {goal} %{name} takes about {times} times as long, {}",
        units::time(time)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn says(error: f64, rhat: Option<f64>, target: Option<f64>, ended_by: EndedBy) -> String {
        let stats = Stats {
            relative_error: Some(error),
            rhat,
            apart: rhat.is_some(),
            render_seconds: 10.0,
            ..Stats::default()
        };
        let render = Render {
            stats,
            pixels: Vec::new(),
            width: 0,
            height: 0,
            offset: [0; 2],
            full: [0; 2],
            warnings: Vec::new(),
            deviation: None,
            strategies: Vec::new(),
            ended_by,
        };
        verdict(&render, target).unwrap()
    }

    #[test]
    fn a_better_picture_has_a_price() {
        let effort = |error| says(error, None, None, EndedBy::Effort);
        assert_eq!(
            effort(0.4),
            "relative error 40.0 %; 20 % (draft) takes about 4.0 times as long, 40.0 s"
        );
        assert_eq!(
            effort(0.1),
            "relative error 10.0 % (draft); 5 % (good) takes about 4.0 times as long, 40.0 s"
        );
        assert_eq!(effort(0.008), "relative error 0.80 % (final)");
    }

    #[test]
    fn targets_are_reached_or_not() {
        assert_eq!(
            says(0.04, None, Some(0.05), EndedBy::Target),
            "relative error 4.0 % (good); 1 % (final) takes about 16 times as long, 2 min 40 s; ended by --target-error"
        );
        assert_eq!(
            says(0.04, None, Some(0.02), EndedBy::Time),
            "relative error 4.0 % (good); the target is not reached; 2 % (good) takes about 4.0 times as long, 40.0 s; ended by --time"
        );
        assert_eq!(
            says(0.01, Some(1.5), Some(0.05), EndedBy::Time),
            "relative error 1.0 % (final), by chains that have not mixed (split R-hat 1.50); the target is not reached; ended by --time"
        );
    }
}
