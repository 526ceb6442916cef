//! `AreaLightSource`.

use std::f64::consts::PI;

use super::images::{image_of, is_black};
use super::power::{check_exclusive, emission_or_image};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::{Channels, Tables};
use crate::scene::Rgb;
use crate::scene::spectrum::luminance;

/// Emission that the shapes after an `AreaLightSource` have.
#[derive(Clone, Debug)]
pub(in crate::pbrt) struct AreaLight {
    pub set: ParamSet,
    l: Rgb,
    pub two_sided: bool,
    /// v4's `power`; the radiance then depends on the area of each primitive.
    power: Option<f64>,
    /// v4's image, that `l` scales.
    pub image: Option<u32>,
    /// Mean luminance of the image as pbrt-v4 has it for `power`, 1 without one.
    mean: f64,
}

impl AreaLight {
    pub fn build(
        kind: &str,
        set: ParamSet,
        tables: &mut Tables,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        if !(kind == "diffuse" || kind == "area" && set.dialect == Dialect::V3) {
            return Err(set.error("this area light is unknown; use \"diffuse\""));
        }
        if set.dialect == Dialect::V3 {
            set.refuse(
                &["filename", "mapname"],
                "area lights of this dialect have no image; use \"rgb L\", or the v4 dialect",
            )?;
        }
        check_exclusive(&set)?;
        let mut l = emission_or_image(&set, "L")?;
        let (mut image, mut mean) = (None, 1.0);
        if set.dialect == Dialect::V4
            && let Some((index, picture)) = image_of(&set, Channels::Rgb, tables)?
        {
            image = Some(index);
            let sum: f64 = (picture.texels.iter())
                .map(|t| f64::from(luminance(*t)))
                .sum();
            mean = sum / picture.texels.len() as f64;
            if is_black(picture) {
                l = [0.0; 3];
            }
        }
        let two_sided = set.bool_or("twosided", false)?;
        let power = match set.dialect {
            Dialect::V3 => None,
            Dialect::V4 => set.float("power")?.filter(|p| *p > 0.0),
        };
        set.accept(&["nsamples", "samples"]);
        set.finish(report);
        Ok(Self {
            set,
            l,
            two_sided,
            power,
            image,
            mean,
        })
    }

    pub fn has_power(&self) -> bool {
        self.power.is_some()
    }

    /// Radiance of a primitive of this area (world space), or what its image is multiplied by.
    pub fn radiance(&self, area: f64) -> Rgb {
        match self.power {
            Some(power) if area > 0.0 && self.mean > 0.0 => {
                let sides = if self.two_sided { 2.0 } else { 1.0 };
                let factor = (power / (sides * area * PI * self.mean)) as f32;
                self.l.map(|c| c * factor)
            }
            _ => self.l,
        }
    }

    pub fn is_black(&self) -> bool {
        self.l == [0.0; 3]
    }
}
