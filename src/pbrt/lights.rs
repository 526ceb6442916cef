//! `LightSource` and `AreaLightSource`.
//!
//! v4 gives every light a photometric unit: its spectrum is divided by the luminous efficacy, then
//! `power` (lumen) or `illuminance` (lux) replace that unit. In linear sRGB this comes to: `rgb`
//! values stand as they are, other spectra have luminance 1 (`Use::Emission`), and `power` divides
//! by the geometric factor alone, as pbrt does.

mod area;
mod images;
mod power;
mod world;

pub(super) use self::area::AreaLight;
use self::images::{goniometric, infinite, projection};
use self::power::{emission, with_unit};
pub(super) use self::world::WorldLight;
use self::world::WorldLightKind;
use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::params::ParamSet;
use super::textures::Tables;
use super::transform::similarity;
use crate::scene::SpotFalloff;

/// Builds the light of a `LightSource` directive placed by `ctm`; `None` if it emits nothing.
pub(super) fn build(
    kind: &str,
    set: &ParamSet,
    ctm: &DAffine3,
    tables: &mut Tables,
    report: &mut Report,
) -> Result<Option<WorldLight>, SceneError> {
    let placed = |p: DVec3| placed(set, ctm, p);
    let built = match kind {
        "point" => {
            let mut i = emission(set, "I")?;
            i = with_unit(set, i, "power", 4.0 * PI)?;
            let from = set.point_or("from", DVec3::ZERO)?;
            let p = match set.dialect {
                // v3 adds `from` to where the transform puts the origin, it does not transform it.
                Dialect::V3 => placed(DVec3::ZERO)? + from,
                Dialect::V4 => placed(from)?,
            };
            (i, WorldLightKind::Point { p, i })
        }
        "spot" => spot(set, ctm, report)?,
        "distant" => {
            let mut l = emission(set, "L")?;
            l = with_unit(set, l, "illuminance", 1.0)?;
            let from = set.point_or("from", DVec3::ZERO)?;
            let to = set.point_or("to", DVec3::Z)?;
            (
                l,
                WorldLightKind::Distant {
                    direction: direction(set, ctm, to - from)?,
                    l,
                },
            )
        }
        "goniometric" => goniometric(set, ctm, placed(DVec3::ZERO)?, tables)?,
        "projection" => projection(set, ctm, placed(DVec3::ZERO)?, tables)?,
        "infinite" => infinite(set, ctm, tables, report)?,
        "exinfinite" if set.dialect == Dialect::V3 => infinite(set, ctm, tables, report)?,
        _ => {
            return Err(set.error(
                "this light is unknown; use point, spot, goniometric, projection, distant or infinite",
            ));
        }
    };
    set.accept(&["nsamples", "samples"]);
    set.finish(report);
    let (power, kind) = built;
    Ok((power != [0.0; 3]).then(|| WorldLight {
        origin: set.site.origin(),
        kind,
    }))
}

fn placed(set: &ParamSet, ctm: &DAffine3, p: DVec3) -> Result<DVec3, SceneError> {
    let p = ctm.transform_point3(p);
    if p.is_finite() {
        Ok(p)
    } else {
        Err(set.error("its position overflows"))
    }
}

fn spot(
    set: &ParamSet,
    ctm: &DAffine3,
    report: &mut Report,
) -> Result<([f32; 3], WorldLightKind), SceneError> {
    let cone = set.float_in("coneangle", 30.0, 0.0, 180.0)?;
    let delta = set.float_in("conedeltaangle", 5.0, 0.0, 180.0)?;
    let (versine_total, versine_full) = (versine(cone), versine(cone - delta));
    let k = PI * (versine_full + versine_total);
    let mut i = with_unit(set, emission(set, "I")?, "power", k)?;
    if versine_total < MIN_VERSINE {
        report.warn_at(&set.site, "its cone is empty, so it sheds no light");
        i = [0.0; 3];
    }
    let from = set.point_or("from", DVec3::ZERO)?;
    let to = set.point_or("to", DVec3::Z)?;
    if similarity(ctm).is_none() {
        report.warn_at(
            &set.site,
            "the cone is circular; shear and stretch of the transform only move it",
        );
    }
    let axis = direction(set, ctm, to - from)?;
    let falloff = match set.dialect {
        Dialect::V3 => SpotFalloff::V3,
        Dialect::V4 => SpotFalloff::V4,
    };
    let kind = WorldLightKind::Spot {
        p: placed(set, ctm, from)?,
        axis,
        i,
        versine_total,
        versine_full,
        falloff,
    };
    Ok((i, kind))
}

/// One minus the cosine below which a cone is empty: its density over solid angle would come near
/// the ends of `f32`.
const MIN_VERSINE: f64 = 1e-30;

/// One minus the cosine of an angle in degrees, with all its digits however small the angle.
fn versine(degrees: f64) -> f64 {
    2.0 * (degrees.to_radians() / 2.0).sin().powi(2)
}

fn direction(set: &ParamSet, ctm: &DAffine3, v: DVec3) -> Result<DVec3, SceneError> {
    ctm.transform_vector3(v).try_normalize().ok_or_else(|| {
        set.error("\"from\" and \"to\" are the same point, so the light has no direction")
    })
}
