//! Primitives that lie in one place. Clustering them takes a time that grows with the square of
//! their number.
//!
//! Clustering merges boxes that are each other's best neighbours, again and again. Of equal or
//! nested boxes, and of rows in which every box is larger than the one before, only one pair a
//! round is.

use std::collections::HashSet;

use super::node::{Bounds, union};
use crate::scene::Scene;

/// Boxes looked at by clustering, per primitive, beyond which it is not worth its while. Of usual
/// scenes it looks at three.
const MOST_WORK: u64 = 64;

/// Whether clustering would take too long: goes through its rounds with nearest neighbours alone.
pub fn is_crowded(boxes: &[Bounds]) -> bool {
    let mut row = along_curve(boxes);
    let most = MOST_WORK * boxes.len() as u64;
    let mut work = 0;
    while row.len() > 1 {
        work += row.len() as u64;
        if work > most {
            return true;
        }
        merge_neighbours(&mut row);
    }
    false
}

/// One round: boxes whose union is smaller than those with their other neighbours become one.
fn merge_neighbours(row: &mut Vec<Bounds>) {
    let cost = |row: &[Bounds], i: usize| {
        row.get(i..i + 2)
            .map_or(f32::INFINITY, |two| half_area(&union(two[0], two[1])))
    };
    let mut before = f32::INFINITY;
    let mut here = cost(row, 0);
    let (mut from, mut to) = (0, 0);
    while from < row.len() {
        let after = cost(row, from + 1);
        // As in obvhs, the later of equal neighbours is the better.
        let is_pair = from + 1 < row.len() && here <= before && here < after;
        if is_pair {
            row[to] = union(row[from], row[from + 1]);
            before = after;
            here = cost(row, from + 2);
            from += 2;
        } else {
            row[to] = row[from];
            (before, here) = (here, after);
            from += 1;
        }
        to += 1;
    }
    row.truncate(to);
}

/// The boxes in the order of their centres on a space-filling curve.
fn along_curve(boxes: &[Bounds]) -> Vec<Bounds> {
    let all = boxes.iter().copied().reduce(union).unwrap_or_default();
    let code = |b: &Bounds| {
        (0..3).fold(0, |code, k| {
            let centre = 0.5 * b[k][0] + 0.5 * b[k][1];
            let size = (all[k][1] - all[k][0]).max(f32::MIN_POSITIVE);
            // NaN and what is beyond the range become its ends.
            let place = ((centre - all[k][0]) / size * 2_097_151.0) as u64;
            code | spread(place.min(2_097_151)) << k
        })
    };
    let mut order: Vec<(u64, u32)> = (boxes.iter().zip(0..)).map(|(b, i)| (code(b), i)).collect();
    order.sort_unstable();
    order.iter().map(|&(_, i)| boxes[i as usize]).collect()
}

/// The 21 lowest bits, two zeros between each.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

/// Finds primitives that lie where an earlier one lies. No ray ever finds them: of equal distances
/// the first counts.
#[derive(Default)]
pub struct Equals {
    triangles: HashSet<[[u32; 3]; 3]>,
    spheres: HashSet<[[u32; 4]; 3]>,
}

impl Equals {
    /// Whether none of the triangles so far has the same corners.
    pub fn is_first_triangle(&mut self, scene: &Scene, triangle: u32) -> bool {
        let place = |v: u32| scene.vertices[v as usize].p.map(bits);
        let mut corners = scene.triangles[triangle as usize].v.map(place);
        corners.sort_unstable();
        self.triangles.insert(corners)
    }

    /// Whether none of the spheres so far is the same.
    pub fn is_first_sphere(&mut self, scene: &Scene, sphere: u32) -> bool {
        let map = scene.spheres[sphere as usize].to_world;
        self.spheres.insert(map.map(|row| row.map(bits)))
    }
}

/// Zeros of both signs are one number.
fn bits(x: f32) -> u32 {
    (x + 0.0).to_bits()
}

pub fn half_area(b: &Bounds) -> f32 {
    let [x, y, z] = b.map(|[min, max]| max - min);
    x * y + y * z + z * x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(centre: [f32; 3], size: f32) -> Bounds {
        centre.map(|c| [c - size, c + size])
    }

    #[test]
    fn equal_nested_and_growing_boxes_are_crowded() {
        let n = 3000;
        let row = |f: &dyn Fn(f32) -> Bounds| (0..n).map(|i| f(i as f32)).collect::<Vec<_>>();
        assert!(is_crowded(&row(&|_| cube([1.0, 2.0, 3.0], 0.5))));
        assert!(is_crowded(&row(&|i| cube([0.0; 3], 1.0 + i))));
        assert!(is_crowded(&row(&|i| [
            [0.0, i + 1.0],
            [0.0, i + 1.0],
            [0.0, 1.0]
        ])));
    }

    #[test]
    fn meshes_and_soups_are_not() {
        let grid: Vec<Bounds> = (0..10_000)
            .map(|i| cube([(i % 100) as f32, (i / 100) as f32, 0.0], 0.5))
            .collect();
        assert!(!is_crowded(&grid));
        let mut state = 1u64;
        let mut unit = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f32 / 16_777_216.0
        };
        let soup: Vec<Bounds> = (0..10_000)
            .map(|_| cube([unit(), unit(), unit()], 0.1 * unit()))
            .collect();
        assert!(!is_crowded(&soup));
        for n in 0..4 {
            assert!(!is_crowded(&grid[..n]));
        }
    }
}
