//! Which strategies a sample of bidirectional path tracing has, and where their primary samples
//! are.

use super::World;
use super::paths::Endpoints;
use super::records::{Contribution, Splat};
use super::samples::ConnectionSamples;
use super::strategy::Strategy;
use super::weigh::StrategyMask;
use crate::plan::{Layout, Vertices};
use crate::simd::Row;

/// Which strategies run, and where their primary samples are.
#[derive(Clone, Debug)]
pub struct BidirectionalLayout {
    pub(super) strategies: Vec<Strategy>,
    /// By depth: which of them is `s = 0`.
    pub(super) seen: Vec<Option<usize>>,
    /// Most surface vertices of a camera subpath, and of a light subpath.
    pub camera_vertices: usize,
    /// Most surface vertices of a light subpath.
    pub light_vertices: usize,
    /// Camera vertices that scatter or are joined.
    pub(super) camera_components: usize,
    pub(super) mask: StrategyMask,
    /// By strategy: the most of a contribution that is kept, if chains bring the rest.
    pub(super) kept: Vec<Option<f32>>,
    pub(super) parts: bool,
    /// Where their primary samples are.
    pub at: Layout,
}

impl BidirectionalLayout {
    /// All strategies that can carry light, of all depths that the world is planned for.
    pub fn new(world: &World) -> Self {
        Self::with(world, StrategyMask::ALL, |_| true)
    }

    /// Light subpaths joined to the camera alone, and lights that the camera sees directly. Nothing
    /// competes: weights are 1. Light that reaches the camera from specular surfaces is out of
    /// reach.
    pub fn light_tracing(world: &World) -> Self {
        Self::with(world, StrategyMask::NONE, |strategy| {
            strategy.t == 1 || strategy.depth() == 0
        })
    }

    /// The strategies of depths of which samples keep something, if `kept` is the most of a
    /// contribution's mean channel that they keep at each depth: the rest is that of chains
    /// ([`DepthPlan::kept`](crate::plan::DepthPlan::kept)). Infinity keeps all of it, 0 nothing.
    pub fn sharing(world: &World, kept: &[f32]) -> Self {
        let of = |strategy: Strategy| kept[strategy.depth() as usize];
        let mut layout = Self::with(world, StrategyMask::ALL, |strategy| of(strategy) > 0.0);
        let bounds = layout.strategies.iter().map(|strategy| of(*strategy));
        layout.kept = bounds.map(|b| b.is_finite().then_some(b)).collect();
        layout
    }

    /// Asks evaluations for [`Splats::parts`](super::paths::Splats::parts), too.
    pub fn with_parts(mut self) -> Self {
        self.parts = true;
        self
    }

    fn with(world: &World, mask: StrategyMask, runs: impl Fn(Strategy) -> bool) -> Self {
        let plan = &world.plan;
        let mut strategies = Vec::new();
        let mut seen = Vec::new();
        for depth in &plan.depths {
            let first = strategies.len();
            strategies.extend(
                (depth.strategies.iter())
                    .map(|&s| Strategy {
                        s,
                        t: depth.depth + 2 - s,
                    })
                    .filter(|strategy| runs(*strategy)),
            );
            let met = strategies.get(first).filter(|strategy| strategy.s == 0);
            seen.push(met.map(|_| first));
        }
        let most = |side: usize, of: &dyn Fn(&Strategy) -> bool| {
            let chosen = strategies.iter().filter(|strategy| of(strategy));
            chosen.map(|s| s.surfaces()[side]).max().unwrap_or(0)
        };
        let camera_vertices = most(1, &|_| true);
        let light_vertices = most(0, &|_| true);
        let joined = most(1, &|strategy| strategy.s > 0);
        let camera_components = joined.max(camera_vertices.saturating_sub(1));

        let by_choice = usize::from(world.camera.connects_by_choice());
        let vertices = Vertices {
            camera: camera_vertices,
            camera_components,
            light: light_vertices,
            direct: most(1, &|strategy| strategy.s == 1),
            seen: by_choice * most(0, &|strategy| strategy.t == 1),
        };
        Self {
            seen,
            camera_vertices,
            light_vertices,
            camera_components,
            mask,
            kept: vec![None; strategies.len()],
            parts: false,
            at: Layout::bidirectional(plan, vertices),
            strategies,
        }
    }

    /// The strategies that run, by depth, then by light vertices.
    pub fn strategies(&self) -> &[Strategy] {
        &self.strategies
    }

    /// Rays of a path that is not cut short, with the strategies of depths that are chosen alone.
    pub fn rays(&self, chosen: impl Fn(u32) -> bool) -> f64 {
        let chosen = || (self.strategies.iter()).filter(|strategy| chosen(strategy.depth()));
        let most = |side: usize| chosen().map(|s| s.surfaces()[side]).max().unwrap_or(0);
        let joined = chosen().filter(|strategy| strategy.s > 0).count();
        (most(0) + most(1) + joined) as f64
    }

    /// Rows of the sample matrix.
    pub fn total(&self) -> usize {
        self.at.total
    }

    /// Raster positions that a path contributes to beside its camera's: lists in
    /// [`Splats::light`](super::paths::Splats::light).
    pub fn splats(&self) -> usize {
        let joined = self.strategies.iter().filter(|strategy| strategy.t == 1);
        joined
            .map(|strategy| strategy.s as usize - 1)
            .max()
            .unwrap_or(0)
    }

    /// Bytes at most that the workspace of a path of up to `max_depth` scattering events takes
    /// beside what all evaluations need; with [`Splats::parts`](super::paths::Splats::parts) or
    /// without.
    pub fn bytes_per_path(max_depth: u32, parts: bool) -> u64 {
        let depth = u64::from(max_depth);
        // An endpoint with its flags and its place in a list, parameter rows of its own, and its
        // primary samples.
        let vertex = Endpoints::BYTES + 7 + 2 * size_of::<Row>() + 7 * size_of::<f32>();
        let parts = if parts { Strategy::most(max_depth) } else { 0 };
        (2 * depth + 1) * vertex as u64
            + depth * size_of::<Splat>() as u64
            + parts * size_of::<Contribution>() as u64
    }

    /// Samples that strategy `(s, t)` reads beside those of its subpaths.
    pub(super) fn connection(&self, strategy: Strategy) -> ConnectionSamples {
        let [light, camera] = strategy.surfaces();
        let at = &self.at;
        if strategy.t == 1 {
            let point = at.camera_point + 2 * (light - 1);
            return ConnectionSamples {
                choice: point,
                point,
            };
        }
        let further = (camera - 1) * at.strides.connection;
        ConnectionSamples {
            choice: at.connection_choice + further,
            point: at.connection + further,
        }
    }
}
