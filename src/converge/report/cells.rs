//! Figures as people read them, the same in tables on a terminal and on a page.

use crate::converge::figures::{BudgetFigures, SceneFigures, TargetFigures, VariantFigures};
use crate::converge::fit::Estimate;

/// Behind a figure that lies outside what was measured.
pub const EXTRAPOLATED: &str = "*";
/// Behind an error that the reference cannot resolve.
const WITHIN_REFERENCE: &str = "†";
/// What is not known.
pub const NOTHING: &str = "-";

/// Three significant digits; as a power of ten where that is shorter.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 {
            "0".into()
        } else {
            NOTHING.into()
        };
    }
    // The exponent after rounding: 9.999 is 10.0.
    let scientific = format!("{value:.2e}");
    let exponent = scientific
        .split_once('e')
        .and_then(|(_, e)| e.parse::<i32>().ok());
    match exponent.unwrap_or(0) {
        e @ -2..=4 => format!("{value:.*}", (2 - e).max(0) as usize),
        _ => scientific,
    }
}

/// Effort, runs, time and errors of a budget; `clear` stands behind errors that the reference can
/// resolve.
pub fn of_budget(budget: &BudgetFigures, clear: &str) -> [String; 5] {
    let mark = match budget.within_reference_error {
        true => WITHIN_REFERENCE,
        false => clear,
    };
    [
        budget.effort.to_string(),
        budget.runs.to_string(),
        relative(&budget.seconds),
        relative(&budget.relmse),
        format!("{}{mark}", relative(&budget.relmse_corrected)),
    ]
}

/// `1e-2`, as targets are called.
pub fn power(value: f64) -> String {
    format!("{value:e}")
}

/// `2.31 ±4%`
pub fn relative(estimate: &Estimate) -> String {
    let value = number(estimate.value);
    match estimate.relative() {
        Some(e) if e < 9.995 => format!("{value} ±{}%", percent(e)),
        Some(_) => format!("{value} ±∞"),
        None => value,
    }
}

fn percent(fraction: f64) -> String {
    match 100.0 * fraction {
        p if p < 0.995 => format!("{p:.1}"),
        p => format!("{p:.0}"),
    }
}

pub fn optional(estimate: Option<&Estimate>) -> String {
    estimate.map_or(NOTHING.into(), relative)
}

/// `-1.02 ±0.03`
pub fn slope(variant: &VariantFigures) -> String {
    match variant.slope {
        Some(Estimate {
            value,
            stderr: Some(e),
        }) => format!("{value:.2} ±{e:.2}"),
        Some(Estimate { value, .. }) => format!("{value:.2}"),
        None => NOTHING.into(),
    }
}

/// `2.31 ±4% *`; the mark's place is kept, so that columns line up.
pub fn target(target: &TargetFigures) -> String {
    let mark = if target.extrapolated {
        EXTRAPOLATED
    } else {
        " "
    };
    match &target.seconds {
        Some(seconds) => format!("{} {mark}", relative(seconds)),
        None => format!("{NOTHING}  "),
    }
}

/// What the errors are measured against, a sentence.
pub fn reference(figures: &SceneFigures) -> String {
    let r = &figures.reference;
    let size = format!("{} x {} pixels", figures.width, figures.height);
    let made = match r.parts {
        0 => format!("reference {}", r.source),
        n => format!(
            "reference by {}, {} a pixel in {n} independent parts, {} s",
            r.source,
            r.effort,
            number(r.seconds)
        ),
    };
    let own = match (r.relmse, r.relmse_stderr) {
        (Some(own), Some(e)) => {
            format!(
                "its own relMSE is {} ± {}, and subtracted",
                number(own),
                number(e)
            )
        }
        (Some(own), None) => format!("its own relMSE is {}, and subtracted", number(own)),
        (None, _) => "its own error is unknown, and not subtracted".into(),
    };
    format!("{size}; {made}; {own}")
}

/// What the marks in a scene's tables mean, for those that are there.
pub fn notes(figures: &SceneFigures) -> Vec<String> {
    let mut notes = Vec::new();
    let variants = &figures.variants;
    if variants
        .iter()
        .flat_map(|v| &v.targets)
        .any(|t| t.extrapolated)
    {
        notes.push(format!(
            "{EXTRAPOLATED} extrapolated, beyond the times that were measured"
        ));
    }
    if variants
        .iter()
        .flat_map(|v| &v.budgets)
        .any(|b| b.within_reference_error)
    {
        notes.push(format!(
            "{WITHIN_REFERENCE} within the error of the reference, and left out of lines; a longer reference would tell more"
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        let pairs = [
            (0.0, "0"),
            (1.0, "1.00"),
            (9.999, "10.0"),
            (0.0123, "0.0123"),
            (0.00123, "1.23e-3"),
            (12345.0, "12345"),
            (123456.0, "1.23e5"),
            (-0.5, "-0.500"),
            (f64::NAN, "-"),
        ];
        for (value, text) in pairs {
            assert_eq!(number(value), text);
        }
        let with = |stderr| relative(&Estimate { value: 2.0, stderr });
        assert_eq!(with(Some(0.1)), "2.00 ±5%");
        assert_eq!(with(Some(0.01)), "2.00 ±0.5%");
        assert_eq!(with(Some(1e9)), "2.00 ±∞");
        assert_eq!(with(None), "2.00");
    }

    #[test]
    fn extrapolations_are_marked() {
        let of = |extrapolated| {
            target(&TargetFigures {
                relmse: 1e-2,
                seconds: Some(Estimate {
                    value: 3.0,
                    stderr: None,
                }),
                extrapolated,
            })
        };
        assert_eq!(
            (of(true).as_str(), of(false).as_str()),
            ("3.00 *", "3.00  ")
        );
    }
}
