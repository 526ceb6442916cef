//! The internal space: centred, of unit size, whatever the file has.

use super::*;

// Space and geometry.

#[test]
fn internal_space_is_centred_and_of_unit_size() {
    for shift in [0.0, 1e3, 1e6] {
        for size in [1e-4, 1.0, 1e6] {
            let s = v4(&format!(
                "Translate {shift} 0 0 Scale {size} {size} {size} {V4_TRIANGLE} Shape \"sphere\" \"float radius\" 2"
            ));
            let radius = (s.bounds[1] - s.bounds[0]).length() / 2.0;
            assert!((0.49..=1.01).contains(&radius), "{radius}");
            assert!((s.bounds[0] + s.bounds[1]).length() < 1e-6);
            assert_eq!(s.space.scale.log2().fract(), 0.0);
            near(
                corners(&s, 0)[1],
                Vec3::new(shift as f32 + size as f32, 0.0, 0.0),
            );
        }
    }
}

/// Neither the window in units of the scene nor its area is one that `f32` holds.
#[test]
fn windows_out_of_proportion_are_refused() {
    for (window, radius, good) in [
        ("-1 1e30 2 1", "1e-30", false),
        ("-1 1 -1 1", "1e-6", true),
        ("0 1e-20 0 1", "1", false),
    ] {
        let text = format!(
            "Film \"rgb\" Camera \"orthographic\" \"float screenwindow\" [{window}] WorldBegin Shape \"sphere\" \"float radius\" {radius}"
        );
        assert_eq!(try_load(&text).is_ok(), good, "{window}");
    }
}

#[test]
fn texture_coordinates_beyond_f32_are_left_out() {
    let s = v4(&format!("{V4_TRIANGLE} \"point2 uv\" [1e100 0 .5 .5 1 1]"));
    assert_eq!([s.vertices[0].uv, s.vertices[1].uv], [[0.0; 2], [0.5; 2]]);
}

/// The sphere's size is less than the distance of neighbouring `f64` where it is.
#[test]
fn spheres_beyond_the_digits_of_f64_fit_into_the_space() {
    for place in [
        "Translate 0 -3e38 -1e10 Scale 1 1e10 -2",
        "Translate 1e-20 1e-6 0 Scale 1e-30 1e-30 1e-30",
    ] {
        let s = v4(&format!("{place} Shape \"sphere\""));
        assert!(
            s.bounds.iter().all(|b| b.length() <= 1.001),
            "{:?}",
            s.bounds
        );
        assert!(s.bounds[1].length() >= 0.5);
    }
}

#[test]
fn far_scenes_keep_the_digits_of_the_text() {
    // Neighbouring vertices that f32 could not tell apart at this distance.
    let s = v4(
        "Shape \"trianglemesh\" \"point3 P\" [1000000.001 0 0  1000000.002 0 0  1000000.001 0.001 0]",
    );
    let [a, b, _] = s.triangles[0]
        .v
        .map(|i| Vec3::from(s.vertices[i as usize].p));
    let edge = f64::from((b - a).length()) / s.space.scale;
    assert!((edge - 0.001).abs() < 1e-9, "{edge}");
}

#[test]
fn geometry_beyond_all_measure_is_left_out() {
    let text =
        "Film \"rgb\" WorldBegin Rotate 1 0 0 1 Scale 0 -1e308 0 Shape \"disk\" \"float radius\" 2";
    let s = try_load(text).expect("a scene without the disk");
    assert!(s.triangles.is_empty() && s.vertices.iter().all(|v| Vec3::from(v.p).is_finite()));
    assert!(s.bounds.iter().all(|b| b.length() <= 1.001));
}
