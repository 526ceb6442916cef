//! Rows 4, 20, 21, 22, 29 and 37: points, edges, broken meshes, grazing angles, mirrors.
//!
//! `trace` has rays that leave surfaces and segments between them, by triangles of every shape
//! (rows 4 and 22), and broken geometry that the tracer is given all the same (row 21);
//! `tests/renderer/bsdf.rs` has every scattering function at grazing angles (row 22).

use super::COMPARISONS;
use crate::common::stats::Random;
use crate::support::stage::{CAMERA, GREY, lamp, stage};
use crate::support::{BOTH, Runs, expect_integrators_agree_among, head, run, scene, settings};
use phalanx::chain::evaluator::Evaluator;
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, LightKind, Scene};
use phalanx::trace::{Coherence, Hit, Ray, Tracer};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};
use std::fmt::Write;

// --- Coincident vertices ---

/// A groove along `z` whose sides meet in the origin, and below it a triangle that makes the origin
/// the centre of the scene.
fn groove() -> Scene {
    let view = "LookAt 0 1 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" [10]";
    scene(
        &(head(1, 1, 2, view)
            + "LightSource \"point\" \"rgb I\" [1 1 1] \"point from\" [0 1 0]\n\
               Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 3 4] \"point P\" [0 0 0  1 1 -1  1 1 1  -1 1 1  -1 1 -1]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [-1 -1 -1  1 -1 -1  0 -1 1]\n"),
    )
}

/// The path camera, `x = camera`, `x = light`, light, joined in its middle: rays straight down, at
/// those places of the groove. Returns its splat and the distance of the two endpoints.
fn joined(evaluator: Evaluator, camera: f32, light: f32) -> (Splat, f64) {
    let mut scene = groove();
    // It looks down; its upper side is to positive z.
    let height = 0.9;
    scene.camera.to_world = [
        [1.0, 0.0, 0.0, camera],
        [0.0, 0.0, -1.0, height],
        [0.0, 1.0, 0.0, 0.0],
    ];
    let LightKind::Point { p, .. } = &mut scene.lights[0].kind else {
        panic!("not a point");
    };
    *p = [light, height, 0.0].into();
    let world = World::new(&scene, 2);
    let plan = &world.plan.depths[2];
    let at = plan.layout;
    let mut samples = Samples::new(at.total, 8);
    for d in 0..at.total {
        samples.row_mut(d).fill(0.5);
    }
    let s2 = plan.strategies.iter().position(|s| *s == 2).unwrap();
    let choice = (s2 as f32 + 0.5) / plan.strategies.len() as f32;
    samples.row_mut(at.strategy).fill(choice);
    // Down: three quarters of a turn.
    samples.row_mut(at.emission + 3).fill(0.75);
    let mut paths = Paths::new(&world);
    evaluator.multiplexed(&world, plan, &samples, 8, &mut paths);
    let splat = paths.splats.camera[0];
    assert_eq!(splat.s, 2);
    let [a, b] = [0, 1].map(|side: usize| paths.subpaths.endpoints[side].place[0].p);
    let distance2: f64 = (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)).sum();
    (splat, distance2.sqrt())
}

/// Row 4: endpoints at distances from 0 up, on both sides of a groove and on one side of it. Such a
/// path is worth what its likes of any size are, as long as `f32` holds its densities; then
/// nothing. It is never infinite nor rejected.
#[test]
fn vertices_that_coincide() {
    let value = |o: &Splat| f64::from(o.rgb[1]);
    let usual = value(&joined(Evaluator::ONE, 1e-3, -1e-3).0);
    assert!(usual > 0.0);
    let mut places = vec![0.0f32];
    places.extend((3..=44).map(|e| 10f64.powi(-e) as f32));
    for x in places {
        for other in [-x, x, 2.0 * x, 0.0, x.next_up()] {
            let (one, distance) = joined(Evaluator::ONE, x, other);
            let (eight, _) = joined(Evaluator::EIGHT, x, other);
            assert_eq!(one, eight, "{x:e} {other:e}");
            let what = format!("{x:e} and {other:e}, {distance:e} apart: {one:?}");
            assert_eq!(one.rejected, 0, "{what}");
            assert!((0.0..=1.01 * usual).contains(&value(&one)), "{what}");
            // Across the groove everything is similar to what it is at any other size.
            if other == -x && x > 1e-15 {
                assert!((distance / f64::from(2.0 * x) - 1.0).abs() < 1e-3, "{what}");
                assert!(
                    (value(&one) / usual - 1.0).abs() < 0.01,
                    "{what}, not {usual}"
                );
            }
        }
    }
}

// --- Edges ---

/// A closed ball of triangles of all sizes: rings that crowd towards one pole.
fn ball() -> String {
    let (rings, segments) = (60, 90);
    let (mut points, mut indices) = (String::new(), String::new());
    for i in 1..rings {
        let theta = std::f64::consts::PI * (f64::from(i) / f64::from(rings)).powi(3);
        for j in 0..segments {
            let phi = std::f64::consts::TAU * f64::from(j) / f64::from(segments);
            let (s, c) = theta.sin_cos();
            write!(points, "{} {} {} ", s * phi.cos(), c, s * phi.sin()).unwrap();
        }
    }
    points += "0 1 0 0 -1 0";
    let poles = ((rings - 1) * segments, (rings - 1) * segments + 1);
    let at = |i: i32, j: i32| (i - 1) * segments + j % segments;
    for j in 0..segments {
        write!(indices, "{} {} {} ", poles.0, at(1, j), at(1, j + 1)).unwrap();
        write!(
            indices,
            "{} {} {} ",
            poles.1,
            at(rings - 1, j + 1),
            at(rings - 1, j)
        )
        .unwrap();
        for i in 1..rings - 1 {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            write!(indices, "{a} {b} {c} {a} {c} {d} ").unwrap();
        }
    }
    format!("Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point P\" [{points}]\n")
}

/// Sends rays from inside a closed mesh at its vertices and edges; returns how many escape.
fn escapes(rays: u64) -> u64 {
    let scene = scene(&(head(1, 1, 0, CAMERA) + &ball()));
    let tracer = Tracer::build(&scene);
    let mut random = Random(20);
    let n = 1 << 14;
    let list: Vec<u32> = (0..n).collect();
    let mut queue = vec![Ray::default(); n as usize];
    let mut hits = vec![Hit::default(); n as usize];
    let mut escaped = 0;
    for _ in 0..rays.div_ceil(u64::from(n)) {
        for ray in &mut queue {
            let triangle = scene.triangles[random.below(scene.triangles.len())];
            let corner = random.below(3);
            let [a, b] =
                [corner, (corner + 1) % 3].map(|c| scene.vertices[triangle.v[c] as usize].p);
            let along = match random.below(3) {
                0 => 0.0,
                1 => 0.5,
                _ => random.uniform(),
            };
            let direction = random.direction();
            // The ball has a radius of 0.5 in internal space.
            let radius = 0.4 * random.uniform64();
            let [o, d]: [[f32; 3]; 2] = {
                let o = direction.map(|v| (v * radius) as f32);
                let d = std::array::from_fn(|c| a[c] + along * (b[c] - a[c]) - o[c]);
                [o, d]
            };
            *ray = Ray::endless(o, d);
        }
        Evaluator::EIGHT.trace(&tracer, Coherence::Unknown, &queue, &list, &mut hits);
        escaped += hits.iter().filter(|h| h.is_none()).count() as u64;
    }
    escaped
}

/// Row 20: ten million rays at the edges and vertices of a closed mesh: none escapes.
#[test]
fn closed_meshes_hold_every_ray() {
    assert_eq!(escapes(10_000_000), 0);
}

/// Row 20: the same with a hundred million.
#[test]
#[ignore = "takes a minute"]
fn closed_meshes_hold_every_ray_of_many() {
    assert_eq!(escapes(100_000_000), 0);
}

// --- Broken meshes ---

/// Row 21: triangles without area, with vertices that coincide or are not finite, in the scene's
/// text and in PLY files: dropped with a counted warning, and the picture is to the bit that of the
/// mesh without them.
#[test]
fn broken_triangles_are_dropped_and_counted() {
    let dir = tempfile::tempdir().unwrap();
    let points = [
        "-3 0 -2", "-3 0 3", "3 0 3", "3 0 -2", "0 0 0", "-3 0 -2", "3 0 2",
    ];
    let good = ["0 1 2", "0 2 3"];
    // A point, a line, a line through three points, two equal corners by number and by place.
    let flat = ["4 4 4", "0 1 1", "0 6 4", "2 2 3", "0 5 1"];
    let infinite = ["7 1 2", "8 1 2", "0 9 2"];
    // Beyond `f32`, which is infinite; no number at all, as C prints it; and infinite as it stands.
    let odd_points = ["1e39 0 0", "0 -nan .0", "0 0 inf"];
    let ply = |name: &str, faces: &[&str]| {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            points.len() + odd_points.len(),
            faces.len()
        );
        for line in points.iter().chain(&odd_points) {
            writeln!(text, "{line}").unwrap();
        }
        for face in faces {
            writeln!(text, "3 {face}").unwrap();
        }
        std::fs::write(dir.path().join(name), text).unwrap();
    };
    let all: Vec<&str> = good.iter().chain(&flat).chain(&infinite).copied().collect();
    ply("good.ply", &good);
    ply("all.ply", &all);
    let mesh = |faces: &[&str]| {
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [{}] \"point P\" [{}]\n",
            faces.join(" "),
            points.join(" ")
        )
    };
    let both_kinds: Vec<&str> = good.iter().chain(&flat).copied().collect();
    let load = |floor: &str| {
        let text = head(12, 9, 3, CAMERA) + &lamp("[8 8 8]") + &stage(GREY) + floor;
        load_str(&text, "test.pbrt", dir.path()).unwrap()
    };
    let cases = [
        (
            mesh(&good),
            mesh(&both_kinds),
            vec!["5 triangles without area"],
        ),
        (
            "Shape \"plymesh\" \"string filename\" \"good.ply\"\n".to_string(),
            "Shape \"plymesh\" \"string filename\" \"all.ply\"\n".to_string(),
            vec![
                "3 triangles with vertices that are not finite",
                "5 triangles without area",
            ],
        ),
    ];
    for (good, broken, told) in cases {
        let (good, broken) = (load(&good), load(&broken));
        assert_eq!(good.triangles.len(), broken.triangles.len());
        assert_eq!(broken.warnings.len(), told.len(), "{:?}", broken.warnings);
        for (warning, what) in broken.warnings.iter().zip(told) {
            assert!(warning.contains(what), "{warning}");
        }
        for kind in BOTH {
            let [a, b] = [&good, &broken].map(|s| run(s, &settings(s, kind, 16)));
            assert_eq!(b.stats.rejected_nonfinite, 0);
            assert!(a.pixels == b.pixels, "{kind:?}");
        }
    }
}

/// Row 21: normals and texture coordinates that are not finite are told and left out: the mesh is
/// as if it had none.
#[test]
fn broken_normals_are_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let ply = |name: &str, properties: &str, rest: &str| {
        let mut text = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{properties}\
             element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        );
        for p in ["-3 0.001 -2", "-3 0.001 3", "3 0.001 3", "3 0.001 -2"] {
            writeln!(text, "{p} {rest}").unwrap();
        }
        text += "4 0 1 2 3\n";
        std::fs::write(dir.path().join(name), text).unwrap();
    };
    ply("plain.ply", "", "");
    let properties = ["nx", "ny", "nz", "u", "v"].map(|p| format!("property float {p}\n"));
    ply("odd.ply", &properties.concat(), "0 1e39 0 -1e39 0");
    let [plain, odd] = ["plain", "odd"].map(|name| {
        let mesh = format!("Shape \"plymesh\" \"string filename\" \"{name}.ply\"\n");
        let text = head(12, 9, 3, CAMERA) + &lamp("[8 8 8]") + &stage(GREY) + &mesh;
        load_str(&text, "test.pbrt", dir.path()).unwrap()
    });
    assert_eq!(odd.warnings.len(), 2, "{:?}", odd.warnings);
    assert!(odd.warnings[0].contains("4 normals") && odd.warnings[1].contains("4 texture"));
    for kind in BOTH {
        let [a, b] = [&plain, &odd].map(|s| run(s, &settings(s, kind, 16)));
        assert_eq!(b.stats.rejected_nonfinite, 0);
        assert!(a.pixels == b.pixels, "{kind:?}");
    }
}

/// Row 21: a floor of needles, a millionth as wide as they are long, is a floor.
#[test]
fn needles_make_a_floor() {
    let floor = |cuts: &[f64]| {
        let mut points = String::new();
        let mut indices = String::new();
        for (i, x) in cuts.iter().enumerate() {
            write!(points, "{x} .001 -2 {x} .001 3 ").unwrap();
            if i > 0 {
                let a = 2 * i - 2;
                write!(indices, "{a} {} {} {a} {} {} ", a + 1, a + 3, a + 3, a + 2).unwrap();
            }
        }
        format!("Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point P\" [{points}]\n")
    };
    let mut cuts = vec![-3.0, 3.0];
    for i in 0..200 {
        // Bundles of five needles.
        let x = -2.9 + 5.8 * f64::from(i) / 200.0;
        cuts.extend((0..5).map(|j| x + 5e-6 * f64::from(j)));
    }
    cuts.sort_by(f64::total_cmp);
    let [plain, needles] = [floor(&[-3.0, 3.0]), floor(&cuts)]
        .map(|f| scene(&(head(24, 18, 3, CAMERA) + &lamp("[8 8 8]") + &stage(GREY) + &f)));
    assert_eq!(needles.warnings, plain.warnings);
    let [a, b] = [&plain, &needles].map(|s| run(s, &settings(s, IntegratorKind::Pt, 64)));
    assert_eq!(b.stats.rejected_nonfinite, 0);
    let sum: f64 = a.pixels.iter().flatten().map(|v| f64::from(*v)).sum();
    let apart = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    let off: f64 = apart.map(|(a, b)| f64::from(a - b).abs()).sum();
    println!("{:.2e} of the light is elsewhere", off / sum);
    // The same paths, but for roundings that send one in some thousands the other way at an edge.
    assert!(off < 2e-3 * sum);
    let [a, b] = [&plain, &needles]
        .map(|s| Runs::new(s, &settings(s, IntegratorKind::Mmlt, 64), 24).whole(1));
    b.expect_same_among(COMPARISONS, &a, "needles");
}

// --- Grazing angles ---

/// Row 22: a plain under a constant sky shows its albedo, from straight above and from a
/// hundred-thousandth of a radian over it: paths from the camera graze it, and light subpaths end
/// in a camera that does. Glossy plains are the same by both integrators. (At some 3e-6 radians the
/// camera itself lies in the plain, as far as `f32` can tell. What scatters at smaller angles is in
/// `tests/renderer/bsdf.rs` and `trace`.)
#[test]
fn plains_seen_at_grazing_angles() {
    for angle in [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5f64] {
        let (sin, cos) = angle.sin_cos();
        // The window shows most of the plain at every angle: light subpaths meet it as often as
        // camera subpaths do.
        let half = 1.9 * sin;
        let view = format!(
            "LookAt {} {} 0  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1.9 1.9 -{half} {half}]",
            -3.0 * cos,
            3.0 * sin
        );
        let plain = |material: &str| {
            scene(
                &(head(4, 4, 1, &view)
                    + "LightSource \"infinite\" \"rgb L\" [1 1 1]\n"
                    + &format!("Material {material}\n")
                    + "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 0 -2 -2 0 2 2 0 2 2 0 -2]\n"),
            )
        };
        let grey = plain("\"matte\" \"rgb Kd\" [.5 .5 .5]");
        for kind in BOTH {
            let runs = Runs::new(&grey, &settings(&grey, kind, 192), 24);
            runs.whole(1)
                .expect_among(COMPARISONS, 0.5, &format!("{angle:e}, {kind:?}"));
        }
        let glossy = plain("\"metal\" \"float roughness\" [.3] \"bool remaproughness\" \"false\"");
        let name = format!("glossy, {angle:e}");
        expect_integrators_agree_among(COMPARISONS, &glossy, 96, 48, [1, 1], &name);
    }
}

// --- Mirrors ---

/// Row 29: mirrored transforms. `Scale -1 1 1` around the world shows its mirror image, with
/// emitters on their right sides: meshes, disks and spheres, also inside out.
#[test]
fn mirrored_worlds_are_mirror_images() {
    let world = |scale: &str| {
        head(16, 12, 3, CAMERA)
            + scale
            + &lamp("[8 6 4]")
            + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\nReverseOrientation\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 .2 -1 -2 1.2 -1 -1.2 1.2 -1 -1.2 .2 -1]\n\
               AttributeEnd\n\
               AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [3 2 1]\nTranslate 1.5 .4 0\nShape \"sphere\" \"float radius\" [.3]\n\
               AttributeEnd\n\
               AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [30 20 10]\nTranslate 1.5 1.4 0\nReverseOrientation\n\
               Shape \"sphere\" \"float radius\" [.3]\nAttributeEnd\n"
            + &stage(GREY)
    };
    for kind in BOTH {
        let [plain, mirrored] = ["", "Scale -1 1 1\n"].map(|scale| {
            let scene = scene(&world(scale));
            Runs::new(&scene, &settings(&scene, kind, 16), 48)
        });
        plain.show(&format!("plain-{kind:?}"));
        mirrored.show(&format!("mirrored-{kind:?}"));
        for i in 0..4 {
            let left = plain.region([4 * i, 4 * (i + 1), 0, 12], 0);
            let right = mirrored.region([12 - 4 * i, 16 - 4 * i, 0, 12], 0);
            left.expect_same_among(COMPARISONS, &right, &format!("{kind:?} column {i}"));
        }
    }
    expect_integrators_agree_among(
        COMPARISONS,
        &scene(&world("Scale -1 1 1\n")),
        12,
        64,
        [4, 3],
        "mirrored world",
    );
}
