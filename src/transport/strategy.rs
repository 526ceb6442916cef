//! Bidirectional strategies.

/// A way to make a path: so many vertices from a light, and from the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Strategy {
    /// Vertices of the light subpath, that on the light included.
    pub s: u32,
    /// Vertices of the camera subpath, that on the lens included.
    pub t: u32,
}

impl Strategy {
    /// Scattering events of its paths.
    pub fn depth(self) -> u32 {
        self.s + self.t - 2
    }

    /// How many there are of depths up to `max_depth`, at most.
    pub fn most(max_depth: u32) -> u64 {
        let depths = u64::from(max_depth);
        // One of depth 0, and k + 2 of depth k.
        1 + depths * (depths + 5) / 2
    }

    /// Surface vertices of its light subpath and of its camera subpath.
    pub(super) fn surfaces(self) -> [usize; 2] {
        [self.s, self.t].map(|n| n.saturating_sub(1) as usize)
    }
}
