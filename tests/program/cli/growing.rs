//! Picture files that are written while the render goes on.

use super::signals::send;
use super::{Folder, Running, bright};
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

fn start(folder: &Folder, arguments: &str) -> Running {
    Running::start(folder.command(arguments))
}

#[track_caller]
pub fn wait_until(what: &str, mut is_true: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_true() {
        assert!(start.elapsed() < Duration::from_secs(60), "never {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Whether a whole picture is there, with errors that are not all 0.
fn has_errors(path: &Path) -> bool {
    if !path.exists() {
        return false;
    }
    let image = exr::prelude::read_all_flat_layers_from_file(path).unwrap();
    let channels = &image.layer_data[0].channel_data.list;
    let red = channels.iter().find(|c| c.name.eq("error.R"));
    red.is_some_and(|red| red.sample_data.values_as_f32().any(|v| v > 0.0))
}

/// Every integrator's; whoever reads them meanwhile finds whole ones.
#[test]
fn pictures_have_all_layers_from_the_first_on() {
    let picture = "--resolution 64x48 --bootstrap 2000 --chains 512";
    let every = "--output-every 100ms --error-layers -q -o a.exr -o b.pfm -o c.exr";
    for effort in [
        "mmlt --mutations 100000000",
        "auto --mutations 100000000",
        "pt --spp 100000000",
        "bdpt --spp 100000000",
    ] {
        let folder = Folder::new();
        let flags = format!("render {picture} --integrator {effort} {every}");
        let child = start(&folder, &format!("{flags} --checkpoint kept --every 200ms"));
        let at = |name: &str| folder.path().join(name);
        wait_until("errors", || has_errors(&at("a.exr")));
        wait_until("another file", || at("c.exr").exists());
        let early = fs::read(at("c.exr")).unwrap();
        wait_until("a next picture", || {
            assert!(has_errors(&at("a.exr")));
            fs::read(at("c.exr")).unwrap() != early
        });
        wait_until("a checkpoint", || at("kept").exists());
        child.kill();
        assert_eq!(
            folder.files(),
            ["a.exr", "a.png", "b.pfm", "c.exr", "c.png", "kept"],
            "{effort}"
        );
        assert!(bright(&folder.exr("a.exr")), "{effort}");
        let info = folder.run("info a.exr").succeeds().stdout();
        assert!(info.contains("studio.pbrt"), "{info}");

        folder.files().iter().for_each(|name| match name.as_str() {
            "kept" => {}
            name => fs::remove_file(at(name)).unwrap(),
        });
        let child = start(&folder, &format!("resume kept --every 1h {every}"));
        wait_until("errors after resuming", || has_errors(&at("c.exr")));
        child.kill();
    }
}

/// A folder that goes away and comes back: a warning, and no harm.
#[test]
fn what_cannot_be_written_now_is_written_later() {
    let folder = Folder::new();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("out")).unwrap();
    let child = start(
        &folder,
        "render --resolution 32x32 --integrator pt --spp 100000000 --output-every 50ms -o out/a.exr -o b.exr",
    );
    wait_until("a picture", || at("out/a.exr").exists());
    wait_until("another file", || at("b.exr").exists());
    fs::rename(at("out"), at("away")).unwrap();
    let early = fs::read(at("b.exr")).unwrap();
    wait_until("another picture", || {
        fs::read(at("b.exr")).unwrap() != early
    });
    std::thread::sleep(Duration::from_millis(700));
    fs::rename(at("away"), at("out")).unwrap();
    send(child.id(), 2);
    let ran = child.end();
    let stderr = ran.stderr();
    assert_eq!(ran.code(), 130, "{stderr}");
    assert_eq!(stderr.matches("the render goes on").count(), 1, "{stderr}");
    assert!(
        stderr.contains("warning: --output-every: out/a."),
        "{stderr}"
    );
    assert!(bright(&folder.exr("out/a.exr")));
}
