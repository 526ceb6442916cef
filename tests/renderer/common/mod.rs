//! What the tests share. Every test binary includes all of it and uses a part.
#![allow(dead_code)]

pub mod bsdf;
pub mod scenes;
pub mod stats;
