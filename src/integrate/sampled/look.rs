//! What is seen of samples between two rounds.

use super::Sampling;
use crate::checkpoint::Malformed;
use crate::integrate::error::Looks;
use crate::integrate::run::Wants;
use crate::integrate::{EndedBy, Run};
use std::time::Instant;

impl Sampling<'_> {
    /// What is between two rounds: whoever wants to see it sees what all processes have made. Says
    /// whether the render ends.
    pub fn look(&mut self, looks: &mut Looks) -> Result<Option<EndedBy>, Malformed> {
        let begin = Instant::now();
        let (run, done) = (self.run, self.done);
        let hopeless = is_hopeless(run, done);
        let judged = run.settings.shard.is_none() && run.settings.estimate_error;
        let due = judged && done >= 2 * self.grid.cells() && looks.is_due();
        let wants = Wants::ask(run, due);
        if wants.is_nothing() && !hopeless {
            return Ok(None);
        }
        self.gather()?;
        let mut ended = 0u8;
        if run.team().leads() {
            run.show(wants.picture, |judged| self.see(judged));
            if wants.state {
                run.keep(false, |to| self.save(to));
            }
            let black = self.sums.is_black();
            if wants.error && !black {
                ended = u8::from(self.is_good_enough());
                looks.looked(begin);
            }
            if hopeless && black {
                ended = 2;
            }
        }
        Ok(match run.team().agree(ended) {
            0 => None,
            1 => Some(EndedBy::Target),
            // There is nothing more to make.
            _ => Some(EndedBy::Effort),
        })
    }

    /// Looks at the error, tells the observer, and says whether the target is reached.
    fn is_good_enough(&self) -> bool {
        let run = self.run;
        let error = self.relmse().sqrt();
        run.observer.error(error);
        run.settings
            .target_error
            .is_some_and(|target| error <= target)
            && self.knows_chance()
    }
}

/// Samples after which a picture that is black stays black, where only a target error would end the
/// render.
const MOST_BLACK: u64 = 1 << 24;

/// Whether a picture that is still black will be so for as long as one may wait.
fn is_hopeless(run: &Run, done: u64) -> bool {
    let endless = run.settings.target_error.is_some() && run.settings.time.is_none();
    run.world.is_unlit() || (endless && done >= MOST_BLACK)
}
