//! What previews are told of a render before it begins.

use crate::formats::tone::Display;
use crate::integrate::Settings;

/// A render that begins.
pub struct About<'a> {
    pub scene: &'a str,
    pub settings: &'a Settings,
    pub display: Display,
    /// What has been warned of already.
    pub warnings: &'a [String],
}
