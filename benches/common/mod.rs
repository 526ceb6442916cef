//! What the benches of chains share: scenes, chains ready to march, and how long criterion
//! measures.

// Each bench uses its own part of this.
#![allow(dead_code)]

use criterion::Criterion;
use phalanx::chain::batch::{Batch, Workspace};
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::ProposalDistribution;
use phalanx::film::{Destination, FilterTable, SplatFilm};
use phalanx::pbrt;
use phalanx::scene::Scene;
use phalanx::simd::Lanes;
use phalanx::transport::World;
use std::path::Path;
use std::time::Duration;

/// Names and texts of scenes that stand for easy and hard work: mostly diffuse, and mostly glass.
const SCENES: [(&str, &str); 2] = [
    ("cornell", include_str!("../../scenes/cornell.pbrt")),
    (
        "cornell-glass",
        include_str!("../../tests/reference/cornell-glass.pbrt"),
    ),
];

/// Both scenes, by name.
pub fn scenes() -> Vec<(&'static str, Scene)> {
    let load = |(name, text)| {
        let scene = pbrt::load_str(text, name, Path::new("")).expect("the scene loads");
        (name, scene)
    };
    SCENES.map(load).into()
}

pub fn cornell() -> Scene {
    scenes().swap_remove(0).1
}

/// Few and short measurements: differences that matter are larger than their noise. Flags of the
/// command line still count.
pub fn criterion() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800))
        .configure_from_args()
}

/// `cargo bench -- --test`: whether everything runs, not how fast.
pub fn quick() -> bool {
    std::env::args().any(|a| a == "--test")
}

/// A film of one layer with room for the splats of any measurement.
pub fn film(scene: &Scene) -> SplatFilm {
    let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
    SplatFilm::new(filter, 1, 1e15)
}

/// All splats of a film of one layer.
pub const WHOLE: Destination = Destination {
    layer: 0,
    scale: 1.0,
    half: false,
};

/// Chains of one depth in batches, started as a render starts them.
pub struct Chains {
    evaluator: Evaluator,
    batches: Vec<Batch>,
    next: usize,
    proposals: ProposalDistribution,
    workspace: Workspace,
}

impl Chains {
    /// `count` batches of `chains` each; `None` if no bootstrap path of this depth carries light.
    pub fn new(
        evaluator: Evaluator,
        world: &World,
        depth: usize,
        chains: usize,
        count: usize,
    ) -> Option<Self> {
        let plan = &world.plan.depths[depth];
        let paths = if quick() { 5_000 } else { 50_000 };
        let bootstrap = Evaluator::EIGHT.bootstrap(world, plan, 1, paths, &|| false);
        if bootstrap.estimate.mean() <= 0.0 {
            return None;
        }
        let seeds = bootstrap.seeds(1, depth as u32, chains * count);
        let mut workspace = Workspace::new(world);
        let batches = (seeds.chunks(chains).enumerate())
            .map(|(i, seeds)| {
                let paths = &mut workspace.paths;
                evaluator.batch(world, plan, i * chains, seeds, 1, paths)
            })
            .collect();
        Some(Self {
            evaluator,
            batches,
            next: 0,
            proposals: ProposalDistribution::new(1, 0.3, 0.01),
            workspace,
        })
    }

    /// Marches the next batch, one after the other and round again.
    pub fn march(&mut self, world: &World, film: &SplatFilm, iterations: u32) {
        let at = self.turn();
        let (batch, workspace) = (&mut self.batches[at], &mut self.workspace);
        (self.evaluator).march(
            batch,
            world,
            &self.proposals,
            iterations,
            workspace,
            film,
            WHOLE,
        );
    }

    /// The same with lanes of any kind, whose kernels the bench then compiles itself.
    pub fn march_by<L: Lanes>(&mut self, world: &World, film: &SplatFilm, iterations: u32) {
        let at = self.turn();
        let (batch, workspace) = (&mut self.batches[at], &mut self.workspace);
        batch.march::<L>(world, &self.proposals, iterations, workspace, film, WHOLE);
    }

    /// The batch whose turn it is.
    fn turn(&mut self) -> usize {
        let next = (self.next + 1) % self.batches.len();
        std::mem::replace(&mut self.next, next)
    }
}
