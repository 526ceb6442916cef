//! What other processes of a team hand over.

use super::Run;
use super::team::parted;
use crate::checkpoint::Malformed;
use std::sync::PoisonError;
use std::time::Instant;

/// Receives from all below, and adds it up by `add`.
pub(super) fn take(
    run: &Run,
    add: &mut dyn FnMut(Vec<Vec<u8>>) -> Result<(), Malformed>,
) -> Result<(), Malformed> {
    let crew = run.crew;
    let (mut bytes, mut waiting, mut adding) = (0, 0.0, 0.0);
    for child in crew.team.children() {
        let begin = Instant::now();
        let message = crew.team.receive(child);
        waiting += begin.elapsed().as_secs_f64();
        bytes += message.len() as u64;
        let begin = Instant::now();
        let parts = parted(&message).ok_or_else(|| Malformed::new("a message is cut short"))?;
        drop(message);
        add(parts)?;
        adding += begin.elapsed().as_secs_f64();
    }
    let gathered = &crew.gathered;
    let mut gathered = gathered.lock().unwrap_or_else(PoisonError::into_inner);
    gathered.times += 1;
    gathered.bytes += bytes;
    gathered.waiting_seconds += waiting;
    gathered.adding_seconds += adding;
    Ok(())
}
