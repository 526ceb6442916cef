//! Checkpoints that no render has written, but whose checksums are right: they are refused, or
//! rendered from, and never the end of the program.

use crate::common;

use common::stats::Random;
use phalanx::checkpoint::{self, Origin, Packed, Reader, Writer};
use phalanx::integrate::{Checkpoint, Observer, Settings, State, render, resume};
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, PathSamplerKind, Scene};
use std::path::Path;
use std::sync::Mutex;

const SCENE: &str = r#"
LookAt 0 0 3  0 0 0  0 1 0
Camera "perspective" "float fov" 40
Film "image" "integer xresolution" 8 "integer yresolution" 6
WorldBegin
LightSource "point" "rgb I" [9 9 9] "point from" [0 2 2]
Shape "sphere"
WorldEnd
"#;

#[derive(Default)]
struct Keeps(Mutex<Option<State>>);

impl Observer for Keeps {
    fn wants_state(&self, last: bool) -> bool {
        last
    }
    fn state(&self, state: State, _: bool) {
        *self.0.lock().unwrap() = Some(state);
    }
}

fn bytes(packed: &Packed) -> Vec<u8> {
    let mut from = Reader::new(packed);
    std::iter::from_fn(|| from.value().ok()).collect()
}

fn packed(bytes: &[u8]) -> Packed {
    let mut to = Writer::new();
    bytes.iter().for_each(|byte| to.value(*byte));
    to.finish()
}

/// Changes a few bytes, or cuts some off.
fn changed(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut below = |n: usize| random.below(n);
    match below(8) {
        0 => bytes.truncate(below(bytes.len())),
        kind => {
            for _ in 0..=below(3) {
                let at = below(bytes.len());
                bytes[at] = match kind {
                    1 => 0xff,
                    2 => 0,
                    3 => 0x7f,
                    _ => bytes[at] ^ 1 << below(8),
                };
            }
        }
    }
    bytes
}

fn attack(scene: &Scene, settings: &Settings, rounds: u32) -> [u32; 2] {
    let keeps = Keeps::default();
    render(scene, settings, &keeps).unwrap();
    let state = keeps.0.into_inner().unwrap().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state");
    let checkpoint = Checkpoint {
        origin: Origin::new(None, "made up", &[]).unwrap(),
        resolution: None,
        crop: Some([0.0, 1.0, 0.0, 1.0]),
        settings: settings.clone(),
        error: None,
        state,
    };
    checkpoint.write(&path).unwrap();
    let (head, state) = checkpoint::read(&path, true).unwrap();
    let (head, state) = (bytes(&head), bytes(&state));
    let mut random = Random(7);
    let mut counts = [0, 0];
    for round in 0..rounds {
        let (mut head, mut state) = (head.clone(), state.clone());
        match round % 4 {
            0 => head = changed(&head, &mut random),
            _ => state = changed(&state, &mut random),
        }
        checkpoint::write(&path, &packed(&head), &packed(&state)).unwrap();
        let taken = match Checkpoint::read(&path) {
            // A head of other settings is another render, of any length: only read.
            Ok(read) if round % 4 == 0 => read.settings == *settings,
            Ok(read) => resume(scene, settings, &read.state, &Keeps::default()).is_ok(),
            Err(_) => false,
        };
        counts[usize::from(taken)] += 1;
    }
    counts
}

#[test]
fn they_are_refused_or_taken() {
    let scene = load_str(SCENE, "made up", Path::new("")).unwrap();
    for integrator in [
        IntegratorKind::Mmlt,
        IntegratorKind::Pssmlt(PathSamplerKind::Bdpt),
        IntegratorKind::Bdpt,
        IntegratorKind::Auto,
    ] {
        let mut settings = Settings::of(&scene);
        settings.integrator = integrator;
        settings.max_depth = 2;
        settings.threads = 1;
        settings.chains = 16;
        settings.bootstrap = 64;
        settings.mutations_per_pixel = 20;
        settings.samples_per_pixel = 4;
        let [refused, taken] = attack(&scene, &settings, 120);
        println!("{}: {refused} refused, {taken} taken", integrator.name());
        assert!(refused > 10, "{}", integrator.name());
    }
}
