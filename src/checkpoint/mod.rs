//! The state of a render in a file: values in a row, packed, and proof that they are as they were.
//!
//! 1. A [`Writer`] takes values one after the other and packs them into blocks (`blocks.rs`): each
//!    compressed, and with a checksum. Tables are laid out byte by byte before (`planes.rs`): the
//!    high bytes of numbers are alike, the low ones are noise.
//! 2. A [`Reader`] gives the same values back in the same order. It allocates no more than the
//!    caller expects, and refuses what does not fit.
//! 3. `file.rs` puts two of them in a file: a head, which is small, and the state.
//! 4. [`Origin`] says which files a scene came from, and whether they are as they were.
//!
//! Whoever has state writes and reads it beside its definition (`save`, `load`). `save` takes its
//! type apart field by field, so that a new field does not compile until it has a place there.
//! [`FORMAT`] is then to be raised.

mod blocks;
mod error;
mod file;
mod origin;
mod planes;
mod reader;
mod writer;

pub use self::blocks::Packed;
pub use self::error::{CheckpointError, Malformed};
pub use self::file::{read, write};
pub use self::origin::{Change, Origin};
pub use self::reader::Reader;
pub use self::writer::Writer;

/// Of what is in a file, and in which order.
pub const FORMAT: u32 = 2;

#[cfg(test)]
mod tests;
