//! How property tests run: the same cases every time, and nothing written beside the sources.

use proptest::test_runner::{Config, RngSeed};

/// A failure must not come and go.
pub fn cases(count: u32) -> Config {
    Config {
        cases: count,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..Config::default()
    }
}
