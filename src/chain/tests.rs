//! Chains over a target that is no primary sample space, and whose proposals are not as probable as
//! their reversals.

use super::batch::{Batch, Workspace};
use super::target::{Steps, Target};
use crate::pbrt::load_str;
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::{Paths, Splat, World};

/// States are cells of a ring with brightnesses `1 + cell`. Chains go right with the probability
/// 3/4, left with 1/4.
struct Ring {
    current: Vec<f32>,
    proposed: Vec<f32>,
    /// Density of the way back over that of the way there.
    ratios: Vec<f32>,
}

const CELLS: u32 = 6;

impl Target for Ring {
    type Proposals = Stream;
    type State = f32;
    const SYMMETRIC: bool = false;

    fn id(&self) -> u32 {
        0
    }
    fn chains(&self) -> usize {
        self.current.len()
    }
    fn splats(&self) -> usize {
        1
    }
    fn strategies(&self) -> &[u32] {
        &[]
    }
    fn draw<L: Lanes>(&mut self, _seed: u64, n: usize, index: impl Fn(usize) -> u64) {
        for i in 0..n {
            self.proposed[i] = (index(i) % u64::from(CELLS)) as f32;
        }
    }
    fn propose<L: Lanes>(&mut self, proposals: &Stream, steps: Steps) {
        for i in 0..self.chains() {
            let [step, decide, ..]: [f32; 4] = proposals.uniforms(steps.ids[i], steps.iteration, 0);
            let right = step < 0.75;
            let by = if right { 1.0 } else { CELLS as f32 - 1.0 };
            self.proposed[i] = (self.current[i] + by) % CELLS as f32;
            self.ratios[i] = if right { 1.0 / 3.0 } else { 3.0 };
            steps.large[i] = 0.0;
            steps.decide[i] = decide;
        }
    }
    fn evaluate<L: Lanes>(&self, _: &World, n: usize, paths: &mut Paths) {
        paths.resize(n);
        for (splat, cell) in paths.splats.camera.iter_mut().zip(&self.proposed) {
            *splat = Splat::new([1.0 + cell; 3], [*cell, 0.0]);
        }
    }
    fn log_ratio<L: Lanes>(&self, start: usize) -> L {
        L::from_fn(|i| self.ratios[start + i].ln())
    }
    fn commit<L: Lanes>(&mut self, taken: &[f32]) {
        for (i, taken) in taken.iter().enumerate() {
            if *taken > 0.0 {
                self.current[i] = self.proposed[i];
            }
        }
    }
    fn current(&self, chain: usize) -> f32 {
        self.current[chain]
    }
    fn proposed(&self, chain: usize) -> f32 {
        self.proposed[chain]
    }
}

/// Cells are visited in proportion to their brightness: detailed balance holds with the ratio of
/// proposals, and without it does not.
#[test]
fn chains_over_biased_proposals_keep_their_target() {
    let text = "Camera \"perspective\"\nWorldBegin\nLightSource \"point\"\nShape \"sphere\"\n";
    let scene = load_str(text, "ring.pbrt", ".".as_ref()).unwrap();
    let world = World::new(&scene, 1);
    let mut workspace = Workspace::new(&world);
    const CHAINS: usize = 4096;
    let ring = Ring {
        current: vec![0.0; CHAINS],
        proposed: vec![0.0; CHAINS],
        ratios: vec![1.0; CHAINS],
    };
    // In equilibrium from the start: cell `c` is the state of `1 + c` in 21 chains.
    let sum = CELLS * (CELLS + 1) / 2;
    let seeds: Vec<u64> = (0..CHAINS as u32)
        .map(|i| {
            (0..CELLS)
                .find(|c| (c + 1) * (c + 2) / 2 > i % sum)
                .unwrap()
                .into()
        })
        .collect();
    let start = &mut workspace.paths;
    let mut batch = Batch::over::<f32>(&world, ring, 0, &seeds, 1, start);
    let proposals = Stream::new(5, Purpose::Mutation);
    for _ in 0..200 {
        batch.step::<f32>(&world, &proposals, &mut workspace.paths);
    }
    // Chains are independent: the cells they are in now are a multinomial sample.
    let mut counts = [0.0; CELLS as usize];
    (0..CHAINS).for_each(|i| counts[batch.state(i).samples as usize] += 1.0);
    let chi2: f64 = (0..CELLS)
        .map(|c| {
            let expected = CHAINS as f64 * f64::from(c + 1) / f64::from(sum);
            (counts[c as usize] - expected).powi(2) / expected
        })
        .sum();
    // Five degrees of freedom: beyond 40 once in seven million.
    assert!(chi2 < 40.0, "{counts:?}: {chi2}");
}
