//! Every run, and every variant, as comma-separated values (RFC 4180).

use crate::converge::figures::{TARGETS, VariantFigures};
use crate::converge::fit::Estimate;
use crate::converge::plan::INTEGRATOR;
use crate::converge::run::Study;
use csv::Writer;

type Row = Vec<String>;

fn write(header: Row, rows: impl Iterator<Item = Row>) -> Result<Vec<u8>, String> {
    let mut writer = Writer::from_writer(Vec::new());
    let mut write = |row: Row| writer.write_record(row).map_err(|e| e.to_string());
    write(header)?;
    for row in rows {
        write(row)?;
    }
    writer.into_inner().map_err(|e| e.to_string())
}

/// Labels in use, in their order.
fn labels(study: &Study) -> Vec<&'static str> {
    let mut names = vec![INTEGRATOR];
    let variants = study.scenes.iter().flat_map(|s| &s.figures.variants);
    for label in variants.flat_map(|v| &v.labels) {
        if !names.contains(&label.name) {
            names.push(label.name);
        }
    }
    names
}

/// Column names are words in snake case.
fn columns(labels: &[&str]) -> impl Iterator<Item = String> {
    labels.iter().map(|name| name.replace(' ', "_"))
}

/// What a variant is, a cell for every label; empty where it means nothing to it.
fn values(labels: &[&str], variant: &VariantFigures) -> impl Iterator<Item = String> {
    labels.iter().map(|name| {
        let label = variant.labels.iter().find(|l| l.name == *name);
        label.map_or(String::new(), |l| l.value.clone())
    })
}

/// Shortest text that reads back as the same number.
fn exact(value: f64) -> String {
    value.to_string()
}

fn known(value: Option<f64>) -> String {
    value.map_or(String::new(), exact)
}

/// A value and its standard error.
fn pair(estimate: Option<Estimate>) -> [String; 2] {
    [
        known(estimate.map(|e| e.value)),
        known(estimate.and_then(|e| e.stderr)),
    ]
}

/// One row a run, in the order in which they ran.
pub fn runs(study: &Study) -> Result<Vec<u8>, String> {
    let labels = labels(study);
    let mut header = vec!["scene".to_string(), "variant".into()];
    header.extend(columns(&labels));
    header.extend(
        [
            "seed",
            "budget",
            "effort",
            "effort_unit",
            "seconds",
            "build_seconds",
            "bootstrap_seconds",
            "render_seconds",
            "mutations",
            "samples",
            "rays",
            "relmse",
            "relmse_corrected",
            "within_reference_error",
            "warnings",
        ]
        .map(String::from),
    );
    let labels = &labels;
    let rows = study.scenes.iter().flat_map(|scene| {
        scene.runs.iter().map(|run| {
            let variant = &scene.figures.variants[run.variant];
            let mut row = vec![scene.figures.scene.clone(), variant.name.clone()];
            row.extend(values(labels, variant));
            row.extend([
                run.seed.to_string(),
                exact(study.budgets.get(run.budget)),
                run.effort.to_string(),
                variant.effort_unit.to_string(),
                exact(run.seconds),
                exact(run.build_seconds),
                exact(run.bootstrap_seconds),
                exact(run.render_seconds),
                run.mutations.to_string(),
                run.samples.to_string(),
                run.rays.to_string(),
                exact(run.relmse),
                exact(run.relmse_corrected),
                run.within_reference_error.to_string(),
                run.warnings.join(" | "),
            ]);
            row
        })
    });
    write(header, rows)
}

/// One row a variant.
pub fn summary(study: &Study) -> Result<Vec<u8>, String> {
    let labels = labels(study);
    let mut header = vec!["scene".to_string(), "variant".into()];
    header.extend(columns(&labels));
    header.extend(["runs", "slope", "slope_stderr"].map(String::from));
    for target in TARGETS {
        let name = format!("seconds_to_{}", super::cells::power(target));
        header.extend([
            name.clone(),
            format!("{name}_stderr"),
            format!("{name}_extrapolated"),
        ]);
    }
    header.extend(
        [
            "efficiency",
            "efficiency_stderr",
            "gain",
            "gain_stderr",
            "last_seconds",
            "last_seconds_stderr",
            "last_relmse_corrected",
            "last_relmse_corrected_stderr",
            "last_within_reference_error",
            "reference_relmse",
        ]
        .map(String::from),
    );
    let labels = &labels;
    let rows = study.scenes.iter().flat_map(|scene| {
        let figures = &scene.figures;
        figures.variants.iter().map(move |variant| {
            let mut row = vec![figures.scene.clone(), variant.name.clone()];
            row.extend(values(labels, variant));
            let runs: usize = variant.budgets.iter().map(|b| b.runs).sum();
            row.push(runs.to_string());
            row.extend(pair(variant.slope));
            for target in &variant.targets {
                row.extend(pair(target.seconds));
                row.push(target.extrapolated.to_string());
            }
            row.extend(pair(variant.efficiency));
            row.extend(pair(variant.gain));
            let last = variant.budgets.last();
            row.extend(pair(last.map(|b| b.seconds)));
            row.extend(pair(last.map(|b| b.relmse_corrected)));
            row.push(last.map_or(String::new(), |b| b.within_reference_error.to_string()));
            row.push(known(figures.reference.relmse));
            row
        })
    });
    write(header, rows)
}
