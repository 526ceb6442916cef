//! What does choosing a light cost?
//!
//! The choice that the renderer makes (inversion through a guide table) beside two that it could
//! make: a binary search in the cumulative powers, and an alias table (Walker 1977; Vose 1991), for
//! 1 to 100 000 lights whose powers span three orders of magnitude. Primary samples are
//! independent: nothing is in the cache because it was chosen before, as large steps have it.
//! Throughput is choices a second on one thread.
//!
//! An alias table also scatters neighbouring primary samples over all lights, which costs small
//! steps their use; that is not to be seen here.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use phalanx::light::LightChoice;

const COUNTS: [usize; 4] = [1, 10, 1_000, 100_000];
const CHOICES: usize = 1 << 16;

fn xorshift(state: &mut u64) -> f32 {
    // xorshift64*.
    *state ^= *state >> 12;
    *state ^= *state << 25;
    *state ^= *state >> 27;
    (state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 40) as f32 / 16_777_216.0
}

struct Search(Vec<f32>);

impl Search {
    fn new(powers: &[f64]) -> Self {
        let total: f64 = powers.iter().sum();
        let mut running = 0.0;
        let end = |p: &f64| {
            running += p / total;
            running as f32
        };
        Self(powers.iter().map(end).collect())
    }

    fn sample(&self, u: f32) -> u32 {
        let i = self.0.partition_point(|end| *end <= u);
        i.min(self.0.len() - 1) as u32
    }
}

struct Alias(Vec<(f32, u32)>);

impl Alias {
    fn new(powers: &[f64]) -> Self {
        let n = powers.len();
        let total: f64 = powers.iter().sum();
        let mut share: Vec<f64> = powers.iter().map(|p| p / total * n as f64).collect();
        let mut table = vec![(1.0f32, 0u32); n];
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..n).partition(|i| share[*i] < 1.0);
        while let (Some(s), Some(l)) = (small.pop(), large.last().copied()) {
            table[s] = (share[s] as f32, l as u32);
            share[l] -= 1.0 - share[s];
            if share[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        Self(table)
    }

    fn sample(&self, u: f32) -> u32 {
        let x = u * self.0.len() as f32;
        let i = (x as usize).min(self.0.len() - 1);
        let (keep, other) = self.0[i];
        if x - (i as f32) < keep {
            i as u32
        } else {
            other
        }
    }
}

fn choices(c: &mut Criterion) {
    let mut state = 0x5eed_u64;
    let numbers: Vec<f32> = (0..CHOICES).map(|_| xorshift(&mut state)).collect();
    let mut group = c.benchmark_group("choice of a light");
    group.throughput(Throughput::Elements(CHOICES as u64));
    for n in COUNTS {
        let powers: Vec<f64> = (0..n)
            .map(|_| 10f64.powf(3.0 * f64::from(xorshift(&mut state))))
            .collect();
        let (guide, search, alias) = (
            LightChoice::new(&powers),
            Search::new(&powers),
            Alias::new(&powers),
        );
        let sum = |sample: &dyn Fn(f32) -> u32| numbers.iter().fold(0u32, |a, u| a ^ sample(*u));
        group.bench_function(BenchmarkId::new("guide table", n), |b| {
            b.iter(|| sum(&|u| guide.sample(u)))
        });
        group.bench_function(BenchmarkId::new("binary search", n), |b| {
            b.iter(|| sum(&|u| search.sample(u)))
        });
        group.bench_function(BenchmarkId::new("alias table", n), |b| {
            b.iter(|| sum(&|u| alias.sample(u)))
        });
    }
    group.finish();
}

criterion_group!(benches, choices);
criterion_main!(benches);
