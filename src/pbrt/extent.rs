//! How large things are, and where the small ones are: what decides on the origin of internal
//! space, and on what is kept in `f64`.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, DVec3};

use super::geometry::Geometry;
use super::transform::inverse;
use crate::scene::large::{Large, LargeSphere, LargeTriangle};
use crate::scene::{NONE, Scene, Space};

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
/// Part of the primitives that may be smaller than what counts as small: slivers of a mesh say
/// nothing about its scale.
const SLIVERS: f64 = 0.01;
/// The bounds' centre is the origin unless small things are this far from it, in units of their
/// size.
const OFF_CENTRE: f64 = 4096.0;

/// The camera's place and those of some lights.
pub(super) struct Eyes(pub Vec<DVec3>);

/// Numbers of things by size, a quarter of a factor of two each.
struct Sizes {
    buckets: Vec<u64>,
    count: u64,
}

impl Sizes {
    fn new() -> Self {
        Self {
            buckets: vec![0; 1 << 13],
            count: 0,
        }
    }

    fn add(&mut self, size: f64) {
        // Exponent and the first two digits.
        self.buckets[(size.abs().to_bits() >> 50) as usize] += 1;
        self.count += 1;
    }

    /// The size that at most `part` of the things fall short of.
    fn quantile(&self, part: f64) -> f64 {
        let mut below = (self.count as f64 * part) as u64;
        for (i, &n) in self.buckets.iter().enumerate() {
            if n > below {
                return f64::from_bits((i as u64) << 50);
            }
            below -= n;
        }
        0.0
    }
}

/// A box around something.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const NONE: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    fn of(points: [DVec3; 3]) -> Self {
        let [a, b, c] = points;
        Self {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn size(&self) -> f64 {
        (self.high - self.low).max_element()
    }

    fn distance(&self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length()
    }
}

/// A lower bound of the distance of `p` to a triangle.
fn triangle_distance(p: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a).normalize_or_zero();
    n.dot(p - a).abs().max(Bounds::of(corners).distance(p))
}

/// Roughly the distance of `p` to the image of the unit sphere; less rather than more.
fn sphere_distance(p: DVec3, to_unit: &DAffine3) -> f64 {
    let least = 1.0 / axes(&to_unit.matrix3).max_element();
    (to_unit.transform_point3(p).length() - 1.0).abs() * least
}

/// Half the size of the bounding box of the unit sphere's image.
fn axes(m: &DMat3) -> DVec3 {
    let row_length = |i: usize| DVec3::new(m.x_axis[i], m.y_axis[i], m.z_axis[i]).length();
    DVec3::new(row_length(0), row_length(1), row_length(2))
}

/// The space whose origin is the centre of the geometry's bounds, or where the small things are if
/// that is far from it; scaled so that everything lies within a radius in `(0.5, 1]`.
pub(super) fn space_of(geometry: &Geometry, eyes: &Eyes) -> Space {
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
    let Bounds { low, high } = bounds;
    if low.x > high.x {
        return Space {
            centre: eyes.0.first().copied().unwrap_or_default(),
            scale: 1.0,
        };
    }
    // Halved first: the sum of the two may be more than an f64 holds.
    let middle = low / 2.0 + high / 2.0;
    let centre = centre_of_detail(geometry, eyes, middle).unwrap_or(middle);
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
fn centre_of_detail(geometry: &Geometry, eyes: &Eyes, middle: DVec3) -> Option<DVec3> {
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
    // Slivers and things that touch must not decide.
    let least = sizes.quantile(SLIVERS);
    let whole = geometry_size(geometry);
    let (mut sum, mut total, mut count) = (DVec3::ZERO, 0.0, 0.0);
    let mut add = |p: DVec3, size: f64, least: f64| {
        let size = size.max(least).max(whole * 1e-12);
        let weight = (whole / size).powi(2);
        sum += (p - middle) * weight;
        total += weight;
        count += 1.0;
    };
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

/// The size of the largest primitive.
fn geometry_size(geometry: &Geometry) -> f64 {
    let triangles = (geometry.triangles.iter()).map(|t| Bounds::of(corners(geometry, t.v)).size());
    let spheres = (geometry.spheres.iter()).map(|s| 2.0 * axes(&s.to_world.matrix3).max_element());
    triangles.chain(spheres).fold(f64::MIN_POSITIVE, f64::max)
}

fn corners(geometry: &Geometry, v: [u32; 3]) -> [DVec3; 3] {
    v.map(|i| geometry.vertices[i as usize].p)
}

/// The large surfaces of a scene whose other tables are filled; `spheres` are its spheres in
/// internal space.
pub(super) fn large_of(
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
    for i in 0..scene.triangles.len() {
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
            }),
            Some(i) => large.spheres.push(LargeSphere {
                sphere: i as u32,
                to_world: spheres[i],
                to_unit: to_unit[i],
            }),
        }
    }
    add_seams(scene, &corners, &mut large);
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
        for (i, triangle) in scene.triangles.iter().enumerate() {
            let b = Bounds::of(corners(i));
            sizes.add(b.size());
            let shape = &mut shapes[triangle.shape as usize];
            *shape = shape.with(b);
        }
        for (i, sphere) in scene.spheres.iter().enumerate() {
            let b = sphere_box(i);
            sizes.add(b.size());
            let shape = &mut shapes[sphere.shape as usize];
            *shape = shape.with(b);
        }
        shapes.iter().for_each(|b| whole = whole.with(*b));
        // Nothing is larger than twice this.
        let most = 2.0 * whole.size() / SHAPES;
        shapes.retain(|b| b.low.x <= b.high.x && b.size() <= most);
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

/// Adds the neighbours of large triangles: all that share a corner with one.
fn add_seams(scene: &Scene, corners: &dyn Fn(usize) -> [DVec3; 3], large: &mut Large) {
    if large.triangles.is_empty() {
        return;
    }
    // Zeros of both signs are one place.
    let place = |v: u32| scene.vertices[v as usize].p.map(|x| (x + 0.0).to_bits());
    let mut is_large = vec![false; scene.triangles.len()];
    let mut places = HashSet::new();
    for t in &large.triangles {
        is_large[t.triangle as usize] = true;
        places.extend(scene.triangles[t.triangle as usize].v.map(place));
    }
    for (i, triangle) in scene.triangles.iter().enumerate() {
        if !is_large[i] && triangle.v.iter().any(|&v| places.contains(&place(v))) {
            large.triangles.push(LargeTriangle {
                triangle: i as u32,
                p: corners(i),
                seam: true,
            });
        }
    }
    debug_assert!(large.triangles.iter().all(|t| t.triangle != NONE));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;

    fn load(shapes: &str) -> Scene {
        let text =
            format!("LookAt 3 0 1  0 0 0  0 0 1\nCamera \"perspective\"\nWorldBegin\n{shapes}");
        load_str(&text, "test.pbrt", ".".as_ref()).unwrap()
    }

    fn ground(s: f64, x: f64) -> String {
        let (a, b) = (x - s, x + s);
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{a} {a} 0 {b} {a} 0 {b} {b} 0 {a} {b} 0]\n"
        )
    }

    const BALL: &str =
        "AttributeBegin\nTranslate 0 0 .5\nShape \"sphere\" \"float radius\" .5\nAttributeEnd\n";

    #[test]
    fn grounds_are_large_if_something_small_is_next_to_them() {
        assert_eq!(load(&(ground(4e2, 0.0) + BALL)).large.len(), 0);
        assert_eq!(load(&(ground(1e5, 0.0) + BALL)).large.len(), 2);
        // The camera is small enough.
        assert_eq!(load(&ground(1e5, 0.0)).large.len(), 2);
        assert_eq!(load(&ground(10.0, 0.0)).large.len(), 0);
        // A spark in the air is no reason.
        let spark = "AttributeBegin\nTranslate 0 0 1\nShape \"sphere\" \"float radius\" 1e-5\nAttributeEnd\n";
        assert_eq!(load(&(ground(3.0, 0.0) + spark)).large.len(), 0);
    }

    #[test]
    fn neighbours_of_large_triangles_are_their_seam() {
        // A fan of small triangles on the ground's corner.
        let fan = "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-100000 -100000 0 -100000 -100001 0 -100001 -100001 0]\n";
        let scene = load(&(ground(1e5, 0.0) + BALL + fan));
        let seams: Vec<bool> = scene.large.triangles.iter().map(|t| t.seam).collect();
        assert_eq!(seams, [false, false, true]);
    }

    #[test]
    fn the_origin_is_where_small_things_are() {
        let scene = load(&(ground(1e6, 9e5) + BALL));
        assert!(scene.space.centre.length() < 10.0, "{:?}", scene.space);
        let reach = scene.bounds.map(|b| b.length());
        assert!(
            reach.iter().all(|r| *r <= 1.0) && reach[1] > 0.5,
            "{reach:?}"
        );
        // In usual scenes it is the middle.
        let scene = load(&(ground(5.0, 4.0) + BALL));
        assert_eq!(scene.space.centre.truncate(), glam::DVec2::splat(4.0));
    }

    #[test]
    fn quantiles_leave_slivers_out() {
        let mut sizes = Sizes::new();
        assert_eq!(sizes.quantile(0.5), 0.0);
        sizes.add(1e-9);
        (0..1000).for_each(|_| sizes.add(3.0));
        let size = sizes.quantile(SLIVERS);
        assert!((2.0..=3.0).contains(&size), "{size}");
        assert!(sizes.quantile(0.0) < 1.01e-9);
    }
}
