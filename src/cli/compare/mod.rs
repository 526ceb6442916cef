//! `phalanx compare`: how far a picture is from a reference. To stdout, and into pictures of the
//! error.

pub mod args;
mod canvas;
mod document;
mod draw;
pub mod pictures;
mod text;

use std::path::Path;
use std::process::ExitCode;

use self::args::{CompareArgs, Limit};
use self::document::Document;
use self::pictures::Input;
use super::messages::Messages;
use super::{Failure, outputs, units};
use crate::film::output::{self, Attribute, AttributeValue};
use crate::formats::Picture;
use crate::formats::tone::Display;
use crate::metrics::{Comparison, Figures};

pub fn run(args: &CompareArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let json_file = args.json.as_deref().filter(|path| *path != Path::new("-"));
    outputs::check_pictures(&args.output)?;
    if let Some(path) = json_file {
        outputs::check_text(path)?;
    }
    let written = outputs::once(&args.output).into_iter().chain(json_file);
    outputs::check_distinct(written, [args.picture.as_path(), &args.reference])?;
    let inputs = pictures::read(&args.picture, &args.reference, messages)?;
    let [a, b] = &inputs;
    let kind = pictures::suitable_flip(&inputs);
    let width = a.picture.width as usize;
    let comparison = Comparison::new(&a.picture.pixels, &b.picture.pixels, width, kind, args.ppd);
    let whole = comparison.whole().ok_or_else(|| {
        let message = format!("no pixel is finite in both {} and {}", a.name, b.name);
        Failure::Input(message)
    })?;
    let document = Document::new(args, &inputs, kind, &comparison, whole);
    let json = || serde_json::to_string_pretty(&document).unwrap_or_default() + "\n";
    if args.json.is_some() && json_file.is_none() {
        outputs::print(&json())?;
    } else {
        outputs::print(&text::tables(&document, args.map))?;
    }
    if let Some(path) = json_file {
        let json = json();
        outputs::save(path, |path| outputs::write_text(path, &json)).map_err(Failure::Io)?;
        messages.say(format_args!("wrote {}", path.display()));
    }
    let errors = match args.output.is_empty() {
        true => Vec::new(),
        false => comparison.map(args.map.map()),
    };
    for path in &args.output {
        write_map(path, args, a, &errors, &document.whole)?;
        messages.say(format_args!("wrote {}", path.display()));
    }
    let broken = broken_limits(args, a, &document.whole);
    if broken.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    messages.error(broken.join("; "));
    Ok(ExitCode::from(1))
}

/// Writes the errors of pixels: as they are, or in false colours.
fn write_map(
    path: &Path,
    args: &CompareArgs,
    a: &Input,
    errors: &[f32],
    whole: &Figures,
) -> Result<(), Failure> {
    let is_png = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("png"));
    let picture = if is_png {
        let drawn = draw::false_colors(errors, a.picture.width, args, whole);
        drawn.ok_or_else(|| Failure::Input(format!("{}: too large to be drawn", path.display())))?
    } else {
        Picture {
            pixels: errors.iter().map(|e| [*e; 3]).collect(),
            ..a.picture.clone()
        }
    };
    let attributes = [
        ("metric", args.map.title().to_string()),
        ("picture", a.name.clone()),
        ("reference", args.reference.display().to_string()),
    ];
    let attributes = attributes.map(|(name, text)| Attribute {
        name: name.into(),
        value: AttributeValue::Text(text),
    });
    outputs::save_picture(path, |path| {
        output::write(path, &picture, &attributes, &Display::LINEAR)
    })
    .map_err(Failure::Io)
}

/// What does not hold of what was asked for, and by how much.
fn broken_limits(args: &CompareArgs, a: &Input, whole: &Figures) -> Vec<String> {
    let number = |v: f64| units::digits(v, 4);
    let above = |limit: &Limit| {
        let value = limit.metric.value(whole);
        (value > limit.value).then(|| {
            format!(
                "{} is {}, above {} by {}",
                limit.metric.title(),
                number(value),
                limit.value,
                number(value - limit.value)
            )
        })
    };
    let below = |limit: &Limit| {
        let value = limit.metric.value(whole);
        (value < limit.value).then(|| {
            format!(
                "{} is {} dB, below {} by {}",
                limit.metric.title(),
                number(value),
                limit.value,
                number(limit.value - value)
            )
        })
    };
    let limited = !args.max.is_empty() || !args.min.is_empty();
    let not_finite = a.not_finite.filter(|_| limited);
    let not_finite =
        not_finite.map(|bad| format!("{}: {} not finite", a.name, pictures::count(bad.pixels)));
    let above = args.max.iter().filter_map(above);
    let below = args.min.iter().filter_map(below);
    above.chain(below).chain(not_finite).collect()
}
