//! Vertex normals of any length and direction (row 37); `bsdf` has what they do to light.

use crate::support::{head, scene};
use phalanx::simd::{Lanes, Vec3, f32x8};
use phalanx::transport::World;

/// Shading normals at the centroid of the first triangle, both widths.
fn normal_at_centroid(text: &str) -> [f64; 3] {
    let view = "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\"";
    let scene = scene(&(head(1, 1, 1, view) + text));
    let world = World::new(&scene, 1);
    fn at<L: Lanes>(world: &World) -> [f32; 3] {
        let third = L::splat(1.0 / 3.0);
        let any = Vec3::splat([0.0, 0.0, 1.0]);
        let b = [L::one(), third, third];
        let point = (world.geometry).surface_point((&[0], &[u32::MAX]), any, any, b, world.wanted);
        point.ns.lane(0)
    }
    let n = at::<f32>(&world);
    assert_eq!(n, at::<f32x8>(&world));
    n.map(f64::from)
}

/// Row 37: normals are interpolated as they come, after the transform, and normalised after that;
/// whatever their common length.
#[test]
fn normals_of_any_length() {
    let given = [[0.0, 0.0, 10.0f64], [0.866, 0.1, 0.5], [0.3, -0.2, 0.05]];
    let mesh = |scale: f64| {
        let n: Vec<String> = (given.iter().flatten())
            .map(|x| format!("{:e}", x * scale))
            .collect();
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1 -1 0 1 -1 0 0 1 0] \"normal N\" [{}]\n",
            n.join(" ")
        )
    };
    let object = |mesh: String| format!("ObjectBegin \"a\"\n{mesh}ObjectEnd\n");
    let use_it = |transform: &str| format!("{transform}\nObjectInstance \"a\"\n");
    for length in [1.0, 1e-20, 1e20, 1e-37, 1e37] {
        for scale in [
            [1.0, 1.0, 1.0],
            [1.0, 1.0, 4.0],
            [-2.0, 3.0, 1e-3],
            [1e-9, 1e9, -1.0],
        ] {
            let [x, y, z] = scale;
            let transform = format!("Scale {x} {y} {z}");
            let spellings = [
                (1.0, format!("{transform}\n{}", mesh(length))),
                (
                    -1.0,
                    format!("{transform}\nReverseOrientation\n{}", mesh(length)),
                ),
                (1.0, object(mesh(length)) + &use_it(&transform)),
                (
                    1.0,
                    object(format!("{transform}\n{}", mesh(length))) + &use_it("Translate 0 0 0"),
                ),
            ];
            // The inverse transpose of a scale is its inverse.
            let sum: [f64; 3] =
                std::array::from_fn(|c| given.iter().map(|n| n[c]).sum::<f64>() / scale[c]);
            let norm = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
            for (side, text) in spellings {
                let n = normal_at_centroid(&text);
                for c in 0..3 {
                    let want = side * sum[c] / norm;
                    assert!(
                        (n[c] - want).abs() < 1e-6,
                        "{length:e} {scale:?} {side}: {n:?}, not {want}"
                    );
                }
            }
        }
    }
}

/// Row 37: a mesh whose normals are of lengths that no product of two holds, in triangles of their
/// own.
#[test]
fn normals_of_one_mesh_of_all_lengths() {
    for order in ["0 1 2 3 4 5", "3 4 5 0 1 2"] {
        let n = normal_at_centroid(&format!(
            "Shape \"trianglemesh\" \"integer indices\" [{order}] \"point P\" [-1 -1 0 1 -1 0 0 1 0 -1 -1 1 1 -1 1 0 1 1]
             \"normal N\" [0 6e19 8e19 0 6e19 8e19 0 6e19 8e19 0 6e-20 8e-20 0 6e-20 8e-20 0 6e-20 8e-20]\n"
        ));
        assert!(
            (n[1] - 0.6).abs() < 1e-4 && (n[2] - 0.8).abs() < 1e-4,
            "{n:?}"
        );
    }
}

/// Row 37: vertices without a normal do not turn those of others; without any the face has its own.
#[test]
fn normals_that_are_zero() {
    let mesh = |n: &str| {
        normal_at_centroid(&format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1 -1 0 1 -1 0 0 1 0] \"normal N\" [{n}]\n"
        ))
    };
    assert_eq!(mesh("0 0 0 0 0 0 0 0 0"), [0.0, 0.0, 1.0]);
    let n = mesh("0 0 0 0 .6 .8 0 0 0");
    assert!((n[1] - 0.6).abs() < 1e-6, "{n:?}");
}

/// Row 37: `loopsubdiv` passes its normals on as they are, long where faces are large.
#[test]
fn normals_of_subdivided_meshes_have_their_lengths() {
    let text = "Shape \"loopsubdiv\" \"integer levels\" [1] \"integer indices\" [0 1 2 0 2 3 0 3 1] \"point P\" [0 0 0 4 0 1 -1 3 0 -1 -2 .5]\n";
    let view = "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\"";
    let scene = scene(&(head(1, 1, 1, view) + text));
    let lengths = (scene.vertices.iter()).map(|v| v.n.iter().map(|x| x * x).sum::<f32>().sqrt());
    let least = lengths.clone().fold(f32::MAX, f32::min);
    assert!(least > 0.0 && lengths.fold(0.0, f32::max) > 1.5 * least);
}
