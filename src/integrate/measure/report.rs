//! What a measurement found. Names and units are those of the JSON that `phalanx bench` writes.

use super::Machine;
use crate::scene::Scene;
use crate::transport::World;
use serde::Serialize;

/// Median and extremes over the rounds of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The middle one.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

impl Spread {
    /// Of at least one value; of an even number, the median is the larger of the two in the middle.
    pub(super) fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        Self {
            median: values[values.len() / 2],
            min: values[0],
            max: values[values.len() - 1],
        }
    }
}

/// All figures.
#[derive(Clone, Debug, Serialize)]
pub struct ThroughputReport {
    /// Of Phalanx.
    pub version: &'static str,
    /// What it was measured on.
    pub machine: Machine,
    /// Of all random numbers.
    pub seed: u64,
    /// As on the command line.
    pub integrator: &'static str,
    /// Largest number of scattering events.
    pub max_depth: u32,
    /// Chains that march together, of each depth.
    pub chains_per_batch: usize,
    /// Time each comparison may take.
    pub seconds_per_measurement: f64,
    /// Rounds of a comparison; that of error estimates has more.
    pub rounds: usize,
    /// Its size.
    pub scene: SceneFigures,
    /// What came before the chains.
    pub bootstrap: BootstrapFigures,
    /// What eight lanes buy.
    pub lanes: LaneFigures,
    /// In the order in which they run.
    pub stages: Vec<StageFigures>,
    /// `total`, `traversal` (closest hits and visibility), `rest` (all but that),
    /// `accept_and_splat`.
    pub groups: Vec<StageFigures>,
    /// Time of a step with the error estimate of a render over time without, at eight lanes on one
    /// thread.
    pub error_estimate: Spread,
    /// What threads buy; from one to all of them.
    pub threads: Vec<ThreadFigures>,
}

/// The scene, and the tree its rays are traced through.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SceneFigures {
    /// Width of the rendered part of the picture, in pixels.
    pub width: u32,
    /// Its height.
    pub height: u32,
    /// Triangles that rays can meet.
    pub triangles: usize,
    /// The same of spheres.
    pub spheres: usize,
    /// Building the tree.
    pub tracer_build_seconds: f64,
    /// Nodes and primitives.
    pub tracer_bytes: usize,
    /// `None` without triangles.
    pub tracer_bytes_per_triangle: Option<f64>,
}

impl SceneFigures {
    pub(super) fn of(scene: &Scene, world: &World) -> Self {
        let [x0, x1, y0, y1] = scene.film.crop;
        let stats = world.tracer.stats();
        let per_triangle = stats.bytes as f64 / stats.triangles as f64;
        Self {
            width: x1 - x0,
            height: y1 - y0,
            triangles: stats.triangles,
            spheres: stats.spheres,
            tracer_build_seconds: stats.build_time.as_secs_f64(),
            tracer_bytes: stats.bytes,
            tracer_bytes_per_triangle: (stats.triangles > 0).then_some(per_triangle),
        }
    }
}

/// The bootstrap of all depths, at eight lanes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BootstrapFigures {
    /// Threads that made it.
    pub threads: usize,
    /// Bootstrap paths of all depths.
    pub paths: u64,
    /// Rays traced for them.
    pub rays: u64,
    /// Time it took.
    pub seconds: f64,
    /// [`Self::paths`] over [`Self::seconds`].
    pub paths_per_second: f64,
    /// [`Self::rays`] over [`Self::seconds`].
    pub rays_per_second: f64,
}

/// Whole steps on one thread, the stage clock off.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LaneFigures {
    /// At eight lanes.
    pub eight: Rates,
    /// At one lane.
    pub one: Rates,
    /// Throughput at eight lanes over that at one, round by round.
    pub gain: Spread,
    /// The same at both widths.
    pub rays_per_mutation: f64,
}

/// Throughput at one width.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rates {
    /// Width of the kernels.
    pub lanes: u32,
    /// Throughput of one thread.
    pub mutations_per_second: Spread,
    /// Rays of these mutations.
    pub rays_per_second: Spread,
    /// At the median throughput.
    pub ns_per_mutation: f64,
}

/// A stage of the step, or several together, by the stage clock.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageFigures {
    /// As [`Stage::name`](crate::transport::clock::Stage::name), or of a group.
    pub name: String,
    /// Of the time of all stages, at eight lanes.
    pub share: f64,
    /// The same at one lane.
    pub share_one_lane: f64,
    /// At eight lanes.
    pub ns_per_mutation: f64,
    /// The same at one lane.
    pub ns_per_mutation_one_lane: f64,
    /// Time at one lane over time at eight.
    pub gain: Option<f64>,
    /// Of eight, those that carry a path; `None` where that has no meaning, or is not counted.
    pub mean_live_lanes: Option<f64>,
}

/// Threads at eight lanes.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ThreadFigures {
    /// How many.
    pub threads: usize,
    /// Of all of them together.
    pub mutations_per_second: Spread,
    /// Over one thread, round by round.
    pub speed_up: Spread,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_of_rounds() {
        let spread = Spread::of([3.0, 1.0, 2.0]);
        assert_eq!((spread.median, spread.min, spread.max), (2.0, 1.0, 3.0));
        assert_eq!(Spread::of([5.0]).median, 5.0);
    }
}
