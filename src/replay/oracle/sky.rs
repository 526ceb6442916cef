//! What lights send by direction, in `f64`: environments, and points whose intensity an image
//! gives. With it the density of choosing a direction, piecewise constant over texels.

use super::frustum::Frustum;
use super::texels::{Table, bilinear, brightness, tent};
use super::vector::{V, dot, unit, wide};
use crate::scene::{EnvLayout, Filtering, Image, LightKind, Rgb, Scene};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// What escaping rays see of one light, or what one at a point sends.
pub enum Sky {
    /// The same radiance from everywhere.
    Constant(V),
    /// An image over all directions.
    Image(Map),
    /// An image that a point projects.
    Frustum(Frustum),
}

/// An image around the scene or a point.
pub struct Map {
    width: usize,
    height: usize,
    /// Radiance or intensity, as the renderer scales it.
    texels: Vec<V>,
    to_light: [V; 3],
    layout: EnvLayout,
    filtering: Filtering,
    table: Table,
}

impl Sky {
    /// `None` for lights whose emission is the same in all directions, or has a formula.
    pub fn of(scene: &Scene, light: &LightKind) -> Option<Self> {
        let image = |index: u32| scene.images.get(index as usize);
        Some(match light {
            LightKind::InfiniteConstant { l } => Sky::Constant(wide(*l)),
            LightKind::InfiniteImage {
                image: index,
                scale,
                to_light,
                layout,
            }
            | LightKind::Goniometric {
                image: index,
                scale,
                to_light,
                layout,
                ..
            } => {
                let image = image(*index)?;
                let filtering = layout.filtering();
                Sky::Image(Map::new(image, *scale, *to_light, *layout, filtering))
            }
            LightKind::Projection {
                image: index,
                scale,
                to_light,
                extent,
                filtering,
                ..
            } => {
                let image = image(*index)?;
                Sky::Frustum(Frustum::new(image, *scale, *to_light, *extent, *filtering))
            }
            _ => return None,
        })
    }

    /// What there is along unit `direction`, away from the scene or the point, and density over
    /// solid angle of sampling it.
    pub fn seen(&self, direction: V) -> (V, f64) {
        match self {
            Sky::Constant(l) => (*l, 0.5 / TAU),
            Sky::Image(map) => map.seen(direction),
            Sky::Frustum(frustum) => frustum.seen(direction),
        }
    }

    /// The direction that two primary samples stand for.
    pub fn sample(&self, u: f64, v: f64) -> V {
        match self {
            Sky::Constant(_) => super::warp::sphere(u, v),
            Sky::Image(map) => map.sample(u, v),
            Sky::Frustum(frustum) => frustum.sample(u, v),
        }
    }
}

impl Map {
    fn new(
        image: &Image,
        scale: Rgb,
        to_light: [[f32; 3]; 3],
        layout: EnvLayout,
        filtering: Filtering,
    ) -> Self {
        let size = [image.width as usize, image.height as usize];
        let texels: Vec<V> = (image.texels.iter())
            .map(|t| std::array::from_fn(|c| f64::from((t[c] * scale[c]).clamp(0.0, f32::MAX))))
            .collect();
        let value = |x, y| brightness(texels[wrapped(layout, size, x, y)]);
        // The sine of a row's angle in a lat-long map.
        let of_row = |y: i64| match layout {
            EnvLayout::LatLong => ((y as f64 + 0.5) / size[1] as f64 * PI).sin(),
            EnvLayout::EqualArea => 1.0,
        };
        let weight = |x, y| match filtering {
            Filtering::Nearest => value(x, y),
            Filtering::Bilinear => tent(value, x, y),
        };
        let table = Table::new(size, weight, of_row);
        Self {
            width: size[0],
            height: size[1],
            texels,
            to_light: to_light.map(wide),
            layout,
            filtering,
            table,
        }
    }

    fn seen(&self, direction: V) -> (V, f64) {
        let local = self.to_light.map(|row| dot(row, direction));
        let (u, v, area) = match self.layout {
            EnvLayout::LatLong => {
                let sin = local[0].hypot(local[1]);
                let turns = local[1].atan2(local[0]) / TAU;
                (
                    turns.rem_euclid(1.0),
                    sin.atan2(local[2]) / PI,
                    TAU * PI * sin,
                )
            }
            EnvLayout::EqualArea => {
                let (u, v) = square_of(local);
                (u, v, 2.0 * TAU)
            }
        };
        if !(u.is_finite() && v.is_finite()) {
            return ([0.0; 3], 0.0);
        }
        let density = self.table.density(u, v);
        let pdf = if area > 0.0 { density / area } else { 0.0 };
        let (x, y) = (u * self.width as f64, v * self.height as f64);
        let texel = |x, y| self.texels[wrapped(self.layout, [self.width, self.height], x, y)];
        let value = match self.filtering {
            Filtering::Nearest => {
                let last = [self.width - 1, self.height - 1].map(|n| n as i64);
                texel((x as i64).min(last[0]), (y as i64).min(last[1]))
            }
            Filtering::Bilinear => bilinear(texel, x - 0.5, y - 0.5),
        };
        (value, pdf)
    }

    fn sample(&self, u: f64, v: f64) -> V {
        let [u, v] = self.table.sample(u, v);
        let local = match self.layout {
            EnvLayout::LatLong => {
                let ((sin_t, cos_t), (sin_p, cos_p)) = ((v * PI).sin_cos(), (u * TAU).sin_cos());
                [sin_t * cos_p, sin_t * sin_p, cos_t]
            }
            EnvLayout::EqualArea => sphere_of(u, v),
        };
        let column = |c: usize| {
            [
                self.to_light[0][c],
                self.to_light[1][c],
                self.to_light[2][c],
            ]
        };
        unit([0, 1, 2].map(|c| dot(column(c), local)))
    }
}

/// Index of a texel; beyond the border, of what the layout has there.
fn wrapped(layout: EnvLayout, [width, height]: [usize; 2], x: i64, y: i64) -> usize {
    let (w, h) = (width as i64, height as i64);
    let (x, y) = match layout {
        EnvLayout::LatLong => (x.rem_euclid(w), y.rem_euclid(h)),
        EnvLayout::EqualArea => {
            // Beyond an edge of the octahedral square lies the same edge, turned round.
            let over = |a: i64, b: i64| match a {
                a if a < 0 => (-1 - a, w - 1 - b),
                a if a >= w => (2 * w - 1 - a, w - 1 - b),
                a => (a, b),
            };
            let (x, y) = over(x, y);
            let (y, x) = over(y, x);
            (x.clamp(0, w - 1), y.clamp(0, h - 1))
        }
    };
    (y * w + x) as usize
}

/// Equal-area octahedral map (Clarberg 2008), unit square to sphere.
pub(super) fn sphere_of(u: f64, v: f64) -> V {
    let (u, v) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    let inside = 1.0 - (u.abs() + v.abs());
    let r = 1.0 - inside.abs();
    let phi = if r > 0.0 {
        ((v.abs() - u.abs()) / r + 1.0) * FRAC_PI_4
    } else {
        FRAC_PI_4
    };
    let s = r * (2.0 - r * r).max(0.0).sqrt();
    let z = (1.0 - r * r).copysign(inside);
    [(phi.cos() * s).copysign(u), (phi.sin() * s).copysign(v), z]
}

/// Its inverse.
pub(super) fn square_of(d: V) -> (f64, f64) {
    let [x, y, z] = d.map(f64::abs);
    // sqrt(1 - |z|) without the difference.
    let r = ((x * x + y * y) / (1.0 + z)).sqrt();
    let v = y.atan2(x) / FRAC_PI_4 / 2.0 * r;
    let u = r - v;
    let (u, v) = if d[2] < 0.0 {
        (1.0 - v, 1.0 - u)
    } else {
        (u, v)
    };
    (
        (u.copysign(d[0]) + 1.0) * 0.5,
        (v.copysign(d[1]) + 1.0) * 0.5,
    )
}
