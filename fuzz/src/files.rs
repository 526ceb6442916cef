//! Files on disk that inputs are written to, or may name.

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

thread_local! {
    static FOLDER: TempDir = folder();
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let put = |name: &str, bytes: &[u8]| {
        fs::write(folder.path().join(name), bytes).expect("a written file");
    };
    put("a.ply", PLY.as_bytes());
    put("a.pbrt", b"Translate 1 0 0 Shape \"sphere\"");
    put("a.spd", b"400 1\n500 .5\n700 .2\n");
    let picture = |width: u32, height: u32| {
        let mut pfm = format!("PF\n{width} {height}\n-1\n").into_bytes();
        for i in 0..width * height * 3 {
            pfm.extend((0.1 + (i % 7) as f32).to_le_bytes());
        }
        pfm
    };
    put("a.pfm", &picture(4, 2));
    put("square.pfm", &picture(4, 4));
    folder
}

/// A folder of small files that scenes may name: `a.ply`, `a.pbrt`, `a.spd`, `a.pfm` and
/// `square.pfm`.
pub fn dir() -> PathBuf {
    FOLDER.with(|folder| folder.path().to_owned())
}

/// Calls `f` with a file that holds `bytes`.
pub fn with_file(name: &str, bytes: &[u8], f: impl FnOnce(&Path)) {
    let path = dir().join(name);
    fs::write(&path, bytes).expect("a written file");
    f(&path);
}
