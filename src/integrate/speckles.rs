//! Spots that the picture's own error says are none of the scene: pixels far brighter than their
//! surroundings, of which one half of the render knows and the other does not. Chains that are
//! stuck leave them, and so do samples of light that is rarely found.
//!
//! With `v` the mean channel of a pixel, `m` the median of `v` over the 7 x 7 pixels around it, `s`
//! their spread (1.4826 times the median of `|v - m|`) and `d` half the difference of the two
//! halves of the render, a pixel is a speckle if
//!
//! ```text
//! m > 0,  v - m > max(m, 6 s),  d > (v - m) / 2
//! ```
//!
//! What both halves show alike, such as a small lamp or a glint, is none: there `d` is small. Where
//! most of the surroundings are black nothing can be told.
//!
//! To replace speckles by the medians of their surroundings is a robust estimate, and a biased one:
//! the light of a spot may be all there is of light that should have been spread over the picture.

use rayon::prelude::*;
use serde::Serialize;

/// Half width of the window.
const HALF: usize = 3;
/// Robust standard deviations that are beyond noise.
const BEYOND: f64 = 6.0;
/// Standard deviation of normal numbers over their median absolute deviation.
const NORMAL: f64 = 1.4826;

/// A spot of pixels that touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Speckle {
    /// The brightest pixel, from the left of the whole picture.
    pub x: u32,
    /// From the top.
    pub y: u32,
    /// How many.
    pub pixels: usize,
    /// How many times as bright as its surroundings the brightest pixel is.
    pub times: f64,
    /// Part of the picture's light that the spot has more than its surroundings.
    pub share: f64,
}

/// All of them, the one with the most light first.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Speckles {
    /// Spots.
    pub spots: Vec<Speckle>,
    /// Pixels of all spots.
    pub pixels: usize,
    /// Part of the picture's light that goes away if they are replaced: the sum of all pixels and
    /// channels before less the sum after, over the former.
    pub share: f64,
    /// They have been replaced.
    pub replaced: bool,
    /// Pixels, and what their surroundings have in their place.
    #[serde(skip)]
    instead: Vec<(usize, [f32; 3])>,
}

impl Speckles {
    /// Looks for them in a picture whose rows have `width` pixels and that begins at `offset` of a
    /// whole one. `deviation` is [`Render::deviation`](super::Render::deviation).
    pub fn find(
        pixels: &[[f32; 3]],
        deviation: &[[f32; 3]],
        width: usize,
        offset: [u32; 2],
    ) -> Self {
        let values: Vec<f64> = pixels.iter().map(|p| mean(*p)).collect();
        let height = pixels.len() / width.max(1);
        let around = |i: usize| window(i, width, height);
        let excess = |i: usize| {
            let (v, d) = (values[i], mean(deviation[i]));
            // Follows from what is asked for below, and spares most pixels the sorting.
            if v <= 0.0 || d <= v / 4.0 {
                return None;
            }
            let m = median(around(i).map(|i| values[i]));
            let above = v - m;
            if m <= 0.0 || above <= m || d <= above / 2.0 {
                return None;
            }
            let s = NORMAL * median(around(i).map(|i| (values[i] - m).abs()));
            (above > BEYOND * s).then_some(above)
        };
        let found: Vec<Option<f64>> = (0..values.len()).into_par_iter().map(excess).collect();
        let instead: Vec<(usize, [f32; 3])> = (0..values.len())
            .into_par_iter()
            .filter(|i| found[*i].is_some())
            .map(|i| (i, surroundings(pixels, around(i), &found)))
            .collect();
        let total: f64 = values.iter().sum();
        let share = |light: f64| if total > 0.0 { light / total } else { 0.0 };
        let lost = |(i, to): &(usize, [f32; 3])| values[*i] - mean(*to);
        let mut spots: Vec<Speckle> = clusters(&found, width, height)
            .iter()
            .map(|members| {
                let at = |i: &usize| instead.partition_point(|(other, _)| other < i);
                let light: f64 = members.iter().map(|i| lost(&instead[at(i)])).sum();
                let (mut brightest, mut most) = (members[0], f64::NEG_INFINITY);
                for &i in members {
                    if values[i] > most {
                        (brightest, most) = (i, values[i]);
                    }
                }
                let m = most - found[brightest].unwrap_or(0.0);
                Speckle {
                    x: (brightest % width) as u32 + offset[0],
                    y: (brightest / width) as u32 + offset[1],
                    pixels: members.len(),
                    times: most / m,
                    share: share(light),
                }
            })
            .collect();
        spots.sort_by(|a, b| b.share.total_cmp(&a.share));
        Self {
            spots,
            pixels: instead.len(),
            share: share(instead.iter().map(lost).sum()),
            replaced: false,
            instead,
        }
    }

    /// Replaces them, in the picture in which they were found.
    pub fn replace(&mut self, pixels: &mut [[f32; 3]]) {
        for (i, to) in &self.instead {
            pixels[*i] = *to;
        }
        self.replaced = true;
    }
}

fn mean(p: [f32; 3]) -> f64 {
    p.map(f64::from).iter().sum::<f64>() / 3.0
}

/// Pixels of the window about a pixel, as far as it is in the picture.
fn window(i: usize, width: usize, height: usize) -> impl Iterator<Item = usize> + Clone {
    let range = |at: usize, n: usize| at.saturating_sub(HALF)..n.min(at + HALF + 1);
    let (columns, rows) = (range(i % width, width), range(i / width, height));
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Of an even number the lower one of both.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len().saturating_sub(1) / 2;
    match values.is_empty() {
        true => 0.0,
        false => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

/// Channel by channel the median of what is no speckle.
fn surroundings(
    pixels: &[[f32; 3]],
    around: impl Iterator<Item = usize> + Clone,
    found: &[Option<f64>],
) -> [f32; 3] {
    let clean = around.filter(|i| found[*i].is_none());
    std::array::from_fn(|c| median(clean.clone().map(|i| f64::from(pixels[i][c]))) as f32)
}

/// Pixels that were found, those that touch together.
fn clusters(found: &[Option<f64>], width: usize, height: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; found.len()];
    let mut list = Vec::new();
    for start in 0..found.len() {
        if seen[start] || found[start].is_none() {
            continue;
        }
        seen[start] = true;
        let mut members = vec![start];
        let mut next = 0;
        while let Some(&i) = members.get(next) {
            next += 1;
            let (x, y) = (i % width, i / width);
            for y in y.saturating_sub(1)..height.min(y + 2) {
                for x in x.saturating_sub(1)..width.min(x + 2) {
                    let i = y * width + x;
                    if found[i].is_some() && !seen[i] {
                        seen[i] = true;
                        members.push(i);
                    }
                }
            }
        }
        list.push(members);
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 20;

    /// A grey ramp of two halves that differ a little, with a spot in one half, a lamp in both.
    fn picture() -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let (mut pixels, mut deviation) = (Vec::new(), Vec::new());
        for i in 0..WIDTH * 15 {
            let value = 0.5 + 0.01 * (i % WIDTH) as f32;
            let noise = 0.02 * ((i * 7919 % 13) as f32 / 6.0 - 1.0);
            pixels.push([value + noise; 3]);
            deviation.push([noise.abs(); 3]);
        }
        for i in [5 * WIDTH + 6, 5 * WIDTH + 7, 6 * WIDTH + 7] {
            pixels[i] = [8.0, 4.0, 0.5];
            deviation[i] = [7.5, 3.5, 0.02];
        }
        pixels[10 * WIDTH + 15] = [9.0; 3];
        deviation[10 * WIDTH + 15] = [0.3; 3];
        (pixels, deviation)
    }

    #[test]
    fn spots_of_one_half_go_and_what_both_halves_show_stays() {
        let (mut pixels, deviation) = picture();
        let before = pixels.clone();
        let mut found = Speckles::find(&pixels, &deviation, WIDTH, [100, 200]);
        assert_eq!((found.spots.len(), found.pixels), (1, 3), "{found:?}");
        let spot = found.spots[0];
        assert_eq!((spot.pixels, spot.y), (3, 205), "{spot:?}");
        assert!((6.0..9.0).contains(&spot.times), "{spot:?}");
        found.replace(&mut pixels);
        for (i, (before, after)) in before.iter().zip(&pixels).enumerate() {
            let is_spot = [5 * WIDTH + 6, 5 * WIDTH + 7, 6 * WIDTH + 7].contains(&i);
            assert_eq!(before != after, is_spot, "{i}");
            if is_spot {
                assert!(after.iter().all(|v| (0.5..0.65).contains(v)), "{after:?}");
            }
        }
        // What it says has gone is what has gone.
        let sum = |pixels: &[[f32; 3]]| -> f64 { pixels.iter().map(|p| mean(*p)).sum() };
        let lost = (sum(&before) - sum(&pixels)) / sum(&before);
        assert!(lost > 0.03 && (found.share - lost).abs() < 1e-12, "{lost}");
        assert!((spot.share - lost).abs() < 1e-12);
        // There is nothing left to do.
        let again = Speckles::find(&pixels, &deviation, WIDTH, [0; 2]);
        assert_eq!(again.pixels, 0);
    }

    #[test]
    fn nothing_is_found_where_nothing_can_be_told() {
        let black = |lit: usize| -> Vec<[f32; 3]> {
            (0..100).map(|i| [f32::from(i % lit == 0); 3]).collect()
        };
        // Every pixel that is lit is so in one half only, as samples are that are few.
        let sparse = black(9);
        let found = Speckles::find(&sparse, &sparse, 10, [0; 2]);
        assert_eq!(found, Speckles::default());
        let empty = Speckles::find(&[], &[], 0, [0; 2]);
        assert_eq!(empty, Speckles::default());
    }
}
