//! Row 33: hostile files.
//!
//! `pbrt` and `pbrt::ply` have generated texts, truncated and damaged meshes;
//! `tests/renderer/fuzz_seeds.rs` has the inputs that fuzzing (`fuzz/README.md`) found to fail;
//! here the program meets them.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::common::stats::Random;
use phalanx::film::output::{Picture, write};
use phalanx::pbrt::load_str;

/// A scene that needs a file of each kind it names.
fn scene_of(file: &str) -> String {
    let use_it = match file.rsplit('.').next() {
        Some("ply") => format!("Shape \"plymesh\" \"string filename\" \"{file}\""),
        Some("pbrt") => format!("Include \"{file}\""),
        _ => format!(
            "Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"{file}\"\nMaterial \"matte\" \"texture Kd\" \"t\"\n\
             Shape \"sphere\" \"float radius\" [1]"
        ),
    };
    // pbrt-v3 goes on without a mesh that it cannot read.
    let film = match file.ends_with(".ply") || file.ends_with(".pbrt") {
        true => "rgb",
        false => "image",
    };
    format!(
        "Film \"{film}\" \"integer xresolution\" 4 \"integer yresolution\" 4 \"string filename\" \"out.pfm\"\nWorldBegin\n{use_it}\n"
    )
}

/// Runs the program on a scene that uses `file`, with a gigabyte of address space.
fn program(dir: &Path, file: &str) -> Output {
    fs::write(dir.join("main.pbrt"), scene_of(file)).unwrap();
    let command = "ulimit -v 1000000; exec \"$0\" render main.pbrt --mutations 1 --bootstrap 100 --chains 8 --threads 1";
    Command::new("sh")
        .args(["-c", command, env!("CARGO_BIN_EXE_phalanx")])
        .current_dir(dir)
        .output()
        .unwrap()
}

#[track_caller]
fn refused(dir: &Path, file: &str) {
    let output = program(dir, file);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{file}: {stderr}");
    assert!(stderr.contains("error: "), "{file}: {stderr}");
    assert!(!stderr.contains("panicked"), "{file}: {stderr}");
    assert!(!dir.join("out.pfm").exists(), "{file}");
}

/// Row 33: headers that promise more than any file holds: a message and exit code 2 before the
/// memory is asked for. The program has a gigabyte; each of these would take more. Pictures have 16
/// 000 pixels squared: few enough to be believed of a larger file.
#[cfg(target_os = "linux")]
#[test]
fn headers_that_promise_too_much() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let chunk = |name: &[u8], data: &[u8]| {
        let mut c = (data.len() as u32).to_be_bytes().to_vec();
        c.extend(name);
        c.extend(data);
        let crc = flate2::Crc::new();
        let mut crc = crc;
        crc.update(&c[4..]);
        c.extend(crc.sum().to_be_bytes());
        c
    };
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    png.extend(chunk(
        b"IHDR",
        &[0, 0, 62, 128, 0, 0, 62, 128, 8, 2, 0, 0, 0],
    ));
    png.extend(chunk(b"IDAT", &[0x78, 0x9c, 3, 0, 0, 0, 0, 1]));
    png.extend(chunk(b"IEND", &[]));
    let mut tga = vec![0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    tga.extend([128, 62, 128, 62, 24, 0]);
    let mut bmp = b"BM".to_vec();
    bmp.extend(54u32.to_le_bytes());
    bmp.extend([0; 4]);
    bmp.extend(54u32.to_le_bytes());
    bmp.extend(40u32.to_le_bytes());
    bmp.extend(16_000i32.to_le_bytes());
    bmp.extend(16_000i32.to_le_bytes());
    bmp.extend([1, 0, 24, 0]);
    bmp.extend([0; 24]);
    let ply = |format: &str, count: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uint int vertex_indices\nend_header\n"
        )
        .into_bytes()
    };
    // A list of 2^32 - 1 indices in a file of a few bytes.
    let mut list = ply("binary_little_endian", "0");
    list.extend([0xff; 16]);
    let files: Vec<(&str, Vec<u8>)> = vec![
        ("a.pfm", b"PF\n200000 200000\n-1.0\n".to_vec()),
        ("b.pfm", b"PF\n99999999999999999999 2\n-1.0\n".to_vec()),
        ("a.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n".to_vec()),
        ("a.png", png),
        ("a.tga", tga),
        ("a.bmp", bmp),
        ("a.ply", ply("ascii", "4000000000")),
        ("b.ply", ply("binary_big_endian", "4000000000")),
        ("c.ply", list),
        ("cycle.pbrt", b"Include \"cycle.pbrt\"\n".to_vec()),
        ("levels.pbrt", b"Shape \"loopsubdiv\" \"integer levels\" 30 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]".to_vec()),
        ("index.pbrt", b"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2000000000]".to_vec()),
    ];
    for (name, bytes) in files {
        fs::write(dir.join(name), bytes).unwrap();
        refused(dir, name);
    }
}

/// Row 33: files with bytes changed, cut or repeated at random load, or are refused with a message
/// of one line; nothing panics.
#[test]
fn damaged_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    let picture = Picture {
        width: 5,
        height: 4,
        offset: [0, 0],
        full: [5, 4],
        pixels: vec![[0.5, 0.2, 0.8]; 20],
    };
    for name in ["whole.png", "whole.exr", "whole.pfm"] {
        write(
            &dir.join(name),
            &picture,
            &[],
            &phalanx::formats::tone::Display::LINEAR,
        )
        .unwrap();
    }
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n".to_vec();
    hdr.extend([10, 20, 30, 128].repeat(4));
    fs::write(dir.join("whole.hdr"), hdr).unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
               element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
    fs::write(dir.join("whole.ply"), ply).unwrap();
    let text = "AttributeBegin Translate 0 1 0 Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"sphere\" \"float radius\" [1] AttributeEnd";
    fs::write(dir.join("whole.pbrt"), text).unwrap();
    let mut random = Random(33);
    let (mut loaded, mut failed) = (0, 0);
    for name in ["png", "exr", "pfm", "hdr", "ply", "pbrt"] {
        let whole = fs::read(dir.join(format!("whole.{name}"))).unwrap();
        let file = format!("damaged.{name}");
        let text = scene_of(&file);
        for i in 0..400 {
            let mut bytes = whole.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(bytes.len());
                match random.below(4) {
                    0 => bytes[at] = random.next() as u8,
                    1 => bytes[at] ^= 1 << random.below(8),
                    2 => bytes.truncate(at.max(1)),
                    _ => {
                        let again = bytes[at..].to_vec();
                        bytes.extend(again);
                    }
                }
            }
            fs::write(dir.join(&file), &bytes).unwrap();
            match load_str(&text, "main.pbrt", dir) {
                Ok(_) => loaded += 1,
                Err(e) => {
                    let message = e.to_string();
                    assert!(
                        !message.contains('\n') && message.contains("main.pbrt")
                            || message.contains(&file),
                        "{name} {i}: {message}"
                    );
                    failed += 1;
                }
            }
            // A few of them through the program.
            if i % 100 == 0 {
                let output = program(dir, &file);
                let code = output.status.code();
                assert!(matches!(code, Some(0 | 2)), "{name} {i}: {output:?}");
            }
        }
    }
    println!("{loaded} loaded, {failed} refused");
    assert!(loaded > 100 && failed > 100);
}

/// Row 33: files that never end, and pipes that nobody writes into.
#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path();
    for name in ["a.ply", "a.pfm", "a.exr", "a.png", "a.hdr"] {
        let path = dir.join(name);
        for pipe in [false, true] {
            if pipe {
                fs::remove_file(&path).unwrap();
                let made = Command::new("mkfifo").arg(&path).status();
                assert!(made.unwrap().success());
            } else {
                std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
            }
            // pbrt-v3 goes on without an image that it cannot read.
            let message = match load_str(&scene_of(name), "a.pbrt", dir) {
                Ok(scene) => scene.warnings.join("\n"),
                Err(error) => error.to_string(),
            };
            assert!(
                message.contains(name) && message.contains("is not a file"),
                "{message}"
            );
        }
    }
}
