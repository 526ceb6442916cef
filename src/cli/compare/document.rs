//! All that a comparison says, as JSON has it.

use serde::Serialize;

use super::args::CompareArgs;
use super::pictures::Input;
use crate::metrics::{Comparison, Figures, Flip, NotFinite, Tile};

/// All that is known, as JSON has it.
#[derive(Serialize)]
pub struct Document<'a> {
    pub version: &'static str,
    pub a: File<'a>,
    pub b: File<'a>,
    pub width: u32,
    pub height: u32,
    pub flip_settings: FlipSettings,
    #[serde(flatten)]
    pub whole: Figures,
    pub tile_size: u32,
    pub tiles: Vec<Tile>,
}

#[derive(Serialize)]
pub struct File<'a> {
    pub file: &'a str,
    pub not_finite: Option<NotFinite>,
}

#[derive(Serialize)]
pub struct FlipSettings {
    /// `LDR` or `HDR`
    pub kind: &'static str,
    pub pixels_per_degree: f32,
    /// For HDR: exposures, in stops.
    pub exposures: Option<usize>,
    pub first_exposure: Option<f32>,
    pub last_exposure: Option<f32>,
}

impl<'a> Document<'a> {
    pub fn new(
        args: &CompareArgs,
        [a, b]: &'a [Input; 2],
        kind: Flip,
        comparison: &Comparison,
        whole: Figures,
    ) -> Self {
        let file = |input: &'a Input| File {
            file: &input.name,
            not_finite: input.not_finite,
        };
        let exposures = comparison.exposures;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            a: file(a),
            b: file(b),
            width: a.picture.width,
            height: a.picture.height,
            flip_settings: FlipSettings {
                kind: match kind {
                    Flip::Ldr => "LDR",
                    Flip::Hdr => "HDR",
                },
                pixels_per_degree: args.ppd,
                exposures: exposures.map(|e| e.count),
                first_exposure: exposures.map(|e| e.start),
                last_exposure: exposures.map(|e| e.stop),
            },
            whole,
            tile_size: args.tiles,
            tiles: comparison.tiles(args.tiles as usize),
        }
    }
}
