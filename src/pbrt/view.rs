//! What is rendered how: `Camera`, `Film`, `PixelFilter`, `Sampler` and `Integrator`.

use glam::{DAffine3, DVec3, Vec2};

use super::color::ColorSpace;
use super::dialect::Dialect;
use super::error::{Report, SceneError};
use super::params::ParamSet;
use super::sensor;
use super::transform::{Similarity, inverse, narrow_point, rows, similarity};
use crate::scene::{
    Camera, Clamp, Film, Filter, FilterKind, IntegratorKind, IntegratorSettings, Projection, Space,
    SphereMap,
};

/// Pixels a film may have.
const MAX_PIXELS: i64 = 1 << 31;
/// A side of the film, so that raster positions are exact to a fraction of a pixel in `f32`.
const MAX_SIDE: i64 = 1 << 17;

/// `shutter` is how long the camera's shutter is open.
pub(super) fn film(
    kind: &str,
    set: &ParamSet,
    shutter: f64,
    report: &mut Report,
) -> Result<Film, SceneError> {
    match (set.dialect, kind) {
        (Dialect::V3, "image") | (Dialect::V4, "rgb") => {}
        (Dialect::V4, "gbuffer" | "spectral") => {
            report.warn_at(
                &set.site,
                "written as an RGB picture, without the other channels",
            );
            set.accept(&["coordinatesystem", "nbuckets", "lambdamin", "lambdamax"]);
        }
        (Dialect::V3, _) => return Err(set.error("this film is unknown; use \"image\"")),
        (Dialect::V4, _) => return Err(set.error("this film is unknown; use \"rgb\"")),
    }
    let width = set.int_in("xresolution", 1280, 1, MAX_SIDE)?;
    let height = set.int_in("yresolution", 720, 1, MAX_SIDE)?;
    if width * height > MAX_PIXELS {
        return Err(set.error(format_args!(
            "{width} x {height} pixels are more than {MAX_PIXELS}"
        )));
    }
    let crop = crop(set, width as u32, height as u32)?;
    let filename = set.string("filename")?.map(str::to_owned);
    set.accept(&["diagonal", "savefp16"]);
    let (scale, colour, space) = match set.dialect {
        Dialect::V3 => (set.float_or("scale", 1.0)?, None, ColorSpace::Srgb),
        Dialect::V4 => {
            // Files for early versions of pbrt-v4 have the time of the exposure here.
            let time = set.float_or("exposuretime", shutter)?;
            let iso = set.float_or("iso", 100.0)?;
            let balance = balance(set, report)?;
            let colour = sensor::matrix(set.color_space, balance);
            (time * iso / 100.0, colour, set.color_space)
        }
    };
    if !(scale as f32).is_finite() {
        return Err(set.error("the factor on its values is out of range"));
    }
    let clamp = clamp(set, scale, report)?;
    set.finish(report);
    Ok(Film {
        width: width as u32,
        height: height as u32,
        crop,
        filename,
        filter: Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        },
        scale: scale as f32,
        colour,
        chromaticities: (space != ColorSpace::Srgb).then(|| space.chromaticities()),
        clamp,
    })
}

/// The temperature in kelvin that a v4 film is balanced for, if it is.
fn balance(set: &ParamSet, report: &mut Report) -> Result<Option<f64>, SceneError> {
    let kelvin = set.float_or("whitebalance", 0.0)?;
    let given = kelvin != 0.0;
    if given && !(1000.0..=1e6).contains(&kelvin) {
        return Err(set.error(format_args!(
            "white balance {kelvin} is not between 1000 and 1000000 kelvin"
        )));
    }
    let camera = set.string("sensor")?.filter(|name| *name != sensor::CIE);
    let Some(name) = camera else {
        return Ok(given.then_some(kelvin));
    };
    if !sensor::is_camera(name) {
        return Err(set.error(format_args!(
            "sensor \"{name}\" is unknown; use {} or one of pbrt-v4's cameras, canon_eos_100d for instance",
            sensor::CIE
        )));
    }
    let kelvin = if given {
        kelvin
    } else {
        sensor::CAMERA_BALANCE
    };
    report.warn_at(
        &set.site,
        format_args!(
            "sensor \"{name}\" stands for {} balanced for {kelvin} K: greys as the camera has them, other colours nearly",
            sensor::CIE
        ),
    );
    Ok(Some(kelvin))
}

/// What samples are cut down to. Only integrators whose samples are independent can: what chains bring is normalised, so pbrt's own clamp
/// of it turns pictures green.
fn clamp(set: &ParamSet, scale: f64, report: &mut Report) -> Result<Option<Clamp>, SceneError> {
    let (name, of): (_, fn(f32) -> Clamp) = match set.dialect {
        Dialect::V3 => ("maxsampleluminance", Clamp::Luminance),
        Dialect::V4 => ("maxcomponentvalue", Clamp::Xyz),
    };
    let Some(param) = set.find(name) else {
        return Ok(None);
    };
    let most = match set.dialect {
        Dialect::V3 => set.float_or(name, 0.0)?,
        // Of what the film holds, exposure included.
        Dialect::V4 => set.float_or(name, 0.0)? / scale,
    };
    if most.is_nan() || most <= 0.0 {
        return Err(set.error_at(param, "must be positive, or the picture is black"));
    }
    if !(most as f32).is_finite() {
        return Ok(None);
    }
    report.warn_at(
        &set.site_of(param),
        format_args!(
            "\"{name}\" takes light from the brightest samples of path, bdpt and lightpath; mlt does without"
        ),
    );
    Ok(Some(of(most as f32)))
}

/// The film without a `Film` directive.
pub(super) fn default_film() -> Film {
    Film {
        width: 1280,
        height: 720,
        crop: [0, 1280, 0, 720],
        filename: None,
        filter: Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        },
        scale: 1.0,
        colour: None,
        chromaticities: None,
        clamp: None,
    }
}

/// How long a v4 camera's shutter is open.
pub(super) fn shutter_time(set: &ParamSet) -> Result<f64, SceneError> {
    let (open, close) = (
        set.float_or("shutteropen", 0.0)?,
        set.float_or("shutterclose", 1.0)?,
    );
    match set.dialect {
        // Of no consequence while nothing moves.
        Dialect::V3 => Ok(1.0),
        Dialect::V4 if close > open => Ok(close - open),
        Dialect::V4 => Err(set.error(format_args!(
            "its shutter closes at {close} and opens at {open}: no light reaches the film"
        ))),
    }
}

fn crop(set: &ParamSet, width: u32, height: u32) -> Result<[u32; 4], SceneError> {
    let mut crop = [0, width, 0, height];
    let four = |name: &str, given: Option<&[f64]>| match given {
        Some(&[x0, x1, y0, y1]) => Ok(Some([x0, x1, y0, y1])),
        // v3 would go on with a window that holds nothing.
        Some(_) if set.dialect == Dialect::V3 => {
            Err(set.error(format_args!("\"{name}\" needs 4 values: x0 x1 y0 y1")))
        }
        Some(_) => {
            set.note(format_args!(
                "\"{name}\" is ignored: it needs 4 values, x0 x1 y0 y1"
            ));
            Ok(None)
        }
        None => Ok(None),
    };
    let window = four("cropwindow", set.floats("cropwindow")?)?;
    let mut bounds = four("pixelbounds", set.ints("pixelbounds")?)?;
    if window.is_some() && bounds.take().is_some() {
        set.note("\"pixelbounds\" is ignored beside \"cropwindow\"");
    }
    if let Some([x0, x1, y0, y1]) = window {
        // In f32 as pbrt does it, for the same pixels; rounded up at both ends, so that adjacent windows tile.
        let edge = |x: f64, size: u32| {
            (size as f32 * (x as f32).clamp(0.0, 1.0))
                .ceil()
                .min(size as f32) as u32
        };
        crop = [
            edge(x0.min(x1), width),
            edge(x0.max(x1), width),
            edge(y0.min(y1), height),
            edge(y0.max(y1), height),
        ];
    }
    if let Some([x0, x1, y0, y1]) = bounds {
        let edge = |x: f64, size: u32| x.clamp(0.0, f64::from(size)) as u32;
        crop = [
            edge(x0, width),
            edge(x1, width),
            edge(y0, height),
            edge(y1, height),
        ];
    }
    if crop[0] >= crop[1] || crop[2] >= crop[3] {
        return Err(set.error("the crop window holds no pixel"));
    }
    Ok(crop)
}

pub(super) fn filter(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<Filter, SceneError> {
    let (xname, yname) = match set.dialect {
        Dialect::V3 => ("xwidth", "ywidth"),
        Dialect::V4 => ("xradius", "yradius"),
    };
    let default_radius = match (kind, set.dialect) {
        ("box", _) => 0.5,
        ("gaussian", Dialect::V4) => 1.5,
        ("sinc", _) => 4.0,
        _ => 2.0,
    };
    let kind = match kind {
        "box" => FilterKind::Box,
        "triangle" => FilterKind::Triangle,
        "gaussian" => FilterKind::Gaussian {
            alpha: match set.dialect {
                Dialect::V3 => set.float_or("alpha", 2.0)? as f32,
                Dialect::V4 => alpha_of(set.float_in("sigma", 0.5, 1e-3, f64::INFINITY)?),
            },
        },
        "mitchell" => FilterKind::Mitchell {
            b: set.float_or("B", 1.0 / 3.0)? as f32,
            c: set.float_or("C", 1.0 / 3.0)? as f32,
        },
        "sinc" => FilterKind::Sinc {
            tau: set.float_in("tau", 3.0, 1e-3, f64::INFINITY)? as f32,
        },
        _ => {
            return Err(
                set.error("this filter is unknown; use box, triangle, gaussian, mitchell or sinc")
            );
        }
    };
    let radius = |name: &str| set.float_in(name, default_radius, 1e-3, 64.0);
    let radius = Vec2::new(radius(xname)? as f32, radius(yname)? as f32);
    set.finish(report);
    Ok(Filter { radius, kind })
}

/// The filter without a `PixelFilter` directive.
pub(super) fn default_filter(dialect: Dialect) -> Filter {
    match dialect {
        Dialect::V3 => Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        },
        Dialect::V4 => Filter {
            radius: Vec2::splat(1.5),
            kind: FilterKind::Gaussian {
                alpha: alpha_of(0.5),
            },
        },
    }
}

fn alpha_of(sigma: f64) -> f32 {
    (1.0 / (2.0 * sigma * sigma)) as f32
}

/// A camera in world space: internal lengths follow once the space is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldCamera {
    placed: Similarity,
    projection: Projection,
    /// World lengths for an orthographic camera.
    screen: [f64; 4],
    lens_radius: f64,
    focal_distance: f64,
}

/// Builds the camera; `ctm` is the transform at the directive, world to camera.
pub(super) fn camera(
    kind: &str,
    set: &ParamSet,
    ctm: &DAffine3,
    film: &Film,
    report: &mut Report,
) -> Result<WorldCamera, SceneError> {
    let mut projection = match kind {
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
        "realistic" => {
            return Err(set.error(
                "this camera is not supported; use perspective with lensradius and focaldistance",
            ));
        }
        _ => {
            return Err(set.error(
                "this camera is unknown; use perspective, orthographic, spherical or environment",
            ));
        }
    };
    let placed = inverse(ctm).and_then(|t| similarity(&t)).ok_or_else(|| {
        set.error("its transform shears or stretches space; use rotations, translations, mirrors and uniform scales")
    })?;
    set.accept(&["shutteropen", "shutterclose"]);
    if let Projection::Sphere(_) = projection {
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
        set.finish(report);
        return Ok(WorldCamera {
            placed,
            projection,
            screen: [-1.0, 1.0, -1.0, 1.0],
            lens_radius: 0.0,
            focal_distance: 1.0,
        });
    }
    let aspect = set.float_in(
        "frameaspectratio",
        f64::from(film.width) / f64::from(film.height),
        1e-6,
        1e6,
    )?;
    // [-1, 1] along the shorter side.
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
    let lens_radius = set.float_in("lensradius", 0.0, 0.0, f64::INFINITY)?;
    let focal_distance = set.float_or("focaldistance", 1e6)?;
    if lens_radius > 0.0 && focal_distance <= 0.0 {
        return Err(set.error(format_args!(
            "focal distance {focal_distance} is not positive"
        )));
    }
    let window_scale = match projection {
        Projection::Perspective => {
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
            (fov.to_radians() / 2.0).tan()
        }
        // pbrt's orthographic camera has one lens for all of its film, at the origin: rays leave its disk for points of the window
        // in the plane in focus. That is a perspective camera, whose window lies at distance 1.
        Projection::Orthographic if lens_radius > 0.0 => {
            report.warn_at(
                &set.site,
                "with a lens, its rays start at the lens and not at the film, as in pbrt: a perspective view of its window in the plane in focus",
            );
            projection = Projection::Perspective;
            1.0 / focal_distance
        }
        Projection::Orthographic | Projection::Sphere(_) => placed.scale,
    };
    let screen = screen.map(|x| x * window_scale);
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

/// The camera without a `Camera` directive: pbrt's default at the origin, looking along `+z`.
pub(super) fn default_camera(film: &Film) -> WorldCamera {
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

    /// `None` if the screen window is so much larger or smaller than the scene that `f32` does not hold its area, or that of a pixel.
    pub fn to_internal(self, space: &Space) -> Option<Camera> {
        const LARGEST: f64 = 1e15;
        let translation =
            narrow_point((self.placed.translation - space.centre) * space.scale).as_dvec3();
        let screen = match self.projection {
            Projection::Perspective | Projection::Sphere(_) => self.screen,
            Projection::Orthographic => self.screen.map(|x| x * space.scale),
        };
        let [x0, x1, y0, y1] = screen;
        let sides = [x1 - x0, y1 - y0];
        if !screen.iter().all(|x| x.abs() <= LARGEST)
            || !sides.iter().all(|x| x.abs() >= 1.0 / LARGEST)
        {
            return None;
        }
        Some(Camera {
            projection: self.projection,
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

/// Samples per pixel, and the seed if the sampler has one.
pub(super) fn sampler(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<(u32, Option<u64>), SceneError> {
    let most = i64::from(u32::MAX);
    let samples = if kind == "stratified" {
        let (x, y) = (
            set.int_in("xsamples", 4, 1, 1 << 15)?,
            set.int_in("ysamples", 4, 1, 1 << 15)?,
        );
        set.int_in("pixelsamples", x * y, 1, most)?
    } else {
        set.int_in("pixelsamples", 16, 1, most)?
    };
    set.accept(&["jitter", "dimensions", "randomization", "samplepixelcenter"]);
    let limit = i64::from(u32::MAX);
    let seed = (set
        .has("seed")
        .then(|| set.int_in("seed", 0, -limit, limit)))
    .transpose()?;
    set.finish(report);
    Ok((samples as u32, seed.map(|seed| seed as u64)))
}

pub(super) fn integrator(
    kind: &str,
    set: &ParamSet,
    report: &mut Report,
) -> Result<IntegratorSettings, SceneError> {
    let mut settings = IntegratorSettings::default();
    let default_depth = i64::from(settings.max_depth);
    settings.max_depth = set.int_in("maxdepth", default_depth, 0, 1 << 16)? as u32;
    let replaced = |report: &mut Report, by: &str| {
        report.warn_at(&set.site, format_args!("rendered with {by} instead"));
    };
    let count = |name: &str, default: u64, least: i64| -> Result<u64, SceneError> {
        Ok(set.int_in(name, default as i64, least, 1 << 50)? as u64)
    };
    match kind {
        "mlt" => {
            settings.mutations_per_pixel =
                count("mutationsperpixel", settings.mutations_per_pixel, 1)?;
            settings.chains = count("chains", settings.chains, 1)?;
            settings.bootstrap_samples = count("bootstrapsamples", settings.bootstrap_samples, 1)?;
            settings.large_step_probability = set.float_in(
                "largestepprobability",
                f64::from(settings.large_step_probability),
                0.0,
                1.0,
            )? as f32;
            settings.sigma =
                set.float_in("sigma", f64::from(settings.sigma), 0.0, f64::INFINITY)? as f32;
        }
        "path" => settings.kind = IntegratorKind::Pt,
        "volpath" | "directlighting" | "whitted" | "simplepath" | "simplevolpath"
        | "randomwalk" | "ao" | "ambientocclusion" | "function" => {
            settings.kind = IntegratorKind::Pt;
            if kind != "volpath" {
                replaced(report, "path tracing");
            }
        }
        "bdpt" => {
            settings.kind = IntegratorKind::Bdpt;
            // Of two pictures of each strategy pbrt writes one.
            settings.strategies = set.bool_or("visualizestrategies", false)?
                | set.bool_or("visualizeweights", false)?;
        }
        "lightpath" => settings.kind = IntegratorKind::Lt,
        "sppm" => replaced(report, "multiplexed Metropolis light transport"),
        _ => {
            return Err(set.error("this integrator is unknown; use mlt, path, bdpt or lightpath"));
        }
    }
    if set.bool_or("regularize", false)? {
        report.warn_at(
            &set.site,
            "\"regularize\" is ignored: it would alter the picture",
        );
    }
    // How samples are spent, not what the picture converges to.
    set.accept(&[
        "lightsamplestrategy",
        "lightsampler",
        "rrthreshold",
        "strategy",
        "visualizestrategies",
        "visualizeweights",
        "samplelights",
        "samplebsdf",
        "cossample",
        "maxdistance",
        "nsamples",
        "numiterations",
        "iterations",
        "photonsperiteration",
        "imagewritefrequency",
        "radius",
        "seed",
    ]);
    set.finish(report);
    Ok(settings)
}
