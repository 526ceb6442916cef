//! Parameters of surfaces of revolution, height fields and NURBS.
//!
//! All of them become triangles, see [`mesh`](super::mesh). pbrt takes parameters that make no
//! surface and draws nothing; so do we, with a warning.

use glam::{DVec3, DVec4};

use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::mesh::{Knots, MeshData, Quadric, height_field, nurbs};
use super::params::{ParamSet, Type};

/// Radians, held to a full turn as in pbrt.
pub(super) fn phi_max(set: &ParamSet) -> Result<f64, SceneError> {
    let degrees = set.float_or("phimax", 360.0)?;
    Ok(degrees.clamp(0.0, 360.0).to_radians())
}

/// Two heights, the lower first.
fn heights(set: &ParamSet, low: f64, high: f64) -> Result<[f64; 2], SceneError> {
    let (a, b) = (set.float_or("zmin", low)?, set.float_or("zmax", high)?);
    Ok([a.min(b), a.max(b)])
}

/// The shape of this kind, if it is one. Of the dialects only v3 has all of them.
pub(super) fn quadric(kind: &str, set: &ParamSet) -> Result<Option<Quadric>, SceneError> {
    let radius = |default| set.float_or("radius", default);
    Ok(Some(match kind {
        "cylinder" => Quadric::Cylinder {
            radius: radius(1.0)?,
            z: heights(set, -1.0, 1.0)?,
        },
        "cone" if set.dialect == Dialect::V3 => Quadric::Cone {
            radius: radius(1.0)?,
            height: set.float_or("height", 1.0)?,
        },
        "paraboloid" if set.dialect == Dialect::V3 => Quadric::Paraboloid {
            radius: radius(1.0)?,
            z: heights(set, 0.0, 1.0)?,
        },
        "hyperboloid" if set.dialect == Dialect::V3 => Quadric::Hyperboloid {
            ends: [
                set.point_or("p1", DVec3::ZERO)?,
                set.point_or("p2", DVec3::ONE)?,
            ],
        },
        _ => return Ok(None),
    }))
}

/// The part of a sphere that is there, or `None` if all of it is.
pub(super) fn part_of_sphere(set: &ParamSet, radius: f64) -> Result<Option<Quadric>, SceneError> {
    let z = heights(set, -radius, radius)?.map(|z| z.clamp(-radius, radius));
    let whole = z == [-radius, radius] && set.float_or("phimax", 360.0)? >= 360.0;
    Ok((!whole).then_some(Quadric::Sphere { radius, z }))
}

/// v3's mesh over a grid, or why there is none.
pub(super) fn grid(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<Result<MeshData, String>, SceneError> {
    let [nu, nv] = match [count(set, "nu")?, count(set, "nv")?] {
        [Some(nu), Some(nv)] => [nu, nv],
        _ => return Ok(Err("needs an \"integer nu\" and an \"integer nv\"".into())),
    };
    if kind == "nurbs" {
        return spline(set, [nu, nv]);
    }
    let heights = set.floats("Pz")?.unwrap_or_default();
    if nu.checked_mul(nv) != Some(heights.len()) {
        let given = heights.len();
        return Ok(Err(format!(
            "has {given} heights \"Pz\", must be {nu} times {nv}"
        )));
    }
    let mut mesh = height_field(nu, heights);
    for warning in mesh.warnings.drain(..) {
        report.warn_at(&set.site, warning);
    }
    Ok(Ok(mesh))
}

fn count(set: &ParamSet, name: &str) -> Result<Option<usize>, SceneError> {
    // Below 0 stands for none.
    let n = set.int_in(name, -1, i64::from(i32::MIN), i64::from(i32::MAX))?;
    Ok(usize::try_from(n).ok())
}

fn spline(set: &ParamSet, [nu, nv]: [usize; 2]) -> Result<Result<MeshData, String>, SceneError> {
    let knots = |points: usize, [order, knots, from, to]: [&str; 4]| {
        let order = count(set, order)?.unwrap_or_default();
        let range = [set.float(from)?, set.float(to)?];
        let list = set.floats(knots)?.unwrap_or_default();
        Ok::<_, SceneError>(Knots::new(points, order, list, range))
    };
    let u = knots(nu, ["uorder", "uknots", "u0", "u1"])?;
    let v = knots(nv, ["vorder", "vknots", "v0", "v1"])?;
    let points: Vec<DVec4> = match set.triples("P", Type::Point3)? {
        Some(points) => points.into_iter().map(|p| p.extend(1.0)).collect(),
        None => {
            let numbers = set.floats("Pw")?.unwrap_or_default();
            let (points, rest) = numbers.as_chunks::<4>();
            if points.is_empty() || !rest.is_empty() {
                return Ok(Err(
                    "needs control points, \"point P\" or four numbers each of \"float Pw\"".into(),
                ));
            }
            points.iter().map(|p| DVec4::from_array(*p)).collect()
        }
    };
    Ok(u.and_then(|u| nurbs(&u, &v?, &points)))
}
