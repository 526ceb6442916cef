//! Primary samples that ask for trouble.

use crate::common::stats::Random;
use phalanx::plan::DepthPlan;
use phalanx::replay::vector::{dot, length, sub, wide};
use phalanx::replay::{Recorder, Walk, bsdf};
use phalanx::surface::Kind;

/// Numbers that a sampler rarely draws, among some that it does.
pub fn extreme(random: &mut Random) -> f32 {
    match random.below(9) {
        0 => 0.0,
        1 => 1.0 - f32::EPSILON / 2.0,
        2 => 0.5,
        3 => 0.5 - f32::EPSILON / 4.0,
        4 => 1.0 / 16_777_216.0,
        5 => 0.25,
        6 => 0.75,
        _ => random.uniform(),
    }
}

/// A number near an end of an interval, at a distance of any magnitude.
fn edge(random: &mut Random) -> f32 {
    let off = (-24.0 * random.uniform64()).exp2() as f32;
    let ends = [0.0, 1.0, 0.5, 0.25, 0.75];
    let end = ends[random.below(ends.len())];
    let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
    inside(end + sign * off)
}

/// The number or, outside `[0, 1)`, what is opposite.
fn inside(x: f32) -> f32 {
    (x - x.floor()).min(1.0 - f32::EPSILON / 2.0)
}

/// A few ulps up or down.
fn nudge(x: f32, random: &mut Random) -> f32 {
    let ulps = random.below(9) as f32 - 4.0;
    inside(x + ulps * f32::EPSILON / 4.0)
}

/// Where to look for trouble.
pub const KINDS: usize = 7;

/// Primary samples of a path that is hard in one of [`KINDS`] ways.
pub fn samples(
    recorder: &Recorder,
    plan: &DepthPlan,
    kind: usize,
    random: &mut Random,
) -> Vec<f32> {
    let n = plan.layout.total;
    let mut u: Vec<f32> = (0..n).map(|_| random.uniform()).collect();
    match kind {
        // Extremes everywhere.
        0 => u[usize::from(plan.strategies.len() > 1)..].fill_with(|| extreme(random)),
        // One or two among ordinary numbers.
        1 => {
            for _ in 0..1 + random.below(2) {
                u[random.below(n)] = extreme(random);
            }
        }
        // One number again and again.
        2 => {
            let x = if random.below(2) == 0 {
                extreme(random)
            } else {
                random.uniform()
            };
            u[usize::from(plan.strategies.len() > 1)..].fill(x);
        }
        // Borders between lights.
        3 => {
            let border = light_border(recorder, random);
            for at in [plan.layout.light_choice, plan.layout.connection_choice] {
                if at < n {
                    u[at] = nudge(border, random);
                }
            }
        }
        // Borders between lobes.
        4 => lobe_border(recorder, plan, &mut u, random),
        // Grazing directions: the rim of the disk that a hemisphere is projected to.
        5 => {
            for _ in 0..1 + random.below(3) {
                u[random.below(n)] = edge(random);
            }
        }
        // Tiny distances.
        _ => approach(recorder, plan, &mut u, random),
    }
    u
}

fn light_border(recorder: &Recorder, random: &mut Random) -> f32 {
    let below = random.below(recorder.oracle.choice.len().max(1));
    recorder.oracle.choice[..below].iter().sum::<f64>() as f32
}

/// Sets the choice of lobe at one vertex to where the choice changes.
fn lobe_border(recorder: &Recorder, plan: &DepthPlan, u: &mut [f32], random: &mut Random) {
    let at = &plan.layout;
    if at.per_bounce < 3 {
        return;
    }
    let walk = recorder.walk(plan, u);
    let mut places = Vec::new();
    for (subpath, first) in [
        (&walk.camera, at.camera_bounce),
        (&walk.light, at.light_bounce),
    ] {
        let steps = subpath.iter().flat_map(|s| s.steps.iter().enumerate());
        for (j, step) in steps.filter(|(_, s)| s.sampled.is_some()) {
            let v = &step.vertex;
            let border = match v.kind {
                Kind::SmoothDielectric => {
                    let cos = dot(wide(step.wo), v.ns);
                    let eta = f64::from(v.row[6]);
                    let eta = if cos > 0.0 { eta } else { 1.0 / eta };
                    bsdf::dielectric(cos.abs().min(1.0), eta).0
                }
                Kind::ThinDielectric => {
                    let cos = dot(wide(step.wo), v.ns).abs().min(1.0);
                    bsdf::sheet(cos, v.row[0].into())
                }
                Kind::DiffuseTransmission => bsdf::reflected_share(&v.row.map(f64::from)),
                Kind::Plastic | Kind::Substrate => 0.5,
                _ => continue,
            };
            places.push((first + j * at.per_bounce + 2, border as f32));
        }
    }
    if !places.is_empty() {
        let (place, border) = places[random.below(places.len())];
        u[place] = nudge(border, random);
    }
}

/// Brings two successive vertices as near to each other as a short search can.
fn approach(recorder: &Recorder, plan: &DepthPlan, u: &mut [f32], random: &mut Random) {
    let mut best = f64::INFINITY;
    let mut size = 0.1f32;
    let mut now = u.to_vec();
    for _ in 0..24 {
        let near = nearest(&recorder.walk(plan, &now));
        if near < best {
            best = near;
            u.copy_from_slice(&now);
        } else {
            size *= 0.7;
        }
        now.copy_from_slice(u);
        // The strategy stays.
        for x in &mut now[usize::from(plan.strategies.len() > 1)..] {
            *x = inside(*x + size * (random.uniform() - 0.5));
        }
    }
}

/// The smallest distance between successive vertices of a path that reaches from the camera to a
/// light.
fn nearest(walk: &Walk) -> f64 {
    let Some(path) = walk.paths().next() else {
        return f64::INFINITY;
    };
    let mut points: Vec<_> = path.surface.iter().map(|v| v.p).collect();
    if let phalanx::replay::End::Area { p, .. } = path.end {
        points.push(p);
    }
    (points.windows(2).map(|w| length(sub(w[0], w[1])))).fold(f64::INFINITY, f64::min)
}
