//! Evaluating batches of paths from their primary samples, wave by wave.

use super::World;
use super::connect::ConnectionSamples;
use super::paths::{Lists, Paths, Side};
use super::samples::Samples;
use crate::plan::DepthPlan;
use crate::simd::Lanes;

/// Primary samples of a path-traced path: raster (2), lens (2), and per bounce three for the BSDF, one for the choice of a light,
/// two for a point on it.
#[derive(Clone, Copy, Debug)]
pub struct UnidirectionalLayout {
    pub max_depth: u32,
}

impl UnidirectionalLayout {
    const PER_BOUNCE: usize = 6;

    /// Rows of the sample matrix.
    pub fn total(&self) -> usize {
        4 + Self::PER_BOUNCE * self.max_depth as usize
    }

    fn at(&self, depth: u32) -> (usize, ConnectionSamples) {
        let base = 4 + Self::PER_BOUNCE * depth as usize;
        let connection = ConnectionSamples {
            choice: base + 3,
            point: base + 4,
        };
        (base, connection)
    }
}

impl World<'_> {
    /// Multiplexed evaluation (Hachisuka et al. 2014): path `i` of `n` takes column `i` of `samples`, laid out as `depth.layout`, chooses a
    /// strategy `(s, t)` with `s + t = depth + 2`, and leaves its contribution in `paths.outcome[i]`.
    ///
    /// A path costs `depth + 1` rays whatever its strategy, so the batch marches in lockstep: wave `w` traces the `w`-th ray of every live
    /// path, camera and light subpaths alike, and the visibility rays go last.
    pub fn evaluate_multiplexed<L: Lanes>(
        &self,
        depth: &DepthPlan,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        paths.resize(n);
        paths.light_subpaths = 1.0;
        if depth.strategies.is_empty() {
            return;
        }
        let mut lists = std::mem::take(&mut paths.lists);
        self.choose_strategies(depth, samples, paths, &mut lists);
        let at = &depth.layout;
        // With one strategy nothing competes with it.
        let alone = depth.strategies.len() == 1;
        let choices = depth.strategies.len() as f32;
        self.start_camera::<L>(
            paths,
            samples,
            &lists.camera,
            (at.raster, at.lens),
            alone || !self.plan.connectable,
        );
        for wave in 0..=depth.depth {
            // Light subpaths start where the camera's rays are spent.
            let mut light = std::mem::take(&mut lists.light);
            let first = (at.light_choice, at.emission);
            self.start_light::<L>(paths, samples, &lists.starting, first, &mut light);
            lists.light = light;
            lists.starting.clear();
            lists.trace.clear();
            lists.trace.extend_from_slice(&lists.camera);
            lists.trace.extend_from_slice(&lists.light);
            if lists.trace.is_empty() {
                break;
            }
            self.trace::<L>(paths, &lists.trace);
            self.advance_camera::<L>(paths, samples, &mut lists, depth, wave);
            self.advance_light::<L>(paths, samples, &mut lists, depth, wave);
        }
        self.emission::<L>(paths, &lists.emission, choices);
        self.escape::<L>(paths, &lists.escaped, choices);
        for &path in &lists.connect {
            let (s, t) = (paths.s[path as usize], paths.t[path as usize]);
            match (s, t) {
                (1, _) => lists.direct.push(path),
                (_, 1) => lists.lens.push(path),
                _ => lists.general.push(path),
            }
        }
        paths.lists = lists;
        let connection = ConnectionSamples {
            choice: at.connection_choice,
            point: at.connection,
        };
        self.connect::<L>(paths, samples, connection, choices);
        self.settle(paths);
    }

    /// The first primary sample of the camera stream chooses among the strategies uniformly.
    fn choose_strategies(
        &self,
        depth: &DepthPlan,
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
    ) {
        for list in [
            &mut lists.camera,
            &mut lists.light,
            &mut lists.emission,
            &mut lists.escaped,
            &mut lists.starting,
            &mut lists.connect,
            &mut lists.direct,
            &mut lists.lens,
            &mut lists.general,
        ] {
            list.clear();
        }
        let count = depth.strategies.len();
        for path in 0..paths.n {
            let pick = if count > 1 {
                let u = samples.row(depth.layout.strategy)[path];
                ((u * count as f32) as usize).min(count - 1)
            } else {
                0
            };
            let s = depth.strategies[pick];
            let t = depth.depth + 2 - s;
            paths.s[path] = s;
            paths.t[path] = t;
            paths.outcome[path].s = s;
            if t >= 2 {
                lists.camera.push(path as u32);
            } else {
                lists.starting.push(path as u32);
            }
        }
    }

    /// Camera subpaths have their hits of this wave: they arrive, end, or scatter. `lists.camera` is left with those that go on.
    fn advance_camera<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        depth: &DepthPlan,
        wave: u32,
    ) {
        lists.scratch.clear();
        for &path in &lists.camera {
            let last = paths.t[path as usize] == wave + 2;
            if !paths.missed(path) {
                lists.scratch.push(path);
            } else if last && paths.s[path as usize] == 0 {
                lists.escaped.push(path);
            }
        }
        self.arrive::<L>(paths, &lists.scratch, Side::Camera);
        lists.camera.clear();
        for &path in &lists.scratch {
            let s = paths.s[path as usize];
            if paths.t[path as usize] > wave + 2 {
                lists.camera.push(path);
            } else if s == 0 {
                lists.emission.push(path);
            } else if paths.tips[0].kind[path as usize].is_delta() {
                // Nothing can be joined to a delta BSDF.
            } else if s == 1 {
                lists.connect.push(path);
            } else {
                lists.starting.push(path);
            }
        }
        let first = depth.layout.camera_bounce + wave as usize * depth.layout.per_bounce;
        let mut alive = std::mem::take(&mut lists.camera);
        self.scatter_queues::<L>(paths, samples, lists, &mut alive, Side::Camera, &|_| first);
        lists.camera = alive;
    }

    fn advance_light<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        depth: &DepthPlan,
        wave: u32,
    ) {
        lists.scratch.clear();
        let hit = lists.light.iter().filter(|p| !paths.missed(**p));
        lists.scratch.extend(hit);
        self.arrive::<L>(paths, &lists.scratch, Side::Light);
        lists.light.clear();
        for &path in &lists.scratch {
            // All rays but the visibility ray are spent.
            if wave + 1 < depth.depth {
                lists.light.push(path);
            } else if !paths.tips[1].kind[path as usize].is_delta() {
                lists.connect.push(path);
            }
        }
        let (base, per) = (depth.layout.light_bounce, depth.layout.per_bounce);
        let mut alive = std::mem::take(&mut lists.light);
        let t = std::mem::take(&mut paths.t);
        self.scatter_queues::<L>(paths, samples, lists, &mut alive, Side::Light, &|path| {
            base + (wave + 1 - t[path as usize]) as usize * per
        });
        paths.t = t;
        lists.light = alive;
    }

    /// Scatters the tips of `list` queue by queue; `list` is left with the survivors.
    pub(super) fn scatter_queues<L: Lanes>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        list: &mut Vec<u32>,
        side: Side,
        dimension: &dyn Fn(u32) -> usize,
    ) {
        if list.is_empty() {
            return;
        }
        self.queue(paths, list, side, &mut lists.queues);
        list.clear();
        for &kind in &self.plan.kinds {
            let queue = &lists.queues[kind as usize];
            if !queue.is_empty() {
                crate::for_kind!(
                    kind,
                    self.scatter::<_, L>(paths, samples, queue, side, dimension, list)
                );
            }
        }
    }

    /// Path tracing: camera subpaths of up to `layout.max_depth` scattering events, at every vertex joined to a light (`s = 1`) and, where they
    /// meet one, seen (`s = 0`), both weighed against each other. Leaves the radiance along the first ray in `paths.outcome[i]`.
    pub fn evaluate_unidirectional<L: Lanes>(
        &self,
        layout: &UnidirectionalLayout,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        paths.resize(n);
        paths.light_subpaths = 0.0;
        let mut lists = std::mem::take(&mut paths.lists);
        lists.camera.clear();
        lists.camera.extend(0..n as u32);
        lists.lens.clear();
        lists.general.clear();
        self.start_camera::<L>(paths, samples, &lists.camera, (0, 2), true);
        for depth in 0..=layout.max_depth {
            if lists.camera.is_empty() {
                break;
            }
            self.trace::<L>(paths, &lists.camera);
            lists.escaped.clear();
            lists.scratch.clear();
            for &path in &lists.camera {
                if paths.missed(path) {
                    lists.escaped.push(path);
                } else {
                    lists.scratch.push(path);
                }
            }
            self.escape::<L>(paths, &lists.escaped, 1.0);
            self.arrive::<L>(paths, &lists.scratch, Side::Camera);
            self.emission::<L>(paths, &lists.scratch, 1.0);
            if depth == layout.max_depth {
                break;
            }
            let mut alive = std::mem::take(&mut lists.camera);
            alive.clear();
            alive.extend_from_slice(&lists.scratch);
            lists.direct.clear();
            if self.plan.connectable {
                let kinds = &paths.tips[0].kind;
                let joinable = alive.iter().filter(|p| !kinds[**p as usize].is_delta());
                lists.direct.extend(joinable);
            }
            paths.lists = lists;
            let (bounce, connection) = layout.at(depth);
            self.connect::<L>(paths, samples, connection, 1.0);
            lists = std::mem::take(&mut paths.lists);
            let first = |_| bounce;
            self.scatter_queues::<L>(paths, samples, &mut lists, &mut alive, Side::Camera, &first);
            lists.camera = alive;
        }
        paths.lists = lists;
        self.settle(paths);
    }

    /// Replaces contributions that are not finite, or negative, by 0.
    pub(super) fn settle(&self, paths: &mut Paths) {
        for outcome in &mut paths.outcome {
            if outcome.rgb.iter().any(|v| !v.is_finite() || *v < 0.0) {
                outcome.rgb = [0.0; 3];
                outcome.rejected = true;
            }
        }
    }
}
