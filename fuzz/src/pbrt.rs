//! Scene text loads as a sound scene, or is refused with a message of one line that begins with a
//! place in the text.

use phalanx::pbrt::load_str;

use super::{files, sound};

const NAME: &str = "input.pbrt";

pub fn check(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    match load_str(&text, NAME, &files::dir()) {
        Ok(scene) => {
            sound::tables(&scene);
            sound::a_few_paths(&scene);
        }
        Err(error) => {
            let message = error.to_string();
            assert!(!message.contains('\n'), "{message:?}");
            let folder = files::dir().display().to_string();
            if let Some(rest) = message.strip_prefix(&format!("{NAME}:")) {
                in_text(&text, rest);
            } else {
                // In a file that the text includes.
                assert!(message.starts_with(&folder), "{message:?}");
            }
        }
    }
}

/// `line:column: ...` is a place in the text, or just behind it.
fn in_text(text: &str, message: &str) {
    let mut numbers = message.splitn(3, ':').map(|n| n.parse::<usize>());
    let (Some(Ok(line)), Some(Ok(column))) = (numbers.next(), numbers.next()) else {
        panic!("{message:?} has no place");
    };
    let found = text.split('\n').nth(line.wrapping_sub(1));
    let width = found.map(|l| l.chars().count());
    assert!(
        width.is_some_and(|w| (1..=w + 1).contains(&column)),
        "{message:?} is outside the text"
    );
}
