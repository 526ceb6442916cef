//! `Camera`, in world space until the internal space is known.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::lenses::lenses;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::params::ParamSet;
use crate::pbrt::textures::Tables;
use crate::pbrt::transform::{Similarity, inverse, narrow_point, rows, similarity};
use crate::scene::lenses::Lenses;
use crate::scene::{Camera, Film, Projection, Space, SphereMap};

/// A camera in world space: internal lengths follow once the space is known.
#[derive(Clone, Debug)]
pub(in crate::pbrt) struct WorldCamera {
    placed: Similarity,
    projection: Projection,
    /// World lengths for an orthographic camera.
    screen: [f64; 4],
    lens_radius: f64,
    focal_distance: f64,
}

/// Builds the camera; `ctm` is the transform at the directive, world to camera, and `diagonal` that
/// of the film in metres.
pub(in crate::pbrt) fn camera(
    kind: &str,
    set: &ParamSet,
    ctm: &DAffine3,
    (film, diagonal): (&Film, f64),
    tables: &mut Tables,
    report: &mut Report,
) -> Result<WorldCamera, SceneError> {
    let mut projection = match kind {
        "realistic" => Projection::Lenses(lenses(set, diagonal, tables)?.into()),
        _ => projection_of(kind, set)?,
    };
    let placed = inverse(ctm).and_then(|t| similarity(&t)).ok_or_else(|| {
        set.error("its transform shears or stretches space; use rotations, translations, mirrors and uniform scales")
    })?;
    set.accept(&["shutteropen", "shutterclose"]);
    if let Projection::Sphere(_) | Projection::Lenses(_) = projection {
        if let Projection::Sphere(_) = projection {
            note_useless(set, report);
        }
        set.finish(report);
        return Ok(WorldCamera {
            placed,
            projection,
            screen: [-1.0, 1.0, -1.0, 1.0],
            lens_radius: 0.0,
            focal_distance: 1.0,
        });
    }
    let window = window(set, film)?;
    let lens_radius = set.float_in("lensradius", 0.0, 0.0, f64::INFINITY)?;
    let focal_distance = set.float_or("focaldistance", 1e6)?;
    if lens_radius > 0.0 && focal_distance <= 0.0 {
        return Err(set.error(format_args!(
            "focal distance {focal_distance} is not positive"
        )));
    }
    let window_scale = match &projection {
        Projection::Perspective => half_view(set)?,
        // pbrt's orthographic camera has one lens for all of its film, at the origin: rays leave
        // its disk for points of the window in the plane in focus. That is a perspective
        // camera, whose window lies at distance 1.
        Projection::Orthographic if lens_radius > 0.0 => {
            report.warn_at(
                &set.site,
                "with a lens, its rays start at the lens and not at the film, as in pbrt: a perspective view of its window in the plane in focus",
            );
            projection = Projection::Perspective;
            1.0 / focal_distance
        }
        _ => placed.scale,
    };
    let screen = window.map(|x| x * window_scale);
    if screen[0] == screen[1]
        || screen[2] == screen[3]
        || !screen.iter().all(|x| (*x as f32).is_finite())
    {
        return Err(set.error("its screen window is empty"));
    }
    set.finish(report);
    Ok(WorldCamera {
        placed,
        projection,
        screen,
        lens_radius: lens_radius * placed.scale,
        focal_distance: focal_distance * placed.scale,
    })
}

/// What a kind of camera projects by; its lens may change that.
fn projection_of(kind: &str, set: &ParamSet) -> Result<Projection, SceneError> {
    Ok(match kind {
        "perspective" => Projection::Perspective,
        "orthographic" => Projection::Orthographic,
        "environment" => Projection::Sphere(SphereMap::Equirectangular),
        "spherical" => Projection::Sphere(match set.string("mapping")? {
            None | Some("equalarea") => SphereMap::EqualArea,
            Some("equirectangular") => SphereMap::Equirectangular,
            Some(other) => {
                return Err(set.error(format_args!(
                    "mapping \"{other}\" is unknown; use equalarea or equirectangular"
                )));
            }
        }),
        _ => {
            return Err(set.error(
                "this camera is unknown; use perspective, orthographic, spherical, environment or realistic",
            ));
        }
    })
}

/// What a camera that sees every direction has no use for.
fn note_useless(set: &ParamSet, report: &mut Report) {
    for name in [
        "lensradius",
        "focaldistance",
        "frameaspectratio",
        "screenwindow",
    ] {
        if let Some(param) = set.find(name) {
            report.warn_at(
                &set.site_of(param),
                format_args!("\"{name}\" has no effect on a camera that sees every direction"),
            );
        }
    }
}

/// `[x0, x1, y0, y1]` as the file has it: [-1, 1] along the shorter side, unless it says otherwise.
fn window(set: &ParamSet, film: &Film) -> Result<[f64; 4], SceneError> {
    let aspect = set.float_in(
        "frameaspectratio",
        f64::from(film.width) / f64::from(film.height),
        1e-6,
        1e6,
    )?;
    let mut screen = if aspect > 1.0 {
        [-aspect, aspect, -1.0, 1.0]
    } else {
        [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
    };
    if let Some(window) = set.floats("screenwindow")? {
        match *window {
            [x0, x1, y0, y1] => screen = [x0, x1, y0, y1],
            _ => set.note("\"screenwindow\" is ignored: it needs 4 values, x0 x1 y0 y1"),
        }
    }
    Ok(screen)
}

/// The tangent of half the field of view.
fn half_view(set: &ParamSet) -> Result<f64, SceneError> {
    let mut fov = set.float_or("fov", 90.0)?;
    if set.dialect == Dialect::V3
        && let Some(half) = set.float("halffov")?
    {
        fov = 2.0 * half;
    }
    if !(fov > 0.0 && fov < 180.0) {
        return Err(set.error(format_args!(
            "field of view {fov} is not between 0 and 180 degrees"
        )));
    }
    Ok((fov.to_radians() / 2.0).tan())
}

/// The camera without a `Camera` directive: pbrt's default at the origin, looking along `+z`.
pub(in crate::pbrt) fn default_camera(film: &Film) -> WorldCamera {
    let aspect = f64::from(film.width) / f64::from(film.height);
    let screen = if aspect > 1.0 {
        [-aspect, aspect, -1.0, 1.0]
    } else {
        [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
    };
    WorldCamera {
        placed: Similarity {
            frame: glam::DMat3::IDENTITY,
            scale: 1.0,
            translation: DVec3::ZERO,
        },
        projection: Projection::Perspective,
        screen,
        lens_radius: 0.0,
        focal_distance: 1e6,
    }
}

impl WorldCamera {
    pub fn position(&self) -> DVec3 {
        self.placed.translation
    }

    /// `None` if the screen window is so much larger or smaller than the scene that `f32` does not
    /// hold its area, or that of a pixel.
    pub fn into_internal(self, space: &Space) -> Option<Camera> {
        const LARGEST: f64 = 1e15;
        let translation =
            narrow_point((self.placed.translation - space.centre) * space.scale).as_dvec3();
        let screen = match self.projection {
            Projection::Orthographic => self.screen.map(|x| x * space.scale),
            _ => self.screen,
        };
        let [x0, x1, y0, y1] = screen;
        let sides = [x1 - x0, y1 - y0];
        if !screen.iter().all(|x| x.abs() <= LARGEST)
            || !sides.iter().all(|x| x.abs() >= 1.0 / LARGEST)
        {
            return None;
        }
        let unit = self.placed.scale * space.scale;
        let projection = match self.projection {
            Projection::Lenses(_) if !(1.0 / LARGEST..=LARGEST).contains(&unit) => return None,
            Projection::Lenses(lenses) => Projection::Lenses(Arc::new(Lenses {
                unit: unit as f32,
                ..(*lenses).clone()
            })),
            other => other,
        };
        Some(Camera {
            projection,
            to_world: rows(&DAffine3 {
                matrix3: self.placed.frame,
                translation,
            }),
            screen: screen.map(|x| x as f32),
            lens_radius: ((self.lens_radius * space.scale) as f32).min(f32::MAX),
            focal_distance: ((self.focal_distance * space.scale) as f32).min(f32::MAX),
        })
    }
}
