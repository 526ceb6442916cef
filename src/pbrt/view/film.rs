//! `Film` and `PixelFilter`.

use glam::Vec2;

use crate::pbrt::color_space::ColorSpace;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{Report, SceneError};
use crate::pbrt::params::ParamSet;
use crate::pbrt::sensor;
use crate::scene::{Clamp, Film, Filter, FilterKind};

/// Pixels a film may have.
const MAX_PIXELS: i64 = 1 << 31;

/// A side of the film, so that raster positions are exact to a fraction of a pixel in `f32`.
const MAX_SIDE: i64 = 1 << 17;

/// `shutter` is how long the camera's shutter is open.
pub(in crate::pbrt) fn film(
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
    // That of the diagonal is `lenses::film_diagonal`.
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

/// What samples are cut down to. Only integrators whose samples are independent can: what chains
/// bring is normalised, so pbrt's own clamp of it turns pictures green.
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
pub(in crate::pbrt) fn default_film() -> Film {
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
pub(in crate::pbrt) fn shutter_time(set: &ParamSet) -> Result<f64, SceneError> {
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
        // In f32 as pbrt does it, for the same pixels; rounded up at both ends, so that adjacent
        // windows tile.
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

pub(in crate::pbrt) fn filter(
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
pub(in crate::pbrt) fn default_filter(dialect: Dialect) -> Filter {
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
