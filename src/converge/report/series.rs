//! The curves of a chart, their marks, and the legend.

use super::axis::LogAxis;
use super::draw::{Axes, BOTTOM, LEGEND, Point, ROW, Series, TOP, line, round, text};
use super::style::{self, Marker, Style};
use svg::node::element::{Circle, Group, Line, Polygon, Polyline, Title};

pub(super) fn curve(series: &Series, index: usize, axes: &Axes) -> Group {
    let style = style::of(index);
    let shown: Vec<&Point> = series.points.iter().filter(|p| p.error > 0.0).collect();
    let places = shown.iter().map(|p| {
        let (x, y) = (axes.x.place(p.seconds), axes.y.place(p.error));
        format!("{},{}", round(x), round(y))
    });
    let places: Vec<String> = places.collect();
    let path = Polyline::new()
        .set("points", places.join(" "))
        .set("fill", "none")
        .set("stroke", style.color)
        .set("stroke-width", 1.8)
        .set("stroke-dasharray", style.dash)
        .set("stroke-linejoin", "round");
    let mut all = Group::new()
        .set("class", "series")
        .set("data-series", index)
        .set("color", "inherit")
        .add(path);
    for point in shown {
        all = all.add(mark(point, style, axes));
    }
    all
}

fn mark(point: &Point, style: Style, axes: &Axes) -> Group {
    let (x, y) = (axes.x.place(point.seconds), axes.y.place(point.error));
    let bar = |line: Line| line.set("stroke", style.color).set("stroke-width", 1.2);
    let span = |axis: &LogAxis, value: f64, error: f64| {
        [axis.place(value - error), axis.place(value + error)]
    };
    let mut all = Group::new()
        .set("class", "point")
        .set("data-x", round(x))
        .set("data-y", round(y))
        .set("data-tip", point.lines.join("\n"))
        .add(Title::new(point.lines.join("\n")));
    let [low, high] = span(&axes.y, point.error, point.error_stderr);
    // Bars that the marker hides are left out.
    if (low - high).abs() > 2.0 {
        all = all.add(bar(line(x, low, x, high)));
        for end in [low, high].into_iter().filter(|e| *e < BOTTOM) {
            all = all.add(bar(line(x - 3.5, end, x + 3.5, end)));
        }
    }
    let [low, high] = span(&axes.x, point.seconds, point.seconds_stderr);
    if (high - low).abs() > 2.0 {
        all = all.add(bar(line(low, y, high, y)));
        for end in [low, high] {
            all = all.add(bar(line(end, y - 3.5, end, y + 3.5)));
        }
    }
    if point.warned {
        all = all.add(ring(x, y));
    }
    let fill = if point.doubtful { "none" } else { style.color };
    all.add(
        marker(style.marker, x, y)
            .set("fill", fill)
            .set("stroke", style.color),
    )
}

/// Around what came with a warning.
fn ring(x: f64, y: f64) -> Circle {
    Circle::new()
        .set("class", "warned")
        .set("cx", round(x))
        .set("cy", round(y))
        .set("r", 8.5)
        .set("fill", "none")
        .set("stroke", "currentColor")
        .set("stroke-width", 1.1)
}

/// What the ring means, below so many rows.
pub(super) fn legend_of_warnings(rows: usize) -> Group {
    let y = TOP + 8.0 + ROW * rows as f64;
    Group::new()
        .set("class", "remark")
        .add(ring(LEGEND + 18.0, y))
        .add(text(LEGEND + 44.0, y + 4.0, "with a warning", "start"))
}

fn marker(marker: Marker, x: f64, y: f64) -> Polygon {
    const RADIUS: f64 = 4.2;
    // A circle is a polygon, too, if it has corners enough.
    let round_corners = || {
        (0..24)
            .map(|i| f64::from(i) * std::f64::consts::TAU / 24.0)
            .map(|a| [RADIUS * a.cos(), RADIUS * a.sin()])
            .collect()
    };
    let corners: Vec<[f64; 2]> = marker.corners(RADIUS).unwrap_or_else(round_corners);
    let points = corners
        .iter()
        .map(|c| format!("{},{}", round(x + c[0]), round(y + c[1])));
    Polygon::new()
        .set("points", points.collect::<Vec<String>>().join(" "))
        .set("stroke-width", 1.3)
}

pub(super) fn legend(series: &Series, index: usize) -> Group {
    let style = style::of(index);
    let y = TOP + 8.0 + ROW * index as f64;
    Group::new()
        .set("class", "legend")
        .set("data-series", index)
        .add(
            line(LEGEND, y, LEGEND + 36.0, y)
                .set("stroke", style.color)
                .set("stroke-width", 1.8)
                .set("stroke-dasharray", style.dash),
        )
        .add(
            marker(style.marker, LEGEND + 18.0, y)
                .set("fill", style.color)
                .set("stroke", style.color),
        )
        .add(text(LEGEND + 44.0, y + 4.0, &series.name, "start"))
}
