//! What is not in order yet. The lists only ever get shorter.

/// A file that uses a room which is not below its own.
pub const UPWARDS: &[&str] = &[];

/// Files that use each other in a circle.
pub const CIRCLES: &[&str] = &[];

/// Files of more than 500 lines.
pub const LONG: &[&str] = &[];

/// Files, or whole folders, with lines of more than 100 columns.
pub const WIDE: &[&str] = &[];
