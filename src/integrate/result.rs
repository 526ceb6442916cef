//! What a render comes to: the picture, its figures, or why there is none.

use serde::Serialize;

use super::depth_stats::{CrossCheck, DepthStats};
use super::error::Tiles;
use super::run::EndedBy;
use super::shares::Shares;
use crate::transport::bidirectional::Strategy;

/// The figures of a render.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Stats {
    pub integrator: String,
    pub seed: u64,
    pub lanes: u32,
    pub threads: usize,
    pub width: u32,
    pub height: u32,
    pub max_depth: u32,
    pub mutations: u64,
    pub mutations_per_second: f64,
    pub samples: u64,
    pub samples_per_second: f64,
    pub rays: u64,
    pub rays_per_second: f64,
    /// Reading and parsing the scene; 0 for a scene that was not read from a file.
    pub load_seconds: f64,
    pub build_seconds: f64,
    pub bootstrap_seconds: f64,
    pub render_seconds: f64,
    pub total_seconds: f64,
    pub acceptance_large: f64,
    pub acceptance_small: f64,
    /// Part of small and of large proposals that carries no light, over all depths; `None` if not
    /// recorded.
    pub dark_small: Option<f64>,
    pub dark_large: Option<f64>,
    /// Mean over the sampled raster region of the target (mean channel of radiance), and its
    /// standard error.
    pub b: f64,
    pub b_stderr: f64,
    pub rejected_nonfinite: u64,
    pub peak_rss_bytes: u64,
    /// Estimated relative mean squared error of the picture as written: the mean over pixels and
    /// channels of the squared standard error over (squared value +
    /// [`RELATIVE_EPSILON`](crate::metrics::RELATIVE_EPSILON)); and its root. `None` if not
    /// estimated.
    pub relmse: Option<f64>,
    pub relative_error: Option<f64>,
    /// Largest split R-hat of depths that matter (see [`DepthStats`]), and smallest effective
    /// sample size.
    pub rhat: Option<f64>,
    pub ess: Option<f64>,
    pub stuck_chains: u64,
    pub cross_check: Option<CrossCheck>,
    /// Who brings what (`auto`).
    pub shares: Option<Shares>,
    pub depths: Vec<DepthStats>,
    /// In radiance as written.
    pub tiles: Option<Tiles>,
}

/// A finished render.
pub struct Render {
    /// Linear sRGB radiance of the crop window, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
    pub width: u32,
    pub height: u32,
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
    pub ended_by: EndedBy,
}

/// What a bidirectional strategy adds to the picture: like [`Render::pixels`].
pub struct StrategyPictures {
    pub strategy: Strategy,
    /// Times its weight: these pictures of all strategies add up to the picture.
    pub weighted: Vec<[f32; 3]>,
    /// As if there were no other: all light that it can find, as noisy as it finds it.
    pub unweighted: Vec<[f32; 3]>,
}
