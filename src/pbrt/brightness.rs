//! Light close to the end of what `f32` holds: sums, and products with areas, must stay numbers.

use std::collections::HashMap;

use crate::scene::{LightKind, Rgb, Scene};

/// Light beyond this power of two is scaled down to it: products with areas and solid angles stay
/// numbers.
const BRIGHT: i32 = 104;

/// Scales all light down if some of it is so bright, and the picture up again, by a power of two.
pub(super) fn dim(scene: &mut Scene) {
    let brightest = brightest(scene);
    // Also where there is no light at all.
    if !(brightest.is_finite() && brightest > f64::from(BRIGHT).exp2()) {
        return;
    }
    let beyond = brightest.log2().floor() as i32 - BRIGHT;
    let factor = (-f64::from(beyond)).exp2() as f32;
    let dimmed = |l: &mut Rgb| *l = l.map(|c| c * factor);
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Triangle { l, .. }
            | LightKind::Sphere { l, .. }
            | LightKind::Distant { l, .. }
            | LightKind::InfiniteConstant { l } => dimmed(l),
            LightKind::Point { i, .. } | LightKind::Spot { i, .. } => dimmed(i),
            LightKind::Goniometric { scale, .. }
            | LightKind::Projection { scale, .. }
            | LightKind::InfiniteImage { scale, .. } => dimmed(scale),
            LightKind::ImageTriangle { scale, .. } | LightKind::ImageSphere { scale, .. } => {
                *scale *= factor;
            }
        }
    }
    scene.film.scale = (scene.film.scale / factor).min(f32::MAX);
    scene.film.clamp = scene.film.clamp.map(|clamp| clamp.scaled(factor));
}

/// The largest radiance or intensity of any light.
fn brightest(scene: &Scene) -> f64 {
    let most = |l: &Rgb| l.iter().fold(0.0, |most, c| f64::from(*c).max(most));
    let mut known = HashMap::new();
    let mut texel = |image: u32| {
        *known.entry(image).or_insert_with(|| {
            let texels = scene.images[image as usize].texels.iter();
            texels.fold(0.0, |so_far, t| most(t).max(so_far))
        })
    };
    let mut of = |kind: &LightKind| match kind {
        LightKind::Triangle { l, .. }
        | LightKind::Sphere { l, .. }
        | LightKind::Distant { l, .. }
        | LightKind::InfiniteConstant { l } => most(l),
        LightKind::Point { i, .. } | LightKind::Spot { i, .. } => most(i),
        LightKind::Goniometric { scale, image, .. }
        | LightKind::Projection { scale, image, .. }
        | LightKind::InfiniteImage { scale, image, .. } => most(scale) * texel(*image),
        LightKind::ImageTriangle { scale, image, .. }
        | LightKind::ImageSphere { scale, image, .. } => f64::from(*scale) * texel(*image),
    };
    (scene.lights.iter()).fold(0.0, |so_far, light| of(&light.kind).max(so_far))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;

    #[test]
    fn light_near_the_end_of_floats_is_scaled() {
        let load = |l: &str| {
            let text = format!(
                "WorldBegin\nLightSource \"infinite\" \"rgb L\" [{l} 1 0]\nShape \"sphere\"\n"
            );
            let scene = load_str(&text, "test.pbrt", ".".as_ref()).unwrap();
            let LightKind::InfiniteConstant { l } = scene.lights[0].kind else {
                panic!("{:?}", scene.lights)
            };
            (l, scene.film.scale)
        };
        assert_eq!(load("1e12"), ([1e12, 1.0, 0.0], 1.0));
        let (l, scale) = load("3e38");
        assert_eq!([l[0] * scale, l[1] * scale, l[2] * scale], [3e38, 1.0, 0.0]);
        assert!(l[0] < 2f32.powi(105) && l[0] >= 2f32.powi(104));
    }
}
