//! The workspace of a batch of paths: tables of [`records`](super::records), one per path, by what
//! lives together.

pub use super::endpoints::{Endpoint, Endpoints};
use super::kept::Kept;
pub use super::side::Side;
use crate::simd::Row;
use crate::surface::Kind;
use crate::transport::World;
use crate::transport::alpha_mask::Through;
use crate::transport::below::Below;
use crate::transport::clock::Clock;
use crate::transport::dispersion::Dispersion;
use crate::transport::flying::Flying;
use crate::transport::list::List;
use crate::transport::records::*;
use crate::transport::sort::Sorter;
use crate::transport::wavelength::Wavelength;

/// Rays of a wave, and what they met.
#[derive(Default)]
pub struct Rays {
    /// The latest ray of each path.
    pub ray: Vec<Ray>,
    /// What it met.
    pub hit: Vec<Hit>,
    /// Whether visibility rays are blocked.
    pub blocked: Vec<u32>,
    /// Puts waves in the order they are traced.
    pub(super) sorter: Sorter,
    /// Rays on their way through alpha masks.
    pub(super) through: Through,
    /// Rays on their way through media.
    pub(super) flying: Flying,
    /// How many have been traced so far.
    pub traced: u64,
}

impl Rays {
    /// True if the ray of `path` hit nothing.
    #[inline(always)]
    pub(super) fn missed(&self, path: u32) -> bool {
        self.hit[path as usize].is_none()
    }
}

/// Subpaths: on their way, and where they are.
#[derive(Default)]
pub struct Subpaths {
    /// What each path carries to its next vertex; one table for both sides, whose subpaths are
    /// never on their way at once.
    pub flight: Vec<Flight>,
    /// By side.
    pub endpoints: [Endpoints; 2],
    /// Of the BSDFs at the endpoints.
    pub parameters: Parameters,
    /// Those of a wave that are on surfaces, and those in media.
    pub(super) parted: [List; 2],
    /// Below surfaces.
    pub(super) below: Below,
}

/// Parameter rows of BSDFs.
#[derive(Default)]
pub struct Parameters {
    /// First those of the materials, then one per slot, path and side for hits that have their
    /// own. Bidirectional evaluations keep all vertices: their slot is the vertex number. All
    /// others have the slot 0 alone.
    pub rows: Vec<Row>,
    materials: usize,
    slots: usize,
    /// Paths there is room for.
    room: usize,
    /// Paths whose rows are to be evaluated, with material and texture coordinates; the rest of
    /// their place is their endpoint's.
    pub(super) textured: Vec<(u32, u32, [f32; 2])>,
    /// Endpoints that are of mixtures until a component is chosen: path, material and texture
    /// coordinates.
    pub(super) mixed: Vec<(u32, u32, [f32; 2])>,
    /// Paths whose endpoints are of chosen components, and their shares, until they are in the
    /// throughputs.
    pub(super) shares: Vec<(u32, [f32; 3])>,
}

impl Parameters {
    fn resize(&mut self, room: usize) {
        self.room = room;
        self.rows
            .resize(self.materials + 2 * room * self.slots, Row::default());
        self.textured.reserve(room);
        self.mixed.reserve(room);
        self.shares.reserve(room);
    }

    /// Gives every endpoint so many rows of its own.
    pub(super) fn reserve_slots(&mut self, slots: usize) {
        if self.slots < slots {
            self.slots = slots;
            self.resize(self.room);
        }
    }

    /// The material of a path that has arrived, and whose parameters are those of row `row`.
    pub(super) fn material(&self, path: u32, row: u32) -> u32 {
        let own = self.textured.iter().find(|hit| hit.0 == path);
        own.map_or(row, |hit| hit.1)
    }

    /// The share of the component that a path has arrived at, of a mixture; else 1.
    pub(super) fn share(&self, path: u32) -> [f32; 3] {
        let share = self.shares.iter().find(|share| share.0 == path);
        share.map_or([1.0; 3], |share| share.1)
    }

    /// The row reserved for an endpoint that has its own.
    #[inline(always)]
    pub(super) fn own(&self, slot: usize, side: Side, path: u32) -> u32 {
        let endpoint = slot * self.room + path as usize;
        (self.materials + 2 * endpoint + side as usize) as u32
    }
}

/// Connections on their way.
#[derive(Default)]
pub struct Connections {
    /// From the camera's endpoint to the far end.
    pub link: Vec<Link>,
    /// Their far ends, where those are no endpoints.
    pub light_end: Vec<LightEnd>,
    /// As `light_end`, where `t = 1`.
    pub lens_end: Vec<LensEnd>,
    /// By side.
    pub value: [Vec<EndpointValue>; 2],
    /// What waits for visibility.
    pub contribution: Vec<Contribution>,
}

/// What became of paths.
#[derive(Default)]
pub struct Splats {
    /// What each path adds at its own raster position: where its camera ray starts on the film
    /// or, of a multiplexed path with `t = 1`, where the lens sees its light vertex. All but
    /// bidirectional evaluations have no other.
    pub camera: Vec<Splat>,
    /// `t = 1` of bidirectional evaluations, `[s - 2][path]`: what each light vertex joined to the
    /// camera adds, and where. 0 if nothing; the raster position then means nothing.
    pub light: Vec<Vec<Splat>>,
    /// By strategy of a bidirectional evaluation that is asked for them, and path.
    pub parts: Vec<Vec<Contribution>>,
}

/// Workspace for up to a fixed number of paths; grows, never shrinks.
#[derive(Default)]
pub struct Paths {
    /// Paths in the batch.
    pub n: usize,
    /// Of the wave that is being traced.
    pub rays: Rays,
    /// How far both sides have come.
    pub subpaths: Subpaths,
    /// What joins them.
    pub connections: Connections,
    /// Results.
    pub splats: Splats,
    /// Light vertices of the strategy of each path; only of multiplexed paths.
    pub s: Vec<u32>,
    /// Its camera vertices.
    pub t: Vec<u32>,
    /// Wavelengths.
    pub(super) dispersion: Dispersion,
    /// All vertices of both subpaths; only bidirectional evaluations keep them.
    pub(super) kept: Kept,
    pub(super) lists: Lists,
    /// Endpoints know the media around them.
    media: bool,
    /// Subpaths go below surfaces.
    subsurface: bool,
    /// Where the time goes.
    pub clock: Clock,
}

/// Index lists, kept between batches for their memory.
#[derive(Default)]
pub(super) struct Lists {
    /// Camera subpaths on their way: their rays belong to this wave.
    pub camera: List,
    /// Light subpaths on their way.
    pub light: List,
    /// The rays of a wave: those of `camera`, then those of `light`. In the end, the visibility
    /// rays of connections that carry something.
    pub trace: List,
    /// Paths whose endpoint has one kind of BSDF, by kind.
    pub queues: [List; Kind::ALL.len()],
    /// Multiplexed paths of `s = 0` whose camera subpath has come to its last vertex. In the other
    /// evaluators, subpaths that have hit something in this wave.
    pub emission: List,
    /// Camera subpaths that have left the scene where `s = 0` ends them: environments light them.
    pub escaped: List,
    /// Light subpaths that start in the next wave.
    pub starting: List,
    /// Camera endpoints to be joined to a point on a light: `s = 1`.
    pub direct: List,
    /// Light endpoints to be joined to the camera: `t = 1`.
    pub lens: List,
    /// Endpoints of both sides to be joined to each other: `s >= 2`, `t >= 2`.
    pub general: List,
    /// What a stage keeps to itself.
    pub scratch: List,
    /// Of `direct`, `lens` and `general`, those whose link can carry light.
    pub joined: [List; 3],
    /// Paths there is room for.
    room: usize,
}

impl Lists {
    fn all(&mut self) -> impl Iterator<Item = &mut List> {
        [
            &mut self.camera,
            &mut self.light,
            &mut self.trace,
            &mut self.emission,
            &mut self.escaped,
            &mut self.starting,
            &mut self.direct,
            &mut self.lens,
            &mut self.general,
            &mut self.scratch,
        ]
        .into_iter()
        .chain(&mut self.queues)
        .chain(&mut self.joined)
    }

    fn reserve(&mut self, n: usize) {
        self.room = n;
        self.all().for_each(|list| list.reserve(n));
    }

    /// Empties all of them.
    pub fn clear(&mut self) {
        self.all().for_each(List::clear);
    }
}

impl Paths {
    /// No paths yet; the rows of the materials are copied.
    pub fn new(world: &World) -> Self {
        let rows = world.materials.rows.clone();
        let mut paths = Self {
            media: world.plan.media,
            subsurface: world.plan.subsurface,
            ..Self::default()
        };
        paths.subpaths.parameters = Parameters {
            materials: rows.len(),
            rows,
            slots: 1,
            ..Parameters::default()
        };
        paths
    }

    /// Makes room for `n` paths and clears their splats.
    pub fn resize(&mut self, n: usize) {
        self.n = n;
        if self.room() < n {
            let Rays {
                ray, hit, blocked, ..
            } = &mut self.rays;
            ray.resize(n, Ray::default());
            hit.resize(n, Hit::default());
            blocked.resize(n, 0);
            let Subpaths {
                flight,
                endpoints,
                parameters,
                parted: _,
                below,
            } = &mut self.subpaths;
            flight.resize(n, Flight::default());
            endpoints
                .iter_mut()
                .for_each(|side| side.resize(n, self.media));
            parameters.resize(n);
            if self.subsurface {
                below.resize(n);
            }
            let Connections {
                link,
                light_end,
                lens_end,
                value,
                contribution,
            } = &mut self.connections;
            link.resize(n, Link::default());
            light_end.resize(n, LightEnd::default());
            lens_end.resize(n, LensEnd::default());
            for value in value {
                value.resize(n, EndpointValue::default());
            }
            contribution.resize(n, Contribution::default());
            self.s.resize(n, 0);
            self.t.resize(n, 0);
        }
        self.splats.camera.clear();
        self.splats.camera.resize(n, Splat::default());
        if self.lists.room < n {
            self.lists.reserve(n);
        }
    }

    /// Where camera subpaths start.
    pub(super) fn camera_starts(&mut self) -> (&mut [Ray], &mut [Flight], &mut [Splat]) {
        (
            &mut self.rays.ray,
            &mut self.subpaths.flight,
            &mut self.splats.camera,
        )
    }

    /// The wavelength of a path, in a scene with dispersion.
    pub fn wavelength(&self, path: usize) -> Option<Wavelength> {
        self.dispersion.wavelength(path)
    }

    /// Paths there is room for.
    pub(super) fn room(&self) -> usize {
        self.rays.ray.len()
    }
}
