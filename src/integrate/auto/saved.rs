//! A decision, written and read.

use super::Decision;
use super::model::Choice;
use crate::checkpoint::{Malformed, Reader, Writer};
use crate::integrate::Run;

impl Decision {
    /// Writes what the render depends on.
    pub fn save(&self, to: &mut Writer) {
        let Self {
            choice:
                Choice {
                    kept,
                    samples,
                    chains,
                    rays: of_path,
                    forward,
                },
            // Budgets of chains have what became of them.
            bootstraps: _,
            light,
            usual,
            rays,
            affordable,
            gain,
            expected,
        } = self;
        to.table(kept);
        to.value([*samples, *chains]);
        to.value(*of_path);
        to.flag(*forward);
        to.table(light);
        to.value([*usual, *affordable, *gain, *expected]);
        to.value(*rays);
    }

    /// Reads it; all shards must have decided alike.
    pub fn load_all(run: &Run, from: &mut [Reader]) -> Result<Self, Malformed> {
        let packed = |decision: &Self| {
            let mut to = Writer::new();
            decision.save(&mut to);
            to.finish()
        };
        let mut all = from.iter_mut().map(|from| Self::load(run, from));
        let first = all.next();
        let first = first.ok_or_else(|| Malformed::new("there is no state"))??;
        for other in all {
            let same = packed(&other?) == packed(&first);
            Malformed::unless(same, "shards have decided otherwise")?;
        }
        Ok(first)
    }

    fn load(run: &Run, from: &mut Reader) -> Result<Self, Malformed> {
        let depths = run.world.plan.depths.len();
        let kept: Vec<f64> = from.vector(depths)?;
        Malformed::unless(
            kept.iter().all(|k| *k >= 0.0),
            "samples keep less than nothing",
        )?;
        let [samples, chains] = from.value()?;
        let rays: [f64; 2] = from.value()?;
        let choice = Choice {
            kept,
            samples,
            chains,
            rays,
            forward: from.flag()?,
        };
        let alike = !(choice.forward && choice.has_chains());
        Malformed::unless(alike, "paths from the camera have chains beside them")?;
        let light = from.vector(depths)?;
        let [usual, affordable, gain, expected] = from.value()?;
        Ok(Self {
            choice,
            bootstraps: Vec::new(),
            light,
            usual,
            affordable,
            gain,
            expected,
            rays: from.value()?,
        })
    }
}
