//! What is studied and how, and what is known of each run.

use super::plan::{Budgets, Variant};
use super::reference::Reference;
use crate::integrate::Settings;
use crate::scene::Scene;
use serde::Serialize;

/// A scene, and what is done with it.
pub struct Subject {
    pub name: String,
    pub scene: Scene,
    pub variants: Vec<Variant>,
    pub reference: ReferenceSource,
}

pub enum ReferenceSource {
    Given(Reference),
    /// Rendered with these settings, whatever effort they say.
    Render(Settings),
}

/// What all scenes share.
#[derive(Clone, Debug)]
pub struct Options {
    pub budgets: Budgets,
    /// Runs of every variant at every budget, with the seeds `first_seed..first_seed + seeds`.
    pub seeds: u64,
    pub first_seed: u64,
    /// Effort of a reference that is rendered, all parts together, in multiples of the largest
    /// budget.
    pub reference_factor: f64,
    /// Independent parts of such a reference, at least 2.
    pub reference_parts: u64,
    /// Stops by which the pictures of the report are brightened.
    pub exposure: f32,
    /// What the user typed, for the record.
    pub command: String,
}

/// A finished run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the budget.
    pub budget: usize,
    pub seed: u64,
    /// Mutations or samples per pixel.
    pub effort: u64,
    /// Tree, bootstrap and render.
    pub seconds: f64,
    pub build_seconds: f64,
    pub bootstrap_seconds: f64,
    pub render_seconds: f64,
    pub mutations: u64,
    pub samples: u64,
    pub rays: u64,
    /// As measured.
    pub relmse: f64,
    /// Without the reference's own error.
    pub relmse_corrected: f64,
    /// The reference's own error is the larger part of what was measured.
    pub within_reference_error: bool,
    /// What the render warned of, a sentence each.
    pub warnings: Vec<String>,
}

impl Run {
    /// What it takes before the first mutation or sample.
    pub fn start_seconds(&self) -> f64 {
        self.build_seconds + self.bootstrap_seconds
    }
}
