//! The half of all chains that a film sums once more, to know its own error.

/// How the half of all chains is summed for a layer.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Half {
    /// About what the layer's sums will be multiplied by in the picture, in any unit.
    pub scale: f64,
    /// Part of the layer's chains that the half has.
    pub part: f64,
}

impl Half {
    /// With `f` the part of the half, `A` its sum and `T` that of all, `A / sqrt(f (1 - f)) - T
    /// sqrt(f / (1 - f))` has mean 0 and the variance of `T`, if chains are alike. These are
    /// the factors of `A` (halved, so that it is about 1) and of `T`.
    pub(super) fn factors(&self) -> [f64; 2] {
        let (f, g) = (self.part, 1.0 - self.part);
        if f > 0.0 && g > 0.0 {
            [0.5 / (f * g).sqrt(), (f / g).sqrt()]
        } else {
            [0.0, 0.0]
        }
    }
}
