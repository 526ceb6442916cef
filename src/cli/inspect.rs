//! `phalanx inspect`: what a scene holds, and how it would be rendered. To stdout.

mod json;
mod names;
mod price;

use std::fmt::{self, Write as _};
use std::process::ExitCode;
use std::time::Duration;

use self::names::{film_filter, light_name, medium_does, medium_name, texture_name, to_world};
use super::args::look::InspectArgs;
use super::failure::Failure;
use super::input::{self, Input};
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use super::units;
use crate::brief::brief;
use crate::integrate::{self, Needs, Settings, Shares, peak_rss_bytes};
use crate::memory::Bytes;
use crate::scene::{
    Bump, Camera, IntegratorKind, Material, NONE, Projection, Scene, Space, SphereMap,
};
use crate::surface::Kind;
use crate::transport::World;

pub fn run(args: &InspectArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let memory = MemoryLimit::new(None);
    let mut input = input::load(args.scene.as_deref(), &memory, messages)?;
    let max_depth = args.max_depth.unwrap_or(input.scene.integrator.max_depth);
    let most = crate::chain::counts::MAX_DEPTHS - 1;
    if max_depth > most {
        let message = format!("{}: maxdepth {max_depth} is beyond {most}", input.name);
        return Err(Failure::Input(message));
    }
    let prices = match args.estimate {
        true => Some(price::of(&mut input.scene, max_depth)?),
        false => None,
    };
    let world = World::with_forced(&input.scene, max_depth, &args.effects.force_effects);
    if args.json {
        outputs::print(&json::document(&input, &world, prices))?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut text = String::new();
    // Writing to a string does not fail.
    let _ = report(&mut text, &input, &world, args.plan);
    if let Some(prices) = prices {
        text += &format!("\nError\n  time          {}\n", price::text(&prices));
    }
    let lines: Vec<String> = text.lines().map(brief).collect();
    outputs::print(&(lines.join("\n") + "\n"))?;
    Ok(ExitCode::SUCCESS)
}

fn report(out: &mut String, input: &Input, world: &World, whole: bool) -> fmt::Result {
    let scene = &input.scene;
    writeln!(
        out,
        "{} (loaded in {})",
        input.name,
        units::time(input.load_time)
    )?;
    section(out, "Scene")?;
    counts(out, scene, world)?;
    let [low, high] = scene.bounds.map(|p| to_world(&scene.space, p.to_array()));
    writeln!(out, "  bounds        {} to {}", point(low), point(high))?;
    section(out, "Camera and film")?;
    camera(out, &scene.camera, &scene.space)?;
    film(out, scene)?;
    section(out, "Integrator")?;
    integrator(out, scene)?;
    let settings = Settings {
        max_depth: world.plan.depths.len().saturating_sub(1) as u32,
        ..Settings::of(scene)
    };
    if let Some(shares) = shares(scene, world, &settings) {
        writeln!(out, "  pilot         {shares}")?;
    }
    for hidden in integrate::hidden(scene, world, scene.integrator.kind) {
        let (what, possible) = (hidden.what(), 100.0 * hidden.possible);
        writeln!(
            out,
            "  by chance     {what}: up to {possible:.0} % of all light, the lamp {:.1e} of the scene's size",
            hidden.size
        )?;
    }
    let settings = Settings::of(scene);
    let needs = Needs::of(scene, &settings);
    writeln!(
        out,
        "  needs         {} of memory: {needs}",
        Bytes(needs.bytes())
    )?;
    section(out, "Acceleration structure")?;
    let stats = world.tracer.stats();
    writeln!(
        out,
        "  tree          {} nodes, {} levels, {} triangles, {} spheres",
        stats.nodes, stats.depth, stats.triangles, stats.spheres
    )?;
    writeln!(
        out,
        "  memory        {} (scene tables {}, peak of this process {})",
        Bytes(stats.bytes as u64),
        Bytes(scene.bytes()),
        Bytes(peak_rss_bytes())
    )?;
    writeln!(out, "  build         {}", units::precise(stats.build_time))?;
    section(out, "Plan")?;
    match whole {
        true => write!(out, "{:#}", world.plan),
        false => writeln!(
            out,
            "{}  the rest      with --plan: what is left out, and what paths of each depth consist of",
            world.plan
        ),
    }
}

fn section(out: &mut String, name: &str) -> fmt::Result {
    writeln!(out, "\n{name}")
}

fn counts(out: &mut String, scene: &Scene, world: &World) -> fmt::Result {
    let rows = [
        ("triangles", scene.triangles.len()),
        ("vertices", scene.vertices.len()),
        ("spheres", scene.spheres.len()),
        ("shapes", scene.shapes.len()),
    ];
    for (name, count) in rows {
        writeln!(out, "  {name:<13} {count}")?;
    }
    let cut = scene.shapes.iter().filter(|s| s.alpha != NONE).count();
    if cut > 0 {
        writeln!(out, "  cut-outs      in {cut} of the shapes")?;
    }
    materials(out, scene, world)?;
    media(out, scene)?;
    textures(out, scene)?;
    lights(out, scene)
}

/// What fills space, and what light passes below surfaces.
fn media(out: &mut String, scene: &Scene) -> fmt::Result {
    let below = scene.materials.iter().filter(|m| m.kind.is_subsurface());
    let below: Vec<_> = below
        .map(|m| format!("{} ({})", m.name, m.origin))
        .collect();
    if !below.is_empty() {
        writeln!(out, "  subsurface    in {}", below.join(", "))?;
    }
    if scene.media.list.is_empty() {
        return Ok(());
    }
    writeln!(out, "  media         {}", scene.media.list.len())?;
    for (i, medium) in scene.media.list.iter().enumerate() {
        let around = if scene.media.camera as usize == i {
            ", around the camera"
        } else {
            ""
        };
        writeln!(
            out,
            "                \"{}\" ({}): {}, {}{around}",
            medium.name,
            medium.origin,
            medium_name(medium),
            medium_does(medium)
        )?;
    }
    Ok(())
}

fn materials(out: &mut String, scene: &Scene, world: &World) -> fmt::Result {
    let kernels = Kind::ALL.map(|kind| {
        let count = world
            .materials
            .entries
            .iter()
            .filter(|e| e.kind == kind && !e.mixture)
            .count();
        (kind.name(), count)
    });
    let mixtures = (world.materials.entries.iter())
        .filter(|e| e.mixture)
        .count();
    let kernels = [&kernels[..], &[("mixture", mixtures)]].concat();
    writeln!(
        out,
        "  materials     {}",
        tally(scene.materials.len(), &kernels)
    )?;
    for material in &scene.materials {
        if let Some(index) = material.kind.dispersion() {
            let [violet, red] = [400.0, 700.0].map(|nm| index.at(nm));
            writeln!(
                out,
                "  dispersive    {} ({}): index {violet:.4} at 400 nm, {red:.4} at 700 nm",
                material.name, material.origin
            )?;
        }
    }
    let bumps = ["bump map", "normal map"].map(|name| {
        let is_normal = name == "normal map";
        let has = |m: &&Material| {
            m.bump
                .is_some_and(|b| matches!(b, Bump::Normal { .. }) == is_normal)
        };
        (name, scene.materials.iter().filter(has).count())
    });
    let bumped = bumps.iter().map(|b| b.1).sum();
    if bumped > 0 {
        writeln!(out, "  bumps         {}", tally(bumped, &bumps))?;
    }
    Ok(())
}

fn textures(out: &mut String, scene: &Scene) -> fmt::Result {
    let kinds = [
        "constant",
        "scale",
        "mix",
        "directionmix",
        "checkerboard",
        "3D checkerboard",
        "dots",
        "bilerp",
        "uv",
        "fbm",
        "wrinkled",
        "windy",
        "marble",
        "image",
    ];
    let textures = kinds.map(|name| {
        let count = scene
            .textures
            .iter()
            .filter(|t| texture_name(t) == name)
            .count();
        (name, count)
    });
    writeln!(
        out,
        "  textures      {}",
        tally(scene.textures.len(), &textures)
    )?;
    writeln!(out, "  images        {}", scene.images.len())?;
    for image in &scene.images {
        writeln!(
            out,
            "                {} x {}  {}",
            image.width, image.height, image.name
        )?;
    }
    Ok(())
}

fn lights(out: &mut String, scene: &Scene) -> fmt::Result {
    let kinds = [
        "triangle",
        "sphere",
        "image triangle",
        "image sphere",
        "point",
        "spot",
        "goniometric",
        "projection",
        "distant",
        "constant infinite",
        "image infinite",
    ];
    let lights = kinds.map(|name| {
        let count = scene
            .lights
            .iter()
            .filter(|l| light_name(&l.kind) == name)
            .count();
        (name, count)
    });
    writeln!(
        out,
        "  lights        {}",
        tally(scene.lights.len(), &lights)
    )
}

/// `7 (4 diffuse, 3 mirror)`
fn tally(total: usize, kinds: &[(&str, usize)]) -> String {
    let present = kinds.iter().filter(|k| k.1 > 0);
    let list: Vec<String> = present.map(|(name, n)| format!("{n} {name}")).collect();
    if list.is_empty() {
        format!("{total}")
    } else {
        format!("{total} ({})", list.join(", "))
    }
}

fn camera(out: &mut String, camera: &Camera, space: &Space) -> fmt::Result {
    let m = camera.to_world;
    let position = to_world(space, [m[0][3], m[1][3], m[2][3]]);
    let forward = [m[0][2], m[1][2], m[2][2]].map(f64::from);
    let [x0, x1, y0, y1] = camera.screen.map(f64::from);
    let view = match &camera.projection {
        Projection::Perspective => {
            let angle = |a: f64, b: f64| (b.atan() - a.atan()).abs().to_degrees();
            format!(
                "perspective, {:.2} x {:.2} degrees",
                angle(x0, x1),
                angle(y0, y1)
            )
        }
        Projection::Orthographic => {
            let length = |a: f64, b: f64| (b - a).abs() / space.scale;
            format!(
                "orthographic, {:.4} x {:.4}",
                length(x0, x1),
                length(y0, y1)
            )
        }
        Projection::Sphere(SphereMap::Equirectangular) => "every direction, equirectangular".into(),
        Projection::Sphere(SphereMap::EqualArea) => "every direction, equal-area".into(),
        Projection::Lenses(lenses) => format!(
            "realistic, {} surfaces, the film {:.5} behind them",
            lenses.elements.len(),
            lenses.elements.last().map_or(0.0, |e| e.thickness)
        ),
    };
    writeln!(
        out,
        "  camera        {view}, at {}, looking along {}",
        point(position),
        point(forward)
    )?;
    if camera.lens_radius > 0.0 {
        let world = |v: f32| f64::from(v) / space.scale;
        writeln!(
            out,
            "  lens          radius {:.5}, in focus at {:.5}",
            world(camera.lens_radius),
            world(camera.focal_distance)
        )?;
    }
    Ok(())
}

fn film(out: &mut String, scene: &Scene) -> fmt::Result {
    let film = &scene.film;
    writeln!(
        out,
        "  film          {} x {} pixels",
        film.width, film.height
    )?;
    let [x0, x1, y0, y1] = film.crop;
    if film.crop != [0, film.width, 0, film.height] {
        writeln!(out, "  crop          x {x0} to {x1}, y {y0} to {y1}")?;
    }
    let filter = film_filter(&film.filter);
    let radius = film.filter.radius;
    writeln!(
        out,
        "  filter        {filter}, radius {} x {} pixels",
        radius.x, radius.y
    )?;
    if film.scale != 1.0 {
        writeln!(out, "  scale         {}", film.scale)?;
    }
    if let Some([r, g, b]) = &film.colour {
        writeln!(out, "  colours       {r:?} {g:?} {b:?} times linear sRGB")?;
    }
    if let Some(clamp) = film.clamp {
        writeln!(out, "  clamp         {clamp:?} (pt, bdpt, lt)")?;
    }
    if let Some(name) = &film.filename {
        writeln!(out, "  filename      {name}")?;
    }
    Ok(())
}

fn integrator(out: &mut String, scene: &Scene) -> fmt::Result {
    let i = &scene.integrator;
    let name = i.kind.name();
    match i.kind.mutates() {
        true => writeln!(
            out,
            "  {name:14}maxdepth {}, {} mutations per pixel, {} chains, {} bootstrap paths per depth, large steps {}, sigma {}",
            i.max_depth,
            i.mutations_per_pixel,
            i.chains,
            i.bootstrap_samples,
            i.large_step_probability,
            i.sigma
        ),
        false => writeln!(
            out,
            "  {name:14}maxdepth {}, {} samples per pixel",
            i.max_depth, i.pixel_samples
        ),
    }
}

/// Mutations of a render whose pilot takes seconds at most.
const SHORT: f64 = 1e8;
/// The pilot of a longer one is that of a render of a minute: it takes a few per cent of that.
const MINUTE: Duration = Duration::from_secs(60);

/// What a pilot finds, if it is up to one.
pub(super) fn shares(scene: &Scene, world: &World, settings: &Settings) -> Option<Shares> {
    if settings.integrator != IntegratorKind::Auto {
        return None;
    }
    let work = settings.mutations_per_pixel as f64 * scene.film.crop_pixels() as f64;
    let settings = Settings {
        time: (work > SHORT).then_some(MINUTE),
        ..settings.clone()
    };
    integrate::shares(scene, world, &settings).ok()
}

/// `(0.0000, 1.0000, 3.9000)`, without negative zeros.
fn point(p: [f64; 3]) -> String {
    let [x, y, z] = p.map(|v| {
        let text = format!("{v:.4}");
        if text == "-0.0000" {
            "0.0000".to_string()
        } else {
            text
        }
    });
    format!("({x}, {y}, {z})")
}
