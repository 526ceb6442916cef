//! References, and the runs themselves, one at a time on all threads.

use super::figures::{SceneFigures, scene_figures};
use super::gallery::{Gallery, Shown};
use super::plan::{Budgets, Cost, Turn, names, order, with_effort};
use super::reference::{Parts, Reference, ReferenceFigures};
use super::subject::{Options, ReferenceSource, Run, Subject};
use super::trial::{costs, slow_starts, trial};
use super::watch::{StudyStep, Watch, whole};
use crate::integrate::measure::Machine;
use crate::integrate::{Render, RenderError, Settings};
use crate::metrics::relmse;
use serde::Serialize;

/// Everything there is to report.
#[derive(Serialize)]
pub struct Study {
    /// Of Phalanx.
    pub version: &'static str,
    pub command: String,
    pub machine: Machine,
    pub threads: usize,
    pub budgets: Budgets,
    pub seeds: u64,
    pub first_seed: u64,
    #[serde(skip)]
    pub exposure: f32,
    /// The user ended it before all was done.
    pub stopped: bool,
    pub scenes: Vec<SceneStudy>,
    /// Things the user should know, a sentence each.
    pub warnings: Vec<String>,
}

#[derive(Serialize)]
pub struct SceneStudy {
    #[serde(flatten)]
    pub figures: SceneFigures,
    pub runs: Vec<Run>,
    /// Linear sRGB of the crop window.
    #[serde(skip)]
    pub reference: Vec<[f32; 3]>,
    /// A picture of every variant at the largest budget that all of them have; empty if there is
    /// none.
    #[serde(skip)]
    pub shown: Vec<Shown>,
}

/// Runs everything; `None` if it was stopped before there was anything to report.
///
/// # Errors
/// As [`render`](crate::integrate::render); and what a variant is called whose settings it will not
/// have.
pub fn study(
    subjects: &[Subject],
    options: &Options,
    watch: &dyn Watch,
) -> Result<Option<Study>, RenderError> {
    let counts: Vec<usize> = subjects.iter().map(|s| s.variants.len()).collect();
    let turns = order(options.budgets.count, options.seeds, &counts);
    let part_amount = part_amount(options);
    let parts = subjects
        .iter()
        .filter(|s| matches!(s.reference, ReferenceSource::Render(_)));
    let references = parts.count() as f64 * part_amount * options.reference_parts as f64;
    let amounts: f64 = turns.iter().map(|t| options.budgets.get(t.budget)).sum();
    watch.total(references + amounts);

    let mut warnings = Vec::new();
    let Some(mut scenes) = sceneries(subjects, options, watch, &mut warnings)? else {
        return Ok(None);
    };
    let mut threads = 0;
    let mut stopped = false;
    for turn in turns {
        let (subject, scenery) = (&subjects[turn.scene], &mut scenes[turn.scene]);
        match take(turn, subject, scenery, options, watch, &mut warnings)? {
            Taken::Run { threads: of_run } => threads = of_run,
            Taken::TooSmall => {}
            Taken::Stopped => {
                stopped = true;
                break;
            }
        }
    }
    let scenes = (subjects.iter().zip(scenes))
        .map(|(subject, s)| SceneStudy {
            figures: scene_figures(subject, options, &s.costs, &s.reference.figures, &s.runs),
            runs: s.runs,
            reference: s.reference.pixels,
            shown: s.gallery.shown(),
        })
        .collect();
    Ok(Some(Study {
        version: env!("CARGO_PKG_VERSION"),
        command: options.command.clone(),
        machine: Machine::this(),
        threads,
        budgets: options.budgets,
        seeds: options.seeds,
        first_seed: options.first_seed,
        exposure: options.exposure,
        stopped,
        scenes,
        warnings,
    }))
}

/// Costs and references of all scenes; `None` if stopped.
fn sceneries(
    subjects: &[Subject],
    options: &Options,
    watch: &dyn Watch,
    warnings: &mut Vec<String>,
) -> Result<Option<Vec<Scenery>>, RenderError> {
    let mut scenes = Vec::new();
    for (index, subject) in subjects.iter().enumerate() {
        let Some(costs) = costs(index, subject, options, watch)? else {
            return Ok(None);
        };
        slow_starts(subject, options, &costs, warnings);
        let reference = match &subject.reference {
            ReferenceSource::Given(reference) => Some(reference.clone()),
            ReferenceSource::Render(settings) => {
                render_reference(index, subject, settings, options, watch)?
            }
        };
        let Some(reference) = reference else {
            return Ok(None);
        };
        scenes.push(Scenery {
            costs,
            reference,
            runs: Vec::new(),
            gallery: Gallery::default(),
        });
    }
    Ok(Some(scenes))
}

/// What has become of a turn.
enum Taken {
    Run {
        threads: usize,
    },
    /// The budget does not reach for any effort.
    TooSmall,
    Stopped,
}

/// Renders one variant of one scene for one budget.
fn take(
    turn: Turn,
    subject: &Subject,
    scenery: &mut Scenery,
    options: &Options,
    watch: &dyn Watch,
    warnings: &mut Vec<String>,
) -> Result<Taken, RenderError> {
    watch.begins(StudyStep::Run(turn));
    let cost = &scenery.costs[turn.variant];
    let amount = options.budgets.get(turn.budget);
    if options.budgets.is_too_small(turn.budget, cost) {
        watch.ended(amount, None);
        return Ok(Taken::TooSmall);
    }
    let effort = options.budgets.effort(amount, cost);
    let mut settings = with_effort(&subject.variants[turn.variant].settings, effort);
    settings.seed = options.first_seed.wrapping_add(turn.round);
    let Some(done) = whole(&subject.scene, &settings, watch)? else {
        return Ok(Taken::Stopped);
    };
    let threads = done.stats.threads;
    let whose = format!(
        "{}: {}, {}, seed {}",
        subject.name,
        names(&subject.variants)[turn.variant],
        options.budgets.named(turn.budget),
        settings.seed
    );
    warnings.extend(done.warnings.iter().map(|w| format!("{whose}: {w}")));
    let run = record(&turn, effort, &settings, &done, &scenery.reference);
    scenery.gallery.add(
        &turn,
        subject.variants.len(),
        done.pixels,
        &run,
        &scenery.reference,
    );
    watch.ended(amount, Some(&run));
    scenery.runs.push(run);
    Ok(Taken::Run { threads })
}

/// A scene under way.
struct Scenery {
    /// Of each variant.
    costs: Vec<Cost>,
    reference: Reference,
    runs: Vec<Run>,
    gallery: Gallery,
}

fn seconds(done: &Render) -> f64 {
    let s = &done.stats;
    s.build_seconds + s.bootstrap_seconds + s.render_seconds
}

fn record(
    turn: &Turn,
    effort: u64,
    settings: &Settings,
    done: &Render,
    reference: &Reference,
) -> Run {
    let measured = relmse(&done.pixels, &reference.pixels);
    let corrected = reference.figures.correct(measured);
    Run {
        variant: turn.variant,
        budget: turn.budget,
        seed: settings.seed,
        effort,
        seconds: seconds(done),
        build_seconds: done.stats.build_seconds,
        bootstrap_seconds: done.stats.bootstrap_seconds,
        render_seconds: done.stats.render_seconds,
        mutations: done.stats.mutations,
        samples: done.stats.samples,
        rays: done.stats.rays,
        relmse: measured,
        relmse_corrected: corrected,
        within_reference_error: reference.figures.drowns(corrected),
        warnings: done.warnings.clone(),
    }
}

/// Of one part of a reference, in the budgets' unit.
fn part_amount(options: &Options) -> f64 {
    let largest = options.budgets.get(options.budgets.count.saturating_sub(1));
    options.reference_factor * largest / options.reference_parts as f64
}

/// Renders the parts of a reference; `None` if that was stopped.
fn render_reference(
    scene: usize,
    subject: &Subject,
    settings: &Settings,
    options: &Options,
    watch: &dyn Watch,
) -> Result<Option<Reference>, RenderError> {
    let amount = part_amount(options);
    watch.begins(StudyStep::Reference { scene, part: 0 });
    let Some(cost) = trial(&subject.scene, settings, options, watch)? else {
        return Ok(None);
    };
    let effort = options.budgets.effort(amount, &cost);
    let mut settings = with_effort(settings, effort);
    let mut parts = Parts::default();
    let mut taken = 0.0;
    for part in 0..options.reference_parts {
        watch.begins(StudyStep::Reference { scene, part });
        // Seeds that no run has.
        settings.seed = options.first_seed.wrapping_sub(1 + part);
        let Some(done) = whole(&subject.scene, &settings, watch)? else {
            return Ok(None);
        };
        taken += seconds(&done);
        parts.add(&done.pixels);
        watch.ended(amount, None);
    }
    let error = parts.error();
    Ok(Some(Reference {
        pixels: parts.pixels(),
        figures: ReferenceFigures {
            source: settings.integrator.name().into(),
            relmse: error.map(|e| e.0),
            relmse_stderr: error.map(|e| e.1),
            parts: parts.count(),
            effort: effort * parts.count(),
            seconds: taken,
        },
    }))
}
