//! `phalanx converge` as a user meets it: files, figures, messages and exit codes.

use crate::command;

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use command::{command, refused, run, text};

/// Work that is the same on any machine: two variants, two budgets, two seeds.
const TINY: &str = "converge --resolution 16x16 --bootstrap 500 --first-effort 4 --budgets 2 --seeds 2 --reference-factor 8";

#[track_caller]
fn succeeds(output: &Output) -> String {
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    stderr
}

/// Rows of a file as maps from column to cell.
fn table(path: &Path) -> Vec<HashMap<String, String>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

#[track_caller]
fn number(row: &HashMap<String, String>, column: &str) -> f64 {
    let cell = row
        .get(column)
        .unwrap_or_else(|| panic!("{column} in {row:?}"));
    cell.parse().unwrap_or_else(|_| panic!("{column}: {cell}"))
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_report_is_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &format!("{TINY} -o report/of/mine"));
    assert!(succeeds(&output).contains("wrote report/of/mine/index.html"));
    let tables = text(&output.stdout);
    for word in ["studio.pbrt", "pt", "mmlt", "slope", "s to 1e-2", "gain"] {
        assert!(tables.contains(word), "{word}: {tables}");
    }
    let report = folder.path().join("report/of/mine");
    let expected = [
        "index.html",
        "runs.csv",
        "studio-reference.exr",
        "studio.svg",
        "summary.csv",
    ];
    assert_eq!(files(&report), expected);

    let runs = table(&report.join("runs.csv"));
    assert_eq!(runs.len(), 2 * 2 * 2);
    for row in &runs {
        assert_eq!(row["scene"], "studio.pbrt");
        assert_eq!(
            (row["variant"].as_str(), row["lanes"].as_str()),
            (row["integrator"].as_str(), "8")
        );
        let [seconds, build, bootstrap, render] = [
            "seconds",
            "build_seconds",
            "bootstrap_seconds",
            "render_seconds",
        ]
        .map(|c| number(row, c));
        assert!((seconds - build - bootstrap - render).abs() < 1e-9 && render > 0.0);
        let work = if row["integrator"] == "pt" {
            "samples"
        } else {
            "mutations"
        };
        assert!(number(row, work) >= 16.0 * 16.0 * number(row, "effort"));
        assert!([4.0, 8.0].contains(&number(row, "budget")));
        assert!([0.0, 1.0].contains(&number(row, "seed")));
        assert!(number(row, "relmse") > number(row, "relmse_corrected"));
    }
    let bootstrap = |name: &str| {
        let row = runs.iter().find(|r| r["integrator"] == name).unwrap();
        row["bootstrap"].clone()
    };
    assert_eq!(
        (bootstrap("pt"), bootstrap("mmlt")),
        ("".into(), "500".into())
    );

    let summary = table(&report.join("summary.csv"));
    assert_eq!(summary.len(), 2);
    for column in [
        "slope",
        "slope_stderr",
        "seconds_to_1e-2",
        "seconds_to_1e-2_extrapolated",
        "efficiency",
        "gain",
    ] {
        assert!(summary[0].contains_key(column), "{column}");
    }
    assert!(number(&summary[0], "efficiency") > 0.0);
    let svg = fs::read_to_string(report.join("studio.svg")).unwrap();
    assert!(svg.contains("relative mean squared error") && svg.ends_with("</svg>\n"));
}

#[test]
fn the_page_needs_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "<b>&\"'.pbrt";
    fs::write(
        folder.path().join(scene),
        include_str!("../../scenes/cornell.pbrt"),
    )
    .unwrap();
    // Enough paths at the start that there is nothing to warn of.
    let quiet = TINY.replace("--bootstrap 500", "--bootstrap 20000");
    let mut command = command(folder.path(), &format!("{quiet} -q --budgets 1"));
    let output = command.arg(scene).output().unwrap();
    assert_eq!(succeeds(&output), "");
    let page = fs::read_to_string(folder.path().join("converge/index.html")).unwrap();
    // The namespace of SVG is a name, no address.
    let page = page.replace("http://www.w3.org/2000/svg", "");
    for external in [
        "http:",
        "https:",
        "//cdn",
        "src=\"/",
        "href=\"/",
        "url(http",
        "@import",
        "<link rel=\"stylesheet",
    ] {
        assert!(!page.contains(external), "{external}");
    }
    let sources = page.matches(" src=\"").count();
    assert_eq!(
        sources,
        page.matches(" src=\"data:image/png;base64,").count()
    );
    assert_eq!(sources, 1 + 2 * 2);
    assert!(!page.contains("<b>&\"") && page.contains("&lt;b&gt;&amp;&quot;&#39;.pbrt"));
    assert!(!page.contains("{{") && page.contains("--budgets 1"));
    assert!(files(&folder.path().join("converge")).contains(&"_b____.svg".into()));
}

#[test]
fn every_combination_that_means_something_runs() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = "--lanes 1,8 --large-step 0.2,auto --mutation kelemen --sigma 0.01 --seeds 1 --budgets 1 --json -";
    let output = run(folder.path(), &format!("{TINY} {sweep}"));
    succeeds(&output);
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let scene = &json["scenes"][0];
    let variants = scene["variants"].as_array().unwrap();
    let names: Vec<&str> = variants
        .iter()
        .map(|v| v["name"].as_str().unwrap())
        .collect();
    let expected = [
        "pt, lanes 1",
        "pt, lanes 8",
        "mmlt, lanes 1, large step 0.2",
        "mmlt, lanes 1, large step auto",
        "mmlt, lanes 8, large step 0.2",
        "mmlt, lanes 8, large step auto",
    ];
    assert_eq!(names, expected);
    // Lanes change the time, not the picture.
    let runs = scene["runs"].as_array().unwrap();
    let error = |variant: usize| {
        let run = runs.iter().find(|r| r["variant"] == variant).unwrap();
        run["relmse"].as_f64().unwrap()
    };
    assert_eq!(
        (error(0), error(2), error(3)),
        (error(1), error(4), error(5))
    );
    assert_ne!(error(2), error(3));
    assert!(json["machine"]["cores"].as_u64().is_some());
    assert!(
        json["command"]
            .as_str()
            .unwrap()
            .starts_with("phalanx converge --resolution 16x16")
    );
    // One seed tells of no error.
    assert!(variants[0]["efficiency"]["stderr"].is_null());
}

#[test]
fn budgets_of_time_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "converge --resolution 16x16 --bootstrap 500 --first-seconds 0.05 --budgets 3 --seeds 1 --reference-factor 2";
    let output = run(folder.path(), &format!("{arguments} --json figures.json"));
    assert!(succeeds(&output).contains("wrote figures.json"));
    let runs = table(&folder.path().join("converge/runs.csv"));
    // How long a run takes is up to the machine, and what else it does.
    for row in runs.iter().filter(|r| r["budget"] == "0.2") {
        assert!(number(row, "seconds") > 0.0);
    }
    let efforts: Vec<f64> = (runs.iter().filter(|r| r["integrator"] == "pt"))
        .map(|r| number(r, "effort"))
        .collect();
    assert!(efforts[0] < efforts[2], "{efforts:?}");
}

#[test]
fn a_reference_can_be_given() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(&run(folder.path(), &format!("{TINY} -o first")));
    let reuse = "--reference first/studio-reference.exr --reference-error 0.01";
    let tiny = TINY.replace(" --reference-factor 8", "");
    succeeds(&run(folder.path(), &format!("{tiny} {reuse} -o second")));
    assert!(!folder.path().join("second/studio-reference.exr").exists());
    let relmse = |name: &str, column: &str| -> Vec<f64> {
        let rows = table(&folder.path().join(name).join("runs.csv"));
        rows.iter().map(|r| number(r, column)).collect()
    };
    assert_eq!(relmse("first", "relmse"), relmse("second", "relmse"));
    for (whole, less) in relmse("second", "relmse")
        .iter()
        .zip(relmse("second", "relmse_corrected"))
    {
        assert!((whole - less - 0.01).abs() < 1e-12);
    }
}

#[test]
fn what_cannot_be_run_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |arguments: &str| refused(&run(folder.path(), arguments));
    fs::write(folder.path().join("file"), "").unwrap();
    fs::write(folder.path().join("bad.pfm"), "PF\n").unwrap();
    fs::write(
        folder.path().join("small.pfm"),
        b"PF\n1 1\n-1\n\0\0\0\0\0\0\0\0\0\0\0\0",
    )
    .unwrap();
    fs::write(
        folder.path().join("nan.pfm"),
        b"PF\n1 1\n-1\n\0\0\xc0\x7f\0\0\0\0\0\0\0\0",
    )
    .unwrap();
    for bad in [
        "--integrators pt,vcm",
        "--integrators",
        "--lanes 4",
        "--large-step 0.1,2",
        "--sigma x",
        "--mutation gaussian,levy",
        "--chains 0",
        "--max-depth -1",
        "--seeds 0",
        "--budgets 0",
        "--budgets 25",
        "--first-seconds 0",
        "--first-seconds nan",
        "--first-effort 0",
        "--first-effort 1 --first-seconds 1",
        "--reference-parts 1",
        "--reference-error 0.1",
        "--reference a.pfm,b.pfm",
        "--reference a.pfm --reference-error 1,2",
        "--reference a.pfm --reference-integrator pt",
        "--reference missing.pfm",
        "--reference file",
        "--reference bad.pfm",
        "missing.pbrt",
        "-o file",
        "-o file/below",
        "--json missing/a.json",
    ] {
        refuse(&format!("converge {bad}"));
    }
    let message = refuse("converge --reference small.pfm");
    assert!(
        message.contains("1 x 1 pixels, and studio.pbrt has 600 x 400"),
        "{message}"
    );
    let message = refuse("converge --resolution 1x1 --reference nan.pfm");
    assert!(message.contains("not finite"), "{message}");
}

#[test]
fn dark_scenes_and_idle_flags_are_no_trouble() {
    let folder = tempfile::tempdir().unwrap();
    let dark = "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\nWorldBegin\nShape \"sphere\"\nWorldEnd\n";
    fs::write(folder.path().join("dark.pbrt"), dark).unwrap();
    let arguments =
        "converge dark.pbrt --first-seconds 0.001 --budgets 2 --seeds 2 --reference-factor 1";
    let stderr = succeeds(&run(folder.path(), arguments));
    assert!(stderr.contains("no lights"), "{stderr}");
    let page = fs::read_to_string(folder.path().join("converge/index.html")).unwrap();
    assert!(page.contains("no error that the reference can tell from 0"));
    let arguments = format!("{TINY} --integrators pt --sigma 0.1,0.2 --budgets 1 --seeds 1");
    let stderr = succeeds(&run(folder.path(), &arguments));
    assert!(stderr.contains("--sigma means nothing"), "{stderr}");
    assert_eq!(table(&folder.path().join("converge/runs.csv")).len(), 1);
}

#[cfg(unix)]
mod signals {
    use super::*;
    use std::time::{Duration, Instant};

    /// Sends SIGINT once `ready`, and returns how the study ended.
    fn interrupted(folder: &Path, arguments: &str, ready: impl Fn() -> bool) -> Output {
        let mut command = command(folder, arguments);
        let child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while !ready() && start.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(50));
        }
        // Handlers are there before the folder is; some runs are done a little later.
        std::thread::sleep(Duration::from_millis(1500));
        let kill = Command::new("kill")
            .args(["-2", &child.id().to_string()])
            .status();
        assert!(kill.unwrap().success());
        child.wait_with_output().unwrap()
    }

    #[test]
    fn what_is_complete_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let long = "converge --resolution 16x16 --bootstrap 500 --first-effort 1 --budgets 24 --seeds 2 --reference-factor 1e-3 --reference-parts 2";
        let reference = "--reference r.pfm".to_string();
        // Without a reference of its own the runs begin at once.
        let mut file = b"PF\n16 16\n-1\n".to_vec();
        file.extend([0u8; 16 * 16 * 12]);
        fs::write(folder.path().join("r.pfm"), file).unwrap();
        let long = long.replace("--reference-factor 1e-3 --reference-parts 2", &reference);
        let made = folder.path().join("converge");
        let output = interrupted(folder.path(), &long, || made.exists());
        assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
        let runs = table(&made.join("runs.csv"));
        assert!(
            !runs.is_empty() && runs.len() < 24 * 2 * 2,
            "{}",
            runs.len()
        );
        let page = fs::read_to_string(made.join("index.html")).unwrap();
        assert!(page.contains("Stopped before all runs were done"));
        assert!(text(&output.stdout).contains("slope"));
    }

    #[test]
    fn without_runs_there_is_no_report() {
        let folder = tempfile::tempdir().unwrap();
        let made = folder.path().join("converge");
        let long = "converge --first-seconds 100 --seeds 1";
        let output = interrupted(folder.path(), long, || made.exists());
        assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("no report is written"));
        assert!(files(&made).is_empty());
    }
}
