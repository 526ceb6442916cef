//! What things are called, and where they are in the world of the scene file.

use crate::scene::{
    Density, Filter, FilterKind, LightKind, Medium, Projection, Space, SphereMap, Texture,
};

pub fn texture_name(texture: &Texture) -> &'static str {
    match texture {
        Texture::Constant(_) => "constant",
        Texture::Scale { .. } => "scale",
        Texture::Mix { .. } => "mix",
        Texture::DirectionMix { .. } => "directionmix",
        Texture::Checkerboard { .. } => "checkerboard",
        Texture::Blocks { .. } => "3D checkerboard",
        Texture::Dots { .. } => "dots",
        Texture::Bilerp { .. } => "bilerp",
        Texture::Uv { .. } => "uv",
        Texture::Fbm { .. } => "fbm",
        Texture::Wrinkled { .. } => "wrinkled",
        Texture::Windy { .. } => "windy",
        Texture::Marble { .. } => "marble",
        Texture::Image { .. } => "image",
    }
}

pub fn light_name(light: &LightKind) -> &'static str {
    match light {
        LightKind::Triangle { .. } => "triangle",
        LightKind::Sphere { .. } => "sphere",
        LightKind::ImageTriangle { .. } => "image triangle",
        LightKind::ImageSphere { .. } => "image sphere",
        LightKind::Point { .. } => "point",
        LightKind::Spot { .. } => "spot",
        LightKind::Goniometric { .. } => "goniometric",
        LightKind::Projection { .. } => "projection",
        LightKind::Distant { .. } => "distant",
        LightKind::InfiniteConstant { .. } => "constant infinite",
        LightKind::InfiniteImage { .. } => "image infinite",
    }
}

/// `homogeneous`, or the size of its grid.
pub fn medium_name(medium: &Medium) -> String {
    match &medium.density {
        Density::Uniform => "homogeneous".to_string(),
        Density::Grid(grid)
        | Density::Channels {
            extinction: grid, ..
        } => {
            let [x, y, z] = grid.size;
            format!("a grid of {x} x {y} x {z}")
        }
    }
}

/// What light goes through in it.
pub fn medium_does(medium: &Medium) -> String {
    let absorbs = (0..3).any(|c| medium.extinction[c] > medium.scattering[c])
        || matches!(medium.density, Density::Channels { .. });
    let does = [
        (medium.scatters(), "scatters"),
        (absorbs, "absorbs"),
        (medium.shines(), "emits light"),
    ];
    let does: Vec<_> = does.into_iter().filter(|d| d.0).map(|d| d.1).collect();
    does.join(", ")
}

pub fn projection_name(projection: &Projection) -> &'static str {
    match projection {
        Projection::Perspective => "perspective",
        Projection::Orthographic => "orthographic",
        Projection::Sphere(SphereMap::Equirectangular) => "equirectangular",
        Projection::Sphere(SphereMap::EqualArea) => "equal-area",
        Projection::Lenses(_) => "realistic",
    }
}

pub fn film_filter(filter: &Filter) -> String {
    match filter.kind {
        FilterKind::Box => "box".to_string(),
        FilterKind::Triangle => "triangle".to_string(),
        FilterKind::Gaussian { alpha } => format!("Gaussian (alpha {alpha})"),
        FilterKind::Mitchell { b, c } => format!("Mitchell (B {b}, C {c})"),
        FilterKind::Sinc { tau } => format!("Lanczos-windowed sinc (tau {tau})"),
    }
}

/// A point of internal space in the world of the file.
pub fn to_world(space: &Space, p: [f32; 3]) -> [f64; 3] {
    let centre = space.centre.to_array();
    std::array::from_fn(|i| f64::from(p[i]) / space.scale + centre[i])
}
