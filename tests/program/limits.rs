//! Limits of the machine: memory that is not there, and disks that are full.

#[path = "limits/bombs.rs"]
#[cfg(target_os = "linux")]
mod bombs;
use crate::command;

use std::fs;
use std::path::Path;

use command::{refused, run, text};

/// A flat mesh of `side * side` squares, as binary PLY.
fn write_mesh(path: &Path, side: u32) {
    let n = side + 1;
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        n * n,
        side * side
    )
    .into_bytes();
    for i in 0..n * n {
        for v in [i % n, i / n, 0] {
            ply.extend((v as f32).to_le_bytes());
        }
    }
    for i in 0..side * side {
        let at = i / side * n + i % side;
        ply.push(4);
        for v in [at, at + 1, at + 1 + n, at + n] {
            ply.extend(v.to_le_bytes());
        }
    }
    fs::write(path, ply).unwrap();
}

const MESH: &str = "LookAt 0 0 9  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n\
                    Shape \"plymesh\" \"string filename\" \"m.ply\"\n";

/// What needs too much memory is refused before it is allocated, with what needs it.
#[test]
fn memory_is_checked_before_it_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (flags, part) in [
        ("--resolution 20000x20000", "film "),
        ("--bootstrap 1000000000", "bootstrap "),
        ("--chains 1000000 --max-depth 100", "chains "),
    ] {
        let message = refused(&run(folder, &format!("render --max-memory 1GiB {flags}")));
        assert!(message.contains("--max-memory allows 1.0 GiB"), "{message}");
        let (_, parts) = message.split_once("GiB: ").unwrap();
        assert!(parts.starts_with(part), "{flags}: {message}");
    }
    // By default, three quarters of what there is.
    let message = refused(&run(
        folder,
        "render --resolution 100000x20000 --max-depth 20",
    ));
    assert!(message.contains("three quarters of the "), "{message}");
    let message = refused(&run(folder, "render --max-memory 5x"));
    assert!(message.contains("--max-memory"), "{message}");

    // Meshes and images, by their headers, and copies of objects.
    write_mesh(&folder.join("m.ply"), 400);
    fs::write(folder.join("mesh.pbrt"), MESH).unwrap();
    let message = refused(&run(folder, "render mesh.pbrt --max-memory 5MiB"));
    assert!(
        message.contains("mesh.pbrt:5:1: Shape \"plymesh\": m.ply: needs 8."),
        "{message}"
    );
    assert!(message.contains("the limit is 5.0 MiB"), "{message}");
    let message = refused(&run(
        folder,
        "render mesh.pbrt --resolution 9x9 --max-memory 40MiB",
    ));
    assert!(
        message.contains("tree") && message.contains("being sorted"),
        "{message}"
    );

    // What is squashed is copied.
    let copies = MESH.replace("Shape", "ObjectBegin \"m\"\nShape")
        + "ObjectEnd\nScale 1 1 0\n"
        + &"ObjectInstance \"m\"\n".repeat(100);
    fs::write(folder.join("copies.pbrt"), copies).unwrap();
    let message = refused(&run(folder, "render copies.pbrt --max-memory 100MiB"));
    assert!(
        message.contains("ObjectInstance") && message.contains("for what comes before"),
        "{message}"
    );

    let mut header = b"P".to_vec();
    header.extend(b"F\n3000 3000\n-1.0\n");
    header.resize(header.len() + 3000 * 3000 * 12, 0);
    fs::write(folder.join("sky.pfm"), header).unwrap();
    let sky = "WorldBegin\nLightSource \"infinite\" \"string mapname\" \"sky.pfm\"\n";
    fs::write(folder.join("sky.pbrt"), sky).unwrap();
    let message = refused(&run(folder, "render sky.pbrt --max-memory 100MiB"));
    assert!(
        message.contains("sky.pbrt:2:1: LightSource \"infinite\""),
        "{message}"
    );
    assert!(message.contains("sky.pfm: needs 206.0 MiB"), "{message}");
    assert!(!folder.join("studio.exr").exists());
}

/// What a render is said to need is about what it takes.
#[test]
fn needs_are_what_is_taken() {
    let folder = tempfile::tempdir().unwrap();
    write_mesh(&folder.path().join("m.ply"), 700);
    fs::write(folder.path().join("mesh.pbrt"), MESH).unwrap();
    // With a limit that the scene alone does not reach.
    for (flags, limit) in [
        (
            "mesh.pbrt --integrator mmlt --resolution 16x16 --bootstrap 1000",
            100,
        ),
        (
            "--integrator mmlt --resolution 1500x1500 --bootstrap 1000 --max-depth 8",
            20,
        ),
        ("--resolution 1500x1500 --integrator pt --spp 2", 20),
        (
            "--integrator mmlt --resolution 16x16 --chains 60000 --mutations 3000 --max-depth 20",
            20,
        ),
    ] {
        let render = format!("render {flags} --mutations 1 -o a.pfm --stats s.json --threads 1");
        // The message of a refusal says what is needed.
        let message = refused(&run(
            folder.path(),
            &format!("{render} --max-memory {limit}MiB"),
        ));
        let needs = message.split_once("needs ").unwrap().1;
        let needs: f64 = needs.split_once(" MiB").unwrap().0.parse().unwrap();
        let output = run(folder.path(), &render);
        assert!(output.status.success(), "{}", text(&output.stderr));
        let stats = fs::read(folder.path().join("s.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
        let taken = stats["peak_rss_bytes"].as_f64().unwrap() / f64::from(1 << 20);
        println!("{flags}: needs {needs} MiB, took {taken:.1} MiB");
        assert!(
            taken <= 1.1 * needs && needs <= 2.5 * taken,
            "{flags}: {needs} {taken}"
        );
    }
}

/// A disk that is full from the start, and one that fills up.
#[cfg(target_os = "linux")]
#[test]
fn full_disks_lose_no_picture() {
    let folder = tempfile::tempdir().unwrap();
    let small = folder.path().join("small");
    fs::create_dir(&small).unwrap();
    let refuge = folder.path().join("refuge");
    fs::create_dir(&refuge).unwrap();
    // A small disk needs a name space of its own, which some machines do not give.
    let shell = |script: &str| {
        std::process::Command::new("unshare")
            .args(["--user", "--map-root-user", "--mount", "sh", "-c", script])
            .current_dir(folder.path())
            .env("PHALANX", env!("CARGO_BIN_EXE_phalanx"))
            .env("TMPDIR", &refuge)
            .output()
    };
    let mount = "mount -t tmpfs -o size=200k none small";
    match shell(mount) {
        Ok(output) if output.status.success() => {}
        _ => {
            println!("skipped: there are no name spaces to mount a small disk in");
            return;
        }
    }
    let full = shell(&format!(
        "{mount} && $PHALANX render --resolution 300x300 -o small/a.exr"
    ));
    let full = full.unwrap();
    let stderr = text(&full.stderr);
    assert_eq!(full.status.code(), Some(1), "{stderr}");
    assert!(
        stderr.contains("small: the disk has 200.0 KiB left"),
        "{stderr}"
    );
    assert!(!stderr.contains("mutations"), "{stderr}");

    // Room for the picture at first, and none at the end.
    let script = format!(
        "{mount} || exit 9; (sleep 0.7; cat /dev/zero > small/other) 2>/dev/null & \
         $PHALANX render --resolution 64x64 --time 2 --mutations 100000000 -o small/a.exr -o b.png --stats small/s.json"
    );
    let fills = shell(&script).unwrap();
    let stderr = text(&fills.stderr);
    assert_eq!(fills.status.code(), Some(1), "{stderr}");
    assert_eq!(stderr.matches("it is saved as ").count(), 2, "{stderr}");
    assert!(folder.path().join("b.png").exists());
    let mut saved: Vec<String> = fs::read_dir(&refuge)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    saved.sort();
    assert!(
        saved.len() == 2 && saved[0].ends_with("-a.exr") && saved[1].ends_with("-s.json"),
        "{saved:?}"
    );
    phalanx::film::output::read_exr(&refuge.join(&saved[0])).unwrap();
}
