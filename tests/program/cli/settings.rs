//! What flags and the scene say of a render: integrator, resolution, seed, when it ends.

use super::{Folder, TINY, bright};
use std::fs;
use std::io::Write;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

#[test]
fn primary_sample_space_has_a_host() {
    let folder = Folder::new();
    let name = |flags: &str| {
        let done = folder.run(&format!("render {TINY} {flags} -o x.exr --stats x.json"));
        assert!(done.0.status.success(), "{}", done.stderr());
        let json: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(folder.path().join("x.json")).unwrap())
                .unwrap();
        assert!(bright(&folder.exr("x.exr")));
        (
            json["integrator"].as_str().unwrap().to_owned(),
            done.stderr(),
        )
    };
    assert_eq!(name("--integrator pssmlt").0, "pssmlt-bdpt");
    assert_eq!(name("--integrator pssmlt --host pt").0, "pssmlt-pt");
    assert_eq!(name("--integrator pssmlt-pt").0, "pssmlt-pt");
    for (flags, flag) in [
        (
            "--integrator pssmlt --strategy-choice learned",
            "--strategy-choice",
        ),
        ("--integrator mmlt --host pt", "--host"),
    ] {
        let (_, said) = name(flags);
        let warning = format!("warning: {flag} means nothing to this integrator");
        assert!(said.contains(&warning), "{said}");
    }
}

#[test]
fn effort_is_given_as_the_integrator_counts_it() {
    let folder = Folder::new();
    for (flags, expected) in [
        (
            "--integrator mmlt --spp 3",
            "error: --spp: the integrator mmlt takes --mutations",
        ),
        (
            "--spp 3",
            "error: --spp: the integrator auto takes --mutations; --integrator pt, lt and bdpt take --spp",
        ),
        (
            "--integrator pt --mutations 3",
            "error: --mutations: the integrator pt takes --spp",
        ),
    ] {
        let ran = folder.run(&format!("render --resolution 8x8 {flags} -o a.exr"));
        assert_eq!(ran.code(), 2, "{}", ran.stderr());
        assert_eq!(ran.stderr().trim(), expected);
    }
    // Given in both ways, it is for whichever integrator it is.
    let ran = folder.run(&format!("render {TINY} --spp 2 --integrator pt -o a.exr"));
    assert!(!ran.succeeds().stderr().contains("--mutations"));
}

#[test]
fn several_scenes_are_rendered_one_after_another() {
    let folder = Folder::new();
    for name in ["a", "b", "c"] {
        let film = match name {
            "c" => "Film \"image\" \"string filename\" \"a.exr\"\n",
            _ => "",
        };
        let world = "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\nWorldEnd\n";
        folder.write(&format!("{name}.pbrt"), &format!("{film}{world}"));
    }
    let flags = "--integrator pt --spp 1 --resolution 8x8 --no-png";
    let ran = folder.run(&format!("a.pbrt missing.pbrt c.pbrt b.pbrt {flags}"));
    assert_eq!(ran.code(), 2);
    let said = ran.stderr();
    assert!(said.contains("error: cannot open missing.pbrt"), "{said}");
    let twice = "error: c.pbrt: a.exr has just been written for another scene";
    assert!(said.contains(twice), "{said}");
    assert_eq!(
        folder.files(),
        ["a.exr", "a.pbrt", "b.exr", "b.pbrt", "c.pbrt"]
    );
    let said = folder
        .run(&format!("a.pbrt b.pbrt {flags} -o x.exr"))
        .fails(2);
    assert!(said.contains("-o: files of several scenes"), "{said}");
}

/// The program, fed a text.
fn fed(folder: &Folder, arguments: &str, text: &str) -> Output {
    let mut child = folder
        .command(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(text.as_bytes()).unwrap();
    drop(stdin);
    child.wait_with_output().unwrap()
}

#[test]
fn scenes_come_from_stdin_and_pictures_go_to_stdout() {
    let folder = Folder::new();
    let scene = "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n";
    let flags = "--integrator pt --spp 4 --resolution 8x8";
    let output = fed(&folder, &format!("render - {flags} -q -o -"), scene);
    assert!(output.status.success());
    folder.write("same.pbrt", scene);
    folder
        .run(&format!("render same.pbrt {flags} -o a.exr"))
        .succeeds();
    fs::write(folder.path().join("piped.exr"), &output.stdout).unwrap();
    assert_eq!(folder.exr("piped.exr").pixels, folder.exr("a.exr").pixels);
    let output = fed(&folder, "render - -o a.exr", "WorldBegin\nShape \"cube\"\n");
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.starts_with("error: stdin:2:1: "), "{said}");
}

#[test]
fn the_integrator_chooses_unless_told() {
    let folder = Folder::new();
    let name = |scene: &str, flags: &str| {
        let ran = folder.run(&format!("render {scene} {TINY} {flags} --stats s.json"));
        let said = ran.succeeds().stderr();
        let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        (json["integrator"].as_str().unwrap().to_owned(), said, json)
    };
    let (integrator, said, json) = name("", "");
    assert_eq!(integrator, "auto");
    assert!(
        said.lines()
            .any(|line| line.contains("; samples for depth")),
        "{said}"
    );
    assert!(json["shares"]["gain"].as_f64().unwrap() >= 1.0);
    let world = "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\nWorldEnd\n";
    for (kind, expected) in [
        ("", "auto"),
        ("mlt", "auto"),
        ("path", "pt"),
        ("bdpt", "bdpt"),
    ] {
        let directive = match kind {
            "" => String::new(),
            kind => format!("Integrator \"{kind}\"\n"),
        };
        folder.write("a.pbrt", &(directive + world));
        assert_eq!(name("a.pbrt", "--spp 2").0, expected, "{kind}");
    }
}

#[test]
fn flags_beat_the_scene_file() {
    let folder = Folder::new();
    folder.write(
        "a.pbrt",
        "Integrator \"mlt\" \"integer maxdepth\" 7 \"integer mutationsperpixel\" 1000000\n\
         Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 8\n\
         WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\nWorldEnd\n",
    );
    folder
        .run("render a.pbrt --integrator pt --spp 2 --max-depth 2 --stats s.json")
        .succeeds();
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["integrator"], "pt");
    assert_eq!(json["max_depth"], 2);
    assert_eq!(json["samples"], 2 * 16 * 8);
}

#[test]
fn resolution_and_crop() {
    let folder = Folder::with_cornell();
    let pt = "render cornell.pbrt --integrator pt --spp 1";
    folder
        .run(&format!("{pt} --resolution 40x20 -o whole.exr"))
        .succeeds();
    folder
        .run(&format!(
            "{pt} --resolution 40x20 --crop 0.26,0.5,0.25,1 -o part.exr"
        ))
        .succeeds();
    let whole = folder.exr("whole.exr");
    assert_eq!((whole.width, whole.height), (40, 20));
    let part = folder.exr("part.exr");
    assert_eq!((part.width, part.height), (9, 15));
    assert_eq!((part.offset, part.full), ([11, 5], [40, 20]));
    // A wider picture shows the same height: the walls of the box leave its sides empty.
    assert_eq!(whole.pixels[10 * 40], [0.0; 3]);
    assert!(whole.pixels[10 * 40 + 20][0] > 0.0);
}

#[test]
fn the_picture_depends_on_the_seed_alone() {
    let folder = Folder::new();
    let render = |flags: &str| {
        folder
            .run(&format!("render {TINY} -q -o a.pfm {flags}"))
            .succeeds();
        fs::read(folder.path().join("a.pfm")).unwrap()
    };
    let picture = render("--threads 2");
    assert!(picture == render("--threads 1 --lanes 1"));
    assert!(picture != render("--seed 1"));
}

#[test]
fn time_ends_a_render_and_takes_the_place_of_its_budget() {
    let folder = Folder::new();
    let start = Instant::now();
    folder
        .run("render --resolution 16x16 --bootstrap 500 --time 0.5 -o a.exr")
        .succeeds();
    let taken = start.elapsed();
    assert!(taken > Duration::from_millis(450), "{taken:?}");
    assert!(bright(&folder.exr("a.exr")));
}

#[test]
fn a_render_ends_when_it_is_accurate_enough_and_says_so() {
    for integrator in ["auto", "mmlt", "pt", "lt", "bdpt"] {
        let folder = Folder::new();
        let ran = folder
            .run(&format!(
                "render --resolution 32x32 --bootstrap 5000 --integrator {integrator} --target-error 0.3 --time 60 -o a.exr --stats s.json --error-layers"
            ))
            .succeeds();
        let text = ran.stderr();
        let last = text.lines().last().unwrap();
        assert!(last.contains("relative error "), "{last}");
        assert!(last.ends_with("; ended by --target-error"), "{last}");
        let json = fs::read_to_string(folder.path().join("s.json")).unwrap();
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        let error = json["relative_error"].as_f64().unwrap();
        assert!(error > 0.0 && error <= 0.3, "{error}");
        let image =
            exr::prelude::read_all_flat_layers_from_file(folder.path().join("a.exr")).unwrap();
        let channels = &image.layer_data[0].channel_data.list;
        let errors = channels
            .iter()
            .filter(|c| c.name.to_string().starts_with("error."));
        let errors: Vec<f32> = errors
            .flat_map(|c| c.sample_data.values_as_f32().collect::<Vec<_>>())
            .collect();
        assert_eq!(errors.len(), 3 * folder.exr("a.exr").pixels.len());
        assert!(errors.iter().all(|e| e.is_finite() && *e >= 0.0));
        assert!(errors.iter().any(|e| *e > 0.0));
    }
}

#[test]
fn errors_need_not_be_estimated() {
    let folder = Folder::new();
    let ran = folder
        .run(&format!(
            "render {TINY} --no-estimate -o a.pfm --stats s.json"
        ))
        .succeeds();
    assert!(!ran.stderr().contains("relative error"), "{}", ran.stderr());
    let json = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(json["relmse"].is_null() && json["tiles"].is_null());
    folder.run(&format!("render {TINY} -o b.pfm")).succeeds();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert_eq!(
        read("a.pfm"),
        read("b.pfm"),
        "the estimate changes the picture"
    );
    let message = folder
        .run("render --no-estimate --target-error 0.1")
        .fails(2);
    assert!(message.contains("cannot be used with"), "{message}");
}

#[test]
fn threads_without_work_are_not_started() {
    let folder = Folder::new();
    let start = Instant::now();
    folder
        .run(&format!(
            "render {TINY} --threads 1024 -o a.pfm --stats s.json"
        ))
        .succeeds();
    let taken = start.elapsed();
    assert!(taken < Duration::from_secs(10), "{taken:?}");
    folder.run(&format!("render {TINY} -o b.pfm")).succeeds();
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("a.pfm") == read("b.pfm"));
    let json: serde_json::Value = serde_json::from_slice(&read("s.json")).unwrap();
    let cores = std::thread::available_parallelism().unwrap().get() as u64;
    assert_eq!(json["threads"], 1024.min(64.max(2 * cores)));
}
