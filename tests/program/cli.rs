//! The program as a user meets it: files, messages and exit codes. Every test runs the real binary
//! in a folder of its own.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use phalanx::film::output::{read_exr, read_pfm};
use phalanx::formats::Picture;
use tempfile::TempDir;

#[path = "cli/display.rs"]
mod display;
#[cfg(unix)]
#[path = "cli/kills.rs"]
mod kills;
#[path = "cli/written.rs"]
mod written;

/// A budget of a fraction of a second.
const TINY: &str = "--resolution 32x32 --mutations 2 --bootstrap 500 --chains 64";

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_phalanx"));
        command
            .args(arguments.split_whitespace())
            .current_dir(self.path())
            .env_remove("NO_COLOR")
            .stdin(Stdio::null());
        command
    }

    fn run(&self, arguments: &str) -> Ran {
        Ran(self.command(arguments).output().unwrap())
    }

    /// Files in the folder, sorted.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).unwrap();
    }

    fn exr(&self, name: &str) -> Picture {
        read_exr(&self.path().join(name)).unwrap()
    }
}

struct Ran(Output);

impl Ran {
    fn code(&self) -> i32 {
        self.0.status.code().unwrap()
    }

    fn stderr(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).unwrap()
    }

    fn stdout(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).unwrap()
    }

    #[track_caller]
    fn succeeds(self) -> Self {
        assert_eq!(self.code(), 0, "{}", self.stderr());
        self
    }

    /// Ends with this code and exactly one line that begins `error: `, which it returns.
    #[track_caller]
    fn fails(self, code: i32) -> String {
        let stderr = self.stderr();
        assert_eq!(self.code(), code, "{stderr}");
        let errors: Vec<&str> = stderr
            .lines()
            .filter(|l| l.starts_with("error: "))
            .collect();
        assert_eq!(errors.len(), 1, "{stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
        errors[0].to_owned()
    }
}

fn bright(picture: &Picture) -> bool {
    let sum: f32 = picture.pixels.iter().flatten().sum();
    sum > 0.0 && picture.pixels.iter().flatten().all(|v| v.is_finite())
}

#[test]
fn without_arguments_the_built_in_scene_becomes_two_files() {
    let folder = Folder::new();
    let ran = folder.run(&format!("render {TINY}")).succeeds();
    assert_eq!(folder.files(), ["cornell.exr", "cornell.png"]);
    let picture = folder.exr("cornell.exr");
    assert_eq!((picture.width, picture.height), (32, 32));
    assert!(bright(&picture));
    let png = image::open(folder.path().join("cornell.png")).unwrap();
    assert_eq!((png.width(), png.height()), (32, 32));
    assert_eq!(ran.stdout(), "");
    assert!(ran.stderr().contains("wrote cornell.png"));
}

#[test]
fn every_format_and_folder() {
    let folder = Folder::new();
    fs::create_dir(folder.path().join("sub")).unwrap();
    folder
        .run(&format!(
            "render {TINY} -o sub/a.exr --output b.PFM -o c.png -o c.png"
        ))
        .succeeds();
    assert_eq!(folder.files(), ["b.PFM", "c.png", "sub"]);
    let exr = folder.exr("sub/a.exr");
    let pfm = read_pfm(&folder.path().join("b.PFM")).unwrap();
    assert_eq!(exr.pixels, pfm.pixels);
}

#[test]
fn the_scene_names_its_picture() {
    let folder = Folder::new();
    let film =
        |name: &str| format!("Film \"image\" {name}\nWorldBegin\nShape \"sphere\"\nWorldEnd\n");
    let cases = [
        (
            "a.pbrt",
            "\"string filename\" \"/some/where/x.pfm\"",
            "x.pfm",
        ),
        ("b.pbrt", "\"string filename\" \"y.tga\"", "y.exr"),
        ("d.pbrt", "\"string filename\" \"z\"", "z.exr"),
        ("c.pbrt", "", "c.exr"),
    ];
    for (scene, name, picture) in cases {
        folder.write(scene, &film(name));
        let ran = folder
            .run(&format!("render {scene} {TINY} --quiet"))
            .succeeds();
        assert!(folder.files().contains(&picture.to_string()), "{picture}");
        let instead =
            format!("only .exr, .pfm and .png are written here: writing {picture} instead");
        let other = name.contains("y.tga") || name.contains("\"z\"");
        assert_eq!(ran.stderr().contains(&instead), other, "{}", ran.stderr());
    }
}

#[test]
fn figures_are_a_json_object() {
    let folder = Folder::new();
    folder
        .run(&format!(
            "render {TINY} --integrator mmlt --stats s.json --seed 18446744073709551615 --threads 2 --max-depth 3 --mutations 200"
        ))
        .succeeds();
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let json = json.as_object().unwrap();
    let names = "seed lanes threads width height max_depth mutations mutations_per_second rays rays_per_second \
        load_seconds bootstrap_seconds render_seconds total_seconds acceptance_large acceptance_small b b_stderr \
        rejected_nonfinite peak_rss_bytes relmse relative_error stuck_chains";
    for name in names.split_whitespace() {
        assert!(json[name].is_number(), "{name}: {}", json[name]);
    }
    let depths = json["depths"].as_array().unwrap();
    let b: f64 = depths.iter().map(|d| d["b"].as_f64().unwrap()).sum();
    assert!((b / json["b"].as_f64().unwrap() - 1.0).abs() < 1e-9);
    for name in ["b_stderr", "share", "chains", "mutations"] {
        assert!(depths[0][name].is_number(), "{name}");
    }
    let strategies = depths[1]["strategies"].as_array().unwrap();
    for name in ["s", "t", "share", "acceptance_small", "acceptance_large"] {
        assert!(strategies[0][name].is_number(), "{name}");
    }
    let tiles = &json["tiles"];
    assert_eq!((&tiles["columns"], &tiles["rows"]), (&2.into(), &2.into()));
    let numbers = |name: &str| -> Vec<f64> {
        let list = tiles[name].as_array().unwrap();
        list.iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let mean = numbers("mean").iter().sum::<f64>() / 4.0;
    assert!((mean / b - 1.0).abs() < 1e-6, "{mean} {b}");
    assert!(numbers("stderr").iter().all(|e| *e > 0.0 && *e < b));
    assert_eq!(json["integrator"], "mmlt");
    assert_eq!(json["seed"], u64::MAX);
    assert_eq!(
        (json["threads"].as_u64(), json["lanes"].as_u64()),
        (Some(2), Some(8))
    );
    assert_eq!(json["max_depth"], 3);
    assert!(json["mutations"].as_u64().unwrap() >= 2 * 32 * 32);
    let seconds = |name: &str| json[name].as_f64().unwrap();
    let parts = ["load_seconds", "bootstrap_seconds", "render_seconds"].map(seconds);
    assert!(parts.iter().sum::<f64>() <= seconds("total_seconds"));
    // `/dev/stdout` is written into, not replaced.
    let ran = folder
        .run(&format!("render {TINY} -q --stats /dev/stdout"))
        .succeeds();
    assert!(serde_json::from_str::<serde_json::Value>(&ran.stdout()).is_ok());
}

#[test]
fn strategies_are_written_beside_the_picture() {
    let folder = Folder::new();
    let small = "--resolution 16x16 --max-depth 2";
    let ran = folder
        .run(&format!(
            "render {small} --integrator bdpt --spp 2 --strategies -o a.exr -o b.png"
        ))
        .succeeds();
    let said = ran.stderr();
    assert!(said.contains("wrote a.s0.t2.weighted.exr"), "{said}");
    let mut expected = vec!["a.exr".to_string(), "b.png".into()];
    for (s, t) in [
        (0, 2),
        (0, 3),
        (1, 2),
        (2, 1),
        (0, 4),
        (1, 3),
        (2, 2),
        (3, 1),
    ] {
        for kind in ["weighted", "unweighted"] {
            expected.push(format!("a.s{s}.t{t}.{kind}.exr"));
            expected.push(format!("b.s{s}.t{t}.{kind}.png"));
        }
    }
    expected.sort();
    assert_eq!(folder.files(), expected);
    let whole = folder.exr("a.exr");
    let mut sum = vec![[0.0f32; 3]; whole.pixels.len()];
    for file in expected.iter().filter(|f| f.contains(".weighted.exr")) {
        let part = folder.exr(file);
        assert_eq!((part.full, part.offset), (whole.full, whole.offset));
        let values = sum.as_flattened_mut().iter_mut();
        (values.zip(part.pixels.as_flattened())).for_each(|(sum, v)| *sum += v);
    }
    for (a, b) in (sum.as_flattened().iter()).zip(whole.pixels.as_flattened()) {
        assert!((a - b).abs() <= 2e-6 * b, "{a} {b}");
    }
    let many = "render --integrator bdpt --strategies --max-depth 21 -o c.exr";
    assert!(folder.run(many).fails(2).contains("at most 20"));
    for integrator in ["pt", "lt"] {
        let ran = folder
            .run(&format!(
                "render {small} --integrator {integrator} --spp 1 --strategies -o c.exr"
            ))
            .succeeds();
        let said = ran.stderr();
        assert!(said.contains("--strategies means nothing"), "{said}");
    }
}

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
    let (_, said) = name("--integrator pssmlt --spp 3 --strategy-choice learned");
    for flag in ["--spp", "--strategy-choice"] {
        let warning = format!("warning: {flag} means nothing to this integrator");
        assert!(said.contains(&warning), "{said}");
    }
    let (_, said) = name("--integrator mmlt --host pt");
    assert!(
        said.contains("warning: --host means nothing to this integrator"),
        "{said}"
    );
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
        said.lines().last().unwrap().contains("; samples for depth"),
        "{said}"
    );
    assert!(json["shares"]["gain"].as_f64().unwrap() >= 1.0);
    let (_, said, _) = name("", "--spp 3");
    assert!(
        said.contains("warning: --spp means nothing to this integrator"),
        "{said}"
    );
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
        assert_eq!(name("a.pbrt", "").0, expected, "{kind}");
    }
}

#[test]
fn exr_files_carry_settings_and_figures() {
    use exr::prelude::AttributeValue;
    let folder = Folder::new();
    folder
        .run(&format!(
            "render {TINY} --integrator mmlt --seed 7 -o a.exr --sigma 0.02"
        ))
        .succeeds();
    let meta = exr::meta::MetaData::read_from_file(folder.path().join("a.exr"), true).unwrap();
    let all = &meta.headers[0].own_attributes.other;
    let get = |name: &str| all.iter().find(|(n, _)| **n == *name).map(|(_, v)| v);
    assert_eq!(get("seed"), Some(&AttributeValue::I32(7)));
    assert!(matches!(get("b"), Some(AttributeValue::F64(b)) if *b > 0.0));
    assert!(matches!(get("sigma"), Some(AttributeValue::F64(s)) if (*s - 0.02).abs() < 1e-6));
    assert!(matches!(get("mutations"), Some(AttributeValue::I32(n)) if *n >= 2048));
    assert!(get("scene").is_some() && get("renderer").is_some());
}

/// However they were made.
#[test]
fn equal_renders_are_equal_files() {
    let folder = Folder::new();
    for integrator in ["auto", "mmlt", "bdpt"] {
        let files = ["--threads 1 --lanes 1", "--threads 2 --lanes 8"].map(|how| {
            let flags = format!("--integrator {integrator} --error-layers -o a.exr -o a.png");
            folder
                .run(&format!("render {TINY} {flags} {how}"))
                .succeeds();
            ["a.exr", "a.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap())
        });
        assert!(files[0] == files[1], "{integrator}");
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
    let folder = Folder::new();
    let pt = "render --integrator pt --spp 1";
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
fn quiet_says_nothing() {
    let folder = Folder::new();
    let ran = folder.run(&format!("render {TINY} --quiet")).succeeds();
    assert_eq!((ran.stdout(), ran.stderr()), (String::new(), String::new()));
    assert_eq!(folder.files().len(), 2);
    folder.run("render -q missing.pbrt").fails(2);
}

#[test]
fn bad_flags_are_named() {
    let folder = Folder::new();
    let cases = "--lanes=4 --threads=-1 --threads=100000 --seed=-1 --mutations=0 --mutations=1e6 --spp=0 --time=0 --time=nan \
        --time=-3 --target-error=0 --target-error=nan --target-error=-1 --max-depth=4096 --max-depth=-1 --chains=0 --chains=99999999999 --bootstrap=0 --large-step=1.5 \
        --large-step=nan --large-step=-0.1 --sigma=inf --sigma=-1 --sigma=nan --resolution=0x10 --resolution=10 \
        --resolution=100000x100000 --crop=0,1,0 --crop=0.5,0.5,0,1 --crop=0,nan,0,1 --crop=-1,1,0,1 --exposure=inf \
        --integrator=sppm --strategy-choice=random --mutation=levy --sigma=automatic --large-step=Auto --color=red";
    for flag in cases.split_whitespace() {
        let message = folder.run(&format!("render {flag} {TINY}")).fails(2);
        let name = flag.split('=').next().unwrap();
        assert!(message.contains(name), "{flag}: {message}");
    }
    for pair in ["--sigma -1", "--seed -1", "--large-step -0.5"] {
        let message = folder.run(&format!("render {pair}")).fails(2);
        assert!(
            message.contains(pair.split(' ').next().unwrap()),
            "{message}"
        );
    }
    let message = folder.run("render --no-such-flag").fails(2);
    assert!(message.contains("--no-such-flag"));
    folder.run("dance").fails(2);
    assert_eq!(folder.run("").code(), 2);
    assert!(folder.files().is_empty());
}

#[test]
fn big_but_sensible_values_are_taken() {
    let folder = Folder::new();
    folder.run("inspect --max-depth 100").succeeds();
    // Fails for the folder, after every flag has been accepted.
    let message = folder
        .run("render --bootstrap 100000000 --mutations 1000000000000 --chains 1000000 -o missing/a.exr")
        .fails(2);
    assert!(message.contains("missing/a.exr"), "{message}");
}

#[test]
fn outputs_are_checked_before_the_render() {
    let folder = Folder::new();
    folder.write("file", "");
    fs::create_dir(folder.path().join("folder.exr")).unwrap();
    let cases = [
        "-o a.jpg",
        "-o a",
        "-o missing/a.exr",
        "-o file/a.exr",
        "-o folder.exr",
        "-o a.exr -o missing/b.png",
        "--stats missing/s.json",
        "--stats folder.exr",
    ];
    for case in cases {
        let start = Instant::now();
        let message = folder
            .run(&format!("render --mutations 1000000 {case}"))
            .fails(2);
        assert!(start.elapsed() < Duration::from_secs(5), "{case}");
        let path = case.rsplit(' ').next().unwrap();
        assert!(message.contains(path), "{case}: {message}");
    }
    assert_eq!(folder.files(), ["file", "folder.exr"]);
}

#[test]
fn scenes_that_cannot_be_used_are_named_with_line_and_column() {
    let folder = Folder::new();
    let message = folder.run("render missing.pbrt").fails(2);
    assert!(message.contains("missing.pbrt"), "{message}");

    folder.write(
        "a.pbrt",
        "Film \"rgb\" WorldBegin\nShape \"sphere\"\n  Shape \"dodecahedron\"\n",
    );
    for command in ["render", "inspect"] {
        let message = folder.run(&format!("{command} a.pbrt")).fails(2);
        assert!(message.starts_with("error: a.pbrt:3:3: Shape"), "{message}");
    }
    folder.write(
        "b.pbrt",
        "WorldBegin\nShape \"sphere\" \"float radius\" [ 1\n",
    );
    let message = folder.run("render b.pbrt").fails(2);
    assert!(message.starts_with("error: b.pbrt:"), "{message}");
    folder.write("c.pbrt", "\u{0}\u{1}\u{2}");
    folder.run("render c.pbrt").fails(2);
    folder.run("render .").fails(2);
    assert_eq!(folder.files(), ["a.pbrt", "b.pbrt", "c.pbrt"]);
}

#[test]
fn settings_of_the_scene_are_checked() {
    let folder = Folder::new();
    folder.write(
        "a.pbrt",
        "Integrator \"mlt\" \"integer maxdepth\" 60000\nWorldBegin\nShape \"sphere\"\nWorldEnd\n",
    );
    for command in ["render", "inspect"] {
        let message = folder.run(&format!("{command} a.pbrt")).fails(2);
        assert!(message.contains("depth"), "{message}");
    }
}

#[test]
fn warnings_of_the_scene_reach_stderr() {
    let folder = Folder::new();
    folder.write(
        "a.pbrt",
        "WorldBegin\nShape \"sphere\" \"float size\" 2\nWorldEnd\n",
    );
    let ran = folder.run(&format!("render a.pbrt -q {TINY}")).succeeds();
    let stderr = ran.stderr();
    assert!(stderr.contains("warning: a.pbrt:2:"), "{stderr}");
}

#[test]
fn a_dark_scene_is_a_black_picture_and_a_warning() {
    let folder = Folder::new();
    folder.write("a.pbrt", "WorldBegin\nShape \"sphere\"\nWorldEnd\n");
    let ran = folder.run(&format!("render a.pbrt {TINY}")).succeeds();
    assert!(ran.stderr().contains("warning: the scene has no lights"));
    let picture = folder.exr("a.exr");
    assert!(picture.pixels.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn inspect_prints_the_scene_and_the_plan() {
    let folder = Folder::new();
    let text = folder.run("inspect").succeeds().stdout();
    for part in [
        "triangles     24",
        "spheres       1",
        "lights        2 (2 triangle)",
        "1 smooth dielectric",
        "400 x 400",
        "looking along (0.0000, 0.0000, -1.0000)",
        "bounds        (-1.0000, 0.0000, -1.0000) to (1.0000, 2.0000, 1.0000)",
        "strategies",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    assert!(folder.files().is_empty());
}

#[test]
fn help_and_version_go_to_stdout() {
    let folder = Folder::new();
    let short = folder.run("render -h").succeeds().stdout();
    let long = folder.run("render --help").succeeds().stdout();
    assert!(short.len() < long.len());
    for flag in [
        "-o",
        "--integrator",
        "--mutations",
        "--spp",
        "--time",
        "--seed",
        "--threads",
        "--lanes",
        "--max-depth",
        "--chains",
        "--bootstrap",
        "--large-step",
        "--strategy-choice",
        "--mutation",
        "--sigma",
        "--resolution",
        "--crop",
        "--quiet",
        "--stats",
        "--exposure",
        "--color",
    ] {
        assert!(short.contains(flag) && long.contains(flag), "{flag}");
    }
    let version = folder.run("--version").succeeds().stdout();
    assert_eq!(
        version,
        concat!("phalanx ", env!("CARGO_PKG_VERSION"), "\n")
    );
}

#[test]
fn colour_is_for_terminals_unless_asked_for() {
    let folder = Folder::new();
    let escape = |flags: &str| {
        let ran = folder.run(&format!("render missing.pbrt {flags}"));
        ran.stderr().contains('\u{1b}')
    };
    assert!(!escape(""));
    assert!(!escape("--color never"));
    assert!(escape("--color always"));
    assert!(escape("--color=always --lanes 4"));
}

#[test]
fn a_reader_that_leaves_is_no_panic() {
    let folder = Folder::new();
    for arguments in ["inspect", "--help", "render missing.pbrt"] {
        let mut child = folder
            .command(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        drop(child.stderr.take());
        let code = child.wait().unwrap().code().unwrap();
        assert!([0, 2].contains(&code), "{arguments}: {code}");
    }
}

#[cfg(unix)]
mod signals {
    use super::*;

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
}

#[test]
fn inspect_speaks_json() {
    let folder = Folder::new();
    let text = folder
        .run("inspect --json --max-depth 3")
        .succeeds()
        .stdout();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["triangles"], 24);
    assert_eq!(json["camera"]["projection"], "perspective");
    let plan = &json["plan"];
    let depths = plan["depths"].as_array().unwrap();
    assert_eq!(depths.len(), 4);
    for (depth, entry) in depths.iter().enumerate() {
        let parts = entry["parts"].as_array().unwrap();
        let last = parts.last().unwrap()["end"].as_u64();
        assert_eq!(entry["primary_samples"].as_u64(), last);
        let strategies = entry["strategies"].as_array().unwrap().len();
        assert_eq!(strategies, if depth == 0 { 1 } else { depth + 2 });
    }
    let glass = plan["effects"].as_array().unwrap().iter();
    let glass: Vec<_> = glass
        .filter(|e| e["effect"] == "smooth dielectric")
        .collect();
    let reason = glass[0]["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("material \"glass\", cornell.pbrt:"),
        "{reason}"
    );

    // Text and JSON are of the same plan.
    let forced = folder
        .run("inspect --force-effects all")
        .succeeds()
        .stdout();
    assert!(forced.contains("rough dielectric") && forced.contains("forced"));
    let ran = folder.run("inspect --force-effects lenses");
    assert!(ran.stderr().contains("light-choice"), "{}", ran.stderr());
}

/// Names in messages end where a line does, and hold nothing that a terminal would obey.
#[test]
fn long_names_are_shortened_in_messages() {
    let folder = Folder::new();
    let long = "x".repeat(3000);
    let world = |text: String| format!("Film \"rgb\"\nWorldBegin\n{text}\nShape \"sphere\"\n");
    folder.write("a.pbrt", &world(format!("Shape \"{long}\"")));
    folder.write(
        "b.pbrt",
        &world(format!(
            "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{long}.png\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\""
        )),
    );
    folder.write("c.pbrt", &world(format!("{long} 1 2 3")));
    folder.write("d.pbrt", &world("Shape \"a\u{1b}[2Jb\"".into()));
    let spaced = "a ".repeat(2000);
    folder.write(
        "e.pbrt",
        &world(format!("Material \"diffuse\" \"float {spaced}\" 1")),
    );
    for arguments in [
        "render a.pbrt".to_string(),
        "render b.pbrt".into(),
        "render c.pbrt".into(),
        "render d.pbrt".into(),
        "render e.pbrt --lanes 3".into(),
        format!("inspect {long}.pbrt"),
        format!("render --integrator {long}"),
        format!("render -o {long}.exr"),
        format!("render -o {long}/a.exr"),
        format!("compare {long}.exr {long}.png"),
        format!("replay --depth 1 --samples {long}"),
        format!("{long} --{long}"),
    ] {
        let ran = folder.run(&arguments);
        let stderr = ran.stderr();
        assert_eq!(ran.code(), 2, "{stderr}");
        assert!(stderr.lines().all(|l| l.chars().count() <= 700), "{stderr}");
        assert!(!stderr.contains("xxx".repeat(50).as_str()), "{stderr}");
        assert!(!stderr.contains('\u{1b}'), "{stderr}");
    }
    let warned = folder.run(&format!("render e.pbrt {TINY}")).succeeds();
    assert!(
        warned.stderr().lines().all(|l| l.chars().count() <= 700),
        "{}",
        warned.stderr()
    );
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
