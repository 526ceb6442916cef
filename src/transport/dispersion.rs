//! Wavelengths of a batch of paths, and which paths have met what disperses light. All of it is
//! empty in a scene without dispersion.

use super::World;
use super::samples::Samples;
use super::side::Side;
use super::wavelength::{Wavelength, Wavelengths};
use crate::simd::{Lanes, Vec3};

/// The part of a workspace that only scenes with dispersion have.
#[derive(Default)]
pub struct Dispersion {
    /// Of each path.
    wavelength: Vec<Wavelength>,
    /// Some scattering event of the path so far was on a dispersive surface.
    touched: Vec<bool>,
    /// The endpoint of each side is on one.
    endpoint: [Vec<bool>; 2],
}

impl Dispersion {
    /// Gives the first `n` paths the wavelengths that their primary samples stand for.
    pub fn start(&mut self, table: &Wavelengths, samples: &[f32], n: usize) {
        self.touched.clear();
        self.touched.resize(n, false);
        self.wavelength.clear();
        (self.wavelength).extend(samples[..n].iter().map(|u| table.at(*u)));
        for endpoint in &mut self.endpoint {
            endpoint.resize(n, false);
        }
    }

    /// The wavelength of a path; `None` in a scene without dispersion.
    pub fn wavelength(&self, path: usize) -> Option<Wavelength> {
        self.wavelength.get(path).copied()
    }

    /// Wavelength of a path in nanometres; 0 in a scene without dispersion.
    #[inline(always)]
    pub fn nm(&self, path: usize) -> f32 {
        self.wavelength.get(path).map_or(0.0, |w| w.nm)
    }

    /// Notes which of the surfaces that the subpaths of `list` have arrived at are dispersive; all
    /// of those are among `textured`.
    pub fn note(&mut self, list: &[u32], side: Side, textured: impl Iterator<Item = (u32, bool)>) {
        let endpoint = &mut self.endpoint[side as usize];
        for &path in list {
            endpoint[path as usize] = false;
        }
        for (path, dispersive) in textured {
            endpoint[path as usize] = dispersive;
        }
    }

    /// The endpoints of the paths in `list` scatter, or are joined.
    pub fn touch(&mut self, list: &[u32], side: Side) {
        let endpoint = &self.endpoint[side as usize];
        for &path in list {
            self.touched[path as usize] |= endpoint[path as usize];
        }
    }

    /// Starts subpaths anew: nothing has been met.
    pub fn forget(&mut self) {
        self.touched.fill(false);
    }

    /// Whether a path has met what disperses light, up to this side's endpoint.
    #[inline(always)]
    pub fn has_met(&self, path: u32, side: Side) -> bool {
        self.touched[path as usize] | self.endpoint[side as usize][path as usize]
    }

    /// Says of a path whether it has.
    #[inline(always)]
    pub fn set(&mut self, path: u32, touched: bool) {
        self.touched[path as usize] = touched;
    }

    /// `rgb` as light of the paths' wavelengths, where they have one.
    #[inline(always)]
    pub fn colour<L: Lanes>(&self, list: &[u32], rgb: Vec3<L>) -> Vec3<L> {
        let last = list.len() - 1;
        let channel = |c: usize| {
            L::from_fn(|i| {
                let path = list[i.min(last)] as usize;
                if self.touched[path] {
                    self.wavelength[path].colour[c]
                } else {
                    1.0
                }
            })
        };
        rgb.mul_elem(Vec3::new(channel(0), channel(1), channel(2)))
    }
}

impl World<'_> {
    /// Gives the paths their wavelengths, if the scene calls for them; `dimension` is that of their
    /// primary sample.
    pub(super) fn start_wavelengths(
        &self,
        samples: &Samples,
        dimension: usize,
        n: usize,
        dispersion: &mut Dispersion,
    ) {
        if let Some(table) = &self.wavelengths {
            dispersion.start(table, samples.row(dimension), n);
        }
    }
}
