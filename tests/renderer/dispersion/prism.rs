//! White light through a prism, where Snell's law says which colour goes where.

use super::{disperse, fill, scene};
use crate::common::stats::{FALSE_ALARM, Random, normal_quantile};
use phalanx::chain::evaluator::Evaluator;
use phalanx::replay::Recorder;
use phalanx::replay::vector::*;
use phalanx::scene::spectrum::{self, IndexCurve};
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, World};
use std::sync::Arc;

/// Newton's experiment: a beam of parallel light along `x`, a slit, a prism with its edge along
/// `z`, and a screen across the beam's way. The camera looks at the screen past the prism, so that
/// raster `y` is `y` on the screen.
struct Experiment {
    n: fn(f64) -> f64,
    /// Corners of the prism in the plane `z = 0`, counterclockwise; light enters by the first side
    /// and leaves by the second.
    corners: [[f64; 2]; 3],
    /// `y` of the beam's middle.
    beam: f64,
    screen: f64,
}

const HALF_VIEW: f64 = 1.5;

const SLIT: f64 = 0.3;

impl Experiment {
    pub fn new(n: fn(f64) -> f64) -> Self {
        // The prism's edge is up, and the beam bends down.
        Self {
            n,
            corners: [[0.05, 0.6], [-0.35, -0.4], [0.35, -0.4]],
            beam: 0.1,
            screen: 3.0,
        }
    }

    fn centre(&self) -> f64 {
        -1.1
    }

    fn text(&self, eta: &str) -> String {
        let [a, b, c] = self.corners;
        let p: Vec<String> = [-0.5, 0.5]
            .iter()
            .flat_map(|z| [a, b, c].map(|[x, y]| format!("{x} {y} {z}")))
            .collect();
        let quad = |x: f64, y0: f64, y1: f64, z: f64| {
            format!(
                "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [{x} {y0} {} {x} {y1} {} {x} {y1} {z} {x} {y0} {z}]\n",
                -z, -z
            )
        };
        let (d, m, s) = (self.screen, self.centre(), self.beam);
        format!(
            r#"LookAt {} {m} 3  {d} {m} 0  0 1 0
            Camera "orthographic" "float screenwindow" [-{HALF_VIEW} {HALF_VIEW} -{HALF_VIEW} {HALF_VIEW}]
            Film "rgb" "integer xresolution" 64 "integer yresolution" 64
            WorldBegin
            LightSource "distant" "point3 from" [-1 0 0] "point3 to" [0 0 0] "rgb L" [1 1 1]
            Material "diffuse" "rgb reflectance" [0 0 0]
            {}{}
            Material "diffuse" "rgb reflectance" [0.5 0.5 0.5]
            {}
            Material "dielectric" {eta}
            Shape "trianglemesh" "integer indices" [0 2 1  3 4 5  0 1 4  0 4 3  1 2 5  1 5 4  2 0 3  2 3 5] "point3 P" [{}]"#,
            d - 3.0,
            quad(-0.8, s + SLIT / 2.0, 0.8, 0.6),
            quad(-0.8, -0.6, s - SLIT / 2.0, 0.6),
            quad(d, m - 1.0, m + 1.0, 0.7),
            p.join(" ")
        )
    }

    /// `y` on the screen and the part that both faces let through, at a wavelength: Snell and
    /// Fresnel.
    fn ray(&self, nm: f64) -> (f64, f64) {
        let n = (self.n)(nm);
        let [a, b, c] = self.corners;
        let mut p = [-2.0, self.beam];
        let mut d = [1.0, 0.0];
        let mut through = 1.0;
        for (from, to, eta) in [(a, b, n), (c, a, 1.0 / n)] {
            let edge = [to[0] - from[0], to[1] - from[1]];
            // p + t d on the edge's line.
            let off = [from[0] - p[0], from[1] - p[1]];
            let t = (off[0] * edge[1] - off[1] * edge[0]) / (d[0] * edge[1] - d[1] * edge[0]);
            p = [p[0] + t * d[0], p[1] + t * d[1]];
            let length = edge[0].hypot(edge[1]);
            // Towards where the ray comes from.
            let mut normal = [-edge[1] / length, edge[0] / length];
            if normal[0] * d[0] + normal[1] * d[1] > 0.0 {
                normal = normal.map(|v| -v);
            }
            let cos = -(normal[0] * d[0] + normal[1] * d[1]);
            let (reflected, cos_t) = phalanx::replay::bsdf::dielectric(cos, eta);
            assert!(reflected < 1.0, "total reflection");
            through *= 1.0 - reflected;
            d = [0, 1].map(|i| d[i] / eta + (cos / eta - cos_t) * normal[i]);
        }
        (p[1] + (self.screen - p[0]) / d[0] * d[1], through)
    }

    /// Mean `y` of each channel on the screen, and the mean of its square.
    fn expected(&self) -> [[f64; 2]; 3] {
        let responses = spectrum::responses();
        std::array::from_fn(|c| {
            let mut sums = [0.0; 3];
            for (i, w) in responses.iter().enumerate() {
                let (y, through) = self.ray((spectrum::FIRST + i) as f64);
                for (k, sum) in sums.iter_mut().enumerate() {
                    *sum += w[c] * through * y.powi(k as i32);
                }
            }
            [sums[1] / sums[0], sums[2] / sums[0]]
        })
    }
}

/// Where red, green and blue fall, and how far they spread, is what Snell's law says at every
/// wavelength.
#[test]
fn a_prism_spreads_light_as_snell_says() {
    const N: usize = 1 << 14;
    const BATCHES: usize = 40;
    // Strong dispersion, so that colours are apart; and the same index at every wavelength.
    let curve: fn(f64) -> f64 = |nm| 1.35 + 35_000.0 / (nm * nm);
    let knots: Vec<String> = (360..=830)
        .map(|nm| format!("{nm} {}", curve(f64::from(nm))))
        .collect();
    let spectral = format!("\"spectrum eta\" [{}]", knots.join(" "));
    let mut random = Random(55);
    for (n, eta) in [
        (curve, spectral.as_str()),
        ((|_| 1.5) as fn(f64) -> f64, "\"float eta\" 1.5"),
    ] {
        let experiment = Experiment::new(n);
        let scene = scene(&experiment.text(eta));
        let world = World::new(&scene, 3);
        let plan = &world.plan.depths[3];
        let mut samples = Samples::new(plan.layout.total, N);
        let mut paths = Paths::new(&world);
        // Sums of 1, y and y^2 by channel and batch.
        let mut sums = vec![[[0.0; 3]; 3]; BATCHES];
        for batch in &mut sums {
            fill(&mut samples, &mut random);
            // Everything from the light: no other strategy sees the screen through the prism.
            samples.row_mut(plan.layout.strategy).fill(0.999);
            Evaluator::EIGHT.multiplexed(&world, plan, &samples, N, &mut paths);
            for o in &paths.splats.camera {
                assert!(o.rgb == [0.0; 3] || o.s == 4);
                let y =
                    experiment.centre() + HALF_VIEW * (1.0 - 2.0 * f64::from(o.raster[1]) / 64.0);
                for c in 0..3 {
                    for k in 0..3 {
                        batch[c][k] += f64::from(o.rgb[c]) * y.powi(k as i32);
                    }
                }
            }
        }
        let expected = experiment.expected();
        for c in 0..3 {
            let total: f64 = sums.iter().map(|b| b[c][0]).sum();
            assert!(total > 0.0, "no light");
            for k in 1..=2 {
                let mean = sums.iter().map(|b| b[c][k]).sum::<f64>() / total;
                let scatter: f64 = (sums.iter())
                    .map(|b| (b[c][k] - mean * b[c][0]).powi(2))
                    .sum();
                let error = scatter.sqrt() / total;
                // Of a uniform beam, from one border to the other.
                let at = |beam: f64| {
                    let moved = Experiment {
                        beam: experiment.beam + beam,
                        ..Experiment::new(n)
                    };
                    moved.expected()[c][k - 1]
                };
                // The mean over the beam by Gauss's rule of two points, exact of the squares that
                // these are.
                let g = SLIT / 2.0 / 3f64.sqrt();
                let over_beam = 0.5 * (at(-g) + at(g));
                println!(
                    "channel {c}, moment {k}: {mean:.5} +- {error:.5}, expected {over_beam:.5} ({:.5} of a thin beam)",
                    expected[c][k - 1]
                );
                assert!((mean - over_beam).abs() < normal_quantile(FALSE_ALARM) * error + 1e-5);
            }
        }
        let mean = |c: usize| expected[c][0];
        assert!(eta.contains("float") || mean(0) - mean(1) > 0.05 && mean(1) - mean(2) > 0.05);
    }
}

/// Directions of single paths through a prism, wavelength by wavelength.
#[test]
fn directions_follow_the_wavelength() {
    let experiment = Experiment::new(|nm| 1.35 + 35_000.0 / (nm * nm));
    let curve = IndexCurve::of(experiment.n);
    let mut scene = scene(&experiment.text("\"float eta\" 1.5"));
    disperse(&mut scene, &Arc::new(curve));
    let world = World::new(&scene, 3);
    let recorder = Recorder::new(&scene, &world);
    let plan = &world.plan.depths[3];
    let mut random = Random(56);
    let mut seen = 0;
    for _ in 0..60_000 {
        let mut u: Vec<f32> = (0..plan.layout.total).map(|_| random.uniform()).collect();
        u[plan.layout.strategy] = 0.999;
        let walk = recorder.walk(plan, &u);
        let Some(path) = walk.paths().next().filter(|p| p.surface.len() == 3) else {
            continue;
        };
        // From the camera: screen, exit, entry.
        let [screen, exit, entry] = &path.surface[..] else {
            continue;
        };
        let towards = unit(sub(screen.p, exit.p));
        let inside = unit(sub(exit.p, entry.p));
        let nm = f64::from(walk.wavelength.unwrap().single.nm);
        let n = (experiment.n)(nm);
        let sine = |d: V, at: V| length(cross(d, at));
        let into = [1.0, 0.0, 0.0];
        assert!((sine(into, entry.ng) - n * sine(inside, entry.ng)).abs() < 1e-5);
        assert!((sine(towards, exit.ng) - n * sine(inside, exit.ng)).abs() < 1e-5);
        seen += 1;
    }
    assert!(seen > 20, "{seen}");
}
