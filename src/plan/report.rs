//! A plan for people and for programs.

use super::{DepthPlan, Member, Plan};
use serde::Serialize;
use std::fmt;
use std::ops::Range;

/// A plan as figures and names; serialises.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanReport {
    /// Effects that run, and what calls for them.
    pub effects: Vec<Member>,
    /// Effects that do not run.
    pub absent: Vec<&'static str>,
    /// What hit points carry.
    pub vertex_fields: Vec<&'static str>,
    /// [`Plan::per_bounce`].
    pub samples_per_bounce: usize,
    /// By depth, from 0.
    pub depths: Vec<DepthReport>,
}

/// [`DepthPlan`] as figures and names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DepthReport {
    /// Scattering events of its paths.
    pub depth: u32,
    /// Light vertices of each strategy; `depth + 2 - s` are the camera's.
    pub strategies: Vec<u32>,
    /// Of a multiplexed path.
    pub primary_samples: usize,
    /// What they are for.
    pub parts: Vec<PartReport>,
}

/// Primary samples `first` to `end - 1`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartReport {
    /// Such as `light bounces`.
    pub purpose: &'static str,
    /// The first of them.
    pub first: usize,
    /// One past the last.
    pub end: usize,
}

impl PlanReport {
    /// What is told of a plan.
    pub fn of(plan: &Plan) -> Self {
        Self {
            effects: plan.effects.members(),
            absent: plan.effects.absent(),
            vertex_fields: vertex_fields(plan),
            samples_per_bounce: plan.per_bounce,
            depths: plan.depths.iter().map(depth).collect(),
        }
    }
}

fn depth(plan: &DepthPlan) -> DepthReport {
    let parts = plan.layout.parts().into_iter();
    DepthReport {
        depth: plan.depth,
        strategies: plan.strategies.clone(),
        primary_samples: plan.layout.total,
        parts: parts
            .filter(|(_, range)| !range.is_empty())
            .map(|(purpose, Range { start: first, end })| PartReport {
                purpose,
                first,
                end,
            })
            .collect(),
    }
}

/// Positions, geometric normals and their errors are always there.
fn vertex_fields(plan: &Plan) -> Vec<&'static str> {
    let wanted = plan.effects.wanted();
    let optional = [
        (wanted.normals, "shading normal"),
        (wanted.uv, "texture coordinates"),
        (wanted.tangent, "tangent"),
    ];
    let extra = optional.into_iter().filter(|(on, _)| *on);
    (["position", "error bound", "geometric normal"].into_iter())
        .chain(extra.map(|(_, name)| name))
        .collect()
}

impl fmt::Display for Plan {
    /// Effects and their reasons; the alternate form (`{:#}`) has all else, too: what is left out,
    /// and what paths of each depth consist of.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let report = PlanReport::of(self);
        let members = &report.effects;
        let width = members.iter().map(|m| m.effect.len()).max().unwrap_or(0);
        for (i, Member { effect, reason }) in members.iter().enumerate() {
            let head = if i == 0 { "effects" } else { "" };
            writeln!(f, "  {head:<13} {effect:<width$}  {reason}")?;
        }
        if members.is_empty() {
            writeln!(f, "  effects       none")?;
        }
        if !f.alternate() {
            return Ok(());
        }
        for (i, line) in wrapped(&report.absent).iter().enumerate() {
            let head = if i == 0 { "left out" } else { "" };
            writeln!(f, "  {head:<13} {line}")?;
        }
        writeln!(f, "  vertices      {}", report.vertex_fields.join(", "))?;
        writeln!(f, "  bounces       {} samples each", self.per_bounce)?;
        writeln!(f, "  depth  strategies s          primary samples")?;
        for d in &self.depths {
            let runs = d.strategies.chunk_by(|a, b| a + 1 == *b);
            let runs: Vec<String> = runs
                .map(|run| match run {
                    [first, .., last] => format!("{first}..{last}"),
                    run => run.iter().map(u32::to_string).collect(),
                })
                .collect();
            let list = if runs.is_empty() {
                "none".into()
            } else {
                runs.join(", ")
            };
            writeln!(f, "  {:>5}  {:<21} {}", d.depth, list, d.layout.total)?;
        }
        Ok(())
    }
}

/// A list in lines that fit beside their head.
fn wrapped(names: &[&str]) -> Vec<String> {
    const COLUMNS: usize = 100;
    let mut lines = vec![String::new()];
    for (i, name) in names.iter().enumerate() {
        let comma = if i + 1 < names.len() { ", " } else { "" };
        let line = lines.last_mut().filter(|l| l.len() + name.len() < COLUMNS);
        match line {
            Some(line) => *line += &format!("{name}{comma}"),
            None => lines.push(format!("{name}{comma}")),
        }
    }
    lines.iter().map(|l| l.trim_end().to_string()).collect()
}
