//! Error against time, both logarithmic, as SVG. Ink is `currentColor`, so that a page can make it
//! white on black.

use super::axis::{LogAxis, Tick, TickLabel};
use super::cells::{self, number};
use super::draw::{
    Axes, BOTTOM, FONT, LEFT, LEGEND, Point, RIGHT, ROW, Series, TOP, line, round, text,
};
use super::series::{curve, legend, legend_of_warnings};
use crate::converge::figures::{BudgetFigures, VariantFigures};
use crate::converge::run::SceneStudy;
use svg::node::element::{ClipPath, Definitions, Group, Line, Rectangle, SVG, TSpan, Text};
use svg::node::{self, Node};

pub struct Chart {
    pub title: String,
    pub series: Vec<Series>,
    /// An error below which the reference says nothing.
    pub floor: Option<f64>,
}

/// The chart of a scene.
pub fn of(scene: &SceneStudy) -> Chart {
    let series = scene.figures.variants.iter().map(|variant| Series {
        name: variant.name.clone(),
        points: (variant.budgets.iter())
            .map(|b| Point {
                seconds: b.seconds.value,
                seconds_stderr: b.seconds.stderr.unwrap_or(0.0),
                error: b.relmse_corrected.value,
                error_stderr: b.relmse_corrected.stderr.unwrap_or(0.0),
                doubtful: b.within_reference_error,
                warned: b.warned > 0,
                lines: lines(variant, b),
            })
            .collect(),
    });
    let figures = &scene.figures;
    Chart {
        title: format!(
            "{}, {} × {} pixels",
            figures.scene, figures.width, figures.height
        ),
        series: series.collect(),
        floor: figures.reference.relmse.filter(|r| *r > 0.0),
    }
}

/// What a point says when it is pointed at.
fn lines(variant: &VariantFigures, b: &BudgetFigures) -> Vec<String> {
    let mut lines = vec![
        variant.name.clone(),
        format!("time in s: {}", cells::relative(&b.seconds)),
        format!("relMSE: {}", cells::relative(&b.relmse_corrected)),
        format!(
            "{} {}, {} seed{}",
            b.effort,
            variant.effort_unit,
            b.runs,
            if b.runs == 1 { "" } else { "s" }
        ),
    ];
    if b.warned > 0 {
        lines.push(format!("{} of {} with a warning", b.warned, b.runs));
    }
    lines
}

/// Least height of a picture.
const HEIGHT: f64 = 484.0;
/// Width of a character of the font, on average.
const CHARACTER: f64 = 6.6;

/// A file of its own, on white. Names of things in it begin with `prefix`.
pub fn document(chart: &Chart, prefix: &str) -> String {
    let (width, height) = size(chart);
    let paper = Rectangle::new()
        .set("width", width)
        .set("height", height)
        .set("fill", "#ffffff");
    let svg = root(chart).add(paper).add(drawing(chart, prefix));
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{svg}\n")
}

/// An element for a page.
pub fn element(chart: &Chart, prefix: &str) -> String {
    root(chart)
        .set("role", "img")
        .add(drawing(chart, prefix))
        .to_string()
}

fn size(chart: &Chart) -> (f64, f64) {
    let longest = chart.series.iter().map(|s| s.name.chars().count()).max();
    let legend = 48.0 + CHARACTER * longest.unwrap_or(0) as f64;
    let rows = chart.series.len() + 2;
    (
        LEGEND + legend.max(130.0) + 10.0,
        HEIGHT.max(TOP + ROW * rows as f64),
    )
}

fn root(chart: &Chart) -> SVG {
    let (width, height) = size(chart);
    SVG::new()
        .set("class", "chart")
        .set("width", width)
        .set("height", height)
        .set("viewBox", format!("0 0 {width} {height}"))
        .set("color", "#000000")
        .set("fill", "currentColor")
        .set("font-family", "Helvetica, Arial, sans-serif")
        .set("font-size", FONT)
}

fn axes(chart: &Chart) -> Axes {
    let points = || {
        chart
            .series
            .iter()
            .flat_map(|s| &s.points)
            .filter(|p| p.error > 0.0)
    };
    let least = points().map(|p| p.error).fold(f64::INFINITY, f64::min);
    // Far below everything it need not be seen.
    let floor = chart.floor.filter(|f| *f > 0.2 * least);
    // Bars that reach down to 0 would stretch a logarithmic axis without end.
    let span = |value: f64, error: f64| [(value - error).max(0.5 * value), value + error];
    let x = points().flat_map(|p| span(p.seconds, p.seconds_stderr));
    let y = points()
        .flat_map(|p| span(p.error, p.error_stderr))
        .chain(floor);
    Axes {
        x: LogAxis::new(x, LEFT, RIGHT),
        y: LogAxis::new(y, BOTTOM, TOP),
        floor: floor.filter(|_| least.is_finite()),
    }
}

fn drawing(chart: &Chart, prefix: &str) -> Group {
    let axes = axes(chart);
    let clip = format!("{prefix}plot");
    let window = Rectangle::new()
        .set("x", LEFT)
        .set("y", TOP)
        .set("width", RIGHT - LEFT)
        .set("height", BOTTOM - TOP);
    let mut all = Group::new()
        .add(Definitions::new().add(ClipPath::new().set("id", clip.as_str()).add(window.clone())))
        .add(text(LEFT, 22.0, &chart.title, "start").set("font-weight", "bold"))
        .add(grid(&axes));
    if let Some(floor) = axes.floor {
        all = all.add(floor_line(&axes, floor));
    }
    if let Some(guide) = guide(chart, &axes, &clip) {
        all = all.add(guide);
    }
    all = all.add(
        window
            .set("fill", "none")
            .set("stroke", "currentColor")
            .set("class", "frame"),
    );
    for (i, series) in chart.series.iter().enumerate() {
        all = all.add(curve(series, i, &axes)).add(legend(series, i));
    }
    if chart
        .series
        .iter()
        .flat_map(|s| &s.points)
        .any(|p| p.warned)
    {
        all = all.add(legend_of_warnings(chart.series.len()));
    }
    if chart
        .series
        .iter()
        .flat_map(|s| &s.points)
        .all(|p| p.error <= 0.0 || p.error.is_nan())
    {
        let (x, y) = (0.5 * (LEFT + RIGHT), 0.5 * (TOP + BOTTOM));
        all = all.add(text(
            x,
            y,
            "no error that the reference can tell from 0",
            "middle",
        ));
    }
    let middle = 0.5 * (TOP + BOTTOM);
    all.add(text(
        0.5 * (LEFT + RIGHT),
        BOTTOM + 42.0,
        "time (s)",
        "middle",
    ))
    .add(
        text(
            18.0,
            middle,
            "relative mean squared error (relMSE)",
            "middle",
        )
        .set("transform", format!("rotate(-90 18 {middle})")),
    )
}

fn grid(axes: &Axes) -> Group {
    let faint =
        |tick: &Tick, line: Line| line.set("stroke-opacity", if tick.major { 0.22 } else { 0.08 });
    let mut all = Group::new().set("class", "grid");
    for tick in axes.x.ticks() {
        all = all.add(faint(&tick, line(tick.at, TOP, tick.at, BOTTOM)));
        if let Some(label) = &tick.label {
            all = all.add(tick_label(tick.at, BOTTOM + 19.0, label, "middle"));
        }
    }
    for tick in axes.y.ticks() {
        all = all.add(faint(&tick, line(LEFT, tick.at, RIGHT, tick.at)));
        if let Some(label) = &tick.label {
            all = all.add(tick_label(LEFT - 8.0, tick.at + 4.0, label, "end"));
        }
    }
    all
}

fn tick_label(x: f64, y: f64, label: &TickLabel, anchor: &str) -> Text {
    match label {
        TickLabel::Plain(content) => text(x, y, content, anchor),
        TickLabel::Power(factor, exponent) => {
            let base = factor.map_or("10".into(), |f| format!("{f}·10"));
            let raised = TSpan::new(exponent.to_string().replace('-', "\u{2212}"))
                .set("dy", -5)
                .set("font-size", round(0.75 * FONT));
            let mut text = text(x, y, "", anchor);
            *text.get_children_mut().unwrap_or(&mut Vec::new()) =
                vec![Box::new(node::Text::new(base)), Box::new(raised)];
            text
        }
    }
}

/// Everything below the reference's own error is shaded.
fn floor_line(axes: &Axes, floor: f64) -> Group {
    let y = axes.y.place(floor);
    let shade = Rectangle::new()
        .set("x", LEFT)
        .set("y", round(y))
        .set("width", RIGHT - LEFT)
        .set("height", round(BOTTOM - y))
        .set("fill-opacity", 0.06);
    let label = format!("error of the reference itself, {}", number(floor));
    Group::new()
        .set("class", "floor")
        .add(shade)
        .add(
            line(LEFT, y, RIGHT, y)
                .set("stroke-opacity", 0.5)
                .set("stroke-dasharray", "1 3"),
        )
        .add(text(LEFT + 8.0, (y + 15.0).min(BOTTOM - 4.0), &label, "start").set("font-size", 11))
}

/// What independent samples follow: error over time falls with slope -1. Drawn beyond the largest
/// errors.
fn guide(chart: &Chart, axes: &Axes, clip: &str) -> Option<Group> {
    let points = chart
        .series
        .iter()
        .flat_map(|s| &s.points)
        .filter(|p| p.error > 0.0);
    let product = points
        .map(|p| (p.seconds * p.error).log10())
        .fold(f64::NEG_INFINITY, f64::max);
    if !product.is_finite() {
        return None;
    }
    // Fifteen pixels above and right of the worst point.
    let across = 15.0 / axes.x.decade() + 15.0 / -axes.y.decade();
    let at = |log_x: f64| (axes.x.line(log_x), axes.y.line(product + across - log_x));
    let (x0, y0) = at(0.0);
    let (dx, dy) = (axes.x.decade(), -axes.y.decade());
    // Where it enters the plot at the top, and leaves it to the right or below.
    let enter = ((TOP - y0) / dy).max((LEFT - x0) / dx);
    let leave = ((BOTTOM - y0) / dy).min((RIGHT - x0) / dx);
    let length = (leave - enter) * dx.hypot(dy);
    let (a, b) = (at(enter), at(leave));
    let all = Group::new()
        .set("class", "guide")
        .set("clip-path", format!("url(#{clip})"))
        .add(
            line(a.0, a.1, b.0, b.1)
                .set("stroke-opacity", 0.45)
                .set("stroke-dasharray", "2 4"),
        );
    if length < 90.0 {
        return (length > 0.0).then_some(all);
    }
    let angle = dy.atan2(dx).to_degrees();
    // Near the upper end, where curves are rarely.
    let along = 45.0 / dx.hypot(dy);
    let (x, y) = (a.0 + along * dx + 3.0, a.1 + along * dy - 4.0);
    let turn = format!("rotate({} {} {})", round(angle), round(x), round(y));
    let label = text(x, y, "slope \u{2212}1", "middle")
        .set("font-size", 11)
        .set("fill-opacity", 0.75);
    Some(all.add(label.set("transform", turn)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(errors: &[f64]) -> Chart {
        let point = |(i, error): (usize, &f64)| Point {
            seconds: 2f64.powi(i as i32),
            seconds_stderr: 0.1,
            error: *error,
            error_stderr: 0.3 * error.abs(),
            doubtful: i == 2,
            warned: i == 1,
            lines: vec!["<a> & \"b\"".into()],
        };
        Chart {
            title: "a<b>".into(),
            series: vec![Series {
                name: "pt & more".into(),
                points: errors.iter().enumerate().map(point).collect(),
            }],
            floor: Some(2e-3),
        }
    }

    #[test]
    fn a_document_has_axes_marks_and_no_raw_text() {
        let text = document(&chart(&[0.1, 0.05, 0.025]), "x-");
        for part in [
            "time (s)",
            "relative mean squared error (relMSE)",
            "slope",
            "x-plot",
            "pt &amp; more",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert_eq!(text.matches("class=\"point\"").count(), 3);
        // One at the point, one in the legend.
        assert_eq!(text.matches("class=\"warned\"").count(), 2);
        assert!(text.contains("with a warning"));
        assert!(!text.contains("<a>") && !text.contains("NaN") && !text.contains("inf"));
    }

    #[test]
    fn nothing_to_draw_is_no_trouble() {
        for errors in [&[][..], &[0.0, -1.0], &[f64::NAN], &[1e-300, 1e300]] {
            let text = element(&chart(errors), "x-");
            assert!(
                !text.contains("NaN") && !text.contains("inf,"),
                "{errors:?}"
            );
        }
    }
}
