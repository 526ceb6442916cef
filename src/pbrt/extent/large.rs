//! Which surfaces are large, what their seams are, and how far `f64` is from them.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use glam::{DAffine3, DVec3};

use super::super::geometry::Geometry;
use super::super::transform::inverse;
use super::measure::{
    Bounds, Detail, Eyes, SLIVERS, Sizes, axes, corners, sphere_distance, triangle_distance,
};
use crate::scene::large::{Large, LargeSphere, LargeTriangle};
use crate::scene::{Instances, NONE, Object, Scene, Sphere};

/// A surface is large if it is so many times the size of a shape next to it, ...
const SHAPES: f64 = 4096.0;
/// ... or of the smallest primitives, ...
const PRIMITIVES: f64 = 8192.0;
/// ... or if the camera, or a light at a point, is next to it: nearer than this part of its size.
/// `f32` then errs by a hundredth of the smallest at most.
const NEAR: f64 = 1.0 / 1024.0;
/// Small shapes whose places are looked at, at most; of more, some are next to any large surface.
const MOST_SHAPES: usize = 4096;
/// Most surfaces that are kept in `f64` for their size.
const MOST: usize = 4096;

/// The large surfaces of a scene whose other tables are filled; `spheres` are its spheres in
/// internal space.
pub(in super::super) fn large_of(
    scene: &Scene,
    geometry: &Geometry,
    spheres: &[DAffine3],
    eyes: &Eyes,
) -> Large {
    let internal = |p: DVec3| (p - scene.space.centre) * scene.space.scale;
    let corners = |i: usize| corners(geometry, scene.triangles[i].v).map(internal);
    let to_unit: Vec<DAffine3> = spheres
        .iter()
        .map(|s| inverse(s).unwrap_or(DAffine3::IDENTITY))
        .collect();
    let sphere_box = |i: usize| {
        let (centre, half) = (spheres[i].translation, axes(&spheres[i].matrix3));
        Bounds {
            low: centre - half,
            high: centre + half,
        }
    };
    let smallest = Smallest::of(scene, &corners, &sphere_box);
    let eyes: Vec<DVec3> = eyes.0.iter().map(|&p| internal(p)).collect();
    let near = |size: f64, distance: &dyn Fn(DVec3) -> f64| {
        eyes.iter().any(|&eye| distance(eye) < NEAR * size)
    };
    let mut found = Vec::new();
    for i in scene.own_triangles().map(|i| i as usize) {
        let p = corners(i);
        let bounds = Bounds::of(p);
        let size = bounds.size();
        // The box first: of most triangles it is far enough.
        if size > smallest.limit
            || near(size, &|eye| bounds.distance(eye))
                && near(size, &|eye| triangle_distance(eye, p))
        {
            found.push((size, i));
        }
    }
    for (i, to_unit) in to_unit.iter().enumerate() {
        let size = sphere_box(i).size();
        if size > smallest.limit || near(size, &|eye| sphere_distance(eye, to_unit)) {
            found.push((size, scene.triangles.len() + i));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    found.truncate(MOST);
    found.retain(|&(size, primitive)| {
        let distance = |p: DVec3| match primitive.checked_sub(scene.triangles.len()) {
            None => triangle_distance(p, corners(primitive)),
            Some(i) => sphere_distance(p, &to_unit[i]),
        };
        near(size, &distance) || smallest.matters(size, &distance)
    });
    let mut large = Large::default();
    for (_, primitive) in found {
        match primitive.checked_sub(scene.triangles.len()) {
            None => large.triangles.push(LargeTriangle {
                triangle: primitive as u32,
                p: corners(primitive),
                seam: false,
                off: 0.0,
            }),
            Some(i) => large.spheres.push(LargeSphere {
                sphere: i as u32,
                to_world: spheres[i],
                to_unit: to_unit[i],
            }),
        }
    }
    add_seams(scene, &corners, &mut large);
    find_errors(scene, &mut large);
    large
}

/// The small things of a scene.
struct Smallest {
    /// Shapes, unless there are too many.
    shapes: Option<Vec<Bounds>>,
    /// The size beyond which a surface may be large, ...
    limit: f64,
    /// ... and beyond which it is, whatever is next to it.
    sure: f64,
}

impl Smallest {
    fn of(
        scene: &Scene,
        corners: &dyn Fn(usize) -> [DVec3; 3],
        sphere_box: &dyn Fn(usize) -> Bounds,
    ) -> Self {
        let mut sizes = Sizes::new();
        let mut shapes = vec![Bounds::NONE; scene.shapes.len()];
        let mut whole = Bounds::NONE;
        let own = &scene.triangles[..scene.own_triangles().end as usize];
        for (i, triangle) in own.iter().enumerate() {
            let b = Bounds::of(corners(i));
            sizes.add(b.size());
            let shape = &mut shapes[triangle.shape as usize];
            *shape = shape.with(b);
        }
        let own = &scene.spheres[..scene.own_spheres().end as usize];
        for (i, sphere) in own.iter().enumerate() {
            let b = sphere_box(i);
            sizes.add(b.size());
            let shape = &mut shapes[sphere.shape as usize];
            *shape = shape.with(b);
        }
        // Shapes of objects are where these are seen.
        shapes.retain(|b| b.low.x <= b.high.x);
        let Instances { objects, placed } = &scene.instances;
        let details: Vec<Detail> = objects.iter().map(|o| detail(scene, o)).collect();
        for instance in placed {
            let object = instance.object as usize;
            let [low, high] = instance.around(objects[object].bounds);
            shapes.push(Bounds { low, high });
            let scale = instance.to_world.matrix3.determinant().abs().cbrt();
            sizes.add_instance(&details[object], scale);
        }
        shapes.iter().for_each(|b| whole = whole.with(*b));
        // Nothing is larger than twice this.
        let most = 2.0 * whole.size() / SHAPES;
        shapes.retain(|b| b.size() <= most);
        let smallest = shapes.iter().fold(f64::INFINITY, |s, b| b.size().min(s));
        // Of few primitives no part is small enough to say what is usual.
        let sure = if sizes.count as f64 * SLIVERS >= 1.0 {
            PRIMITIVES * sizes.quantile(SLIVERS)
        } else {
            f64::INFINITY
        };
        Self {
            shapes: (shapes.len() <= MOST_SHAPES).then_some(shapes),
            limit: (SHAPES * smallest).min(sure),
            sure,
        }
    }

    /// Whether something small is next to a surface of this size and at this distance of places.
    fn matters(&self, size: f64, distance: &dyn Fn(DVec3) -> f64) -> bool {
        let is_near = |b: &Bounds| {
            let middle = b.low / 2.0 + b.high / 2.0;
            SHAPES * b.size() < size && distance(middle) < NEAR * size + b.size()
        };
        let shapes = self.shapes.as_ref();
        size > self.sure || shapes.is_none_or(|shapes| shapes.iter().any(is_near))
    }
}

/// How large the primitives of an object are, in its space.
fn detail(scene: &Scene, object: &Object) -> Detail {
    let range = |r: &Range<u32>| r.start as usize..r.end as usize;
    let point = |v: u32| DVec3::from(scene.vertices[v as usize].p.map(f64::from));
    let triangles = &scene.triangles[range(&object.triangles)];
    let spheres = &scene.spheres[range(&object.spheres)];
    let radius = |s: &Sphere| {
        let row = |r: &[f32; 4]| f64::from(r[0].hypot(r[1]).hypot(r[2]));
        s.to_world.iter().map(row).fold(0.0, f64::max)
    };
    let of_triangles = triangles.iter().map(|t| Bounds::of(t.v.map(point)).size());
    Detail::of(of_triangles.chain(spheres.iter().map(|s| 2.0 * radius(s))))
}

/// Adds the neighbours of large triangles: all that share a corner with one.
fn add_seams(scene: &Scene, corners: &dyn Fn(usize) -> [DVec3; 3], large: &mut Large) {
    if large.triangles.is_empty() {
        return;
    }
    let place = |v: u32| place(scene, v);
    let mut is_large = vec![false; scene.triangles.len()];
    let mut places = HashSet::new();
    for t in &large.triangles {
        is_large[t.triangle as usize] = true;
        places.extend(scene.triangles[t.triangle as usize].v.map(place));
    }
    let own = &scene.triangles[..scene.own_triangles().end as usize];
    for (i, triangle) in own.iter().enumerate() {
        if !is_large[i] && triangle.v.iter().any(|&v| places.contains(&place(v))) {
            large.triangles.push(LargeTriangle {
                triangle: i as u32,
                p: corners(i),
                seam: true,
                off: 0.0,
            });
        }
    }
    debug_assert!(large.triangles.iter().all(|t| t.triangle != NONE));
}

/// Where a vertex is, as far as `f32` knows. Zeros of both signs are one place.
fn place(scene: &Scene, vertex: u32) -> [u32; 3] {
    (scene.vertices[vertex as usize].p).map(|x| (x + 0.0).to_bits())
}

/// Finds how far `f64` is from the planes of large triangles: by the largest coordinates in them
/// and in those that share a corner.
fn find_errors(scene: &Scene, large: &mut Large) {
    let shift = scene.space.centre.abs().max_element() * scene.space.scale;
    let reach = |t: &LargeTriangle| {
        let corners = t.p.map(|p| p.abs().max_element());
        shift + corners.into_iter().fold(0.0, f64::max)
    };
    let places = |t: &LargeTriangle| {
        scene.triangles[t.triangle as usize]
            .v
            .map(|v| place(scene, v))
    };
    let mut reaches = HashMap::new();
    for t in &large.triangles {
        for place in places(t) {
            let most = reaches.entry(place).or_insert(0.0);
            *most = reach(t).max(*most);
        }
    }
    for t in &mut large.triangles {
        let most = places(t).into_iter().map(|place| reaches[&place]);
        t.off = LargeTriangle::OFF * most.fold(0.0, f64::max);
    }
}
