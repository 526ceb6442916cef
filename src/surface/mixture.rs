//! Several BSDFs in one place: `f = sum w_i f_i`, with a weight per colour channel.
//!
//! At each vertex one more primary sample chooses a component `i`, with probability `P_i`; the path
//! goes on as if the surface had that BSDF alone, times `w_i / P_i`. No kernel has to know about
//! mixtures, delta and other components mix freely, and every component is sampled as well as it is
//! by itself. Why this is right under any mixture of strategies:
//!
//! The measurement contribution of a path `x_1 .. x_k` is a product of sums over components, one at
//! each vertex that scatters. Multiplied out it is a sum over sequences of *labels* `l_1 .. l_k`,
//! so that the picture is an integral over labelled paths, of `F(x, l)`, the product of
//! `w_{l_j} f_{l_j}`. Whatever the strategy, each of those vertices gets its label with the same
//! probability `P_{l_j}`, since that depends on the place alone, never on a direction (a vertex
//! that is hit by chance on a light ends the path: it does not scatter, and has no label). The
//! density of a labelled path under strategy `s` is therefore `p_s(x | l) prod P_{l_j}`, where
//! `p_s(x | l)` is that of a scene whose surfaces are what the labels say. The product is common to
//! all strategies: it cancels from the MIS weights, which so are those of that scene, and leaves
//! `F / prod P_{l_j}`. This is also what tells that only strategies that would have to connect a
//! vertex labelled with a delta have density 0.
//!
//! Metropolis sampling sees one more dimension a vertex, with a step function in it.

use crate::scene::{MAX_COMPONENTS, Material, MaterialKind, Param, Rgb, Weight};

/// The component that is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// Index of its material; it is no mixture.
    pub material: u32,
    /// `w / P`, what its BSDF is multiplied by; the product over all levels of nested mixtures. 0
    /// where all weights are.
    pub share: [f32; 3],
}

/// Chooses at a place where `at` gives the values of parameters, by a primary sample in [0, 1),
/// which mixtures within mixtures use again: where it lies in the interval that chose it. Weights
/// count as at most `brightest`.
pub fn choose(
    materials: &[Material],
    mut material: u32,
    at: &dyn Fn(Param) -> Rgb,
    brightest: f32,
    u: f32,
) -> Chosen {
    let mut u = f64::from(u);
    let mut share = [1.0f64; 3];
    while let MaterialKind::Mixture { components } = &materials[material as usize].kind {
        let mut weights = [[0.0; 3]; MAX_COMPONENTS];
        // In f64, where the mean of three equal numbers is that number, and the shares of grey
        // weights of 1 are 1.
        let mut importance = [0.0f64; MAX_COMPONENTS];
        for (i, component) in components.iter().enumerate().take(MAX_COMPONENTS) {
            weights[i] = weight(component.weight, at, brightest);
            let albedo: f64 = (component.albedo.iter())
                .map(|p| mean(at(*p).map(unit)))
                .sum();
            let albedo = if component.albedo.is_empty() {
                1.0
            } else {
                albedo
            };
            importance[i] = mean(weights[i]) * albedo;
        }
        let total: f64 = importance.iter().sum();
        let (chosen, start) = interval(&importance, u * total);
        let Some(component) = components.get(chosen) else {
            share = [0.0; 3];
            break;
        };
        material = component.material;
        if total > 0.0 {
            let p = importance[chosen] / total;
            share = std::array::from_fn(|c| share[c] * (weights[chosen][c] / p));
            u = ((u * total - start) / importance[chosen]).clamp(0.0, 1.0);
        } else {
            share = [0.0; 3];
        }
    }
    Chosen {
        material,
        share: share.map(|s| s as f32),
    }
}

/// The interval that `x` lies in, of lengths in a row, and where it starts. Never an empty one,
/// unless all are.
fn interval(lengths: &[f64], x: f64) -> (usize, f64) {
    let (mut found, mut end) = (None, 0.0);
    for (i, length) in lengths.iter().enumerate() {
        if *length > 0.0 && (x >= end || found.is_none()) {
            found = Some((i, end));
        }
        end += length;
    }
    found.unwrap_or((0, 0.0))
}

fn weight(weight: Weight, at: &dyn Fn(Param) -> Rgb, brightest: f32) -> [f64; 3] {
    match weight {
        Weight::Amount(amount) => at(amount).map(|w| match w > 1.0 {
            true => f64::from(w.min(brightest)),
            false => unit(w),
        }),
        Weight::Rest(amount) => at(amount).map(|w| 1.0 - unit(w)),
    }
}

/// In [0, 1]; what is not a number counts as 0.
fn unit(x: f32) -> f64 {
    if x > 0.0 { f64::from(x.min(1.0)) } else { 0.0 }
}

fn mean(rgb: [f64; 3]) -> f64 {
    (rgb[0] + rgb[1] + rgb[2]) / 3.0
}
