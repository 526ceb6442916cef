//! Changing the size of the picture and the part of it that is rendered, after a scene is loaded.

use super::{Camera, Film, Scene};

/// Why a film cannot have a size or a crop window.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    #[error("{width} x {height}: a side has 1 to {most} pixels", most = Film::MAX_SIDE)]
    Side { width: u64, height: u64 },
    #[error("{width} x {height} pixels are more than 2^31")]
    Pixels { width: u64, height: u64 },
    #[error("the crop window {0:?} holds no pixel of {1} x {2}")]
    EmptyCrop([f32; 4], u32, u32),
}

impl Film {
    /// Pixels of a side: raster positions stay exact to a fraction of a pixel in `f32`.
    pub const MAX_SIDE: u64 = 1 << 17;
    /// Pixels of a picture.
    pub const MAX_PIXELS: u64 = 1 << 31;

    /// Pixels of the crop window.
    pub fn crop_pixels(&self) -> u64 {
        let [x0, x1, y0, y1] = self.crop.map(u64::from);
        (x1 - x0) * (y1 - y0)
    }

    /// The size, if a film can have it.
    pub fn check_size(width: u64, height: u64) -> Result<(u32, u32), FilmError> {
        let side = 1..=Self::MAX_SIDE;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(FilmError::Side { width, height });
        }
        if width * height > Self::MAX_PIXELS {
            return Err(FilmError::Pixels { width, height });
        }
        Ok((width as u32, height as u32))
    }

    /// Renders only the pixels from `ceil(x0 * width)` up to, not including, `ceil(x1 * width)`, and likewise in `y`
    /// from the top. Rounded up at both ends, as pbrt does, so that adjacent windows tile.
    pub fn set_crop(&mut self, [x0, x1, y0, y1]: [f32; 4]) -> Result<(), FilmError> {
        let edge = |x: f32, size: u32| (size as f32 * x.clamp(0.0, 1.0)).ceil() as u32;
        let (w, h) = (self.width, self.height);
        let crop = [edge(x0, w), edge(x1, w), edge(y0, h), edge(y1, h)];
        if crop[0] >= crop[1] || crop[2] >= crop[3] {
            return Err(FilmError::EmptyCrop([x0, x1, y0, y1], w, h));
        }
        self.crop = crop;
        Ok(())
    }
}

impl Scene {
    /// Gives the picture another size and keeps its framing.
    ///
    /// pbrt's screen window is `[-1, 1]` along the shorter side of the film and as much wider along the other as the film
    /// is. So where the shape changes, the shorter side goes on showing what it showed, the other side shows more or less,
    /// and pixels keep their shape (square, unless the file stretched them by a window of its own). The crop window keeps its
    /// fractions of the film, rounded up at both ends, and at least one pixel.
    pub fn set_resolution(&mut self, width: u32, height: u32) -> Result<(), FilmError> {
        Film::check_size(width.into(), height.into())?;
        let film = &mut self.film;
        self.camera.reshape(
            [film.width, film.height].map(f64::from),
            [width, height].map(f64::from),
        );
        let [x0, x1, y0, y1] = film.crop;
        let (x0, x1) = resize_interval(x0, x1, film.width, width);
        let (y0, y1) = resize_interval(y0, y1, film.height, height);
        film.crop = [x0, x1, y0, y1];
        (film.width, film.height) = (width, height);
        Ok(())
    }
}

impl Camera {
    /// Fits the screen window to a film of `new` pixels where it fitted one of `old`.
    fn reshape(&mut self, old: [f64; 2], new: [f64; 2]) {
        if old[0] * new[1] == old[1] * new[0] {
            return;
        }
        let [x0, x1, y0, y1] = self.screen.map(f64::from);
        // Half extents; negative where the file mirrors the picture.
        let half = [(x1 - x0) / 2.0, (y1 - y0) / 2.0];
        let size = half.map(f64::abs);
        let pixel_aspect = size[0] / size[1] * old[1] / old[0];
        let aspect = pixel_aspect * new[0] / new[1];
        let short = size[0].min(size[1]);
        let wanted = if aspect > 1.0 {
            [short * aspect, short]
        } else {
            [short, short / aspect]
        };
        let centre = [(x0 + x1) / 2.0, (y0 + y1) / 2.0];
        for axis in 0..2 {
            let half = half[axis].signum() * wanted[axis];
            self.screen[2 * axis] = (centre[axis] - half) as f32;
            self.screen[2 * axis + 1] = (centre[axis] + half) as f32;
        }
    }
}

/// `[a, b)` of `old` pixels as an interval of `new` pixels.
fn resize_interval(a: u32, b: u32, old: u32, new: u32) -> (u32, u32) {
    let edge = |x: u32| (u64::from(x) * u64::from(new)).div_ceil(u64::from(old)) as u32;
    let (a, b) = (edge(a).min(new - 1), edge(b));
    (a, b.max(a + 1))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::load_str;

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
}
