//! Cameras that see every direction, in `f64`: directions of places on the film, and the density of
//! directions by counting, cell by cell, the places of the sampled region that show them.

use super::sky::{sphere_of, square_of};
use super::vector::V;
use crate::camera::Region;
use crate::scene::{Film, SphereMap};
use std::f64::consts::{PI, TAU};

/// Direction in camera space of film coordinates `u`, `v`, the frame being `[0, 1]^2`.
pub fn direction(map: SphereMap, u: f64, v: f64) -> V {
    match map {
        SphereMap::Equirectangular => {
            let ((sin_t, cos_t), (sin_p, cos_p)) = ((PI * v).sin_cos(), (TAU * u).sin_cos());
            [sin_t * cos_p, cos_t, sin_t * sin_p]
        }
        SphereMap::EqualArea => {
            let (i, j) = (u.floor(), v.floor());
            let (u, v) = (u - i, v - j);
            let [x, y, z] = if (i + j) % 2.0 == 0.0 {
                sphere_of(u, v)
            } else {
                sphere_of(1.0 - u, 1.0 - v)
            };
            [x, z, y]
        }
    }
}

/// Density over solid angle of unit `d`, in camera space, if raster positions are uniform over
/// `region`.
pub fn density(map: SphereMap, film: &Film, region: &Region, d: V) -> f64 {
    let [x, y, z] = d;
    let (w, h) = (f64::from(film.width), f64::from(film.height));
    // Solid angle of the frame's unit square there.
    let (u, v, square) = match map {
        SphereMap::Equirectangular => {
            let sin = x.hypot(z);
            let u = (z.atan2(x) / TAU).rem_euclid(1.0);
            (u, sin.atan2(y) / PI, TAU * PI * sin)
        }
        SphereMap::EqualArea => {
            let (u, v) = square_of([x, z, y]);
            (u, v, 2.0 * TAU)
        }
    };
    let (x0, y0) = (f64::from(region.x0) / w, f64::from(region.y0) / h);
    let (x1, y1) = (
        x0 + f64::from(region.width) / w,
        y0 + f64::from(region.height) / h,
    );
    let inside = |u: f64, v: f64| u >= x0 && u < x1 && v >= y0 && v < y1;
    let cells = |a: f64, b: f64| a.floor() as i64 - 1..=b.ceil() as i64 + 1;
    let mut places = 0;
    for j in cells(y0, y1) {
        for i in cells(x0, x1) {
            let (a, b) = (i as f64, j as f64);
            let place = match map {
                SphereMap::Equirectangular if j % 2 == 0 => (u + a, v + b),
                SphereMap::Equirectangular => (u + a + 0.5, b + 1.0 - v),
                SphereMap::EqualArea if (i + j) % 2 == 0 => (u + a, v + b),
                SphereMap::EqualArea => (a + 1.0 - u, b + 1.0 - v),
            };
            places += u32::from(inside(place.0, place.1));
        }
    }
    f64::from(places) * (w * h / region.area()) / square
}
