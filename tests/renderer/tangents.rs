//! Tangents of vertices (pbrt's `S`): they take the place of dp/du in the shading frame.

use crate::support;

use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, Scene};
use std::path::Path;
use support::{run, settings};

/// A square seen from above under a small sun, of `material`, with texture coordinates `uv` of its
/// corners and further parameters of the mesh.
fn square(v4: bool, material: &str, uv: &str, more: &str) -> Scene {
    let (film, end) = if v4 {
        ("rgb", "")
    } else {
        ("image", "WorldEnd")
    };
    let (point, pair) = if v4 {
        ("point3", "point2")
    } else {
        ("point", "float")
    };
    let text = format!(
        "LookAt 0 0 4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]\n\
         Film \"{film}\" \"integer xresolution\" [12] \"integer yresolution\" [12]\n\
         Integrator \"path\" \"integer maxdepth\" [1]\nPixelFilter \"box\"\nWorldBegin\n\
         LightSource \"distant\" \"{point} from\" [1 .2 2] \"{point} to\" [0 0 0]\n{material}\n\
         Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
         \"{point} P\" [-2 -2 0  2 -2 0  2 2 0  -2 2 0] \"{pair} uv\" [{uv}] {more}\n{end}\n"
    );
    load_str(&text, "test.pbrt", Path::new(".")).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// The largest difference of two pictures over the largest value.
fn difference(a: &Scene, b: &Scene) -> f32 {
    let pixels = |scene: &Scene| run(scene, &settings(scene, IntegratorKind::Pt, 16)).pixels;
    let (a, b) = (pixels(a), pixels(b));
    let largest = a.iter().flatten().fold(0f32, |x, y| x.max(*y));
    assert!(largest > 0.0);
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.fold(0f32, |d, (a, b)| d.max((a - b).abs())) / largest
}

const ALONG_X: &str = "0 0  1 0  1 1  0 1";
const ALONG_Y: &str = "0 0  0 -1  1 -1  1 0";

/// Four times the tangent along y, a little off the plane, which does not count.
fn given(v4: bool) -> String {
    let vector = if v4 { "vector3" } else { "vector" };
    format!("\"{vector} S\" [0 4 .5  0 4 .5  0 4 .5  0 4 .5]")
}

/// A brushed metal with tangents along y is one whose texture coordinates run along y.
#[test]
fn highlights_lie_along_given_tangents() {
    for (v4, material) in [(false, "metal"), (true, "conductor")] {
        let brushed = "\"float uroughness\" .1 \"float vroughness\" .6";
        let material = &format!("Material \"{material}\" {brushed}");
        let turned = square(v4, material, ALONG_Y, "");
        let plain = square(v4, material, ALONG_X, "");
        let tangents = square(v4, material, ALONG_X, &given(v4));
        assert!(difference(&turned, &tangents) < 1e-4);
        assert!(difference(&plain, &tangents) > 0.1);
    }
}
