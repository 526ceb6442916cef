//! Numbers for people.

use std::time::Duration;

/// `12.3 M`: three digits and a decimal prefix.
pub fn si(value: f64) -> String {
    const PREFIXES: [&str; 7] = ["", " k", " M", " G", " T", " P", " E"];
    let mut scaled = value;
    let mut prefix = 0;
    // What would round to 1000 takes the next prefix.
    while scaled >= 999.5 && prefix + 1 < PREFIXES.len() {
        scaled /= 1000.0;
        prefix += 1;
    }
    let decimals = match scaled {
        s if prefix == 0 && s.fract() == 0.0 => 0,
        s if s < 9.995 => 2,
        s if s < 99.95 => 1,
        _ => 0,
    };
    format!("{scaled:.decimals$}{}", PREFIXES[prefix])
}

/// `12.5 %`: two or three digits.
pub fn percent(part: f64) -> String {
    let value = 100.0 * part;
    let decimals = match value {
        v if v < 0.0995 => 3,
        v if v < 0.995 => 2,
        v if v < 99.5 => 1,
        _ => 0,
    };
    format!("{value:.decimals$} %")
}

/// `0.01234`, `1.5e-7`: rounded to `count` digits, without zeros at the end.
pub fn digits(value: f64, count: usize) -> String {
    let exponential = format!("{value:.*e}", count.saturating_sub(1));
    let rounded: f64 = exponential.parse().unwrap_or(value);
    match rounded.abs() {
        // Not "-0".
        0.0 => "0".into(),
        v if v.is_finite() && !(1e-4..1e7).contains(&v) => format!("{rounded:e}"),
        _ => rounded.to_string(),
    }
}

/// `0.12 s`, `8.5 s`, `1 min 05 s`, `2 h 05 min`
pub fn time(duration: Duration) -> String {
    let seconds = duration.as_secs_f64();
    if seconds < 1.0 {
        return format!("{seconds:.2} s");
    }
    if seconds < 59.95 {
        return format!("{seconds:.1} s");
    }
    let whole = seconds.round() as u64;
    if whole < 3600 {
        return format!("{} min {:02} s", whole / 60, whole % 60);
    }
    let minutes = (seconds / 60.0).round() as u64;
    format!("{} h {:02} min", minutes / 60, minutes % 60)
}

/// Builds of small scenes take microseconds.
pub fn precise(duration: Duration) -> String {
    if duration < Duration::from_millis(100) {
        format!("{:.3} ms", 1000.0 * duration.as_secs_f64())
    } else {
        time(duration)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits() {
        let pairs = [
            (0.0, "0"),
            (7.0, "7"),
            (0.5, "0.50"),
            (999.0, "999"),
            (999.6, "1.00 k"),
            (12_345_678.0, "12.3 M"),
            (123_456.0, "123 k"),
            (9.996e9, "10.0 G"),
            (1e30, "1000000000000 E"),
        ];
        for (value, text) in pairs {
            assert_eq!(si(value), text);
        }
    }

    #[test]
    fn percentages() {
        for (part, text) in [
            (0.1252, "12.5 %"),
            (1.5, "150 %"),
            (0.005, "0.50 %"),
            (0.000_12, "0.012 %"),
        ] {
            assert_eq!(percent(part), text);
        }
    }

    #[test]
    fn digits_that_matter() {
        let pairs = [
            (0.012_345_6, "0.01235"),
            (-0.5, "-0.5"),
            (1234.56, "1235"),
            (1.5e-7, "1.5e-7"),
            (0.000_099_999, "0.0001"),
            (2e30, "2e30"),
            (-0.0, "0"),
            (f64::INFINITY, "inf"),
        ];
        for (value, text) in pairs {
            assert_eq!(digits(value, 4), text);
        }
    }

    #[test]
    fn binary_bytes() {}

    #[test]
    fn times() {
        let text = |s: f64| time(Duration::from_secs_f64(s));
        assert_eq!(text(0.123), "0.12 s");
        assert_eq!(text(59.96), "1 min 00 s");
        assert_eq!(text(65.2), "1 min 05 s");
        assert_eq!(text(7500.0), "2 h 05 min");
    }
}
