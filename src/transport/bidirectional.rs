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
pub use super::bidirectional_layout::BidirectionalLayout;
use super::clock::Stage;
use super::connect::{Joining, Weighing};
use super::dispersion::Dispersion;
use super::evaluate::{is_good, settle};
use super::kept::{Kept, KeptVertex};
use super::media::How;
use super::paths::{Endpoints, Lists, Paths, Side, Splats};
use super::samples::{Bounce, Samples};
pub use super::strategy::Strategy;
use super::weigh::{Sink, StrategyMask};
use crate::simd::Lanes;

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
        kept.start(counts, paths.room(), &self.plan);
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
            if self.plan.media {
                let at = &layout.at;
                let at = Bounce::at(at.light_distance + wave * at.strides.distance);
                self.fly_on::<L>(paths, &lists.light, (samples, at), |_, _| How::default());
            }
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
            !self.plan.seen,
            paths.camera_starts(),
            &mut (),
        );
        let list = (&mut lists.camera, &mut lists.scratch);
        self.drop_blocked(&paths.subpaths.flight, list, &mut ());
        paths.clock.lap(Stage::Generate);
        for wave in 0..layout.camera_vertices {
            if lists.camera.is_empty() {
                break;
            }
            self.trace::<L>(&mut paths.rays, &lists.camera, &mut paths.clock);
            if self.plan.media {
                let at = &layout.at;
                let at = Bounce::at(at.camera_distance + wave * at.strides.distance);
                let last = wave >= layout.camera_components;
                let how = |_, _| How {
                    straight: last,
                    glows: layout.seen[wave].is_some(),
                };
                self.fly_on::<L>(paths, &lists.camera, (samples, at), how);
                self.shine_in::<L>(layout, wave, paths, &lists.camera);
            }
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
                let from = (
                    &paths.subpaths.endpoints[0],
                    &paths.rays.hit[..],
                    &paths.subpaths.flight[..],
                );
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

    /// Adds what media have emitted along the rays of `list` in this wave.
    fn shine_in<L: Lanes>(
        &self,
        layout: &BidirectionalLayout,
        wave: usize,
        paths: &mut Paths,
        list: &[u32],
    ) {
        let Some(index) = layout.seen[wave].filter(|_| self.emits) else {
            return;
        };
        let to = (&mut paths.splats, &paths.dispersion);
        let sink = sink(self, layout, to, (None, index));
        self.glow::<L>(&mut paths.rays, list, 1.0, sink);
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
        late: world.plan.media,
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
