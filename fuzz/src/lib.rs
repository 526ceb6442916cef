//! What holds for any input, however odd: a check for every fuzz target.
//!
//! The targets in `fuzz_targets` call these with inputs of libFuzzer's making.
//! `tests/renderer/fuzz_seeds.rs` of the renderer includes this file and calls them with the inputs
//! kept in `seeds`, so that what was mended stays mended without a fuzzer.

mod checkpoint;
mod files;
mod image;
mod nanovdb;
mod paths;
mod pbrt;
mod ply;
mod scenes;
mod sound;

/// A check of one input; it panics if what it promises does not hold.
pub type Check = fn(&[u8]);

/// Every target's name and check.
pub const TARGETS: [(&str, Check); 7] = [
    ("pbrt", pbrt::check),
    ("ply", ply::check),
    ("image", image::check),
    ("nanovdb", nanovdb::check),
    ("paths", paths::check),
    ("scenes", scenes::check),
    ("checkpoint", checkpoint::check),
];

/// Runs the check of a target.
pub fn check(target: &str, data: &[u8]) {
    for (name, check) in TARGETS {
        if name == target {
            check(data);
        }
    }
}
