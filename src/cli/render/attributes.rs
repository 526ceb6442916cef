//! What EXR files say about the render.

use crate::film::output::{Attribute, AttributeValue};
use crate::integrate::{Settings, Stats};
use crate::scene::IntegratorKind;

/// Figures that differ between equal renders: how long they took, and on what.
fn is_of_the_machine(figure: &str) -> bool {
    figure.ends_with("_seconds")
        || figure.ends_with("_per_second")
        || ["threads", "lanes", "peak_rss_bytes"].contains(&figure)
}

fn text(v: &str) -> AttributeValue {
    AttributeValue::Text(v.into())
}

/// With a name of our own, so that it is nobody else's.
fn own(name: &str, value: AttributeValue) -> Attribute {
    Attribute {
        name: format!("phalanx:{name}"),
        value,
    }
}

/// What an EXR file says about its making before it is made: scene and settings, by names that
/// begin with `phalanx:`; and the primaries of a film that has its own.
pub fn of_settings(
    scene: &str,
    settings: &Settings,
    primaries: Option<[f32; 8]>,
) -> Vec<Attribute> {
    let tuned = |auto: bool, v: f32| match auto {
        true => text("auto"),
        false => AttributeValue::Float(v.into()),
    };
    let integer = |v: u64| AttributeValue::Integer(i64::try_from(v).unwrap_or(i64::MAX));
    let mut list = vec![("scene", text(scene))];
    match settings.integrator.mutates() {
        true => list.extend([
            ("mutations_per_pixel", integer(settings.mutations_per_pixel)),
            ("chains", integer(settings.chains)),
            ("bootstrap", integer(settings.bootstrap)),
            (
                "large_step_probability",
                tuned(settings.tune.large_step, settings.large_step_probability),
            ),
            ("mutation", text(settings.mutation.name())),
            ("sigma", tuned(settings.tune.sigma, settings.sigma)),
        ]),
        false => {
            list.push(("samples_per_pixel", integer(settings.samples_per_pixel)));
        }
    }
    if matches!(
        settings.integrator,
        IntegratorKind::Auto | IntegratorKind::Mmlt
    ) {
        list.push(("strategy_choice", text(settings.strategy_choice.name())));
    }
    let mut list: Vec<Attribute> = (list.into_iter())
        .map(|(name, value)| own(name, value))
        .collect();
    list.push(Attribute {
        name: "software".into(),
        value: text(concat!("Phalanx ", env!("CARGO_PKG_VERSION"))),
    });
    list.extend(primaries.map(|c| Attribute {
        name: "chromaticities".into(),
        value: AttributeValue::Chromaticities(c),
    }));
    list
}

/// And afterwards: the figures of the render under the names they have in `--stats`, but for those
/// that differ between equal renders. Equal renders are equal files.
pub fn of_figures(stats: &Stats) -> Vec<Attribute> {
    let mut list = Vec::new();
    if let Ok(serde_json::Value::Object(figures)) = serde_json::to_value(stats) {
        let figures = figures
            .into_iter()
            .filter(|(name, _)| !is_of_the_machine(name));
        list.extend(figures.filter_map(|(name, value)| {
            let value = match &value {
                serde_json::Value::String(s) => text(s),
                // A seed may need all 64 bits.
                serde_json::Value::Number(n) => match (n.as_i64(), n.as_u64()) {
                    (Some(i), _) => AttributeValue::Integer(i),
                    (None, Some(u)) => text(&u.to_string()),
                    (None, None) => AttributeValue::Float(n.as_f64()?),
                },
                _ => return None,
            };
            Some(own(&name, value))
        }));
    }
    if let Some(speckles) = stats.speckles.as_ref().filter(|s| s.replaced) {
        let pixels = i64::try_from(speckles.pixels).unwrap_or(i64::MAX);
        list.push(own("despeckled_pixels", AttributeValue::Integer(pixels)));
        list.push(own(
            "despeckled_light",
            AttributeValue::Float(speckles.share),
        ));
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate;

    #[test]
    fn every_figure_is_an_attribute() {
        let stats = Stats {
            seed: u64::MAX,
            b: 0.5,
            ..Stats::default()
        };
        let settings = Settings {
            integrator: IntegratorKind::Mmlt,
            seed: 0,
            threads: 0,
            lanes: integrate::Width::One,
            max_depth: 5,
            samples_per_pixel: 1,
            mutations_per_pixel: 1,
            chains: 1,
            bootstrap: 1,
            large_step_probability: 0.3,
            mutation: crate::chain::mutate::Mutation::Gaussian,
            sigma: 0.01,
            tune: crate::chain::tune::Tune {
                sigma: true,
                large_step: false,
            },
            strategy_choice: crate::integrate::StrategyChoice::Uniform,
            time: None,
            target_error: None,
            estimate_error: true,
            error_layers: false,
            strategies: false,
            batch: None,
            forced: Vec::new(),
            shard: None,
        };
        let mut list = of_settings("a.pbrt", &settings, None);
        list.extend(of_figures(&stats));
        let get = |name: &str| {
            let name = format!("phalanx:{name}");
            list.iter().find(|a| a.name == name).map(|a| &a.value)
        };
        assert_eq!(get("b"), Some(&AttributeValue::Float(0.5)));
        let auto = AttributeValue::Text("auto".into());
        assert_eq!(get("sigma"), Some(&auto));
        assert!(get("large_step_probability") != Some(&auto));
        assert_eq!(get("chains"), Some(&AttributeValue::Integer(1)));
        let seed = AttributeValue::Text(u64::MAX.to_string());
        assert_eq!(get("seed"), Some(&seed));
    }
}
