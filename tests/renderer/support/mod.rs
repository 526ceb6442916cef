//! What the tests of whole renders share: independent runs of a scene, and the only rule by which a
//! measured number may differ from another.
//!
//! Every estimate is the mean of renders with different seeds, and its standard error comes from
//! their scatter. A test fails if a difference exceeds so many standard errors that chance alone
//! does so once in five million ([`FALSE_ALARM`]): with the few hundred comparisons there are, the
//! whole suite raises a false alarm less than once in ten thousand changes of seed. For many runs
//! that is 5.2 standard errors; with few, the scatter itself is uncertain, and Student's
//! distribution asks for more ([`reach`]). Seeds are fixed.
//!
//! A suite that counts its comparisons can hand the number to [`standard_errors`], and then all of
//! them together raise a false alarm once in a million changes of seed ([`SUITE_FALSE_ALARM`]).

// Each test file uses its own part of this.
#![allow(dead_code)]

pub mod command;
pub mod dialect;
pub mod stage;

use phalanx::film::output::{Picture, write};
use phalanx::formats::tone::Display;
use phalanx::integrate::{Render, Settings, Silent, render};
use phalanx::pbrt::load_str;
use phalanx::scene::{IntegratorKind, Scene};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Probability that a comparison of two equal things fails.
pub const FALSE_ALARM: f64 = 2e-7;

/// Probability that any comparison of a suite that counts them fails.
pub const SUITE_FALSE_ALARM: f64 = 1e-6;

/// Differences of this part of a value are put down to `f32`.
pub const ROUNDING: f64 = 2e-5;

/// Standard errors below any bound here: that of [`SUITE_FALSE_ALARM`] is 4.89. What lies within
/// needs no bound of its own, which takes longer to find than some pictures.
const NEVER_LESS: f64 = 4.8;

/// Whether a difference is within as many standard errors as `reach` says, and rounding.
fn is_chance(off: f64, error: f64, rounding: f64, reach: impl FnOnce() -> f64) -> bool {
    off <= NEVER_LESS * error + rounding || off <= reach() * error + rounding
}

pub const BOTH: [IntegratorKind; 2] = [IntegratorKind::Pt, IntegratorKind::Mmlt];

/// A scene from text; files it refers to lie in `tests/reference`.
pub fn scene(text: &str) -> Scene {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    load_str(text, "test.pbrt", &dir).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Writes a float file, which keeps its values: texels in rows from the top down.
pub fn write_pfm(path: &Path, width: u32, texels: &[[f32; 3]]) {
    let height = texels.len() as u32 / width;
    let picture = Picture {
        width,
        height,
        offset: [0, 0],
        full: [width, height],
        pixels: texels.to_vec(),
    };
    write(path, &picture, &[], &Display::LINEAR).expect("a written image");
}

/// Settings for small pictures: one thread (the tests themselves run in parallel), `effort` samples
/// or mutations per pixel, and a bootstrap and chains to match.
pub fn settings(scene: &Scene, integrator: IntegratorKind, effort: u64) -> Settings {
    Settings {
        integrator,
        threads: 1,
        samples_per_pixel: effort,
        mutations_per_pixel: effort,
        bootstrap: 4096,
        chains: 64,
        ..Settings::of(scene)
    }
}

pub fn run(scene: &Scene, settings: &Settings) -> Render {
    render(scene, settings, &Silent).unwrap_or_else(|e| panic!("{e}"))
}

/// The same scene rendered with several seeds.
pub struct Runs {
    pub width: u32,
    pub height: u32,
    pub pictures: Vec<Vec<[f32; 3]>>,
}

impl Runs {
    pub fn new(scene: &Scene, settings: &Settings, seeds: u64) -> Self {
        let renders: Vec<Render> = (0..seeds)
            .map(|i| {
                let seed = settings.seed + 1 + i;
                run(
                    scene,
                    &Settings {
                        seed,
                        ..settings.clone()
                    },
                )
            })
            .collect();
        Self::of(renders)
    }

    pub fn of(renders: Vec<Render>) -> Self {
        for r in &renders {
            assert_eq!(
                r.stats.rejected_nonfinite, 0,
                "contributions were not finite"
            );
            assert!(
                r.pixels.iter().flatten().all(|v| v.is_finite()),
                "pixels are not finite"
            );
        }
        Self {
            width: renders[0].width,
            height: renders[0].height,
            pictures: renders.into_iter().map(|r| r.pixels).collect(),
        }
    }

    /// The mean of a channel over the pixels `[x0, x1, y0, y1]`.
    pub fn region(&self, [x0, x1, y0, y1]: [u32; 4], channel: usize) -> Estimate {
        let means: Vec<f64> = (self.pictures.iter())
            .map(|picture| {
                let mut sum = 0.0;
                for y in y0..y1 {
                    for x in x0..x1 {
                        sum += f64::from(picture[(y * self.width + x) as usize][channel]);
                    }
                }
                sum / f64::from((x1 - x0) * (y1 - y0))
            })
            .collect();
        Estimate::of(&means)
    }

    /// The mean of a channel over the whole picture.
    pub fn whole(&self, channel: usize) -> Estimate {
        self.region([0, self.width, 0, self.height], channel)
    }

    /// Means over a grid of `columns` by `rows` regions, for each channel.
    pub fn grid(&self, columns: u32, rows: u32) -> Vec<Estimate> {
        let mut list = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let cut = |k: u32, n: u32, size: u32| k * size / n;
                let region = [
                    cut(i, columns, self.width),
                    cut(i + 1, columns, self.width),
                    cut(j, rows, self.height),
                    cut(j + 1, rows, self.height),
                ];
                list.extend((0..3).map(|c| self.region(region, c)));
            }
        }
        list
    }

    /// The mean picture.
    pub fn mean(&self) -> Vec<[f32; 3]> {
        let n = self.pictures.len() as f64;
        (0..self.pictures[0].len())
            .map(|i| {
                std::array::from_fn(|c| {
                    let sum: f64 = self.pictures.iter().map(|p| f64::from(p[i][c])).sum();
                    (sum / n) as f32
                })
            })
            .collect()
    }

    /// Writes the mean picture to `$PHALANX_TEST_PICTURES/NAME.png`, if that is set: a number that
    /// is right beside a wrong picture is not.
    pub fn show(&self, name: &str) {
        if let Some(dir) = std::env::var_os("PHALANX_TEST_PICTURES") {
            let picture = Picture {
                width: self.width,
                height: self.height,
                offset: [0, 0],
                full: [self.width, self.height],
                pixels: self.mean(),
            };
            let file = name.replace([' ', ','], "-");
            let path = Path::new(&dir).join(format!("{file}.png"));
            write(
                &path,
                &picture,
                &[],
                &phalanx::formats::tone::Display::LINEAR,
            )
            .unwrap();
        }
    }
}

/// A mean of independent runs.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
    /// Degrees of freedom of the error.
    pub freedom: f64,
}

impl Estimate {
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let spread: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        Self {
            mean,
            error: (spread / (n - 1.0) / n).sqrt(),
            freedom: n - 1.0,
        }
    }

    /// Fails unless this is `truth` but for chance.
    #[track_caller]
    pub fn expect(&self, truth: f64, what: &str) {
        self.expect_within(truth, reach, what);
    }

    /// The same, as one of so many comparisons of a suite.
    #[track_caller]
    pub fn expect_among(&self, comparisons: usize, truth: f64, what: &str) {
        let errors = |freedom| standard_errors(comparisons, freedom);
        self.expect_within(truth, errors, what);
    }

    /// Fails unless this is `truth` within `errors(degrees of freedom)` standard errors.
    #[track_caller]
    fn expect_within(&self, truth: f64, errors: impl Fn(f64) -> f64, what: &str) {
        let off = self.mean - truth;
        println!(
            "{what}: {:.6} +- {:.6}, expected {truth:.6}: {:+.2} standard errors",
            self.mean,
            self.error,
            off / self.error.max(f64::MIN_POSITIVE)
        );
        let rounding = ROUNDING * truth.abs();
        assert!(
            is_chance(off.abs(), self.error, rounding, || errors(self.freedom)),
            "{what}: {} +- {} is not {truth}",
            self.mean,
            self.error
        );
    }

    /// Fails unless this and `other` are the same but for chance (Welch's test).
    #[track_caller]
    pub fn expect_same(&self, other: &Estimate, what: &str) {
        self.expect_same_within(other, reach, what);
    }

    /// The same, as one of so many comparisons of a suite.
    #[track_caller]
    pub fn expect_same_among(&self, comparisons: usize, other: &Estimate, what: &str) {
        let errors = |freedom| standard_errors(comparisons, freedom);
        self.expect_same_within(other, errors, what);
    }

    /// Fails unless both differ by at most `errors(degrees of freedom)` standard errors.
    #[track_caller]
    fn expect_same_within(&self, other: &Estimate, errors: impl Fn(f64) -> f64, what: &str) {
        let off = self.mean - other.mean;
        let (a, b) = (self.error.powi(2), other.error.powi(2));
        let error = (a + b).sqrt();
        println!(
            "{what}: {:.6} +- {:.6} against {:.6} +- {:.6}: {:+.2} standard errors",
            self.mean,
            self.error,
            other.mean,
            other.error,
            off / error.max(f64::MIN_POSITIVE)
        );
        let freedom = if error > 0.0 {
            (a + b).powi(2) / (a * a / self.freedom + b * b / other.freedom)
        } else {
            self.freedom
        };
        let rounding = ROUNDING * self.mean.abs();
        assert!(
            is_chance(off.abs(), error, rounding, || errors(freedom)),
            "{what}: {} +- {} is not {} +- {}",
            self.mean,
            self.error,
            other.mean,
            other.error
        );
    }
}

/// How many standard errors chance exceeds with probability [`FALSE_ALARM`] (two-sided), if the
/// error was measured with so many degrees of freedom: Student's distribution, whose density with
/// `x = sqrt(f) tan(angle)` is `cos(angle)^(f - 1)`.
pub fn reach(freedom: f64) -> f64 {
    quantile(FALSE_ALARM, freedom)
}

/// How far equal things may be apart, in standard errors, so that chance exceeds it in any of so
/// many comparisons with probability [`SUITE_FALSE_ALARM`] at most (Bonferroni's bound): 6.1 for a
/// thousand comparisons of well-known errors, 9.9 if the errors have 23 degrees of freedom.
pub fn standard_errors(comparisons: usize, freedom: f64) -> f64 {
    quantile(SUITE_FALSE_ALARM / comparisons as f64, freedom)
}

/// What the absolute value of a variable of Student's distribution exceeds with probability `rate`.
fn quantile(rate: f64, freedom: f64) -> f64 {
    // The grid below resolves no narrower density, and there the distribution is normal.
    let freedom = freedom.min(1e4);
    let n = 16_000;
    let h = FRAC_PI_2 / f64::from(n);
    let density = |i: i32| ((f64::from(i) + 0.5) * h).cos().powf(freedom - 1.0);
    let densities: Vec<f64> = (0..n).map(density).collect();
    // From the far end: the cell at which so much lies beyond, and the part of it that does.
    let wanted = rate * densities.iter().sum::<f64>();
    let (mut beyond, mut cell) = (0.0, densities.len() - 1);
    while beyond + densities[cell] < wanted {
        beyond += densities[cell];
        cell -= 1;
    }
    let part = (wanted - beyond) / densities[cell];
    freedom.sqrt() * (h * (cell as f64 + 1.0 - part)).tan()
}

#[test]
fn reaches_are_those_of_tables() {
    for (rate, freedom, expected) in [
        (1e-3, 1.0, 636.619),
        (0.05, 2.0, 4.302_65),
        (1e-3, 15.0, 4.072_77),
        (1e-3, 30.0, 3.645_96),
        (FALSE_ALARM, 1e9, 5.199_34),
    ] {
        let got = quantile(rate, freedom);
        assert!(
            (got / expected - 1.0).abs() < 1e-3,
            "{rate} {freedom}: {got}"
        );
    }
    assert!(NEVER_LESS < quantile(SUITE_FALSE_ALARM, 1e9));
}

/// Renders with PT and MMLT and fails where they differ: the whole picture and a grid of regions,
/// every channel. Many short renders are better than few long ones: with 48 instead of 16, the
/// scatter is so much better known that three eighths of the samples bound a difference as well.
#[track_caller]
pub fn expect_integrators_agree(
    scene: &Scene,
    effort: u64,
    seeds: u64,
    grid: [u32; 2],
    name: &str,
) {
    agree(scene, effort, seeds, grid, reach, name);
}

/// The same, its comparisons among so many of a suite.
#[track_caller]
pub fn expect_integrators_agree_among(
    comparisons: usize,
    scene: &Scene,
    effort: u64,
    seeds: u64,
    grid: [u32; 2],
    name: &str,
) {
    let errors = |freedom| standard_errors(comparisons, freedom);
    agree(scene, effort, seeds, grid, errors, name);
}

#[track_caller]
fn agree(
    scene: &Scene,
    effort: u64,
    seeds: u64,
    grid: [u32; 2],
    errors: impl Fn(f64) -> f64,
    name: &str,
) {
    let [pt, mmlt] = BOTH.map(|kind| {
        // Short renders, short bootstraps.
        let settings = Settings {
            bootstrap: 1024,
            ..settings(scene, kind, effort)
        };
        let runs = Runs::new(scene, &settings, seeds);
        runs.show(&format!("{name}-{kind:?}"));
        runs
    });
    for c in 0..3 {
        let (a, b) = (mmlt.whole(c), pt.whole(c));
        a.expect_same_within(&b, &errors, &format!("{name}, channel {c}"));
    }
    let [columns, rows] = grid;
    let regions = mmlt.grid(columns, rows);
    for (i, (a, b)) in regions.iter().zip(pt.grid(columns, rows)).enumerate() {
        let what = format!("{name}, region {}, channel {}", i / 3, i % 3);
        a.expect_same_within(&b, &errors, &what);
    }
}

/// A closed axis-aligned box `[x0, x1] x [y0, y1] x [z0, z1]` as a pbrt mesh whose front faces
/// inwards.
pub fn inward_box([x0, x1, y0, y1, z0, z1]: [f64; 6]) -> String {
    let corners: Vec<String> = (0..8)
        .map(|i| {
            let pick = |bit: i32, a: f64, b: f64| if i >> bit & 1 == 0 { a } else { b };
            format!(
                "{} {} {}",
                pick(0, x0, x1),
                pick(1, y0, y1),
                pick(2, z0, z1)
            )
        })
        .collect();
    // Counter-clockwise seen from inside.
    let quads = [
        [0, 2, 6, 4],
        [1, 5, 7, 3],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 1, 3, 2],
        [4, 6, 7, 5],
    ];
    let indices: Vec<String> = (quads.iter())
        .map(|[a, b, c, d]| format!("{a} {b} {c} {a} {c} {d}"))
        .collect();
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [{}] \"point P\" [{}]\n",
        indices.join(" "),
        corners.join("  ")
    )
}

/// The head of a scene in the v3 dialect, up to `WorldBegin`: film size, largest depth, and the
/// camera with its transform.
pub fn head(width: u32, height: u32, depth: u32, camera: &str) -> String {
    format!(
        "{camera}\nFilm \"image\" \"integer xresolution\" [{width}] \"integer yresolution\" [{height}]\n\
         PixelFilter \"box\"\nIntegrator \"mlt\" \"integer maxdepth\" [{depth}]\nWorldBegin\n"
    )
}
