//! Values that flags take as text, in their range or with a message.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PathBufValueParser, TypedValueParser};

use super::values::{Exposure, Tuned};
use crate::chain::counts::MAX_CHAINS_PER_DEPTH;
use crate::integrate::Shard;
use crate::scene::Film;

/// A file to write; `-` stands for standard output, where that is a file.
pub(super) fn file() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().map(|path| match path.as_os_str() == "-" && cfg!(unix) {
        true => PathBuf::from("/dev/stdout"),
        false => path,
    })
}

/// Thirty years.
pub(super) const MAX_SECONDS: f64 = 1e9;

pub(super) fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        Ok(_) => Err("it is not finite".into()),
        Err(_) => Err("it is not a number".into()),
    }
}

pub(in crate::cli) fn number_in(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value = number(text)?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{text} is not in {least}..={most}"))
    }
}

pub(in crate::cli) fn probability(text: &str) -> Result<Tuned, String> {
    tuned(text, 1.0)
}

pub(in crate::cli) fn sigma(text: &str) -> Result<Tuned, String> {
    tuned(text, 1e6)
}

pub(super) fn tuned(text: &str, most: f64) -> Result<Tuned, String> {
    match text.trim() {
        "auto" => Ok(Tuned::Auto),
        text => match number_in(text, 0.0, most) {
            Ok(value) => Ok(Tuned::Is(value as f32)),
            Err(e) => Err(format!("{e}, nor auto")),
        },
    }
}

pub(in crate::cli) fn exposure(text: &str) -> Result<Exposure, String> {
    match text.trim() {
        "auto" => Ok(Exposure::Auto),
        text => match stops(text) {
            Ok(stops) => Ok(Exposure::Stops(stops)),
            Err(e) => Err(format!("{e}, nor auto")),
        },
    }
}

pub(in crate::cli) fn stops(text: &str) -> Result<f32, String> {
    number_in(text, -100.0, 100.0).map(|v| v as f32)
}

/// Seconds, or a number with a unit: `90`, `90s`, `1.5m`, `2h`, `1d`.
pub(super) fn seconds(text: &str) -> Result<Duration, String> {
    const UNITS: [(&str, f64); 5] = [
        ("ms", 1e-3),
        ("s", 1.0),
        ("m", 60.0),
        ("h", 3600.0),
        ("d", 86400.0),
    ];
    let split =
        (UNITS.iter()).find_map(|(name, unit)| Some((text.trim().strip_suffix(name)?, unit)));
    let (count, unit) = split.unwrap_or((text, &1.0));
    let value = number(count).map_err(|e| format!("{e}; expected seconds, or 90s, 5m, 1h"))?;
    let value = value * unit;
    if !(0.0..=MAX_SECONDS).contains(&value) {
        return Err(format!("{text} is not in 0..={MAX_SECONDS} s"));
    }
    let time = Duration::from_secs_f64(value);
    if time.is_zero() {
        // Or less than a nanosecond.
        return Err("it must be more than 0".into());
    }
    Ok(time)
}

/// `2/4`: the second of four parts.
pub(super) fn shard(text: &str) -> Result<Shard, String> {
    let expected = || {
        format!(
            "expected a part and how many there are, like 2/4, up to {}",
            Shard::MOST
        )
    };
    let (index, of) = text.split_once('/').ok_or_else(expected)?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| expected());
    let (index, of) = (number(index)?, number(of)?);
    match index >= 1 && index <= of && of <= Shard::MOST {
        true => Ok(Shard {
            index: index - 1,
            of,
        }),
        false => Err(expected()),
    }
}

pub(super) fn target_error(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err("it must be more than 0".into())
    }
}

/// An hour at most: the film must not overflow.
pub(super) fn bench_seconds(text: &str) -> Result<Duration, String> {
    number_in(text, 0.001, 3600.0).map(Duration::from_secs_f64)
}

pub(super) fn batch(text: &str) -> Result<usize, String> {
    number_in(text, 1.0, MAX_CHAINS_PER_DEPTH as f64)?;
    text.trim()
        .parse()
        .map_err(|_| "it is not a whole number".into())
}

/// Bytes, with a unit: kB, MB, GB are powers of 1000, KiB, MiB, GiB of 1024.
pub(super) fn size(text: &str) -> Result<u64, String> {
    match text.trim().parse::<bytesize::ByteSize>() {
        Ok(size) if size.0 > 0 => Ok(size.0),
        Ok(_) => Err("it must be more than nothing".into()),
        Err(_) => Err("expected a size like 8GiB or 500MB".into()),
    }
}

pub(in crate::cli) fn resolution(text: &str) -> Result<(u32, u32), String> {
    let expected = || "expected width and height in pixels, like 640x480".to_string();
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let side = |t: &str| t.trim().parse::<u64>().map_err(|_| expected());
    let size = (side(w)?, side(h)?);
    Film::check_size(size.0, size.1).map_err(|e| e.to_string())
}

pub(super) fn crop(text: &str) -> Result<[f32; 4], String> {
    let values: Result<Vec<f64>, String> = text.split(',').map(number).collect();
    let [x0, x1, y0, y1] = values?[..] else {
        return Err("expected four fractions x0,x1,y0,y1, like 0.25,0.75,0,1".into());
    };
    if ![x0, x1, y0, y1].iter().all(|v| (0.0..=1.0).contains(v)) {
        return Err("fractions lie between 0 and 1".into());
    }
    if x0 >= x1 || y0 >= y1 {
        return Err("it is empty: x0 must be less than x1, and y0 less than y1".into());
    }
    Ok([x0, x1, y0, y1].map(|v| v as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn values() {
        assert_eq!(resolution("640x480"), Ok((640, 480)));
        for bad in ["640", "0x5", "x", "-1x5", "99999999x1", "131072x131072"] {
            assert!(resolution(bad).is_err(), "{bad}");
        }
        assert_eq!(crop("0,1,0.25,.5"), Ok([0.0, 1.0, 0.25, 0.5]));
        for bad in ["0,1,0", "0,1,0,2", "1,0,0,1", "0,1,0,nan", "", "0,1,0,1,1"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        for bad in ["nan", "inf", "1.01", "-0.1", "x", ""] {
            assert!(probability(bad).is_err(), "{bad}");
        }
        assert_eq!(probability("auto"), Ok(Tuned::Auto));
        assert_eq!(sigma("0.5"), Ok(Tuned::Is(0.5)));
        for bad in [
            "nan",
            "inf",
            "0",
            "-1",
            "1e300",
            "1e-300",
            "s",
            "5 furlongs",
            "1h30",
            "1e9h",
            "-5m",
        ] {
            assert!(seconds(bad).is_err(), "{bad}");
        }
        for (text, expected) in [
            ("90", 90.0),
            ("90s", 90.0),
            (" 2 m", 120.0),
            ("1.5h", 5400.0),
            ("1d", 86400.0),
            ("250ms", 0.25),
            ("1e2s", 100.0),
        ] {
            assert_eq!(
                seconds(text),
                Ok(Duration::from_secs_f64(expected)),
                "{text}"
            );
        }
        assert_eq!(size("8GiB"), Ok(8 << 30));
        assert_eq!(size("1.5 MB"), Ok(1_500_000));
        for bad in ["0", "-1", "x", "", "5 furlongs", "nan"] {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    proptest! {
        #![proptest_config(crate::property::cases(1000))]

        /// Numbers, and what people may take for them: a value in its range, or a message.
        #[test]
        fn values_are_in_range_or_refused(
            text in "[-+ ]?([0-9]{0,12}[.]?[0-9]{0,4}(e[-+]?[0-9]{1,4})?|nan|inf|\\PC{0,8})",
            separator in "[xX, ]",
        ) {
            let within = |value: Result<f32, String>, least: f32, most: f32| {
                value.map_or(true, |v| (least..=most).contains(&v))
            };
            let tuned = |value: Result<Tuned, String>| value.map(|v| match v {
                Tuned::Auto => 0.0,
                Tuned::Is(v) => v,
            });
            prop_assert!(within(tuned(probability(&text)), 0.0, 1.0));
            prop_assert!(within(tuned(sigma(&text)), 0.0, 1e6));
            let stops = exposure(&text).map(|e| match e {
                Exposure::Auto => 0.0,
                Exposure::Stops(stops) => stops,
            });
            prop_assert!(within(stops, -100.0, 100.0));
            let in_range = |t: Duration| !t.is_zero() && t.as_secs_f64() <= MAX_SECONDS;
            prop_assert!(seconds(&text).map_or(true, in_range));
            prop_assert!(target_error(&text).map_or(true, |e| e > 0.0 && e.is_finite()));
            prop_assert!(bench_seconds(&text).map_or(true, |t| !t.is_zero()));
            prop_assert!(batch(&text).map_or(true, |n| n >= 1));
            let list = [text.as_str(); 4].join(&separator);
            prop_assert!(resolution(&list).is_err());
            prop_assert!(crop(&list).is_err());
            let pair = format!("{text}{separator}{text}");
            prop_assert!(resolution(&pair).map_or(true, |(w, h)| w >= 1 && h >= 1));
        }

        /// Sizes and windows are what they say.
        #[test]
        fn sizes_are_as_written(
            w in 1..20_000u32,
            h in 1..20_000u32,
            x in 0f32..1.0,
            y in 0f32..1.0,
        ) {
            prop_assert_eq!(resolution(&format!(" {w} x{h}")), Ok((w, h)));
            prop_assert_eq!(crop(&format!("{x},1, {y} ,1")), Ok([x, 1.0, y, 1.0]));
        }
    }
}
