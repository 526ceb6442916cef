//! Processes that make one render together: who tells whom.
//!
//! The first one leads. It alone makes the bootstrap and what follows from it, says how far each
//! round goes and when the render ends, and has the picture. What it says reaches the others along
//! a binomial tree, and what they have made comes to it along the same one: with `n` processes in
//! `log2 n` steps.
//!
//! ```text
//! 0 -+- 1
//!    +- 2 --- 3
//!    +- 4 -+- 5
//!          +- 6 --- 7
//! ```

use super::state::Gathered;
use bytemuck::{Pod, bytes_of};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};

/// Carries bytes between the processes of a render. Called by one thread at a time.
pub trait Team: Sync {
    /// The number of this process, from 0 on.
    fn rank(&self) -> usize;
    /// How many there are.
    fn size(&self) -> usize;
    /// Sends bytes to another.
    fn send(&self, to: usize, bytes: &[u8]);
    /// The next bytes that another has sent to this one.
    fn receive(&self, from: usize) -> Vec<u8>;
    /// Called where a process cannot go on while others wait for it: they should end, too.
    fn fail(&self, why: &str) {
        let _ = why;
    }
}

/// A process by itself.
pub struct Alone;

impl Team for Alone {
    fn rank(&self) -> usize {
        0
    }
    fn size(&self) -> usize {
        1
    }
    fn send(&self, _: usize, _: &[u8]) {}
    fn receive(&self, _: usize) -> Vec<u8> {
        Vec::new()
    }
}

impl dyn Team + '_ {
    /// Whether this is the first process.
    pub fn leads(&self) -> bool {
        self.rank() == 0
    }

    /// Whether there are no others.
    pub fn is_alone(&self) -> bool {
        self.size() == 1
    }

    /// Whom it hears from, and sends to. None of the first.
    pub fn parent(&self) -> Option<usize> {
        let rank = self.rank();
        (rank > 0).then(|| rank & (rank - 1))
    }

    /// Whose parent it is, in order. All that come after one, and before the next, are below it.
    pub fn children(&self) -> impl DoubleEndedIterator<Item = usize> + use<> {
        let (rank, size) = (self.rank(), self.size());
        let steps = (0..rank.trailing_zeros()).map(|bit| 1usize << bit);
        let children: Vec<usize> = steps
            .map_while(|step| rank.checked_add(step).filter(|child| *child < size))
            .collect();
        children.into_iter()
    }

    /// What the first process says, at all of them.
    pub fn tell(&self, bytes: Vec<u8>) -> Vec<u8> {
        let bytes = match self.parent() {
            Some(parent) => self.receive(parent),
            None => bytes,
        };
        // The largest part of the tree first.
        for child in self.children().rev() {
            self.send(child, &bytes);
        }
        bytes
    }

    /// The value that the first process has, at all of them.
    pub fn agree<T: Pod>(&self, value: T) -> T {
        if self.is_alone() {
            return value;
        }
        let told = self.tell(bytes_of(&value).to_vec());
        bytemuck::try_pod_read_unaligned(&told).unwrap_or(value)
    }

    /// Adds up the values of all processes, at the first; the others get a part of the sum.
    pub fn sum(&self, mut value: f64) -> f64 {
        for child in self.children() {
            let more = self.receive(child);
            value += bytemuck::try_pod_read_unaligned::<f64>(&more).unwrap_or(f64::NAN);
        }
        if let Some(parent) = self.parent() {
            self.send(parent, bytes_of(&value));
        }
        value
    }
}

/// A render's team, and how far it has come.
pub(super) struct Crew<'a> {
    pub team: &'a dyn Team,
    /// The others know where to begin, or that they do not.
    pub told: AtomicBool,
    /// What has come from others so far.
    pub gathered: Mutex<Gathered>,
}

/// Of a render by one process.
pub(super) static ALONE: Crew = Crew::new(&Alone);

impl<'a> Crew<'a> {
    pub const fn new(team: &'a dyn Team) -> Self {
        Self {
            team,
            told: AtomicBool::new(false),
            gathered: Mutex::new(Gathered {
                times: 0,
                bytes: 0,
                waiting_seconds: 0.0,
                adding_seconds: 0.0,
            }),
        }
    }

    pub fn gathered(&self) -> Gathered {
        *self.gathered.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Messages one after the other, as one.
pub(super) fn joined(messages: &[Vec<u8>]) -> Vec<u8> {
    let all = messages.iter().map(|message| 8 + message.len()).sum();
    let mut joined = Vec::with_capacity(all);
    for message in messages {
        joined.extend_from_slice(&(message.len() as u64).to_le_bytes());
        joined.extend_from_slice(message);
    }
    joined
}

/// What has been [`joined`]; none if it has not.
pub(super) fn parted(mut joined: &[u8]) -> Option<Vec<Vec<u8>>> {
    let mut messages = Vec::new();
    while let Some((length, rest)) = joined.split_first_chunk() {
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (message, rest) = rest.split_at_checked(length)?;
        messages.push(message.to_vec());
        joined = rest;
    }
    joined.is_empty().then_some(messages)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Member(usize, usize);

    impl Team for Member {
        fn rank(&self) -> usize {
            self.0
        }
        fn size(&self) -> usize {
            self.1
        }
        fn send(&self, _: usize, _: &[u8]) {}
        fn receive(&self, _: usize) -> Vec<u8> {
            Vec::new()
        }
    }

    #[test]
    fn everybody_has_one_parent_and_those_below_are_in_a_row() {
        for size in 1..70 {
            let mut order = vec![0];
            let mut at = 0;
            fn walk(rank: usize, size: usize, order: &mut Vec<usize>) {
                let team: &dyn Team = &Member(rank, size);
                for child in team.children() {
                    let below: &dyn Team = &Member(child, size);
                    assert_eq!(below.parent(), Some(rank));
                    order.push(child);
                    walk(child, size, order);
                }
            }
            walk(0, size, &mut order);
            assert!(order.iter().all(|rank| {
                at += 1;
                *rank == at - 1
            }));
            assert_eq!(at, size);
        }
    }

    #[test]
    fn messages_come_apart_as_they_were() {
        let messages = vec![vec![], vec![1, 2, 3], vec![4; 1000]];
        let one = joined(&messages);
        assert_eq!(parted(&one), Some(messages));
        assert_eq!(parted(&one[..one.len() - 1]), None);
        assert_eq!(parted(&[]), Some(vec![]));
    }
}
