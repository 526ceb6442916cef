//! Mutations of whole scenes and of flags, given to the program itself:
//!
//!     PHALANX_FUZZ_SECONDS=600 PHALANX_FUZZ_SEED=1 cargo test --release --test renderer
//! fuzz_seeds:: -- --ignored --nocapture binary
//!
//! A run must end in time with code 0, 1 or 2, and say something if that is not 0. What fails is
//! kept in `target/fuzz-binary`, a scene and a command line each.

use std::collections::hash_map::DefaultHasher;
use std::fs;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A run that takes longer hangs.
const HANG: Duration = Duration::from_secs(60);

/// Scenes that no file has.
const SMALL: [&str; 6] = [
    "WorldBegin LightSource \"infinite\" Shape \"sphere\"",
    "Camera \"spherical\" Film \"rgb\" WorldBegin LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [0 2 0] \
     Shape \"disk\" Shape \"bilinearmesh\" \"point3 P\" [0 0 1 1 0 1 0 1 1 1 1 2] \"float alpha\" 0.5",
    "Camera \"orthographic\" \"float lensradius\" 0.1 WorldBegin AttributeBegin AreaLightSource \"diffuse\" \"float power\" 3 \
     Shape \"sphere\" AttributeEnd Material \"coateddiffuse\" \"float roughness\" 0.1 Translate 0 0 3 \
     Shape \"loopsubdiv\" \"integer levels\" 2 \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2 0 3 1 1 3 2 2 3 0]",
    "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 60 WorldBegin LightSource \"distant\" \"point from\" [1 1 1] \
     LightSource \"spot\" \"point from\" [0 0 4] \"point to\" [0 0 0] \"float coneangle\" 20 Material \"glass\" \"float index\" 1.5 \
     Shape \"trianglemesh\" \"point P\" [-1 -1 0 1 -1 0 0 1 0] \"integer indices\" [0 1 2] \"float uv\" [0 0 1 0 0 1] WorldEnd",
    "WorldBegin Texture \"a\" \"float\" \"fbm\" Texture \"b\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"c\" \
     MakeNamedMaterial \"m\" \"string type\" \"conductor\" \"texture roughness\" \"a\" NamedMaterial \"m\" ObjectBegin \"o\" \
     Shape \"sphere\" ObjectEnd ObjectInstance \"o\" Scale 2 1 -1 ObjectInstance \"o\" LightSource \"infinite\" \"blackbody L\" 5000",
    "Film \"image\" \"float cropwindow\" [0.1 0.9 0 1] Sampler \"halton\" \"integer pixelsamples\" 1 Integrator \"bdpt\" \
     \"integer maxdepth\" 3 WorldBegin AreaLightSource \"area\" \"rgb L\" [1 2 3] Material \"uber\" \"rgb opacity\" [.5 .5 .5] \
     Shape \"sphere\" \"float radius\" 2 ReverseOrientation Shape \"disk\" \"float height\" -1 WorldEnd",
];

const NUMBERS: [&str; 22] = [
    "0",
    "-0",
    "1",
    "-1",
    "0.5",
    "1e38",
    "-1e38",
    "1e-38",
    "1e-45",
    "3.5e38",
    "1e300",
    "1e-300",
    "1e400",
    "nan",
    "inf",
    "2147483647",
    "2147483648",
    "-2147483649",
    "4294967296",
    "1e19",
    "0.99999999",
    "180",
];

/// Each with values that mean something, and some that do not.
const FLAGS: [(&str, &[&str]); 22] = [
    (
        "--integrator",
        &["mmlt", "pt", "lt", "bdpt", "pssmlt-bdpt", "pssmlt-pt", "x"],
    ),
    (
        "--max-depth",
        &["0", "1", "3", "20", "300", "4294967296", "-1"],
    ),
    ("--chains", &["0", "1", "7", "64", "1000000000000"]),
    (
        "--bootstrap",
        &["0", "1", "9", "1000", "18446744073709551615"],
    ),
    ("--large-step", &["0", "1", "0.3", "2", "nan"]),
    ("--mutation", &["gaussian", "kelemen", "cauchy"]),
    ("--sigma", &["0", "0.01", "1", "1e30", "inf", "-1"]),
    ("--strategy-choice", &["uniform", "learned"]),
    ("--seed", &["0", "18446744073709551615", "-1"]),
    ("--force-effects", &["all", "strategies", "none", "x"]),
    ("--mutations", &["0", "1", "3", "18446744073709551615"]),
    ("--spp", &["0", "1", "2", "18446744073709551615"]),
    ("--target-error", &["0.5", "0", "1e-9", "1e30", "nan"]),
    ("--no-estimate", &[]),
    ("--threads", &["0", "1", "2", "3"]),
    ("--lanes", &["1", "8", "4"]),
    (
        "--max-memory",
        &["0", "1B", "10MB", "100MB", "1e30", "16EiB"],
    ),
    ("--exposure", &["0", "-200", "1e30", "nan"]),
    ("--error-layers", &[]),
    ("--strategies", &[]),
    (
        "--resolution",
        &["1x1", "7x3", "0x0", "1x40", "100000x100000", "4294967296x1"],
    ),
    (
        "--crop",
        &[
            "0,1,0,1",
            "0,0.5,0.5,1",
            "0.5,0.5,0,1",
            "nan,1,0,1",
            "-1,2,-1,2",
        ],
    ),
];

/// Numbers of SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    fn of<'a, T>(&mut self, list: &'a [T]) -> &'a T {
        &list[self.below(list.len())]
    }
}

/// Strings with their quotes, brackets, words, comments left out.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '#' => {
                rest = rest
                    .split_once('\n')
                    .map_or("", |(_, after)| after)
                    .trim_start();
                continue;
            }
            '[' | ']' => 1,
            '"' => rest[1..].find('"').map_or(rest.len(), |end| end + 2),
            _ => {
                let ends = |c: char| c.is_whitespace() || "[]\"#".contains(c);
                rest.find(ends).unwrap_or(rest.len())
            }
        };
        let (token, after) = rest.split_at(length);
        tokens.push(token.to_owned());
        rest = after.trim_start();
    }
    tokens
}

fn is_number(token: &str) -> bool {
    token.parse::<f64>().is_ok()
}

/// Changes a few tokens; `others` are those of another scene.
fn mutate(scene: &mut Vec<String>, others: &[String], random: &mut Random) {
    for _ in 0..=random.below(4) {
        if scene.is_empty() {
            return;
        }
        let at = random.below(scene.len());
        let end = (at + 1 + random.below(12)).min(scene.len());
        match random.below(10) {
            0 => drop(scene.remove(at)),
            1 => {
                let again = scene[at].clone();
                scene.insert(at, again);
            }
            2 => {
                let with = random.below(scene.len());
                scene.swap(at, with);
            }
            3..6 => {
                let numbers: Vec<usize> =
                    (0..scene.len()).filter(|&i| is_number(&scene[i])).collect();
                if !numbers.is_empty() {
                    scene[*random.of(&numbers)] = (*random.of(&NUMBERS)).to_owned();
                }
            }
            6 => drop(scene.drain(at..end)),
            7 => {
                let again = scene[at..end].to_vec();
                scene.splice(at..at, again);
            }
            8 => {
                let from = random.below(others.len());
                let until = (from + 1 + random.below(12)).min(others.len());
                scene.splice(at..at, others[from..until].iter().cloned());
            }
            // A string by another: names of parameters, types, files.
            _ => {
                let strings = |tokens: &[String]| -> Vec<usize> {
                    (0..tokens.len())
                        .filter(|&i| tokens[i].starts_with('"'))
                        .collect()
                };
                let (here, there) = (strings(scene), strings(others));
                if !here.is_empty() && !there.is_empty() {
                    scene[*random.of(&here)] = others[*random.of(&there)].clone();
                }
            }
        }
    }
}

/// Flags that bound the work first, so that others may take their place.
fn arguments(random: &mut Random) -> Vec<String> {
    let mut arguments: Vec<(String, Option<String>)> = Vec::new();
    let mut set = |flag: &str, value: Option<&str>| {
        arguments.retain(|(known, _)| known != flag);
        arguments.push((flag.to_owned(), value.map(str::to_owned)));
    };
    let render = random.below(8) > 0;
    if render {
        for (flag, value) in [
            ("--resolution", "6x5"),
            ("--bootstrap", "200"),
            ("--chains", "64"),
            ("--time", "1"),
            ("--max-memory", "1GB"),
            ("--threads", "1"),
        ] {
            set(flag, Some(value));
        }
        set("-o", Some(*random.of(&["a.exr", "a.png", "a.pfm"])));
        for _ in 0..random.below(4) {
            let (flag, values) = random.of(&FLAGS);
            set(flag, (!values.is_empty()).then(|| *random.of(values)));
        }
    } else if random.below(2) == 0 {
        set("--json", None);
    }
    let command = if render { "render" } else { "inspect" };
    let flags = arguments.into_iter().flat_map(|(flag, value)| match value {
        Some(value) => vec![format!("{flag}={value}")],
        None => vec![flag],
    });
    let short = flags.map(|f| f.replace("-o=", "--output="));
    [command.to_owned(), "scene.pbrt".to_owned()]
        .into_iter()
        .chain(short)
        .collect()
}

/// What is wrong with how the program ends, if anything.
fn fault(folder: &Path, arguments: &[String]) -> Option<String> {
    let (out, err) = (folder.join("stdout"), folder.join("stderr"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_phalanx"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(fs::File::create(out).unwrap())
        .stderr(fs::File::create(&err).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > HANG {
            child.kill().unwrap();
            child.wait().unwrap();
            return Some("hangs".to_owned());
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let bytes = fs::read(&err).unwrap();
    let stderr = String::from_utf8_lossy(&bytes);
    match status.code() {
        None => Some(format!("{status}: {stderr}")),
        Some(0..=2) if stderr.contains("panicked") => Some(format!("panics: {stderr}")),
        Some(1 | 2) if stderr.trim().is_empty() => Some("says nothing".to_owned()),
        Some(0..=2) => stderr
            .lines()
            .find(|line| line.len() > 2000)
            .map(|line| format!("a line of {} bytes", line.len())),
        Some(code) => Some(format!("code {code}: {stderr}")),
    }
}

/// Every scene of the repository, by its tokens; pictures and meshes go into the folder.
fn corpus(folder: &Path) -> Vec<Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut scenes: Vec<Vec<String>> = SMALL.iter().map(|text| tokens(text)).collect();
    for place in [
        "scenes",
        "tests/reference",
        "tests/faults",
        "fuzz/seeds/pbrt",
    ] {
        let Ok(entries) = fs::read_dir(root.join(place)) else {
            continue;
        };
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        files.sort();
        for file in files.iter().filter(|f| f.is_file()) {
            let extension = file.extension().and_then(|e| e.to_str());
            if extension == Some("pbrt") || place.starts_with("fuzz") {
                let text = fs::read(file).unwrap();
                if text.len() < 100_000 {
                    scenes.push(tokens(&String::from_utf8_lossy(&text)));
                }
            } else if extension != Some("pfm") {
                fs::copy(file, folder.join(file.file_name().unwrap())).unwrap();
            }
        }
    }
    scenes.retain(|scene| !scene.is_empty());
    scenes
}

fn from_environment(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |value| value.parse().unwrap())
}

#[test]
#[ignore = "takes as long as it is told; see the top of the file"]
fn mutated_scenes_end_well() {
    let seconds = from_environment("PHALANX_FUZZ_SECONDS", 600);
    let mut random = Random(from_environment("PHALANX_FUZZ_SEED", 1) << 32);
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz-binary");
    fs::create_dir_all(&kept).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scenes = corpus(folder);
    let start = Instant::now();
    let (mut runs, mut faults) = (0, 0);
    while start.elapsed() < Duration::from_secs(seconds) {
        let mut scene = random.of(&scenes).clone();
        let others = random.of(&scenes);
        if random.below(8) > 0 {
            mutate(&mut scene, others, &mut random);
        }
        let text = scene.join(" ").replace(" \"", "\n\"");
        fs::write(folder.join("scene.pbrt"), &text).unwrap();
        let arguments = arguments(&mut random);
        runs += 1;
        if let Some(fault) = fault(folder, &arguments) {
            faults += 1;
            let mut hasher = DefaultHasher::new();
            (&text, &arguments).hash(&mut hasher);
            let name = kept.join(format!("{:016x}", hasher.finish()));
            fs::write(name.with_extension("pbrt"), &text).unwrap();
            fs::write(name.with_extension("txt"), arguments.join(" ")).unwrap();
            let fault: Vec<&str> = fault.lines().take(4).collect();
            let fault = fault.join("\n    ");
            println!("{}: {}\n    {fault}", name.display(), arguments.join(" "));
        }
    }
    println!("{runs} runs in {seconds} s, {faults} faults");
    assert_eq!(faults, 0);
}
