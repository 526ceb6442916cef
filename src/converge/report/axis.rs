//! Logarithmic axes: what they span, and where they are labelled.

/// From values to places along a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogAxis {
    /// log10 of the ends.
    low: f64,
    high: f64,
    /// Places of the ends, in pixels.
    from: f64,
    to: f64,
}

/// A line across, and what is written beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    pub at: f64,
    /// Of a power of ten.
    pub major: bool,
    pub label: Option<TickLabel>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum TickLabel {
    Plain(String),
    /// `2` and `-3` are 2·10⁻³; no factor is 1.
    Power(Option<u32>, i32),
}

impl LogAxis {
    /// Holds all positive `values`, and some room at both ends.
    pub fn new(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logs = values.map(f64::log10).filter(|v| v.is_finite());
        let (mut low, mut high) = logs.fold((f64::INFINITY, -f64::INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
        if low > high {
            (low, high) = (-1.0, 0.0);
        }
        let room = (0.06 * (high - low)).max(0.08);
        Self {
            low: low - room,
            high: high + room,
            from,
            to,
        }
    }

    /// Where a value is, within the ends.
    pub fn place(&self, value: f64) -> f64 {
        // The logarithm of 0 is an end, that of less is nowhere and becomes one.
        let log = if value > 0.0 { value.log10() } else { self.low };
        self.line(log.clamp(self.low, self.high))
    }

    /// Where a logarithm is, ends or no ends.
    pub fn line(&self, log: f64) -> f64 {
        self.from + (log - self.low) / (self.high - self.low) * (self.to - self.from)
    }

    /// Pixels that a decade takes, with their sign.
    pub fn decade(&self) -> f64 {
        (self.to - self.from) / (self.high - self.low)
    }

    /// Values at 1 to 9 times powers of ten. Powers are labelled; 2 and 5 times them where there
    /// are few.
    pub fn ticks(&self) -> Vec<Tick> {
        let exponents = self.low.floor() as i32..=self.high.ceil() as i32;
        let inside = |log: f64| (self.low..=self.high).contains(&log);
        let powers = exponents.clone().filter(|e| inside(f64::from(*e))).count();
        let every = (powers / 8 + 1) as i32;
        let plain = exponents.clone().all(|e| (-3..=4).contains(&e));
        let label = |factor: u32, exponent: i32| {
            if plain {
                let decimals = (-exponent).max(0) as usize;
                let value = f64::from(factor) * 10f64.powi(exponent);
                TickLabel::Plain(format!("{value:.decimals$}"))
            } else {
                TickLabel::Power((factor > 1).then_some(factor), exponent)
            }
        };
        let mut ticks = Vec::new();
        for exponent in exponents {
            for factor in 1..10 {
                let log = f64::from(exponent) + f64::from(factor).log10();
                if !inside(log) || (powers > 8 && factor > 1) {
                    continue;
                }
                let labelled = match factor {
                    1 => exponent.rem_euclid(every) == 0,
                    2 | 5 => powers <= 2,
                    _ => false,
                };
                ticks.push(Tick {
                    at: self.line(log),
                    major: factor == 1,
                    label: labelled.then(|| label(factor, exponent)),
                });
            }
        }
        ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_hold_everything() {
        let axis = LogAxis::new([0.1, 10.0, 0.0, -1.0, f64::NAN].into_iter(), 0.0, 212.0);
        assert!((axis.place(1.0) - 106.0).abs() < 1e-9);
        assert!(axis.place(0.1) > 0.0 && axis.place(10.0) < 212.0);
        assert_eq!((axis.place(-5.0), axis.place(1e9)), (0.0, 212.0));
        let empty = LogAxis::new([].into_iter(), 0.0, 1.0);
        assert!(empty.place(0.3).is_finite() && !empty.ticks().is_empty());
    }

    #[test]
    fn labels_neither_lack_nor_crowd() {
        for (low, high) in [
            (0.2, 0.3),
            (0.2, 9.0),
            (1e-3, 1.0),
            (1e-9, 1e9),
            (1e-30, 1e30),
        ] {
            let axis = LogAxis::new([low, high].into_iter(), 300.0, 0.0);
            let labels = axis.ticks().iter().filter(|t| t.label.is_some()).count();
            assert!((1..=10).contains(&labels), "{low} {high}: {labels}");
        }
        let axis = LogAxis::new([0.05, 0.2].into_iter(), 0.0, 1.0);
        let texts: Vec<_> = axis.ticks().into_iter().filter_map(|t| t.label).collect();
        let expected = ["0.05", "0.1", "0.2"].map(|t| TickLabel::Plain(t.into()));
        assert_eq!(texts, expected);
    }
}
