//! Sizes and crop windows that are changed after a scene is loaded.

use std::path::Path;

use crate::pbrt::load_str;
use crate::scene::Scene;
use crate::scene::film::Film;

fn scene(camera: &str, width: u32, height: u32) -> Scene {
    let text = format!(
        "Film \"image\" \"integer xresolution\" {width} \"integer yresolution\" {height}\n\
         Camera {camera}\nWorldBegin\nShape \"sphere\"\nWorldEnd\n"
    );
    load_str(&text, "test.pbrt", Path::new("")).unwrap()
}

/// Loading at a size and changing to it are the same, for pbrt's own windows.
#[test]
fn framing_is_that_of_a_scene_loaded_at_this_size() {
    for camera in [
        "\"perspective\" \"float fov\" 38",
        "\"orthographic\"",
        "\"perspective\" \"float fov\" 90",
    ] {
        let sizes = [(400, 400), (640, 360), (90, 160), (32, 32), (1000, 1)];
        for (w, h) in sizes {
            for (w2, h2) in sizes {
                let mut changed = scene(camera, w, h);
                changed.set_resolution(w2, h2).unwrap();
                let loaded = scene(camera, w2, h2);
                assert_eq!(changed.film, loaded.film);
                for (a, b) in changed.camera.screen.iter().zip(loaded.camera.screen) {
                    assert!((a - b).abs() <= 1e-6 * b.abs(), "{a} {b}");
                }
            }
        }
    }
}

#[test]
fn windows_of_the_file_keep_their_centre_direction_and_pixel_shape() {
    let mut s = scene(
        "\"perspective\" \"float fov\" 90 \"float screenwindow\" [3 1 0 1]",
        200,
        100,
    );
    s.set_resolution(100, 100).unwrap();
    assert_eq!(s.camera.screen, [2.5, 1.5, 0.0, 1.0]);
    s.set_resolution(50, 50).unwrap();
    assert_eq!(s.camera.screen, [2.5, 1.5, 0.0, 1.0]);
}

#[test]
fn crop_windows_keep_their_fractions() {
    let mut s = scene("\"perspective\"", 100, 100);
    s.film.set_crop([0.25, 0.75, 0.0, 0.5]).unwrap();
    assert_eq!(s.film.crop, [25, 75, 0, 50]);
    s.set_resolution(200, 10).unwrap();
    assert_eq!(s.film.crop, [50, 150, 0, 5]);
    s.set_resolution(1, 1).unwrap();
    assert_eq!(s.film.crop, [0, 1, 0, 1]);
}

#[test]
fn adjacent_crops_tile() {
    let mut s = scene("\"perspective\"", 101, 7);
    let mut next = 0;
    for i in 0..10 {
        let (a, b) = (i as f32 / 10.0, (i + 1) as f32 / 10.0);
        s.film.set_crop([a, b, 0.0, 1.0]).unwrap();
        assert_eq!(s.film.crop[0], next);
        next = s.film.crop[1];
    }
    assert_eq!(next, 101);
    assert!(s.film.set_crop([0.991, 0.999, 0.0, 0.1]).is_err());
}

#[test]
fn sizes_have_limits() {
    assert!(Film::check_size(0, 1).is_err());
    assert!(Film::check_size(1 << 17, 1 << 14).is_ok());
    assert!(Film::check_size(1 << 17, (1 << 14) + 1).is_err());
    assert!(Film::check_size((1 << 17) + 1, 1).is_err());
}
