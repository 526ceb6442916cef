//! `index.html`: one page that needs no other file and no network.

use super::cells::{self, EXTRAPOLATED, number};
use super::heat::{self, Scale, VIRIDIS};
use super::{chart, sentence, style};
use crate::converge::figures::{SceneFigures, TARGETS};
use crate::converge::plan::BudgetUnit;
use crate::converge::run::{SceneStudy, Study};

const PAGE: &str = include_str!("page/page.html");
const SCENE: &str = include_str!("page/scene.html");
const PICTURES: &str = include_str!("page/pictures.html");
const CSS: &str = include_str!("page/page.css");
const JS: &str = include_str!("page/page.js");

/// Small pictures are shown larger than they are.
const LEAST_WIDTH: u32 = 480;

pub fn page(study: &Study) -> Result<String, String> {
    let mut scenes = String::new();
    for (i, scene) in study.scenes.iter().enumerate() {
        scenes += &section(study, scene, i)?;
    }
    let names: Vec<&str> = study
        .scenes
        .iter()
        .map(|s| s.figures.scene.as_str())
        .collect();
    let contents = if names.len() > 1 {
        let links = names.iter().enumerate();
        let link = |(i, n): (usize, &&str)| format!("<a href=\"#scene-{i}\">{}</a>", escape(n));
        links.map(link).collect()
    } else {
        String::new()
    };
    let stopped = if study.stopped {
        "<p class=\"warning\">Stopped before all runs were done: this is what was complete.</p>"
    } else {
        ""
    };
    Ok(fill(
        PAGE,
        &[
            (
                "title",
                &escape(&format!("Error against time: {}", names.join(", "))),
            ),
            ("css", CSS),
            ("js", JS),
            ("lead", &escape(&lead(study))),
            ("stopped", stopped),
            ("facts", &facts(study)),
            ("contents", &contents),
            ("scenes", &scenes),
            ("star", EXTRAPOLATED),
        ],
    ))
}

fn lead(study: &Study) -> String {
    let b = &study.budgets;
    let last = b.get(b.count.saturating_sub(1));
    let unit = match b.unit {
        BudgetUnit::Seconds => "s",
        BudgetUnit::Effort => "mutations or samples a pixel",
    };
    let seeds = match study.seeds {
        1 => "one seed".to_string(),
        n => format!("{n} seeds"),
    };
    format!(
        "Phalanx {}: {} budgets from {} to {} {unit}, {seeds} each",
        study.version,
        b.count,
        b.first,
        (last * 1e6).round() / 1e6
    )
}

fn facts(study: &Study) -> String {
    let machine = &study.machine;
    let cpu = machine.cpu.as_deref().unwrap_or(machine.arch);
    let rows = [
        (
            "Command",
            format!("<code>{}</code>", escape(&study.command)),
        ),
        ("Processor", escape(cpu)),
        (
            "Threads",
            format!("{} used, of {} cores", study.threads, machine.cores),
        ),
        (
            "Built for",
            escape(&format!(
                "{}, {}: {}",
                machine.os,
                machine.arch,
                machine.target_features.join(" ")
            )),
        ),
    ];
    let row = |(name, value): &(&str, String)| format!("<dt>{name}</dt><dd>{value}</dd>\n");
    rows.iter().map(row).collect()
}

fn section(study: &Study, scene: &SceneStudy, index: usize) -> Result<String, String> {
    let figures = &scene.figures;
    let sentence = sentence::of(figures).map_or(String::new(), |sentence| {
        format!("<p class=\"sentence\">{}</p>", escape(&sentence))
    });
    let chart = chart::element(&chart::of(scene), &format!("scene-{index}-"));
    Ok(fill(
        SCENE,
        &[
            ("index", &index.to_string()),
            ("name", &escape(&figures.scene)),
            ("sentence", &sentence),
            ("about", &escape(&cells::reference(figures))),
            ("chart", &chart),
            ("summary", &summary(figures)),
            ("notes", &(notes(figures) + &warnings(study, scene))),
            ("budgets", &budgets(figures)),
            ("pictures", &pictures(study, scene, index)?),
        ],
    ))
}

/// Cells are HTML. One that is empty belongs to the row above.
fn row(cells: &[String]) -> String {
    let class = match cells.first() {
        Some(first) if first.is_empty() => "",
        _ => " class=\"head\"",
    };
    let cells: String = cells.iter().map(|c| format!("<td>{c}</td>")).collect();
    format!("<tr{class}>{cells}</tr>\n")
}

fn table(caption: &str, header: &[(String, &str)], body: &str) -> String {
    let header: String = (header.iter())
        .map(|(name, unit)| {
            let unit = if unit.is_empty() { "&nbsp;" } else { unit };
            format!("<th>{name}<small>{unit}</small></th>")
        })
        .collect();
    format!(
        "<table><caption>{caption}</caption><thead><tr>{header}</tr></thead>\n<tbody>\n{body}</tbody></table>"
    )
}

/// The variant's colour and name.
fn named(figures: &SceneFigures, index: usize) -> String {
    let s = style::of(index);
    format!(
        "<svg class=\"key\" viewBox=\"0 0 26 10\" aria-hidden=\"true\"><line x1=\"0\" y1=\"5\" x2=\"26\" y2=\"5\" stroke=\"{}\" stroke-width=\"2.5\" stroke-dasharray=\"{}\"/></svg>{}",
        s.color,
        s.dash,
        escape(&figures.variants[index].name)
    )
}

fn summary(figures: &SceneFigures) -> String {
    let mut header = vec![(String::new(), ""), ("slope".into(), "of the line")];
    header.extend(TARGETS.map(|t| (format!("time to {}", cells::power(t)), "s")));
    header.push(("efficiency".into(), "1 / s"));
    header.push(("gain".into(), "over the first"));
    let mut body = String::new();
    for (i, variant) in figures.variants.iter().enumerate() {
        let mut line = vec![named(figures, i), cells::slope(variant)];
        line.extend(
            variant
                .targets
                .iter()
                .map(|t| cells::target(t).trim_end().to_string()),
        );
        line.push(cells::optional(variant.efficiency.as_ref()));
        line.push(match i {
            0 => "1".into(),
            _ => cells::optional(variant.gain.as_ref()),
        });
        body += &row(&line);
    }
    table("Time to an error, and efficiency", &header, &body)
}

fn notes(figures: &SceneFigures) -> String {
    let notes: Vec<String> = cells::notes(figures).iter().map(|n| escape(n)).collect();
    if notes.is_empty() {
        return String::new();
    }
    format!("<p class=\"notes\">{}</p>", notes.join("<br>"))
}

/// What runs warned of, folded up.
fn warnings(study: &Study, scene: &SceneStudy) -> String {
    let all = scene.runs.iter().flat_map(|run| {
        let name = &scene.figures.variants[run.variant].name;
        let whose = format!(
            "{name}, {}, seed {}",
            study.budgets.named(run.budget),
            run.seed
        );
        let item =
            move |text: &String| format!("<li><b>{}</b>: {}</li>\n", escape(&whose), escape(text));
        run.warnings.iter().map(item)
    });
    let all: Vec<String> = all.collect();
    match all.len() {
        0 => String::new(),
        n => format!(
            "<details class=\"notes\"><summary>Warnings: {n}</summary><ul>\n{}</ul></details>",
            all.concat()
        ),
    }
}

fn budgets(figures: &SceneFigures) -> String {
    let header = [
        (String::new(), ""),
        ("effort".into(), "per pixel"),
        ("seeds".into(), ""),
        ("time".into(), "s"),
        ("relMSE".into(), "as measured"),
        ("relMSE".into(), "less the reference's"),
    ];
    let mut body = String::new();
    for (i, variant) in figures.variants.iter().enumerate() {
        for (j, budget) in variant.budgets.iter().enumerate() {
            let name = match j {
                0 => named(figures, i),
                _ => String::new(),
            };
            let [effort, runs, time, error, corrected] = cells::of_budget(budget, "");
            body += &row(&[name, effort, runs, time, error, corrected]);
        }
    }
    table("Means over seeds", &header, &body)
}

fn pictures(study: &Study, scene: &SceneStudy, index: usize) -> Result<String, String> {
    let figures = &scene.figures;
    let (width, height) = (figures.width, figures.height);
    if scene.shown.is_empty() {
        return Ok(String::new());
    }
    let scale = Scale::of(&scene.shown);
    let id = |kind: &str, i: usize| format!("scene-{index}-{kind}-{i}");
    let image = |id: &str, alt: &str, uri: &str| {
        format!("<img id=\"{id}\" alt=\"{}\" src=\"{uri}\">", escape(alt))
    };
    let reference = heat::picture(&scene.reference, width, height, study.exposure)?;
    let mut gallery = format!(
        "<figure><div>{}</div><figcaption>Reference</figcaption></figure>\n",
        image(&id("reference", 0), "Reference", &reference)
    );
    let mut options = vec![(id("reference", 0), "Reference".to_string())];
    let mut maps = Vec::new();
    for (i, (shown, variant)) in scene.shown.iter().zip(&figures.variants).enumerate() {
        let picture = heat::picture(&shown.pixels, width, height, study.exposure)?;
        let map = heat::map(&shown.errors, width, height, scale)?;
        let error = format!("Error of {}", variant.name);
        gallery += &format!(
            "<figure><div>{}{}</div><figcaption>{}<br>{} s, relMSE {}; map of {} seed{}</figcaption></figure>\n",
            image(&id("picture", i), &variant.name, &picture),
            image(&id("error", i), &error, &map),
            named(figures, i),
            number(shown.seconds),
            number(shown.relmse_corrected),
            shown.runs,
            if shown.runs == 1 { "" } else { "s" },
        );
        options.push((id("picture", i), variant.name.clone()));
        maps.push((id("error", i), error));
    }
    options.extend(maps);
    let choose = |chosen: usize| -> String {
        let option = |(i, (id, name)): (usize, &(String, String))| {
            let selected = if i == chosen { " selected" } else { "" };
            format!("<option value=\"{id}\"{selected}>{}</option>", escape(name))
        };
        options.iter().enumerate().map(option).collect()
    };
    let heading = match study.budgets.unit {
        BudgetUnit::Seconds => "Pictures at equal time",
        BudgetUnit::Effort => "Pictures at the largest budget",
    };
    // The first two variants beside each other; one, beside the reference.
    let (left, right) = if scene.shown.len() > 1 {
        (1, 2)
    } else {
        (1, 0)
    };
    let ramp: Vec<String> = (VIRIDIS.iter())
        .map(|[r, g, b]| format!("rgb({r} {g} {b})"))
        .collect();
    let decades = (scale.high - scale.low()).round() as i32;
    let marks: String = (0..=decades)
        .map(|d| format!("<span>1e{}</span>", scale.low().round() as i32 + d))
        .collect();
    Ok(fill(
        PICTURES,
        &[
            ("index", &index.to_string()),
            ("heading", heading),
            ("left", &choose(left)),
            ("right", &choose(right)),
            ("width", &width.to_string()),
            ("height", &height.to_string()),
            ("shown", &width.max(LEAST_WIDTH).to_string()),
            ("ramp", &ramp.join(", ")),
            ("marks", &marks),
            ("gallery", &gallery),
        ],
    ))
}

/// Text for HTML, attributes included.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// Replaces each `{{name}}` of a template, once: what values hold is left alone.
fn fill(template: &str, values: &[(&str, &str)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        if let Some((_, value)) = values.iter().find(|v| v.0 == name) {
            out.push_str(value);
        }
        rest = after;
    }
    out + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_not_templates() {
        assert_eq!(
            fill("a {{x}} b {{y}}{{z}}.", &[("x", "{{y}}"), ("y", "2")]),
            "a {{y}} b 2."
        );
        assert_eq!(
            escape("<a href='x'>&\""),
            "&lt;a href=&#39;x&#39;&gt;&amp;&quot;"
        );
    }

    #[test]
    fn templates_name_only_what_is_filled() {
        for template in [PAGE, SCENE, PICTURES] {
            assert_eq!(
                template.matches("{{").count(),
                template.matches("}}").count()
            );
        }
    }
}
