//! Effects that are on though a scene does not call for them.

/// Effects that can be turned on in a scene that does not call for them, to see what they cost and
/// that they change nothing.
///
/// The picture stays the same but for noise. Those that move no primary samples and no directions
/// (all but [`Lobes`](Self::Lobes), [`Tangents`](Self::Tangents), [`Dispersion`](Self::Dispersion),
/// [`Mixtures`](Self::Mixtures), [`LightChoice`](Self::LightChoice), [`Lens`](Self::Lens) and
/// [`Strategies`](Self::Strategies)) leave every bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Forced {
    /// Everything below.
    All,
    /// A queue for every kind of BSDF.
    Surfaces,
    /// A sample per bounce for the choice of a lobe.
    Lobes,
    /// Texture coordinates, and parameters evaluated per hit.
    Textures,
    /// Tangents at hits.
    Tangents,
    /// Interpolated normals.
    Normals,
    /// A look for bump and normal maps at every textured hit.
    Bumps,
    /// A look for alpha masks at every hit.
    AlphaMasks,
    /// A sample for the wavelength.
    Dispersion,
    /// Samples that choose components of mixtures.
    Mixtures,
    /// Tests for spheres, and for large surfaces.
    Spheres,
    /// A kernel for every kind of light.
    Lights,
    /// A sample for the choice of a light.
    LightChoice,
    /// Samples for a point of the lens.
    Lens,
    /// All strategies, also those that cannot carry light.
    Strategies,
}

impl Forced {
    /// Every group, in the order of the command line's help.
    pub const ALL: [Forced; 15] = [
        Forced::All,
        Forced::Surfaces,
        Forced::Lobes,
        Forced::Textures,
        Forced::Tangents,
        Forced::Normals,
        Forced::Bumps,
        Forced::AlphaMasks,
        Forced::Dispersion,
        Forced::Mixtures,
        Forced::Spheres,
        Forced::Lights,
        Forced::LightChoice,
        Forced::Lens,
        Forced::Strategies,
    ];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Forced::All => "all",
            Forced::Surfaces => "surfaces",
            Forced::Lobes => "lobes",
            Forced::Textures => "textures",
            Forced::Tangents => "tangents",
            Forced::Normals => "normals",
            Forced::Bumps => "bumps",
            Forced::AlphaMasks => "cut-outs",
            Forced::Dispersion => "dispersion",
            Forced::Mixtures => "mixtures",
            Forced::Spheres => "spheres",
            Forced::Lights => "lights",
            Forced::LightChoice => "light-choice",
            Forced::Lens => "lens",
            Forced::Strategies => "strategies",
        }
    }
}
