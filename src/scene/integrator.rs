//! What renders a scene, and how much of it.

/// The `Integrator` directive, reduced to what Phalanx can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegratorSettings {
    /// Which integrator.
    pub kind: IntegratorKind,
    /// Bounces of a path, at most.
    pub max_depth: u32,
    /// From `Sampler "integer pixelsamples"` (integrators of independent samples).
    pub pixel_samples: u32,
    /// Of all chains together.
    pub mutations_per_pixel: u64,
    /// Markov chains over all depths.
    pub chains: u64,
    /// Independent paths that start the chains: per depth (`mmlt`, `auto`), or in all (`pssmlt`).
    pub bootstrap_samples: u64,
    /// Of a mutation that forgets where the chain was, 0 to 1.
    pub large_step_probability: f32,
    /// Standard deviation of a small step of a primary sample, which lies in [0, 1].
    pub sigma: f32,
    /// A picture of each bidirectional strategy is wanted, too (`bdpt`).
    pub strategies: bool,
    /// Of the random numbers.
    pub seed: u64,
}

/// The integrators; [`Self::title`] has their names in full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// Bidirectional path tracing, multiplexed Metropolis light transport, or both: a pilot
    /// decides.
    Auto,
    /// Multiplexed Metropolis light transport.
    Mmlt,
    /// Path tracing.
    Pt,
    /// Light tracing.
    Lt,
    /// Bidirectional path tracing.
    Bdpt,
    /// Over a sampler.
    Pssmlt(PathSamplerKind),
}

impl IntegratorKind {
    /// Every one, in the order of reports.
    pub const ALL: [Self; 7] = [
        Self::Auto,
        Self::Mmlt,
        Self::Pt,
        Self::Lt,
        Self::Bdpt,
        Self::Pssmlt(PathSamplerKind::Bdpt),
        Self::Pssmlt(PathSamplerKind::Pt),
    ];

    /// As flags and figures have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Mmlt => "mmlt",
            Self::Pt => "pt",
            Self::Lt => "lt",
            Self::Bdpt => "bdpt",
            Self::Pssmlt(PathSamplerKind::Bdpt) => "pssmlt-bdpt",
            Self::Pssmlt(PathSamplerKind::Pt) => "pssmlt-pt",
        }
    }

    /// In words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Auto => {
                "independent samples where they suffice, chains where they pay: bdpt and mmlt"
            }
            Self::Mmlt => "multiplexed Metropolis light transport",
            Self::Pt => "path tracing",
            Self::Lt => "light tracing",
            Self::Bdpt => "bidirectional path tracing",
            Self::Pssmlt(PathSamplerKind::Bdpt) => {
                "primary sample space Metropolis light transport over bidirectional path tracing"
            }
            Self::Pssmlt(PathSamplerKind::Pt) => {
                "primary sample space Metropolis light transport over path tracing"
            }
        }
    }

    /// True if it mutates paths, or may do so; the others make independent samples.
    pub fn mutates(self) -> bool {
        matches!(self, Self::Auto | Self::Mmlt | Self::Pssmlt(_))
    }
}

/// Whose samples are mutated ([`IntegratorKind::Pssmlt`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathSamplerKind {
    /// The bidirectional one.
    Bdpt,
    /// The path tracer.
    Pt,
}

impl PathSamplerKind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Bdpt, Self::Pt];
}

impl Default for IntegratorSettings {
    /// pbrt's defaults for `Integrator "mlt"`, but for the chains: pbrt's 1000 would leave lanes
    /// empty, and a chain started from the bootstrap is in equilibrium however few steps it
    /// makes.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Auto,
            max_depth: 5,
            pixel_samples: 16,
            mutations_per_pixel: 100,
            chains: 8192,
            bootstrap_samples: 100_000,
            large_step_probability: 0.3,
            sigma: 0.01,
            strategies: false,
            seed: 0,
        }
    }
}
