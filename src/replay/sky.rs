//! Environments in `f64`: radiance by direction, and the density of choosing a direction, piecewise constant over texels.
//!
//! The probability of a texel is by definition what the renderer's tables say: the differences of cumulative sums rounded to `f32`. The
//! tables are made once more here.

use super::vector::{V, dot, unit, wide};
use crate::scene::{EnvLayout, LightKind, Scene};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// What escaping rays see of one light.
pub enum Sky {
    Constant(V),
    Image(Map),
}

/// An image around the scene.
pub struct Map {
    width: usize,
    height: usize,
    /// Radiance, as the renderer scales it.
    texels: Vec<V>,
    to_light: [V; 3],
    layout: EnvLayout,
    /// Upper ends of the rows' intervals, and of the texels' within each row.
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Sky {
    /// `None` for lights that do not surround the scene.
    pub fn of(scene: &Scene, light: &LightKind) -> Option<Self> {
        match light {
            LightKind::InfiniteConstant { l } => Some(Sky::Constant(wide(*l))),
            LightKind::InfiniteImage {
                image,
                scale,
                to_light,
                layout,
            } => {
                let image = scene.images.get(*image as usize)?;
                let mut map = Map {
                    width: image.width as usize,
                    height: image.height as usize,
                    texels: (image.texels.iter())
                        .map(|t| std::array::from_fn(|c| f64::from(t[c] * scale[c])))
                        .collect(),
                    to_light: to_light.map(wide),
                    layout: *layout,
                    rows: Vec::new(),
                    columns: Vec::new(),
                };
                map.tabulate();
                Some(Sky::Image(map))
            }
            _ => None,
        }
    }

    /// Radiance from unit `direction`, away from the scene, and density over solid angle of sampling it.
    pub fn seen(&self, direction: V) -> (V, f64) {
        match self {
            Sky::Constant(l) => (*l, 0.5 / TAU),
            Sky::Image(map) => map.seen(direction),
        }
    }

    /// The direction that two primary samples stand for.
    pub fn sample(&self, u: f64, v: f64) -> V {
        match self {
            Sky::Constant(_) => super::warp::sphere(u, v),
            Sky::Image(map) => map.sample(u, v),
        }
    }
}

impl Map {
    /// The density follows the mean of the channels under a tent of two texels' radius, times the sine of a row's angle in a lat-long map.
    fn tabulate(&mut self) {
        let (w, h) = (self.width as i64, self.height as i64);
        let brightness = |x: i64, y: i64| {
            let [r, g, b] = self.texel(x, y).map(|v| v as f32);
            f64::from(((r + g + b) / 3.0).max(0.0))
        };
        let tent = |x: i64, y: i64| -> f64 {
            let weight = |d: i64| if d == 0 { 0.5 } else { 0.25 };
            (-1..=1)
                .flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)))
                .map(|(dx, dy)| weight(dx) * weight(dy) * brightness(x + dx, y + dy))
                .sum()
        };
        let mut columns = Vec::with_capacity(self.texels.len());
        let mut rows = Vec::with_capacity(self.height);
        let mut all = 0.0;
        for y in 0..h {
            let mut ends = Vec::with_capacity(self.width);
            let mut running = 0.0;
            for x in 0..w {
                running += tent(x, y);
                ends.push(running);
            }
            columns.extend(ends.iter().map(|e| rounded(*e, running)));
            let sine = match self.layout {
                EnvLayout::LatLong => ((y as f64 + 0.5) / h as f64 * PI).sin(),
                EnvLayout::EqualArea => 1.0,
            };
            all += running * sine;
            rows.push(all);
        }
        self.rows = rows.iter().map(|e| rounded(*e, all)).collect();
        if let Some(last) = self.rows.last_mut() {
            *last = 1.0;
        }
        self.columns = columns;
    }

    /// A texel; beyond the border, what the layout has there.
    fn texel(&self, x: i64, y: i64) -> V {
        let (w, h) = (self.width as i64, self.height as i64);
        let (x, y) = match self.layout {
            EnvLayout::LatLong => (x.rem_euclid(w), y.clamp(0, h - 1)),
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
        let at = (y * w + x) as usize;
        self.texels.get(at).copied().unwrap_or([0.0; 3])
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
        let (x, y) = (u * self.width as f64, v * self.height as f64);
        let density = self.probability(x as usize, y as usize) * (self.width * self.height) as f64;
        let pdf = if area > 0.0 { density / area } else { 0.0 };
        (self.bilinear(x - 0.5, y - 0.5), pdf)
    }

    fn probability(&self, x: usize, y: usize) -> f64 {
        let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
        let step = |ends: &[f64], i: usize| {
            let end = |i: usize| ends.get(i).copied().unwrap_or(0.0);
            if i == 0 { end(0) } else { end(i) - end(i - 1) }
        };
        step(&self.rows, y) * step(self.row(y), x)
    }

    fn row(&self, y: usize) -> &[f64] {
        let start = y * self.width;
        self.columns.get(start..start + self.width).unwrap_or(&[])
    }

    fn bilinear(&self, x: f64, y: f64) -> V {
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let mut sum = [0.0; 3];
        for (dy, wy) in [(0, 1.0 - fy), (1, fy)] {
            for (dx, wx) in [(0, 1.0 - fx), (1, fx)] {
                let texel = self.texel(x0 as i64 + dx, y0 as i64 + dy);
                for c in 0..3 {
                    sum[c] += wx * wy * texel[c];
                }
            }
        }
        sum
    }

    fn sample(&self, u: f64, v: f64) -> V {
        let (y, fy) = invert(&self.rows, v);
        let (x, fx) = invert(self.row(y), u);
        let u = (x as f64 + fx) / self.width as f64;
        let v = (y as f64 + fy) / self.height as f64;
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

/// A cumulative sum's part of the whole, as the renderer keeps it.
fn rounded(part: f64, whole: f64) -> f64 {
    if whole > 0.0 {
        f64::from((part / whole) as f32)
    } else {
        1.0
    }
}

/// The interval that holds `u`, and where in it.
fn invert(ends: &[f64], u: f64) -> (usize, f64) {
    let i = ends.partition_point(|end| *end <= u);
    let i = i.min(ends.len().saturating_sub(1));
    let start = if i == 0 { 0.0 } else { ends[i - 1] };
    let width = ends.get(i).copied().unwrap_or(1.0) - start;
    let f = if width > 0.0 {
        (u - start) / width
    } else {
        0.5
    };
    (i, f.clamp(0.0, 1.0 - f64::EPSILON))
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
