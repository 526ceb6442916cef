//! The page that `phalanx converge` writes, in a real browser: Chromium, without a window. Where
//! there is none on the path, nothing is tested, and a note says so.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Before the page's own scripts: nothing that goes wrong goes unseen.
const WATCH: &str = include_str!("converge_page/watch.js");
/// After them: what a reader does with the page, and what came of it.
const READER: &str = include_str!("converge_page/reader.js");

fn browser() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = [
        "chromium",
        "chromium-browser",
        "google-chrome",
        "google-chrome-stable",
    ];
    let found = std::env::split_paths(&path)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|file| file.is_file());
    if found.is_none() {
        // Past the test harness, which hides what tests that pass print.
        let note = "note: no Chromium on the path; the page is not tested in a browser\n";
        let _ = std::io::stderr().write_all(note.as_bytes());
    }
    found
}

/// The document after all scripts have run, and what the browser logged.
fn open(browser: &Path, page: &Path, folder: &Path) -> (String, String) {
    let [dom, log] = ["dom.html", "log.txt"].map(|name| folder.join(name));
    let profile = folder.join("profile");
    let mut child = Command::new(browser)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
        ])
        .args([
            "--enable-logging=stderr",
            "--window-size=1100,900",
            "--virtual-time-budget=5000",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .args(["--dump-dom", &format!("file://{}", page.display())])
        .stdin(Stdio::null())
        .stdout(fs::File::create(&dom).unwrap())
        .stderr(fs::File::create(&log).unwrap())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > Duration::from_secs(120) {
            let _ = child.kill();
            panic!(
                "the browser does not end: {}",
                fs::read_to_string(log).unwrap()
            );
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let read = |file| String::from_utf8_lossy(&fs::read(file).unwrap()).into_owned();
    (read(dom), read(log))
}

/// No line of the log is from the page's console.
#[track_caller]
fn silent(log: &str) {
    let complaints: Vec<&str> = log.lines().filter(|l| l.contains("CONSOLE")).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn a_reader_finds_everything() {
    let Some(browser) = browser() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let study = "converge -q --resolution 24x16 --bootstrap 500 --first-effort 8 --budgets 3 --seeds 2 --reference-factor 8";
    let status = Command::new(env!("CARGO_BIN_EXE_phalanx"))
        .args(study.split_whitespace())
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .status();
    assert!(status.unwrap().success());
    let page = folder.path().join("converge/index.html");

    let (dom, log) = open(&browser, &page, folder.path());
    silent(&log);
    assert!(dom.contains("class=\"chart\""), "{dom}");

    let html = fs::read_to_string(&page).unwrap();
    let watched = html.replacen("<head>", &format!("<head><script>{WATCH}</script>"), 1);
    let (before, after) = watched.rsplit_once("</body>").unwrap();
    let read = format!("{before}<script>{READER}</script></body>{after}");
    let copy = folder.path().join("read.html");
    fs::write(&copy, read).unwrap();
    let (dom, log) = open(&browser, &copy, folder.path());
    silent(&log);
    let verdict = dom
        .split_once("<pre id=\"verdict\">")
        .and_then(|(_, v)| v.split_once("</pre>"));
    let (verdict, _) = verdict.unwrap_or_else(|| panic!("no verdict: {dom}"));
    let verdict: Value = serde_json::from_str(verdict).unwrap();

    assert_eq!(verdict["errors"], Value::Array(vec![]), "{verdict:#}");
    // Two variants at three budgets; the reference, and a picture and a map of each.
    assert_eq!(verdict["series"], 2);
    assert_eq!(verdict["points"], 6);
    assert_eq!(verdict["legends"], 2);
    assert_eq!(verdict["pictures"], 5);
    assert_eq!(verdict["broken"], 0);
    assert_eq!(verdict["sizes"], serde_json::json!(["24x16"]));
    assert!(verdict["chart_width"].as_f64().unwrap() > 300.0);
    for check in [
        "tip_hidden_at_first",
        "tip_shows_the_point",
        "others_fade",
        "tip_leaves",
        "starts_in_the_middle",
        "slider_moves_the_divider",
        "dragging_moves_the_slider",
        "choosing_changes_the_picture",
        "flip_shows_one",
        "flip_shows_the_other",
        "flip_names_what_it_shows",
        "sliding_again",
    ] {
        assert_eq!(verdict[check], true, "{check}: {verdict:#}");
    }
}
