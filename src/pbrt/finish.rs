//! From world space to the tables of [`Scene`] in internal space.

use std::collections::HashSet;

use glam::{DAffine3, DVec3, Vec3};

use super::brightness;
use super::dialect::Dialect;
use super::error::{Report, SceneError, Site};
use super::extent::{Eyes, large_of, space_of};
use super::flush;
use super::geometry::{Geometry, WorldShape};
use super::instances::{Instances as WorldInstances, Placement, Placements};
use super::lights::AreaLight;
use super::loader::{Loader, Pending};
use super::media::Fillings;
use super::transform::{inverse, narrow_point, rows};
use super::view;
use crate::scene::{
    Instance, Instances, IntegratorKind, IntegratorSettings, Large, Light, LightKind, NONE, Object,
    PathSamplerKind, Scene, Shape, Sides, Space, Sphere, Triangle, Vertex,
};

/// Twice the area (internal space) below which a triangle counts as having none: products of its
/// inverse would leave `f32`. On a ground of 1e7 it is that of a triangle of a thousandth.
const MIN_CROSS: f64 = 1e-22;

/// Lights at points whose neighbourhoods are looked at.
const LAMPS: usize = 4;

/// Of reflectances: products of some are still numbers.
const NO_BOUND: f32 = 1e9;

/// Puts the scene together.
pub(super) fn finish(mut loader: Loader) -> Result<Scene, SceneError> {
    let take = |pending: Option<Pending>| pending.map(|p| (p.kind, p.set, p.ctm));

    let shutter = match &loader.view.camera {
        Some(camera) => view::shutter_time(&camera.set)?,
        None => 1.0,
    };
    let diagonal = match &loader.view.film {
        Some(film) => view::film_diagonal(&film.set)?,
        None => view::DIAGONAL,
    };
    let mut film = match take(loader.view.film.take()) {
        Some((kind, set, _)) => view::film(&kind, &set, shutter, &mut loader.report)?,
        None => view::default_film(),
    };
    film.filter = match take(loader.view.filter.take()) {
        Some((kind, set, _)) => view::filter(&kind, &set, &mut loader.report)?,
        None => view::default_filter(loader.dialect),
    };
    let camera_medium = loader.camera_medium();
    let mut camera_site = None;
    let camera = match take(loader.view.camera.take()) {
        Some((kind, set, ctm)) => {
            let to = (&mut loader.tables, &mut loader.report);
            let camera = view::camera(&kind, &set, &ctm, (&film, diagonal), to.0, to.1)?;
            camera_site = Some(set.site);
            camera
        }
        None => view::default_camera(&film),
    };
    let mut integrator_site = None;
    let mut integrator = match take(loader.view.integrator.take()) {
        Some((kind, set, _)) => {
            let integrator = view::integrator(&kind, &set, &mut loader.report)?;
            integrator_site = Some(set.site);
            integrator
        }
        None => IntegratorSettings::default(),
    };
    if let Some((kind, set, _)) = take(loader.view.sampler.take()) {
        let (samples, seed) = view::sampler(&kind, &set, &mut loader.report)?;
        integrator.pixel_samples = samples;
        loader.seed = seed.or(loader.seed);
    }
    integrator.seed = loader.seed.unwrap_or(0);

    // A few lights at points stand for all: what matters is whether something is next to them.
    let lamps = loader
        .lights
        .iter()
        .filter_map(|l| l.position())
        .take(LAMPS);
    let eyes = Eyes(std::iter::once(camera.position()).chain(lamps).collect());
    let placements = std::mem::replace(
        &mut loader.placements,
        Placements::new(loader.geometry.budget()),
    );
    let instances = placements.settle(&mut loader.geometry, &mut loader.report)?;
    let space = space_of(&loader.geometry, &instances, &eyes);
    flush::part(
        (&mut loader.geometry, &instances),
        &loader.tables.materials,
        &space,
        camera.position(),
        &mut loader.report,
    );
    let mut fillings = Fillings::new(
        std::mem::take(&mut loader.media),
        (loader.geometry.shapes.iter()).chain(instances.shapes()),
        (camera_medium, &loader.light_media),
        &space,
        &mut loader.report,
    )?;
    let camera = camera.into_internal(&space).ok_or_else(|| {
        let what = "its screen window is out of all proportion to the scene";
        match camera_site {
            Some(site) => site.error(what),
            None => SceneError(what.into()),
        }
    })?;
    let [triangles, spheres, shapes] = instances.sizes(&loader.geometry);
    let mut scene = Scene {
        vertices: Vec::new(),
        tangents: Vec::new(),
        triangles: Vec::with_capacity(triangles),
        spheres: Vec::with_capacity(spheres),
        shapes: Vec::with_capacity(shapes),
        alphas: std::mem::take(&mut loader.tables.alphas),
        materials: std::mem::take(&mut loader.tables.materials),
        textures: loader.tables.take_textures(&space),
        images: std::mem::take(&mut loader.tables.images),
        lights: loader
            .lights
            .iter()
            .map(|l| l.to_internal(&space))
            .collect(),
        media: Default::default(),
        camera,
        film,
        integrator,
        space,
        sides: match loader.dialect {
            Dialect::V3 => Sides::Geometric,
            Dialect::V4 => Sides::Shading,
        },
        brightest: match loader.dialect {
            Dialect::V3 => NO_BOUND,
            Dialect::V4 => 1.0,
        },
        large: Large::default(),
        instances: Instances::default(),
        bounds: [Vec3::ZERO; 2],
        files: loader.dir.files(),
        warnings: Vec::new(),
    };
    let spheres = add(
        (&mut scene, &mut fillings),
        &loader.geometry,
        &space,
        &mut loader.report,
    );
    add_objects((&mut scene, &mut fillings), instances, &mut loader.report);
    scene.media = fillings.media;
    scene.bounds = whole_bounds(&scene);
    scene.large = large_of(&scene, &loader.geometry, &spheres, &eyes);
    brightness::dim(&mut scene);
    trace_below(&mut scene, integrator_site.as_ref(), &mut loader.report);
    scene.warnings = loader.report.finish();
    Ok(scene)
}

/// Has the integrator make paths that go below surfaces: only lights can be joined to these.
fn trace_below(scene: &mut Scene, site: Option<&Site>, report: &mut Report) {
    if !scene.materials.iter().any(|m| m.kind.is_subsurface()) {
        return;
    }
    let traced = IntegratorKind::Pssmlt(PathSamplerKind::Pt);
    let integrator = &mut scene.integrator;
    let (kind, name) = match integrator.kind {
        IntegratorKind::Pt => return,
        kind if kind == traced => return,
        IntegratorKind::Bdpt | IntegratorKind::Lt => (IntegratorKind::Pt, "path tracing (pt)"),
        _ => (
            traced,
            "Metropolis light transport over path tracing (pssmlt-pt)",
        ),
    };
    integrator.strategies = false;
    integrator.kind = match site {
        Some(site) => {
            let what = format_args!(
                "rendered by {name}: no light subpath can be joined to what is below a surface (subsurface)"
            );
            report.warn_at(site, what);
            kind
        }
        // pbrt's own choice where a file makes none.
        None => IntegratorKind::Pt,
    };
}

/// Adds geometry whose coordinates become those of `space`, and returns the maps of its spheres
/// there.
fn add(
    (scene, fillings): (&mut Scene, &mut Fillings),
    geometry: &Geometry,
    space: &Space,
    report: &mut Report,
) -> Vec<DAffine3> {
    let base = scene.vertices.len();
    let vertices = geometry.vertices.iter().map(|v| to_vertex(v, space));
    if base == 0 {
        scene.vertices = vertices.collect();
    } else {
        scene.vertices.extend(vertices);
    }
    if !geometry.tangents.is_empty() {
        scene.tangents.resize(base, [0.0; 3]);
        scene.tangents.extend(tangents(geometry, space));
    }
    let mut spheres = Vec::with_capacity(geometry.spheres.len());
    for shape in &geometry.shapes {
        let [flat, repeated] = if shape.spheres {
            let to = (&mut *scene, &mut *fillings);
            add_spheres(to, geometry, shape, space, &mut spheres);
            [0; 2]
        } else {
            add_triangles(scene, fillings, geometry, shape, base as u32)
        };
        if flat > 0 {
            let what = format_args!("{flat} triangles without area dropped");
            report.warn_at(&shape.site, what);
        }
        if repeated > 0 {
            let what = format_args!("{repeated} triangles that lie on others of the lamp dropped");
            report.warn_at(&shape.site, what);
        }
    }
    spheres
}

/// Adds what is kept once, each object in a space of its own, and where it is seen.
fn add_objects(
    (scene, fillings): (&mut Scene, &mut Fillings),
    instances: WorldInstances,
    report: &mut Report,
) {
    let WorldInstances { objects, placed } = instances;
    let mut spaces = Vec::with_capacity(objects.len());
    for object in objects {
        let space = object.space();
        let first = [scene.triangles.len() as u32, scene.spheres.len() as u32];
        add((scene, fillings), &object.geometry, &space, report);
        let [triangles, spheres] = [
            first[0]..scene.triangles.len() as u32,
            first[1]..scene.spheres.len() as u32,
        ];
        let bounds = bounds(
            &scene.vertices,
            &scene.triangles[first[0] as usize..],
            &scene.spheres[first[1] as usize..],
        );
        spaces.push(space);
        scene.instances.objects.push(Object {
            triangles,
            spheres,
            bounds: bounds.unwrap_or_default(),
        });
    }
    let Space { centre, scale } = scene.space;
    let place = |p: &Placement| {
        let space = &spaces[p.object as usize];
        Instance {
            to_world: DAffine3 {
                matrix3: p.by.matrix3 * (scale / space.scale),
                translation: (p.by.transform_point3(space.centre) - centre) * scale,
            },
            object: p.object,
        }
    };
    scene.instances.placed = placed.iter().map(place).collect();
}

fn to_vertex(v: &super::geometry::WorldVertex, space: &Space) -> Vertex {
    let p = (v.p - space.centre) * space.scale;
    Vertex {
        // Beyond the bounds lie only vertices no triangle refers to.
        p: narrow_point(p).to_array(),
        n: v.n.to_array(),
        uv: v.uv.to_array(),
    }
}

fn tangents(geometry: &Geometry, space: &Space) -> Vec<[f32; 3]> {
    let narrow = |s: &DVec3| {
        let s = (s * space.scale).as_vec3();
        if s.is_finite() {
            s.to_array()
        } else {
            [0.0; 3]
        }
    };
    geometry.tangents.iter().map(narrow).collect()
}

/// Adds the triangles that have an area, and their lights; the first vertex of the geometry is the
/// scene's `base`. Returns how many have none, and how many of a lamp lie on others of it.
fn add_triangles(
    scene: &mut Scene,
    fillings: &mut Fillings,
    geometry: &Geometry,
    shape: &WorldShape,
    base: u32,
) -> [usize; 2] {
    let range = shape.first as usize..(shape.first + shape.count) as usize;
    let world = &geometry.triangles[range];
    let shape_index = scene.shapes.len() as u32;
    let first = scene.triangles.len() as u32;
    let first_light = scene.lights.len() as u32;
    let whole_area = match &shape.light {
        Some(light) if light.has_power() && shape.power_of_whole => {
            Some(world.iter().map(|t| geometry.triangle_area(t)).sum::<f64>())
        }
        _ => None,
    };
    let (mut flat, mut repeated) = (0, 0);
    let mut places = HashSet::new();
    for triangle in world {
        let v = triangle.v.map(|i| base + i);
        let [a, b, c] = v.map(|i| Vec3::from(scene.vertices[i as usize].p).as_dvec3());
        if (b - a).cross(c - a).length() <= MIN_CROSS {
            flat += 1;
            continue;
        }
        if let Some(light) = &shape.light
            && !places.insert(place(scene, v, light.two_sided))
        {
            repeated += 1;
            continue;
        }
        let index = scene.triangles.len() as u32;
        scene.triangles.push(Triangle {
            v,
            shape: shape_index,
        });
        if let Some(light) = &shape.light {
            let area = whole_area.unwrap_or_else(|| geometry.triangle_area(triangle));
            let (l, two_sided) = (light.radiance(area), light.two_sided);
            fillings.add_light(shape.media);
            add_light(scene, light, |image| match image {
                None => LightKind::Triangle {
                    triangle: index,
                    l,
                    two_sided,
                },
                Some(image) => LightKind::ImageTriangle {
                    triangle: index,
                    image,
                    scale: l[0],
                    two_sided,
                },
            });
        }
    }
    let kept = scene.triangles.len() - first as usize;
    if kept > 0 {
        let light = if shape.light.is_some() {
            first_light
        } else {
            NONE
        };
        scene.shapes.push(Shape {
            material: shape.material,
            light,
            first,
            alpha: shape.alpha,
            boundary: fillings.boundary(shape.media),
        });
    }
    [flat, repeated]
}

/// Adds the light that a primitive is; `kind` makes it, of an image if it shines by one.
fn add_light(scene: &mut Scene, light: &AreaLight, kind: impl FnOnce(Option<u32>) -> LightKind) {
    scene.lights.push(Light {
        origin: light.set.site.origin(),
        kind: kind(light.image),
    });
}

/// Where a triangle is, whatever its first corner; unless it shines to both sides, also which way
/// round it goes.
fn place(scene: &Scene, v: [u32; 3], both_sides: bool) -> [[u32; 3]; 3] {
    let mut corners = v.map(|v| scene.vertices[v as usize].p.map(|x| (x + 0.0).to_bits()));
    if both_sides {
        corners.sort_unstable();
    } else {
        let first = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(first);
    }
    corners
}

/// Adds spheres and their lights; `placed` gets their maps to `space`.
fn add_spheres(
    (scene, fillings): (&mut Scene, &mut Fillings),
    geometry: &Geometry,
    shape: &WorldShape,
    space: &Space,
    placed: &mut Vec<DAffine3>,
) {
    let range = shape.first as usize..(shape.first + shape.count) as usize;
    let shape_index = scene.shapes.len() as u32;
    let first = scene.spheres.len() as u32;
    let first_light = scene.lights.len() as u32;
    for world in &geometry.spheres[range] {
        let to_world = DAffine3 {
            matrix3: world.to_world.matrix3 * space.scale,
            translation: (world.to_world.translation - space.centre) * space.scale,
        };
        // Checked to be invertible when it was added; scaling by a power of two changes nothing
        // about that.
        let to_unit = inverse(&to_world).unwrap_or(DAffine3::IDENTITY);
        placed.push(to_world);
        let index = scene.spheres.len() as u32;
        scene.spheres.push(Sphere {
            to_world: rows(&to_world),
            to_unit: rows(&to_unit),
            facing: world.facing,
            shape: shape_index,
        });
        if let Some(light) = &shape.light {
            let area = if light.has_power() { world.area() } else { 0.0 };
            let (l, two_sided) = (light.radiance(area), light.two_sided);
            fillings.add_light(shape.media);
            add_light(scene, light, |image| match image {
                None => LightKind::Sphere {
                    sphere: index,
                    l,
                    two_sided,
                },
                Some(image) => LightKind::ImageSphere {
                    sphere: index,
                    image,
                    scale: l[0],
                    two_sided,
                },
            });
        }
    }
    let light = if shape.light.is_some() {
        first_light
    } else {
        NONE
    };
    scene.shapes.push(Shape {
        material: shape.material,
        light,
        first,
        alpha: shape.alpha,
        boundary: fillings.boundary(shape.media),
    });
}

/// Bounds of primitives; none without any.
fn bounds(vertices: &[Vertex], triangles: &[Triangle], spheres: &[Sphere]) -> Option<[Vec3; 2]> {
    let mut low = Vec3::INFINITY;
    let mut high = Vec3::NEG_INFINITY;
    for triangle in triangles {
        for i in triangle.v {
            let p = Vec3::from(vertices[i as usize].p);
            low = low.min(p);
            high = high.max(p);
        }
    }
    for sphere in spheres {
        let m = sphere.to_world;
        let centre = Vec3::new(m[0][3], m[1][3], m[2][3]);
        let half = Vec3::from(m.map(|r| Vec3::new(r[0], r[1], r[2]).length()));
        low = low.min(centre - half);
        high = high.max(centre + half);
    }
    (low.x <= high.x).then_some([low, high])
}

/// Bounds of all geometry that was kept, internal space.
fn whole_bounds(scene: &Scene) -> [Vec3; 2] {
    let own = bounds(
        &scene.vertices,
        &scene.triangles[..scene.own_triangles().end as usize],
        &scene.spheres[..scene.own_spheres().end as usize],
    );
    let Instances { objects, placed } = &scene.instances;
    let boxes = placed.iter().map(|i| {
        let around = i.around(objects[i.object as usize].bounds);
        around.map(|p| p.as_vec3())
    });
    let union = |a: [Vec3; 2], b: [Vec3; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    own.into_iter()
        .chain(boxes)
        .reduce(union)
        .unwrap_or_default()
}
