//! Renders by many processes, which MPI has started (`mpirun -n 8 phalanx render`).
//!
//! The first process does what a process by itself would do: it reads arguments, looks after files,
//! says what is to be said, and renders. At two points it tells the others ([`task`]): before it
//! loads a scene, which they load too, and before it renders, which they do together
//! ([`integrate::together`](crate::integrate::together)). Of their own they say nothing.
//!
//! Without the feature `mpi` there is one process, and several are refused: each would render the
//! whole picture.

mod follow;
mod launch;
#[cfg(feature = "mpi")]
mod mpi;
mod task;

use std::path::Path;
use std::process::ExitCode;

use self::launch::Launch;
pub use self::launch::{launched, on_this_machine, processes};
use self::task::Task;
use super::failure::Failure;
use super::input::is_stdin;
use super::memory::MemoryLimit;
use super::messages::Messages;
use crate::checkpoint::Origin;
use crate::integrate::{Alone, Checkpoint, Team};

/// The processes of a render.
pub struct Ranks {
    #[cfg(feature = "mpi")]
    world: Option<mpi::World>,
}

/// Has the first of all processes do `lead`, and the others go along with it. `max_memory` is the
/// limit of each.
pub fn with(
    max_memory: Option<u64>,
    messages: Messages,
    lead: impl FnOnce(&Ranks) -> Result<ExitCode, Failure>,
) -> Result<ExitCode, Failure> {
    let Some(launch) = launched() else {
        return lead(&Ranks::alone());
    };
    let ranks = match Ranks::of(launch) {
        Ok(ranks) => ranks,
        // Once is enough.
        Err(_) if launch.rank > 0 => return Ok(ExitCode::from(2)),
        Err(message) => return Err(Failure::Input(message)),
    };
    let done = match ranks.team().leads() {
        true => lead(&ranks),
        false => follow::follow(ranks.team(), &MemoryLimit::new(max_memory), messages),
    };
    ranks.leave();
    done
}

impl Ranks {
    /// A process by itself.
    pub fn alone() -> Self {
        Self {
            #[cfg(feature = "mpi")]
            world: None,
        }
    }

    #[cfg(feature = "mpi")]
    fn of(launch: Launch) -> Result<Self, String> {
        let world = mpi::World::new()?;
        if world.size() == launch.size {
            return Ok(Self { world: Some(world) });
        }
        let size = world.size();
        world.end();
        Err(format!(
            "{} processes were started, and this program's MPI knows of {size}: start it by the mpirun of the MPI that it was built with",
            launch.size
        ))
    }

    #[cfg(not(feature = "mpi"))]
    fn of(launch: Launch) -> Result<Self, String> {
        Err(format!(
            "MPI has started {} processes, and this phalanx was built without it: each would render the whole picture. Build it with `--features \
             mpi`, or render parts with --shard",
            launch.size
        ))
    }

    pub fn team(&self) -> &dyn Team {
        #[cfg(feature = "mpi")]
        if let Some(world) = &self.world {
            return world;
        }
        &Alone
    }

    /// Has the others load a scene, as this process is about to.
    ///
    /// # Errors
    /// They cannot read it.
    pub fn load(&self, scene: Option<&Path>) -> Result<(), Failure> {
        if self.team().is_alone() {
            return Ok(());
        }
        if scene.is_some_and(is_stdin) {
            return Err(Failure::Input(
                "a scene from standard input reaches one process alone; render it from a file"
                    .into(),
            ));
        }
        let origin = Origin::new(scene, "scene", &[]);
        let origin = origin.map_err(|e| Failure::Input(e.to_string()))?;
        self.team().tell(Task::Load(origin).to_bytes());
        Ok(())
    }

    /// Has the others render with this process.
    ///
    /// # Errors
    /// One of them cannot.
    pub fn begin(
        &self,
        checkpoint: impl FnOnce() -> Result<Checkpoint, Failure>,
    ) -> Result<(), Failure> {
        let team = self.team();
        if team.is_alone() {
            return Ok(());
        }
        let task = Task::Render(Box::new(checkpoint()?));
        team.tell(task.to_bytes());
        match follow::are_ready(team, String::new()) {
            none if none.is_empty() => Ok(()),
            problem => Err(Failure::Input(problem)),
        }
    }

    /// The end of all of them.
    fn leave(self) {
        if self.team().leads() && !self.team().is_alone() {
            self.team().tell(Task::Leave.to_bytes());
        }
        #[cfg(feature = "mpi")]
        if let Some(world) = self.world {
            world.end();
        }
    }
}
