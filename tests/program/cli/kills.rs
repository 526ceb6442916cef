//! A render that is ended from outside, at any moment and while it writes: whole files or none, and
//! nothing else left.

use super::signals::send;
use super::{Folder, Ran, bright};
use phalanx::film::output::{read_exr, read_pfm};
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const HANGUP: i32 = 1;
const INTERRUPT: i32 = 2;
const KILL: i32 = 9;
const TERMINATE: i32 = 15;

const RENDER: &str = "render --resolution 240x160 --mutations 3 --bootstrap 5000 -o a.exr -o a.png -o a.pfm --stats s.json";
const FILES: [&str; 4] = ["a.exr", "a.pfm", "a.png", "s.json"];

fn start(folder: &Folder) -> Child {
    let mut command = folder.command(RENDER);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Nothing but files of the render, each of them whole: the old one or a new one.
#[track_caller]
fn check_files(folder: &Folder, old: Option<&[u8]>, moment: &str) {
    for name in folder.files() {
        assert!(FILES.contains(&&*name), "{moment}: {name} is left");
        let path = folder.path().join(&name);
        let bytes = fs::read(&path).unwrap();
        if old == Some(&bytes) {
            continue;
        }
        match name.rsplit('.').next().unwrap() {
            "exr" => assert!(bright(&read_exr(&path).unwrap()), "{moment}"),
            "pfm" => assert!(bright(&read_pfm(&path).unwrap()), "{moment}"),
            "png" => assert!(image::load_from_memory(&bytes).is_ok(), "{moment}"),
            _ => assert!(
                serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(),
                "{moment}"
            ),
        }
    }
}

/// Moments of a render, most of them near its end, where files are written.
fn moments(whole: Duration, count: u32) -> impl Iterator<Item = Duration> {
    // Weyl's sequence.
    let part = |i: u32| (f64::from(i) * 0.618_034).fract();
    (0..count).map(move |i| whole.mul_f64(1.1 * part(i).sqrt()))
}

/// How long a render takes that nobody disturbs.
fn undisturbed() -> Duration {
    let folder = Folder::new();
    let start = Instant::now();
    folder.run(RENDER).succeeds();
    start.elapsed()
}

#[test]
fn one_signal_at_any_moment() {
    let whole = undisturbed();
    let old = b"what was there";
    for (i, delay) in moments(whole, 48).enumerate() {
        let signal = [KILL, HANGUP, INTERRUPT, TERMINATE][i % 4];
        let folder = Folder::new();
        let replaces = i / 4 % 2 == 1;
        if replaces {
            for name in FILES {
                fs::write(folder.path().join(name), old).unwrap();
            }
        }
        let child = start(&folder);
        std::thread::sleep(delay);
        send(child.id(), signal);
        let ran = Ran(child.wait_with_output().unwrap());
        let moment = format!("signal {signal} after {delay:?}");
        let status = ran.0.status;
        // Before the handlers are there, any of them kills; after the last file, none does
        // anything.
        let ended = [Some(128 + signal), Some(0)].contains(&status.code());
        assert!(
            ended || status.signal() == Some(signal),
            "{moment}: {}",
            ran.stderr()
        );
        check_files(&folder, replaces.then_some(old), &moment);
    }
}

#[test]
fn two_signals_leave_nothing_behind() {
    let whole = undisturbed();
    for (i, delay) in moments(whole, 16).enumerate() {
        let signal = [TERMINATE, INTERRUPT, HANGUP][i % 3];
        let folder = Folder::new();
        let child = start(&folder);
        std::thread::sleep(delay);
        send(child.id(), signal);
        std::thread::sleep(Duration::from_millis(2 * i as u64));
        send(child.id(), signal);
        let ran = Ran(child.wait_with_output().unwrap());
        let moment = format!("signal {signal} after {delay:?}");
        let status = ran.0.status;
        let ended = [Some(128 + signal), Some(0)].contains(&status.code());
        assert!(
            ended || status.signal() == Some(signal),
            "{moment}: {}",
            ran.stderr()
        );
        check_files(&folder, None, &moment);
    }
}

/// As `nohup` starts it.
#[test]
fn an_ignored_hangup_stays_ignored() {
    let folder = Folder::new();
    let child = Command::new("sh")
        .args([
            "-c",
            "trap '' HUP; exec \"$0\" \"$@\"",
            env!("CARGO_BIN_EXE_phalanx"),
        ])
        .args("render --resolution 32x32 --bootstrap 500 --time 1 -o a.exr".split(' '))
        .current_dir(folder.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(500));
    send(child.id(), HANGUP);
    let ran = Ran(child.wait_with_output().unwrap());
    assert_eq!(ran.code(), 0, "{}", ran.stderr());
    assert!(ran.stderr().contains("ended by --time"), "{}", ran.stderr());
}
