//! What charts are drawn with: what a curve says, where things are in the picture, and elements.

use super::axis::LogAxis;
use svg::node::element::{Line, Text};

/// A curve.
pub struct Series {
    pub name: String,
    pub points: Vec<Point>,
}

/// Seconds and error, each with a standard error.
pub struct Point {
    pub seconds: f64,
    pub seconds_stderr: f64,
    pub error: f64,
    pub error_stderr: f64,
    /// Within the error of the reference: the marker is hollow.
    pub doubtful: bool,
    /// Some of its runs came with a warning: there is a ring around the marker.
    pub warned: bool,
    /// What it says when pointed at, line by line.
    pub lines: Vec<String>,
}

// The plot, in pixels.
pub const LEFT: f64 = 72.0;
pub const TOP: f64 = 40.0;
pub const RIGHT: f64 = 620.0;
pub const BOTTOM: f64 = 430.0;
/// Left end of the legend.
pub const LEGEND: f64 = RIGHT + 22.0;
/// Between the rows of the legend.
pub const ROW: f64 = 21.0;
pub const FONT: f64 = 12.5;

/// Seconds from left to right, errors upwards.
pub struct Axes {
    pub x: LogAxis,
    pub y: LogAxis,
    /// Where the reference's own error is, if that can be seen.
    pub floor: Option<f64>,
}

pub fn text(x: f64, y: f64, content: &str, anchor: &str) -> Text {
    Text::new(content)
        .set("x", round(x))
        .set("y", round(y))
        .set("text-anchor", anchor)
}

/// A hundredth of a pixel is enough.
pub fn round(v: f64) -> f64 {
    (v * 100.0).round() / 100.0
}

pub fn line(x1: f64, y1: f64, x2: f64, y2: f64) -> Line {
    Line::new()
        .set("x1", round(x1))
        .set("y1", round(y1))
        .set("x2", round(x2))
        .set("y2", round(y2))
        .set("stroke", "currentColor")
}
