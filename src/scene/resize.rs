//! Changing the size of the picture, after a scene is loaded.

use super::camera::Camera;
use super::film::{Film, FilmError};
use super::whole::Scene;

impl Scene {
    /// Gives the picture another size and keeps its framing.
    ///
    /// pbrt's screen window is `[-1, 1]` along the shorter side of the film and as much wider along
    /// the other as the film is. So where the shape changes, the shorter side goes on showing
    /// what it showed, the other side shows more or less, and pixels keep their shape (square,
    /// unless the file stretched them by a window of its own). The crop window keeps its
    /// fractions of the film, rounded up at both ends, and at least one pixel.
    pub fn set_resolution(&mut self, width: u32, height: u32) -> Result<(), FilmError> {
        Film::check_size(width.into(), height.into())?;
        let film = &self.film;
        self.camera.reshape(
            [film.width, film.height].map(f64::from),
            [width, height].map(f64::from),
        );
        self.film = film.of_size(width, height);
        Ok(())
    }
}

impl Film {
    /// The same with another number of pixels, at least one along each side. The crop window keeps
    /// its fractions, rounded up at both ends.
    pub fn of_size(&self, width: u32, height: u32) -> Self {
        let [x0, x1, y0, y1] = self.crop;
        let (x0, x1) = resize_interval(x0, x1, self.width, width);
        let (y0, y1) = resize_interval(y0, y1, self.height, height);
        Self {
            width,
            height,
            crop: [x0, x1, y0, y1],
            ..self.clone()
        }
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
