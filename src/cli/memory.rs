//! How much memory a command may take, and the refusal of what would take more: better than being
//! killed for it halfway.

use super::failure::Failure;
use super::ranks::on_this_machine;
use crate::integrate::{Needs, Settings};
use crate::memory::Bytes;
use crate::scene::Scene;

/// A limit on memory.
pub struct MemoryLimit {
    pub bytes: u64,
    /// Where it comes from, for messages.
    source: String,
}

impl MemoryLimit {
    /// What the user says, or three quarters of the memory that this machine, or the container the
    /// program runs in, has.
    pub fn new(flag: Option<u64>) -> Self {
        if let Some(bytes) = flag {
            return Self {
                bytes,
                source: "--max-memory".into(),
            };
        }
        match machine() {
            Some(total) => {
                let processes = on_this_machine();
                let of = match processes {
                    1 => String::new(),
                    n => format!(", shared by {n} processes"),
                };
                Self {
                    bytes: total / 4 * 3 / processes,
                    source: format!(
                        "three quarters of the {} here{of} (see --max-memory)",
                        Bytes(total)
                    ),
                }
            }
            None => Self {
                bytes: u64::MAX,
                source: String::new(),
            },
        }
    }

    /// Refuses a render that needs more; `kept` says that there are checkpoints of it.
    pub fn check(&self, scene: &Scene, settings: &Settings, kept: bool) -> Result<(), Failure> {
        let needs = match kept {
            true => Needs::of_kept(scene, settings),
            false => Needs::of(scene, settings),
        };
        if needs.bytes() <= self.bytes {
            return Ok(());
        }
        Err(Failure::Input(format!(
            "the render needs {} of memory, and {} allows {}: {needs}",
            Bytes(needs.bytes()),
            self.source,
            Bytes(self.bytes)
        )))
    }
}

/// Bytes of memory that this process can have; `None` where the system does not tell.
fn machine() -> Option<u64> {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let total = system.total_memory();
    let container = system.cgroup_limits().map(|limits| limits.total_memory);
    let total = container.map_or(total, |limit| limit.min(total));
    (total > 0).then_some(total)
}
