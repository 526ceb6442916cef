//! Chains on trial: a short run that tells how long chains of the render would remember, and where
//! they would go. They start from the bootstrap, so that they are in equilibrium, and make small
//! steps only; what large steps make of it is computed ([`super::tune`] has the model).

use super::batch::Batch;
use super::bootstrap::Bootstrap;
use super::correlation::{Curve, LargeSteps, coincidence, error, octave};
use super::mutate::ProposalDistribution;
use super::tune::{STEPS, thin};
use crate::simd::Lanes;
use crate::simd::rng::{Purpose, Stream};
use crate::transport::{PathSampler, Paths, World};

/// Steps from state to state that is kept.
const EVERY: u32 = 8;

/// What became of one chain.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    /// Integrated autocorrelation of its pixels: mutations that tell as much as one independent
    /// path.
    pub memory: f64,
    /// Raster positions and targets of some of its states.
    pub states: Vec<([f32; 2], f32)>,
}

/// How a trial is run.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// The run's seed.
    pub seed: u64,
    /// Of the chains that count.
    pub proposals: ProposalDistribution,
    /// Iterations that they make.
    pub iterations: u32,
    /// Chains on trial.
    pub chains: usize,
}

impl Trial {
    /// Runs chains of a sampler from its bootstrap; their traces, and the rays that they traced.
    pub fn run<L: Lanes>(
        &self,
        world: &World,
        sampler: &PathSampler,
        bootstrap: &Bootstrap,
    ) -> (Vec<Trace>, u64) {
        let stream = Stream::new(self.seed, Purpose::PilotSeeding);
        let seeds = bootstrap.draw(&stream, sampler.id(), self.chains);
        let mut paths = Paths::new(world);
        let mut batch = Batch::new::<L>(world, sampler, 0, &seeds, self.seed, &mut paths);
        let chance = LargeSteps::new(thin(bootstrap));
        let mut proposals = self.proposals.piloting(self.seed);
        proposals.large_step_probability = 0.0;
        let mut traces = vec![Trace::default(); batch.len()];
        let mut accepted = vec![0.0; batch.len()];
        let mut pixels: Vec<Vec<u64>> = Vec::new();
        for step in 0..STEPS {
            let mut row = Vec::with_capacity(batch.len());
            for (i, (place, target)) in batch.places().enumerate() {
                let [x, y] = place.map(|v| v.floor() as i32 as u32);
                row.push(u64::from(y) << 32 | u64::from(x));
                accepted[i] += chance.accepted(target);
                if step % EVERY == 0 {
                    traces[i].states.push((place, target));
                }
            }
            pixels.push(row);
            batch.step::<L>(world, &proposals, &mut paths);
        }
        let met = coincidence(&pixels[0], &seeds);
        let curves: Vec<Curve> = (accepted.iter().enumerate())
            .map(|(i, accepted)| {
                let track: Vec<u64> = pixels.iter().map(|row| row[i]).collect();
                Curve::new(&track, met, accepted / f64::from(STEPS))
            })
            .collect();
        let octave = octave(&curves);
        let end = (2.0 / f64::from(self.iterations.max(1))).min(1.0);
        let p = f64::from(self.proposals.large_step_probability);
        for (trace, curve) in traces.iter_mut().zip(curves) {
            trace.memory = error(&[curve], octave, end, p).max(1.0);
        }
        (traces, paths.rays.traced)
    }
}
