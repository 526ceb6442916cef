//! Elements of ASCII files: numbers as C's `strtod` takes them, which is how most programs that
//! write or read PLY do.

use std::str::FromStr;

use ply_rs_bw::ply::{ElementDef, PropertyAccess, PropertyType, ScalarType};

/// One element from its line. What follows its last property is ignored.
pub fn element<E: PropertyAccess>(line: &str, definition: &ElementDef) -> Result<E, String> {
    let mut words = line.split_ascii_whitespace();
    let mut element = E::new();
    for (name, property) in &definition.properties {
        let mut next = || words.next().ok_or(format!("{name:?} is missing"));
        let told = |message: String| format!("{name:?}: {message}");
        match &property.data_type {
            // Not by way of a double, which would round twice.
            PropertyType::Scalar(ScalarType::Float) => {
                element.set_float(name, float(next()?).map_err(told)?);
            }
            PropertyType::Scalar(kind) => {
                element.set_double(name, number(next()?, kind).map_err(told)?);
            }
            PropertyType::List(length, kind) => {
                let length = number(next()?, length).map_err(told)?;
                if length < 0.0 || length.fract() != 0.0 {
                    return Err(told(format!("{length} is not the length of a list")));
                }
                // No memory is set aside: the line may be shorter than it says.
                let list = (0..length as u64)
                    .map(|_| next().and_then(|word| number(word, kind).map_err(told)))
                    .collect::<Result<_, _>>()?;
                element.set_list_double(name, list);
            }
        }
    }
    Ok(element)
}

/// A number of the kind; a double holds all of them.
fn number(word: &str, kind: &ScalarType) -> Result<f64, String> {
    match kind {
        ScalarType::Char => integer::<i8>(word),
        ScalarType::UChar => integer::<u8>(word),
        ScalarType::Short => integer::<i16>(word),
        ScalarType::UShort => integer::<u16>(word),
        ScalarType::Int => integer::<i32>(word),
        ScalarType::UInt => integer::<u32>(word),
        ScalarType::Float => float::<f32>(word).map(f64::from),
        ScalarType::Double => float(word),
    }
}

fn integer<T: FromStr + Into<f64>>(word: &str) -> Result<f64, String> {
    let parsed = word.parse::<T>().map(T::into);
    parsed.map_err(|_| format!("{word:?} is not an integer in range"))
}

/// Rust's grammar is that of `strtod`, but for hexadecimal digits and what C may append to `nan`.
fn float<T: FromStr>(word: &str) -> Result<T, String> {
    let plain = match word.split_once('(') {
        Some((nan, rest)) if rest.ends_with(')') && nan.to_ascii_lowercase().ends_with("nan") => {
            nan
        }
        _ => word,
    };
    plain
        .parse()
        .map_err(|_| format!("{word:?} is not a number"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_c_takes_them() {
        for (word, value) in [
            (".001", 0.001),
            ("-.5", -0.5),
            ("1.", 1.0),
            ("+1", 1.0),
            ("1e5", 1e5),
            ("1.5E-07", 1.5e-7),
            ("-0", 0.0),
            ("inf", f64::INFINITY),
            ("-Infinity", f64::NEG_INFINITY),
            ("1e999", f64::INFINITY),
        ] {
            assert_eq!(number(word, &ScalarType::Double), Ok(value), "{word}");
        }
        for word in ["nan", "NaN", "-nan", "-nan(ind)", "nan(0x7ff)"] {
            assert!(float::<f32>(word).unwrap().is_nan(), "{word}");
        }
        for word in ["", ".", "1-2", "e5", "1,5", "x", "nan(", "1(2)", "--1"] {
            assert!(float::<f32>(word).is_err(), "{word}");
        }
    }

    #[test]
    fn integers_are_of_their_kind() {
        assert_eq!(number("+255", &ScalarType::UChar), Ok(255.0));
        assert_eq!(number("4294967295", &ScalarType::UInt), Ok(4294967295.0));
        for (word, kind) in [
            ("256", ScalarType::UChar),
            ("-129", ScalarType::Char),
            ("2147483648", ScalarType::Int),
            ("1.0", ScalarType::Int),
            ("nan", ScalarType::Int),
        ] {
            assert!(number(word, &kind).is_err(), "{word}");
        }
    }
}
