//! How often a viewer is shown a picture.

use std::time::{Duration, Instant};

use crate::integrate::Wanted;

/// Shortest time between two pictures.
const LEAST: Duration = Duration::from_secs(1);
/// All pictures together take no more of the render than one part in so many.
const PICTURES: u32 = 50;
/// And those with errors.
const JUDGED: u32 = 25;

/// When the next picture is due, and when the next with its errors. The first is due at once.
#[derive(Debug, Default)]
pub struct Pace {
    /// What has been asked for, and when.
    asked: Option<(Wanted, Instant)>,
    picture: Option<Instant>,
    judged: Option<Instant>,
}

impl Pace {
    /// Asks for what is due.
    pub fn ask(&mut self) -> Wanted {
        let now = Instant::now();
        let is_due = |next: Option<Instant>| next.is_none_or(|next| now >= next);
        let wanted = match (is_due(self.picture), is_due(self.judged)) {
            (false, _) => return Wanted::Nothing,
            (true, false) => Wanted::Picture,
            (true, true) => Wanted::Judged,
        };
        self.asked = Some((wanted, now));
        wanted
    }

    /// It is there: all since it was asked for has been spent on it.
    pub fn shown(&mut self) {
        let Some((wanted, asked)) = self.asked.take() else {
            return;
        };
        let now = Instant::now();
        let after = |pause: Duration| now.checked_add(pause.max(LEAST));
        let spent = now - asked;
        match wanted {
            Wanted::Judged => {
                self.judged = after(spent.saturating_mul(JUDGED));
                self.picture = after(LEAST);
            }
            _ => self.picture = after(spent.saturating_mul(PICTURES)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_long_is_rare() {
        let mut pace = Pace::default();
        assert_eq!(pace.ask(), Wanted::Judged);
        std::thread::sleep(Duration::from_millis(80));
        pace.shown();
        assert_eq!(pace.ask(), Wanted::Nothing);
        std::thread::sleep(LEAST);
        // Errors have taken 80 ms, and are due two seconds later.
        assert_eq!(pace.ask(), Wanted::Picture);
    }
}
