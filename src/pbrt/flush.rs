//! Lamps that lie in other surfaces.
//!
//! Where two surfaces lie in one place, the rounding of each ray would decide which one it meets,
//! and a lamp in a ceiling would be seen by some rays and not by others. One rule holds for all
//! rays, strategies and integrators: **a lamp that lies in another surface lies just in front of
//! it**, on the side to which it shines (of a lamp that shines to both sides, the side of the
//! camera). Of lamps in one place that shine to one side, the brighter lies in front, then the one
//! that comes first in the file. The distance is a hundred-thousandth of the scene, and no more
//! than a small part of the lamp: enough for any ray to tell the two apart. What lies within half
//! of it counts as in one place.
//!
//! Lamps are moved before anything else sees them, so there is nothing to agree on later.

mod tree;

use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

use glam::{DVec2, DVec3};

use self::tree::{Facet, arrange, visit};
use super::error::{Report, Site};
use super::geometry::{Geometry, WorldTriangle};
use super::instances::Instances;
use crate::scene::{Material, MaterialKind, NONE, Space};

/// How far in front a lamp lies, in units of the scene's radius: some 256 roundings.
const STEP: f64 = 1.0 / 65_536.0;
/// The same in units of the lamp's size, at most.
const STEP_OF_LAMP: f64 = 1.0 / 256.0;
/// Lamps in one place that lie one before the other, at most.
const MOST_LAYERS: u32 = 16;
/// Planes of one shape that are looked after, at most.
const MOST_PLANES: usize = 64;
/// Pairs of triangles that are compared, at most.
const MOST_PAIRS: u64 = 1 << 26;

/// A shape that emits light.
struct Lamp {
    /// Index of the shape.
    shape: usize,
    /// How far in front of what it lies in.
    step: f64,
    brightness: f32,
    two_sided: bool,
    /// Planes of its facets that lie in other surfaces.
    planes: Vec<Plane>,
    /// A surface it lies in.
    wall: Option<Rc<Site>>,
}

#[derive(Clone, Copy)]
struct Plane {
    p: DVec3,
    n: DVec3,
}

impl Plane {
    fn of([a, b, c]: [DVec3; 3]) -> Option<Self> {
        let n = (b - a).cross(c - a).try_normalize()?;
        Some(Self { p: a, n })
    }

    /// Whether all corners lie in it.
    fn holds(&self, p: [DVec3; 3], tolerance: f64) -> bool {
        p.iter().all(|p| self.n.dot(*p - self.p).abs() <= tolerance)
    }
}

/// Moves lamps that lie in other surfaces off them, with a warning each.
pub(super) fn part(
    (geometry, instances): (&mut Geometry, &Instances),
    materials: &[Material],
    space: &Space,
    eye: DVec3,
    report: &mut Report,
) {
    let (mut lamps, mut facets) = collect(geometry, materials, space);
    if facets.is_empty() {
        return;
    }
    let mut tree = Vec::new();
    arrange(&mut facets, &mut tree);
    let scene = (&*geometry, instances);
    let neighbours = find(scene, materials, &mut lamps, &facets, &tree);
    for lamp in &mut lamps {
        turn(lamp, eye);
    }
    let layers = layers(&lamps, &neighbours);
    for (lamp, layer) in lamps.iter().zip(layers) {
        if lamp.planes.is_empty() {
            continue;
        }
        shift(geometry, lamp, f64::from(layer) * lamp.step);
        // Without a wall it lies in itself, back to back.
        let shape = &geometry.shapes[lamp.shape];
        let (Some(light), Some(wall)) = (&shape.light, &lamp.wall) else {
            continue;
        };
        let origin = light.set.site.origin();
        report.warn_once(
            &format!("lamp in a surface {origin}"),
            &light.set.site,
            format_args!(
                "the lamp at {} lies in the surface at {}; it is taken to lie just in front of it",
                shape.site.origin(),
                wall.origin()
            ),
        );
    }
}

fn is_visible(materials: &[Material], material: u32) -> bool {
    let kind = materials.get(material as usize).map(|m| &m.kind);
    material == NONE || !matches!(kind, Some(MaterialKind::Interface))
}

fn corners(geometry: &Geometry, triangle: &WorldTriangle) -> [DVec3; 3] {
    triangle.v.map(|i| geometry.vertices[i as usize].p)
}

/// All lamps made of triangles, and those triangles.
fn collect(geometry: &Geometry, materials: &[Material], space: &Space) -> (Vec<Lamp>, Vec<Facet>) {
    let (mut lamps, mut facets) = (Vec::new(), Vec::new());
    for (index, shape) in geometry.shapes.iter().enumerate() {
        let Some(light) = &shape.light else { continue };
        if shape.spheres || !is_visible(materials, shape.material) {
            continue;
        }
        let range = shape.first as usize..(shape.first + shape.count) as usize;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for triangle in &geometry.triangles[range] {
            let p = corners(geometry, triangle);
            let facet = Facet {
                lamp: lamps.len(),
                p,
                low: p[0].min(p[1]).min(p[2]),
                high: p[0].max(p[1]).max(p[2]),
            };
            (low, high) = (low.min(facet.low), high.max(facet.high));
            if Plane::of(p).is_some() {
                facets.push(facet);
            }
        }
        let size = (high - low).max_element().max(0.0);
        let l = light.radiance(1.0);
        lamps.push(Lamp {
            shape: index,
            step: (STEP / space.scale).min(STEP_OF_LAMP * size),
            brightness: l[0] + l[1] + l[2],
            two_sided: light.two_sided,
            planes: Vec::new(),
            wall: None,
        });
    }
    (lamps, facets)
}

/// Finds what lamps lie in: their planes, and pairs of lamps in one place.
fn find(
    (geometry, instances): (&Geometry, &Instances),
    materials: &[Material],
    lamps: &mut [Lamp],
    facets: &[Facet],
    tree: &[[DVec3; 2]],
) -> BTreeSet<[usize; 2]> {
    let most = lamps.iter().fold(0.0, |most, l| l.step.max(most));
    let lamp_of: HashMap<usize, usize> = (lamps.iter().enumerate())
        .map(|(i, l)| (l.shape, i))
        .collect();
    let mut finding = Finding {
        lamps,
        facets,
        tree,
        most,
        pairs: 0,
        neighbours: BTreeSet::new(),
    };
    for (index, shape) in geometry.shapes.iter().enumerate() {
        if shape.spheres || !is_visible(materials, shape.material) {
            continue;
        }
        let other = lamp_of.get(&index).copied();
        let range = shape.first as usize..(shape.first + shape.count) as usize;
        for triangle in &geometry.triangles[range] {
            finding.meet(corners(geometry, triangle), other, &shape.site);
        }
    }
    for placement in &instances.placed {
        let object = &instances.objects[placement.object as usize];
        let [low, high] = placement.around(object);
        if !finding.is_near([low, high]) {
            continue;
        }
        let geometry = &object.geometry;
        for shape in &geometry.shapes {
            if shape.spheres || !is_visible(materials, shape.material) {
                continue;
            }
            let range = shape.first as usize..(shape.first + shape.count) as usize;
            for triangle in &geometry.triangles[range] {
                let p = corners(geometry, triangle).map(|p| placement.by.transform_point3(p));
                finding.meet(p, None, &shape.site);
            }
        }
    }
    finding.neighbours
}

/// Lamps on the way to what they lie in.
struct Finding<'a> {
    lamps: &'a mut [Lamp],
    facets: &'a [Facet],
    tree: &'a [[DVec3; 2]],
    /// The largest step of a lamp.
    most: f64,
    /// Compared so far.
    pairs: u64,
    neighbours: BTreeSet<[usize; 2]>,
}

impl Finding<'_> {
    /// Whether something in a box may be near a lamp.
    fn is_near(&self, [low, high]: [DVec3; 2]) -> bool {
        let mut is_near = false;
        let around = [low - self.most, high + self.most];
        visit(self.facets, self.tree, around, &mut |_| is_near = true);
        is_near && self.pairs <= MOST_PAIRS
    }

    /// Notes the lamps that lie in a triangle, which belongs to the lamp `other` if to any.
    fn meet(&mut self, p: [DVec3; 3], other: Option<usize>, site: &Rc<Site>) {
        let around = [
            p[0].min(p[1]).min(p[2]) - self.most,
            p[0].max(p[1]).max(p[2]) + self.most,
        ];
        visit(self.facets, self.tree, around, &mut |facet| {
            self.pairs += 1;
            let lamp = &mut self.lamps[facet.lamp];
            let is_own = other == Some(facet.lamp);
            if self.pairs > MOST_PAIRS || is_own && !are_back_to_back(facet, p, lamp) {
                return;
            }
            let Some(plane) = shared_plane(facet, p, lamp) else {
                return;
            };
            note(plane, facet, lamp);
            // Of two of its own triangles, back to back, each shines from its side; the lamp
            // lies in nothing else.
            if is_own {
                return;
            }
            if let Some(other) = other {
                (self.neighbours).insert([facet.lamp.min(other), facet.lamp.max(other)]);
            }
            lamp.wall.get_or_insert_with(|| Rc::clone(site));
        });
    }
}

/// The plane of a facet that lies in the triangle `p`.
fn shared_plane(facet: &Facet, p: [DVec3; 3], lamp: &Lamp) -> Option<Plane> {
    let (own, wall) = (Plane::of(facet.p)?, Plane::of(p)?);
    let tolerance = 0.5 * lamp.step;
    let is_in = wall.holds(facet.p, tolerance) && overlap(facet.p, p, own.n, tolerance);
    is_in.then_some(own)
}

/// Has a lamp's facets in this plane moved: that is where a facet lies in something.
fn note(plane: Plane, facet: &Facet, lamp: &mut Lamp) {
    let tolerance = 0.5 * lamp.step;
    let is_same = |known: &Plane| known.n.dot(plane.n) > 0.999 && known.holds(facet.p, tolerance);
    if !lamp.planes.iter().any(is_same) && lamp.planes.len() < MOST_PLANES {
        lamp.planes.push(plane);
    }
}

/// Whether two triangles, seen along `n`, have more than their borders in common.
fn overlap(a: [DVec3; 3], b: [DVec3; 3], n: DVec3, tolerance: f64) -> bool {
    let (x, y) = n.any_orthonormal_pair();
    let flat = |p: DVec3| DVec2::new(x.dot(p - a[0]), y.dot(p - a[0]));
    let (a, b) = (a.map(flat), b.map(flat));
    let parted = |edges: [DVec2; 3]| {
        (0..3).any(|i| {
            let across = (edges[(i + 1) % 3] - edges[i]).perp().normalize_or_zero();
            let range = |t: [DVec2; 3]| {
                let [x, y, z] = t.map(|p| across.dot(p));
                [x.min(y).min(z), x.max(y).max(z)]
            };
            let ([a0, a1], [b0, b1]) = (range(a), range(b));
            a1.min(b1) - a0.max(b0) <= tolerance
        })
    };
    !parted(a) && !parted(b)
}

/// Turns the planes of a lamp that shines to both sides towards the camera.
fn turn(lamp: &mut Lamp, eye: DVec3) {
    if lamp.two_sided {
        for plane in &mut lamp.planes {
            if plane.n.dot(eye - plane.p) < 0.0 {
                plane.n = -plane.n;
            }
        }
    }
}

/// In how many steps' distance each lamp lies in front of what it lies in.
fn layers(lamps: &[Lamp], neighbours: &BTreeSet<[usize; 2]>) -> Vec<u32> {
    let mut order: Vec<usize> = (0..lamps.len()).collect();
    // Dim ones first; of equal ones the last in the file.
    order.sort_by(|&a, &b| {
        let [x, y] = [a, b].map(|i| lamps[i].brightness);
        x.total_cmp(&y).then(b.cmp(&a))
    });
    let mut near = vec![Vec::new(); lamps.len()];
    for &[a, b] in neighbours {
        near[a].push(b);
        near[b].push(a);
    }
    let mut layers = vec![0; lamps.len()];
    for i in order {
        let behind = near[i]
            .iter()
            .filter(|&&j| shine_alike(&lamps[i], &lamps[j]));
        let most = behind.map(|&j| layers[j]).max().unwrap_or(0);
        layers[i] = (most + 1).min(MOST_LAYERS);
    }
    layers
}

/// Whether some planes of two lamps are one.
fn shine_alike(a: &Lamp, b: &Lamp) -> bool {
    let tolerance = a.step.max(b.step);
    a.planes
        .iter()
        .any(|x| (b.planes.iter()).any(|y| x.n.dot(y.n) > 0.0 && x.holds([y.p; 3], tolerance)))
}

/// Moves what lies in the planes of a lamp by `distance`.
fn shift(geometry: &mut Geometry, lamp: &Lamp, distance: f64) {
    let shape = &geometry.shapes[lamp.shape];
    let range = shape.first as usize..(shape.first + shape.count) as usize;
    let tolerance = 0.5 * lamp.step;
    let mut moved = HashMap::new();
    for i in range {
        let p = corners(geometry, &geometry.triangles[i]);
        let Some(own) = Plane::of(p) else { continue };
        let is_of = |plane: &Plane| {
            let along = own.n.dot(plane.n);
            let is_parallel = along > 0.999 || lamp.two_sided && along < -0.999;
            is_parallel && plane.holds(p, tolerance)
        };
        let Some(at) = lamp.planes.iter().position(is_of) else {
            continue;
        };
        let offset = lamp.planes[at].n * distance;
        for corner in 0..3 {
            let old = geometry.triangles[i].v[corner];
            let new = *moved.entry((old, at)).or_insert_with(|| {
                let mut vertex = geometry.vertices[old as usize];
                vertex.p += offset;
                geometry.vertices.push(vertex);
                let new = geometry.vertices.len() - 1;
                geometry.set_tangent(new, geometry.tangent(old as usize));
                new as u32
            });
            geometry.triangles[i].v[corner] = new;
        }
    }
}

/// Whether another triangle `p` of the same lamp shines to the other side.
fn are_back_to_back(facet: &Facet, p: [DVec3; 3], lamp: &Lamp) -> bool {
    let turned = |own: Plane, other: Plane| own.n.dot(other.n) < 0.0;
    !lamp.two_sided
        && (Plane::of(facet.p).zip(Plane::of(p))).is_some_and(|(own, other)| turned(own, other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;
    use crate::scene::Scene;

    const WALL: &str = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
        \"point P\" [-1 -1 0 1 -1 0 1 1 0 -1 1 0]\n";

    fn lamp(options: &str, z: f64) -> String {
        format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" {options}\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
             \"point P\" [-.5 -.5 {z} .5 -.5 {z} .5 .5 {z} -.5 .5 {z}]\nAttributeEnd\n"
        )
    }

    fn load(shapes: &str) -> Scene {
        let text =
            format!("LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n{shapes}");
        load_str(&text, "test.pbrt", ".".as_ref()).unwrap()
    }

    /// Heights of the corners of all triangles of lights, in steps.
    fn heights(scene: &Scene) -> Vec<f64> {
        let lit = (scene.triangles.iter())
            .filter(|t| scene.shapes[t.shape as usize].light != NONE)
            .flat_map(|t| t.v);
        let height = |v: u32| f64::from(scene.vertices[v as usize].p[2]);
        let mut heights: Vec<f64> = lit.map(|v| (height(v) / STEP).round()).collect();
        heights.dedup();
        heights
    }

    #[test]
    fn lamps_are_moved_to_the_side_they_shine_to() {
        let scene = load(&(lamp("\"rgb L\" [1 1 1]", 0.0) + WALL));
        assert_eq!(heights(&scene), [1.0]);
        assert_eq!(scene.warnings.len(), 1);
        let warning = &scene.warnings[0];
        assert!(
            warning.starts_with("test.pbrt:5:") && warning.contains("test.pbrt:9"),
            "{warning}"
        );
        // To both sides: the camera's.
        let scene = load(&(lamp("\"rgb L\" [1 1 1] \"bool twosided\" \"true\"", 0.0) + WALL));
        assert_eq!(heights(&scene), [-1.0]);
        // A rounding off is in one place, a step and more is not.
        let scene = load(&(lamp("\"rgb L\" [1 1 1]", 0.1 * STEP) + WALL));
        assert_eq!(heights(&scene), [1.0]);
        let scene = load(&(lamp("\"rgb L\" [1 1 1]", 3.0 * STEP) + WALL));
        assert_eq!(scene.warnings, Vec::<String>::new());
    }

    #[test]
    fn the_brighter_lies_in_front() {
        let (dim, bright) = (
            lamp("\"rgb L\" [1 1 1]", 0.0),
            lamp("\"rgb L\" [2 2 2]", 0.0),
        );
        let one = load(&(dim.clone() + &bright + WALL));
        assert_eq!(heights(&one), [1.0, 2.0]);
        let other = load(&(WALL.to_string() + &bright + &dim));
        assert_eq!(heights(&other), [2.0, 1.0]);
    }

    #[test]
    fn what_only_touches_is_left_alone() {
        let beside = WALL.replace("-1 -1 0 1 -1 0 1 1 0 -1 1 0", ".5 -1 0 2 -1 0 2 1 0 .5 1 0");
        let scene = load(&(lamp("\"rgb L\" [1 1 1]", 0.0) + &beside));
        assert_eq!(heights(&scene), [0.0]);
        assert_eq!(scene.warnings, Vec::<String>::new());
    }

    #[test]
    fn a_triangle_is_a_light_once() {
        let twice =
            lamp("\"rgb L\" [1 1 1]", 0.0).replace("0 1 2 0 2 3", "0 1 2 0 2 3 1 2 0 0 2 1");
        let scene = load(&twice);
        // Back to back is not twice.
        assert_eq!(scene.lights.len(), 3);
        assert_eq!(heights(&scene), [1.0, -1.0]);
        assert!(
            scene.warnings[0].contains("1 triangles that lie on others"),
            "{:?}",
            scene.warnings
        );
    }

    #[test]
    fn lamps_lie_in_what_is_kept_once() {
        // A wall of 140 by 140 squares.
        let (mut p, mut indices) = (String::new(), String::new());
        for i in 0..141 * 141 {
            p += &format!("{} {} 0 ", i % 141, i / 141);
            if i % 141 < 140 && i < 140 * 141 {
                let (a, b) = (i, i + 141);
                indices += &format!("{a} {} {b} {b} {} {} ", a + 1, a + 1, b + 1);
            }
        }
        let wall = format!(
            "ObjectBegin \"wall\"\nShape \"trianglemesh\" \"integer indices\" [{indices}]\n\
             \"point P\" [{p}]\nObjectEnd\n"
        );
        let place = "AttributeBegin\nTranslate -1 -1 0\nScale .015 .015 1\n\
            ObjectInstance \"wall\"\nAttributeEnd\n";
        let far = place.replace("-1 0\n", "-1 1\n");
        let scene = load(&(lamp("\"rgb L\" [1 1 1]", 0.0) + &wall + place + &far));
        assert_eq!(scene.instances.placed.len(), 2);
        let z = heights(&scene);
        assert!(
            z.len() == 1 && scene.warnings.len() == 1,
            "{z:?} {:?}",
            scene.warnings
        );
        let text = &scene.warnings[0];
        assert!(text.contains("lies in the surface"), "{text}");
    }
}
