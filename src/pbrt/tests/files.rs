//! Files that include others, and what is too much of them.

use super::*;

// Files.

#[test]
fn includes() {
    let dir = tempfile::tempdir().expect("a folder");
    let write =
        |name: &str, text: &str| std::fs::write(dir.path().join(name), text).expect("written");
    std::fs::create_dir(dir.path().join("sub")).expect("a folder");
    // Names are relative to the main file's folder everywhere.
    write(
        "main.pbrt",
        "Film \"rgb\" WorldBegin Include \"sub/a.pbrt\" Shape \"sphere\"",
    );
    write("sub/a.pbrt", "Translate 1 0 0 Import \"sub/b.pbrt\"");
    write(
        "sub/b.pbrt",
        "Translate 5 0 0 Shape \"sphere\" \"float radius\" 2",
    );
    let s = crate::pbrt::load(&dir.path().join("main.pbrt")).expect("loads");
    assert_eq!(s.spheres.len(), 2);
    let distance =
        (s.spheres[0].to_world[0][3] - s.spheres[1].to_world[0][3]) / s.space.scale as f32;
    assert!((distance - 5.0).abs() < 1e-5);

    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut gz, b"Film \"rgb\" WorldBegin Shape \"sphere\"")
        .expect("compressed");
    std::fs::write(
        dir.path().join("z.pbrt.gz"),
        gz.finish().expect("compressed"),
    )
    .expect("written");
    assert_eq!(
        crate::pbrt::load(&dir.path().join("z.pbrt.gz"))
            .expect("loads")
            .spheres
            .len(),
        1
    );

    write(
        "cycle.pbrt",
        "Film \"rgb\" WorldBegin\n Include \"sub/c.pbrt\"",
    );
    write("sub/c.pbrt", "\nInclude \"cycle.pbrt\"");
    let error = crate::pbrt::load(&dir.path().join("cycle.pbrt"))
        .expect_err("a cycle")
        .to_string();
    assert!(
        error.contains("sub/c.pbrt:2:1: Include: ") && error.contains("includes itself"),
        "{error}"
    );

    let error = crate::pbrt::load(&dir.path().join("none.pbrt"))
        .expect_err("no file")
        .to_string();
    assert!(error.contains("none.pbrt"), "{error}");
}

#[test]
fn files_that_multiply_are_stopped() {
    let dir = tempfile::tempdir().expect("a folder");
    for i in 0..40 {
        let next = format!("Include \"{}.pbrt\" ", i + 1);
        let text = if i == 39 {
            String::new()
        } else {
            next.repeat(2)
        };
        std::fs::write(dir.path().join(format!("{i}.pbrt")), text).expect("written");
    }
    let main = "Film \"rgb\" WorldBegin Include \"0.pbrt\"";
    let error = load_str(main, "t", dir.path())
        .expect_err("too many")
        .to_string();
    assert!(error.contains("too many included files"), "{error}");
}

#[test]
fn deep_nesting_does_not_recurse() {
    let n = 10_000;
    let s = v4(&format!(
        "{}{}",
        "AttributeBegin ".repeat(n),
        "AttributeEnd ".repeat(n)
    ));
    assert!(s.warnings.is_empty());
    assert!(v4_error(&"AttributeBegin ".repeat(100_000)).contains("blocks are open"));
}

#[test]
fn hostile_sizes_fail_before_allocation() {
    for text in [
        "Shape \"loopsubdiv\" \"integer levels\" 13 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2 0 1 2]",
        "Shape \"loopsubdiv\" \"integer levels\" 1000000 \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 -1]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 4294967296]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1] \"integer indices\" [0 1 1]",
        "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]",
    ] {
        v4_error(text);
    }
}

/// Textures that each name another twice would take 2^40 steps; those that each name another once,
/// a stack of 100 000 frames.
#[test]
fn textures_that_multiply_are_stopped() {
    let first = "Texture \"t\" \"spectrum\" \"checkerboard\"\n";
    for (kind, count) in [
        ("mix\" \"texture tex1\" \"t\" \"texture tex2\" \"t", 40),
        (
            "checkerboard\" \"float uscale\" 2 \"texture tex1\" \"t",
            100_000,
        ),
    ] {
        let next = format!("Texture \"t\" \"spectrum\" \"{kind}\"\n");
        let used = format!("Material \"diffuse\" \"texture reflectance\" \"t\" {V4_TRIANGLE}");
        let error = v4_error(&(first.to_owned() + &next.repeat(count) + &used));
        assert!(
            error.contains(": is made of more than 1000 textures; bake it into an image"),
            "{error}"
        );
        v4(&(first.to_owned() + &next.repeat(8) + &used));
    }
}

#[test]
fn names_with_line_ends_make_messages_of_one_line() {
    let error = v4_error("Shape \"a\\nb\u{1b}\"");
    assert!(
        error.starts_with("t.pbrt:3:1: Shape \"a\\nb\\u{1b}\": this shape"),
        "{error}"
    );
    let error = v4_error("Shape \"sphere\" \"float r\\nx\" y");
    assert!(!error.contains(char::is_control), "{error}");
}

#[test]
fn parameters_are_counted() {
    let many = |n: usize| {
        (0..n)
            .map(|i| format!(" \"float a{i}\" 1"))
            .collect::<String>()
    };
    assert_eq!(
        v4(&format!("Shape \"sphere\"{}", many(1000))).spheres.len(),
        1
    );
    let error = v4_error(&format!("Shape \"sphere\"{}", many(1001)));
    assert!(
        error.contains("parameter \"a1000\": is one of too many"),
        "{error}"
    );
}
