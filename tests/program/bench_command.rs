//! `phalanx bench` as a user meets it: tables, JSON, messages and exit codes.

use crate::command;

use std::fs;

use serde_json::Value;

use command::{refused, run, text};

/// The shortest measurement that means anything.
const TINY: &str = "bench --seconds 0.05 --bootstrap 5000 --threads 2";

#[track_caller]
fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// A figure that is a positive number, by its JSON pointer.
#[track_caller]
fn positive(json: &Value, path: &str) -> f64 {
    let value = json.pointer(path).and_then(Value::as_f64);
    let value = value.unwrap_or_else(|| panic!("{path} in {json:#}"));
    assert!(value > 0.0 && value.is_finite(), "{path}: {value}");
    value
}

/// Median, least and largest are in order.
#[track_caller]
fn spread(json: &Value, path: &str) {
    let [least, median, most] =
        ["min", "median", "max"].map(|name| positive(json, &format!("{path}/{name}")));
    assert!(least <= median && median <= most, "{path}");
}

#[test]
fn json_holds_every_figure() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &format!("{TINY} --json - -q --seed 3"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
    let json = json(&text(&output.stdout));
    assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["scene_file"], "studio.pbrt");
    assert_eq!(json["seed"], 3);
    assert_eq!(json["integrator"], "mmlt");
    assert!(json["machine"]["target_features"].is_array());
    for path in [
        "/machine/cores",
        "/chains_per_batch",
        "/seconds_per_measurement",
        "/scene/triangles",
        "/scene/width",
        "/scene/tracer_build_seconds",
        "/scene/tracer_bytes",
        "/scene/tracer_bytes_per_triangle",
        "/bootstrap/seconds",
        "/bootstrap/paths_per_second",
        "/bootstrap/rays_per_second",
        "/lanes/eight/ns_per_mutation",
        "/lanes/one/ns_per_mutation",
        "/lanes/rays_per_mutation",
    ] {
        positive(&json, path);
    }
    for path in [
        "/lanes/eight/mutations_per_second",
        "/lanes/eight/rays_per_second",
        "/lanes/one/mutations_per_second",
        "/lanes/gain",
        "/threads/0/mutations_per_second",
        "/threads/1/speed_up",
    ] {
        spread(&json, path);
    }
    assert_eq!(json["threads"].as_array().unwrap().len(), 2);
    assert_eq!(json["threads"][0]["speed_up"]["median"], 1.0);
}

#[test]
fn stages_make_up_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &format!("{TINY} --json -"));
    let json = json(&text(&output.stdout));
    let stages = json["stages"].as_array().unwrap();
    let sum = |name: &str| -> f64 { stages.iter().map(|s| s[name].as_f64().unwrap()).sum() };
    assert!((sum("share") - 1.0).abs() < 1e-9);
    assert!((sum("share_one_lane") - 1.0).abs() < 1e-9);
    let groups = json["groups"].as_array().unwrap();
    let group = |name: &str| groups.iter().find(|g| g["name"] == name).unwrap();
    let ns = |name: &str| group(name)["ns_per_mutation"].as_f64().unwrap();
    let total = ns("total");
    assert!((sum("ns_per_mutation") / total - 1.0).abs() < 1e-9);
    assert!(((ns("traversal") + ns("rest")) / total - 1.0).abs() < 1e-9);
    assert!(ns("accept_and_splat") < ns("rest"));
    let stage = |name: &str| stages.iter().find(|s| s["name"] == name).unwrap();
    for name in ["mutate", "trace", "occlusion", "accept"] {
        let lanes = positive(stage(name), "/mean_live_lanes");
        assert!(lanes <= 8.0, "{name}: {lanes}");
    }
    assert!(stage("splat")["mean_live_lanes"].is_null());
}

#[test]
fn tables_go_to_stdout_and_json_to_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = format!("{TINY} --max-depth 3 --batch 64 --threads 1 --json a.json");
    let output = run(folder.path(), &arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for word in [
        "studio.pbrt",
        "mutations/s",
        "traversal",
        "live lanes",
        "Threads",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    assert!(!table.contains('\x1b'), "{table}");
    let json = json(&fs::read_to_string(folder.path().join("a.json")).unwrap());
    assert_eq!(
        (&json["max_depth"], &json["chains_per_batch"]),
        (&3.into(), &64.into())
    );
    assert_eq!(json["threads"].as_array().unwrap().len(), 1);
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let dark = "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\nWorldBegin\nShape \"sphere\"\nWorldEnd\n";
    fs::write(folder.path().join("dark.pbrt"), dark).unwrap();
    fs::write(folder.path().join("bad.pbrt"), "WorldBegin\nShape 5\n").unwrap();
    let message = refused(&run(folder.path(), &format!("{TINY} dark.pbrt")));
    assert!(message.contains("no lights"), "{message}");
    let message = refused(&run(folder.path(), &format!("{TINY} bad.pbrt")));
    assert!(message.contains("bad.pbrt"), "{message}");
    let message = refused(&run(folder.path(), &format!("{TINY} missing.pbrt")));
    assert!(message.contains("missing.pbrt"), "{message}");
    refused(&run(
        folder.path(),
        &format!("{TINY} --json missing/a.json"),
    ));
    for bad in [
        "--seconds 0",
        "--seconds x",
        "--batch 0",
        "--batch 1.5",
        "--threads -1",
    ] {
        refused(&run(folder.path(), &format!("bench {bad}")));
    }
    let many = "--batch 1048576 --threads 2";
    let message = refused(&run(folder.path(), &format!("bench {many}")));
    assert!(message.contains("chains"), "{message}");
}
