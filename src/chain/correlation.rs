//! How long chains remember: integrated autocorrelation from a short run of small steps
//! ([`super::tune`] has the model).

/// Longest distance of two steps between which coincidences are counted.
pub(super) const LAGS: usize = 64;
/// Octaves of distances beyond.
const OCTAVES: u32 = 24;

/// What is known of one chain that makes small steps only.
pub(super) struct Curve {
    /// Probability, less `chance`, that states are in one pixel, by their distance; and beyond.
    at: Vec<f64>,
    beyond: f64,
    /// Mean acceptance probability of a large step.
    accepted: f64,
}

impl Curve {
    /// `track` has the pixels of the states, one a step.
    pub fn new(track: &[u64], chance: f64, accepted: f64) -> Self {
        let met = |lag: usize| {
            let pairs = track.iter().zip(&track[lag..]);
            let n = track.len() - lag;
            pairs.filter(|(a, b)| a == b).count() as f64 / n as f64 - chance
        };
        let at: Vec<f64> = (0..LAGS.min(track.len())).map(met).collect();
        let late = &at[at.len() / 2..];
        Self {
            beyond: late.iter().sum::<f64>() / late.len().max(1) as f64,
            at,
            accepted,
        }
    }
}

/// Of all chains: what is left of coincidences when the distance doubles, at the end of what is
/// counted.
pub(super) fn octave(chains: &[Curve]) -> f64 {
    let early = |c: &Curve| c.at[c.at.len() / 4..c.at.len() / 2].iter().sum::<f64>();
    // Half as many.
    let early = 2.0 * chains.iter().map(early).sum::<f64>();
    let late = |c: &Curve| c.at[c.at.len() / 2..].iter().sum::<f64>();
    let late = chains.iter().map(late).sum::<f64>();
    if early > 0.0 {
        (late / early).clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// Mean integrated autocorrelation of chains that make large steps with the probability `p` and end
/// with the probability `end`. `octave` is what is left of coincidences when the distance doubles.
pub(super) fn error(chains: &[Curve], octave: f64, end: f64, p: f64) -> f64 {
    let (mut near, mut far) = (0.0, 0.0);
    for chain in chains {
        let h = 1.0 / (1.0 - (1.0 - end) * p * (1.0 - chain.accepted));
        let g = (1.0 - end) * (1.0 - p) * h;
        let mut power = 1.0;
        for c in &chain.at {
            near += h * c * power;
            power *= g;
        }
        // (1 - g) / h; a chain that could never leave leaves after a very long time.
        let leaves = (end + (1.0 - end) * p * chain.accepted).max(1e-12);
        let mut c = chain.beyond;
        for _ in 0..OCTAVES {
            c *= octave;
            far += c * (power - power * power) / leaves;
            power *= power;
        }
    }
    // Chains that have forgotten all are not better than independent ones: what is below 0 is
    // noise.
    (2.0 * near + 2.0 * far.max(0.0)) / chains.len().max(1) as f64 - 1.0
}

/// Part of all pairs of states, of chains that started apart, that are in one pixel.
pub(super) fn coincidence(pixels: &[u64], seeds: &[u64]) -> f64 {
    let pairs = |keys: Vec<(u64, u64)>, same: fn(&(u64, u64), &(u64, u64)) -> bool| -> f64 {
        let runs = keys.chunk_by(same).map(|run| run.len() as f64);
        runs.map(|n| n * (n - 1.0)).sum()
    };
    let mut keys: Vec<(u64, u64)> = pixels.iter().copied().zip(seeds.iter().copied()).collect();
    keys.sort_unstable();
    let n = keys.len() as f64;
    let kin = {
        let mut seeds: Vec<(u64, u64)> = seeds.iter().map(|s| (*s, 0)).collect();
        seeds.sort_unstable();
        pairs(seeds, |a, b| a.0 == b.0)
    };
    let met = pairs(keys.clone(), |a, b| a.0 == b.0) - pairs(keys, |a, b| a == b);
    let all = n * (n - 1.0) - kin;
    if all > 0.0 { met / all } else { 0.0 }
}

/// Acceptance probabilities of large steps.
pub(super) struct LargeSteps {
    /// Targets of independent paths, ascending, and the sums up to each.
    values: Vec<f32>,
    sums: Vec<f64>,
}

impl LargeSteps {
    pub fn new(mut values: Vec<f32>) -> Self {
        values.sort_unstable_by(f32::total_cmp);
        let sums = (values.iter())
            .scan(0.0, |sum, v| {
                *sum += f64::from(*v);
                Some(*sum)
            })
            .collect();
        Self { values, sums }
    }

    /// From a state of this target.
    pub fn accepted(&self, target: f32) -> f64 {
        let n = self.values.len();
        if n == 0 || target <= 0.0 {
            return 1.0;
        }
        let below = self.values.partition_point(|v| *v < target);
        let sum = below.checked_sub(1).map_or(0.0, |last| self.sums[last]);
        (sum / f64::from(target) + (n - below) as f64) / n as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain whose small steps leave the part `power` of its correlation each.
    fn curve(power: f64, accepted: f64) -> Curve {
        Curve {
            at: (0..LAGS).map(|j| power.powi(j as i32)).collect(),
            beyond: if power < 1.0 { 0.0 } else { 1.0 },
            accepted,
        }
    }

    #[test]
    fn errors_of_chains_that_are_known() {
        for (accepted, end) in [(0.01, 0.0), (0.3, 0.0), (1.0, 0.0), (0.3, 0.02)] {
            for p in [0.05, 0.3, 0.9] {
                // What is left of the correlation by one mutation.
                let left = |power: f64| (1.0 - end) * (p * (1.0 - accepted) + (1.0 - p) * power);
                // From small steps that forget at once to small steps that never do.
                for power in [0.0, 0.3, 0.6, 1.0] {
                    let chains = [curve(power, accepted)];
                    let f = left(power);
                    let exact = (1.0 + f) / (1.0 - f);
                    let found = error(&chains, octave(&chains), end, p);
                    assert!(
                        (found / exact - 1.0).abs() < 1e-6,
                        "{accepted} {end} {p} {power}: {found} {exact}"
                    );
                }
            }
        }
    }

    /// Power laws go on as they were counted.
    #[test]
    fn errors_of_chains_that_diffuse() {
        let at: Vec<f64> = (0..1 << 16).map(|j| 1.0 / f64::from(j + 1)).collect();
        let (p, accepted) = (0.1, 0.02);
        let whole = Curve {
            at: at.clone(),
            beyond: 0.0,
            accepted,
        };
        let late = &at[LAGS / 2..LAGS];
        let counted = [Curve {
            at: at[..LAGS].to_vec(),
            beyond: late.iter().sum::<f64>() / late.len() as f64,
            accepted,
        }];
        let exact = error(&[whole], 0.0, 0.0, p);
        let found = error(&counted, octave(&counted), 0.0, p);
        let blind = error(&counted, 0.0, 0.0, p);
        assert!(
            (found - exact).abs() < 0.05 * (exact - blind),
            "{found} {exact} {blind}"
        );
    }

    #[test]
    fn large_steps_are_accepted_as_often_as_they_are() {
        let values = [0.0f32, 0.0, 3.0, 1.0, 0.25, 1.0, 80.0];
        let chance = LargeSteps::new(values.to_vec());
        for target in [0.0, 1e-6, 0.25, 0.3, 1.0, 2.0, 80.0, 1e6] {
            let ratio = |v: &f32| super::super::accept::acceptance(target, *v);
            // From where there is no light, all that have some.
            let mean = values.iter().map(ratio).sum::<f32>() / values.len() as f32;
            let expected = if target > 0.0 { f64::from(mean) } else { 1.0 };
            assert!(
                (chance.accepted(target) - expected).abs() < 1e-6,
                "{target}"
            );
        }
    }

    #[test]
    fn pairs_of_independent_chains_are_counted() {
        let mut word = 1u64;
        let mut random = |n: u64| {
            word = word.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (word >> 33) % n
        };
        let n = 200;
        let pixels: Vec<u64> = (0..n).map(|_| random(20)).collect();
        let seeds: Vec<u64> = (0..n).map(|_| random(60)).collect();
        let (mut met, mut all) = (0.0, 0.0);
        for i in 0..n {
            for j in (0..n).filter(|j| seeds[i] != seeds[*j]) {
                all += 1.0;
                met += f64::from(u8::from(pixels[i] == pixels[j]));
            }
        }
        assert_eq!(coincidence(&pixels, &seeds), met / all);
        // Nothing to compare.
        assert_eq!(coincidence(&pixels, &vec![7; n]), 0.0);
        assert_eq!(coincidence(&[], &[]), 0.0);
    }

    #[test]
    fn curves_count_what_tracks_do() {
        let track: Vec<u64> = (0..128u64).map(|i| i / 4).collect();
        let curve = Curve::new(&track, 0.0, 1.0);
        assert_eq!(curve.at[0], 1.0);
        // Of 127 neighbours, 32 times 3 are in one pixel.
        assert_eq!(curve.at[1], 96.0 / 127.0);
        assert!(curve.at[4..].iter().all(|c| *c == 0.0) && curve.beyond == 0.0);
    }
}
