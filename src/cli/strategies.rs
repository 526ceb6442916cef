//! Pictures of bidirectional strategies, beside the picture that they add up to.

use std::path::{Path, PathBuf};

use super::messages::Messages;
use super::outputs;
use crate::film::output;
use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::integrate::{Settings, StrategyPictures};
use crate::scene::IntegratorKind;
use crate::transport::bidirectional::Strategy;

/// Most pictures that a render with these settings writes beside each of its files.
pub fn pictures(settings: &Settings) -> u64 {
    match settings.strategies && settings.integrator == IntegratorKind::Bdpt {
        true => 2 * Strategy::most(settings.max_depth),
        false => 0,
    }
}

/// The files that [`write`] may make beside each of `files`.
pub fn files(files: &[PathBuf], settings: &Settings) -> Vec<PathBuf> {
    if pictures(settings) == 0 {
        return Vec::new();
    }
    let of_depth = |depth: u32| {
        (0..=depth + 1).map(move |s| Strategy {
            s,
            t: depth + 2 - s,
        })
    };
    let strategies = (0..=settings.max_depth).flat_map(of_depth);
    let kinds = strategies.flat_map(|strategy| KINDS.map(|kind| (strategy, kind)));
    kinds
        .flat_map(|(strategy, kind)| files.iter().map(move |file| name(file, strategy, kind)))
        .collect()
}

const KINDS: [&str; 2] = ["weighted", "unweighted"];

/// Writes them beside each of `files`; false if something is not where it should be.
pub fn write(
    files: &[PathBuf],
    whole: &Picture,
    strategies: &[StrategyPictures],
    display: &Display,
    messages: Messages,
) -> bool {
    let mut all = true;
    for file in files {
        for of in strategies {
            for (kind, pixels) in KINDS.into_iter().zip([&of.weighted, &of.unweighted]) {
                let picture = Picture {
                    pixels: pixels.clone(),
                    ..*whole
                };
                let path = name(file, of.strategy, kind);
                let write = |path: &Path| output::write(path, &picture, &[], display);
                if let Err(message) = outputs::save_picture(&path, write) {
                    messages.error(message);
                    all = false;
                }
            }
        }
        if let (Some(first), true) = (strategies.first(), all) {
            let first = name(file, first.strategy, "weighted");
            let count = 2 * strategies.len();
            messages.say(format_args!(
                "wrote {} and so on, {count} pictures of strategies",
                first.display()
            ));
        }
    }
    all
}

/// `a.s1.t3.weighted.exr` for `a.exr`.
fn name(file: &Path, Strategy { s, t }: Strategy, kind: &str) -> PathBuf {
    let part = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_os_string();
    let mut name = part(file.file_stem());
    name.push(format!(".s{s}.t{t}.{kind}."));
    name.push(part(file.extension()));
    file.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_beside_the_picture() {
        let strategy = Strategy { s: 0, t: 12 };
        let made = name(Path::new("a/b.c.exr"), strategy, "weighted");
        assert_eq!(made, Path::new("a/b.c.s0.t12.weighted.exr"));
    }
}
