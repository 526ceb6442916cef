//! What the fuzz targets promise, of the inputs kept for them: those that reach most of the code,
//! and those that once failed.

use std::fs;
use std::path::Path;

#[path = "fuzz_seeds/binary.rs"]
mod binary;
#[path = "../../fuzz/src/lib.rs"]
#[allow(dead_code)]
mod targets;

/// Every input of every target, each by its name when it fails.
#[test]
fn seeds_keep_the_promises() {
    for (target, check) in targets::TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("fuzz/seeds")
            .join(target);
        let mut files: Vec<_> = fs::read_dir(&folder)
            .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
            .map(|entry| entry.unwrap().path())
            .collect();
        files.sort();
        assert!(!files.is_empty(), "{target} has no seeds");
        for file in files {
            let data = fs::read(&file).unwrap();
            if std::panic::catch_unwind(|| check(&data)).is_err() {
                panic!("{} fails, as shown above", file.display());
            }
        }
    }
}
