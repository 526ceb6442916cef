//! The order in which a wave is traced: rays that agree in the signs and the main axis of their
//! direction go together, so that a packet of them can take the tracer's fast path. One counting
//! sort, stable; results do not depend on it.

use super::records::Ray;

/// Signs of the direction by main axis.
const BUCKETS: usize = 24;

/// Memory of the sort.
#[derive(Default)]
pub(super) struct Sorter {
    keys: Vec<u8>,
    sorted: Vec<u32>,
}

impl Sorter {
    /// Sorts `list`, indices into `rays`.
    pub fn sort(&mut self, rays: &[Ray], list: &[u32]) {
        let mut start = [0u32; BUCKETS];
        self.keys.clear();
        for &path in list {
            let key = bucket(&rays[path as usize]);
            start[key as usize] += 1;
            self.keys.push(key);
        }
        let mut next = 0;
        for slot in &mut start {
            let count = *slot;
            *slot = next;
            next += count;
        }
        self.sorted.resize(list.len(), 0);
        for (&path, &key) in list.iter().zip(&self.keys) {
            let at = &mut start[key as usize];
            self.sorted[*at as usize] = path;
            *at += 1;
        }
    }

    /// The latest list in order.
    pub fn sorted(&self) -> &[u32] {
        &self.sorted
    }
}

#[inline(always)]
fn bucket(ray: &Ray) -> u8 {
    let [x, y, z] = ray.direction;
    let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
    let axis = if ax > ay && ax > az {
        0
    } else if ay > az {
        1
    } else {
        2
    };
    let sign = |v: f32, bit: u32| ((v.to_bits() >> 31) << bit) as u8;
    axis * 8 + (sign(x, 0) | sign(y, 1) | sign(z, 2))
}
