//! Lights as kernels read them. Both tables are written by
//! [`LightTable::new`](super::LightTable::new).

use crate::simd::record::record;

record! {
    /// A light: what all kinds have, and what area lights have.
    pub(super) struct Base / BaseLanes {
        /// Probability of its choice.
        choice: f32,
        /// Radiance, intensity of a point, or what an image's values are multiplied by: linear
        /// sRGB.
        colour: [f32; 3],
        /// Of an area light, its sides: 0 for one and 1 for two; -1 and 2 if no ray meets the
        /// light. Of a spotlight, its falloff: above 0 if it is smooth, as in pbrt-v4.
        sides_or_falloff: f32,
        /// Triangle or sphere of an area light.
        primitive: u32,
        /// Index into the environments, projectors or pictures, by kind.
        image: u32,
        /// One over the area of a triangle.
        inv_area: f32,
    }
}

record! {
    /// Where a light without area is, in internal space.
    pub(super) struct Place / PlaceLanes {
        /// Position; of a distant light the direction that its light goes, a unit vector.
        p: [f32; 3],
        /// Of a spotlight: its axis, a unit vector.
        axis: [f32; 3],
        /// One minus the cosine between the axis and the border of the cone.
        versine_total: f32,
        /// The same of its part of full intensity.
        versine_full: f32,
    }
}
