//! Textures as the file means them: trees of constants, images and procedures, and the mappings
//! that lay them on surfaces.

use super::Rgb;

/// A material parameter: a constant or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Param {
    /// The same everywhere.
    Constant(Rgb),
    /// Index into [`Scene::textures`](super::Scene::textures).
    Texture(u32),
}

/// A texture; children are indices of earlier entries of
/// [`Scene::textures`](super::Scene::textures) or constants, so the table has no cycles. What is a
/// number is one in all three channels.
///
/// pbrt filters procedures by the footprint of camera rays. These are what its filters converge to
/// as the footprint shrinks.
// What the fields mean stands at each kind.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    Constant(Rgb),
    /// Product of two textures.
    Scale {
        a: Param,
        b: Param,
    },
    /// `(1 - amount) * a + amount * b`, per channel.
    Mix {
        a: Param,
        b: Param,
        amount: Param,
    },
    /// v4 `directionmix`: `w * a + (1 - w) * b` with `w = |n . direction|`, `n` the geometric
    /// normal.
    DirectionMix {
        a: Param,
        b: Param,
        /// Unit, internal space.
        direction: [f32; 3],
    },
    /// 2D checkerboard over `mapping`: `a` where `floor(s) + floor(t)` is even.
    Checkerboard {
        a: Param,
        b: Param,
        mapping: Mapping,
    },
    /// 3D checkerboard: `a` where the sum of the three floors in texture space is even.
    Blocks {
        a: Param,
        b: Param,
        to_texture: ToTexture,
    },
    /// `dots`: disks of radius 0.35, shifted at random, in about half of the unit cells of
    /// `mapping`.
    Dots {
        dot: Param,
        ground: Param,
        mapping: Mapping,
    },
    /// Bilinear in `(s, t)`, also beyond the unit square; `v01` is at `s = 0`, `t = 1`.
    Bilerp {
        v00: Rgb,
        v01: Rgb,
        v10: Rgb,
        v11: Rgb,
        mapping: Mapping,
    },
    /// v3 `uv`: the fractional parts of `(s, t)` as red and green.
    Uv {
        mapping: Mapping,
    },
    /// Fractional Brownian motion: octaves of noise.
    Fbm {
        octaves: Octaves,
        to_texture: ToTexture,
    },
    /// Turbulence: octaves of the absolute value of noise.
    Wrinkled {
        octaves: Octaves,
        to_texture: ToTexture,
    },
    /// Waves whose height varies as wind does.
    Windy {
        to_texture: ToTexture,
    },
    /// Bands of fixed colours across `y`, perturbed by noise. Points are scaled by `scale` first.
    Marble {
        octaves: Octaves,
        scale: f32,
        variation: f32,
        spline: MarbleSpline,
        to_texture: ToTexture,
    },
    /// Bilinear look-up; values are `x = scale * texel`, or `max(0, 1 - x)` if `invert` (in this
    /// order, as pbrt-v4). Image row 0 is the top: `t = 1`.
    Image {
        image: u32,
        mapping: Mapping,
        wrap: Wrap,
        scale: f32,
        invert: bool,
    },
}

/// Internal to texture space: three rows of a 3x4 matrix.
pub type ToTexture = [[f32; 4]; 3];

/// `(s, t)` of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mapping {
    /// Of the texture coordinates of the surface.
    Uv(UvMapping),
    /// Of the point in texture space: `s` its angle from `+z` over pi, `t` its azimuth over 2 pi.
    Spherical(ToTexture),
    /// `s` is half a turn plus the azimuth, in turns, `t` is `z`: that of the point, or of the
    /// direction to it if `unit` (v3).
    Cylindrical {
        /// Internal to texture space.
        to_texture: ToTexture,
        /// Whether `z` is that of the direction.
        unit: bool,
    },
    /// `x` and `y`; the vectors and offsets of the mapping are in the matrix.
    Planar(ToTexture),
}

/// `(s, t) = (su * u + du, sv * v + dv)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMapping {
    /// Factor on `u`.
    pub su: f32,
    /// Factor on `v`.
    pub sv: f32,
    /// Added to `u`.
    pub du: f32,
    /// Added to `v`.
    pub dv: f32,
}

/// Octaves of noise, each of 1.99 times the frequency and `roughness` times the amplitude of the
/// one before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octaves {
    /// How many.
    pub count: u32,
    /// Amplitude of an octave over that of the one before.
    pub roughness: f32,
}

/// Which segment of the spline of marble's colours a value between 0 and 1 is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarbleSpline {
    /// pbrt-v3 never goes beyond the second of six, which it extrapolates (`std::min(1, ...)` in
    /// `MarbleTexture::Evaluate`).
    V3,
    /// All six.
    V4,
}

/// What is beyond the border of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    Repeat,
    /// Nothing.
    Black,
    /// Its border.
    Clamp,
    /// An equal-area octahedral map: beyond an edge lies the same edge, turned round.
    Octahedral,
}

impl Mapping {
    /// The map to texture space, unless texture coordinates are mapped.
    pub fn to_texture_mut(&mut self) -> Option<&mut ToTexture> {
        match self {
            Self::Uv(_) => None,
            Self::Spherical(to_texture)
            | Self::Planar(to_texture)
            | Self::Cylindrical { to_texture, .. } => Some(to_texture),
        }
    }
}

impl Texture {
    /// What it is made of.
    pub fn children(&self) -> impl Iterator<Item = Param> + use<> {
        let list = match *self {
            Self::Scale { a, b }
            | Self::DirectionMix { a, b, .. }
            | Self::Checkerboard { a, b, .. }
            | Self::Blocks { a, b, .. } => [Some(a), Some(b), None],
            Self::Dots { dot, ground, .. } => [Some(dot), Some(ground), None],
            Self::Mix { a, b, amount } => [Some(a), Some(b), Some(amount)],
            Self::Constant(_)
            | Self::Bilerp { .. }
            | Self::Uv { .. }
            | Self::Fbm { .. }
            | Self::Wrinkled { .. }
            | Self::Windy { .. }
            | Self::Marble { .. }
            | Self::Image { .. } => [None; 3],
        };
        list.into_iter().flatten()
    }

    /// How it is laid on surfaces, if it is over `(s, t)`.
    pub fn mapping(&self) -> Option<&Mapping> {
        match self {
            Self::Checkerboard { mapping, .. }
            | Self::Dots { mapping, .. }
            | Self::Bilerp { mapping, .. }
            | Self::Uv { mapping }
            | Self::Image { mapping, .. } => Some(mapping),
            _ => None,
        }
    }

    /// The map from internal to texture space, if it looks at points.
    pub fn to_texture_mut(&mut self) -> Option<&mut ToTexture> {
        match self {
            Self::Blocks { to_texture, .. }
            | Self::Fbm { to_texture, .. }
            | Self::Wrinkled { to_texture, .. }
            | Self::Windy { to_texture }
            | Self::Marble { to_texture, .. } => Some(to_texture),
            Self::Checkerboard { mapping, .. }
            | Self::Dots { mapping, .. }
            | Self::Bilerp { mapping, .. }
            | Self::Uv { mapping }
            | Self::Image { mapping, .. } => mapping.to_texture_mut(),
            _ => None,
        }
    }

    /// Looks at texture coordinates, not counting what its children do.
    pub fn uses_uv(&self) -> bool {
        matches!(self.mapping(), Some(Mapping::Uv(_)))
    }

    /// Looks at the point or the normal, not counting what its children do.
    pub fn uses_point(&self) -> bool {
        match self {
            Self::DirectionMix { .. }
            | Self::Blocks { .. }
            | Self::Fbm { .. }
            | Self::Wrinkled { .. }
            | Self::Windy { .. }
            | Self::Marble { .. } => true,
            _ => self.mapping().is_some_and(|m| !matches!(m, Mapping::Uv(_))),
        }
    }
}

impl Param {
    /// Calls `visit` with the textures it is made of, each as often as it is named.
    pub fn visit(self, textures: &[Texture], visit: &mut impl FnMut(u32, &Texture)) {
        if let Self::Texture(index) = self {
            let texture = &textures[index as usize];
            visit(index, texture);
            for child in texture.children() {
                child.visit(textures, visit);
            }
        }
    }

    /// Whether its value depends on texture coordinates.
    pub fn uses_uv(self, textures: &[Texture]) -> bool {
        let mut found = false;
        self.visit(textures, &mut |_, texture| found |= texture.uses_uv());
        found
    }
}
