//! Faces of four corners in PLY files: two triangles in pbrt-v3, a bilinear patch in pbrt-v4.

use super::*;

const FLAT: &str = "0 0 0\n2 0 0\n2 2 0\n0 2 0\n";
const SADDLE: &str = "-1 -1 0.5\n1 -1 -0.5\n1 1 0.8\n-1 1 -0.5\n";

/// A scene whose world holds the mesh of these vertices (of this many numbers) and faces; `world`
/// comes before it.
fn load(film: &str, world: &str, vertices: &str, faces: &str) -> Scene {
    let dir = tempfile::tempdir().expect("a folder");
    let names = ["x", "y", "z", "u", "v"];
    let width = vertices
        .lines()
        .next()
        .expect("a vertex")
        .split(' ')
        .count();
    let properties: String = (names[..width].iter())
        .map(|name| format!("property float {name}\n"))
        .collect();
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\n{properties}element face {}\nproperty list uchar int vertex_indices\n\
         end_header\n{vertices}{faces}",
        vertices.lines().count(),
        faces.lines().count()
    );
    std::fs::write(dir.path().join("m.ply"), ply).expect("written");
    let shape = "Shape \"plymesh\" \"string filename\" \"m.ply\"";
    let text = format!("Film \"{film}\"\nWorldBegin\n{world}\n{shape}\n");
    load_str(&text, "t.pbrt", dir.path()).expect("loads")
}

const V4_CHECKS: &str = "Texture \"c\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"c\"";
const V3_CHECKS: &str =
    "Texture \"c\" \"spectrum\" \"checkerboard\" Material \"matte\" \"texture Kd\" \"c\"";

/// World position, normal and texture coordinates of every corner of every triangle.
fn all_corners(scene: &Scene) -> Vec<(Vec3, Vec3, [f32; 2])> {
    let corner = |&i: &u32| {
        let vertex = &scene.vertices[i as usize];
        let p = Vec3::from(vertex.p).as_dvec3() / scene.space.scale + scene.space.centre;
        (p.as_vec3(), Vec3::from(vertex.n), vertex.uv)
    };
    (scene.triangles.iter())
        .flat_map(|t| t.v.iter().map(corner))
        .collect()
}

#[test]
fn patches_cover_the_unit_square() {
    let s = load("rgb", V4_CHECKS, FLAT, "4 0 1 2 3\n");
    assert_eq!((s.triangles.len(), s.vertices.len()), (2, 4));
    for (p, n, uv) in all_corners(&s) {
        assert_eq!((n, Vec2::from(uv)), (Vec3::ZERO, p.truncate() / 2.0));
    }
    // Two triangles, each with (0, 0), (1, 0), (1, 1): 0 1 2 and 3 0 2.
    let s = load("image", V3_CHECKS, FLAT, "4 0 1 2 3\n");
    let uvs: Vec<_> = all_corners(&s).iter().map(|c| (c.0, c.2)).collect();
    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let second = [
        (at(0.0, 2.0), [0.0, 0.0]),
        (at(0.0, 0.0), [1.0, 0.0]),
        (at(2.0, 2.0), [1.0, 1.0]),
    ];
    assert_eq!(uvs[3..], second);
}

#[test]
fn patches_take_the_texture_coordinates_of_their_vertices() {
    let vertices = "0 0 0 0 0\n2 0 0 3 0\n1 1 0 1 1\n0 2 0 0 1\n";
    let s = load("rgb", V4_CHECKS, vertices, "4 0 1 2 3\n");
    assert!(s.triangles.len() > 8);
    // Along the line v = 1 - u of the patch. Of triangles the middle would be half of (3, 1).
    let middle = all_corners(&s);
    let middle = middle
        .iter()
        .find(|c| (c.0 - Vec3::new(0.75, 0.75, 0.0)).length() < 1e-5);
    let (_, _, [u, v]) = middle.expect("the middle of the patch");
    assert!((u - 1.0).abs() < 1e-5 && (v - 0.5).abs() < 1e-5, "{u} {v}");
}

#[test]
fn curved_patches_are_followed() {
    for world in ["", V4_CHECKS] {
        let s = load("rgb", world, SADDLE, "4 0 1 2 3\n");
        assert!(s.triangles.len() > 100, "{}", s.triangles.len());
        for (p, n, [u, v]) in all_corners(&s) {
            let [x, y] = [(p.x + 1.0) / 2.0, (p.y + 1.0) / 2.0];
            let z = (1.0 - x) * (0.5 * (1.0 - y) - 0.5 * y) + x * (-0.5 * (1.0 - y) + 0.8 * y);
            assert!((p.z - z).abs() < 1e-5, "{p}: {z}");
            let du = Vec3::new(2.0, 0.0, -(1.0 - y) + 1.3 * y);
            let dv = Vec3::new(0.0, 2.0, -(1.0 - x) + 1.3 * x);
            assert!(n.dot(du.cross(dv).normalize()) > 1.0 - 1e-6, "{p}: {n}");
            assert!(world.is_empty() || (u - x).abs().max((v - y).abs()) < 1e-5);
        }
    }
    let s = load("image", "", SADDLE, "4 0 1 2 3\n");
    assert_eq!((s.triangles.len(), s.vertices.len()), (2, 4));
}

#[test]
fn plane_patches_without_texture_share_vertices() {
    // A trapezoid, and a quad with two corners in one place.
    let vertices = "0 0 0\n4 0 0\n3 1 0\n1 1 0\n4 2 0\n";
    let s = load("rgb", "", vertices, "4 0 1 2 3\n4 1 4 2 2\n3 0 1 4\n");
    assert_eq!((s.triangles.len(), s.vertices.len()), (4, 5));
    assert!(all_corners(&s).iter().all(|c| c.1 == Vec3::ZERO));
    // With a texture on it, each face has coordinates of its own.
    let s = load("rgb", V4_CHECKS, FLAT, "4 0 1 2 3\n3 0 1 2\n");
    assert_eq!(s.triangles.len(), 3);
    let triangle: Vec<_> = all_corners(&s)[6..].iter().map(|c| c.2).collect();
    assert_eq!(triangle, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
}

#[test]
fn a_patch_has_the_power_of_one_light() {
    let light = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"float power\" 10";
    let s = load("rgb", light, FLAT, "4 0 1 2 3\n3 0 1 2\n");
    let radiance = |i: usize| match s.lights[i].kind {
        LightKind::Triangle { l, .. } => l[0],
        _ => panic!("a triangle"),
    };
    assert_eq!(s.lights.len(), 3);
    let of_area = |area: f32| 10.0 / (std::f32::consts::PI * area);
    for (i, area) in [(0, 4.0), (1, 4.0), (2, 2.0)] {
        assert!((radiance(i) / of_area(area) - 1.0).abs() < 1e-5, "{i}");
    }
}

#[test]
fn broken_patches_are_dropped() {
    let vertices = "0 0 0\n1 0 0\n1 1 0\n0 nan 0\n0 1 0\n";
    for world in ["", V4_CHECKS] {
        let s = load("rgb", world, vertices, "4 0 1 2 3\n4 0 1 2 4\n4 1 1 1 1\n");
        assert_eq!(s.triangles.len(), 2);
        assert!(!s.warnings.is_empty());
    }
}
