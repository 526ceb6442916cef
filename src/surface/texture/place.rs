//! Where textures are looked up.

/// Where a texture is evaluated: all of a hit point that textures look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Hit point, internal space.
    pub p: [f32; 3],
    /// Unit geometric normal, either side, internal space.
    pub n: [f32; 3],
}
