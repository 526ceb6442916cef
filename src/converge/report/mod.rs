//! A study written down: `runs.csv`, `summary.csv`, a chart of each scene as SVG, and `index.html`, a page that needs nothing else.

mod axis;
pub mod cells;
mod chart;
mod csv;
mod heat;
mod html;
mod series;
mod style;

use super::run::Study;
use std::path::Path;

/// The files of a report, as name and content.
///
/// # Errors
/// What could not be encoded, in words.
pub fn files(study: &Study) -> Result<Vec<(String, Vec<u8>)>, String> {
    let mut files = vec![
        ("runs.csv".into(), csv::runs(study)?),
        ("summary.csv".into(), csv::summary(study)?),
    ];
    for (scene, stem) in study.scenes.iter().zip(stems(study)) {
        let chart = chart::document(&chart::of(scene), &format!("{stem}-"));
        files.push((format!("{stem}.svg"), chart.into_bytes()));
    }
    files.push(("index.html".into(), html::page(study)?.into_bytes()));
    Ok(files)
}

/// What files about each scene begin with: the scene's file name, reduced to letters that every system can store, and made unique.
pub fn stems(study: &Study) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for scene in &study.scenes {
        let name = Path::new(&scene.figures.scene)
            .file_name()
            .unwrap_or_default();
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
