//! A checkpoint is read and gone on with, or is refused with a message of one line.
//!
//! The first byte of the input says what the rest is:
//! - 0: the file;
//! - 1: the head of a file that is otherwise right, checksums included;
//! - 2 and above, by integrator: changes of a state that a render then goes on from, of three bytes
//!   each: where in it, in two of them, and by what.

use std::fmt::Display;
use std::path::Path;
use std::sync::Mutex;

use phalanx::checkpoint::{self, Origin, Packed, Reader, Writer};
use phalanx::integrate::{self, Checkpoint, Observer, Settings, Silent, State};
use phalanx::pbrt;
use phalanx::scene::{IntegratorKind, Scene};

use super::files;

const SCENE: &str = r#"
    LookAt 0 0 5  0 0 0  0 1 0
    Camera "perspective" "float fov" 40
    Film "image" "integer xresolution" 8 "integer yresolution" 8
    WorldBegin
    LightSource "infinite" "rgb L" [1 1 1]
    Shape "sphere"
    WorldEnd
"#;

const INTEGRATORS: [IntegratorKind; 3] = [
    IntegratorKind::Mmlt,
    IntegratorKind::Bdpt,
    IntegratorKind::Auto,
];

/// A render of a moment, and the file of its end.
struct Kept {
    scene: Scene,
    settings: Settings,
    head: Packed,
    state: Packed,
}

thread_local! {
    static KEPT: [Kept; 3] = INTEGRATORS.map(kept);
}

/// Keeps the last state of a render.
struct Last(Mutex<Option<State>>);

impl Observer for Last {
    fn wants_state(&self, last: bool) -> bool {
        last
    }

    fn state(&self, state: State, _last: bool) {
        *self.0.lock().expect("nobody panics") = Some(state);
    }
}

fn kept(integrator: IntegratorKind) -> Kept {
    let scene = pbrt::load_str(SCENE, "sphere.pbrt", Path::new(".")).expect("a scene");
    let settings = Settings {
        integrator,
        threads: 1,
        max_depth: 2,
        samples_per_pixel: 2,
        mutations_per_pixel: 4,
        chains: 16,
        bootstrap: 64,
        ..Settings::of(&scene)
    };
    let last = Last(Mutex::new(None));
    integrate::render(&scene, &settings, &last).expect("a render");
    let state = last.0.into_inner().expect("nobody panics");
    let checkpoint = Checkpoint {
        origin: Origin::new(None, "sphere.pbrt", &[]).expect("no files"),
        resolution: None,
        crop: None,
        settings: settings.clone(),
        error: Some(0.5),
        state: state.expect("a state"),
    };
    let path = files::dir().join("kept");
    checkpoint.write(&path).expect("a written file");
    let (head, state) = checkpoint::read(&path, true).expect("a file as it was written");
    Kept {
        scene,
        settings,
        head,
        state,
    }
}

pub fn check(data: &[u8]) {
    let Some((kind, data)) = data.split_first() else {
        return;
    };
    match kind {
        0 => files::with_file("file", data, |path| drop(read(path))),
        1 => KEPT.with(|[kept, ..]| {
            let path = files::dir().join("head");
            checkpoint::write(&path, &pack(data), &kept.state).expect("a written file");
            read(&path);
        }),
        kind => KEPT.with(|all| go_on(&all[*kind as usize % all.len()], data)),
    }
}

/// A message of one line, as errors have to be.
fn told(error: &dyn Display) {
    let message = error.to_string();
    assert!(
        !message.is_empty() && !message.contains('\n'),
        "{message:?}"
    );
}

fn read(path: &Path) -> Option<Checkpoint> {
    let looked = Checkpoint::look(path);
    let read = Checkpoint::read(path);
    assert!(looked.is_ok() == read.is_ok());
    read.map_err(|e| told(&e)).ok()
}

/// Goes on from a state that has been changed.
fn go_on(kept: &Kept, changes: &[u8]) {
    let mut bytes = unpack(&kept.state);
    for change in changes.chunks_exact(3) {
        let part = u64::from(u16::from_le_bytes([change[0], change[1]]));
        let at = (part * bytes.len() as u64) >> 16;
        bytes[at as usize] ^= change[2];
    }
    let path = files::dir().join("state");
    checkpoint::write(&path, &kept.head, &pack(&bytes)).expect("a written file");
    let Some(checkpoint) = read(&path) else {
        panic!("its head is as it was");
    };
    match integrate::resume(&kept.scene, &kept.settings, &checkpoint.state, &Silent) {
        Ok(render) => assert!(render.pixels.iter().flatten().all(|v| v.is_finite())),
        Err(e) => told(&e),
    }
}

/// Bytes as a writer has taken them: tables are laid out byte by byte in them.
fn unpack(packed: &Packed) -> Vec<u8> {
    let mut from = Reader::new(packed);
    std::iter::from_fn(|| from.value().ok()).collect()
}

fn pack(bytes: &[u8]) -> Packed {
    let mut to = Writer::new();
    bytes.iter().for_each(|byte| to.value(*byte));
    to.finish()
}
