//! A comparison as tables.

use super::args::MapName;
use super::document::Document;
use crate::cli::table::{Table, heading};
use crate::cli::units::digits;
use crate::metrics::{Figures, Tile};

/// Tiles listed; JSON has all.
const WORST: usize = 5;

pub fn tables(document: &Document, map: MapName) -> String {
    let mut out = String::new();
    about(&mut out, document);
    whole(&mut out, &document.whole);
    worst_tiles(&mut out, document, map);
    out
}

fn about(out: &mut String, document: &Document) {
    let settings = &document.flip_settings;
    let mut flip = format!(
        "{}-FLIP, {:.2} pixels per degree",
        settings.kind, settings.pixels_per_degree
    );
    let exposures = (
        settings.exposures,
        settings.first_exposure,
        settings.last_exposure,
    );
    if let (Some(count), Some(first), Some(last)) = exposures {
        flip += &format!(", {count} exposures from {first:.2} to {last:.2} stops");
    }
    let size = format!("{} x {} pixels", document.width, document.height);
    let rows = [
        ("picture A", format!("{}, {size}", document.a.file)),
        ("reference B", document.b.file.into()),
        ("FLIP", flip),
    ];
    for (name, value) in rows {
        out.push_str(&format!("{name:<12} {value}\n"));
    }
}

fn whole(out: &mut String, figures: &Figures) {
    heading(out, "Whole picture");
    let mut table = Table::new(&["metric", "A against B"]);
    let number = |v| digits(v, 5);
    let rows = [
        ("MSE", number(figures.mse)),
        ("RMSE", number(figures.rmse)),
        ("relMSE", number(figures.relmse)),
        ("SMAPE", number(figures.smape)),
        ("PSNR", decibels(figures.psnr_db)),
        ("FLIP", number(figures.flip)),
        ("mean of A", number(figures.mean_a)),
        ("mean of B", number(figures.mean_b)),
        ("mean A / mean B", ratio(figures, 5)),
    ];
    for (name, value) in rows {
        table.row([name.into(), value]);
    }
    table.print(out);
}

fn worst_tiles(out: &mut String, document: &Document, map: MapName) {
    let judged = document.tiles.iter().filter_map(|tile| {
        let figures = tile.figures.as_ref()?;
        Some((figures.of_map(map.map()), tile, figures))
    });
    let mut tiles: Vec<(f64, &Tile, &Figures)> = judged.collect();
    tiles.sort_by(|a, b| b.0.total_cmp(&a.0));
    let by = match map {
        MapName::Difference => "difference of means",
        map => map.title(),
    };
    let (count, size) = (document.tiles.len(), document.tile_size);
    heading(
        out,
        &format!("Worst of {count} tiles of {size} x {size} pixels, by {by}"),
    );
    let mut table = Table::new(&[
        "left, top",
        "MSE",
        "relMSE",
        "SMAPE",
        "PSNR",
        "FLIP",
        "mean A",
        "mean B",
        "A / B",
    ]);
    for (_, tile, figures) in tiles.into_iter().take(WORST) {
        let number = |v| digits(v, 3);
        table.row([
            format!("{}, {}", tile.x, tile.y),
            number(figures.mse),
            number(figures.relmse),
            number(figures.smape),
            decibels(figures.psnr_db),
            number(figures.flip),
            number(figures.mean_a),
            number(figures.mean_b),
            ratio(figures, 4),
        ]);
    }
    table.print(out);
}

fn decibels(value: f64) -> String {
    format!("{value:.2} dB")
}

fn ratio(figures: &Figures, count: usize) -> String {
    figures.ratio.map_or("-".into(), |r| digits(r, count))
}
