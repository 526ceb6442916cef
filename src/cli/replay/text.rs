//! A replayed path as tables.

use super::super::table::{Table, heading};
use super::super::units;
use super::document::{Document, Iteration};
use crate::replay::PathReport;
use crate::replay::report::{MeetingReport, VertexReport};

pub fn of(document: &Document) -> String {
    let mut out = format!("scene       {}\n", document.scene_file);
    if let Some(iteration) = &document.iteration {
        about_chain(&mut out, iteration);
    }
    for (name, report) in [
        ("Path", &document.path),
        ("Current state", &document.current),
        ("Proposal", &document.proposal),
    ] {
        if let Some(report) = report {
            heading(&mut out, name);
            path(&mut out, report);
        }
    }
    out
}

fn about_chain(out: &mut String, i: &Iteration) {
    let kind = if i.large { "large" } else { "small" };
    let verdict = if i.accepted { "accepted" } else { "rejected" };
    let rows = [
        (
            "chain",
            format!(
                "{} of {} at depth {}, started from bootstrap path {}",
                i.chain, i.chains, i.depth, i.bootstrap_path
            ),
        ),
        ("iteration", format!("{} of {}", i.iteration, i.iterations)),
        (
            "mutations",
            format!(
                "sigma {}, large steps {}",
                i.sigma, i.large_step_probability
            ),
        ),
        (
            "proposal",
            format!(
                "{kind} step, {verdict}: acceptance probability {}, drawn {}",
                i.acceptance, i.drawn
            ),
        ),
    ];
    for (name, value) in rows {
        out.push_str(&format!("{name:<11} {value}\n"));
    }
}

fn path(out: &mut String, report: &PathReport) {
    let seen = match report.visible {
        Some(true) => "; its endpoints see each other",
        Some(false) => "; blocked between its endpoints",
        None => "",
    };
    let rejected = if report.rejected {
        "; not finite or negative, and left out"
    } else {
        ""
    };
    let [x, y] = report.raster;
    let [r, g, b] = report.contribution;
    let rows = [
        (
            "strategy",
            format!(
                "(s, t) = ({}, {}) at depth {}, one of {}, probability {}",
                report.s, report.t, report.depth, report.strategies, report.strategy_probability
            ),
        ),
        ("fate", format!("{}{seen}{rejected}", report.fate)),
        ("raster", format!("{x}, {y}")),
        ("contribution", format!("{r}, {g}, {b}")),
    ];
    for (name, value) in rows {
        out.push_str(&format!("  {name:<13} {value}\n"));
    }
    samples(out, report);
    vertices(out, &report.vertices);
    for meeting in &report.meetings {
        figures(out, meeting, report.followed);
        densities(out, meeting);
        out.push_str(&format!(
            "\n  as vertices move by what single precision makes of positions, the contribution changes by {}, the MIS weight by {}\n",
            percent(meeting.contribution_moves),
            percent(meeting.weight_moves)
        ));
        if !report.followed {
            out.push_str(
                "  in double precision the same primary samples do not hit the same primitives\n",
            );
        }
    }
}

/// Parts of the whole; errors may be infinite.
fn percent(part: f64) -> String {
    format!("{} %", units::digits(100.0 * part, 2))
}

fn samples(out: &mut String, report: &PathReport) {
    heading(out, "  Primary samples");
    for part in &report.layout {
        let numbers = report.samples.iter().skip(part.first).take(part.count);
        let numbers: Vec<String> = numbers.map(f32::to_string).collect();
        out.push_str(&format!("    {:<26} {}\n", part.name, numbers.join(" ")));
    }
    if let (Some(nm), Some(colour)) = (report.wavelength, report.colour) {
        let colour: Vec<String> = colour.map(|c| c.to_string()).into();
        out.push_str(&format!(
            "    {nm} nm: dispersed light is multiplied by {}\n",
            colour.join(" ")
        ));
    }
    // Given samples choose strategies uniformly.
    let again = report.uniform_samples.iter();
    let all: Vec<String> = again.map(f32::to_string).collect();
    out.push_str(&format!(
        "    again: --depth {} --samples {}\n",
        report.depth,
        all.join(",")
    ));
}

fn vertices(out: &mut String, vertices: &[VertexReport]) {
    heading(out, "  Vertices, single precision");
    let mut table = Table::new(&[
        "  vertex",
        "BSDF",
        "material",
        "primitive",
        "light",
        "position",
        "normal",
        "shading normal",
        "direction",
        "beta",
        "moved",
    ]);
    let number = |n: Option<u32>| n.map_or("-".into(), |n| n.to_string());
    let vector = |v: Option<[f32; 3]>| {
        v.map_or("-".into(), |v| {
            v.map(|x| units::digits(x.into(), 6)).join(" ")
        })
    };
    for v in vertices {
        table.row([
            format!("  {} {}", v.subpath, v.vertex),
            v.bsdf.unwrap_or("-").into(),
            v.material.clone().unwrap_or("-".into()),
            number(v.primitive),
            number(v.light),
            vector(Some(v.position)),
            vector(v.ng),
            vector(v.ns),
            vector(v.direction),
            vector(Some(v.beta)),
            v.moved.map_or("-".into(), |m| units::digits(m, 2)),
        ]);
    }
    table.print(out);
}

fn figures(out: &mut String, meeting: &MeetingReport, followed: bool) {
    heading(
        out,
        &format!("  Figures, by way of light {}", meeting.light),
    );
    let mut table = Table::new(&[
        "  figure",
        "single",
        "double, same vertices",
        "relative",
        "double, same samples",
        "relative",
    ]);
    let error = |e: f64| format!("{e:.1e}");
    for f in &meeting.figures {
        let exact = |v: Option<f64>| match v {
            Some(v) if followed => units::digits(v, 10),
            _ => "-".into(),
        };
        table.row([
            format!("  {}", f.name),
            f.single.to_string(),
            units::digits(f.by_vertices, 10),
            error(f.vertices_error),
            exact(f.by_samples),
            f.samples_error.map_or("-".into(), error),
        ]);
    }
    table.print(out);
}

fn densities(out: &mut String, meeting: &MeetingReport) {
    heading(
        out,
        "  Density of the path under every strategy, double precision",
    );
    let mut table = Table::new(&[
        "  (s, t)",
        "density, same vertices",
        "MIS weight",
        "density, same samples",
        "MIS weight",
    ]);
    let known = |v: Option<f64>| v.map_or("-".into(), |v| units::digits(v, 6));
    for d in &meeting.densities {
        table.row([
            format!("  ({}, {})", d.s, d.t),
            units::digits(d.by_vertices, 6),
            units::digits(d.weight_by_vertices, 6),
            known(d.by_samples),
            known(d.weight_by_samples),
        ]);
    }
    table.print(out);
}
