//! Is a claimed error honest in scenes that are made to deceive, or does a warning stand that says
//! why it is not?
//!
//! `cargo test --release --test renderer claims:: -- --ignored --nocapture` makes 24 scenes (12
//! benign, 12 nasty) at three efforts, and prints claimed over true errors. The small tests beside
//! it are about light that only chance finds.

use crate::support;

use phalanx::integrate::{EndedBy, Render, Settings, hidden};
use phalanx::pbrt;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::transport::World;
use std::fmt::Write;
use std::time::Duration;

const HEAD: &str = r#"
LookAt 0 0 3.2  0 -0.1 0  0 1 0
Camera "perspective" "float fov" 34
Integrator "mlt" "integer maxdepth" 8
PixelFilter "box" "float xwidth" 0.5 "float ywidth" 0.5
Film "image" "integer xresolution" 24 "integer yresolution" 24
WorldBegin
"#;

fn quad(corners: [[f64; 3]; 4]) -> String {
    let mut text =
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [".to_owned();
    for p in corners.iter().flatten() {
        write!(text, "{p} ").unwrap();
    }
    text + "]\n"
}

/// A quad across the axis `axis` at `at`, over the ranges `a` and `b` of the next two axes.
fn across(axis: usize, at: f64, a: [f64; 2], b: [f64; 2]) -> String {
    quad([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| {
        let mut p = [0.0; 3];
        p[axis] = at;
        p[(axis + 1) % 3] = a[i];
        p[(axis + 2) % 3] = b[j];
        p
    }))
}

const ALL: [f64; 2] = [-1.0, 1.0];

fn matte(kd: f64) -> String {
    format!("Material \"matte\" \"rgb Kd\" [{kd} {kd} {kd}]\n")
}

/// Walls of a room that is open to the camera, without those that are named: floor, ceiling, left,
/// right, back.
fn walls(without: &[usize]) -> String {
    let all = [
        across(1, -1.0, ALL, ALL),
        across(1, 1.0, ALL, ALL),
        across(0, -1.0, ALL, ALL),
        across(0, 1.0, ALL, ALL),
        across(2, -1.0, ALL, ALL),
    ];
    let kept = all.iter().enumerate().filter(|(i, _)| !without.contains(i));
    matte(0.6) + &kept.map(|(_, wall)| wall.as_str()).collect::<String>()
}

fn shining(l: f64, shape: &str) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}] \"bool twosided\" \"{}\"\n{}{shape}AttributeEnd\n",
        // The inside of a ball would shine on itself.
        !shape.contains("sphere"),
        matte(0.0)
    )
}

/// A panel below the ceiling, half as wide as `half` says; its power is always the same.
fn panel(half: f64) -> String {
    let l = 0.36 / (half * half);
    shining(l, &across(1, 0.98, [-half, half], [-half, half]))
}

fn ball(at: [f64; 3], radius: f64, inside_out: bool) -> String {
    let [x, y, z] = at;
    let turned = if inside_out {
        "ReverseOrientation\n"
    } else {
        ""
    };
    format!(
        "AttributeBegin\nTranslate {x} {y} {z}\n{turned}Shape \"sphere\" \"float radius\" {radius}\nAttributeEnd\n"
    )
}

const LAMP: [f64; 3] = [0.5, 0.2, -0.3];

/// A glowing ball of always the same power.
fn filament(radius: f64) -> String {
    shining(2.4 / (radius * radius), &ball(LAMP, radius, false))
}

const GLASS: &str = "Material \"glass\" \"float eta\" 1.5\n";

/// A shell of glass around it.
fn bulb(radius: f64) -> String {
    filament(radius) + GLASS + &ball(LAMP, 0.2, false) + &ball(LAMP, 0.18, true)
}

/// In front of the room.
fn pane() -> String {
    let wide = [-1.2, 1.2];
    format!(
        "{GLASS}{}{}",
        across(2, 1.31, wide, wide),
        across(2, 1.29, [1.2, -1.2], wide)
    )
}

fn thing(material: &str) -> String {
    format!(
        "Material {material}\n{}",
        ball([-0.4, -0.6, 0.0], 0.4, false)
    )
}

fn scene(world: &str) -> Scene {
    let text = format!("{HEAD}{world}WorldEnd\n");
    pbrt::load_str(&text, "scene.pbrt", ".".as_ref()).unwrap()
}

/// A room lit by a bulb that is seen through a pane.
fn window(radius: f64) -> Scene {
    scene(&(walls(&[]) + &bulb(radius) + &pane()))
}

fn settings(scene: &Scene, integrator: IntegratorKind) -> Settings {
    Settings {
        integrator,
        bootstrap: 20_000,
        chains: 512,
        target_error: Some(100.0),
        mutations_per_pixel: 1 << 30,
        samples_per_pixel: 1 << 30,
        ..Settings::of(scene)
    }
}

/// A target that anything reaches is not reached while light may be missing that only chance finds,
/// and is where that has been found often enough.
#[test]
fn a_target_waits_for_light_that_only_chance_finds() {
    for integrator in [
        IntegratorKind::Mmlt,
        IntegratorKind::Bdpt,
        IntegratorKind::Pt,
    ] {
        let tiny = window(1e-3);
        let limited = Settings {
            time: Some(Duration::from_millis(300)),
            ..settings(&tiny, integrator)
        };
        let missed = support::run(&tiny, &limited);
        assert_eq!(missed.ended_by, EndedBy::Time, "{integrator:?}");
        let [chance] = &missed.stats.chance[..] else {
            panic!("{:?}", missed.stats.chance);
        };
        assert!(!chance.is_known() && chance.tried > 0.0, "{chance:?}");
        let told = |start: &str| missed.warnings.iter().any(|w| w.starts_with(start));
        let start = "the light at scene.pbrt:";
        assert!(told(start), "{:?}", missed.warnings);

        let easy = window(0.15);
        // Chains take their time to mix, for which a target waits as well.
        let chains = integrator == IntegratorKind::Mmlt;
        let settings = Settings {
            mutations_per_pixel: if chains { 4000 } else { 1 },
            ..settings(&easy, integrator)
        };
        let found = support::run(&easy, &settings);
        let end = if chains {
            EndedBy::Effort
        } else {
            EndedBy::Target
        };
        assert_eq!(found.ended_by, end, "{integrator:?}");
        let [chance] = &found.stats.chance[..] else {
            panic!("{:?}", found.stats.chance);
        };
        assert!(chance.is_known() && chance.found >= 16, "{chance:?}");
        let told = found.warnings.iter().any(|w| w.starts_with(start));
        assert!(!told, "{:?}", found.warnings);
    }
}

/// The names of what hides light are those of the file.
#[test]
fn what_hides_light_is_named() {
    let scene = window(1e-3);
    let world = World::new(&scene, 8);
    let [lamp] = &hidden(&scene, &world, IntegratorKind::Mmlt)[..] else {
        panic!("one lamp");
    };
    let text = lamp.warning().unwrap();
    assert!(lamp.possible > 0.9 && lamp.size < 1e-6, "{lamp:?}");
    for part in [
        "the light at scene.pbrt:",
        " through \"glass\" (line ",
        ", seen through \"glass\" (line ",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    // A large one is not worth a word before the render.
    let easy = window(0.15);
    let world = World::new(&easy, 8);
    let easy = hidden(&easy, &world, IntegratorKind::Mmlt);
    assert!(easy.len() == 1 && easy[0].warning().is_none(), "{easy:?}");
}

/// Where next to nothing can hide, nothing is counted and nothing is said; and where there is
/// nothing specular, nothing is looked for.
#[test]
fn benign_scenes_are_not_suspected() {
    let glass = thing("\"glass\"");
    for (world, looks) in [
        (walls(&[]) + &panel(0.5), false),
        (walls(&[]) + &panel(0.5) + &glass, true),
        (walls(&[]) + &filament(1e-3) + &glass, true),
    ] {
        let scene = scene(&world);
        let world = World::new(&scene, 8);
        assert_eq!(world.chance.is_some(), looks);
        let found = hidden(&scene, &world, IntegratorKind::Mmlt);
        assert_eq!(found, [], "{looks}");
    }
}

/// Name, scene, and one with the same picture in which all light is easily found.
type Case = (&'static str, String, Option<String>);

fn benign() -> Vec<Case> {
    let room = |more: String| walls(&[]) + &more;
    let constant = "LightSource \"infinite\" \"rgb L\" [1 1 1]\n";
    let point = "LightSource \"point\" \"rgb I\" [1 1 1] \"point from\" [0 0.8 0]\n";
    let spot = "LightSource \"spot\" \"rgb I\" [4 4 4] \"point from\" [0 0.9 0] \"point to\" [0 -1 0] \"float coneangle\" 50\n";
    let rough = "\"glass\" \"float uroughness\" 0.2 \"float vroughness\" 0.2";
    let list = [
        ("panel", room(panel(0.5))),
        ("small panel", room(panel(0.1))),
        ("two lamps", room(panel(0.3) + &filament(0.1))),
        ("point", room(point.into())),
        ("spot", room(spot.into())),
        ("sky", walls(&[1]) + constant),
        ("glass", room(panel(0.5) + &thing("\"glass\""))),
        ("mirror", room(panel(0.5) + &thing("\"mirror\""))),
        ("plastic", room(panel(0.5) + &thing("\"plastic\""))),
        ("rough glass", room(panel(0.5) + &thing(rough))),
        (
            "metal",
            room(panel(0.5) + &thing("\"metal\" \"float roughness\" 0.1")),
        ),
        (
            "sky and glass",
            walls(&[1]) + constant + &thing("\"glass\""),
        ),
    ];
    list.map(|(name, world)| (name, world, None)).into()
}

/// The right wall with a hole of half width `half` to a room behind it that is lit.
fn hole(half: f64) -> String {
    let frame = across(0, 1.0, [-1.0, -half], ALL)
        + &across(0, 1.0, [half, 1.0], ALL)
        + &across(0, 1.0, [-half, half], [-1.0, -half])
        + &across(0, 1.0, [-half, half], [half, 1.0]);
    let l = 0.1 / (half * half);
    walls(&[3]) + &frame + &shining(l, &across(0, 1.5, [-0.3, 0.3], [-0.3, 0.3])) + &panel(0.5)
}

fn nasty() -> Vec<Case> {
    let room = |more: String| walls(&[]) + &more;
    let easy = || Some(room(bulb(0.1) + &pane()));
    let door = across(1, 0.7, [-1.0, 0.97], ALL) + &matte(0.6);
    let sun = |radius: f64| {
        let l = 300.0 / (radius * radius);
        let at = [30.0, 60.0, 10.0];
        let glass = format!("{GLASS}{}", across(1, 1.0, ALL, ALL));
        walls(&[1]) + &glass + &shining(l, &ball(at, radius, false)) + &pane()
    };
    vec![
        ("window, 1e-3", room(bulb(1e-3) + &pane()), easy()),
        ("window, 1e-2", room(bulb(1e-2) + &pane()), easy()),
        ("window, 0.05", room(bulb(0.05) + &pane()), easy()),
        ("bulb, 1e-3", room(bulb(1e-3)), Some(room(bulb(0.1)))),
        ("bulb, 0.05", room(bulb(0.05)), Some(room(bulb(0.1)))),
        ("hole, 0.1", hole(0.1), None),
        ("hole, 1e-2", hole(1e-2), None),
        ("hole, 1e-3", hole(1e-3), None),
        ("door ajar", room(door + &panel(0.5)), None),
        ("lamp of 1e-4", room(filament(1e-4)), None),
        (
            "small lamp, mirror",
            room(filament(5e-3) + &thing("\"mirror\"")),
            None,
        ),
        ("sun behind glass", sun(0.3), Some(sun(6.0))),
    ]
}

/// Root of the relMSE against a picture that is off by `off` times as much.
fn error(render: &Render, truth: &[f64], off: f64) -> f64 {
    let values = render.pixels.as_flattened();
    let all = values.iter().zip(truth);
    let sum: f64 = all
        .map(|(v, t)| (f64::from(*v) - t).powi(2) / (t * t + 0.01))
        .sum();
    (sum / values.len() as f64 / (1.0 + off)).sqrt()
}

fn mean(renders: &[Render]) -> Vec<f64> {
    let mut sums = vec![0.0; renders[0].pixels.len() * 3];
    for render in renders {
        let values = render.pixels.as_flattened().iter();
        (sums.iter_mut().zip(values))
            .for_each(|(sum, v)| *sum += f64::from(*v) / renders.len() as f64);
    }
    sums
}

/// Many renders of one scene, the seeds from `first`.
fn renders(scene: &Scene, mutations: u64, first: u64, count: u64) -> Vec<Render> {
    let one = |seed| {
        let settings = Settings {
            mutations_per_pixel: mutations,
            target_error: None,
            seed,
            ..settings(scene, IntegratorKind::Mmlt)
        };
        support::run(scene, &settings)
    };
    (first..first + count).map(one).collect()
}

#[test]
#[ignore = "minutes"]
fn study_of_claims() {
    let (mut fair, mut warned, mut all) = (0, 0, 0);
    for (name, world, twin) in benign().into_iter().chain(nasty()) {
        let own = scene(&world);
        let easy = twin.map_or_else(|| own.clone(), |twin| scene(&twin));
        let truth = mean(&renders(&easy, 2000, 100, 4));
        for mutations in [32, 128, 512] {
            let mut line = format!("{name:>20} {mutations:>4}:");
            for render in renders(&own, mutations, 1, 4) {
                let exact = error(&render, &truth, mutations as f64 / 8000.0);
                let factor = render.stats.relative_error.unwrap() / exact;
                let is_fair = (0.75..=1.33).contains(&factor);
                all += 1;
                fair += u32::from(is_fair);
                warned += u32::from(!is_fair && !render.warnings.is_empty());
                let mark = if render.warnings.is_empty() { ' ' } else { '*' };
                write!(line, " {factor:>6.2}{mark}").unwrap();
            }
            println!("{line}");
        }
    }
    println!("{fair} of {all} within 0.75 to 1.33, {warned} others with a warning (*)");
}
