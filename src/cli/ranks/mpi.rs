//! Messages by MPI. The system's library is linked; nothing else of Phalanx knows it.

use std::thread;
use std::time::{Duration, Instant};

use mpi::Threading;
use mpi::environment::{self, Universe};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, Source};

use crate::integrate::Team;

/// Bytes sent at a time: MPI counts them by 32 bits.
const PIECE: usize = 1 << 30;
/// A process that waits for longer than this, as others do while the first makes the bootstrap,
/// leaves the processor to others, and looks from time to time.
const PATIENCE: Duration = Duration::from_millis(2);
const PAUSE: Duration = Duration::from_micros(200);

/// All processes that MPI has started together.
pub struct World {
    /// None once it has ended in order.
    universe: Option<Universe>,
    rank: usize,
    size: usize,
}

impl World {
    /// Meets the others.
    ///
    /// # Errors
    /// This build of MPI cannot be called from any thread.
    pub fn new() -> Result<Self, String> {
        let (universe, threading) = environment::initialize_with_threading(Threading::Serialized)
            .ok_or("MPI has been started before")?;
        let world = universe.world();
        let (rank, size) = (world.rank() as usize, world.size() as usize);
        let world = Self {
            universe: Some(universe),
            rank,
            size,
        };
        match threading >= Threading::Serialized {
            true => Ok(world),
            false => {
                world.end();
                Err("this MPI was built without support of threads".into())
            }
        }
    }

    /// Leaves, when all others do.
    pub fn end(mut self) {
        self.universe = None;
    }
}

impl Drop for World {
    /// Whoever leaves in another way, by a panic, has others wait for ever: they end, too.
    fn drop(&mut self) {
        if self.universe.is_some() {
            SimpleCommunicator::world().abort(1);
        }
    }
}

impl Team for World {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn send(&self, to: usize, bytes: &[u8]) {
        let world = SimpleCommunicator::world();
        let to = world.process_at_rank(to as i32);
        to.send(&(bytes.len() as u64));
        bytes.chunks(PIECE).for_each(|piece| to.send(piece));
    }

    fn receive(&self, from: usize) -> Vec<u8> {
        let world = SimpleCommunicator::world();
        let from = world.process_at_rank(from as i32);
        let begin = Instant::now();
        while from.immediate_probe().is_none() {
            match begin.elapsed() < PATIENCE {
                true => thread::yield_now(),
                false => thread::sleep(PAUSE),
            }
        }
        let (length, _) = from.receive::<u64>();
        let mut bytes = vec![0u8; length as usize];
        bytes.chunks_mut(PIECE).for_each(|piece| {
            from.receive_into(piece);
        });
        bytes
    }

    fn fail(&self, why: &str) {
        eprintln!("error: process {}: {why}", self.rank);
        SimpleCommunicator::world().abort(1);
    }
}
