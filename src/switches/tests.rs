//! What each switch changes, and that nothing is left of them in other builds.

use super::*;

#[test]
fn names_are_read_back() {
    for switch in Switch::ALL {
        assert_eq!(Switch::named(switch.name()), Some(switch));
    }
    assert_eq!(Switch::named("none"), None);
}

#[cfg(not(feature = "switches"))]
#[test]
fn nothing_is_on_at_compile_time() {
    const { assert!(!on(Switch::FastTriangles) && !on(Switch::FilmF64) && !on(Switch::FilmF32)) }
    const { assert!(!on(Switch::CheapMath) && !on(Switch::CheapRandom)) }
}

#[cfg(feature = "switches")]
mod with_the_feature {
    use super::*;
    use crate::film::{Destination, FilterTable, Passes, Sample, SampleFilm, SplatFilm, SplatLog};
    use crate::integrate::{Settings, Silent, render};
    use crate::pbrt::load_str;
    use crate::scene::{Filter, FilterKind, IntegratorKind, NONE, Scene};
    use crate::simd::rng::{Purpose, Stream};
    use crate::simd::{UintLanes, f32x8, math};
    use crate::trace::{Coherence, Hit, Ray, Tracer};
    use glam::Vec2;

    /// What a function gives with a switch alone.
    fn with<T>(switch: Switch, f: impl FnOnce() -> T) -> T {
        let _held = hold(Switches::only(switch));
        f()
    }

    fn robust<T>(f: impl FnOnce() -> T) -> T {
        let _held = hold(Switches::NONE);
        f()
    }

    #[test]
    fn what_is_held_is_let_go() {
        with(Switch::CheapMath, || {
            for switch in Switch::ALL {
                assert_eq!(on(switch), switch == Switch::CheapMath);
            }
        });
        robust(|| assert!(Switch::ALL.into_iter().all(|s| !on(s))));
    }

    fn one_pixel() -> FilterTable {
        let filter = Filter {
            radius: Vec2::splat(0.5),
            kind: FilterKind::Box,
        };
        FilterTable::new(&filter, [0, 1, 0, 1])
    }

    /// `n` splats of 1.
    fn splats(n: u64) -> f32 {
        let film = SplatFilm::new(one_pixel(), 1, n as f64);
        let to = Destination {
            layer: 0,
            scale: 1.0,
            half: false,
        };
        let mut log = SplatLog::default();
        log.reserve(4096);
        for _ in 0..n {
            if log.room() == 0 {
                film.add(to, &mut log);
            }
            log.push([1.0; 3], [0.5; 2], 1);
        }
        film.add(to, &mut log);
        film.resolve(&[1.0])[0][1]
    }

    #[test]
    fn a_single_precision_film_stops_at_2_to_the_24() {
        const FULL: u64 = 1 << 24;
        let n = FULL + 1000;
        assert_eq!(with(Switch::FilmF32, || splats(n)), FULL as f32);
        assert_eq!(with(Switch::FilmF64, || splats(n)), n as f32);
        assert_eq!(robust(|| splats(n)), n as f32);
    }

    /// A large sample and many small ones: the mean of `1 + n` passes.
    fn samples(n: u64) -> f64 {
        let film = SampleFilm::judged(one_pixel());
        let sample = |pass: u64, v: f32| Sample {
            raster: [0.5; 2],
            colour: [v; 3],
            pass: 2 * pass,
        };
        film.add(std::iter::once(sample(0, 16_777_216.0)));
        film.add((1..=n).map(|pass| sample(pass, 1.0)));
        f64::from(film.resolve_with_error(0..1, &Passes::whole(1)).0[0][0])
    }

    #[test]
    fn the_path_tracers_film_rounds_too() {
        assert_eq!(robust(|| samples(1000)), 16_778_216.0);
        assert_eq!(with(Switch::FilmF64, || samples(1000)), 16_778_216.0);
        assert_eq!(with(Switch::FilmF32, || samples(1000)), 16_777_216.0);
    }

    /// A closed cushion, an octahedron subdivided, around the origin.
    fn closed() -> Scene {
        let text = "Camera \"perspective\"\nWorldBegin\nLightSource \"point\" \"rgb I\" [1 1 1]\n\
             Shape \"loopsubdiv\" \"integer nlevels\" 4 \"integer indices\" [0 2 4 2 1 4 1 3 4 3 0 4 2 0 5 1 2 5 3 1 5 0 3 5] \
             \"point P\" [1.1 0.01 0.02  -1.2 0.03 0  0.02 1.3 0.01  0.03 -1.1 0.02  0.01 0.02 1.2  0 0.03 -1.3]\nWorldEnd\n";
        load_str(text, "closed.pbrt", "".as_ref()).unwrap()
    }

    /// Rays from within a closed mesh through points so far from an edge of each triangle to the opposite vertex.
    fn rays(scene: &Scene, inwards: f32) -> Vec<Ray> {
        let mut rays = Vec::new();
        let origin = [0.013f32, 0.027, -0.011];
        for triangle in &scene.triangles {
            let [a, b, c] = triangle.v.map(|v| scene.vertices[v as usize].p);
            for i in 0..16 {
                let w = (i as f32 + 0.5) / 16.0;
                let edge = [0, 1, 2].map(|k| (1.0 - w) * a[k] + w * b[k]);
                let d = [0, 1, 2].map(|k| edge[k] + inwards * (c[k] - edge[k]) - origin[k]);
                rays.push(Ray::endless(origin, d));
            }
        }
        rays
    }

    /// Rays that miss a closed mesh from within, closest hits and shadow rays alike, at both widths and by both ways to follow them.
    fn escapes(tracer: &Tracer, rays: &[Ray]) -> [usize; 2] {
        let list: Vec<u32> = (0..rays.len() as u32).collect();
        let mut all = [0; 2];
        for coherence in [Coherence::Coherent, Coherence::Incoherent] {
            let mut hits = vec![Hit::default(); rays.len()];
            let mut blocked = vec![0; rays.len()];
            tracer.closest_with::<f32x8>(coherence, rays, &list, &mut hits);
            tracer.occluded_with::<f32x8>(coherence, rays, &list, &mut blocked);
            all[0] += hits.iter().filter(|h| h.is_none()).count();
            all[1] += blocked.iter().filter(|b| **b == 0).count();
            tracer.closest_with::<f32>(coherence, rays, &list, &mut hits);
            all[0] += hits.iter().filter(|h| h.is_none()).count();
        }
        all
    }

    #[test]
    fn the_fast_triangle_test_leaks_and_the_watertight_does_not() {
        let scene = closed();
        let tracer = Tracer::build(&scene);
        let edges = rays(&scene, 0.0);
        assert!(edges.len() > 10_000);
        assert_eq!(robust(|| escapes(&tracer, &edges)), [0, 0]);
        let [closest, any] = with(Switch::FastTriangles, || escapes(&tracer, &edges));
        // Of four and two times as many rays. Chance alone would let a quarter slip through.
        assert!(closest > 0 && any > 0);
        assert!(
            closest < edges.len() && any < edges.len() / 2,
            "{closest} {any}"
        );
        let faces = rays(&scene, 0.4);
        let faces = with(Switch::FastTriangles, || escapes(&tracer, &faces));
        // What is away from all edges is hit.
        assert_eq!(faces, [0, 0]);
    }

    #[test]
    fn cheap_functions_are_near() {
        let worst = |f: fn(f32) -> f32, points: &[f32]| {
            let exact: Vec<f32> = robust(|| points.iter().map(|x| f(*x)).collect());
            let cheap: Vec<f32> =
                with(Switch::CheapMath, || points.iter().map(|x| f(*x)).collect());
            let error = |(a, b): (&f32, &f32)| (a - b).abs() / a.abs().max(1e-3);
            exact.iter().zip(&cheap).map(error).fold(0.0, f32::max)
        };
        let points: Vec<f32> = (1..10_000).map(|i| i as f32 * 1e-4).collect();
        let functions: [fn(f32) -> f32; 6] = [
            |x| math::sin_cos_turns(x).0 + 2.0,
            |x| math::sin_cos_turns(x).1 + 2.0,
            math::ln,
            |x| math::exp(20.0 * x - 10.0),
            |x| math::atan2(x, 0.3),
            math::acos,
        ];
        for (i, f) in functions.into_iter().enumerate() {
            let worst = worst(f, &points);
            assert!((1e-5..2e-3).contains(&worst), "{i}: {worst}");
        }
    }

    #[test]
    fn cheap_random_numbers_are_others_and_spread() {
        let stream = Stream::new(7, Purpose::Mutation);
        let words = || -> Vec<u32> {
            (0..4096u32)
                .flat_map(|i| stream.words::<f32>(i % 64, i / 64, i % 5))
                .collect()
        };
        let (exact, cheap) = (robust(words), with(Switch::CheapRandom, words));
        assert!(exact.iter().zip(&cheap).filter(|(a, b)| a == b).count() < 3);
        let mut bins = [0u32; 16];
        cheap.iter().for_each(|w| bins[(w >> 28) as usize] += 1);
        assert!(bins.iter().all(|n| (824..1224).contains(n)), "{bins:?}");
        let wide = with(Switch::CheapRandom, || {
            let [a, ..] =
                stream.words::<f32x8>(UintLanes::from_fn(|i| i as u32), UintLanes::splat(0), 0);
            (0..8).map(|i| a.lane(i)).collect::<Vec<_>>()
        });
        let one = with(Switch::CheapRandom, || {
            (0..8)
                .map(|i| stream.words::<f32>(i, 0, 0)[0])
                .collect::<Vec<_>>()
        });
        assert_eq!(wide, one);
    }

    /// Every switch makes another picture, near the robust one, and leaves none behind.
    #[test]
    fn pictures_change_and_change_back() {
        let text = "LookAt 0 0 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\n\
             Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\nWorldBegin\n\
             LightSource \"point\" \"point from\" [0 3 4] \"rgb I\" [30 20 10]\n\
             Shape \"trianglemesh\" \"integer indices\" [0 1 2 2 1 3] \"point P\" [-9 -9 0 9 -9 0 -9 9 1 9 9 2]\nWorldEnd\n";
        let scene = load_str(text, "a.pbrt", "".as_ref()).unwrap();
        for integrator in IntegratorKind::ALL {
            let picture = |switches| {
                let settings = Settings {
                    integrator,
                    bootstrap: 20_000,
                    mutations_per_pixel: 200,
                    samples_per_pixel: 64,
                    max_depth: 3,
                    switches,
                    ..Settings::of(&scene)
                };
                render(&scene, &settings, &Silent).unwrap().pixels
            };
            let sum = |p: &[[f32; 3]]| p.as_flattened().iter().sum::<f32>();
            let before = picture(Switches::NONE);
            for switch in Switch::ALL {
                let with = picture(Switches::only(switch));
                // What f64 rounds is below the f32 that pictures are made of.
                if switch != Switch::FilmF64 {
                    assert_ne!(before, with, "{}", switch.name());
                }
                let ratio = sum(&with) / sum(&before);
                assert!((0.9..1.1).contains(&ratio), "{}: {ratio}", switch.name());
            }
            assert_eq!(before, picture(Switches::NONE));
        }
    }
}
