//! Objects and the places where they are seen, until it is known which of them are copied there.
//!
//! A copy is traced faster than an instance: it is a part of the one tree over everything, while
//! every instance takes a step of its own. It takes more memory, and more time to sort. So
//!
//! 1. what is seen once is copied;
//! 2. objects whose copies have at most [`SOME`] primitives together are copied, as long as all
//!    such copies have no more than [`MANY`];
//! 3. everything else is kept once, but for places that squash it: they have no way back.
//!
//! Copies come where the file has them, so that only what is kept changes the order of primitives.

use std::rc::Rc;

use glam::{DAffine3, DVec3};

use super::budget::{Budget, Charge};
use super::error::{Pos, Report, SceneError, Site};
use super::geometry::{Geometry, MAX_PRIMITIVES, WorldShape, is_placeable, too_many};
use super::transform::inverse;
use crate::scene::{self, Space};

/// Copies of an object: with a tenth of it they were traced a fifth to two fifths faster than
/// instances and were built in a twentieth of a second, with ten times it they were slower (fields
/// of `benches/instances.py`, with and without `--copies`).
const SOME: usize = 1 << 15;
/// All copies that are made for speed alone.
const MANY: usize = 1 << 17;
/// Copies of more bytes are worth a word.
const NOTABLE_BYTES: usize = 256 << 20;
/// Ratio of the longest to the shortest way that a place stretches an object; beyond it there is no
/// way back.
const MOST_STRETCH: f64 = 1e6;

/// An object in a place, in world space.
#[derive(Debug)]
pub(super) struct Placement {
    /// Index into the list of objects.
    pub object: u32,
    pub by: DAffine3,
    /// How many shapes of the scene come before it.
    shapes: u32,
    pos: Pos,
}

/// All objects of a scene that are seen, and where.
#[derive(Debug)]
pub(super) struct Placements {
    objects: Vec<Rc<Geometry>>,
    placed: Vec<Placement>,
    room: Charge,
}

/// An object that is kept once.
#[derive(Debug)]
pub(super) struct Kept {
    pub geometry: Rc<Geometry>,
    /// Where it is in its own coordinates, `[min, max]`.
    pub bounds: [DVec3; 2],
}

/// Objects that are kept once, and where they are seen.
#[derive(Debug, Default)]
pub(super) struct Instances {
    pub objects: Vec<Kept>,
    pub placed: Vec<Placement>,
}

impl Placements {
    pub fn new(budget: &Rc<Budget>) -> Self {
        Self {
            objects: Vec::new(),
            placed: Vec::new(),
            room: Charge::none(budget),
        }
    }

    /// An object that can be placed from here on: its number.
    pub fn add_object(&mut self, geometry: Geometry) -> u32 {
        self.objects.push(Rc::new(geometry));
        self.objects.len() as u32 - 1
    }

    /// Places an object after the shapes that the scene has so far.
    pub fn place(
        &mut self,
        site: &Site,
        object: u32,
        by: &DAffine3,
        shapes: usize,
    ) -> Result<(), SceneError> {
        if self.placed.len() >= MAX_PRIMITIVES {
            return Err(site.error(format_args!("more than {MAX_PRIMITIVES} instances")));
        }
        let room = self.room.grow(&self.placed, 1);
        let table = size_of::<scene::Instance>() as u64;
        let room = room.and_then(|()| self.room.add(table));
        room.map_err(|e| site.error(e))?;
        self.placed.push(Placement {
            object,
            by: *by,
            shapes: shapes as u32,
            pos: site.pos.clone(),
        });
        Ok(())
    }

    /// Which objects are kept once.
    fn kept(&self) -> Vec<bool> {
        let mut uses = vec![0usize; self.objects.len()];
        for placement in &self.placed {
            uses[placement.object as usize] += 1;
        }
        let mut copied = 0;
        (uses.iter().zip(&self.objects))
            .map(|(&uses, object)| {
                let primitives = object.primitives();
                let all = uses.saturating_mul(primitives);
                if uses < 2 || primitives == 0 {
                    return false;
                }
                if all <= SOME && copied + all <= MANY {
                    copied += all;
                    return false;
                }
                true
            })
            .collect()
    }

    /// Copies what is to be copied, and returns the rest.
    ///
    /// # Errors
    /// There is no room for the copies, or they are moved beyond all numbers.
    pub fn settle(
        mut self,
        geometry: &mut Geometry,
        report: &mut Report,
    ) -> Result<Instances, SceneError> {
        let kept = self.kept();
        let stays = |p: &Placement| kept[p.object as usize] && has_way_back(&p.by);
        if !self.placed.iter().all(stays) {
            let copies = self.placed.iter().filter(|p| !stays(p));
            copy(copies, &self.objects, geometry, report)?;
            self.placed.retain(stays);
        }
        self.placed.shrink_to_fit();
        let mut numbers = vec![None; self.objects.len()];
        let mut instances = Instances::default();
        for placement in &mut self.placed {
            let object = &self.objects[placement.object as usize];
            let number = numbers[placement.object as usize].get_or_insert_with(|| {
                instances.objects.push(Kept {
                    geometry: Rc::clone(object),
                    bounds: object.bounds(),
                });
                instances.objects.len() as u32 - 1
            });
            placement.object = *number;
            let [low, high] = placement.around(&instances.objects[*number as usize]);
            if !is_placeable(low) || !is_placeable(high) {
                return Err(placement.site().error(BEYOND));
            }
        }
        let all = instances.objects.iter().map(|o| o.geometry.primitives());
        if let Some(placement) = self.placed.first()
            && all.sum::<usize>() + geometry.primitives() > MAX_PRIMITIVES
        {
            return Err(placement.site().error(too_many()));
        }
        instances.placed = self.placed;
        Ok(instances)
    }
}

/// What is wrong with a place that is too far away.
pub(super) const BEYOND: &str = "the current transform moves the object beyond all numbers";

impl Instances {
    /// Of all objects.
    pub fn shapes(&self) -> impl Iterator<Item = &WorldShape> {
        self.objects.iter().flat_map(|o| &o.geometry.shapes)
    }

    /// Triangles, spheres and shapes, those of `own` included.
    pub fn sizes(&self, own: &Geometry) -> [usize; 3] {
        let all = self.objects.iter().map(|o| &*o.geometry);
        all.chain([own])
            .fold([0; 3], |[triangles, spheres, shapes], g| {
                [
                    triangles + g.triangles.len(),
                    spheres + g.spheres.len(),
                    shapes + g.shapes.len(),
                ]
            })
    }
}

impl Kept {
    /// The space in which its tables are.
    pub fn space(&self) -> Space {
        let [low, high] = self.bounds;
        let half = (high / 2.0 - low / 2.0).length();
        let exponent = if half > 0.0 { -half.log2().ceil() } else { 0.0 };
        Space {
            centre: low / 2.0 + high / 2.0,
            scale: exponent.clamp(-1000.0, 1000.0).exp2(),
        }
    }
}

impl Placement {
    fn site(&self) -> Site {
        Site::new(self.pos.clone(), "ObjectInstance")
    }

    /// A box around the object in its place, `[min, max]`.
    pub fn around(&self, object: &Kept) -> [DVec3; 2] {
        let [low, high] = object.bounds;
        let middle = self.by.transform_point3(low / 2.0 + high / 2.0);
        let half = high / 2.0 - low / 2.0;
        let m = self.by.matrix3;
        let reach = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        [middle - reach, middle + reach]
    }

    /// How much larger than in the object things are, on average.
    pub fn scale(&self) -> f64 {
        self.by.matrix3.determinant().abs().cbrt()
    }
}

fn has_way_back(by: &DAffine3) -> bool {
    let Some(back) = inverse(by) else {
        return false;
    };
    let size = |t: &DAffine3| {
        let columns = t.matrix3.to_cols_array();
        columns.iter().fold(0.0, |most, x| x.abs().max(most))
    };
    size(by) * size(&back) <= MOST_STRETCH
}

/// Copies objects to their places, between the shapes that come before and after them.
fn copy<'a>(
    copies: impl Iterator<Item = &'a Placement>,
    objects: &[Rc<Geometry>],
    geometry: &mut Geometry,
    report: &mut Report,
) -> Result<(), SceneError> {
    let before = geometry.take_primitives();
    let (mut next, mut bytes, mut last) = (0, 0, None);
    for placement in copies {
        let end = placement.shapes as usize;
        geometry.put_back(&before, next..end);
        next = end;
        let object = &objects[placement.object as usize];
        let site = placement.site();
        geometry.add_instance(&site, object, &placement.by)?;
        bytes += object.bytes();
        last = Some(site);
    }
    geometry.put_back(&before, next..before.shapes.len());
    if let Some(site) = last.filter(|_| bytes > NOTABLE_BYTES) {
        let megabytes = bytes >> 20;
        let what = format_args!("copies of objects up to here take {megabytes} MB");
        report.warn_at(&site, what);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;
    use crate::scene::Scene;

    fn load(world: &str) -> Scene {
        let text = format!(
            "LookAt 0 0 9  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\n\
             LightSource \"infinite\"\n{world}"
        );
        load_str(&text, "test.pbrt", ".".as_ref()).unwrap_or_else(|e| panic!("{e}"))
    }

    /// Of `2 n n` triangles, and a sphere.
    fn sheet(n: usize) -> String {
        let (mut p, mut indices) = (String::new(), String::new());
        for j in 0..=n {
            for i in 0..=n {
                p += &format!("{i} {j} {} ", (i * j) % 3);
                if i < n && j < n {
                    let (a, b) = (j * (n + 1) + i, (j + 1) * (n + 1) + i);
                    indices += &format!("{a} {} {b} {b} {} {} ", a + 1, a + 1, b + 1);
                }
            }
        }
        format!(
            "Shape \"trianglemesh\" \"point P\" [{p}] \"integer indices\" [{indices}]\nShape \"sphere\"\n"
        )
    }

    fn object(n: usize) -> String {
        format!("ObjectBegin \"o\"\n{}ObjectEnd\n", sheet(n))
    }

    const PLACE: &str = "Translate 0 9 1\nObjectInstance \"o\"\n";

    #[test]
    fn what_is_large_and_seen_again_is_kept_once() {
        let once = load(&(object(140) + PLACE));
        assert!(once.instances.is_empty());
        assert_eq!(once.triangles.len(), 39_200);
        let twice = load(&(object(140) + PLACE + PLACE));
        assert_eq!(twice.instances.placed.len(), 2);
        assert_eq!(twice.triangles.len(), 39_200);
        assert_eq!((twice.own_triangles(), twice.own_spheres()), (0..0, 0..0));
        let small = load(&(object(3) + &PLACE.repeat(10)));
        assert!(small.instances.is_empty());
        assert_eq!((small.triangles.len(), small.spheres.len()), (180, 10));
        // Where it is squashed it is copied: the sphere has no volume there.
        let flat = object(140).replace("Shape \"sphere\"", "") + PLACE + PLACE;
        let flat = load(&(flat + "Scale 1 1 0\nObjectInstance \"o\"\n"));
        assert_eq!(flat.instances.placed.len(), 2);
        assert_eq!(flat.own_triangles(), 0..39_200);
    }

    #[test]
    fn a_place_far_away_is_refused() {
        let text = "WorldBegin\n".to_owned() + &object(140) + PLACE + "Scale 1e99 1 1\n" + PLACE;
        let error = load_str(&text, "test.pbrt", ".".as_ref()).unwrap_err();
        assert!(error.to_string().contains(BEYOND), "{error}");
    }

    #[test]
    fn copies_come_where_the_file_has_them() {
        let ball = "Shape \"sphere\" \"float radius\" 2\n";
        let as_object = object(4) + ball + PLACE + ball;
        let in_place = ball.to_owned() + "Translate 0 9 1\n" + &sheet(4) + ball;
        let [a, b] = [as_object, in_place].map(|world| load(&world));
        assert_eq!(a.spheres, b.spheres);
        assert_eq!(a.shapes, b.shapes);
        let corners = |scene: &Scene| {
            let all = scene.triangles.iter().flat_map(|t| t.v);
            all.map(|v| scene.vertices[v as usize]).collect::<Vec<_>>()
        };
        assert_eq!(corners(&a), corners(&b));
    }
}
