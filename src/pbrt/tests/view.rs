//! Cameras, films, filters, integrators and options.

use super::*;

// Camera, film, integrator.

fn header(header: &str) -> Scene {
    loaded(&format!("{header}\nWorldBegin\nShape \"sphere\"\n"))
}

#[test]
fn cameras() {
    let s = header(
        "Film \"rgb\" \"integer xresolution\" 200 \"integer yresolution\" 100\nScale -2 2 2 LookAt 0 0 -5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 90 \"float lensradius\" 4 \"float focaldistance\" 10",
    );
    let c = s.camera;
    let scale = s.space.scale as f32;
    // World units are halves of camera units.
    assert!(
        (c.lens_radius / scale - 2.0).abs() < 1e-6 && (c.focal_distance / scale - 5.0).abs() < 1e-6
    );
    for (a, b) in c.screen.iter().zip([-2.0, 2.0, -1.0, 1.0]) {
        assert!((a - b).abs() < 1e-6);
    }
    let column = |j: usize| Vec3::from(c.to_world.map(|row| row[j]));
    near(column(2), Vec3::Z);
    near(column(1), Vec3::Y);
    near(column(0), Vec3::NEG_X);
    near(column(3) / scale, Vec3::new(0.0, 0.0, -5.0));

    let s = header(
        "Film \"rgb\" \"integer xresolution\" 100 \"integer yresolution\" 200\nCamera \"perspective\" \"float fov\" 60",
    );
    assert!((s.camera.screen[3] - 2.0 * 30f32.to_radians().tan()).abs() < 1e-6);
    assert_eq!(s.camera.lens_radius, 0.0);
    let s = header("Film \"rgb\"\nCamera \"orthographic\" \"float screenwindow\" [-3 3 -2 2]");
    assert!((s.camera.screen[1] / s.space.scale as f32 - 3.0).abs() < 1e-6);

    for (text, message) in [
        (
            "Scale 1 2 1 Camera \"perspective\"",
            "t.pbrt:1:13: Camera \"perspective\": its transform shears",
        ),
        (
            "Camera \"perspective\" \"float fov\" 180",
            "t.pbrt:1:1: Camera \"perspective\": field of view 180",
        ),
        (
            "Camera \"realistic\"",
            "t.pbrt:1:1: Camera \"realistic\": needs a lens file",
        ),
        (
            "Camera \"perspective\" \"float screenwindow\" [-1 3e38 -1 1]",
            "t.pbrt:1:1: Camera \"perspective\": its screen window is out of all proportion",
        ),
        (
            "Scale 0 1 1 Camera \"perspective\"",
            "t.pbrt:1:13: Camera \"perspective\": the current transform",
        ),
    ] {
        let error = try_load(&format!("{text} WorldBegin")).expect_err("an error");
        assert!(error.starts_with(message), "{error}");
    }
}

#[test]
fn films_and_filters() {
    let s = header(
        "Film \"image\" \"integer xresolution\" [10] \"integer yresolution\" 20 \"float cropwindow\" [.25 .5 0 1] \"float scale\" 2 \"string filename\" [\"a.exr\"]\nPixelFilter \"gaussian\" \"float xwidth\" 3",
    );
    assert_eq!(
        (s.film.width, s.film.height, s.film.crop, s.film.scale),
        (10, 20, [3, 5, 0, 20], 2.0)
    );
    assert_eq!(s.film.filename.as_deref(), Some("a.exr"));
    assert_eq!(
        s.film.filter,
        Filter {
            radius: Vec2::new(3.0, 2.0),
            kind: FilterKind::Gaussian { alpha: 2.0 }
        }
    );
    let s = header(
        "Film \"rgb\" \"integer pixelbounds\" [1 2 3 4] \"float iso\" 200 \"float exposuretime\" .25",
    );
    assert_eq!(
        (s.film.width, s.film.height, s.film.crop, s.film.scale),
        (1280, 720, [1, 2, 3, 4], 0.5)
    );
    assert_eq!(
        s.film.filter,
        Filter {
            radius: Vec2::splat(1.5),
            kind: FilterKind::Gaussian { alpha: 2.0 }
        }
    );
    assert_eq!(
        v3("").film.filter,
        Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box
        }
    );
    for bad in [
        "\"integer xresolution\" 0",
        "\"float cropwindow\" [.5 .5 0 1]",
        "\"integer xresolution\" 99999999999",
    ] {
        assert!(
            try_load(&format!("Film \"rgb\" {bad} WorldBegin")).is_err(),
            "{bad}"
        );
    }
}

#[test]
fn integrators() {
    let s = header(
        "Film \"rgb\" Sampler \"independent\" \"integer pixelsamples\" 7 Integrator \"mlt\" \"integer maxdepth\" 9 \"integer chains\" 3 \"float sigma\" .1",
    );
    let expected = IntegratorSettings {
        max_depth: 9,
        chains: 3,
        sigma: 0.1,
        pixel_samples: 7,
        ..Default::default()
    };
    assert_eq!(s.integrator, expected);
    let s = header("Film \"rgb\" Integrator \"path\" \"float rrthreshold\" 1");
    assert_eq!(
        (s.integrator.kind, s.integrator.max_depth, s.warnings.len()),
        (IntegratorKind::Pt, 5, 0)
    );
    let s = header("Film \"rgb\" Integrator \"bdpt\"");
    assert_eq!(
        (s.integrator.kind, s.warnings.len()),
        (IntegratorKind::Bdpt, 0)
    );
    assert!(!s.integrator.strategies);
    for flag in ["visualizestrategies", "visualizeweights"] {
        let text = format!("Integrator \"bdpt\" \"integer maxdepth\" 3 \"bool {flag}\" true");
        let s = header(&format!("Film \"rgb\" {text}"));
        assert!(s.integrator.strategies && s.warnings.is_empty());
        assert_eq!(s.integrator.max_depth, 3);
    }
    let s = header("Film \"rgb\" Integrator \"lightpath\" \"integer maxdepth\" 4");
    assert_eq!(
        (s.integrator.kind, s.integrator.max_depth, s.warnings.len()),
        (IntegratorKind::Lt, 4, 0)
    );
    let s = header("Film \"rgb\" Integrator \"sppm\"");
    assert_eq!(
        (s.integrator.kind, s.warnings.len()),
        (IntegratorKind::Auto, 1)
    );
}

#[test]
fn options_have_a_name_and_a_value() {
    let seed = |option: &str, sampler: &str| {
        header(&format!("{option} Film \"rgb\" {sampler}"))
            .integrator
            .seed
    };
    for option in [
        "Option \"seed\" 3",
        "Option \"integer seed\" 3",
        "Option \"Seed\" [ 3 ]",
    ] {
        assert_eq!(seed(option, ""), 3, "{option}");
        assert_eq!(seed(option, "Sampler \"halton\" \"integer seed\" 7"), 7);
        assert_eq!(seed(option, "Sampler \"halton\""), 3);
    }
    for option in [
        "\"disablepixeljitter\" false",
        "\"disable-texture_filtering\" true",
        "\"disablewavelengthjitter\" true",
        "\"bool disablewavelengthjitter\" [true]",
        "\"displacementedgescale\" 2.5",
        "\"msereferenceimage\" \"a.exr\"",
        "\"msereferenceout\" \"a.txt\"",
        "\"rendercoordsys\" \"world\"",
        "\"forcediffuse\" false",
        "\"pixelstats\" true",
        "\"wavefront\" true",
    ] {
        let s = header(&format!("Option {option} Film \"rgb\""));
        assert!(s.warnings.is_empty(), "{option}: {:?}", s.warnings);
    }
    for (option, what) in [
        ("\"forcediffuse\" true", "would make all surfaces diffuse"),
        ("\"disablepixeljitter\" true", "would look at the centres"),
        ("\"wavefront\" 1", "must be true or false"),
        ("\"seed\" \"x\"", "must be a whole number"),
        (
            "\"rendercoordsys\" \"moon\"",
            "must be camera, cameraworld or world",
        ),
        ("\"msereferenceout\" 3", "must be a string in quotes"),
        ("\"seed\"", "expected the value"),
        ("seed 3", "expected the name of an option"),
    ] {
        let error = try_load(&format!("Option {option}")).expect_err(option);
        assert!(
            error.contains(what) || error.contains("the file ends"),
            "{error}"
        );
    }
    let s = header("Option \"nosuch\" 1 Film \"rgb\"");
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
}

#[test]
fn exposures_are_as_long_as_the_shutter_is_open() {
    let scale = |camera: &str, film: &str| {
        header(&format!(
            "Camera \"perspective\" {camera} Film \"rgb\" {film}"
        ))
        .film
        .scale
    };
    let shutter = "\"float shutteropen\" .25 \"float shutterclose\" .5";
    assert_eq!(scale(shutter, ""), 0.25);
    assert_eq!(scale(shutter, "\"float iso\" 400"), 1.0);
    assert_eq!(scale("", "\"float iso\" 50"), 0.5);
    assert_eq!(scale("\"float shutterclose\" 2", ""), 2.0);
    assert_eq!(v3("").film.scale, 1.0);
    let error = try_load("Film \"rgb\" Camera \"perspective\" \"float shutterclose\" 0 WorldBegin");
    assert!(
        error
            .expect_err("closed")
            .contains("no light reaches the film")
    );
}

#[test]
fn films_have_a_sensor_and_a_colour_space() {
    let film = |text: &str| header(text).film;
    let plain = film("Film \"rgb\" \"string sensor\" \"cie1931\"");
    assert_eq!(
        (plain.colour, plain.chromaticities, plain.clamp),
        (None, None, None)
    );
    // Light of the colour that the film is balanced for is grey.
    let warm = film("Film \"rgb\" \"float whitebalance\" 3000")
        .colour
        .expect("a matrix");
    let rgb = crate::pbrt::spectrum::blackbody(3000.0 * 1.4388 / 1.4380);
    let seen = warm.map(|r| r[0] * rgb[0] + r[1] * rgb[1] + r[2] * rgb[2]);
    assert!(seen.iter().all(|c| (c - 1.0).abs() < 2e-3), "{seen:?}");
    let camera = "Film \"rgb\" \"string sensor\" \"canon_eos_5d_mkiv\"";
    let s = header(camera);
    assert_eq!(s.warnings.len(), 1, "{:?}", s.warnings);
    assert_eq!(
        s.film.colour,
        film("Film \"rgb\" \"float whitebalance\" 6500").colour
    );
    assert!(try_load("Film \"rgb\" \"string sensor\" \"nokia\" WorldBegin").is_err());
    // Linear sRGB red in the primaries of BT.2020 (BT.2087).
    let wide = film("ColorSpace \"rec2020\" Film \"rgb\"");
    let red = wide.colour.expect("a matrix").map(|r| r[0]);
    for (a, b) in red.iter().zip([0.6274, 0.0691, 0.0164]) {
        assert!((a - b).abs() < 1e-3, "{red:?}");
    }
    assert_eq!(wide.chromaticities.expect("primaries")[..2], [0.708, 0.292]);
    let clamp = film("Film \"rgb\" \"float maxcomponentvalue\" 8 \"float iso\" 200").clamp;
    assert_eq!(clamp, Some(Clamp::Xyz(4.0)));
    let cut = Clamp::Xyz(4.0).of([10.0; 3]);
    // The Z of white is 1.0888.
    assert!(
        cut.iter().all(|c| (c - 4.0 / 1.0888).abs() < 1e-3),
        "{cut:?}"
    );
    assert_eq!(Clamp::Xyz(4.0).of([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    assert_eq!(
        Clamp::Luminance(1.0)
            .of([4.0; 3])
            .map(|c| (c * 1e4).round()),
        [1e4; 3]
    );
}
