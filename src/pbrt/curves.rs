//! Parameters of `curve` shapes.

use super::error::{Report, SceneError};
use super::mesh::{Basis, CurvePiece};
use super::params::{ParamSet, Type};

/// The pieces of a curve, or why there are none: pbrt goes on without such a curve, too. Of a
/// `fibre` the looks do not depend on the normals of its surface.
pub(super) fn pieces(
    set: &ParamSet,
    fibre: bool,
    report: &mut Report,
) -> Result<Result<Vec<CurvePiece>, String>, SceneError> {
    let width = set.float_or("width", 1.0)?;
    let widths = [
        set.float_or("width0", width)?,
        set.float_or("width1", width)?,
    ];
    // How finely pbrt's tree splits curves, which changes no picture.
    set.accept(&["splitdepth"]);
    let basis = match set.string("basis")?.unwrap_or("bezier") {
        "bezier" => Basis::Bezier,
        "bspline" => Basis::BSpline,
        other => return Ok(Err(format!("unknown basis \"{other}\""))),
    };
    let degree = match set.int_in("degree", 3, i64::from(i32::MIN), i64::from(i32::MAX))? {
        n @ 2..=3 => n as usize,
        n => return Ok(Err(format!("degree {n} must be 2 or 3"))),
    };
    let points = set.triples("P", Type::Point3)?.unwrap_or_default();
    let pieces = match basis.pieces(degree, &points) {
        Ok(pieces) => pieces,
        Err(why) => return Ok(Err(why)),
    };
    let normals = set.triples("N", Type::Normal)?;
    let normals = match (set.string("type")?.unwrap_or("flat"), normals) {
        ("ribbon", Some(normals)) if normals.len() == pieces.len() + 1 => Some(normals),
        ("ribbon", normals) => {
            let (given, needed) = (normals.map_or(0, |n| n.len()), pieces.len() + 1);
            return Ok(Err(format!(
                "has {given} normals \"N\", must have {needed}"
            )));
        }
        (kind, normals) => {
            if normals.is_some() {
                report.warn_at(&set.site, "normals \"N\" are of ribbons alone; ignored");
            }
            match kind {
                "flat" if fibre => {}
                "flat" => report.warn_once(
                    "flat curves",
                    &set.site,
                    format_args!(
                        "flat curves are drawn as round ones: as wide from all sides, shaded as \"cylinder\""
                    ),
                ),
                "cylinder" => {}
                other => report.warn_at(
                    &set.site,
                    format_args!("unknown type \"{other}\"; taken as \"cylinder\", as in pbrt"),
                ),
            }
            None
        }
    };
    let n = pieces.len() as f64;
    let width = |i: usize| {
        let part = i as f64 / n;
        widths[0] * (1.0 - part) + widths[1] * part
    };
    let normal = |i: usize| normals.as_ref().map(|n| n[i].normalize_or_zero());
    let all = pieces
        .into_iter()
        .enumerate()
        .map(|(i, points)| CurvePiece {
            points,
            widths: [width(i), width(i + 1)],
            normals: normal(i).zip(normal(i + 1)).map(|(a, b)| [a, b]),
        });
    Ok(Ok(all.collect()))
}
