//! A BSDF that the program does without, to show what adding one takes: its file here, its line in
//! the [table](super::table), nothing else.

pub mod lommel_seeliger;
