//! Rows 3, 11, 12, 13, 14, 15 and 27: acceptance, samples, starts, and chains that do not go where
//! they should.
//!
//! `chain::accept` has the table of acceptance with states that can arise (row 3),
//! `tests/renderer/rng.rs` the uniformity of samples after many small steps (row 11) and of random
//! numbers along every axis of their counters (row 13), `tests/renderer/reference.rs` caustics
//! against long renders (row 27).

use super::COMPARISONS;
use crate::common::stats::{FALSE_ALARM, normal_quantile};
use crate::support::stage::{lit_stage, renders};
use crate::support::{BOTH, Estimate, Runs, head, inward_box, run, scene, settings};
use phalanx::chain::accept::{acceptance, colour, target};
use phalanx::chain::evaluator::Evaluator;
use phalanx::chain::mutate::{ONE_MINUS_EPSILON, ProposalDistribution, wrap};
use phalanx::integrate::Settings;
use phalanx::scene::{IntegratorKind, Scene};
use phalanx::simd::{Lanes, f32x8};
use phalanx::transport::samples::Samples;

// --- Acceptance ---

/// Row 3: acceptance of 0 over 0, and of everything else over everything else: a probability
/// always, 0 for proposals that carry no light or none that can be, 1 where there was none before.
#[test]
fn acceptance_is_a_probability() {
    let subnormal = f32::from_bits(1);
    let all = [
        0.0,
        -0.0,
        subnormal,
        f32::MIN_POSITIVE,
        1e-20,
        1.0,
        1e20,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
        -1.0,
        f32::NEG_INFINITY,
    ];
    for current in all {
        for proposed in all {
            let a = acceptance(current, proposed);
            let wide = acceptance(f32x8::splat(current), f32x8::splat(proposed)).lane(6);
            assert_eq!(a.to_bits(), wide.to_bits(), "{current:e} {proposed:e}");
            assert!((0.0..=1.0).contains(&a), "{current:e} {proposed:e}: {a}");
            let light = proposed > 0.0 && proposed.is_finite();
            if !light {
                assert_eq!(a, 0.0, "{current:e} {proposed:e}");
            } else if current.is_nan() || current <= proposed {
                assert_eq!(a, 1.0, "{current:e} {proposed:e}");
            } else if current.is_finite() && proposed >= f32::MIN_POSITIVE {
                let want = f64::from(proposed) / f64::from(current);
                assert!((f64::from(a) - want).abs() <= 1e-7 * want + 1e-44);
            }
        }
        // A state's colour is a number, whatever its target.
        for c in colour([current; 3], target([current; 3])) {
            assert!(c.is_nan() || c >= 0.0 || current < 0.0);
            if current.is_finite() && current >= 0.0 {
                assert!((0.0..=3.0).contains(&c), "{current:e}: {c}");
            }
        }
    }
}

// --- Samples ---

/// Row 11: samples wrapped to exactly 1. Every float around 0 and 1, and tiny ones, stay in `[0,
/// 1)`.
#[test]
fn wrapping_stays_below_one() {
    let around = |x: f32| -> Vec<f32> {
        let (mut up, mut down) = (x, x);
        let mut out = vec![x];
        for _ in 0..100 {
            (up, down) = (up.next_up(), down.next_down());
            out.extend([up, down]);
        }
        out
    };
    let mut values: Vec<f32> = [-2.0, -1.0, -0.0, 0.0, 0.5, 1.0, 2.0, 3.0]
        .into_iter()
        .flat_map(around)
        .collect();
    for exponent in 0..149 {
        let tiny = 2f32.powi(-exponent);
        values.extend([tiny, -tiny, 1.0 - tiny, 1.0 + tiny, tiny - 1.0]);
    }
    for v in values {
        let w = wrap::<f32>(v);
        assert!((0.0..1.0).contains(&w), "{v:e} to {w:e}");
        // Equal modulo 1, to an ulp of 1.
        let apart = (f64::from(v) - f64::from(w)).rem_euclid(1.0);
        let apart = apart.min(1.0 - apart);
        assert!(apart <= f64::from(f32::EPSILON), "{v:e} to {w:e}");
        assert_eq!(
            wrap::<f32x8>(f32x8::splat(v)).lane(3).to_bits(),
            w.to_bits()
        );
    }
    assert!(wrap::<f32>(-1e-30) == ONE_MINUS_EPSILON);
}

// --- Starts ---

/// Row 12: bias at the start. Chains that make few mutations show where they started. The mean of
/// many tiny renders must be PT's.
#[test]
fn no_bias_at_the_start() {
    let scene = lit_stage(12, 9);
    let pt = Runs::new(&scene, &settings(&scene, IntegratorKind::Pt, 200), 48);
    for (mutations, chains, bootstrap) in [(1, 200, 400), (4, 40, 1000), (20, 8, 2000)] {
        let settings = Settings {
            mutations_per_pixel: mutations,
            chains,
            bootstrap,
            ..settings(&scene, IntegratorKind::Mmlt, 1)
        };
        let mmlt = Runs::new(&scene, &settings, 400);
        for (i, (a, b)) in mmlt.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
            let what = format!(
                "{mutations} mutations per pixel, {chains} chains, region {}",
                i / 3
            );
            a.expect_same_among(COMPARISONS, &b, &what);
        }
        // The means of so many runs are good to the same part of a percent as PT's.
        mmlt.whole(1).expect_same_among(
            COMPARISONS,
            &pt.whole(1),
            &format!("{mutations} mutations per pixel"),
        );
    }
}

// --- Correlation ---

/// Row 13: correlated chains. Kinds, directions and decisions of the steps of all chains are
/// uncorrelated.
#[test]
fn proposals_of_chains_are_uncorrelated() {
    // All chains start from one state, as chains from one bootstrap sample do.
    let (chains, dimensions, steps) = (16, 6, 4000);
    let proposals = ProposalDistribution::new(3, 0.3, 0.01);
    let ids: Vec<u32> = (0..chains as u32).collect();
    let mut start = Samples::new(dimensions, chains);
    for d in 0..dimensions {
        start.row_mut(d).fill(0.5);
    }
    let mut proposed = start.clone();
    let (mut large, mut decide) = (vec![0.0; chains], vec![0.0; chains]);
    let mut series = vec![vec![]; chains];
    let mut kinds = vec![vec![]; chains];
    for i in 0..steps {
        Evaluator::EIGHT.propose(
            &proposals,
            &ids,
            i,
            &start,
            &mut proposed,
            &mut large,
            &mut decide,
        );
        for c in 0..chains {
            for d in 0..dimensions {
                // Its sign has mean 0 and variance 1 for both kinds of step.
                let u = proposed.row(d)[c];
                series[c].push(if u > 0.5 { 1.0 } else { -1.0f64 });
            }
            kinds[c].push(if large[c] > 0.0 { 0.7 } else { -0.3 } / 0.21f64.sqrt());
            kinds[c].push((f64::from(decide[c]) - 0.5) * 12f64.sqrt());
        }
    }
    let sigmas = normal_quantile(FALSE_ALARM / (chains * chains) as f64);
    for a in 0..chains {
        for b in 0..a {
            for all in [&series, &kinds] {
                let r: f64 = all[a].iter().zip(&all[b]).map(|(x, y)| x * y).sum();
                let r = r / (all[a].len() as f64).sqrt();
                assert!(r.abs() < sigmas, "chains {a} and {b}: {r:.2} sigmas");
            }
        }
    }
}

// --- Stuck ---

/// A tiny bright lamp in a closed chamber with a hole in it: the only way out, for light subpaths
/// that find it, is through a pane of glass, which no connection crosses. A dim sky lights the
/// rest.
fn chamber(hole: f64) -> Scene {
    let view = "LookAt 3 1.5 1.5  -.3 -.15 -2  0 1 0\nCamera \"perspective\" \"float fov\" [40]";
    let ring = format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 5 0 5 4 1 2 6 1 6 5 2 3 7 2 7 6 3 0 4 3 4 7] \"point P\" \
         [-.5 -.5 -.5 .5 -.5 -.5 .5 .5 -.5 -.5 .5 -.5 -{hole} -{hole} -.5 {hole} -{hole} -.5 {hole} {hole} -.5 -{hole} {hole} -.5]\n"
    );
    let sides = inward_box([-0.5, 0.5, -0.5, 0.5, -0.5, 0.5]);
    // The side with the hole is the one at the least z.
    let sides = sides.replace(" 0 1 3 0 3 2", "");
    let pane = "AttributeBegin\nMaterial \"glass\"\nReverseOrientation\n".to_string()
        + &inward_box([-0.1, 0.1, -0.1, 0.1, -0.56, -0.52])
        + "AttributeEnd\n";
    scene(
        &(head(32, 32, 3, view)
            + "LightSource \"infinite\" \"rgb L\" [.1 .1 .1]\n\
               AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [2e8 2e8 2e8]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
               Translate .1 .05 0\nShape \"sphere\" \"float radius\" [1e-3]\nAttributeEnd\n\
               Material \"matte\" \"rgb Kd\" [0 0 0]\n"
            + &ring
            + &sides
            + "Material \"matte\" \"rgb Kd\" [.7 .7 .7]\n"
            + &pane
            + "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 -1.5 -2 -3 -1.5 3 3 -1.5 3 3 -1.5 -2]\n\
               Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-2 -1.5 -2 2 -1.5 -2 2 1 -2 -2 1 -2]\n"),
    )
}

/// Row 14: stuck chains. No acceptance is forced: chains that have found the way out stay where
/// they are for hundreds of iterations, and the render says how many, and where to expect a spot.
/// Without the hole, nothing is said.
#[test]
fn stuck_chains_are_told() {
    let render = |hole: f64| {
        let scene = chamber(hole);
        let settings = Settings {
            // Some find the way out: once in some 100 000 paths.
            bootstrap: 400_000,
            chains: 16,
            // Small steps that lead back through the hole are rare.
            sigma: 0.03,
            ..settings(&scene, IntegratorKind::Mmlt, 200)
        };
        run(&scene, &settings)
    };
    let stuck = |w: &&String| w.contains("stuck");
    let open = render(0.006);
    println!("{:?}", open.warnings);
    let told: Vec<&String> = open.warnings.iter().filter(stuck).collect();
    let [told] = told[..] else {
        panic!("{:?}", open.warnings);
    };
    let all: Vec<_> = (open.stats.depths.iter())
        .flat_map(|d| &d.mixing.stuck)
        .collect();
    assert_eq!(open.stats.stuck_chains, all.len() as u64);
    // The spot is where the lamp shines through the hole: in the middle of the picture, by light
    // subpaths alone.
    for chain in &all {
        assert!((chain.x - 16.0).abs() < 1.0 && (chain.y - 16.0).abs() < 1.0);
        assert_eq!((chain.s, chain.t), (Some(4), Some(1)));
        assert!(chain.iterations > 100);
    }
    let (count, rest) = told.split_once(" chains were stuck").expect("a count");
    assert!((2..=all.len()).contains(&count.parse().unwrap()), "{told}");
    let place = [
        "at pixel 15, 15",
        "at pixel 15, 16",
        "at pixel 16, 15",
        "at pixel 16, 16",
    ];
    assert!(place.iter().any(|p| rest.contains(p)), "{told}");
    // In the picture there is one: that pixel is brighter than its neighbours by what the warning
    // says at least.
    let row = |y: usize| open.pixels[y * 32 + 14..y * 32 + 18].iter().map(|p| p[1]);
    let brightest = row(15).chain(row(16)).fold(0.0, f32::max);
    let around = open.pixels.iter().map(|p| p[1]).sum::<f32>() / 1024.0;
    assert!(brightest > 2.0 * around, "{brightest} {around}");

    let closed = render(0.0);
    assert_eq!(closed.stats.stuck_chains, 0);
    assert_eq!(closed.warnings.iter().filter(stuck).count(), 0);
}

// --- Modes ---

/// Two rooms, lit `ratio` : 1, in a picture twice as wide as it is high.
fn two_rooms(width: u32, ratio: f64) -> Scene {
    let room = |x: f64, l: f64| {
        format!(
            "AttributeBegin\nTranslate {x} 0 0\nMaterial \"matte\" \"rgb Kd\" [.6 .6 .6]\n{}\
             AreaLightSource \"diffuse\" \"rgb L\" [{l} {l} {l}]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-.3 .9 .3 .3 .9 .3 .3 .9 .7 -.3 .9 .7]\nAttributeEnd\n",
            open_box()
        )
    };
    let camera =
        "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-2 2 -1 1]";
    scene(&(head(width, width / 2, 3, camera) + &room(-1.01, ratio) + &room(1.01, 1.0)))
}

/// Row 15: modes never found. Two rooms of which no light passes from one to the other, lit 1000 :
/// 1: small steps cannot lead to the dim one, and the chains that are in it by chance say nothing
/// of its share.
#[test]
fn a_dim_room_beside_a_bright_one() {
    let scene = two_rooms(16, 1000.0);
    let [pt, mmlt] = BOTH.map(|kind| {
        let settings = Settings {
            large_step_probability: 0.7,
            ..settings(&scene, kind, 300)
        };
        Runs::new(&scene, &settings, 48)
    });
    // pbrt's cameras see x grow to the left.
    for (region, what) in [([8, 16, 0, 8], "bright room"), ([0, 8, 0, 8], "dim room")] {
        mmlt.region(region, 0)
            .expect_same_among(COMPARISONS, &pt.region(region, 0), what);
    }
    let (bright, dim) = (mmlt.region([8, 16, 0, 8], 0), mmlt.region([0, 8, 0, 8], 0));
    // The rooms are alike: the ratio of their means is that of their lights.
    let scaled = Estimate {
        mean: 1000.0 * dim.mean,
        error: 1000.0 * dim.error,
        freedom: dim.freedom,
    };
    scaled.expect_same_among(COMPARISONS, &bright, "a thousand times the dim room");
}

/// Row 15: what the render itself knows of such rooms. R-hat tells that chains which hardly ever
/// make a large step stay where they are. Of a room so dim that no chain enters it, large steps
/// tell that it is missing, and where, though all chains agree. Neither is said of chains that go
/// everywhere.
#[test]
fn rooms_that_chains_do_not_find_are_told() {
    let render = |ratio, large_step_probability, mutations| {
        let scene = two_rooms(32, ratio);
        let settings = Settings {
            large_step_probability,
            ..settings(&scene, IntegratorKind::Mmlt, mutations)
        };
        let render = run(&scene, &settings);
        let check = render.stats.cross_check.clone().unwrap();
        let rhat = render.stats.rhat.unwrap();
        println!("{rhat} {:?} {check:?}", render.warnings);
        let told = |what: &str| render.warnings.iter().filter(|w| w.contains(what)).count();
        let (apart, missed) = (told("chains disagree"), told("chains miss light"));
        // The dim room is on the left.
        if let Some(worst) = &check.worst {
            assert_eq!(worst.tile, [0, 16, 0, 16]);
            assert!(worst.chains < 0.5 * worst.large_steps);
            assert!(
                render
                    .warnings
                    .iter()
                    .any(|w| w.contains("pixels 0-15, 0-15"))
            );
        }
        assert_eq!(check.missed > 0, missed > 0);
        (rhat, apart, missed)
    };
    // Chains that move are fine.
    let (rhat, apart, missed) = render(1e3, 0.7, 800);
    assert!(rhat < 1.1);
    assert_eq!((apart, missed), (0, 0));
    // Those that stay are not. A chain makes some 200 iterations, and two large steps.
    let (rhat, apart, _) = render(1e3, 0.01, 200);
    assert!(rhat > 1.5);
    assert_eq!(apart, 1);
    // All agree, and are wrong.
    let (rhat, apart, missed) = render(1e6, 0.7, 800);
    assert!(rhat < 1.1);
    assert_eq!((apart, missed), (0, 1));
}

/// `[-1, 1]^3` without its front (`z = 1`).
pub fn open_box() -> String {
    let quads = [
        "-1 -1 -1 -1 1 -1 -1 1 1 -1 -1 1",
        "1 -1 -1 1 -1 1 1 1 1 1 1 -1",
        "-1 -1 -1 -1 -1 1 1 -1 1 1 -1 -1",
        "-1 1 -1 1 1 -1 1 1 1 -1 1 1",
        "-1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1",
    ];
    let mesh =
        |p| format!("Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{p}]\n");
    quads.map(mesh).concat()
}

// --- Specular, diffuse, specular ---

/// Row 27: a caustic seen in a mirror. Every path is specular, diffuse, specular: no connection
/// makes it, and chance has to meet the lamp through the glass from the mirror's side.
#[test]
fn caustics_in_mirrors() {
    const RENDERS: u64 = 32;
    let view = "LookAt 0 1 3  0 .8 -2  0 1 0\nCamera \"perspective\" \"float fov\" [20]";
    let text = head(20, 20, 6, view)
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [20 18 14]\nMaterial \"matte\" \"rgb Kd\" [0 0 0]\n\
           Translate 0 3 1.5\nShape \"sphere\" \"float radius\" [.4]\nAttributeEnd\n\
           Material \"mirror\" \"rgb Kr\" [.9 .9 .9]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 3 0 -2 3 3 -2 -3 3 -2]\n\
           Material \"matte\" \"rgb Kd\" [.7 .6 .5]\n\
           Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-3 0 -2 -3 0 3 3 0 3 3 0 -2]\n\
           AttributeBegin\nMaterial \"glass\"\nTranslate 0 1 .6\nShape \"sphere\" \"float radius\" [.45]\nAttributeEnd\n";
    let scene = scene(&text);
    // Enough paths at the start that no depth is missed, or starts from one path alone, of which no
    // error could be told.
    let change = |s: &mut Settings| {
        (s.samples_per_pixel, s.mutations_per_pixel) = (100, 200);
        (s.bootstrap, s.chains) = (50_000, 512);
    };
    let pt = renders(&scene, IntegratorKind::Pt, &change, 48);
    let mut settings = settings(&scene, IntegratorKind::Mmlt, 200);
    change(&mut settings);
    let all: Vec<_> = (1..=RENDERS)
        .map(|seed| {
            let settings = Settings {
                seed,
                ..settings.clone()
            };
            run(&scene, &settings)
        })
        .collect();
    // The errors that a render states of its tiles.
    let (mut means, mut stated) = (vec![vec![]; 4], [0.0; 4]);
    for render in &all {
        let tiles = render.stats.tiles.as_ref().unwrap();
        let errors = tiles.stderr.as_ref().unwrap();
        for i in 0..4 {
            means[i].push(tiles.mean[i]);
            stated[i] += errors[i].powi(2) / RENDERS as f64;
        }
    }
    let mmlt = Runs::of(all);
    for (i, (a, b)) in mmlt.grid(2, 2).iter().zip(pt.grid(2, 2)).enumerate() {
        let what = format!("caustic in a mirror, region {}, channel {}", i / 3, i % 3);
        a.expect_same_among(COMPARISONS, &b, &what);
    }

    // They are those which renders have.
    for (means, stated) in means.iter().zip(stated) {
        let scatter = Estimate::of(means).error * (RENDERS as f64).sqrt();
        println!("scatter {scatter:.5}, stated {:.5}", stated.sqrt());
        // Of so many values a standard deviation is known to an eighth: five of these.
        assert!((0.4..1.6).contains(&(stated.sqrt() / scatter)));
    }
}
