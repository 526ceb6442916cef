//! Light tracing gives what path tracing gives, but for what specular surfaces show the camera.

use crate::common;
use crate::support;

use common::scenes;
use phalanx::plan::Plan;
use phalanx::scene::IntegratorKind;
use phalanx::transport::World;
use support::{Runs, head, run, scene, settings};

/// Regions along each side.
const GRID: u32 = 2;
const SEEDS: u64 = 12;

fn is_specular(plan: &Plan) -> bool {
    plan.kinds.iter().any(|kind| kind.is_delta())
}

/// Scenes without specular surfaces: nothing is out of reach.
#[test]
fn pictures_are_those_of_path_tracing() {
    let all: Vec<_> = (scenes::all().into_iter())
        .filter(|(_, scene)| !is_specular(&World::new(scene, 4).plan))
        .collect();
    assert!(all.len() >= 8, "{} scenes", all.len());
    let comparisons = all.len() * 3 * (1 + GRID * GRID) as usize;
    for (name, scene) in all {
        let [pt, lt] = [(IntegratorKind::Pt, 48), (IntegratorKind::Lt, 96)]
            .map(|(kind, spp)| Runs::new(&scene, &settings(&scene, kind, spp), SEEDS));
        lt.show(&format!("lt-{name}"));
        for c in 0..3 {
            let what = format!("{name}, channel {c}");
            lt.whole(c)
                .expect_same_among(comparisons, &pt.whole(c), &what);
        }
        let regions = lt.grid(GRID, GRID).into_iter().zip(pt.grid(GRID, GRID));
        for (i, (a, b)) in regions.enumerate() {
            let what = format!("{name}, region {}, channel {}", i / 3, i % 3);
            a.expect_same_among(comparisons, &b, &what);
        }
    }
}

/// A mirror fills the right half of the picture: black, and a warning says why. The left half has
/// the light that the mirror throws on it.
#[test]
fn what_a_mirror_shows_is_out_of_reach() {
    let camera = "LookAt 0 1 6  0 1 0  0 1 0\nCamera \"perspective\" \"float fov\" [40]";
    let text = head(16, 8, 3, camera)
        + "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]\n\
           Translate 0 4 3 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" [.7] AttributeEnd\n\
           Material \"mirror\" \"rgb Kr\" [.9 .9 .9]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 3  0 -9 0  0 9 0  -9 9 3]\n\
           Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [0 -9 0  9 -9 3  9 9 3  0 9 0]\n";
    let scene = scene(&text);
    let [pt, lt, bdpt] = [
        (IntegratorKind::Pt, 256),
        (IntegratorKind::Lt, 512),
        (IntegratorKind::Bdpt, 128),
    ]
    .map(|(kind, spp)| Runs::new(&scene, &settings(&scene, kind, spp), SEEDS));
    let warnings = run(&scene, &settings(&scene, IntegratorKind::Lt, 1)).warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("mirror"),
        "{warnings:?}"
    );
    let (wall, mirror) = ([0, 8, 0, 8], [8, 16, 0, 8]);
    for c in 0..3 {
        let what = format!("channel {c}");
        assert_eq!(lt.region(mirror, c).mean, 0.0);
        assert!(pt.region(mirror, c).mean > 0.0);
        lt.region(wall, c).expect_same(&pt.region(wall, c), &what);
        bdpt.region(mirror, c)
            .expect_same(&pt.region(mirror, c), &what);
    }
}
