//! Files as they are written: whole or not at all, without harm to what was there.
//!
//! A file is written beside its target, without a name where the system can do that
//! ([`replacement`]), and takes the target's place in one step at the end. Symbolic links are
//! followed; what cannot be replaced (a device, a pipe, a file of another user) is written
//! into ([`place`]).

mod place;
mod replacement;

pub(crate) use self::place::{Identity, check, folder, is_special, target};
pub(crate) use self::replacement::{Replacement, abandon};

use std::io::{self, Write};
use std::path::Path;

/// Writes a file of this content.
pub(crate) fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = Replacement::of(path)?;
    file.write_all(content)?;
    file.finish()
}
