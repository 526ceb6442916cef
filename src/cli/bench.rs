//! `phalanx bench`: how fast this machine renders a scene, and where the time goes. To stdout.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use serde::Serialize;

use super::args::look::BenchArgs;
use super::failure::Failure;
use super::input::{self, Input};
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::outputs;
use super::table::{Table, heading};
use super::units;
use crate::integrate::measure::{
    self, MeasureError, Spread, StageFigures, ThroughputReport, thread_counts,
};
use crate::integrate::{RenderError, Settings, worker_threads};
use crate::memory::Bytes;
use crate::scene::IntegratorKind;

pub fn run(args: &BenchArgs, messages: Messages) -> Result<ExitCode, Failure> {
    let json_file = args.json.as_deref().filter(|path| *path != Path::new("-"));
    if let Some(path) = json_file {
        outputs::check_text(path)?;
    }
    let memory = MemoryLimit::new(None);
    let input = input::load(args.scene.as_deref(), &memory, messages)?;
    let read = input.scene.files.iter().map(PathBuf::as_path);
    outputs::check_distinct(json_file, read)?;
    let settings = settings(args, &input);
    memory.check(&input.scene, &settings, false)?;
    messages.say(format_args!(
        "measuring for about {}, and the bootstrap; leave the machine to it",
        units::time(duration(args))
    ));
    let report = measure::measure(&input.scene, &settings, args.seconds).map_err(|e| match e {
        MeasureError::Render(RenderError::Threads { .. }) => Failure::Io(e.to_string()),
        _ => Failure::Input(format!("{}: {e}", input.name)),
    })?;
    let document = Document {
        scene_file: &input.name,
        load_seconds: input.load_time.as_secs_f64(),
        report: &report,
    };
    let json = serde_json::to_string_pretty(&document).unwrap_or_default() + "\n";
    if args.json.is_some() && json_file.is_none() {
        outputs::print(&json)?;
        return Ok(ExitCode::SUCCESS);
    }
    outputs::print(&text(&report, &input))?;
    if let Some(path) = json_file {
        outputs::save(path, |path| outputs::write_text(path, &json)).map_err(Failure::Io)?;
        messages.say(format_args!("wrote {}", path.display()));
    }
    Ok(ExitCode::SUCCESS)
}

/// A report, and what it is about.
#[derive(Serialize)]
struct Document<'a> {
    scene_file: &'a str,
    load_seconds: f64,
    #[serde(flatten)]
    report: &'a ThroughputReport,
}

/// What the scene asks of Metropolis integrators, and what the flags do.
fn settings(args: &BenchArgs, input: &Input) -> Settings {
    let scene = Settings::of(&input.scene);
    Settings {
        integrator: args.integrator.unwrap_or(IntegratorKind::Mmlt),
        seed: args.seed,
        threads: args.threads as usize,
        max_depth: args.max_depth.unwrap_or(scene.max_depth),
        bootstrap: args.bootstrap.unwrap_or(scene.bootstrap),
        batch: args.batch,
        forced: args.effects.force_effects.clone(),
        ..scene
    }
}

/// Two widths, whole and by stages; the error estimate; and every number of threads.
fn duration(args: &BenchArgs) -> Duration {
    let threads = worker_threads(args.threads as usize);
    args.seconds * (6 + thread_counts(threads).len() as u32)
}

fn text(report: &ThroughputReport, input: &Input) -> String {
    let mut out = String::new();
    about(&mut out, report, input);
    lanes(&mut out, report);
    stages(&mut out, report);
    let cost = &report.error_estimate;
    heading(
        &mut out,
        "The render's estimate of its own error, one thread",
    );
    out.push_str(&format!(
        "  time with it over time without: {:.3} ({})\n",
        cost.median,
        range(cost, |v| format!("{v:.3}"))
    ));
    threads(&mut out, report);
    out
}

fn about(out: &mut String, report: &ThroughputReport, input: &Input) {
    let (scene, boot, machine) = (&report.scene, &report.bootstrap, &report.machine);
    let cpu = machine.cpu.as_deref().unwrap_or(machine.arch);
    let built = machine.target_features.join(" ");
    let tree = match scene.tracer_bytes_per_triangle {
        Some(each) => format!("{each:.0} bytes a triangle"),
        None => "no triangles".into(),
    };
    let rows = [
        ("phalanx", report.version.to_string()),
        ("machine", format!("{cpu}, {} cores", machine.cores)),
        ("built with", built),
        ("scene", input.name.clone()),
        (
            "picture",
            format!("{} x {} pixels", scene.width, scene.height),
        ),
        (
            "chains",
            format!(
                "{}, depths 0 to {}, {} a batch",
                report.integrator, report.max_depth, report.chains_per_batch
            ),
        ),
        (
            "tree",
            format!(
                "{} triangles, {} spheres, built in {}; {}, {tree}",
                scene.triangles,
                scene.spheres,
                units::precise(Duration::from_secs_f64(scene.tracer_build_seconds)),
                Bytes(scene.tracer_bytes as u64),
            ),
        ),
        (
            "bootstrap",
            format!(
                "{} paths in {}, {} paths/s, {} rays/s on {} threads",
                units::si(boot.paths as f64),
                units::time(Duration::from_secs_f64(boot.seconds)),
                units::si(boot.paths_per_second),
                units::si(boot.rays_per_second),
                boot.threads
            ),
        ),
    ];
    for (name, value) in rows {
        out.push_str(&format!("{name:<11} {value}\n"));
    }
}

fn lanes(out: &mut String, report: &ThroughputReport) {
    heading(out, "SIMD lanes, one thread");
    let mut table = Table::new(&[
        "lanes",
        "mutations/s",
        "from .. to",
        "rays/s",
        "ns/mutation",
    ]);
    for rates in [&report.lanes.eight, &report.lanes.one] {
        table.row([
            rates.lanes.to_string(),
            units::si(rates.mutations_per_second.median),
            range(&rates.mutations_per_second, units::si),
            units::si(rates.rays_per_second.median),
            format!("{:.1}", rates.ns_per_mutation),
        ]);
    }
    let gain = &report.lanes.gain;
    table.row([
        "gain".into(),
        times(gain.median),
        range(gain, times),
        String::new(),
        String::new(),
    ]);
    table.print(out);
    out.push_str(&format!(
        "  {:.2} rays a mutation\n",
        report.lanes.rays_per_mutation
    ));
}

fn stages(out: &mut String, report: &ThroughputReport) {
    heading(
        out,
        "Where the time goes: ns a mutation, one thread, with the stage clock on",
    );
    let mut table = Table::new(&[
        "stage",
        "8 lanes",
        "share",
        "1 lane",
        "share",
        "gain",
        "live lanes",
    ]);
    let row = |s: &StageFigures| {
        let known = |value: Option<f64>| value.map_or("-".into(), |v| format!("{v:.2}"));
        [
            s.name.replace('_', " "),
            format!("{:.1}", s.ns_per_mutation),
            format!("{:.1} %", 100.0 * s.share),
            format!("{:.1}", s.ns_per_mutation_one_lane),
            format!("{:.1} %", 100.0 * s.share_one_lane),
            known(s.gain),
            known(s.mean_live_lanes),
        ]
    };
    report.stages.iter().for_each(|s| table.row(row(s)));
    table.rule();
    report.groups.iter().for_each(|s| table.row(row(s)));
    table.print(out);
}

fn threads(out: &mut String, report: &ThroughputReport) {
    heading(out, "Threads, 8 lanes");
    let mut table = Table::new(&[
        "threads",
        "mutations/s",
        "from .. to",
        "speed-up",
        "from .. to",
    ]);
    for t in &report.threads {
        table.row([
            t.threads.to_string(),
            units::si(t.mutations_per_second.median),
            range(&t.mutations_per_second, units::si),
            times(t.speed_up.median),
            range(&t.speed_up, times),
        ]);
    }
    table.print(out);
}

fn times(factor: f64) -> String {
    format!("{factor:.2}")
}

fn range(spread: &Spread, number: impl Fn(f64) -> String) -> String {
    format!("{} .. {}", number(spread.min), number(spread.max))
}
