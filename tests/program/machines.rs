//! Renders on many machines, as far as one machine can show: what batch systems do is done by hand.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::command::{command, refused, run, text};

const FLAGS: &str = "--resolution 32x24 --bootstrap 2000 --integrator mmlt --mutations 20";

/// A job script of `docs/slurm` as a task of a job; `srun` stands for Slurm's.
fn job(folder: &Path, script: &str, task: Option<u32>, arguments: &str) {
    let programs = folder.join("programs");
    if !programs.exists() {
        fs::create_dir(&programs).unwrap();
        std::os::unix::fs::symlink(env!("CARGO_BIN_EXE_phalanx"), programs.join("phalanx"))
            .unwrap();
        std::os::unix::fs::symlink("/usr/bin/env", programs.join("srun")).unwrap();
    }
    let path = std::env::var("PATH").unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("docs/slurm")
        .join(script);
    let mut command = Command::new("bash");
    command
        .arg(script)
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", programs.display()))
        // Of every step of a job.
        .env("PMI_SIZE", "1")
        .env("PMI_RANK", "0");
    if let Some(task) = task {
        command.env("SLURM_ARRAY_TASK_ID", task.to_string());
        command.env("SLURM_ARRAY_TASK_COUNT", "3");
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
}

/// A job array renders shards, once more goes on with them, and a job after it adds them up.
#[test]
fn a_job_array_comes_to_the_bits_of_one_render() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.pbrt");
    let render = format!("{} {FLAGS}", scene.display());
    for task in 1..=3 {
        job(folder, "render.sh", Some(task), &render);
    }
    job(folder, "render.sh", Some(2), &render);
    job(folder, "merge.sh", None, "merged.exr");
    let alone = run(folder, &format!("render {render} -o alone.exr"));
    assert!(alone.status.success(), "{}", text(&alone.stderr));
    let [merged, alone] =
        ["merged.exr", "alone.exr"].map(|name| fs::read(folder.join(name)).unwrap());
    assert!(merged == alone);
}

/// Without MPI each of several processes would render the whole picture.
#[test]
fn several_processes_are_refused_once_without_mpi() {
    if cfg!(feature = "mpi") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for [size, rank] in [
        ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"],
        ["PMI_SIZE", "PMI_RANK"],
    ] {
        for arguments in ["render", "resume missing"] {
            let by = |number: &str| {
                let mut command = command(folder, arguments);
                command.env(size, "2").env(rank, number);
                command.output().unwrap()
            };
            let message = refused(&by("0"));
            assert!(message.contains("--features mpi"), "{message}");
            let other = by("1");
            assert_eq!(other.status.code(), Some(2));
            assert_eq!(text(&other.stderr), "");
        }
    }
    // Shards are parts, whoever starts them.
    let part = format!("render {FLAGS} --shard 1/2 --checkpoint part");
    let output = command(folder, &part)
        .env("PMI_SIZE", "2")
        .env("PMI_RANK", "0")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
}
