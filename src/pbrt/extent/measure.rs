//! Sizes, boxes and distances of primitives.

use glam::{DAffine3, DMat3, DVec3};

use super::super::geometry::Geometry;

/// The camera's place and those of some lights.
pub(in crate::pbrt) struct Eyes(pub Vec<DVec3>);

/// Part of the primitives that may be smaller than what counts as small: slivers of a mesh say
/// nothing about its scale.
pub(super) const SLIVERS: f64 = 0.01;

/// Numbers of things by size, a quarter of a factor of two each.
pub(super) struct Sizes {
    buckets: Vec<u64>,
    pub(super) count: u64,
}

impl Sizes {
    pub(super) fn new() -> Self {
        Self {
            buckets: vec![0; 1 << 13],
            count: 0,
        }
    }

    pub(super) fn add(&mut self, size: f64) {
        self.add_many(size, 1);
    }

    pub(super) fn add_many(&mut self, size: f64, count: u64) {
        // Exponent and the first two digits.
        self.buckets[(size.abs().to_bits() >> 50) as usize] += count;
        self.count += count;
    }

    /// Adds the primitives of an instance that makes them so much larger.
    pub(super) fn add_instance(&mut self, detail: &Detail, scale: f64) {
        let small = detail.count / 50;
        self.add_many(detail.small * scale, small);
        self.add_many(detail.usual * scale, detail.count - small);
    }

    /// The size that at most `part` of the things fall short of.
    pub(super) fn quantile(&self, part: f64) -> f64 {
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

/// How large the primitives of an object are.
#[derive(Clone, Copy)]
pub(super) struct Detail {
    /// All but slivers are larger.
    small: f64,
    /// Half are larger.
    pub(super) usual: f64,
    pub(super) count: u64,
}

impl Detail {
    pub(super) fn of(all: impl Iterator<Item = f64>) -> Self {
        let mut sizes = Sizes::new();
        all.for_each(|size| sizes.add(size));
        Self {
            small: sizes.quantile(SLIVERS),
            usual: sizes.quantile(0.5),
            count: sizes.count,
        }
    }
}

/// A box around something.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl Bounds {
    pub(super) const NONE: Self = Self {
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
    };

    pub(super) fn of(points: [DVec3; 3]) -> Self {
        let [a, b, c] = points;
        Self {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
        }
    }

    pub(super) fn with(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    pub(super) fn size(&self) -> f64 {
        (self.high - self.low).max_element()
    }

    pub(super) fn distance(&self, p: DVec3) -> f64 {
        (self.low - p).max(p - self.high).max(DVec3::ZERO).length()
    }
}

/// A lower bound of the distance of `p` to a triangle.
pub(super) fn triangle_distance(p: DVec3, corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a).normalize_or_zero();
    n.dot(p - a).abs().max(Bounds::of(corners).distance(p))
}

/// Roughly the distance of `p` to the image of the unit sphere; less rather than more.
pub(super) fn sphere_distance(p: DVec3, to_unit: &DAffine3) -> f64 {
    let least = 1.0 / axes(&to_unit.matrix3).max_element();
    (to_unit.transform_point3(p).length() - 1.0).abs() * least
}

/// Half the size of the bounding box of the unit sphere's image.
pub(super) fn axes(m: &DMat3) -> DVec3 {
    let row_length = |i: usize| DVec3::new(m.x_axis[i], m.y_axis[i], m.z_axis[i]).length();
    DVec3::new(row_length(0), row_length(1), row_length(2))
}

/// Corners of a triangle, in the space of the file.
pub(super) fn corners(geometry: &Geometry, v: [u32; 3]) -> [DVec3; 3] {
    v.map(|i| geometry.vertices[i as usize].p)
}
