//! The workspace of a batch of paths: tables of [`records`](super::records), one per path.

use super::bidirectional::Kept;
use crate::simd::{Lanes, Row, UintLanes, Vec3};
use crate::surface::{Kind, Mode};
use crate::trace::offset;
use crate::transport::World;
use crate::transport::clock::Clock;
use crate::transport::cutout::Through;
use crate::transport::dispersion::Dispersion;
use crate::transport::list::List;
use crate::transport::mis::Partial;
use crate::transport::records::*;
use crate::transport::sort::Sorter;

/// Which subpath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Side {
    Camera = 0,
    Light = 1,
}

impl Side {
    /// What its subpaths carry.
    #[inline(always)]
    pub fn mode(self) -> Mode {
        match self {
            Side::Camera => Mode::Radiance,
            Side::Light => Mode::Importance,
        }
    }
}

/// The endpoints of one side's subpaths.
#[derive(Default)]
pub struct Endpoints {
    pub place: Vec<EndpointPlace>,
    pub frame: Vec<EndpointFrame>,
    pub energy: Vec<EndpointEnergy>,
    /// BSDF kernel.
    pub kind: Vec<Kind>,
}

impl Endpoints {
    /// Of one endpoint.
    pub(super) const BYTES: usize = size_of::<EndpointPlace>()
        + size_of::<EndpointFrame>()
        + size_of::<EndpointEnergy>()
        + size_of::<Kind>();

    pub(super) fn resize(&mut self, n: usize) {
        self.place.resize(n, EndpointPlace::default());
        self.frame.resize(n, EndpointFrame::default());
        self.energy.resize(n, EndpointEnergy::default());
        self.kind.resize(n, Kind::Diffuse);
    }
}

/// What competes with a strategy in its weight: densities of other strategies enter times these, 0 for those that do not run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rivals {
    /// Points sampled on lights (`s = 1`), where a light was met by chance.
    pub direct: f32,
    /// Light subpaths.
    pub light: f32,
    /// Camera subpaths, where a light subpath is joined to the camera.
    pub camera: f32,
}

impl Rivals {
    pub const ALL: Self = Self {
        direct: 1.0,
        light: 1.0,
        camera: 1.0,
    };
    pub const NONE: Self = Self {
        direct: 0.0,
        light: 0.0,
        camera: 0.0,
    };
    /// Of camera subpaths that are joined to points on lights alone.
    pub const UNIDIRECTIONAL: Self = Self {
        light: 0.0,
        ..Self::ALL
    };
}

/// Workspace for up to a fixed number of paths; grows, never shrinks.
pub struct Paths {
    /// Paths in the batch.
    pub n: usize,
    pub ray: Vec<Ray>,
    pub hit: Vec<Hit>,
    pub flight: Vec<Flight>,
    /// By side.
    pub endpoints: [Endpoints; 2],
    /// Parameter rows: first those of the materials, then one per slot, path and side for hits that have their own.
    pub params: Vec<Row>,
    materials: usize,
    /// Paths whose parameter rows are to be evaluated, with material and texture coordinates; the rest of their place is their tip's.
    pub(super) textured: Vec<(u32, u32, [f32; 2])>,
    /// Tips that are of mixtures until a component is chosen: path, material and texture coordinates.
    pub(super) mixed: Vec<(u32, u32, [f32; 2])>,
    /// Paths whose tips are of chosen components, and their shares, until they are in the throughputs.
    pub(super) shares: Vec<(u32, [f32; 3])>,
    /// Wavelengths.
    pub(super) dispersion: Dispersion,
    /// Connections, and their far ends where those are no endpoints.
    pub link: Vec<Link>,
    pub light_end: Vec<LightEnd>,
    pub lens_end: Vec<LensEnd>,
    /// By side.
    pub value: [Vec<EndpointValue>; 2],
    /// What visible connections will add.
    pub contribution: Vec<Contribution>,
    /// Blocked flags of visibility rays.
    pub blocked: Vec<u32>,
    /// Strategy `(s, t)` per path.
    pub s: Vec<u32>,
    pub t: Vec<u32>,
    /// Results.
    pub outcome: Vec<Outcome>,
    /// Puts waves in the order they are traced.
    pub(super) sorter: Sorter,
    /// Rays on their way through cut-outs.
    pub(super) through: Through,
    /// Rays traced so far.
    pub rays: u64,
    /// What competes in weights.
    pub(super) rivals: Rivals,
    /// `t = 1` of bidirectional evaluations, `[s - 2][path]`: what each light vertex joined to the camera adds, and where. 0 if nothing;
    /// the raster position then means nothing.
    pub splats: Vec<Vec<Outcome>>,
    /// By strategy of a bidirectional evaluation that is asked for them, and path.
    pub parts: Vec<Vec<Contribution>>,
    /// Those of the strategy at work; empty if nobody asks.
    pub(super) part: Vec<Contribution>,
    /// All vertices of both subpaths; only bidirectional evaluations keep them.
    pub(super) kept: Kept,
    /// Which of the parameter rows that each tip has are in use.
    pub(super) slot: usize,
    slots: usize,
    pub(super) lists: Lists,
    /// Where the time goes.
    pub clock: Clock,
}

/// Index lists, kept between batches for their memory.
#[derive(Default)]
pub struct Lists {
    pub camera: List,
    pub light: List,
    pub trace: List,
    pub queues: [List; Kind::ALL.len()],
    pub emission: List,
    pub escaped: List,
    pub starting: List,
    pub direct: List,
    pub lens: List,
    pub general: List,
    pub scratch: List,
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

    pub fn clear(&mut self) {
        self.all().for_each(List::clear);
    }
}

impl Paths {
    pub fn new(world: &World) -> Self {
        let materials = world.materials.rows.len();
        Self {
            n: 0,
            ray: Vec::new(),
            hit: Vec::new(),
            flight: Vec::new(),
            endpoints: Default::default(),
            params: world.materials.rows.clone(),
            materials,
            textured: Vec::new(),
            mixed: Vec::new(),
            shares: Vec::new(),
            dispersion: Dispersion::default(),
            link: Vec::new(),
            light_end: Vec::new(),
            lens_end: Vec::new(),
            value: Default::default(),
            contribution: Vec::new(),
            blocked: Vec::new(),
            s: Vec::new(),
            t: Vec::new(),
            outcome: Vec::new(),
            sorter: Sorter::default(),
            through: Through::default(),
            rays: 0,
            rivals: Rivals::ALL,
            splats: Vec::new(),
            parts: Vec::new(),
            part: Vec::new(),
            kept: Kept::default(),
            slot: 0,
            slots: 1,
            lists: Lists::default(),
            clock: Clock::default(),
        }
    }

    /// Makes room for `n` paths and clears their outcomes.
    pub fn resize(&mut self, n: usize) {
        self.n = n;
        if self.ray.len() < n {
            self.ray.resize(n, Ray::default());
            self.hit.resize(n, Hit::default());
            self.flight.resize(n, Flight::default());
            self.link.resize(n, Link::default());
            self.light_end.resize(n, LightEnd::default());
            self.lens_end.resize(n, LensEnd::default());
            for value in &mut self.value {
                value.resize(n, EndpointValue::default());
            }
            self.contribution.resize(n, Contribution::default());
            for endpoints in &mut self.endpoints {
                endpoints.resize(n);
            }
            self.params
                .resize(self.materials + 2 * n * self.slots, Row::default());
            self.textured.reserve(n);
            self.mixed.reserve(n);
            self.shares.reserve(n);
            self.blocked.resize(n, 0);
            self.s.resize(n, 0);
            self.t.resize(n, 0);
        }
        self.outcome.clear();
        self.outcome.resize(n, Outcome::default());
        if self.lists.room < n {
            self.lists.reserve(n);
        }
    }

    /// Paths there is room for.
    pub(super) fn room(&self) -> usize {
        self.ray.len()
    }

    /// Gives every tip so many parameter rows of its own.
    pub(super) fn reserve_slots(&mut self, slots: usize) {
        if self.slots < slots {
            self.slots = slots;
            let rows = self.materials + 2 * self.room() * slots;
            self.params.resize(rows, Row::default());
        }
    }

    /// The parameter row reserved for a tip that has its own.
    #[inline(always)]
    pub(super) fn own_params(&self, side: Side, path: u32) -> u32 {
        let tip = self.slot * self.room() + path as usize;
        (self.materials + 2 * tip + side as usize) as u32
    }

    /// True if the ray of `path` hit nothing.
    #[inline(always)]
    pub(super) fn missed(&self, path: u32) -> bool {
        self.hit[path as usize].is_none()
    }
}

/// `N` endpoints.
pub struct Endpoint<L: Lanes> {
    pub place: EndpointPlaceLanes<L>,
    pub frame: EndpointFrameLanes<L>,
    pub energy: EndpointEnergyLanes<L>,
}

impl Endpoints {
    #[inline(always)]
    pub fn load<L: Lanes>(&self, list: &[u32]) -> Endpoint<L> {
        Endpoint {
            place: EndpointPlaceLanes::load(&self.place, list),
            frame: EndpointFrameLanes::load(&self.frame, list),
            energy: EndpointEnergyLanes::load(&self.energy, list),
        }
    }
}

impl<L: Lanes> Endpoint<L> {
    /// The running sums of the subpath.
    #[inline(always)]
    pub fn partial(&self) -> Partial<L> {
        Partial {
            d_vcm: self.place.d_vcm,
            d_vc: self.frame.d_vc,
        }
    }
}

impl<L: Lanes> EndpointPlaceLanes<L> {
    /// Where a ray towards `w` starts: off the surface, of geometric normal `ng`, by its error bound.
    #[inline(always)]
    pub fn leave(&self, ng: Vec3<L>, w: Vec3<L>) -> Vec3<L> {
        offset::leave(self.p, self.error, ng, w)
    }
}

impl<L: Lanes> EndpointFrameLanes<L> {
    /// The parameter rows of the BSDFs.
    #[inline(always)]
    pub fn load_params(&self, params: &[Row], n: usize) -> [L; Row::WIDTH] {
        let mut rows = [0u32; 8];
        for (i, row) in rows.iter_mut().enumerate().take(n) {
            *row = self.params.lane(i);
        }
        L::load_rows(params, &rows[..n])
    }
}
