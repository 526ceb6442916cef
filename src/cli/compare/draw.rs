//! Errors in false colours, with a legend below: magma for errors, red and blue for differences
//! with a sign; both can be told apart by the colour-blind.

use colorous::{MAGMA, RED_BLUE};

use super::args::{CompareArgs, MapName};
use super::canvas::{Canvas, Color, Text};
use crate::cli::units::digits;
use crate::formats::{MAX_PIXELS, Picture};
use crate::metrics::Figures;

const PAPER: Color = [255, 255, 255];
const INK: Color = [32, 32, 32];
const FRAME: Color = [128, 128, 128];
/// In neither colour map.
const NOT_FINITE: Color = [0, 200, 83];

/// Part of the pixels whose errors are within the scale.
const QUANTILE: f64 = 0.95;

/// Pixels of the narrowest legend that has room for its numbers.
const NARROWEST: usize = 336;
/// Pictures as wide as this are looked at from afar: their legends are twice as large.
const WIDE: usize = 1600;
const TICKS: usize = 5;

/// From 0 or, with a sign, `-max` to `max`.
struct Scale {
    max: f64,
    signed: bool,
}

/// Draws the errors of pixels in rows of `width`; NaN is a pixel that is not finite. `None` if the
/// legend makes a picture too large (one that is a few pixels high or wide, and millions long).
pub fn false_colors(
    errors: &[f32],
    width: u32,
    args: &CompareArgs,
    whole: &Figures,
) -> Option<Picture> {
    let width = width as usize;
    let height = errors.len() / width.max(1);
    let scale = Scale {
        max: args.scale.unwrap_or_else(|| suitable_max(errors, args.map)),
        signed: args.map == MapName::Difference,
    };
    let (unit, text) = if width < WIDE {
        (1, Text::Small)
    } else {
        (2, Text::Large)
    };
    let full_width = width.max(NARROWEST);
    let legend = Legend {
        unit,
        text,
        width: full_width,
        top: height,
    };
    let full_height = height + legend.height();
    if full_width.saturating_mul(full_height) as u64 > MAX_PIXELS {
        return None;
    }
    let mut canvas = Canvas::new(full_width, full_height, PAPER);
    let left = (full_width - width) / 2;
    for (i, error) in errors.iter().enumerate() {
        canvas.set(left + i % width, i / width, scale.color(*error));
    }
    let mean = match args.map {
        MapName::Difference => whole.mean_a - whole.mean_b,
        map => whole.of_map(map.map()),
    };
    let title = [
        args.map.title().to_string(),
        format!("mean {}", digits(mean, 4)),
    ];
    legend.draw(&mut canvas, &scale, &title, errors);
    Some(canvas.picture())
}

/// 1 for FLIP; else a round number that most errors are below.
fn suitable_max(errors: &[f32], map: MapName) -> f64 {
    if map == MapName::Flip {
        return 1.0;
    }
    let magnitudes = errors.iter().map(|e| e.abs());
    let mut sorted: Vec<f32> = magnitudes.filter(|e| e.is_finite() && *e > 0.0).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let at = (QUANTILE * sorted.len() as f64) as usize;
    sorted.get(at).map_or(1.0, |e| round_up(f64::from(*e)))
}

/// The next of 1, 2, 5, 10, 20, ...
fn round_up(value: f64) -> f64 {
    let power = value.log10().floor() as i32;
    let rounded = [1, 2, 5, 10].map(|n| format!("{n}e{power}").parse().unwrap_or(value));
    rounded.into_iter().find(|r| *r >= value).unwrap_or(value)
}

impl Scale {
    fn color(&self, error: f32) -> Color {
        let part = f64::from(error) / self.max;
        match part {
            p if p.is_nan() => NOT_FINITE,
            // Red is brighter than the reference.
            p if self.signed => RED_BLUE
                .eval_continuous(0.5 - 0.5 * p.clamp(-1.0, 1.0))
                .into_array(),
            p => MAGMA.eval_continuous(p.clamp(0.0, 1.0)).into_array(),
        }
    }

    /// The error at part `t` of the bar.
    fn at(&self, t: f64) -> f64 {
        if self.signed {
            self.max * (2.0 * t - 1.0)
        } else {
            self.max * t
        }
    }
}

/// A title, a bar of colours and its numbers.
struct Legend {
    /// 1, or more for larger legends.
    unit: usize,
    text: Text,
    width: usize,
    top: usize,
}

impl Legend {
    fn margin(&self) -> usize {
        8 * self.unit
    }

    fn bar_height(&self) -> usize {
        14 * self.unit
    }

    fn height(&self) -> usize {
        // Above, below and between; the ticks.
        3 * self.margin() + 4 * self.unit + self.bar_height() + 2 * self.text.height()
    }

    fn draw(&self, canvas: &mut Canvas, scale: &Scale, title: &[String; 2], errors: &[f32]) {
        let (margin, text) = (self.margin(), self.text);
        let mut line = |x: usize, y: usize, t: &str| canvas.write([x, y], t, text, INK);
        let top = self.top + margin;
        line(margin, top, &title[0]);
        let right = self.width.saturating_sub(margin + text.width(&title[1]));
        line(right, top, &title[1]);
        if errors.iter().any(|e| e.is_nan()) {
            let x = margin + text.width(&title[0]) + 2 * margin;
            let side = 10 * self.unit;
            line(x + side + margin, top, "not finite");
            let y = top + (text.height() - side) / 2;
            canvas.fill([x, y], [side, side], NOT_FINITE);
        }
        self.bar(canvas, scale, top + text.height() + margin, errors);
    }

    fn bar(&self, canvas: &mut Canvas, scale: &Scale, top: usize, errors: &[f32]) {
        let (left, height, unit) = (self.margin(), self.bar_height(), self.unit);
        let width = self.width - 2 * left;
        canvas.fill([left, top], [width, height], FRAME);
        for x in unit..width - unit {
            let t = (x - unit) as f64 / (width - 2 * unit - 1) as f64;
            let color = scale.color(scale.at(t) as f32);
            canvas.fill([left + x, top + unit], [1, height - 2 * unit], color);
        }
        for i in 0..TICKS {
            let t = i as f64 / (TICKS - 1) as f64;
            let x = left + (t * (width - unit) as f64) as usize;
            canvas.fill([x, top + height], [unit, 3 * unit], FRAME);
            let value = scale.at(t);
            let beyond = |e: &f32| match value {
                v if v > 0.0 => f64::from(*e) > v,
                v => f64::from(*e) < v,
            };
            let last = i + 1 == TICKS || (i == 0 && scale.signed);
            let sign = match last && errors.iter().any(beyond) {
                true if value > 0.0 => ">",
                true => "<",
                false => "",
            };
            let number = format!("{sign}{}", digits(value, 3));
            let label = self.text.width(&number);
            let most = (self.width - left).saturating_sub(label);
            let x = x.saturating_sub(label / 2).clamp(left.min(most), most);
            let y = top + height + 4 * unit;
            canvas.write([x, y], &number, self.text, INK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_leave_out_outliers() {
        assert_eq!(
            [0.3, 0.011, 1.0, 7.0, 120.0].map(round_up),
            [0.5, 0.02, 1.0, 10.0, 200.0]
        );
        let mut errors = vec![0.3; 999];
        errors.extend([1e9, f32::NAN, f32::INFINITY]);
        assert_eq!(suitable_max(&errors, MapName::Mse), 0.5);
        assert_eq!(suitable_max(&errors, MapName::Flip), 1.0);
        assert_eq!(suitable_max(&[0.0, f32::NAN], MapName::Mse), 1.0);
        assert!(suitable_max(&[1e-45, f32::MAX], MapName::Mse).is_finite());
    }

    #[test]
    fn colors() {
        let scale = |signed| Scale { max: 2.0, signed };
        assert_eq!(scale(false).color(f32::NAN), NOT_FINITE);
        assert_eq!(scale(false).color(f32::INFINITY), scale(false).color(2.0));
        assert_eq!(scale(false).color(0.0), [0, 0, 4]);
        let [r, _, b] = scale(true).color(2.0);
        assert!(r > b, "red is brighter");
        let [r, _, b] = scale(true).color(-2.0);
        assert!(b > r, "blue is darker");
    }
}
