//! Depths and their inversion against closed forms, the phase function against its integral.

use super::passed::ln_1m;
use super::*;
use crate::scene::{Density, Emission, Media, Medium, Rgb};

fn media(extinction: Rgb, scattering: Rgb) -> Media {
    Media {
        list: vec![Medium {
            name: String::new(),
            origin: String::new(),
            extinction,
            scattering,
            g: 0.0,
            density: Density::Uniform,
            emission: Emission::Dark,
        }],
        ..Media::default()
    }
}

fn piece(end: f32) -> Piece {
    Piece {
        origin: [0.0; 3],
        direction: [0.0, 2.0, 0.0],
        range: [0.0, end],
    }
}

/// Weights of all primary samples, scattered and not, sum to what goes in: single scattering and
/// transmittance of a slab.
#[test]
fn a_slab_scatters_and_passes_what_it_should() {
    for extinction in [
        [1.0, 1.0, 1.0],
        [0.1, 1.0, 20.0],
        [0.0, 3.0, 3.0],
        [1e-4, 1e-4, 2e-4],
        [1e4, 1e3, 1e4],
    ] {
        let scattering = extinction.map(|e| 0.5 * e);
        let media = media(extinction, scattering);
        let table = MediumTable::of(&media, None);
        let n = 40_000;
        let (mut events, mut through) = ([0.0f64; 3], [0.0f64; 3]);
        let mut last = 0.0;
        for i in 0..n {
            let u = (i as f32 + 0.5) / n as f32;
            let mut travel = Travel::new(ln_1m(u), false);
            let found = table.scatter(0, &piece(0.5), &mut travel);
            let to = match found {
                Some(Scattered { t, weight }) => {
                    assert!((0.0..=0.5).contains(&t) && t >= last, "{t} after {last}");
                    last = t;
                    (&mut events, weight)
                }
                None => (&mut through, travel.through()),
            };
            for c in 0..3 {
                to.0[c] += f64::from(to.1[c]) / f64::from(n);
            }
        }
        for c in 0..3 {
            let t = (-f64::from(extinction[c])).exp();
            // The midpoint rule errs by a sample at the border between the two.
            let bound = |v: f64| 1e-3 * v + 3.0 * 3.0 / f64::from(n);
            assert!(
                (through[c] - t).abs() < bound(t),
                "{extinction:?} {through:?}"
            );
            let s = 0.5 * (1.0 - t);
            assert!(
                (events[c] - s).abs() < bound(s),
                "{extinction:?} {events:?}"
            );
        }
    }
}

#[test]
fn what_only_absorbs_is_passed() {
    let media = media([1.0, 2.0, 0.0], [0.0; 3]);
    let table = MediumTable::of(&media, None);
    let mut travel = Travel::new(-1e-3, false);
    assert!(table.scatter(0, &piece(0.5), &mut travel).is_none());
    let through = travel.through();
    for (c, depth) in [1.0f64, 2.0, 0.0].into_iter().enumerate() {
        assert!((f64::from(through[c]) - (-depth).exp()).abs() < 1e-6);
    }
}

#[test]
fn media_end_at_their_ball() {
    let media = media([1.0; 3], [1.0; 3]);
    let table = MediumTable::of(&media, Some(2.0));
    let mut passed = Passed::default();
    table.pass(0, &piece(f32::INFINITY), &mut passed);
    assert!((f64::from(passed.transmittance()[0]) - (-2f64).exp()).abs() < 1e-6);
}

#[test]
fn the_phase_function_integrates_to_one_with_its_mean_cosine() {
    use crate::simd::Vec3;
    let wo = Vec3::<f32>::new(0.6, 0.0, 0.8);
    for g in [-0.99f32, -0.5, 0.0, 1e-4, 0.3, 0.9, 0.99] {
        let n = 300;
        let (mut mean, mut ratio) = (0.0f64, 0.0f64);
        for i in 0..n * n {
            let u = [
                ((i % n) as f32 + 0.5) / n as f32,
                ((i / n) as f32 + 0.5) / n as f32,
            ];
            let (wi, pdf) = henyey_greenstein::sample(g, wo, u);
            let cos = -f64::from(wi.dot(wo));
            mean += cos / f64::from(n * n);
            // Its density is that of the formula in f64.
            let g = f64::from(g);
            let d = 1.0 + g * g - 2.0 * g * cos;
            let expected = (1.0 - g * g) / (4.0 * std::f64::consts::PI * d * d.sqrt());
            ratio += f64::from(pdf) / expected / f64::from(n * n);
        }
        assert!((mean - f64::from(g)).abs() < 2e-3, "{g}: {mean}");
        assert!((ratio - 1.0).abs() < 2e-3, "{g}: {ratio}");
        // Uniform directions see a total of 1.
        let mut total = 0.0f64;
        let n = 200_000;
        for i in 0..n {
            let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(n);
            let g = f64::from(g);
            let (s, c) = ((1.0 - z * z).sqrt(), z);
            let wi = Vec3::<f32>::new((0.8 * s + 0.6 * c) as f32, 0.0, (0.8 * c - 0.6 * s) as f32);
            let p = f64::from(henyey_greenstein::value(g as f32, wo, wi));
            total += p * 4.0 * std::f64::consts::PI / f64::from(n);
        }
        assert!((total - 1.0).abs() < 5e-3, "{g}: {total}");
    }
}
