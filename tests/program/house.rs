//! The house in order: what the map in `src/lib.rs` promises about the sources themselves.
//!
//! - A room uses lower rooms only, in the order of [`ROOMS`].
//! - No files of a room use each other in a circle.
//! - Files have at most [`MAX_LINES`] lines, lines at most [`MAX_COLUMNS`] columns.
//!
//! What does not hold yet stands in `house/debts.rs`. A debt that has been paid has to go from
//! there, so that it does not come back.

#[path = "house/debts.rs"]
mod debts;
#[path = "house/source.rs"]
mod source;
#[path = "house/tree.rs"]
mod tree;

use std::collections::BTreeSet;
use std::path::Path;

use source::Source;
use tree::Tree;

/// Rooms from the lowest to the highest, as in the map. Rooms of one row do not use each other.
const ROOMS: &[&[&str]] = &[
    &["simd", "memory", "brief", "files"],
    &["checkpoint"],
    &["formats"],
    &["scene"],
    &["trace"],
    &["geometry"],
    &["medium"],
    &["surface", "light", "camera"],
    &["pbrt"],
    &["plan"],
    &["film"],
    &["transport"],
    &["chain"],
    &["replay"],
    &["metrics"],
    &["integrate"],
    &["converge"],
    &["cli"],
];

const MAX_LINES: usize = 500;
const MAX_COLUMNS: usize = 100;

/// Folders whose files are judged by their length.
const FOLDERS: [&str; 4] = ["src", "tests", "benches", "fuzz"];

fn sources(folder: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut sources = Vec::new();
    source::collect(root, &root.join(folder), &mut sources);
    sources.sort_by(|a, b| a.name.cmp(&b.name));
    sources
}

/// Fails if what is found is not what the list of debts says.
fn compare(what: &str, found: &BTreeSet<String>, debts: &[&str]) {
    let listed: BTreeSet<String> = debts.iter().map(|d| (*d).to_owned()).collect();
    let new: Vec<_> = found.difference(&listed).collect();
    let paid: Vec<_> = listed.difference(found).collect();
    assert!(new.is_empty(), "{what}: {new:#?}");
    assert!(
        paid.is_empty(),
        "{what}, as tests/program/house/debts.rs has it, but no longer: {paid:#?}"
    );
}

fn level(room: &str) -> Option<usize> {
    ROOMS.iter().position(|row| row.contains(&room))
}

#[test]
fn every_room_is_on_the_map() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let map = std::fs::read_to_string(root.join("src/lib.rs")).unwrap();
    let rows = map.lines().filter_map(|line| line.strip_prefix("//! | "));
    let names = rows.filter_map(|row| row.split('`').nth(1).map(str::to_owned));
    let names: Vec<String> = names.collect();
    let mut below = 0;
    for name in &names {
        let level = level(name).unwrap_or_else(|| panic!("{name} is not in ROOMS"));
        assert!(level >= below, "{name} is too low on the map");
        below = level;
    }
    for room in ROOMS.iter().flat_map(|row| row.iter()) {
        assert!(names.iter().any(|n| n == room), "{room} is not on the map");
    }
}

#[test]
fn rooms_use_lower_rooms_only() {
    let tree = Tree::new(&sources("src"));
    let mut found = BTreeSet::new();
    for (user, used) in tree.uses() {
        let (Some(room), Some(other)) = (tree.room(user), tree.room(used)) else {
            continue;
        };
        if room != other && level(other) >= level(room) {
            found.insert(format!("{} uses {other}", tree.name(user)));
        }
    }
    compare("used from below", &found, debts::UPWARDS);
}

#[test]
fn no_files_of_a_room_use_each_other_in_a_circle() {
    let tree = Tree::new(&sources("src"));
    let mut found = BTreeSet::new();
    for circle in tree.circles() {
        println!("{circle:#?}");
        found.extend(circle);
    }
    compare("in a circle", &found, debts::CIRCLES);
}

#[test]
fn files_and_lines_are_short() {
    let (mut files, mut lines) = (BTreeSet::new(), BTreeSet::new());
    for source in FOLDERS.iter().flat_map(|folder| sources(folder)) {
        if source.lines().count() > MAX_LINES {
            files.insert(source.name.clone());
        }
        if let Some((number, _)) = source.widths().find(|(_, width)| *width > MAX_COLUMNS) {
            let folder = |debt: &&&str| debt.ends_with('/') && source.name.starts_with(**debt);
            match debts::WIDE.iter().find(folder) {
                Some(folder) => lines.insert((*folder).to_owned()),
                None => lines.insert(source.name.clone()),
            };
            println!("{}:{number}", source.name);
        }
    }
    compare("too many lines", &files, debts::LONG);
    compare("lines that are too wide", &lines, debts::WIDE);
}
