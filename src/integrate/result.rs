//! What a render comes to: the picture, its figures, or why there is none.

use std::path::Path;

use serde::Serialize;

use super::chance::ChanceStats;
use super::depth_stats::{CrossCheck, DepthStats};
use super::error::Tiles;
use super::run::EndedBy;
use super::shares::Shares;
use super::speckles::Speckles;
use super::state::Gathered;
use crate::film::output::{self, OutputError};
use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::transport::bidirectional::Strategy;

/// The figures of a render.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stats {
    /// As on the command line, such as `mmlt`.
    pub integrator: String,
    /// Of all random numbers.
    pub seed: u64,
    /// SIMD width of the kernels: 1 or 8.
    pub lanes: u32,
    /// Worker threads that were used.
    pub threads: usize,
    /// Of the crop window, in pixels.
    pub width: u32,
    /// Of the crop window, in pixels.
    pub height: u32,
    /// Largest number of scattering events.
    pub max_depth: u32,
    /// Made after the bootstrap; 0 of integrators of independent samples.
    pub mutations: u64,
    /// Over [`Self::render_seconds`].
    pub mutations_per_second: f64,
    /// Independent samples made; 0 of Metropolis integrators.
    pub samples: u64,
    /// Over [`Self::render_seconds`].
    pub samples_per_second: f64,
    /// Rays traced, closest hits and visibility, the bootstrap's included.
    pub rays: u64,
    /// Over bootstrap and render together.
    pub rays_per_second: f64,
    /// Reading and parsing the scene; 0 for a scene that was not read from a file.
    pub load_seconds: f64,
    /// Building the tree that rays are traced through.
    pub build_seconds: f64,
    /// Bootstrap and tuning; 0 of integrators of independent samples.
    pub bootstrap_seconds: f64,
    /// Mutations or samples, and the picture they come to.
    pub render_seconds: f64,
    /// All of it.
    pub total_seconds: f64,
    /// Mean acceptance probability of large steps; 0 if there were none.
    pub acceptance_large: f64,
    /// The same of small steps.
    pub acceptance_small: f64,
    /// Part of the small proposals that carries no light, over all depths; `None` if not recorded.
    pub dark_small: Option<f64>,
    /// The same of large proposals.
    pub dark_large: Option<f64>,
    /// Mean over the sampled raster region of the target (mean channel of radiance).
    pub b: f64,
    /// Standard error of [`Self::b`].
    pub b_stderr: f64,
    /// Proposals or samples that were not finite, or negative, and counted as black.
    pub rejected_nonfinite: u64,
    /// Most memory that the process has had at a time; 0 where the system does not tell.
    pub peak_rss_bytes: u64,
    /// Estimated relative mean squared error of the picture as written: the mean over pixels and
    /// channels of the squared standard error over (squared value +
    /// [`RELATIVE_EPSILON`](crate::metrics::RELATIVE_EPSILON)). `None` if it was not estimated.
    pub relmse: Option<f64>,
    /// Square root of [`Self::relmse`].
    pub relative_error: Option<f64>,
    /// Largest split R-hat of depths that matter (see [`DepthStats`]); `None` if it was not told.
    pub rhat: Option<f64>,
    /// Chains of such depths disagree, and some tiles are off by what can be seen.
    pub apart: bool,
    /// Smallest effective sample size of these depths.
    pub ess: Option<f64>,
    /// Chains that hardly moved ([`Mixing::stuck`](crate::chain::mixing::Mixing)).
    pub stuck_chains: u64,
    /// `None` if the error is not estimated.
    pub cross_check: Option<CrossCheck>,
    /// What came from other processes; `None` if there were none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gathered: Option<Gathered>,
    /// Light that only chance finds, if so much of it may be missing that it would show.
    pub chance: Vec<ChanceStats>,
    /// Who brings what (`auto`).
    pub shares: Option<Shares>,
    /// One a depth that has chains; none of integrators of independent samples.
    pub depths: Vec<DepthStats>,
    /// In radiance as written.
    pub tiles: Option<Tiles>,
    /// Bright spots, if they were looked for ([`Speckles::find`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speckles: Option<Speckles>,
}

/// A finished render.
pub struct Render {
    /// Linear sRGB radiance of the crop window, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
    /// Of the crop window, in pixels.
    pub width: u32,
    /// Of the crop window, in pixels.
    pub height: u32,
    /// Where the crop window is in the whole picture: pixels from the left and from the top.
    pub offset: [u32; 2],
    /// Width and height of the whole picture, in pixels.
    pub full: [u32; 2],
    /// How it went.
    pub stats: Stats,
    /// Things the user should know, a sentence each.
    pub warnings: Vec<String>,
    /// Standard error of each value of `pixels`, from one difference of two halves: a single one
    /// is a rough estimate, but their mean square is right. `None` unless
    /// [`Settings::error_layers`](super::Settings::error_layers) asks for them.
    pub deviation: Option<Vec<[f32; 3]>>,
    /// By depth, then by light vertices; none unless
    /// [`Settings::strategies`](super::Settings::strategies) asks for them.
    pub strategies: Vec<StrategyPictures>,
    /// Why it ended when it did.
    pub ended_by: EndedBy,
}

impl Render {
    /// Of a process that leaves the picture to the first one of its team.
    pub(super) fn nothing() -> Self {
        Self {
            pixels: Vec::new(),
            width: 0,
            height: 0,
            offset: [0; 2],
            full: [0; 2],
            stats: Stats::default(),
            warnings: Vec::new(),
            deviation: None,
            strategies: Vec::new(),
            ended_by: EndedBy::Effort,
        }
    }

    /// The picture as files hold it.
    pub fn picture(&self) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            offset: self.offset,
            full: self.full,
            pixels: self.pixels.clone(),
        }
    }

    /// Writes the picture to a file, in the format of its extension: `.exr`, `.pfm` or `.png`.
    /// What is brighter than white is brought down gently in a `.png`.
    ///
    /// # Errors
    /// Another extension, and files that cannot be written.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let display = Display::default();
        output::write(path.as_ref(), &self.picture(), &[], &display)
    }
}

/// What a bidirectional strategy adds to the picture: like [`Render::pixels`].
pub struct StrategyPictures {
    /// Whose.
    pub strategy: Strategy,
    /// Times its weight: these pictures of all strategies add up to the picture.
    pub weighted: Vec<[f32; 3]>,
    /// Without its weight: all light that the strategy can find alone, with all of its noise.
    pub unweighted: Vec<[f32; 3]>,
}
