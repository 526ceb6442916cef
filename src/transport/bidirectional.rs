//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; Veach 1997,
//! section 10.1): one camera and one light subpath a sample, and all strategies of all depths that
//! they make together.
//!
//! Both subpaths of all samples are walked first, wave by wave as elsewhere, and each wave's
//! endpoints are set aside. A strategy `(s, t)` then takes the endpoints of its two vertices back,
//! for all samples at once, and is joined by the kernels that join multiplexed paths: a strategy's
//! visibility rays are one full wave. An endpoint's running sums ([`super::mis`]) are all that a
//! weight needs, here as there, and the weights are the same.
//!
//! A strategy with `t = 1` adds to the picture wherever its light vertex is seen, so that a sample
//! has many raster positions: [`Splats::light`]. Without camera subpaths this is light tracing.

use super::World;
use super::clock::Stage;
use super::connect::{Joining, Weighing};
use super::dispersion::Dispersion;
use super::evaluate::{is_good, settle};
use super::kept::{Kept, KeptVertex};
use super::paths::{Endpoints, Lists, Paths, Side, Splats};
use super::records::{Contribution, Splat};
use super::samples::{Bounce, ConnectionSamples, Samples};
pub use super::strategy::Strategy;
use super::weigh::{Sink, StrategyMask};
use crate::plan::{Layout, Vertices};
use crate::simd::{Lanes, Row};

/// Which strategies run, and where their primary samples are.
#[derive(Clone, Debug)]
pub struct BidirectionalLayout {
    strategies: Vec<Strategy>,
    /// By depth: which of them is `s = 0`.
    seen: Vec<Option<usize>>,
    /// Most surface vertices of a camera subpath, and of a light subpath.
    pub camera_vertices: usize,
    /// Most surface vertices of a light subpath.
    pub light_vertices: usize,
    /// Camera vertices that scatter or are joined.
    camera_components: usize,
    mask: StrategyMask,
    /// By strategy: the most of a contribution that is kept, if chains bring the rest.
    kept: Vec<Option<f32>>,
    parts: bool,
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

    /// Asks evaluations for [`Splats::parts`], too.
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

    /// Raster positions that a path contributes to beside its camera's: lists in [`Splats::light`].
    pub fn splats(&self) -> usize {
        let joined = self.strategies.iter().filter(|strategy| strategy.t == 1);
        joined
            .map(|strategy| strategy.s as usize - 1)
            .max()
            .unwrap_or(0)
    }

    /// Bytes at most that the workspace of a path of up to `max_depth` scattering events takes
    /// beside what all evaluations need; with [`Splats::parts`] or without.
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
    fn connection(&self, strategy: Strategy) -> ConnectionSamples {
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

impl World<'_> {
    /// Bidirectional evaluation: path `i` of `n` takes column `i` of `samples`.
    /// `paths.splats.camera[i]` is left with what its strategies of `t >= 2` add at the
    /// camera's raster position, `paths.splats.light[s - 2][i]` with what its strategy `(s, 1)`
    /// adds, and where. Every strategy is a sample of its own, with its own weight: their sum
    /// over all depths estimates the picture.
    pub fn evaluate_bidirectional<L: Lanes>(
        &self,
        layout: &BidirectionalLayout,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        paths.resize(n);
        let parameters = &mut paths.subpaths.parameters;
        parameters.reserve_slots(layout.camera_vertices.max(layout.light_vertices));
        paths.s[..n].fill(0);
        start_rows(&mut paths.splats.light, layout.splats(), n);
        start_rows(
            &mut paths.splats.parts,
            if layout.parts {
                layout.strategies.len()
            } else {
                0
            },
            n,
        );
        let mut kept = std::mem::take(&mut paths.kept);
        let counts = [layout.camera_vertices, layout.light_vertices];
        kept.start(counts, paths.room(), self.plan.dispersion);
        let mut lists = std::mem::take(&mut paths.lists);
        lists.clear();
        self.start_wavelengths(samples, layout.at.wavelength, n, &mut paths.dispersion);
        self.walk_light::<L>(layout, samples, paths, &mut lists, &mut kept);
        if self.plan.dispersion {
            paths.dispersion.forget();
        }
        self.walk_camera::<L>(layout, samples, paths, &mut lists, &mut kept);
        for index in 0..layout.strategies.len() {
            self.join_strategy::<L>((layout, index), samples, paths, &mut lists, &kept);
        }
        paths.lists = lists;
        paths.kept = kept;
        for (index, splats) in paths.splats.light.iter_mut().enumerate() {
            settle(splats);
            splats.iter_mut().for_each(|o| o.s = index as u32 + 2);
        }
        settle(&mut paths.splats.camera);
        settle_parts(layout, &mut paths.splats);
    }

    fn walk_light<L: Lanes>(
        &self,
        layout: &BidirectionalLayout,
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
        kept: &mut Kept,
    ) {
        if layout.light_vertices == 0 {
            return;
        }
        (0..paths.n).for_each(|path| lists.starting.push(path as u32));
        self.start_light::<L>(
            samples,
            &lists.starting,
            (layout.at.light_choice, layout.at.emission),
            (&mut paths.rays.ray, &mut paths.subpaths.flight),
            &mut lists.light,
            &mut (),
        );
        lists.starting.clear();
        paths.clock.lap(Stage::Generate);
        for wave in 0..layout.light_vertices {
            if lists.light.is_empty() {
                break;
            }
            self.trace::<L>(&mut paths.rays, &lists.light, &mut paths.clock);
            lists.emission.clear();
            for &path in &*lists.light {
                lists.emission.push_if(path, !paths.rays.missed(path));
            }
            paths.clock.lap(Stage::Sort);
            let component = Some(Bounce::at(
                layout.at.light_component + wave * layout.at.strides.component,
            ));
            self.arrive_on::<L>(
                paths,
                &lists.emission,
                (Side::Light, wave),
                (samples, component),
                &mut (),
            );
            self.weigh_components(&mut paths.subpaths, Side::Light);
            self.set_aside::<L>((layout, wave), samples, paths, lists, (Side::Light, kept));
        }
        lists.light.clear();
    }

    /// Puts the endpoints that the subpaths of `lists.emission` have in this wave among the
    /// vertices that are kept; the list of the side is left with those that scatter and go on.
    fn set_aside<L: Lanes>(
        &self,
        (layout, wave): (&BidirectionalLayout, usize),
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
        (side, kept): (Side, &mut Kept),
    ) {
        let vertex = &mut kept.sides[side as usize][wave];
        let arrived = &paths.subpaths.endpoints[side as usize];
        vertex.note(arrived, &paths.dispersion, &lists.emission, side);
        let (on, first, count) = match side {
            Side::Camera => (
                &mut lists.camera,
                layout.at.camera_bounce,
                layout.camera_vertices,
            ),
            Side::Light => (
                &mut lists.light,
                layout.at.light_bounce,
                layout.light_vertices,
            ),
        };
        on.clear();
        if wave + 1 < count {
            on.extend(&lists.emission);
            let bounce = Bounce::at(first + wave * layout.at.strides.bounce);
            self.scatter_queues::<L, ()>(paths, samples, lists, side, bounce, &mut ());
        }
        std::mem::swap(
            &mut paths.subpaths.endpoints[side as usize],
            &mut vertex.endpoints,
        );
    }

    /// Walks the camera subpaths; lights that they meet (`s = 0`) are seen on the way, as long as
    /// the hits are at hand.
    fn walk_camera<L: Lanes>(
        &self,
        layout: &BidirectionalLayout,
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
        kept: &mut Kept,
    ) {
        (0..paths.n).for_each(|path| lists.camera.push(path as u32));
        self.start_camera::<L>(
            samples,
            &lists.camera,
            (layout.at.raster, layout.at.lens),
            !self.plan.connectable,
            paths.camera_starts(),
            &mut (),
        );
        paths.clock.lap(Stage::Generate);
        for wave in 0..layout.camera_vertices {
            if lists.camera.is_empty() {
                break;
            }
            self.trace::<L>(&mut paths.rays, &lists.camera, &mut paths.clock);
            lists.escaped.clear();
            lists.emission.clear();
            let seen = layout.seen[wave];
            for &path in &*lists.camera {
                let missed = paths.rays.missed(path);
                lists.escaped.push_if(path, missed & seen.is_some());
                lists.emission.push_if(path, !missed);
            }
            paths.clock.lap(Stage::Sort);
            // Lights that are seen directly are seen by no other strategy.
            let mask = if wave == 0 {
                StrategyMask::NONE
            } else {
                layout.mask
            };
            if let Some(index) = seen {
                let from = (&paths.rays.ray[..], &paths.subpaths.flight[..]);
                let sink = sink(
                    self,
                    layout,
                    (&mut paths.splats, &paths.dispersion),
                    (None, index),
                );
                self.environment::<L>(from, &lists.escaped, (mask, 1.0), sink, &mut ());
            }
            paths.clock.lap(Stage::Mis);
            let component = (wave < layout.camera_components).then(|| {
                Bounce::at(layout.at.camera_component + wave * layout.at.strides.component)
            });
            self.arrive_on::<L>(
                paths,
                &lists.emission,
                (Side::Camera, wave),
                (samples, component),
                &mut (),
            );
            if let Some(index) = seen {
                let from = (&paths.subpaths.endpoints[0], &paths.rays.hit[..]);
                let sink = sink(
                    self,
                    layout,
                    (&mut paths.splats, &paths.dispersion),
                    (None, index),
                );
                let (list, lit) = (&lists.emission, &mut lists.scratch);
                self.emission::<L>(from, list, lit, (mask, 1.0), sink, &mut ());
            }
            // What a surface emits is no matter of what it is made of.
            self.weigh_components(&mut paths.subpaths, Side::Camera);
            paths.clock.lap(Stage::Mis);
            self.set_aside::<L>((layout, wave), samples, paths, lists, (Side::Camera, kept));
        }
        lists.camera.clear();
    }

    /// Joins the vertices of the strategy `index`, if it joins any.
    fn join_strategy<L: Lanes>(
        &self,
        (layout, index): (&BidirectionalLayout, usize),
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
        kept: &Kept,
    ) {
        let strategy = layout.strategies[index];
        let [light, camera] = strategy.surfaces();
        if strategy.s == 0 {
            return;
        }
        let [of_camera, of_light] = &kept.sides;
        let of_camera = camera.checked_sub(1).map(|i| &of_camera[i]);
        let of_light = light.checked_sub(1).map(|i| &of_light[i]);
        lists.direct.clear();
        lists.lens.clear();
        lists.general.clear();
        let list = match (of_camera, of_light) {
            (Some(c), Some(l)) => {
                for &path in &*c.joined {
                    lists.general.push_if(path, l.joins[path as usize]);
                }
                &lists.general
            }
            (Some(c), None) => {
                lists.direct.extend(&c.joined);
                &lists.direct
            }
            (None, Some(l)) => {
                lists.lens.extend(&l.joined);
                &lists.lens
            }
            (None, None) => return,
        };
        if list.is_empty() {
            return;
        }
        if self.plan.dispersion {
            for &path in &**list {
                let met =
                    |vertex: Option<&KeptVertex>| vertex.is_some_and(|v| v.has_dispersed(path));
                paths.dispersion.set(path, met(of_camera) | met(of_light));
            }
        }
        let none = Endpoints::default();
        let [of_camera, of_light] =
            [of_camera, of_light].map(|vertex| vertex.map_or(&none, |v| &v.endpoints));
        let place = (strategy.t == 1).then(|| strategy.s as usize - 2);
        let joining = Joining {
            endpoints: [of_camera, of_light],
            params: &paths.subpaths.parameters.rows,
            rays: &mut paths.rays,
            connections: &mut paths.connections,
            sink: sink(
                self,
                layout,
                (&mut paths.splats, &paths.dispersion),
                (place, index),
            ),
            clock: &mut paths.clock,
        };
        let weighing = Weighing {
            mask: layout.mask,
            // Every strategy runs once a path.
            factors: &[1.0; 2],
            s: &paths.s,
        };
        let at = layout.connection(strategy);
        self.join::<L, _>(joining, samples, lists, at, weighing, &mut ());
    }
}

/// Where a strategy adds: to the camera's raster position or to that of a light vertex, and to the
/// part of its index if that is asked for.
fn sink<'a>(
    world: &World,
    layout: &BidirectionalLayout,
    (splats, dispersion): (&'a mut Splats, &'a Dispersion),
    (light, index): (Option<usize>, usize),
) -> Sink<'a> {
    Sink {
        splats: match light {
            Some(vertex) => &mut splats.light[vertex],
            None => &mut splats.camera,
        },
        part: splats.parts.get_mut(index).map(|part| &mut part[..]),
        dispersion: world.plan.dispersion.then_some(dispersion),
        kept: layout.kept[index],
    }
}

/// Makes `count` rows of `n` zeroes.
fn start_rows<T: Copy + Default>(rows: &mut Vec<Vec<T>>, count: usize, n: usize) {
    rows.resize_with(count, Vec::new);
    for row in rows {
        row.clear();
        row.resize(n, T::default());
    }
}

/// Parts are left out with what they are of, and where they are not finite themselves.
fn settle_parts(layout: &BidirectionalLayout, splats: &mut Splats) {
    for (strategy, parts) in layout.strategies.iter().zip(&mut splats.parts) {
        let whole = match strategy.t {
            1 => &splats.light[strategy.s as usize - 2],
            _ => &splats.camera,
        };
        for (part, whole) in parts.iter_mut().zip(whole) {
            if whole.rejected != 0 || !is_good(part.weighted) {
                part.weighted = [0.0; 3];
            }
            if !is_good(part.unweighted) {
                part.unweighted = [0.0; 3];
            }
        }
    }
}
