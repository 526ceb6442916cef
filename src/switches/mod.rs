//! Cheaper alternatives to what Phalanx does for the sake of its numbers, to measure what that costs and what it saves.
//!
//! They exist only in a build with the feature `switches`: without it [`on`] is false at compile time, and nothing of them is left in the
//! program. With it the switches of the render under way are one word for the whole process, so renders wait for each other; kernels
//! ask once a packet, a log or a call, never lane by lane.

#[cfg(test)]
mod tests;

/// A cheaper alternative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// The triangle test of Möller and Trumbore in place of the watertight one.
    FastTriangles,
    /// Films that sum in `f64`, rounded at each addition, in place of fixed point.
    FilmF64,
    /// The same in `f32`, as most renderers' films.
    FilmF32,
    /// Polynomials of lower degree for transcendental functions, relative errors about 1e-4.
    CheapMath,
    /// Random numbers of one hash to 32 bits and a linear congruential generator from there on.
    CheapRandom,
}

impl Switch {
    pub const ALL: [Self; 5] = [
        Self::FastTriangles,
        Self::FilmF64,
        Self::FilmF32,
        Self::CheapMath,
        Self::CheapRandom,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::FastTriangles => "fast-triangles",
            Self::FilmF64 => "film-f64",
            Self::FilmF32 => "film-f32",
            Self::CheapMath => "cheap-math",
            Self::CheapRandom => "cheap-random",
        }
    }

    /// The switch of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }
}

/// A set of switches. Without the feature none can be on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches(u32);

impl Switches {
    pub const NONE: Self = Self(0);

    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    /// One switch alone.
    #[cfg(feature = "switches")]
    pub const fn only(switch: Switch) -> Self {
        Self(1 << switch as u32)
    }
}

#[cfg(not(feature = "switches"))]
mod state {
    use super::{Switch, Switches};

    /// Never.
    #[inline(always)]
    pub const fn on(_: Switch) -> bool {
        false
    }

    /// Nothing.
    pub struct Held;

    /// Nothing happens.
    #[inline(always)]
    pub const fn hold(_: Switches) -> Held {
        Held
    }
}

#[cfg(feature = "switches")]
mod state {
    use super::{Switch, Switches};
    use std::sync::atomic::{AtomicU32, Ordering::Relaxed};
    use std::sync::{Mutex, MutexGuard};

    static NOW: AtomicU32 = AtomicU32::new(0);
    static HOLDER: Mutex<()> = Mutex::new(());

    /// Whether a switch of the render under way is on.
    #[inline(always)]
    pub fn on(switch: Switch) -> bool {
        NOW.load(Relaxed) & 1 << switch as u32 != 0
    }

    /// Switches stay as they are until this is dropped, and are then all off.
    pub struct Held {
        _alone: MutexGuard<'static, ()>,
    }

    /// Sets the switches, once nobody else holds them.
    pub fn hold(switches: Switches) -> Held {
        // A holder that panicked has dropped what it held all the same.
        let alone = HOLDER.lock().unwrap_or_else(|p| p.into_inner());
        NOW.store(switches.0, Relaxed);
        Held { _alone: alone }
    }

    impl Drop for Held {
        fn drop(&mut self) {
            NOW.store(0, Relaxed);
        }
    }
}

pub use self::state::{Held, hold, on};
