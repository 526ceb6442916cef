//! What a scene's figures say, in a sentence: who reaches an error first, and by how much.

use super::cells::{number, power};
use crate::converge::figures::{SceneFigures, TARGETS, VariantFigures};

/// `To 10 % of error (relMSE 1e-2): bdpt 1.0 s, mmlt 1.5 s; bdpt is 1.5 times as fast as mmlt`, of
/// the strictest target that two variants reach within their runs, or else of the first that one
/// reaches. `None` if none does.
pub fn of(figures: &SceneFigures) -> Option<String> {
    let reached = |target: usize| -> Vec<(f64, &VariantFigures)> {
        let times = figures.variants.iter().filter_map(|variant| {
            let target = variant.targets.get(target).filter(|t| !t.extrapolated)?;
            Some((target.seconds.as_ref()?.value, variant))
        });
        let mut times: Vec<_> = times.collect();
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        times
    };
    let strictest = (0..TARGETS.len()).rev();
    let target = (strictest.clone().find(|&t| reached(t).len() > 1))
        .or_else(|| (0..TARGETS.len()).find(|&t| !reached(t).is_empty()))?;
    let times = reached(target);
    let percent = number(100.0 * TARGETS[target].sqrt());
    let list: Vec<String> = (times.iter())
        .map(|(seconds, variant)| format!("{} {} s", variant.name, number(*seconds)))
        .collect();
    let relmse = power(TARGETS[target]);
    let mut line = format!(
        "To {percent} % of error (relMSE {relmse}): {}",
        list.join(", ")
    );
    if let [(first, fastest), .., (last, slowest)] = times[..] {
        let times = number(last / first);
        line += &format!(
            "; {} is {times} times as fast as {}",
            fastest.name, slowest.name
        );
    }
    Some(line + ".")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::converge::figures::TargetFigures;
    use crate::converge::fit::Estimate;
    use crate::converge::plan::Cost;
    use crate::converge::reference::ReferenceFigures;

    fn figures(variants: &[(&str, [Option<f64>; 3])]) -> SceneFigures {
        let variant = |(name, times): &(&str, [Option<f64>; 3])| VariantFigures {
            name: (*name).into(),
            labels: Vec::new(),
            effort_unit: "samples",
            cost: Cost::default(),
            budgets: Vec::new(),
            line: None,
            slope: None,
            targets: (TARGETS.into_iter().zip(times))
                .map(|(relmse, time)| TargetFigures {
                    relmse,
                    seconds: time.map(|value| Estimate {
                        value,
                        stderr: None,
                    }),
                    extrapolated: false,
                })
                .collect(),
            efficiency: None,
            gain: None,
        };
        SceneFigures {
            scene: "a".into(),
            width: 1,
            height: 1,
            reference: ReferenceFigures::default(),
            variants: variants.iter().map(variant).collect(),
        }
    }

    #[test]
    fn the_strictest_error_that_two_reach_is_told() {
        let slow = ("pt", [Some(1.0), Some(8.0), None]);
        let fast = ("bdpt", [Some(0.5), Some(2.0), Some(20.0)]);
        assert_eq!(
            of(&figures(&[slow, fast])).unwrap(),
            "To 10.0 % of error (relMSE 1e-2): bdpt 2.00 s, pt 8.00 s; bdpt is 4.00 times as fast as pt."
        );
        assert_eq!(
            of(&figures(&[("pt", [Some(3.0), None, None])])).unwrap(),
            "To 31.6 % of error (relMSE 1e-1): pt 3.00 s."
        );
        assert_eq!(of(&figures(&[("pt", [None; 3])])), None);
    }
}
