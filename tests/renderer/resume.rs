//! A render that is stopped and resumed has the bits of one that was not.

use phalanx::checkpoint::Origin;
use phalanx::integrate::{
    Checkpoint, EndedBy, Observer, Phase, Render, Settings, Shard, Silent, State, Width, merge,
    render, resume,
};
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

mod team;

const SCENE: &str = r#"
LookAt 0 1.2 4  0 0.8 0  0 1 0
Camera "perspective" "float fov" [45]
Film "image" "integer xresolution" [40] "integer yresolution" [30]
PixelFilter "gaussian"
WorldBegin
LightSource "infinite" "rgb L" [.05 .05 .1]
Material "matte" "rgb Kd" [.6 .5 .4]
Shape "trianglemesh" "integer indices" [0 1 2 0 2 3] "point P" [-5 0 -5 -5 0 5 5 0 5 5 0 -5]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [5 4 3]
  Translate 0 3 -1  Rotate 80 1 0 0
  Shape "disk" "float radius" [0.6]
AttributeEnd
AttributeBegin
  Material "glass"
  Translate 0.8 0.7 1.2
  Shape "sphere" "float radius" [0.5]
AttributeEnd
Material "metal" "float roughness" [.05]
Translate -0.8 0.7 0
Shape "sphere" "float radius" [0.7]
WorldEnd
"#;

fn scene() -> Scene {
    load_str(SCENE, "resumed.pbrt", Path::new("")).unwrap()
}

fn settings(scene: &Scene, integrator: IntegratorKind) -> Settings {
    let mut settings = Settings::of(scene);
    settings.integrator = integrator;
    settings.threads = 2;
    settings.chains = 256;
    settings.bootstrap = 4096;
    settings.mutations_per_pixel = match integrator {
        IntegratorKind::Pssmlt(_) => 30,
        _ => 150,
    };
    settings.samples_per_pixel = 130;
    settings.tune.sigma = true;
    settings.error_layers = true;
    settings
}

/// Ends a render after so many rounds, and keeps its last state.
struct Stopped {
    rounds: u32,
    seen: AtomicU32,
    state: Mutex<Option<State>>,
}

impl Stopped {
    fn after(rounds: u32) -> Self {
        Self {
            rounds,
            seen: AtomicU32::new(0),
            state: Mutex::new(None),
        }
    }

    fn state(self) -> State {
        self.state.into_inner().unwrap().unwrap()
    }
}

impl Observer for Stopped {
    fn progress(&self, phase: Phase, _: u64, _: u64) {
        self.seen
            .fetch_add(u32::from(phase == Phase::Render), Relaxed);
    }
    fn stop(&self) -> bool {
        self.seen.load(Relaxed) >= self.rounds
    }
    fn wants_state(&self, _: bool) -> bool {
        true
    }
    fn state(&self, state: State, _: bool) {
        *self.state.lock().unwrap() = Some(state);
    }
}

fn expect_same(a: &Render, b: &Render, what: &str) {
    let bits = |pixels: &[[f32; 3]]| -> Vec<u32> {
        pixels.as_flattened().iter().map(|v| v.to_bits()).collect()
    };
    assert!(
        bits(&a.pixels) == bits(&b.pixels),
        "{what}: pictures differ"
    );
    let deviations = [a, b].map(|r| r.deviation.as_deref().map(bits));
    assert!(deviations[0] == deviations[1], "{what}: errors differ");
    // Of all figures but those of the machine.
    let figures = |render: &Render| {
        let mut stats = render.stats.clone();
        stats.mutations_per_second = 0.0;
        stats.samples_per_second = 0.0;
        stats.rays_per_second = 0.0;
        stats.build_seconds = 0.0;
        stats.bootstrap_seconds = 0.0;
        stats.render_seconds = 0.0;
        stats.total_seconds = 0.0;
        stats.threads = 0;
        stats.lanes = 0;
        stats.peak_rss_bytes = 0;
        stats.gathered = None;
        stats
    };
    assert_eq!(figures(a), figures(b), "{what}");
    assert_eq!(a.warnings, b.warnings, "{what}");
}

/// Through a file, as a program would.
fn kept(scene: &Scene, settings: &Settings, state: State) -> Checkpoint {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state");
    let checkpoint = Checkpoint {
        origin: Origin::new(None, "resumed.pbrt", &scene.files).unwrap(),
        resolution: Some([40, 30]),
        crop: None,
        settings: settings.clone(),
        error: Some(0.5),
        state,
    };
    checkpoint.write(&path).unwrap();
    let read = Checkpoint::read(&path).unwrap();
    assert_eq!(read, checkpoint);
    let look = Checkpoint::look(&path).unwrap();
    assert_eq!(
        (look.settings, look.state.made),
        (read.settings.clone(), read.state.made)
    );
    read
}

/// Stops a render after one round of its work, after two and after three, and each once more.
fn expect_resumed(scene: &Scene, settings: &Settings) {
    let whole = render(scene, settings, &Silent).unwrap();
    let mut stops = 0;
    for rounds in [1, 2, 3] {
        let name = format!("{} after {rounds} rounds", settings.integrator.name());
        let stopped = Stopped::after(rounds);
        let part = render(scene, settings, &stopped).unwrap();
        if part.ended_by != EndedBy::Observer {
            // A fast machine needs fewer rounds.
            continue;
        }
        stops += 1;
        let first = kept(scene, settings, stopped.state());
        assert!(
            first.state.made.part < 1.0,
            "{name}: {:?}",
            first.state.made
        );
        // On another machine.
        let mut other = first.settings.clone();
        (other.threads, other.lanes) = (1, Width::One);
        let stopped = Stopped::after(1);
        resume(scene, &other, &first.state, &stopped).unwrap();
        let second = kept(scene, &other, stopped.state());
        let (a, b) = (&first.state.made, &second.state.made);
        assert!(
            b.part > a.part && b.seconds > a.seconds,
            "{name}: {a:?} {b:?}"
        );
        let resumed = resume(scene, &first.settings, &second.state, &Silent).unwrap();
        expect_same(&whole, &resumed, &name);
    }
    assert!(stops > 0, "{} was not stopped", settings.integrator.name());
}

fn expect_resumed_by(integrator: IntegratorKind) {
    let scene = scene();
    expect_resumed(&scene, &settings(&scene, integrator));
}

/// Renders all shards apart, each stopped once, and adds them up.
fn expect_merged(scene: &Scene, settings: &Settings, of: u32) {
    let name = format!("{} in {of} shards", settings.integrator.name());
    let mut states = Vec::new();
    for index in 0..of {
        let settings = Settings {
            shard: Some(Shard { index, of }),
            threads: 1 + index as usize % 2,
            ..settings.clone()
        };
        let stopped = Stopped::after(1);
        render(scene, &settings, &stopped).unwrap();
        let state = kept(scene, &settings, stopped.state()).state;
        let keeps = Stopped::after(u32::MAX);
        resume(scene, &settings, &state, &keeps).unwrap();
        states.push(kept(scene, &settings, keeps.state()).state);
        assert_eq!(states[index as usize].made.part, 1.0, "{name}");
    }
    let all: Vec<&State> = states.iter().collect();
    let keeps = Stopped::after(u32::MAX);
    let merged = merge(scene, settings, &all, &keeps).unwrap();
    let whole = render(scene, settings, &Silent).unwrap();
    expect_same(&whole, &merged, &name);
    // What it has come to is a state like others.
    let again = resume(scene, settings, &keeps.state(), &Silent).unwrap();
    expect_same(&whole, &again, &name);
    // Not all of them, one twice, out of order.
    let some: &[&[&State]] = &[
        &all[..1],
        &[all[0]; 3],
        &[all[1], all[0], all[2]],
        &all[..2],
    ];
    for some in some {
        assert!(merge(scene, settings, some, &Silent).is_err(), "{name}");
    }
}

#[test]
fn shards_add_up() {
    let scene = scene();
    for integrator in [
        IntegratorKind::Mmlt,
        IntegratorKind::Pssmlt(PathSamplerKind::Bdpt),
        IntegratorKind::Bdpt,
    ] {
        let mut settings = settings(&scene, integrator);
        settings.samples_per_pixel = 9;
        settings.mutations_per_pixel = 20;
        expect_merged(&scene, &settings, 3);
    }
}

#[test]
fn chains_of_one_depth_each() {
    expect_resumed_by(IntegratorKind::Mmlt);
}

#[test]
fn chains_of_all_depths() {
    expect_resumed_by(IntegratorKind::Pssmlt(PathSamplerKind::Bdpt));
    expect_resumed_by(IntegratorKind::Pssmlt(PathSamplerKind::Pt));
}

#[test]
fn samples() {
    expect_resumed_by(IntegratorKind::Pt);
    expect_resumed_by(IntegratorKind::Lt);
    expect_resumed_by(IntegratorKind::Bdpt);
}

#[test]
fn samples_and_chains() {
    let text = include_str!("../../scenes/slit.pbrt");
    let mut slit = load_str(text, "slit.pbrt", Path::new("")).unwrap();
    slit.set_resolution(56, 56).unwrap();
    let mut settings = settings(&slit, IntegratorKind::Auto);
    settings.mutations_per_pixel = 600;
    settings.bootstrap = 65_536;
    settings.chains = 4096;
    settings.seed = 2;
    let render = render(&slit, &settings, &Silent).unwrap();
    assert!(render.stats.mutations > 0 && render.stats.samples > 0);
    expect_resumed(&slit, &settings);
    expect_merged(&slit, &settings, 3);
    // Samples alone.
    let scene = scene();
    settings.mutations_per_pixel = 1000;
    expect_resumed(&scene, &settings);
}

/// Where `auto` has chosen them.
#[test]
fn paths_from_the_camera_alone() {
    let text = include_str!("../../scenes/studio.pbrt");
    let mut studio = load_str(text, "studio.pbrt", Path::new("")).unwrap();
    studio.set_resolution(56, 56).unwrap();
    let mut settings = settings(&studio, IntegratorKind::Auto);
    settings.mutations_per_pixel = 2000;
    let shares = render(&studio, &settings, &Silent).unwrap().stats.shares;
    assert!(shares.is_some_and(|s| s.forward));
    expect_resumed(&studio, &settings);
    expect_merged(&studio, &settings, 3);
}

/// Samples go on to any number of them, and come to what as many at once come to.
#[test]
fn more_samples_than_at_first() {
    let scene = scene();
    let mut settings = settings(&scene, IntegratorKind::Bdpt);
    settings.samples_per_pixel = 5;
    let keeps = Stopped::after(u32::MAX);
    render(&scene, &settings, &keeps).unwrap();
    settings.samples_per_pixel = 9;
    let more = resume(&scene, &settings, &keeps.state(), &Silent).unwrap();
    let at_once = render(&scene, &settings, &Silent).unwrap();
    expect_same(&at_once, &more, "bdpt");
}

/// Chains go on beyond what they were begun for, wherever they were stopped, and their picture is
/// that of a longer render but for the rounding of the film and the error that it was made for.
#[test]
fn more_mutations_than_at_first() {
    let scene = scene();
    let mut settings = settings(&scene, IntegratorKind::Mmlt);
    settings.tune.sigma = false;
    settings.mutations_per_pixel = 20;
    let keeps = Stopped::after(u32::MAX);
    render(&scene, &settings, &keeps).unwrap();
    let state = keeps.state();
    settings.mutations_per_pixel = 400;
    let more = resume(&scene, &settings, &state, &Silent).unwrap();
    let at_once = render(&scene, &settings, &Silent).unwrap();
    assert_eq!(more.stats.mutations, at_once.stats.mutations);
    for (a, b) in more
        .pixels
        .as_flattened()
        .iter()
        .zip(at_once.pixels.as_flattened())
    {
        assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} {b}");
    }
    let stopped = Stopped::after(1);
    resume(&scene, &settings, &state, &stopped).unwrap();
    let again = resume(&scene, &settings, &stopped.state(), &Silent).unwrap();
    expect_same(&more, &again, "mmlt");
}

/// States of other renders are refused, and so is what no render has written.
#[test]
fn other_states_are_refused() {
    let scene = scene();
    let mut settings = settings(&scene, IntegratorKind::Mmlt);
    settings.mutations_per_pixel = 20;
    let keeps = Stopped::after(1);
    render(&scene, &settings, &keeps).unwrap();
    let state = keeps.state();
    let refused = |scene: &Scene, change: &dyn Fn(&mut Settings)| {
        let mut other = settings.clone();
        change(&mut other);
        let Err(error) = resume(scene, &other, &state, &Silent) else {
            panic!("it was taken");
        };
        error.to_string()
    };
    let whose = "not a state of this render";
    assert!(refused(&scene, &|s| s.seed = 1).contains(whose));
    assert!(refused(&scene, &|s| s.max_depth = 3).contains(whose));
    assert!(refused(&scene, &|s| s.integrator = IntegratorKind::Pt).contains(whose));
    assert!(refused(&scene, &|s| s.estimate_error = false).contains(whose));
    assert!(refused(&scene, &|s| s.chains = 16).contains(whose));
    let mut small = load_str(SCENE, "resumed.pbrt", Path::new("")).unwrap();
    small.set_resolution(30, 40).unwrap();
    assert!(refused(&small, &|_| {}).contains(whose));
}
