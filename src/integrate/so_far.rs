//! The picture while it is rendered, as observers get it.

use crate::formats::Picture;

/// What an observer wants of the picture so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wanted {
    /// Nothing.
    Nothing,
    /// The picture.
    Picture,
    /// The picture, how far off it is, and what there is to warn of.
    Judged,
}

/// A picture that is not the last one, or not yet known to be.
#[derive(Clone, Debug, PartialEq)]
pub struct SoFar {
    /// As [`Render::picture`](super::Render::picture).
    pub picture: Picture,
    /// Standard error of each of its values, as files have it; `None` if it was not wanted, or is
    /// not known yet.
    pub errors: Option<Vec<[f32; 3]>>,
    /// As [`Stats::relative_error`](super::Stats::relative_error); `None` as `errors`.
    pub relative_error: Option<f64>,
    /// What the user would be told if the render ended now, a sentence each; `None` if it was not
    /// wanted, or is not known yet.
    pub warnings: Option<Vec<String>>,
}
