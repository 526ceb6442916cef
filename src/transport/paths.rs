//! The workspace of a batch of paths. All records are rows of eight floats ([`Row`]), one per path.

use super::bidirectional::Kept;
use crate::scene::NONE;
use crate::simd::{Lanes, Row, Vec3};
use crate::surface::{Kind, Mode};
use crate::trace::offset;
use crate::transport::World;
use crate::transport::clock::Clock;
use crate::transport::cutout::Through;
use crate::transport::dispersion::Dispersion;
use crate::transport::list::List;
use crate::transport::sides::Normals;
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

/// The end vertices of one side's subpaths.
#[derive(Default)]
pub struct Tips {
    /// `[p (3), error, wo (3), dVCM]`: position, its error bound, unit direction to the previous vertex.
    pub place: Vec<Row>,
    /// `[ng (3), parameter row (bits), ns (3), dVC]`: unit normals.
    pub frame: Vec<Row>,
    /// `[beta (3), primitive (bits), tangent (3), light (bits)]`: throughput, and the light that the primitive is, or [`NONE`].
    pub energy: Vec<Row>,
    /// BSDF kernel.
    pub kind: Vec<Kind>,
}

impl Tips {
    pub(super) fn resize(&mut self, n: usize) {
        for rows in [&mut self.place, &mut self.frame, &mut self.energy] {
            rows.resize(n, Row::default());
        }
        self.kind.resize(n, Kind::Diffuse);
    }
}

/// What became of a path: a [`Row`].
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(32))]
pub struct Outcome {
    /// Contribution, linear sRGB: radiance over the density of the path, MIS weight and choice of strategy included. 0 if the path
    /// carries no light.
    pub rgb: [f32; 3],
    /// Raster position it contributes to.
    pub raster: [f32; 2],
    /// Light vertices of its strategy.
    pub s: u32,
    /// 1 if the contribution was not finite, or negative, and was replaced by 0; else 0.
    pub rejected: u32,
    _unused: u32,
}

impl Outcome {
    /// A path that carries `rgb` to `raster`.
    pub fn new(rgb: [f32; 3], raster: [f32; 2]) -> Self {
        Self {
            rgb,
            raster,
            ..Self::default()
        }
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
    /// Per path `[ox, oy, oz, tmax, dx, dy, dz, 0]`, see [`crate::trace`].
    pub ray: Vec<Row>,
    /// Per path `[t, b1, b2, primitive (bits), ..]`.
    pub hit: Vec<Row>,
    /// Per path `[beta (3), dVCM, dVC, distant (0 or 1), 0, 0]` of the subpath on its way.
    pub flight: Vec<Row>,
    pub tips: [Tips; 2],
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
    /// Connection: `[w (3), distance^2, ..]`, `w` unit from the camera's side to the light's.
    pub link: Vec<Row>,
    /// Connection: `[radiance (3), pdf, emission ratio, by chance, ..]` (`s = 1`) or `[.., pdf, ..]` (`t = 1`).
    pub end: Vec<Row>,
    /// Connection, per side: `[f cos (3), pdf, pdf reverse, |cos ng|, 0, 0]`.
    pub value: [Vec<Row>; 2],
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
    /// By strategy of a bidirectional evaluation that is asked for them, and path: contributions with and without their weight,
    /// `[weighted (3), 0, unweighted (3), 0]`.
    pub parts: Vec<Vec<Row>>,
    /// Those of the strategy at work; empty if nobody asks.
    pub(super) part: Vec<Row>,
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
            tips: Default::default(),
            params: world.materials.rows.clone(),
            materials,
            textured: Vec::new(),
            mixed: Vec::new(),
            shares: Vec::new(),
            dispersion: Dispersion::default(),
            link: Vec::new(),
            end: Vec::new(),
            value: Default::default(),
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
            let [camera_value, light_value] = &mut self.value;
            for rows in [
                &mut self.ray,
                &mut self.hit,
                &mut self.flight,
                &mut self.link,
                &mut self.end,
                camera_value,
                light_value,
            ] {
                rows.resize(n, Row::default());
            }
            for tips in &mut self.tips {
                tips.resize(n);
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
        self.hit[path as usize].0[3].to_bits() == NONE
    }
}

/// A tip loaded for shading.
pub struct Tip<L: Lanes> {
    pub p: Vec3<L>,
    pub error: L,
    pub wo: Vec3<L>,
    pub d_vcm: L,
    pub ng: Vec3<L>,
    pub ns: Vec3<L>,
    pub d_vc: L,
    pub beta: Vec3<L>,
    pub tangent: Vec3<L>,
    /// Parameter row (bits).
    pub params: L,
}

impl Tips {
    #[inline(always)]
    pub fn load<L: Lanes>(&self, list: &[u32]) -> Tip<L> {
        let a = L::load_rows(&self.place, list);
        let b = L::load_rows(&self.frame, list);
        let c = L::load_rows(&self.energy, list);
        Tip {
            p: Vec3::new(a[0], a[1], a[2]),
            error: a[3],
            wo: Vec3::new(a[4], a[5], a[6]),
            d_vcm: a[7],
            ng: Vec3::new(b[0], b[1], b[2]),
            params: b[3],
            ns: Vec3::new(b[4], b[5], b[6]),
            d_vc: b[7],
            beta: Vec3::new(c[0], c[1], c[2]),
            tangent: Vec3::new(c[4], c[5], c[6]),
        }
    }
}

impl<L: Lanes> Tip<L> {
    #[inline(always)]
    pub fn normals(&self) -> Normals<L> {
        Normals {
            ng: self.ng,
            ns: self.ns,
            tangent: self.tangent,
        }
    }

    /// Where a ray towards `w` starts: off the surface by its error bound.
    #[inline(always)]
    pub fn offset(&self, w: Vec3<L>) -> Vec3<L> {
        offset::leave(self.p, self.error, self.ng, w)
    }
}
