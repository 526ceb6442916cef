//! A NanoVDB file becomes a grid that is whole, or is refused with a message of one line.

use phalanx::formats::nanovdb::read;

use super::files;

/// Memory that a grid may take, in bytes.
const ROOM: u64 = 1 << 26;

pub fn check(data: &[u8]) {
    files::with_file("input.nvdb", data, |path| {
        let mut left = ROOM;
        let mut room = |bytes: u64| match left.checked_sub(bytes) {
            Some(rest) => {
                left = rest;
                Ok(())
            }
            None => Err(format!("needs {bytes} bytes, and there are {left}")),
        };
        match read(path, "density", &mut room) {
            Ok(Some(grid)) => {
                let count: u64 = grid.size.iter().map(|n| u64::from(*n)).product();
                assert_eq!(grid.values.len() as u64, count);
                assert!(grid.size.iter().all(|n| *n >= 3));
                let place = grid.to_world.iter().flatten();
                assert!(
                    place
                        .chain(grid.bounds.iter().flatten())
                        .all(|x| x.is_finite())
                );
            }
            Ok(None) => {}
            Err(message) => {
                assert!(
                    !message.is_empty() && !message.contains('\n'),
                    "{message:?}"
                );
            }
        }
    });
}
