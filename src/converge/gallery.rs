//! The pictures of a report: one of every variant at equal time, and where they are wrong.

use super::plan::Turn;
use super::reference::Reference;
use super::subject::Run;
use crate::metrics::relmse;

/// A picture to look at, and where it is wrong.
#[derive(Clone, Debug)]
pub struct Shown {
    pub pixels: Vec<[f32; 3]>,
    /// Relative squared error of each pixel, mean over channels and `runs` seeds.
    pub errors: Vec<f32>,
    pub runs: u32,
    pub seconds: f64,
    pub relmse_corrected: f64,
}

/// Pictures of the first round: of the budget under way, and of the largest that all variants have
/// been through. Later rounds add to the errors of the last.
#[derive(Default)]
pub(super) struct Gallery {
    budget: usize,
    current: Vec<Option<Shown>>,
    before: Vec<Option<Shown>>,
}

impl Gallery {
    pub fn add(
        &mut self,
        turn: &Turn,
        variants: usize,
        pixels: Vec<[f32; 3]>,
        run: &Run,
        reference: &Reference,
    ) {
        if turn.round == 0 && (self.current.is_empty() || turn.budget != self.budget) {
            let last = std::mem::replace(&mut self.current, vec![None; variants]);
            if last.iter().all(Option::is_some) {
                self.before = last;
            }
            self.budget = turn.budget;
        }
        if turn.budget != self.budget {
            return;
        }
        let pixel = |i: usize| relmse(&pixels[i..=i], &reference.pixels[i..=i]) as f32;
        let errors = (0..pixels.len()).map(pixel);
        match &mut self.current[turn.variant] {
            Some(shown) => {
                shown.runs += 1;
                for (mean, error) in shown.errors.iter_mut().zip(errors) {
                    *mean += (error - *mean) / shown.runs as f32;
                }
            }
            empty => {
                *empty = Some(Shown {
                    errors: errors.collect(),
                    pixels,
                    runs: 1,
                    seconds: run.seconds,
                    relmse_corrected: run.relmse_corrected,
                });
            }
        }
    }

    pub fn shown(self) -> Vec<Shown> {
        let whole = |list: Vec<Option<Shown>>| list.into_iter().collect::<Option<Vec<Shown>>>();
        whole(self.current)
            .filter(|list| !list.is_empty())
            .or_else(|| whole(self.before))
            .unwrap_or_default()
    }
}
