//! `phalanx compare` as a user meets it, and its figures against other implementations (see
//! `compare/make.py`).

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use phalanx::film::output::{self, read_exr, read_pfm};
use phalanx::formats::Picture;
use phalanx::formats::tone::Display;
use phalanx::metrics::{Comparison, Flip, Map, flip};
use phalanx::pbrt::image::{Encoding, read_image};
use serde_json::Value;
use tempfile::TempDir;

const PICTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/program/compare/");

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.png", "a.pfm", "b.pfm"] {
        fs::copy(format!("{PICTURES}{name}"), folder.path().join(name)).unwrap();
    }
    folder
}

fn run(folder: &Path, arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_phalanx"))
        .arg("compare")
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env_remove("NO_COLOR")
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[track_caller]
fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Ends with this code and one error line, which it returns.
#[track_caller]
fn fails(output: &Output, code: i32) -> String {
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    let errors: Vec<&str> = stderr
        .lines()
        .filter(|l| l.starts_with("error: "))
        .collect();
    assert_eq!(errors.len(), 1, "{stderr}");
    assert!(!stderr.contains("panicked"));
    errors[0].to_owned()
}

#[track_caller]
fn refused(output: &Output) -> String {
    assert!(output.stdout.is_empty());
    fails(output, 2)
}

fn expected() -> Value {
    let file = fs::read_to_string(format!("{PICTURES}expected.json")).unwrap();
    serde_json::from_str(&file).unwrap()
}

fn number(json: &Value, name: &str) -> f64 {
    let value = json[name].as_f64();
    value.unwrap_or_else(|| panic!("{name} in {json}"))
}

fn picture(size: [u32; 2], value: impl Fn(usize) -> [f32; 3]) -> Picture {
    Picture {
        width: size[0],
        height: size[1],
        offset: [0; 2],
        full: size,
        pixels: (0..size[0] as usize * size[1] as usize)
            .map(value)
            .collect(),
    }
}

fn write(folder: &Path, name: &str, picture: &Picture) {
    output::write(&folder.join(name), picture, &[], &Display::LINEAR).unwrap();
}

#[test]
fn figures_agree_with_other_implementations() {
    let folder = folder();
    for kind in ["png", "pfm"] {
        let expected = &expected()[kind];
        let found = json(&run(folder.path(), &format!("a.{kind} b.{kind} --json -")));
        for name in [
            "mse", "rmse", "relmse", "smape", "psnr_db", "flip", "mean_a", "mean_b", "ratio",
        ] {
            let (found, expected) = (number(&found, name), number(expected, name));
            assert!(
                (found - expected).abs() < 1e-6,
                "{kind} {name}: {found}, not {expected}"
            );
        }
    }
    let found = json(&run(folder.path(), "a.png b.png --ppd 30 --json -"));
    let expected = number(&expected()["png_30_pixels_per_degree"], "flip");
    assert!((number(&found, "flip") - expected).abs() < 1e-6);
    assert_eq!(found["flip_settings"]["kind"], "LDR");
}

#[test]
fn flip_agrees_with_its_authors_program_pixel_by_pixel() {
    let png = |name: &str| {
        let path = format!("{PICTURES}{name}.png");
        let image = read_image(path.as_ref(), Encoding::Srgb).unwrap();
        (image.texels, image.width as usize)
    };
    let pfm = |name: &str| {
        let picture = read_pfm(format!("{PICTURES}{name}.pfm").as_ref()).unwrap();
        (picture.pixels, picture.width as usize)
    };
    let expected = expected();
    for (kind, flip_kind, [(a, width), (b, _)]) in [
        ("png", Flip::Ldr, ["a", "b"].map(png)),
        ("pfm", Flip::Hdr, ["a", "b"].map(pfm)),
    ] {
        let comparison = Comparison::new(&a, &b, width, flip_kind, flip::PPD);
        let map = comparison.map(Map::Flip);
        let expected = &expected[kind];
        for pixel in expected["flip_pixels"].as_array().unwrap() {
            let [x, y, error] = [0, 1, 2].map(|i| pixel[i].as_f64().unwrap());
            let found = f64::from(map[y as usize * width + x as usize]);
            assert!(
                (found - error).abs() < 1e-5,
                "{kind} {x} {y}: {found}, not {error}"
            );
        }
        if let Some(exposures) = comparison.exposures {
            let near = |v: f32, name| (f64::from(v) - number(expected, name)).abs() < 1e-5;
            assert!(near(exposures.start, "start_exposure"));
            assert!(near(exposures.stop, "stop_exposure"));
            assert_eq!(exposures.count as f64, number(expected, "exposures"));
        }
    }
}

#[test]
fn a_picture_is_equal_to_itself() {
    let folder = folder();
    for name in ["a.png", "a.pfm"] {
        let limits = "--max mse=0 --max flip=0 --max bias=0 --min psnr=1000";
        let found = json(&run(
            folder.path(),
            &format!("{name} {name} --json - {limits}"),
        ));
        for metric in ["mse", "rmse", "relmse", "smape", "flip"] {
            assert_eq!(number(&found, metric), 0.0, "{metric}");
        }
        assert!(found["psnr_db"].is_null());
        assert_eq!(found["ratio"], 1.0);
    }
    let output = run(folder.path(), "a.png a.png");
    assert!(text(&output.stdout).contains("inf dB"));
}

#[test]
fn tables_go_to_stdout_and_json_to_a_file() {
    let folder = folder();
    let output = run(folder.path(), "a.pfm b.pfm --tiles 10 --json a.json");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for word in [
        "a.pfm, 36 x 28 pixels",
        "HDR-FLIP",
        "relMSE",
        "Worst of 12 tiles",
        "dB",
    ] {
        assert!(table.contains(word), "{word}: {table}");
    }
    let json = fs::read_to_string(folder.path().join("a.json")).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(
        (&json["a"]["file"], &json["width"]),
        (&"a.pfm".into(), &36.into())
    );
    let tiles = json["tiles"].as_array().unwrap();
    assert_eq!(tiles.len(), 12);
    let last = &tiles[11];
    let place = ["x", "y", "width", "height"].map(|name| number(last, name));
    assert_eq!(place, [30.0, 20.0, 6.0, 8.0]);
    let pixels = |t: &Value| number(t, "width") * number(t, "height");
    let sum: f64 = tiles.iter().map(|t| pixels(t) * number(t, "relmse")).sum();
    assert!((sum / (36.0 * 28.0) - number(&json, "relmse")).abs() < 1e-12);
}

#[test]
fn limits_decide_the_exit_code() {
    let folder = folder();
    let run = |arguments: &str| run(folder.path(), &format!("a.png b.png -q {arguments}"));
    let held = run("--max relmse=0.7 --max bias=0.01 --min psnr=17");
    assert_eq!(held.status.code(), Some(0), "{}", text(&held.stderr));
    let message = fails(&run("--max mse=1 --max relMSE=0.5"), 1);
    assert!(
        message.contains("relMSE is 0.6949, above 0.5 by 0.1949"),
        "{message}"
    );
    assert!(!message.contains(" MSE"), "{message}");
    let message = fails(&run("--min psnr=20 --max flip=0.1 --json -"), 1);
    assert!(
        message.contains("PSNR is 17.56 dB, below 20 by 2.441"),
        "{message}"
    );
    assert!(message.contains("FLIP is 0.203"), "{message}");
    for bad in [
        "--max relmse",
        "--max ssim=1",
        "--max psnr=3",
        "--min mse=1",
        "--max mse=x",
    ] {
        refused(&run(bad));
    }
}

#[test]
fn errors_are_drawn_with_a_legend() {
    let folder = folder();
    for map in ["difference", "mse", "rmse", "relMSE", "smape", "flip"] {
        let output = run(
            folder.path(),
            &format!("a.png b.png --map {map} -o e.png -o e.exr"),
        );
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("wrote e.png"));
        let png = image::open(folder.path().join("e.png"))
            .unwrap()
            .into_rgb8();
        // A legend has a least width, and a height.
        assert_eq!((png.width(), png.height()), (336, 48 + 74), "{map}");
        let values = read_exr(&folder.path().join("e.exr")).unwrap();
        assert_eq!((values.width, values.height), (64, 48));
        assert!(
            values
                .pixels
                .iter()
                .all(|p| p[0] == p[1] && p[1].is_finite())
        );
        let mean: f64 = values.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / (64.0 * 48.0);
        if map == "relMSE" {
            assert!((mean - number(&expected()["png"], "relmse")).abs() < 1e-6);
        }
    }
    let output = run(folder.path(), "a.png b.png --scale 1e-9 -o e.png");
    assert!(output.status.success());
    let png = image::open(folder.path().join("e.png"))
        .unwrap()
        .into_rgb8();
    let last = png.get_pixel((336 - 64) / 2 + 30, 20).0;
    assert!(last[0] > 240 && last[1] > 240, "magma ends light: {last:?}");
}

#[test]
fn formats_mix() {
    let folder = folder();
    let grey = picture([64, 48], |_| [0.25; 3]);
    for name in ["grey.exr", "grey.pfm", "grey.png"] {
        write(folder.path(), name, &grey);
    }
    for pair in ["grey.exr grey.pfm", "grey.pfm grey.exr"] {
        let found = json(&run(folder.path(), &format!("{pair} --max mse=0 --json -")));
        assert_eq!(found["flip_settings"]["kind"], "HDR");
    }
    // Eight bits are a little off.
    let found = json(&run(
        folder.path(),
        "grey.png grey.exr --max flip=0.01 --json -",
    ));
    assert_eq!(found["flip_settings"]["kind"], "LDR");
    assert!(number(&found, "mse") > 0.0 && number(&found, "psnr_db") > 50.0);
    let path = folder.path().join("wide.png");
    let code = (0.25f64.powf(1.0 / 2.4) * 1.055 - 0.055) * 65535.0;
    image::ImageBuffer::from_pixel(64, 48, image::Rgb([code.round() as u16; 3]))
        .save(path)
        .unwrap();
    let found = json(&run(folder.path(), "wide.png grey.exr --json -"));
    assert!(number(&found, "rmse") < 1e-5);
}

#[test]
fn pixels_that_are_not_finite_are_told_and_left_out() {
    let folder = folder();
    let clean = picture([20, 10], |i| [0.1 * i as f32; 3]);
    let mut dirty = clean.clone();
    dirty.pixels[47] = [0.0, f32::NAN, 1.0];
    dirty.pixels[48] = [f32::INFINITY; 3];
    write(folder.path(), "clean.exr", &clean);
    write(folder.path(), "dirty.exr", &dirty);
    let output = run(
        folder.path(),
        "dirty.exr clean.exr --json - -o e.png -o e.exr",
    );
    let warning = text(&output.stderr);
    assert!(
        warning
            .contains("warning: dirty.exr: 2 pixels are not finite, the first in column 7, row 2"),
        "{warning}"
    );
    let found = json(&output);
    assert_eq!((number(&found, "mse"), number(&found, "flip")), (0.0, 0.0));
    assert_eq!(found["a"]["not_finite"]["pixels"], 2);
    assert!(found["b"]["not_finite"].is_null());
    assert!(read_exr(&folder.path().join("e.exr")).unwrap().pixels[47][0].is_nan());
    // A check is not passed by pixels that are left out; a reference may have them.
    let message = fails(&run(folder.path(), "dirty.exr clean.exr --max mse=1"), 1);
    assert!(
        message.contains("dirty.exr: 2 pixels are not finite"),
        "{message}"
    );
    assert!(
        run(folder.path(), "clean.exr dirty.exr --max mse=1")
            .status
            .success()
    );
    write(
        folder.path(),
        "nothing.pfm",
        &picture([20, 10], |_| [f32::NAN; 3]),
    );
    let message = refused(&run(folder.path(), "nothing.pfm clean.exr"));
    assert!(message.contains("no pixel is finite"), "{message}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let folder = folder();
    let refused = |arguments: &str| refused(&run(folder.path(), arguments));
    let message = refused("a.png b.pfm");
    assert!(
        message.contains("a.png is 64 x 48 pixels, b.pfm is 36 x 28"),
        "{message}"
    );
    assert!(refused("missing.exr a.png").contains("missing.exr"));
    assert!(refused("a.png missing.pfm").contains("missing.pfm"));
    assert!(refused("a.png .").contains("extension"));
    let png = fs::read(folder.path().join("a.png")).unwrap();
    let pfm = fs::read(folder.path().join("a.pfm")).unwrap();
    fs::write(folder.path().join("short.png"), &png[..png.len() / 2]).unwrap();
    fs::write(folder.path().join("short.pfm"), &pfm[..pfm.len() / 2]).unwrap();
    fs::write(folder.path().join("text.exr"), "no picture").unwrap();
    fs::write(folder.path().join("empty.png"), "").unwrap();
    fs::write(folder.path().join("a.jpg"), "").unwrap();
    for name in ["short.png", "short.pfm", "text.exr", "empty.png", "a.jpg"] {
        let message = refused(&format!("{name} a.png"));
        assert!(message.contains(name), "{message}");
    }
    let depth = exr::prelude::SpecificChannels::build()
        .with_channel::<f32>("Z")
        .with_pixel_fn(|_| (1.0,));
    let image = exr::prelude::Image::from_channels((64, 48), depth);
    exr::prelude::WritableImage::write(&image)
        .to_file(folder.path().join("depth.exr"))
        .unwrap();
    assert!(refused("depth.exr a.png").contains("channels"));
    for bad in [
        "a.png",
        "a.png b.png --tiles 0",
        "a.png b.png --ppd 0",
        "a.png b.png --scale 0",
        "a.png b.png --map psnr",
        "a.png b.png -o e.jpg",
        "a.png b.png -o missing/e.png",
        "a.png b.png --json missing/e.json",
    ] {
        refused(bad);
    }
}
