//! Light that is found only by chance, named from the scene.
//!
//! A path whose neighbouring vertices are nowhere two of which can be joined (light, specular
//! chain, diffuse surface, specular chain, eye) has one strategy: its camera subpath has to hit the
//! light by chance (Veach 1997, section 10.3.4, writes it `L S D S E`). Where the light is small
//! that may never happen in a whole render, and nothing in the picture tells. What lights there are
//! that could be missed so, and how small they are, is known before the first path.
//!
//! Whether a path that has met a light is one of these is known from its weight, which is exactly 1
//! ([`weigh`](crate::transport)): no class has to be told apart by its vertices.

use crate::geometry::Geometry;
use crate::light::LightTable;
use crate::scene::{EnvLayout, Image, LightKind, Rgb, Scene};
use crate::surface::MaterialTable;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Lamps that are counted each by itself; more than these are counted as one.
pub const LAMPS: usize = 16;
/// A part of an environment is a lamp of its own if it is so much brighter than the mean.
const BRIGHT: f64 = 100.0;

/// Lights that camera subpaths can meet, in a scene with specular surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chance {
    /// At most [`LAMPS`].
    pub lamps: Vec<Lamp>,
    /// By material: a specular surface, or a mixture that can be one.
    specular: Vec<bool>,
    /// By light: its lamp, and the lamp of its bright part with the radiance from which on it is
    /// bright.
    of: Vec<(u32, Option<(u32, f32)>)>,
}

/// What one directive has made to shine.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Such as `the light at scene.pbrt:42`.
    pub name: String,
    /// Largest mean channel of its radiance.
    pub radiance: f64,
    /// Its surface over that of a ball that holds the scene; of an environment, the part of all
    /// directions that it fills.
    pub size: f64,
}

/// A lamp before those that are too many are put together.
struct Part {
    lamp: Lamp,
    lights: Vec<(usize, Option<f32>)>,
}

impl Chance {
    /// `None` where no light can hide so: nothing is specular, nothing else can be joined, or all
    /// lights are points.
    pub fn of(
        scene: &Scene,
        materials: &MaterialTable,
        lights: &LightTable,
        geometry: &Geometry,
    ) -> Option<Self> {
        let mut used = vec![false; scene.materials.len()];
        for shape in &scene.shapes {
            used[shape.material as usize] = true;
        }
        let kinds = |m: usize| {
            let parts = materials.components(m).into_iter();
            parts.map(|part| (materials.entries[part].kind, &scene.materials[part]))
        };
        let specular: Vec<bool> = (used.iter().enumerate())
            .map(|(m, used)| *used && kinds(m).any(|(k, of)| k.is_delta() && !of.kind.is_black()))
            .collect();
        if !specular.contains(&true) {
            return None;
        }
        let met = (0..scene.lights.len()).filter(|i| lights.is_met(*i as u32));
        let ball = 4.0 * PI * f64::from(geometry.radius).powi(2);
        let mut parts: Vec<Part> = Vec::new();
        let mut index: BTreeMap<(&str, bool), usize> = BTreeMap::new();
        for light in met {
            let origin = scene.lights[light].origin.as_str();
            let shining = Shining::of(scene, geometry, ball, &scene.lights[light].kind);
            for (bright, (radiance, size)) in shining.parts() {
                let at = *index.entry((origin, bright)).or_insert_with(|| {
                    let what = if bright {
                        "the brightest part of the light"
                    } else {
                        "the light"
                    };
                    parts.push(Part {
                        lamp: Lamp {
                            name: format!("{what} at {origin}"),
                            radiance: 0.0,
                            size: 0.0,
                        },
                        lights: Vec::new(),
                    });
                    parts.len() - 1
                });
                let part = &mut parts[at];
                part.lamp.radiance = part.lamp.radiance.max(radiance);
                part.lamp.size += size;
                let from = bright.then_some(shining.threshold as f32);
                part.lights.push((light, from));
            }
        }
        (!parts.is_empty()).then(|| Self::gather(parts, specular, scene.lights.len()))
    }

    /// Puts the dimmest lamps together if there are too many.
    fn gather(mut parts: Vec<Part>, specular: Vec<bool>, lights: usize) -> Self {
        if parts.len() > LAMPS {
            parts.sort_by(|a, b| b.lamp.radiance.total_cmp(&a.lamp.radiance));
            let rest = parts.split_off(LAMPS - 1);
            let mut whole = Part {
                lamp: Lamp {
                    name: format!("{} other lights", rest.len()),
                    radiance: 0.0,
                    size: 0.0,
                },
                lights: Vec::new(),
            };
            for part in rest {
                whole.lamp.radiance = whole.lamp.radiance.max(part.lamp.radiance);
                whole.lamp.size += part.lamp.size;
                whole.lights.extend(part.lights);
            }
            parts.push(whole);
        }
        let mut of = vec![(0, None); lights];
        for (lamp, part) in (0..).zip(&parts) {
            for (light, from) in &part.lights {
                match from {
                    Some(from) => of[*light].1 = Some((lamp, *from)),
                    None => of[*light].0 = lamp,
                }
            }
        }
        Self {
            lamps: parts.into_iter().map(|part| part.lamp).collect(),
            specular,
            of,
        }
    }

    /// The lamp that a light belongs to, where its radiance is so bright.
    pub fn lamp(&self, light: u32, radiance: f32) -> u32 {
        let (lamp, bright) = self.of[light as usize];
        match bright {
            Some((bright, from)) if radiance > from => bright,
            _ => lamp,
        }
    }

    /// Whether a surface of this material can be specular.
    pub fn is_specular(&self, material: u32) -> bool {
        self.specular[material as usize]
    }
}

/// How bright a light is, and how large: whole, and its brightest part if that is another matter.
struct Shining {
    whole: (f64, f64),
    bright: Option<(f64, f64)>,
    threshold: f64,
}

impl Shining {
    fn of(scene: &Scene, geometry: &Geometry, ball: f64, kind: &LightKind) -> Self {
        let even = |radiance: f64, size: f64| Self {
            whole: (radiance, size),
            bright: None,
            threshold: 0.0,
        };
        let triangle = |i: u32| f64::from(geometry.triangle_area(i)) / ball;
        let sphere = |i: u32| f64::from(geometry.sphere_area(i)) / ball;
        let brightest = |image: u32, scale: f32| {
            let texels = scene.images[image as usize].texels.iter();
            let most = texels.map(|t| mean(*t)).fold(0.0, f64::max);
            most * f64::from(scale)
        };
        match kind {
            LightKind::Triangle { triangle: i, l, .. } => even(mean(*l), triangle(*i)),
            LightKind::Sphere { sphere: i, l, .. } => even(mean(*l), sphere(*i)),
            LightKind::ImageTriangle {
                triangle: i,
                image,
                scale,
                ..
            } => even(brightest(*image, *scale), triangle(*i)),
            LightKind::ImageSphere {
                sphere: i,
                image,
                scale,
                ..
            } => even(brightest(*image, *scale), sphere(*i)),
            LightKind::InfiniteConstant { l } => even(mean(*l), 1.0),
            LightKind::InfiniteImage {
                image,
                scale,
                layout,
                ..
            } => Self::environment(&scene.images[*image as usize], *scale, *layout),
            // Nothing meets them by chance.
            LightKind::Point { .. }
            | LightKind::Spot { .. }
            | LightKind::Goniometric { .. }
            | LightKind::Projection { .. }
            | LightKind::Distant { .. } => even(0.0, 0.0),
        }
    }

    fn environment(image: &Image, scale: Rgb, layout: EnvLayout) -> Self {
        let height = f64::from(image.height);
        let rows = (image.texels).chunks_exact((image.width as usize).max(1));
        let texels = || {
            (rows.clone().enumerate()).flat_map(|(y, row)| {
                let weight = match layout {
                    EnvLayout::LatLong => (PI * (y as f64 + 0.5) / height).sin(),
                    EnvLayout::EqualArea => 1.0,
                };
                row.iter().map(move |t| {
                    let scaled: Rgb = std::array::from_fn(|c| t[c] * scale[c]);
                    (mean(scaled), weight)
                })
            })
        };
        let (mut sum, mut weights, mut most) = (0.0, 0.0, 0.0f64);
        for (value, weight) in texels() {
            sum += value * weight;
            weights += weight;
            most = most.max(value);
        }
        let threshold = BRIGHT * sum / weights;
        if most <= threshold || weights <= 0.0 {
            return Self {
                whole: (most, 1.0),
                bright: None,
                threshold: 0.0,
            };
        }
        let bright = texels().filter(|(value, _)| *value > threshold);
        let size = bright.map(|(_, weight)| weight).sum::<f64>() / weights;
        Self {
            whole: (threshold, 1.0),
            bright: Some((most, size)),
            threshold,
        }
    }

    fn parts(&self) -> impl Iterator<Item = (bool, (f64, f64))> {
        let bright = self.bright.map(|bright| (true, bright));
        std::iter::once((false, self.whole)).chain(bright)
    }
}

/// Mean channel, without what is negative.
fn mean(l: Rgb) -> f64 {
    l.iter().map(|v| f64::from(v.max(0.0))).sum::<f64>() / 3.0
}
