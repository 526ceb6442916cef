use super::*;

fn monitor() -> Monitor {
    Monitor::new(&[0], &[3, 4, 5], false, &Tiling::new([0, 32, 0, 32]))
}

/// Shows an iteration in which one chain at raster position `x` of strategy `s` gets a
/// proposal.
fn show(monitor: &mut Monitor, iteration: u32, x: f32, s: u32, taken: bool, large: bool) {
    let mut proposed = Splat::new([1.0; 3], [x, 0.5]);
    proposed.s = s;
    monitor.place::<f32>(0, x, 0.5);
    let flag = |on: bool| [f32::from(u8::from(on))];
    monitor.see(
        iteration,
        &View {
            combined: false,
            left: &[],
            states: &[ChainSplat {
                colour: [1.0; 3],
                raster: [x, 0.5],
                s,
                ..ChainSplat::default()
            }],
            targets: &[4.0],
            proposed: &[proposed],
            share: &[0.5],
            taken: &flag(taken),
            large: &flag(large),
            seen: &if large { [2.0] } else { [0.0] },
            left_weights: &[1 << 32],
        },
    );
}

#[test]
fn segments_are_equal_whatever_the_length() {
    for records in [1, 2, 3, 4, 5, 7, 8, 100, 1000] {
        let mut m = monitor();
        for i in 0..records * EVERY {
            show(&mut m, i, (i / EVERY) as f32, 3 + i % 3, true, false);
        }
        let (segments, length) = m.segments();
        assert!(segments.len() * length as usize <= records as usize);
        assert!((segments.len() as u32 + 1) * length > records, "{records}");
        for (i, segment) in segments.iter().enumerate() {
            // Records are numbered: each segment has its own run of them.
            let (first, n) = (i as f64 * f64::from(length), f64::from(length));
            assert_eq!(segment.sums[0][0], n * first + n * (n - 1.0) / 2.0);
            assert_eq!(segment.visits.iter().sum::<u32>(), length);
            assert_eq!(segment.sums[2][0] / n, 129.0);
        }
    }
}

#[test]
fn stays_tallies_and_large_steps_are_counted() {
    let mut m = monitor();
    for i in 0..400 {
        // Accepted at 0, 100, 200, 300: each state is held for 100 iterations.
        show(&mut m, i, 17.0, 4, i % 100 == 0, i % 2 == 1);
    }
    // Records fall on every sixteenth iteration.
    assert!((85..=100).contains(&m.stays()[0].iterations));
    assert_eq!(m.stays()[0].raster, [17.0, 0.5]);
    assert_eq!(m.stays()[0].s, 4);
    let large = m.tallies()[1][1];
    assert_eq!(
        (large.proposals, large.acceptance(), large.dark),
        (25, 12.5, 0)
    );
    assert_eq!(m.tallies()[0], [Tally::default(); 3]);
    assert_eq!(m.groups()[0].sums[1], 400 * UNITS as u64);
    assert_eq!(m.large()[0], TileMoments::default());
    let tile = m.large()[1];
    assert_eq!((tile.count, tile.sum, tile.squares), (200, 400.0, 800.0));
}
