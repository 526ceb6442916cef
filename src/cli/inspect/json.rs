//! What `phalanx inspect` prints, for programs. Lengths are those of the scene file.

use serde::Serialize;

use super::super::input::Input;
use super::names::{film_filter, light_name, projection_name, texture_name, to_world};
use super::price::Price;
use crate::integrate::{self, Hidden, Needs, Settings, peak_rss_bytes};
use crate::plan;
use crate::scene::{Camera, Image, Medium, Scene, Space};
use crate::transport::World;

#[derive(Serialize)]
struct Document<'a> {
    version: &'static str,
    scene_file: &'a str,
    load_seconds: f64,
    warnings: &'a [String],
    triangles: usize,
    vertices: usize,
    spheres: usize,
    shapes: usize,
    bounds: [[f64; 3]; 2],
    materials: Vec<Named<'a>>,
    media: Vec<MediumEntry<'a>>,
    textures: Vec<&'static str>,
    images: Vec<ImageEntry<'a>>,
    lights: Vec<LightEntry<'a>>,
    camera: CameraEntry,
    film: FilmEntry<'a>,
    integrator: IntegratorEntry,
    needs: NeedsEntry,
    tree: Tree,
    plan: plan::PlanReport,
    /// Light that only paths find that hit a lamp by chance.
    found_by_chance: Vec<Hidden>,
    /// Only if it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    seconds_to_error: Option<Vec<Price>>,
}

/// A material and its kernel.
#[derive(Serialize)]
struct Named<'a> {
    name: &'a str,
    origin: &'a str,
    kernel: &'static str,
    textured: bool,
    /// Light comes out elsewhere than it went in.
    subsurface: bool,
}

#[derive(Serialize)]
struct MediumEntry<'a> {
    name: &'a str,
    origin: &'a str,
    /// Of the density's grid; `None` if it is the same everywhere.
    grid: Option<[u32; 3]>,
    scatters: bool,
    emits: bool,
    around_camera: bool,
}

#[derive(Serialize)]
struct ImageEntry<'a> {
    name: &'a str,
    width: usize,
    height: usize,
}

/// Lights in a row that one directive has made.
#[derive(Serialize)]
struct LightEntry<'a> {
    kind: &'static str,
    origin: &'a str,
    count: usize,
}

#[derive(Serialize)]
struct CameraEntry {
    projection: &'static str,
    position: [f64; 3],
    direction: [f64; 3],
    lens_radius: f64,
    /// `None` for a pinhole.
    focal_distance: Option<f64>,
}

#[derive(Serialize)]
struct FilmEntry<'a> {
    width: u32,
    height: u32,
    /// `x0, x1, y0, y1` in pixels.
    crop: [u32; 4],
    filter: String,
    filter_radius: [f32; 2],
    scale: f32,
    filename: Option<&'a str>,
}

#[derive(Serialize)]
struct IntegratorEntry {
    name: &'static str,
    max_depth: u32,
    samples_per_pixel: u32,
    mutations_per_pixel: u64,
    chains: u64,
    bootstrap: u64,
    large_step_probability: f32,
    sigma: f32,
}

#[derive(Serialize)]
struct NeedsEntry {
    bytes: u64,
    parts: Vec<NeedEntry>,
}

#[derive(Serialize)]
struct NeedEntry {
    part: &'static str,
    bytes: u64,
}

#[derive(Serialize)]
struct Tree {
    nodes: usize,
    levels: usize,
    bytes: usize,
    scene_bytes: u64,
    build_seconds: f64,
    peak_rss_bytes: u64,
}

/// Everything, as one JSON object and a line end.
pub fn document(input: &Input, world: &World, prices: Option<Vec<Price>>) -> String {
    let scene = &input.scene;
    let stats = world.tracer.stats();
    let document = Document {
        version: env!("CARGO_PKG_VERSION"),
        scene_file: &input.name,
        load_seconds: input.load_time.as_secs_f64(),
        warnings: &scene.warnings,
        triangles: scene.triangles.len(),
        vertices: scene.vertices.len(),
        spheres: scene.spheres.len(),
        shapes: scene.shapes.len(),
        bounds: scene.bounds.map(|p| to_world(&scene.space, p.to_array())),
        materials: materials(scene, world),
        media: media(scene),
        textures: scene.textures.iter().map(texture_name).collect(),
        images: images(scene),
        lights: lights(scene),
        camera: camera(&scene.camera, &scene.space),
        film: film(scene),
        integrator: integrator(scene),
        needs: needs(scene),
        tree: Tree {
            nodes: stats.nodes,
            levels: stats.depth,
            bytes: stats.bytes,
            scene_bytes: scene.bytes(),
            build_seconds: stats.build_time.as_secs_f64(),
            peak_rss_bytes: peak_rss_bytes(),
        },
        plan: plan::PlanReport::of(&world.plan),
        found_by_chance: integrate::hidden(scene, world, scene.integrator.kind),
        seconds_to_error: prices,
    };
    serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
}

fn materials<'a>(scene: &'a Scene, world: &World) -> Vec<Named<'a>> {
    let entries = scene.materials.iter().zip(&world.materials.entries);
    entries
        .map(|(material, entry)| Named {
            name: &material.name,
            origin: &material.origin,
            kernel: entry.kind.name(),
            textured: entry.textured,
            subsurface: entry.subsurface,
        })
        .collect()
}

fn media(scene: &Scene) -> Vec<MediumEntry<'_>> {
    let list = scene.media.list.iter().enumerate();
    list.map(|(i, medium)| medium_entry(scene.media.camera, i, medium))
        .collect()
}

fn medium_entry(camera: u32, i: usize, medium: &Medium) -> MediumEntry<'_> {
    MediumEntry {
        name: &medium.name,
        origin: &medium.origin,
        grid: medium.density.grids().next().map(|grid| grid.size),
        scatters: medium.scatters(),
        emits: medium.shines(),
        around_camera: camera as usize == i,
    }
}

fn images(scene: &Scene) -> Vec<ImageEntry<'_>> {
    let entries = scene.images.iter().map(|image: &Image| ImageEntry {
        name: &image.name,
        width: image.width as usize,
        height: image.height as usize,
    });
    entries.collect()
}

fn lights(scene: &Scene) -> Vec<LightEntry<'_>> {
    let mut list: Vec<LightEntry> = Vec::new();
    for light in &scene.lights {
        let kind = light_name(&light.kind);
        let like = |last: &&mut LightEntry| last.kind == kind && last.origin == light.origin;
        match list.last_mut().filter(like) {
            Some(last) => last.count += 1,
            None => list.push(LightEntry {
                kind,
                origin: &light.origin,
                count: 1,
            }),
        }
    }
    list
}

fn camera(camera: &Camera, space: &Space) -> CameraEntry {
    let m = camera.to_world;
    let length = |v: f32| f64::from(v) / space.scale;
    CameraEntry {
        projection: projection_name(&camera.projection),
        position: to_world(space, [m[0][3], m[1][3], m[2][3]]),
        direction: [m[0][2], m[1][2], m[2][2]].map(f64::from),
        lens_radius: length(camera.lens_radius),
        focal_distance: (camera.lens_radius > 0.0).then(|| length(camera.focal_distance)),
    }
}

fn film(scene: &Scene) -> FilmEntry<'_> {
    let film = &scene.film;
    FilmEntry {
        width: film.width,
        height: film.height,
        crop: film.crop,
        filter: film_filter(&film.filter),
        filter_radius: film.filter.radius.to_array(),
        scale: film.scale,
        filename: film.filename.as_deref(),
    }
}

fn integrator(scene: &Scene) -> IntegratorEntry {
    let i = &scene.integrator;
    IntegratorEntry {
        name: i.kind.name(),
        max_depth: i.max_depth,
        samples_per_pixel: i.pixel_samples,
        mutations_per_pixel: i.mutations_per_pixel,
        chains: i.chains,
        bootstrap: i.bootstrap_samples,
        large_step_probability: i.large_step_probability,
        sigma: i.sigma,
    }
}

fn needs(scene: &Scene) -> NeedsEntry {
    let needs = Needs::of(scene, &Settings::of(scene));
    NeedsEntry {
        bytes: needs.bytes(),
        parts: (needs.0.iter())
            .map(|need| NeedEntry {
                part: need.part,
                bytes: need.bytes,
            })
            .collect(),
    }
}
