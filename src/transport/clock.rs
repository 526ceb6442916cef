//! Where the time of a step goes, stage by stage, and how full the lanes are. Off unless asked for.

use serde::Serialize;
use std::time::Instant;

/// The stages of a step, in the order in which they first run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[repr(usize)]
pub enum Stage {
    /// Proposed primary samples.
    Mutate,
    /// First rays of camera and light subpaths.
    Generate,
    /// Index lists, and the order of rays.
    Sort,
    /// Closest hits.
    Trace,
    /// Hit points, normals, parameters of materials.
    Surface,
    /// BSDF sampling.
    Shade,
    /// Samples of lights and of the lens, and BSDF values for connections.
    Connect,
    /// MIS weights and contributions, emission hit by chance included.
    Mis,
    /// Visibility of connections.
    Occlusion,
    /// Acceptance.
    Accept,
    /// Film.
    Splat,
}

impl Stage {
    /// Every stage, in the order of a step.
    pub const ALL: [Stage; 11] = [
        Stage::Mutate,
        Stage::Generate,
        Stage::Sort,
        Stage::Trace,
        Stage::Surface,
        Stage::Shade,
        Stage::Connect,
        Stage::Mis,
        Stage::Occlusion,
        Stage::Accept,
        Stage::Splat,
    ];

    /// As figures have it.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Mutate => "mutate",
            Stage::Generate => "generate",
            Stage::Sort => "sort",
            Stage::Trace => "trace",
            Stage::Surface => "surface",
            Stage::Shade => "shade",
            Stage::Connect => "connect",
            Stage::Mis => "MIS",
            Stage::Occlusion => "occlusion",
            Stage::Accept => "accept",
            Stage::Splat => "splat",
        }
    }
}

/// What one stage has taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spent {
    /// Time, on one thread.
    pub seconds: f64,
    /// Paths (or rays) that went through.
    pub items: u64,
    /// Lanes they were given: chunks times the width of the kernels.
    pub slots: u64,
}

impl Spent {
    /// Adds what was measured elsewhere.
    pub fn merge(&mut self, o: &Self) {
        self.seconds += o.seconds;
        self.items += o.items;
        self.slots += o.slots;
    }
}

/// A stopwatch: time since the latest [`Clock::lap`] goes to the stage that ends.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// Of the latest lap; `None` if nothing is measured.
    last: Option<Instant>,
    /// By stage; all 0 if nothing is measured.
    pub spent: [Spent; Stage::ALL.len()],
}

impl Clock {
    /// From now on, everything is measured. A lap costs some 25 ns; a batch makes about ten a wave.
    pub fn start(&mut self) {
        self.last = Some(Instant::now());
    }

    /// Leaves out what happened since the latest lap.
    pub fn skip(&mut self) {
        if self.last.is_some() {
            self.start();
        }
    }

    /// `stage` has ended.
    #[inline]
    pub fn lap(&mut self, stage: Stage) {
        if let Some(last) = self.last {
            let now = Instant::now();
            self.spent[stage as usize].seconds += (now - last).as_secs_f64();
            self.last = Some(now);
        }
    }

    /// `items` paths went through `stage`, `width` a time.
    #[inline]
    pub fn count(&mut self, stage: Stage, items: usize, width: usize) {
        if self.last.is_some() {
            let spent = &mut self.spent[stage as usize];
            spent.items += items as u64;
            spent.slots += items.next_multiple_of(width) as u64;
        }
    }

    /// `items` paths went through `stage`, `width` a time, and it has ended.
    #[inline]
    pub fn finish(&mut self, stage: Stage, items: usize, width: usize) {
        self.count(stage, items, width);
        self.lap(stage);
    }

    /// Adds what other clocks have measured, as on other threads.
    pub fn merge(&mut self, o: &Self) {
        for (a, b) in self.spent.iter_mut().zip(&o.spent) {
            a.merge(b);
        }
    }
}
