//! The tables of a study, for a terminal.

use crate::cli::table::{Table, heading};
use crate::converge::figures::{SceneFigures, TARGETS};
use crate::converge::report::cells;
use crate::converge::run::Study;

pub fn text(study: &Study) -> String {
    let machine = &study.machine;
    let cpu = machine.cpu.as_deref().unwrap_or(machine.arch);
    let mut out = format!(
        "phalanx {}, {cpu}, {} of {} cores\n",
        study.version, study.threads, machine.cores
    );
    for scene in &study.scenes {
        let figures = &scene.figures;
        heading(
            &mut out,
            &format!("{}: {}", figures.scene, cells::reference(figures)),
        );
        out.push('\n');
        summary(&mut out, figures);
        out.push('\n');
        budgets(&mut out, figures);
        for note in cells::notes(figures) {
            out.push_str(&format!("  {note}\n"));
        }
    }
    out.push_str("\n± is one standard error over seeds\n");
    out
}

fn summary(out: &mut String, figures: &SceneFigures) {
    let [a, b, c] = TARGETS.map(|t| format!("s to {}  ", cells::power(t)));
    let mut table = Table::new(&["variant", "slope", &a, &b, &c, "1/(relMSE s)", "gain"]);
    for (i, variant) in figures.variants.iter().enumerate() {
        let target = |i: usize| variant.targets.get(i).map_or(String::new(), cells::target);
        table.row([
            variant.name.clone(),
            cells::slope(variant),
            target(0),
            target(1),
            target(2),
            cells::optional(variant.efficiency.as_ref()),
            match i {
                0 => "1".into(),
                _ => cells::optional(variant.gain.as_ref()),
            },
        ]);
    }
    table.print(out);
}

fn budgets(out: &mut String, figures: &SceneFigures) {
    let mut table = Table::new(&[
        "variant",
        "per pixel",
        "seeds",
        "seconds",
        "relMSE",
        "less reference's ",
    ]);
    for variant in &figures.variants {
        for (i, budget) in variant.budgets.iter().enumerate() {
            let name = match i {
                0 => variant.name.clone(),
                _ => String::new(),
            };
            let [effort, runs, time, error, corrected] = cells::of_budget(budget, " ");
            table.row([name, effort, runs, time, error, corrected]);
        }
    }
    table.print(out);
}
