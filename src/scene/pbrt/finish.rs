//! From world space to the tables of [`Scene`] in internal space.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::error::SceneError;
use super::geometry::{Geometry, WorldShape};
use super::loader::{Loader, Pending};
use super::transform::{inverse, narrow_point, rows};
use super::view;
use crate::scene::{
    IntegratorSettings, Light, LightKind, NONE, Scene, Shape, Space, Sphere, Triangle, Vertex,
};

/// Twice the area (internal space) below which a triangle counts as having none: the square of its normal would leave `f32`.
const MIN_CROSS: f64 = 1e-18;

/// Puts the scene together.
pub(super) fn finish(mut loader: Loader) -> Result<Scene, SceneError> {
    let report = &mut loader.report;
    let take = |pending: Option<Pending>| pending.map(|p| (p.kind, p.set, p.ctm));

    let mut film = match take(loader.view.film.take()) {
        Some((kind, set, _)) => view::film(&kind, &set, report)?,
        None => view::default_film(),
    };
    film.filter = match take(loader.view.filter.take()) {
        Some((kind, set, _)) => view::filter(&kind, &set, report)?,
        None => view::default_filter(loader.dialect),
    };
    let mut camera_site = None;
    let camera = match take(loader.view.camera.take()) {
        Some((kind, set, ctm)) => {
            let camera = view::camera(&kind, &set, &ctm, &film, report)?;
            camera_site = Some(set.site);
            camera
        }
        None => view::default_camera(&film),
    };
    let mut integrator = match take(loader.view.integrator.take()) {
        Some((kind, set, _)) => view::integrator(&kind, &set, report)?,
        None => IntegratorSettings::default(),
    };
    if let Some((kind, set, _)) = take(loader.view.sampler.take()) {
        integrator.pixel_samples = view::pixel_samples(&kind, &set, report)?;
    }

    let space = space_of(&loader.geometry, camera.position());
    let camera = camera.to_internal(&space).ok_or_else(|| {
        let what = "its screen window is out of all proportion to the scene";
        match camera_site {
            Some(site) => site.error(what),
            None => SceneError(what.into()),
        }
    })?;
    let mut scene = Scene {
        vertices: loader
            .geometry
            .vertices
            .iter()
            .map(|v| to_vertex(v, &space))
            .collect(),
        triangles: Vec::with_capacity(loader.geometry.triangles.len()),
        spheres: Vec::with_capacity(loader.geometry.spheres.len()),
        shapes: Vec::with_capacity(loader.geometry.shapes.len()),
        alphas: std::mem::take(&mut loader.tables.alphas),
        materials: std::mem::take(&mut loader.tables.materials),
        textures: loader.tables.take_textures(&space),
        images: std::mem::take(&mut loader.tables.images),
        lights: loader
            .lights
            .iter()
            .map(|l| l.to_internal(&space))
            .collect(),
        camera,
        film,
        integrator,
        space,
        bounds: [Vec3::ZERO; 2],
        files: loader.dir.files(),
        warnings: Vec::new(),
    };
    for shape in &loader.geometry.shapes {
        let dropped = if shape.spheres {
            add_spheres(&mut scene, &loader.geometry, shape);
            0
        } else {
            add_triangles(&mut scene, &loader.geometry, shape)
        };
        if dropped > 0 {
            loader.report.warn_at(
                &shape.site,
                format_args!("{dropped} triangles without area dropped"),
            );
        }
    }
    scene.bounds = bounds(&scene);
    scene.warnings = loader.report.finish();
    Ok(scene)
}

/// The space whose origin is the centre of the geometry's bounds, scaled so that their sphere's radius is in `(0.5, 1]`.
fn space_of(geometry: &Geometry, camera: DVec3) -> Space {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    let mut add = |p: DVec3| {
        low = low.min(p);
        high = high.max(p);
    };
    for triangle in &geometry.triangles {
        triangle
            .v
            .iter()
            .for_each(|&i| add(geometry.vertices[i as usize].p));
    }
    // So far out that their size is lost in the rounding of their place, spheres have it all the same.
    let mut least = DVec3::ZERO;
    for sphere in &geometry.spheres {
        let centre = sphere.to_world.translation;
        let half = sphere_extent(&sphere.to_world.matrix3);
        add(centre - half);
        add(centre + half);
        least = least.max(half);
    }
    if low.x > high.x {
        return Space {
            centre: camera,
            scale: 1.0,
        };
    }
    // Halved first: the sum of the two may be more than an f64 holds.
    let centre = low / 2.0 + high / 2.0;
    let half = (high / 2.0 - low / 2.0).max(least);
    let largest = half.max_element();
    if largest <= 0.0 {
        return Space { centre, scale: 1.0 };
    }
    let radius = (half / largest).length() * largest;
    let exponent = -radius.log2().ceil();
    Space {
        centre,
        scale: exponent.clamp(-1000.0, 1000.0).exp2(),
    }
}

/// Half the size of the bounding box of the unit sphere's image.
fn sphere_extent(m: &DMat3) -> DVec3 {
    let row_length = |i: usize| DVec3::new(m.x_axis[i], m.y_axis[i], m.z_axis[i]).length();
    DVec3::new(row_length(0), row_length(1), row_length(2))
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

/// Adds the triangles that have an area, and their lights; returns how many have none.
fn add_triangles(scene: &mut Scene, geometry: &Geometry, shape: &WorldShape) -> usize {
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
    for triangle in world {
        let [a, b, c] = triangle
            .v
            .map(|i| Vec3::from(scene.vertices[i as usize].p).as_dvec3());
        if (b - a).cross(c - a).length() <= MIN_CROSS {
            continue;
        }
        let index = scene.triangles.len() as u32;
        scene.triangles.push(Triangle {
            v: triangle.v,
            shape: shape_index,
        });
        if let Some(light) = &shape.light {
            let l = light.radiance(whole_area.unwrap_or_else(|| geometry.triangle_area(triangle)));
            let two_sided = light.two_sided;
            let kind = match light.image {
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
            };
            scene.lights.push(Light {
                origin: light.set.site.origin(),
                kind,
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
        });
    }
    world.len() - kept
}

fn add_spheres(scene: &mut Scene, geometry: &Geometry, shape: &WorldShape) {
    let range = shape.first as usize..(shape.first + shape.count) as usize;
    let shape_index = scene.shapes.len() as u32;
    let first = scene.spheres.len() as u32;
    let first_light = scene.lights.len() as u32;
    let space = scene.space;
    for world in &geometry.spheres[range] {
        let to_world = DAffine3 {
            matrix3: world.to_world.matrix3 * space.scale,
            translation: (world.to_world.translation - space.centre) * space.scale,
        };
        // Checked to be invertible when it was added; scaling by a power of two changes nothing about that.
        let to_unit = inverse(&to_world).unwrap_or(DAffine3::IDENTITY);
        let index = scene.spheres.len() as u32;
        scene.spheres.push(Sphere {
            to_world: rows(&to_world),
            to_unit: rows(&to_unit),
            facing: world.facing,
            shape: shape_index,
        });
        if let Some(light) = &shape.light {
            let l = light.radiance(if light.has_power() { world.area() } else { 0.0 });
            let two_sided = light.two_sided;
            let kind = match light.image {
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
            };
            scene.lights.push(Light {
                origin: light.set.site.origin(),
                kind,
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
    });
}

/// Bounds of all geometry that was kept, internal space.
fn bounds(scene: &Scene) -> [Vec3; 2] {
    let mut low = Vec3::INFINITY;
    let mut high = Vec3::NEG_INFINITY;
    for triangle in &scene.triangles {
        for i in triangle.v {
            let p = Vec3::from(scene.vertices[i as usize].p);
            low = low.min(p);
            high = high.max(p);
        }
    }
    for sphere in &scene.spheres {
        let m = sphere.to_world;
        let centre = Vec3::new(m[0][3], m[1][3], m[2][3]);
        let half = Vec3::from(m.map(|r| Vec3::new(r[0], r[1], r[2]).length()));
        low = low.min(centre - half);
        high = high.max(centre + half);
    }
    if low.x > high.x {
        [Vec3::ZERO; 2]
    } else {
        [low, high]
    }
}
