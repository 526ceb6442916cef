//! Where the origin of internal space is: at the centre of the scene, or where the small things
//! are.

use glam::{DAffine3, DVec3};

use super::super::geometry::Geometry;
use super::super::instances::Instances;
use super::super::transform::inverse;
use super::measure::{
    Bounds, Detail, Eyes, SLIVERS, Sizes, axes, corners, sphere_distance, triangle_distance,
};
use crate::scene::Space;

/// The bounds' centre is the origin unless small things are this far from it, in units of their
/// size.
const OFF_CENTRE: f64 = 4096.0;

/// The space whose origin is the centre of the geometry's bounds, or where the small things are if
/// that is far from it; scaled so that everything lies within a radius in `(0.5, 1]`.
pub(in super::super) fn space_of(geometry: &Geometry, instances: &Instances, eyes: &Eyes) -> Space {
    let mut bounds = Bounds::NONE;
    for triangle in &geometry.triangles {
        bounds = bounds.with(Bounds::of(corners(geometry, triangle.v)));
    }
    // So far out that their size is lost in the rounding of their place, spheres have it all the
    // same.
    let mut least = DVec3::ZERO;
    for sphere in &geometry.spheres {
        let centre = sphere.to_world.translation;
        let half = axes(&sphere.to_world.matrix3);
        bounds = bounds.with(Bounds {
            low: centre - half,
            high: centre + half,
        });
        least = least.max(half);
    }
    for placement in &instances.placed {
        let [low, high] = placement.around(&instances.objects[placement.object as usize]);
        bounds = bounds.with(Bounds { low, high });
    }
    let Bounds { low, high } = bounds;
    if low.x > high.x {
        return Space {
            centre: eyes.0.first().copied().unwrap_or_default(),
            scale: 1.0,
        };
    }
    // Halved first: the sum of the two may be more than an f64 holds.
    let middle = low / 2.0 + high / 2.0;
    let centre = centre_of_detail(geometry, instances, eyes, middle).unwrap_or(middle);
    let reach = |end: DVec3| (end / 2.0 - centre / 2.0).abs() * 2.0;
    let half = if centre == middle {
        (high / 2.0 - low / 2.0).max(least)
    } else {
        reach(low).max(reach(high)).max(least)
    };
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

/// The origin from which the squares of all places, in units of the sizes there, add up to the
/// least: what `f32` loses of a place grows with its distance from the origin. `None` if the
/// `middle` does as well.
fn centre_of_detail(
    geometry: &Geometry,
    instances: &Instances,
    eyes: &Eyes,
    middle: DVec3,
) -> Option<DVec3> {
    let mut sizes = Sizes::new();
    let mut near: Vec<f64> = vec![f64::INFINITY; eyes.0.len()];
    for triangle in &geometry.triangles {
        let p = corners(geometry, triangle.v);
        sizes.add(Bounds::of(p).size());
        for (near, &eye) in near.iter_mut().zip(&eyes.0) {
            *near = near.min(triangle_distance(eye, p));
        }
    }
    for sphere in &geometry.spheres {
        let to_unit = inverse(&sphere.to_world).unwrap_or(DAffine3::IDENTITY);
        sizes.add(2.0 * axes(&sphere.to_world.matrix3).max_element());
        for (near, &eye) in near.iter_mut().zip(&eyes.0) {
            *near = near.min(sphere_distance(eye, &to_unit));
        }
    }
    let details: Vec<Detail> = (instances.objects.iter())
        .map(|o| Detail::of(sizes_of(&o.geometry)))
        .collect();
    for placement in &instances.placed {
        sizes.add_instance(&details[placement.object as usize], placement.scale());
    }
    // Slivers and things that touch must not decide.
    let least = sizes.quantile(SLIVERS);
    let mut whole = sizes_of(geometry).fold(f64::MIN_POSITIVE, f64::max);
    for placement in &instances.placed {
        let usual = details[placement.object as usize].usual;
        whole = whole.max(usual * placement.scale());
    }
    let (mut sum, mut total, mut count) = (DVec3::ZERO, 0.0, 0.0);
    let mut add_many = |p: DVec3, size: f64, least: f64, n: f64| {
        let size = size.max(least).max(whole * 1e-12);
        let weight = (whole / size).powi(2) * n;
        sum += (p - middle) * weight;
        total += weight;
        count += n;
    };
    for placement in &instances.placed {
        let object = placement.object as usize;
        let [low, high] = placement.around(&instances.objects[object]);
        let (size, n) = (details[object].usual, details[object].count);
        let at = low / 2.0 + high / 2.0;
        add_many(at, size * placement.scale(), least, n as f64);
    }
    let mut add = |p: DVec3, size: f64, least: f64| add_many(p, size, least, 1.0);
    for triangle in &geometry.triangles {
        let b = Bounds::of(corners(geometry, triangle.v));
        add(b.low / 2.0 + b.high / 2.0, b.size(), least);
    }
    for sphere in &geometry.spheres {
        let size = 2.0 * axes(&sphere.to_world.matrix3).max_element();
        add(sphere.to_world.translation, size, least);
    }
    for (&eye, &near) in eyes.0.iter().zip(&near) {
        add(eye, near, 0.0);
    }
    let offset = sum / total;
    let size = whole * (count / total).sqrt();
    let is_off = offset.is_finite() && offset.length() > OFF_CENTRE * size;
    is_off.then_some(middle + offset)
}

/// The sizes of all primitives.
fn sizes_of(geometry: &Geometry) -> impl Iterator<Item = f64> {
    let triangles = (geometry.triangles.iter()).map(|t| Bounds::of(corners(geometry, t.v)).size());
    let spheres = (geometry.spheres.iter()).map(|s| 2.0 * axes(&s.to_world.matrix3).max_element());
    triangles.chain(spheres)
}
