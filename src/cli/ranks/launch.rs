//! Whether this process is one of several that MPI has started, as the environment tells.

use std::env;

/// How many processes there are, and which this one is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Launch {
    pub size: usize,
    pub rank: usize,
}

/// Where launchers say it, size and rank: Open MPI; MPICH, Intel MPI and Slurm's PMI; Slurm's PMIx,
/// whose sizes are those of any of its steps.
const SOURCES: [[&str; 2]; 3] = [
    ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
    ["PMI_SIZE", "PMI_RANK"],
    ["SLURM_STEP_NUM_TASKS", "PMIX_RANK"],
];
/// Where they say how many there are on this machine.
const LOCAL: [&str; 2] = ["OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS"];

/// `None` of a process by itself.
pub fn launched() -> Option<Launch> {
    of(|name| env::var(name).ok()).filter(|launch| launch.size > 1)
}

/// Processes of this launch.
pub fn processes() -> usize {
    launched().map_or(1, |launch| launch.size)
}

/// Processes of the same launch on this machine, this one among them.
pub fn on_this_machine() -> u64 {
    let told = LOCAL.iter().find_map(|name| env::var(name).ok());
    told.and_then(|n| n.trim().parse().ok()).unwrap_or(1).max(1)
}

fn of(variable: impl Fn(&str) -> Option<String>) -> Option<Launch> {
    let number = |name: &str| variable(name)?.trim().parse().ok();
    SOURCES.iter().find_map(|[size, rank]| {
        Some(Launch {
            size: number(size)?,
            rank: number(rank)?,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known() {
        let by = |all: &'static [(&str, &str)]| {
            of(|name| {
                let own = all.iter().find(|(own, _)| *own == name);
                own.map(|(_, value)| (*value).to_owned())
            })
        };
        let launch = |size, rank| Some(Launch { size, rank });
        let open = [("OMPI_COMM_WORLD_SIZE", "8"), ("OMPI_COMM_WORLD_RANK", "3")];
        assert_eq!(by(Box::leak(Box::new(open))), launch(8, 3));
        assert_eq!(by(&[("PMI_SIZE", "2"), ("PMI_RANK", "0")]), launch(2, 0));
        let slurm = &[("SLURM_STEP_NUM_TASKS", "4"), ("PMIX_RANK", "1")];
        assert_eq!(by(slurm), launch(4, 1));
        // A job of Slurm without MPI.
        assert_eq!(by(&[("SLURM_STEP_NUM_TASKS", "4")]), None);
        assert_eq!(by(&[("PMI_SIZE", "many"), ("PMI_RANK", "0")]), None);
        assert_eq!(by(&[]), None);
    }
}
