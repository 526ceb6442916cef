//! Settings, written and read.

use crate::chain::mutate::Mutation;
use crate::chain::tune::Tune;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::integrate::{Settings, Shard, StrategyChoice, Width};
use crate::plan::Forced;
use crate::scene::IntegratorKind;
use std::time::Duration;

impl Settings {
    /// Writes them.
    pub(super) fn save(&self, to: &mut Writer) {
        let Self {
            integrator,
            seed,
            threads,
            lanes,
            max_depth,
            samples_per_pixel,
            mutations_per_pixel,
            chains,
            bootstrap,
            large_step_probability,
            mutation,
            sigma,
            tune:
                Tune {
                    sigma: tune_sigma,
                    large_step,
                },
            time,
            target_error,
            estimate_error,
            error_layers,
            strategies,
            strategy_choice,
            batch,
            forced,
            shard,
        } = self;
        to.text(integrator.name());
        to.value([
            *seed,
            *samples_per_pixel,
            *mutations_per_pixel,
            *chains,
            *bootstrap,
        ]);
        to.count(*threads);
        to.value([lanes.lanes(), *max_depth]);
        to.value([*large_step_probability, *sigma]);
        to.text(mutation.name());
        to.text(strategy_choice.name());
        to.option(*time, |to, time| to.value(time.as_secs_f64()));
        to.option(*target_error, Writer::value);
        let flags = [
            *tune_sigma,
            *large_step,
            *estimate_error,
            *error_layers,
            *strategies,
        ];
        flags.iter().for_each(|flag| to.flag(*flag));
        to.option(*batch, Writer::count);
        to.count(forced.len());
        forced.iter().for_each(|forced| to.text(forced.name()));
        save_shard(*shard, to);
    }

    /// Reads them.
    pub(super) fn load(from: &mut Reader) -> Result<Self, Malformed> {
        let integrator = named(from, &IntegratorKind::ALL, IntegratorKind::name)?;
        let [
            seed,
            samples_per_pixel,
            mutations_per_pixel,
            chains,
            bootstrap,
        ] = from.value()?;
        let threads = from.count(1 << 20)?;
        let [lanes, max_depth] = from.value()?;
        let [large_step_probability, sigma] = from.value()?;
        let mutation = named(from, &Mutation::ALL, Mutation::name)?;
        let choices = [StrategyChoice::Uniform, StrategyChoice::Learned];
        let strategy_choice = named(from, &choices, StrategyChoice::name)?;
        let time = from.option(|from| {
            let time = Duration::try_from_secs_f64(from.value()?);
            time.map_err(|_| Malformed::new("a time is out of range"))
        })?;
        let target_error = from.option(Reader::value)?;
        let mut flag = || from.flag();
        let tune = Tune {
            sigma: flag()?,
            large_step: flag()?,
        };
        Ok(Self {
            integrator,
            seed,
            threads,
            lanes: match lanes {
                1 => Width::One,
                _ => Width::Eight,
            },
            max_depth,
            samples_per_pixel,
            mutations_per_pixel,
            chains,
            bootstrap,
            large_step_probability,
            mutation,
            sigma,
            tune,
            time,
            target_error,
            estimate_error: flag()?,
            error_layers: flag()?,
            strategies: flag()?,
            strategy_choice,
            batch: from.option(|from| from.count(1 << 30))?,
            forced: {
                let count = from.count(Forced::ALL.len())?;
                (0..count)
                    .map(|_| named(from, &Forced::ALL, Forced::name))
                    .collect::<Result<_, _>>()?
            },
            shard: load_shard(from)?,
        })
    }
}

/// Writes which part of a render it is.
pub(super) fn save_shard(shard: Option<Shard>, to: &mut Writer) {
    to.option(shard, |to, Shard { index, of }| to.value([index, of]));
}

/// Reads it.
pub(super) fn load_shard(from: &mut Reader) -> Result<Option<Shard>, Malformed> {
    from.option(|from| {
        let [index, of] = from.value()?;
        let shard = Shard { index, of };
        Malformed::unless(shard.exists(), "there is no such shard")?;
        Ok(shard)
    })
}

/// The one of a list that has the name that comes next.
fn named<T: Copy>(
    from: &mut Reader,
    all: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, Malformed> {
    let wanted = from.text()?;
    let found = all.iter().find(|one| name(**one) == wanted);
    found
        .copied()
        .ok_or_else(|| Malformed::new(format!("{wanted:?} is unknown")))
}
