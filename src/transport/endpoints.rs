//! Endpoints of subpaths: the latest vertex of each.

use super::mis::Partial;
use super::records::*;
use super::sides::Normals;
use crate::scene::NONE;
use crate::simd::{Lanes, Row, UintLanes, Vec3};
use crate::surface::Kind;
use crate::trace::offset;

/// The endpoints of one side's subpaths.
#[derive(Default)]
pub struct Endpoints {
    /// Where they are; one entry a path, as in all tables.
    pub place: Vec<EndpointPlace>,
    /// Normals, and BSDF parameters.
    pub frame: Vec<EndpointFrame>,
    /// Throughput, and the primitive hit.
    pub energy: Vec<EndpointEnergy>,
    /// BSDF kernel.
    pub kind: Vec<Kind>,
    /// The media outside and inside of the surface; empty in a scene without.
    pub media: Vec<[u32; 2]>,
}

impl Endpoints {
    /// Of one endpoint.
    pub(super) const BYTES: usize = size_of::<EndpointPlace>()
        + size_of::<EndpointFrame>()
        + size_of::<EndpointEnergy>()
        + size_of::<Kind>()
        + size_of::<[u32; 2]>();

    pub(super) fn resize(&mut self, n: usize, media: bool) {
        self.place.resize(n, EndpointPlace::default());
        self.frame.resize(n, EndpointFrame::default());
        self.energy.resize(n, EndpointEnergy::default());
        self.kind.resize(n, Kind::Diffuse);
        self.media.resize(if media { n } else { 0 }, [NONE; 2]);
    }
}

/// `N` endpoints.
pub struct Endpoint<L: Lanes> {
    /// Where they are.
    pub place: EndpointPlaceLanes<L>,
    /// Normals, and BSDF parameters.
    pub frame: EndpointFrameLanes<L>,
    /// Throughput, and the primitive hit.
    pub energy: EndpointEnergyLanes<L>,
}

impl Endpoints {
    /// Those of the paths in `list`, 1 to `N`; missing lanes repeat the last.
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
    /// What shading is done with.
    #[inline(always)]
    pub fn normals(&self) -> Normals<L> {
        Normals {
            ng: self.frame.ng,
            ns: self.frame.ns,
            tangent: self.energy.tangent,
        }
    }

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
    /// Where a ray towards `w` starts: off the surface, of geometric normal `ng`, by its error
    /// bound.
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
