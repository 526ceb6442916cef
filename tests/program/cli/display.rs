//! What is shown rather than kept: .png files beside others, exposure and tone curves, `convert`;
//! and what shells and `man` are told.

use super::{Folder, TINY};
use std::fs;

#[test]
fn a_png_lies_beside_every_exr() {
    let folder = Folder::new();
    folder
        .run(&format!("render {TINY} -q -o a.exr -o b.pfm"))
        .succeeds();
    assert_eq!(folder.files(), ["a.exr", "a.png", "b.pfm"]);
    folder
        .run(&format!("render {TINY} -q -o c.exr --no-png"))
        .succeeds();
    folder
        .run(&format!("render {TINY} -q -o d.exr -o e.png"))
        .succeeds();
    assert_eq!(
        folder.files(),
        ["a.exr", "a.png", "b.pfm", "c.exr", "d.exr", "e.png"]
    );
}

/// A texture of that name is not replaced, and the render goes on.
#[test]
fn it_replaces_nothing_that_was_read() {
    let folder = Folder::new();
    folder
        .run(&format!("render {TINY} -q -o wood.png"))
        .succeeds();
    folder.write(
        "wood.pbrt",
        "Film \"image\" \"integer xresolution\" 8 \"integer yresolution\" 8\nWorldBegin\n\
         Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"wood.png\"\n\
         LightSource \"infinite\" Material \"matte\" \"texture Kd\" \"t\"\n\
         Shape \"disk\"\nWorldEnd\n",
    );
    let before = fs::read(folder.path().join("wood.png")).unwrap();
    // The program finds the command in the name.
    folder
        .run("wood.pbrt -q --mutations 2 --bootstrap 500 --chains 64")
        .succeeds();
    assert_eq!(folder.files(), ["wood.exr", "wood.pbrt", "wood.png"]);
    assert!(fs::read(folder.path().join("wood.png")).unwrap() == before);
}

#[test]
fn pictures_are_converted() {
    let folder = Folder::new();
    // Four pixels: 0.25, 1, 4 and black.
    let mut pfm = b"PF\n4 1\n-1.0\n".to_vec();
    for v in [0.25f32, 1.0, 4.0, 0.0] {
        (0..3).for_each(|_| pfm.extend(v.to_le_bytes()));
    }
    fs::write(folder.path().join("a.pfm"), pfm).unwrap();
    let red = |flags: &str| {
        folder.run(&format!("convert a.pfm -q {flags}")).succeeds();
        let png = image::open(folder.path().join("a.png")).unwrap();
        let png = png.into_rgb8();
        [0, 1, 2, 3].map(|x| png.get_pixel(x, 0)[0])
    };
    assert_eq!(red("--tonemap linear"), [137, 255, 255, 0]);
    assert_eq!(red("--tonemap linear --exposure -2"), [71, 137, 255, 0]);
    // The brightest of three is white: 99 % are not above it.
    assert_eq!(red("--tonemap linear --exposure auto")[1], 255);
    let [dark, white, bright, black] = red("");
    assert!(
        dark == 137 && black == 0 && white < bright && bright >= 254,
        "{white} {bright}"
    );
    let filmic = red("--tonemap filmic");
    assert!(filmic.windows(2).take(2).all(|p| p[0] < p[1]), "{filmic:?}");
    folder.run("convert a.pfm b.exr c.pfm").succeeds();
    assert_eq!(folder.exr("b.exr").pixels[2], [4.0; 3]);
    for (flags, what) in [
        ("convert a.pfm a.pfm", "would overwrite"),
        ("convert none.exr", "none.exr"),
        ("convert a.pfm b.jpg", "extension"),
        ("convert a.pfm --exposure much", "nor auto"),
        ("convert a.pfm --tonemap odd", "shoulder"),
    ] {
        let output = folder.run(flags);
        assert_eq!(output.code(), 2, "{flags}");
        assert!(output.stderr().contains(what), "{}", output.stderr());
    }
}

#[test]
fn shells_and_man_know_the_program() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = folder.run(&format!("completions {shell}")).succeeds();
        assert!(script.stdout().contains("target-error"), "{shell}");
    }
    let page = |command: &str| folder.run(&format!("man {command}")).succeeds().stdout();
    assert!(page("").contains("converge"));
    assert!(page("render").contains("target\\-error"));
    assert!(folder.run("man dance").fails(2).contains("render"));
    assert_eq!(
        folder.run("render -V").succeeds().stdout(),
        folder
            .run("-V")
            .stdout()
            .replace("phalanx", "phalanx-render")
    );
}

#[test]
fn quality_is_a_target_error() {
    let folder = Folder::new();
    let ran = folder
        .run("render --resolution 16x16 --quality draft --time 1m --stats s.json -o a.pfm")
        .succeeds();
    assert!(ran.stderr().contains("--target-error"), "{}", ran.stderr());
    let text = fs::read_to_string(folder.path().join("s.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(json["relative_error"].as_f64().unwrap() <= 0.2);
    let message = folder
        .run("render --quality good --target-error 0.1")
        .fails(2);
    assert!(message.contains("cannot be used with"), "{message}");
}
