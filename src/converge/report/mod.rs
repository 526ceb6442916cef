//! A study written down: `runs.csv`, `summary.csv`, a chart of each scene as SVG, and `index.html`,
//! a page that needs nothing else.

mod axis;
pub mod cells;
mod chart;
mod csv;
mod draw;
mod heat;
mod html;
mod sentence;
mod series;
mod style;

pub use self::heat::VIRIDIS;

use super::run::Study;
use std::path::Path;

/// The files of a report, as name and content.
///
/// # Errors
/// What could not be encoded, in words.
pub fn files(study: &Study) -> Result<Vec<(String, Vec<u8>)>, String> {
    let [page, runs, summary] = SHARED.map(String::from);
    let mut files = vec![(runs, csv::runs(study)?), (summary, csv::summary(study)?)];
    let names = study.scenes.iter().map(|s| s.figures.scene.as_str());
    for (scene, stem) in study.scenes.iter().zip(stems(names)) {
        let chart = chart::document(&chart::of(scene), &format!("{stem}-"));
        files.push((format!("{stem}.svg"), chart.into_bytes()));
    }
    files.push((page, html::page(study)?.into_bytes()));
    Ok(files)
}

/// The page, and the tables.
const SHARED: [&str; 3] = ["index.html", "runs.csv", "summary.csv"];

/// Names of [`files`], the page first, for scenes of these names.
pub fn file_names<'a>(scenes: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let charts = stems(scenes).into_iter().map(|stem| format!("{stem}.svg"));
    SHARED.into_iter().map(String::from).chain(charts).collect()
}

/// What files about each scene begin with: the scene's file name, reduced to letters that every
/// system can store, and made unique.
pub fn stems<'a>(scenes: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for scene in scenes {
        let name = Path::new(scene).file_name().unwrap_or_default();
        let name = name.to_string_lossy();
        let name = name.trim_end_matches(".gz").trim_end_matches(".pbrt");
        let kept = |c: char| {
            if c.is_ascii_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '_'
            }
        };
        let name: String = name.chars().take(64).map(kept).collect();
        let name = if name.is_empty() {
            "scene".into()
        } else {
            name
        };
        let mut stem = name.clone();
        let mut number = 1;
        // On some systems a and A are one file.
        while stems.iter().any(|s| s.eq_ignore_ascii_case(&stem)) {
            number += 1;
            stem = format!("{name}-{number}");
        }
        stems.push(stem);
    }
    stems
}
