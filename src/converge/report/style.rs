//! How series are told apart: by colour, for eyes of every kind; by marker and dash, in
//! black-and-white print.

/// Okabe and Ito 2008, "Color universal design", without the yellow that white paper swallows;
/// their black is the text's colour, which is white on a dark page.
const COLORS: [&str; 7] = [
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "currentColor",
];

/// As `stroke-dasharray`.
const DASHES: [&str; 5] = ["none", "7 3", "2 3", "9 3 2 3", "14 4"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    Circle,
    Square,
    Up,
    Diamond,
    Down,
    Hexagon,
}

const MARKERS: [Marker; 6] = [
    Marker::Circle,
    Marker::Square,
    Marker::Up,
    Marker::Diamond,
    Marker::Down,
    Marker::Hexagon,
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Style {
    pub color: &'static str,
    pub dash: &'static str,
    pub marker: Marker,
}

/// Of the series with this number: the counts have no common divisor, so that 210 series differ.
pub fn of(series: usize) -> Style {
    Style {
        color: COLORS[series % COLORS.len()],
        dash: DASHES[series % DASHES.len()],
        marker: MARKERS[series % MARKERS.len()],
    }
}

impl Marker {
    /// Corners around the origin, as large as a circle of this radius; `None` is that circle.
    pub fn corners(self, radius: f64) -> Option<Vec<[f64; 2]>> {
        let regular = |count: usize, first: f64, scale: f64| {
            let corner = |i: usize| {
                let angle = (first + 360.0 * i as f64 / count as f64).to_radians();
                [radius * scale * angle.cos(), radius * scale * angle.sin()]
            };
            Some((0..count).map(corner).collect())
        };
        match self {
            Marker::Circle => None,
            Marker::Square => regular(4, 45.0, 1.25),
            Marker::Up => regular(3, -90.0, 1.4),
            Marker::Diamond => regular(4, 0.0, 1.35),
            Marker::Down => regular(3, 90.0, 1.4),
            Marker::Hexagon => regular(6, 0.0, 1.1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_differ_in_colour_and_without_it() {
        let styles: Vec<Style> = (0..210).map(of).collect();
        for (i, style) in styles.iter().enumerate() {
            assert!(!styles[..i].contains(style));
        }
        let grey: Vec<(&str, Marker)> = styles[..30].iter().map(|s| (s.dash, s.marker)).collect();
        for (i, style) in grey.iter().enumerate() {
            assert!(!grey[..i].contains(style));
        }
    }
}
