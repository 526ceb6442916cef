//! The program as a user meets it: files, messages and exit codes. Every test runs the real binary
//! in a folder of its own.

mod display;
#[cfg(unix)]
mod growing;
mod inspect;
#[cfg(unix)]
mod kept;
#[cfg(unix)]
mod kills;
mod pictures;
#[cfg(unix)]
mod preview;
mod settings;
#[cfg(unix)]
mod signals;
mod written;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use phalanx::film::output::read_exr;
use phalanx::formats::Picture;
use tempfile::TempDir;

/// A program that is running; it ends with the test that started it.
struct Running(Option<Child>);

impl Running {
    fn start(mut command: Command) -> Self {
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().unwrap()))
    }

    fn id(&self) -> u32 {
        self.0.as_ref().unwrap().id()
    }

    /// Ends it at once.
    fn kill(mut self) {
        let mut child = self.0.take().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// What it has come to.
    fn end(mut self) -> Ran {
        Ran(self.0.take().unwrap().wait_with_output().unwrap())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
        }
    }
}

/// A budget of a fraction of a second.
const TINY: &str = "--resolution 32x32 --mutations 2 --bootstrap 500 --chains 64";

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// One that holds the Cornell box.
    fn with_cornell() -> Self {
        let folder = Self::new();
        folder.write("cornell.pbrt", include_str!("../../scenes/cornell.pbrt"));
        folder
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
