//! Where primary samples live in the matrix `[dimension][path]`: one description for every
//! evaluator.
//!
//! The samples of a path come in parts: what places it on the film and its lens, the bounces of its
//! camera subpath, the start and the bounces of its light subpath, and what joins them. A part that
//! a scene does not call for has no samples. Multiplexed paths have one part after another, so that
//! a change of strategy moves no sample; path-traced ones have all that belongs to a vertex in
//! one place, so that shorter paths have the first samples of longer ones.

use super::Plan;
use std::ops::Range;

/// From [`Layout::below`] to the samples of the place of a probe.
pub const BELOW_RADIUS: usize = 1;
/// To those of the direction in which light comes out.
pub const BELOW_BOUNCE: usize = 3;
/// To that of the choice of a light.
pub const BELOW_CHOICE: usize = 5;

/// First dimension of every part. An absent part is empty: it starts where the next part starts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// One sample; exists if there is more than one strategy to choose among.
    pub strategy: usize,
    /// Two samples.
    pub raster: usize,
    /// Two samples, if the lens is open.
    pub lens: usize,
    /// One sample, if something disperses light.
    pub wavelength: usize,
    /// [`Self::per_bounce`] samples for every vertex of the camera subpath that scatters.
    pub camera_bounce: usize,
    /// If there are mixtures, one sample for every surface vertex that scatters or is joined; they
    /// choose components.
    pub camera_component: usize,
    /// If there are media, one sample for every ray of the camera subpath: how far it goes.
    pub camera_distance: usize,
    /// If light goes below surfaces, some samples for every vertex of a path-traced path:
    /// the axis of a probe, two for its place, two for the direction in which light comes out, and
    /// those that join that point to a light.
    pub below: usize,
    /// One sample, if there are several lights.
    pub light_choice: usize,
    /// Four samples: position and direction.
    pub emission: usize,
    /// As [`Self::camera_bounce`], of the light subpath.
    pub light_bounce: usize,
    /// As [`Self::camera_component`].
    pub light_component: usize,
    /// As [`Self::camera_distance`].
    pub light_distance: usize,
    /// One sample for every vertex that is joined, if there are several lights.
    pub connection_choice: usize,
    /// Two samples for every vertex that is joined: a point on a light (`s = 1`). Multiplexed
    /// paths are joined once, to a light, the lens, or one of several places on the film (`t = 1`,
    /// only some cameras: `Camera::connects_by_choice`).
    pub connection: usize,
    /// Two samples for every light vertex that is joined to the camera, if the camera reads them;
    /// of multiplexed paths those of [`Self::connection`].
    pub camera_point: usize,
    /// Samples that a bounce reads: two for its direction, and one more if some BSDF has several
    /// lobes.
    pub per_bounce: usize,
    /// Dimensions from vertex to vertex.
    pub strides: Strides,
    /// Rows of the matrix.
    pub total: usize,
}

/// Two dimensions that are spread evenly together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// The one.
    pub first: usize,
    /// The other; `None` for the last of an odd number.
    pub second: Option<usize>,
}

/// Dimensions from the samples of a vertex to those of the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Strides {
    /// Of bounces.
    pub bounce: usize,
    /// Of choices of components.
    pub component: usize,
    /// Of distances in media.
    pub distance: usize,
    /// Of what is for light below surfaces; 0 where there is none.
    pub below: usize,
    /// Of what joins a camera vertex to a light, or a light vertex to the camera.
    pub connection: usize,
}

/// How many vertices the subpaths of bidirectional paths have, at most.
#[derive(Clone, Copy, Debug)]
pub struct Vertices {
    /// Surface vertices of the camera subpath.
    pub camera: usize,
    /// Of these, those that scatter or are joined.
    pub camera_components: usize,
    /// Surface vertices of the light subpath.
    pub light: usize,
    /// Camera vertices that are joined to lights.
    pub direct: usize,
    /// Light vertices that are joined to the camera by two samples.
    pub seen: usize,
}

/// Hands out dimensions.
#[derive(Default)]
struct Dimensions(usize);

impl Dimensions {
    /// The first of `n` further ones.
    fn take(&mut self, n: usize) -> usize {
        let at = self.0;
        self.0 += n;
        at
    }
}

impl Layout {
    /// Of paths of one depth, which choose among `strategies` (numbers of light vertices).
    pub fn multiplexed(plan: &Plan, depth: usize, strategies: &[u32]) -> Self {
        let mut next = Dimensions::default();
        let light = usize::from(strategies.iter().any(|s| *s >= 2));
        let connects = usize::from(strategies.iter().any(|s| *s >= 1));
        let strategy = next.take(usize::from(strategies.len() > 1));
        let vertices = Vertices {
            camera: depth + 1,
            camera_components: depth,
            light: light * depth,
            direct: 0,
            seen: 0,
        };
        let subpaths = Self::subpaths(plan, strategy, vertices, &mut next);
        let connection_choice = next.take(connects * plan.light_choice());
        let connection = next.take(connects * 2);
        Self {
            connection_choice,
            connection,
            camera_point: connection,
            total: next.0,
            ..subpaths
        }
    }

    /// Of path-traced paths of up to `max_depth` scattering events. Every vertex that scatters has
    /// its bounce, its point on a light and its choice of a component in one place.
    pub fn unidirectional(plan: &Plan, max_depth: u32) -> Self {
        let mut next = Dimensions::default();
        let start = Self::start(plan, 0, &mut next);
        // That of the first ray comes before all vertices, the others with the vertices that send
        // them on.
        let camera_distance = next.take(plan.distances());
        let camera_bounce = next.0;
        let connection_choice = camera_bounce + plan.per_bounce;
        let connection = connection_choice + plan.light_choice();
        let camera_component = connection + 2;
        let below = camera_component + plan.components();
        let stride = below + plan.below() + plan.distances() - camera_bounce;
        next.take(max_depth as usize * stride);
        Self {
            camera_bounce,
            camera_component,
            camera_distance,
            below,
            light_distance: next.0,
            light_choice: next.0,
            emission: next.0,
            light_bounce: next.0,
            light_component: next.0,
            connection_choice,
            connection,
            camera_point: next.0,
            strides: Strides {
                bounce: stride,
                component: stride,
                distance: stride,
                below: if plan.subsurface { stride } else { 0 },
                connection: stride,
            },
            total: next.0,
            ..start
        }
    }

    /// Of paths with all strategies that two subpaths of so many vertices make.
    pub fn bidirectional(plan: &Plan, vertices: Vertices) -> Self {
        let mut next = Dimensions::default();
        let subpaths = Self::subpaths(plan, 0, vertices, &mut next);
        let choice = plan.light_choice();
        let connection_choice = next.take((choice + 2) * vertices.direct);
        let camera_point = next.take(2 * vertices.seen);
        Self {
            connection_choice,
            connection: connection_choice + choice,
            camera_point,
            strides: Strides {
                connection: choice + 2,
                ..subpaths.strides
            },
            total: next.0,
            ..subpaths
        }
    }

    /// Both subpaths, one part after another; the vertex that ends one does not scatter.
    fn subpaths(plan: &Plan, strategy: usize, vertices: Vertices, next: &mut Dimensions) -> Self {
        let component = plan.components();
        let light = usize::from(vertices.light > 0);
        let start = Self::start(plan, strategy, next);
        Self {
            camera_bounce: next.take(vertices.camera.saturating_sub(1) * plan.per_bounce),
            camera_component: next.take(vertices.camera_components * component),
            camera_distance: next.take(vertices.camera * plan.distances()),
            light_choice: next.take(light * plan.light_choice()),
            emission: next.take(light * 4),
            light_bounce: next.take(vertices.light.saturating_sub(1) * plan.per_bounce),
            light_component: next.take(vertices.light * component),
            light_distance: next.take(vertices.light * plan.distances()),
            strides: Strides {
                bounce: plan.per_bounce,
                component: 1,
                distance: 1,
                below: 0,
                connection: 0,
            },
            ..start
        }
    }

    /// The parts that all camera subpaths begin with.
    fn start(plan: &Plan, strategy: usize, next: &mut Dimensions) -> Self {
        Self {
            strategy,
            raster: next.take(2),
            lens: next.take(if plan.lens { 2 } else { 0 }),
            wavelength: next.take(usize::from(plan.dispersion)),
            per_bounce: plan.per_bounce,
            ..Self::default()
        }
    }

    /// All dimensions of samples of path tracing or bidirectional path tracing, two by two: those
    /// of a place or a direction together, then the others as they come.
    pub fn pairs(&self) -> Vec<Pair> {
        let each = |first: usize, stride: usize, end: usize| (first..end).step_by(stride.max(1));
        let Strides {
            bounce,
            connection,
            below,
            ..
        } = self.strides;
        // Path-traced paths have all that belongs to a vertex in one place.
        let by_vertex = self.connection < self.camera_component;
        let end = |part: usize| if by_vertex { self.total } else { part };
        let beneath = |first: usize| {
            let first = if below > 0 {
                self.below + first
            } else {
                self.total
            };
            each(first, below, self.total)
        };
        let firsts: Vec<usize> = each(self.raster, 2, self.lens)
            .chain(each(self.lens, 2, self.wavelength))
            .chain(each(self.camera_bounce, bounce, end(self.camera_component)))
            .chain(each(self.emission, 2, self.light_bounce))
            .chain(each(self.light_bounce, bounce, self.light_component))
            .chain(each(self.connection, connection, self.camera_point))
            .chain(each(self.camera_point, 2, self.total))
            .chain(beneath(BELOW_RADIUS))
            .chain(beneath(BELOW_BOUNCE))
            .chain(beneath(self.below_point()))
            .collect();
        let mut alone = vec![true; self.total];
        for first in &firsts {
            alone[*first..first + 2].fill(false);
        }
        let alone: Vec<usize> = (0..self.total).filter(|d| alone[*d]).collect();
        let together = firsts.into_iter().map(|first| Pair {
            first,
            second: Some(first + 1),
        });
        let others = alone.chunks(2).map(|two| Pair {
            first: two[0],
            second: two.get(1).copied(),
        });
        together.chain(others).collect()
    }

    /// From [`Self::below`] to the point on a light.
    pub fn below_point(&self) -> usize {
        BELOW_CHOICE + (self.connection - self.connection_choice)
    }

    /// What the primary samples of multiplexed paths are for, in order; some parts may be empty.
    pub fn parts(&self) -> [(&'static str, Range<usize>); 14] {
        [
            ("strategy", self.strategy..self.raster),
            ("raster position", self.raster..self.lens),
            ("lens", self.lens..self.wavelength),
            ("wavelength", self.wavelength..self.camera_bounce),
            ("camera bounces", self.camera_bounce..self.camera_component),
            (
                "camera components",
                self.camera_component..self.camera_distance,
            ),
            (
                "camera distances in media",
                self.camera_distance..self.light_choice,
            ),
            ("choice of light", self.light_choice..self.emission),
            ("emission", self.emission..self.light_bounce),
            ("light bounces", self.light_bounce..self.light_component),
            (
                "light components",
                self.light_component..self.light_distance,
            ),
            (
                "light distances in media",
                self.light_distance..self.connection_choice,
            ),
            (
                "choice of connected light",
                self.connection_choice..self.connection,
            ),
            ("connected point", self.connection..self.total),
        ]
    }
}

impl Plan {
    /// Samples that choose a light.
    fn light_choice(&self) -> usize {
        usize::from(self.light_choice)
    }

    /// Samples that say how far a ray goes.
    fn distances(&self) -> usize {
        usize::from(self.media)
    }

    /// Samples of a vertex for light below the surface.
    fn below(&self) -> usize {
        match self.subsurface {
            true => BELOW_CHOICE + self.light_choice() + 2,
            false => 0,
        }
    }

    /// Samples that choose the component of a vertex.
    fn components(&self) -> usize {
        usize::from(self.mixtures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;
    use crate::transport::World;
    use crate::transport::bidirectional::BidirectionalLayout;

    const PLAIN: &str =
        "Camera \"perspective\"\nWorldBegin\nLightSource \"point\"\nShape \"sphere\"\n";

    /// Every dimension once, and those of a direction together.
    #[test]
    fn pairs_hold_all_dimensions() {
        let rich = PLAIN
            .replace("\"perspective\"", "\"perspective\" \"float lensradius\" .1")
            .replace(
                "LightSource",
                "LightSource \"point\" \"point3 from\" [0 0 9]\nMaterial \"dielectric\"\nLightSource",
            );
        for text in [PLAIN, &rich] {
            let scene = load_str(text, "layout.pbrt", ".".as_ref()).unwrap();
            let world = World::new(&scene, 4);
            let all = BidirectionalLayout::new(&world).at;
            for layout in (0..4)
                .map(|k| Layout::unidirectional(&world.plan, k))
                .chain([all])
            {
                let pairs = layout.pairs();
                let mut dimensions: Vec<usize> = (pairs
                    .iter()
                    .flat_map(|pair| [Some(pair.first), pair.second]))
                .flatten()
                .collect();
                let has = |first: usize| {
                    let second = Some(first + 1);
                    pairs.contains(&Pair { first, second })
                };
                assert!(has(layout.raster));
                if layout.total > layout.camera_bounce {
                    assert!(has(layout.camera_bounce) && has(layout.connection));
                }
                // The next vertex has its own.
                if layout.total > layout.connection + layout.strides.connection + 1 {
                    assert!(has(layout.camera_bounce + layout.strides.bounce));
                    assert!(has(layout.connection + layout.strides.connection));
                }
                dimensions.sort_unstable();
                assert_eq!(dimensions, Vec::from_iter(0..layout.total), "{text}");
            }
        }
    }

    #[test]
    fn path_traced_paths_have_the_samples_that_their_plan_calls_for() {
        let lens = PLAIN.replace("\"perspective\"", "\"perspective\" \"float lensradius\" .1");
        let two = PLAIN.replace(
            "Shape",
            "LightSource \"point\" \"point3 from\" [0 0 9]\nShape",
        );
        for (text, fixed, each) in [(PLAIN, 2, 4), (&lens, 4, 4), (&two, 2, 5)] {
            let scene = load_str(text, "layout.pbrt", ".".as_ref()).unwrap();
            let world = World::new(&scene, 3);
            for depth in 0..4 {
                let layout = Layout::unidirectional(&world.plan, depth);
                assert_eq!(layout.total, fixed + each * depth as usize, "{text}");
            }
        }
    }
}
