//! Signals: a render that is asked to end.

use super::{Folder, Ran, bright};
use phalanx::formats::Picture;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Sends `signal` after `delay` and returns how the render ended.
fn interrupted(folder: &Folder, signal: i32, delay: Duration) -> Ran {
    let child = folder
        .command("render --resolution 64x64 --mutations 100000000 --bootstrap 2000 -o a.exr -o a.png --stats s.json")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(delay);
    send(child.id(), signal);
    Ran(child.wait_with_output().unwrap())
}

pub fn send(process: u32, signal: i32) {
    let kill = Command::new("kill")
        .args([format!("-{signal}"), process.to_string()])
        .status();
    assert!(kill.unwrap().success());
}

#[test]
fn the_first_one_writes_the_picture_so_far() {
    let whole = Folder::new();
    whole
        .run("render --resolution 64x64 --mutations 50 --bootstrap 2000 -o a.exr")
        .succeeds();
    let mean = |p: &Picture| p.pixels.iter().flatten().sum::<f32>() / (3.0 * 64.0 * 64.0);
    let expected = mean(&whole.exr("a.exr"));
    for (signal, code) in [(1, 129), (2, 130), (15, 143)] {
        let folder = Folder::new();
        let ran = interrupted(&folder, signal, Duration::from_millis(1500));
        assert_eq!(ran.code(), code, "{}", ran.stderr());
        let picture = folder.exr("a.exr");
        // The normalisation is that of a render of any length; b differs by its error, here
        // some per cent.
        let ratio = mean(&picture) / expected;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
        assert_eq!(folder.files(), ["a.exr", "a.png", "s.json"]);
    }
}

/// However long the bootstrap would have gone on, what has been made of it shows the whole
/// scene.
#[test]
fn during_the_bootstrap_a_noisy_picture_is_written() {
    let folder = Folder::new();
    let child = folder
        .command("render --integrator mmlt --resolution 64x64 --bootstrap 200000000 --mutations 1000000 -o a.exr --stats s.json")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(700));
    send(child.id(), 2);
    let start = Instant::now();
    let ran = Ran(child.wait_with_output().unwrap());
    assert_eq!(ran.code(), 130);
    assert!(start.elapsed() < Duration::from_secs(5));
    let stderr = ran.stderr();
    assert!(
        stderr.contains("stopped the bootstrap after 0."),
        "{stderr}"
    );
    assert!(bright(&folder.exr("a.exr")));
    assert_eq!(folder.files(), ["a.exr", "a.png", "s.json"]);
}

#[test]
fn the_second_one_quits_at_once() {
    let folder = Folder::new();
    let mut child = folder
        .command("render -q --bootstrap 200000000")
        .spawn()
        .unwrap();
    // The first one leaves the chains a quarter of a second.
    for delay in [500, 50] {
        std::thread::sleep(Duration::from_millis(delay));
        send(child.id(), 15);
    }
    assert_eq!(child.wait().unwrap().code(), Some(143));
    assert!(folder.files().is_empty());
}

#[test]
fn at_any_moment_there_are_whole_files_or_none() {
    // Weyl's sequence: spread over start, bootstrap, render and writing.
    for i in 0..16u32 {
        let delay = Duration::from_secs_f64(1.2 * (f64::from(i) * 0.618_034).fract().powi(2));
        let (signal, code) = [(2, 130), (15, 143)][i as usize % 2];
        let integrator = ["mmlt", "pt"][i as usize / 2 % 2];
        let folder = Folder::new();
        let child = folder
            .command(&format!(
                "render --resolution 300x200 --integrator {integrator} -o a.exr -o a.png --stats s.json"
            ))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(delay);
        send(child.id(), signal);
        let ran = Ran(child.wait_with_output().unwrap());
        // A signal before the handlers are there ends the process, and one after the last file
        // nothing.
        let ended = ran.0.status.code();
        assert!(
            ended == Some(code) || ended.is_none() || ended == Some(0),
            "{}",
            ran.stderr()
        );
        let files = folder.files();
        if files.is_empty() {
            continue;
        }
        assert_eq!(files, ["a.exr", "a.png", "s.json"], "{delay:?}");
        let picture = folder.exr("a.exr");
        assert_eq!(picture.pixels.len(), 300 * 200);
        assert!(bright(&picture), "{delay:?}");
        let stats = std::fs::read(folder.path().join("s.json")).unwrap();
        assert!(serde_json::from_slice::<serde_json::Value>(&stats).is_ok());
    }
}

/// A render that is killed outright leaves its last picture.
#[test]
fn pictures_are_written_while_the_render_goes_on() {
    for integrator in ["mmlt --mutations 100000000", "pt --spp 100000000"] {
        let folder = Folder::new();
        let mut child = folder
            .command(&format!(
                "render --resolution 32x32 --bootstrap 500 --integrator {integrator} --output-every 0.1 -q -o a.exr -o a.png"
            ))
            .spawn()
            .unwrap();
        let deadline = Instant::now() + Duration::from_secs(60);
        let both = || folder.files() == ["a.exr", "a.png"];
        while !both() {
            assert!(Instant::now() < deadline, "{:?}", folder.files());
            std::thread::sleep(Duration::from_millis(20));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(bright(&folder.exr("a.exr")), "{integrator}");
    }
}
