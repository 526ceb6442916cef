//! What the processes of a team have made comes together at the first of them.
//!
//! Sums of films are handed over: the film of the process that takes them has them from then on,
//! and the other one begins anew from zero. Chains are only shown. Each process takes what those
//! below it in the tree have, adds its own, and hands on the whole.

use crate::checkpoint::{Malformed, Packed, Reader, Writer};
use crate::film::{SplatFilm, Tiling};
use crate::integrate::Run;
use crate::integrate::handed_over::take;
use crate::integrate::sampled::Sampling;
use crate::integrate::schedule::ChainBudget;
use crate::integrate::schedule::saved::{Batches, Owned, load_batches, save_batches};
use crate::integrate::team::{joined, parted};

/// All processes of the team call it; the first gets the chains of the others.
pub(super) fn gather<'a>(
    run: &Run,
    budgets: &'a [ChainBudget],
    film: &SplatFilm,
    own: &Batches,
    mut beside: Option<&mut Sampling>,
) -> Result<Owned<'a>, Malformed> {
    let team = run.team();
    if team.is_alone() {
        return Ok(Vec::new());
    }
    let mut others = Vec::new();
    take(run, &mut |parts| {
        let mut parts = parts.into_iter();
        let mut pieces = || {
            let pieces = parts.next().as_deref().and_then(parted);
            pieces.ok_or_else(|| Malformed::new("there are no sums"))
        };
        film.take(pieces()?)?;
        let samples = pieces()?;
        if let Some(beside) = &mut beside {
            beside.take(samples)?;
        }
        others.extend(parts);
        Ok(())
    })?;
    if let Some(parent) = team.parent() {
        let samples = beside.map_or(Vec::new(), Sampling::hand_over);
        let mut chains = Writer::new();
        save_batches(own, &mut chains);
        let sums = [film.hand_over(), samples].map(|pieces| joined(&pieces));
        let mut all = Vec::from(sums);
        all.push(chains.finish().into_bytes());
        all.append(&mut others);
        team.send(parent, &joined(&all));
        return Ok(Vec::new());
    }
    let mut left: Vec<u64> = budgets.iter().map(|a| a.chains as u64).collect();
    for (a, _, batch) in own {
        let budget = budgets.iter().position(|other| other.index == a.index);
        if let Some(left) = budget.and_then(|i| left.get_mut(i)) {
            *left = left.saturating_sub(batch.len() as u64);
        }
    }
    let others: Vec<Packed> = others.into_iter().map(Packed::from_bytes).collect();
    let mut from: Vec<Reader> = others.iter().map(Reader::new).collect();
    let tiling = Tiling::new(run.film.crop);
    let loaded = load_batches(run, budgets, left, &tiling, &mut from)?;
    from.iter().try_for_each(Reader::end)?;
    Ok(loaded)
}

/// All chains in the order in which one process would have them.
pub(super) fn all<'a>(own: Batches<'a>, others: &'a Owned<'a>) -> Batches<'a> {
    let mut all = own;
    all.extend(others.iter().map(|(a, to, batch)| (*a, *to, batch)));
    all.sort_by_key(|(a, _, batch)| (a.index, batch.first()));
    all
}
