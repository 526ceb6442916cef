//! Evaluating batches of paths from their primary samples, wave by wave.

use super::World;
use super::clock::Stage;
use super::media::How;
use super::paths::{Lists, Paths, Side};
use super::probe::{Ended, Probe};
use super::records::Splat;
use super::samples::{Bounce, ComponentSamples, ConnectionSamples, Samples};
use super::subsurface::BelowSamples;
use super::weigh::{Sink, StrategyMask};
use crate::plan::{BELOW_BOUNCE, BELOW_CHOICE, DepthPlan, Layout, Plan};
use crate::simd::Lanes;

/// Primary samples of path-traced paths.
#[derive(Clone, Copy, Debug)]
pub struct UnidirectionalLayout {
    /// Scattering events of the longest paths.
    pub max_depth: u32,
    at: Layout,
}

impl UnidirectionalLayout {
    /// The first of two samples that place a path on the film.
    pub const RASTER: usize = 0;

    /// Of paths with up to `max_depth` scattering events.
    pub fn new(plan: &Plan, max_depth: u32) -> Self {
        Self {
            max_depth,
            at: Layout::unidirectional(plan, max_depth),
        }
    }

    /// Where primary samples are.
    pub fn dimensions(&self) -> &Layout {
        &self.at
    }

    /// Rows of the sample matrix.
    pub fn total(&self) -> usize {
        self.at.total
    }

    /// The bounce of a vertex with `depth` scattering events before it, and what joins it to a
    /// light.
    fn at(&self, depth: u32) -> (Bounce, ConnectionSamples) {
        let (at, depth) = (&self.at, depth as usize);
        let further = depth * at.strides.connection;
        let connection = ConnectionSamples {
            choice: at.connection_choice + further,
            point: at.connection + further,
        };
        (
            Bounce::at(at.camera_bounce + depth * at.strides.bounce),
            connection,
        )
    }

    /// The samples of light below the surface of a vertex with `depth` scattering events before it.
    fn below(&self, depth: u32) -> BelowSamples {
        let at = &self.at;
        let first = at.below + depth as usize * at.strides.below;
        BelowSamples {
            probe: first,
            bounce: Bounce::at(first + BELOW_BOUNCE),
            connection: ConnectionSamples {
                choice: first + BELOW_CHOICE,
                point: first + at.below_point(),
            },
        }
    }

    /// The sample that says how far the ray goes that has `depth` scattering events behind it.
    fn distance(&self, depth: u32) -> Bounce {
        Bounce::at(self.at.camera_distance + depth as usize * self.at.strides.distance)
    }

    /// The sample that chooses a component at a vertex with `depth` scattering events before it;
    /// the last one does not scatter.
    fn component(&self, depth: u32) -> Option<Bounce> {
        let at = &self.at;
        (depth < self.max_depth)
            .then(|| Bounce::at(at.camera_component + depth as usize * at.strides.component))
    }
}

impl World<'_> {
    /// Multiplexed evaluation (Hachisuka et al. 2014): path `i` of `n` takes column `i` of
    /// `samples`, laid out as `depth.layout`, chooses a strategy `(s, t)` with `s + t = depth +
    /// 2`, and leaves its contribution in `paths.splats.camera[i]`.
    ///
    /// A path costs `depth + 1` rays whatever its strategy, so the batch marches in lockstep: wave
    /// `w` traces the `w`-th ray of every live path, camera and light subpaths alike, and the
    /// visibility rays go last.
    #[inline(always)]
    pub fn evaluate_multiplexed<L: Lanes>(
        &self,
        depth: &DepthPlan,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        self.evaluate_multiplexed_with::<L, ()>(depth, samples, n, paths, &mut ());
    }

    /// The same, while `probe` listens.
    pub fn evaluate_multiplexed_with<L: Lanes, P: Probe>(
        &self,
        depth: &DepthPlan,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
        probe: &mut P,
    ) {
        paths.resize(n);
        if depth.strategies.is_empty() {
            return;
        }
        self.start_wavelengths(samples, depth.layout.wavelength, n, &mut paths.dispersion);
        let mut lists = std::mem::take(&mut paths.lists);
        self.choose_strategies(depth, samples, paths, &mut lists);
        paths.clock.lap(Stage::Sort);
        let at = &depth.layout;
        // With one strategy nothing competes with it.
        let alone = depth.strategies.len() == 1;
        let factors = depth.choice.factors();
        self.start_camera::<L>(
            samples,
            &lists.camera,
            (at.raster, at.lens),
            alone || !self.plan.seen,
            paths.camera_starts(),
            probe,
        );
        let list = (&mut lists.camera, &mut lists.scratch);
        self.drop_blocked(&paths.subpaths.flight, list, probe);
        for wave in 0..=depth.depth {
            // Light subpaths start where the camera's rays are spent.
            self.start_light::<L>(
                samples,
                &lists.starting,
                (at.light_choice, at.emission),
                (&mut paths.rays.ray, &mut paths.subpaths.flight),
                &mut lists.light,
                probe,
            );
            paths.clock.lap(Stage::Generate);
            lists.starting.clear();
            lists.trace.clear();
            lists.trace.extend(&lists.camera);
            lists.trace.extend(&lists.light);
            if lists.trace.is_empty() {
                break;
            }
            self.trace::<L>(&mut paths.rays, &lists.trace, &mut paths.clock);
            if self.plan.media {
                self.fly_both::<L>(paths, samples, &lists, (depth, wave));
            }
            self.advance_camera::<L, P>(paths, samples, &mut lists, (depth, wave), probe);
            self.advance_light::<L, P>(paths, samples, &mut lists, (depth, wave), probe);
        }
        let weighing = (StrategyMask::ALL, factors[0]);
        self.meet::<L>(paths, &mut lists, weighing, probe);
        self.escape::<L>(paths, &lists, weighing, probe);
        paths.clock.lap(Stage::Mis);
        let connection = ConnectionSamples {
            choice: at.connection_choice,
            point: at.connection,
        };
        let weighing = (StrategyMask::ALL, factors);
        self.connect::<L>(paths, samples, &mut lists, connection, weighing, probe);
        paths.lists = lists;
        settle(&mut paths.splats.camera);
    }

    /// A primary sample of its own ([`Layout::strategy`]) chooses among the strategies.
    fn choose_strategies(
        &self,
        depth: &DepthPlan,
        samples: &Samples,
        paths: &mut Paths,
        lists: &mut Lists,
    ) {
        lists.clear();
        let n = paths.n;
        let chosen = &mut paths.s[..n];
        if let [only] = depth.strategies[..] {
            chosen.fill(only);
        } else {
            let u = &samples.row(depth.layout.strategy)[..n];
            depth.choice.indices(u, chosen);
            for s in chosen {
                *s = depth.strategies[*s as usize];
            }
        }
        for path in 0..n {
            let s = paths.s[path];
            let t = depth.depth + 2 - s;
            paths.t[path] = t;
            paths.splats.camera[path].s = s;
            lists.camera.push_if(path as u32, t >= 2);
            lists.starting.push_if(path as u32, t < 2);
        }
    }

    /// Camera subpaths have their hits of this wave: they arrive, end, or scatter. `lists.camera`
    /// is left with those that go on.
    fn advance_camera<L: Lanes, P: Probe>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        (depth, wave): (&DepthPlan, u32),
        probe: &mut P,
    ) {
        lists.scratch.clear();
        for &path in &*lists.camera {
            let i = path as usize;
            let missed = paths.rays.missed(path);
            let seen = missed & (paths.t[i] == wave + 2) & (paths.s[i] == 0);
            lists.scratch.push_if(path, !missed);
            lists.escaped.push_if(path, seen);
            if missed {
                probe.ended(path, Ended::Missed(Side::Camera));
            }
        }
        paths.clock.lap(Stage::Sort);
        // In the last wave only paths of `s = 0` are left. Their vertex on the light does not
        // scatter.
        let component = (wave < depth.depth).then(|| {
            Bounce::at(
                depth.layout.camera_component + wave as usize * depth.layout.strides.component,
            )
        });
        let at = (Side::Camera, 0);
        self.arrive_on::<L>(paths, &lists.scratch, at, (samples, component), probe);
        self.weigh_components(&mut paths.subpaths, Side::Camera);
        lists.camera.clear();
        for &path in &*lists.scratch {
            let i = path as usize;
            let (s, ends) = (paths.s[i], paths.t[i] == wave + 2);
            // Nothing can be joined to a delta BSDF.
            let joins = ends & !paths.subpaths.endpoints[0].kind[i].is_delta();
            lists.camera.push_if(path, !ends);
            lists.emission.push_if(path, ends & (s == 0));
            lists.direct.push_if(path, joins & (s == 1));
            lists.starting.push_if(path, joins & (s > 1));
            if ends & !joins & (s > 0) {
                probe.ended(path, Ended::Delta(Side::Camera));
            }
        }
        let at = &depth.layout;
        let bounce = Bounce::at(at.camera_bounce + wave as usize * at.strides.bounce);
        self.scatter_queues::<L, P>(paths, samples, lists, Side::Camera, bounce, probe);
    }

    fn advance_light<L: Lanes, P: Probe>(
        &self,
        paths: &mut Paths,
        samples: &Samples,
        lists: &mut Lists,
        (depth, wave): (&DepthPlan, u32),
        probe: &mut P,
    ) {
        if lists.light.is_empty() {
            return;
        }
        lists.scratch.clear();
        for &path in &*lists.light {
            let missed = paths.rays.missed(path);
            lists.scratch.push_if(path, !missed);
            if missed {
                probe.ended(path, Ended::Missed(Side::Light));
            }
        }
        paths.clock.lap(Stage::Sort);
        let component = Bounce {
            first: depth.layout.light_component,
            per_bounce: 1,
            wave,
        };
        let component = Some(component);
        let at = (Side::Light, 0);
        self.arrive_on::<L>(paths, &lists.scratch, at, (samples, component), probe);
        self.weigh_components(&mut paths.subpaths, Side::Light);
        lists.light.clear();
        if wave + 1 < depth.depth {
            lists.light.extend(&lists.scratch);
        } else {
            // All rays but the visibility ray are spent.
            for &path in &*lists.scratch {
                let joins = !paths.subpaths.endpoints[1].kind[path as usize].is_delta();
                let lens = paths.t[path as usize] == 1;
                lists.lens.push_if(path, joins & lens);
                lists.general.push_if(path, joins & !lens);
                if !joins {
                    probe.ended(path, Ended::Delta(Side::Light));
                }
            }
        }
        let bounce = Bounce {
            first: depth.layout.light_bounce,
            per_bounce: depth.layout.strides.bounce,
            wave,
        };
        self.scatter_queues::<L, P>(paths, samples, lists, Side::Light, bounce, probe);
    }

    /// Path tracing: camera subpaths of up to `layout.max_depth` scattering events, at every vertex
    /// joined to a light (`s = 1`) and, where they meet one, seen (`s = 0`), both weighed
    /// against each other. Leaves the radiance along the first ray in `paths.splats.camera[i]`.
    pub fn evaluate_unidirectional<L: Lanes>(
        &self,
        layout: &UnidirectionalLayout,
        samples: &Samples,
        n: usize,
        paths: &mut Paths,
    ) {
        paths.resize(n);
        let mask = StrategyMask::UNIDIRECTIONAL;
        self.start_wavelengths(samples, layout.at.wavelength, n, &mut paths.dispersion);
        let mut lists = std::mem::take(&mut paths.lists);
        lists.clear();
        for path in 0..n {
            lists.camera.push(path as u32);
        }
        let place = (layout.at.raster, layout.at.lens);
        let starts = paths.camera_starts();
        self.start_camera::<L>(samples, &lists.camera, place, true, starts, &mut ());
        let list = (&mut lists.camera, &mut lists.scratch);
        self.drop_blocked(&paths.subpaths.flight, list, &mut ());
        paths.clock.lap(Stage::Generate);
        for depth in 0..=layout.max_depth {
            if lists.camera.is_empty() {
                break;
            }
            self.trace::<L>(&mut paths.rays, &lists.camera, &mut paths.clock);
            if self.plan.media {
                let last = depth == layout.max_depth;
                let at = layout.distance(depth);
                let how = |_, _| How {
                    straight: last,
                    glows: true,
                };
                self.fly_on::<L>(paths, &lists.camera, (samples, at), how);
                self.shine::<L>(paths, &lists.camera, 1.0);
            }
            lists.escaped.clear();
            lists.emission.clear();
            for &path in &*lists.camera {
                let missed = paths.rays.missed(path);
                lists.escaped.push_if(path, missed);
                lists.emission.push_if(path, !missed);
            }
            paths.clock.lap(Stage::Sort);
            self.escape::<L>(paths, &lists, (mask, 1.0), &mut ());
            paths.clock.lap(Stage::Mis);
            let component = layout.component(depth);
            let at = (Side::Camera, 0);
            self.arrive_on::<L>(paths, &lists.emission, at, (samples, component), &mut ());
            self.meet::<L>(paths, &mut lists, (mask, 1.0), &mut ());
            // What a surface emits is no matter of what it is made of.
            self.weigh_components(&mut paths.subpaths, Side::Camera);
            paths.clock.lap(Stage::Mis);
            if depth == layout.max_depth {
                break;
            }
            lists.camera.clear();
            lists.camera.extend(&lists.emission);
            lists.direct.clear();
            for &path in &*lists.camera {
                let joins = !paths.subpaths.endpoints[0].kind[path as usize].is_delta();
                lists.direct.push_if(path, joins & self.plan.connectable);
            }
            let (bounce, connection) = layout.at(depth);
            let weighing = (mask, &[1.0; 2][..]);
            self.connect::<L>(paths, samples, &mut lists, connection, weighing, &mut ());
            self.scatter_queues::<L, ()>(paths, samples, &mut lists, Side::Camera, bounce, &mut ());
            if self.plan.subsurface {
                self.go_below::<L>(paths, samples, &mut lists, layout.below(depth));
            }
        }
        paths.lists = lists;
        settle(&mut paths.splats.camera);
    }

    /// The subpaths of `list` have hit surfaces.
    pub(super) fn arrive_on<L: Lanes>(
        &self,
        paths: &mut Paths,
        list: &[u32],
        at: (Side, usize),
        (samples, component): (&Samples, Option<Bounce>),
        probe: &mut impl Probe,
    ) {
        let component = ComponentSamples {
            samples,
            at: component,
            t: &paths.t,
        };
        let to = (&mut paths.subpaths, &mut paths.dispersion);
        self.arrive::<L>(&paths.rays, list, to, at, component, probe);
        paths.clock.finish(Stage::Surface, list.len(), L::N);
    }

    /// Camera subpaths in `lists.emission` may have met lights.
    fn meet<L: Lanes>(
        &self,
        paths: &mut Paths,
        lists: &mut Lists,
        weighing: (StrategyMask, f32),
        probe: &mut impl Probe,
    ) {
        let from = (
            &paths.subpaths.endpoints[0],
            &paths.rays.hit[..],
            &paths.subpaths.flight[..],
        );
        let sink = Sink {
            splats: &mut paths.splats.camera,
            part: None,
            dispersion: self.plan.dispersion.then_some(&paths.dispersion),
            kept: None,
            late: self.plan.media,
        };
        let (list, lit) = (&lists.emission, &mut lists.scratch);
        self.emission::<L>(from, list, lit, weighing, sink, probe);
    }

    /// Camera subpaths in `lists.escaped` have left the scene.
    fn escape<L: Lanes>(
        &self,
        paths: &mut Paths,
        lists: &Lists,
        weighing: (StrategyMask, f32),
        probe: &mut impl Probe,
    ) {
        let from = (&paths.rays.ray[..], &paths.subpaths.flight[..]);
        let sink = Sink {
            splats: &mut paths.splats.camera,
            part: None,
            dispersion: self.plan.dispersion.then_some(&paths.dispersion),
            kept: None,
            late: self.plan.media,
        };
        self.environment::<L>(from, &lists.escaped, weighing, sink, probe);
    }
}

/// Replaces contributions that are not finite, or negative, by 0.
pub(super) fn settle(splats: &mut [Splat]) {
    for splat in splats {
        if !is_good(splat.rgb) {
            splat.rgb = [0.0; 3];
            splat.rejected = 1;
        }
    }
}

#[inline(always)]
pub(super) fn is_good([r, g, b]: [f32; 3]) -> bool {
    let good = |v: f32| (0.0..=f32::MAX).contains(&v);
    good(r) & good(g) & good(b)
}
