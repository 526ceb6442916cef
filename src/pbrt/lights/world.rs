//! Lights that are no surfaces, in world space until the internal space is known.

use glam::{DMat3, DVec3, Vec3};

use crate::pbrt::transform::narrow_point;
use crate::scene::{EnvLayout, Filtering, Light, LightKind, Rgb, Space, SpotFalloff};

/// A light that is no surface, in world space.
#[derive(Clone, Debug)]
pub(in crate::pbrt) struct WorldLight {
    pub(super) origin: String,
    pub(super) kind: WorldLightKind,
}

#[derive(Clone, Debug)]
pub(super) enum WorldLightKind {
    Point {
        p: DVec3,
        i: Rgb,
    },
    Spot {
        p: DVec3,
        axis: DVec3,
        i: Rgb,
        versine_total: f64,
        versine_full: f64,
        falloff: SpotFalloff,
    },
    Goniometric {
        p: DVec3,
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        layout: EnvLayout,
    },
    Projection {
        p: DVec3,
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        extent: [f64; 2],
        filtering: Filtering,
    },
    Distant {
        direction: DVec3,
        l: Rgb,
    },
    Constant {
        l: Rgb,
    },
    Image {
        image: u32,
        scale: Rgb,
        to_light: DMat3,
        layout: EnvLayout,
    },
}

impl WorldLight {
    /// Memory that it takes here, and in the table of the scene.
    pub fn bytes(&self) -> u64 {
        2 * (size_of::<Self>() + size_of::<Light>() + self.origin.len() + 16) as u64
    }

    /// Where it is, if it shines from a point.
    pub fn position(&self) -> Option<DVec3> {
        match self.kind {
            WorldLightKind::Point { p, .. }
            | WorldLightKind::Spot { p, .. }
            | WorldLightKind::Goniometric { p, .. }
            | WorldLightKind::Projection { p, .. } => Some(p),
            _ => None,
        }
    }

    /// The same light in internal space. Lengths shrink by the scale, and so must the square root
    /// of intensities.
    pub fn to_internal(&self, space: &Space) -> Light {
        let point = |p: DVec3| narrow_point((p - space.centre) * space.scale);
        let intensity =
            |i: Rgb| i.map(|c| ((f64::from(c) * space.scale * space.scale) as f32).min(f32::MAX));
        let unit = |v: DVec3| v.as_vec3().normalize_or(Vec3::Z);
        let rows = |m: DMat3| m.transpose().as_mat3().to_cols_array_2d();
        let kind = match self.kind {
            WorldLightKind::Point { p, i } => LightKind::Point {
                p: point(p),
                i: intensity(i),
            },
            WorldLightKind::Spot {
                p,
                axis,
                i,
                versine_total,
                versine_full,
                falloff,
            } => LightKind::Spot {
                p: point(p),
                axis: unit(axis),
                i: intensity(i),
                versine_total: versine_total as f32,
                versine_full: versine_full as f32,
                falloff,
            },
            WorldLightKind::Goniometric {
                p,
                image,
                scale,
                to_light,
                layout,
            } => LightKind::Goniometric {
                p: point(p),
                image,
                scale: intensity(scale),
                to_light: rows(to_light),
                layout,
            },
            WorldLightKind::Projection {
                p,
                image,
                scale,
                to_light,
                extent,
                filtering,
            } => LightKind::Projection {
                p: point(p),
                image,
                scale: intensity(scale),
                to_light: rows(to_light),
                extent: extent.map(|x| x as f32),
                filtering,
            },
            WorldLightKind::Distant { direction, l } => LightKind::Distant {
                direction: unit(direction),
                l,
            },
            WorldLightKind::Constant { l } => LightKind::InfiniteConstant { l },
            WorldLightKind::Image {
                image,
                scale,
                to_light,
                layout,
            } => LightKind::InfiniteImage {
                image,
                scale,
                to_light: rows(to_light),
                layout,
            },
        };
        Light {
            origin: self.origin.clone(),
            kind,
        }
    }
}
