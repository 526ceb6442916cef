use super::*;
use crate::scene::{Filter, FilterKind};
use glam::Vec2;

/// Samples as bright as `f32` can tell, and as dark, in one pixel and next to each other.
#[test]
fn sums_have_the_range_of_f32() {
    let filter = Filter {
        radius: Vec2::splat(0.5),
        kind: FilterKind::Box,
    };
    let film = SampleFilm::judged(FilterTable::new(&filter, [0, 2, 0, 1]));
    assert!(film.is_black());
    let sample = |x, value, pass| Sample {
        raster: [x, 0.5],
        colour: [f32::MAX, f32::MIN_POSITIVE, value],
        pass,
    };
    film.add((0..6).flat_map(|pass| [sample(0.5, 1.0, pass), sample(1.5, 1e-45, pass)]));
    let pixel = |value| [f32::MAX, f32::MIN_POSITIVE, value];
    assert_eq!(film.resolve(&Passes::whole(6)), [pixel(1.0), pixel(1e-45)]);
    let (_, deviation) = film.resolve_with_error(0..2, &Passes::whole(6));
    assert_eq!(deviation, [[0.0; 3]; 2]);
    assert!(!film.is_black() && film.full() == 0);
    let of_tile = film.tile_sums()[0].iter().sum::<f64>();
    assert!((of_tile / (4.0 * f64::from(f32::MAX)) - 1.0).abs() < 1e-9);
}

/// The parts of a picture add up to it under filters of any kind, and what is flat is flat
/// where a pass was broken off.
#[test]
fn parts_add_up_and_broken_passes_are_flat() {
    let kinds = [
        FilterKind::Box,
        FilterKind::Gaussian { alpha: 2.0 },
        FilterKind::Sinc { tau: 3.0 },
    ];
    for kind in kinds {
        let filter = Filter {
            radius: Vec2::splat(2.3),
            kind,
        };
        let filter = FilterTable::new(&filter, [2, 13, 1, 12]);
        let film = SampleFilm::judged(filter.clone());
        let parts = [0, 1].map(|_| SampleFilm::part(filter.clone()));
        let mut state = 1u32;
        let mut uniform = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1u32 << 24) as f32
        };
        // Cells of 17 by 17, row by row: one pass and a half.
        for i in 0..17 * 17 * 3 / 2 {
            let cell = [i % 17 - 1, i / 17 % 17 - 2];
            let raster = cell.map(|at| at as f32 + uniform());
            let v = uniform();
            let sample = |r, g, b| Sample {
                raster,
                colour: [r, g, b],
                pass: i as u64 / (17 * 17),
            };
            film.add([sample(0.3, v, v * v)].into_iter());
            parts[0].add([sample(0.1, v, 0.0)].into_iter());
            parts[1].add([sample(0.2, 0.0, v * v)].into_iter());
        }
        let passes = Passes::with_part(1, &filter, [7.0, 6.0]);
        let whole = film.resolve(&passes);
        let [a, b] = parts.map(|part| part.resolve_part(&film, &passes));
        for ((whole, a), b) in whole.iter().zip(a).zip(b) {
            assert_eq!(whole[0], 0.3, "{kind:?}");
            for c in 0..3 {
                assert!((a[c] + b[c] - whole[c]).abs() < 1e-6, "{kind:?}");
            }
        }
    }
}
