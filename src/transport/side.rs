//! The two sides of a path.

use crate::surface::Mode;

/// Which subpath.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Side {
    /// From the lens.
    Camera = 0,
    /// From a light.
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
