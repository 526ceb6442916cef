//! Light that only chance finds ([`crate::plan::Chance`]): what of it may be missing.
//!
//! No chain, no sample and no difference of two halves can tell of light that none has met. What is
//! known without having met it are two bounds, and the smaller one counts:
//!
//! * **By trials.** A camera path that meets a lamp brings at most the lamp's radiance `L` (no
//!   surface sends on more than it gets). If none of `n` independent paths has met it, it is met
//!   with a probability of less than `3 / n`, at 95 % confidence (the "rule of three", Hanley and
//!   Lippman-Hand 1983): the mean over the picture of its light is below `3 L / n`. A multiplexed
//!   large step tries one strategy of one depth; the depth that has tried least decides.
//! * **By power.** The part of all power that the lamp sends to specular surfaces first, times the
//!   part of the picture that shows specular surfaces, is the part of all light that such paths can
//!   be expected to carry ([`World::survey`]). This is no strict bound: a caustic that fills the
//!   picture holds more.
//!
//! Where there are some discoveries, but few, their light is taken to be known to no better than
//! their number says: with `m` of equal amounts, the upper end of a Poisson mean is about `m + 2
//! sqrt(m) + 3`.

use super::depth_stats::MATTERS;
use crate::chain::discoveries::{Discoveries, Found};
use crate::scene::{IntegratorKind, PathSamplerKind, Scene};
use crate::simd::f32x8;
use crate::transport::World;
use serde::Serialize;
use std::collections::BTreeMap;

/// Discoveries of equal amounts from which on the error estimate knows about their light.
pub const FEW: f64 = 16.0;
/// Lamps that are smaller than this part of the scene, or of all directions, are named before the
/// render.
const SMALL: f64 = 1e-5;

/// A lamp of which a part of the light has no strategy but chance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hidden {
    /// Such as `the light at scene.pbrt:42`.
    pub lamp: String,
    /// Materials that its light passes first, and those that the eye sees it through: names and
    /// places. None of the latter for integrators that miss it without.
    pub through: [Vec<String>; 2],
    /// The lamp's surface over that of a ball that holds the scene; of an environment, the part of
    /// all directions that it fills.
    pub size: f64,
    /// Largest mean channel of its radiance.
    pub radiance: f64,
    /// Part of all light that such paths can be expected to carry.
    pub possible: f64,
    #[serde(skip)]
    index: usize,
}

/// What a render has found of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ChanceStats {
    /// Whose light.
    #[serde(flatten)]
    pub hidden: Hidden,
    /// Independent paths that could have met it.
    pub tried: f64,
    /// Those that have.
    pub found: u64,
    /// Those of equal amounts that would say as much.
    pub effective: f64,
    /// Part of the picture's light that they bring.
    pub share: f64,
    /// Part of all light that may be missing, at most.
    pub missing: f64,
}

/// Lamps whose light may be hidden from an integrator; none where so little is at stake that it
/// would not show.
pub fn hidden(scene: &Scene, world: &World, integrator: IntegratorKind) -> Vec<Hidden> {
    let Some(chance) = &world.chance else {
        return Vec::new();
    };
    // Without light subpaths what the eye sees directly is left to chance as well.
    let from_eye = matches!(
        integrator,
        IntegratorKind::Pt | IntegratorKind::Pssmlt(PathSamplerKind::Pt)
    );
    if integrator == IntegratorKind::Lt {
        return Vec::new();
    }
    let survey = world.survey::<f32x8>();
    let joined = !from_eye && world.plan.seen;
    let seen = if joined { survey.seen } else { 1.0 };
    (chance.lamps.iter().zip(&survey.lamps).enumerate())
        .map(|(index, (lamp, light))| Hidden {
            lamp: lamp.name.clone(),
            through: [
                named(scene, &light.through, &lamp.name),
                if joined {
                    named(scene, &survey.shown, &lamp.name)
                } else {
                    Vec::new()
                },
            ],
            size: lamp.size,
            radiance: lamp.radiance,
            possible: if survey.power > 0.0 {
                seen * light.specular / survey.power
            } else {
                0.0
            },
            index,
        })
        .filter(|hidden| hidden.possible >= MATTERS)
        .collect()
}

/// The materials that matter, the most important first; those of the lamp's file by their lines.
fn named(scene: &Scene, parts: &BTreeMap<u32, f64>, lamp: &str) -> Vec<String> {
    let place = |text: &str| {
        let (file, line) = text.rsplit_once(':')?;
        Some((file.to_owned(), line.to_owned()))
    };
    let file = lamp.split_once(" at ").and_then(|(_, at)| place(at));
    let file = file.map(|(file, _)| file);
    let most = parts.values().fold(0.0, |a: f64, b| a.max(*b));
    let mut list: Vec<_> = parts
        .iter()
        .filter(|(_, part)| **part > 0.1 * most)
        .collect();
    list.sort_by(|a, b| b.1.total_cmp(a.1));
    let name = |m: u32| {
        let material = &scene.materials[m as usize];
        match material.origin.as_str() {
            "" => format!("\"{}\"", material.name),
            origin => match place(origin) {
                Some((own, line)) if file.as_ref() == Some(&own) => {
                    format!("\"{}\" (line {line})", material.name)
                }
                _ => format!("\"{}\" ({origin})", material.name),
            },
        }
    };
    list.into_iter().take(3).map(|(m, _)| name(*m)).collect()
}

impl Hidden {
    /// Such as `light of the light at a.pbrt:7 through "glass" (a.pbrt:9), seen through "glass"`.
    pub fn what(&self) -> String {
        let [through, seen] = &self.through;
        let mut text = self.lamp.clone();
        if !through.is_empty() {
            text += &format!(" through {}", through.join(", "));
        }
        if seen == through {
            text += ", seen through the same";
        } else if !seen.is_empty() {
            text += &format!(", seen through {}", seen.join(", "));
        }
        text
    }

    /// What is said before a render, if the lamp is so small that it is likely to be missed.
    pub fn warning(&self) -> Option<String> {
        (self.size < SMALL).then(|| {
            format!(
                "{}: only paths that hit the lamp by chance bring this light, up to {:.0} % of all, and the lamp is {:.1e} of the scene's \
                 size; nothing tells of light that is never hit (docs/error.md)",
                self.what(),
                100.0 * self.possible,
                self.size
            )
        })
    }
}

/// Independent paths that bring light of their own: the large steps of a depth, or samples.
#[derive(Default)]
pub(super) struct Trials {
    /// How many.
    pub paths: f64,
    /// Part of them whose strategy is to hit a lamp by chance.
    pub chosen: f64,
    /// What they have found.
    pub found: Discoveries,
}

/// What trials of `chains`, one a depth, and of `samples` have come to; `b` is the mean of the
/// picture.
pub(super) fn judge(
    hidden: &[Hidden],
    chains: &[Trials],
    samples: Option<&Trials>,
    b: f64,
) -> Vec<ChanceStats> {
    let tries = |trials: &Trials| trials.paths * trials.chosen;
    let all = || chains.iter().chain(samples);
    let tried = all().map(tries).sum();
    let least = chains.iter().map(tries).reduce(f64::min).unwrap_or(0.0);
    let least = least + samples.map_or(0.0, tries);
    let of = |hidden: &Hidden| {
        let mut sum = Found::default();
        let mut variance = 0.0;
        for trials in all().filter(|trials| trials.paths > 0.0) {
            let found = trials.found.of(hidden.index);
            let light = found.sum / trials.paths;
            sum.count += found.count;
            sum.sum += light;
            if found.effective > 0.0 {
                variance += light * light / found.effective;
            }
        }
        if variance > 0.0 {
            sum.effective = sum.sum * sum.sum / variance;
        }
        stats(hidden, sum, [tried, least], b)
    };
    hidden.iter().map(of).collect()
}

/// The sum that was found is light by now.
fn stats(hidden: &Hidden, found: Found, [tried, least]: [f64; 2], b: f64) -> ChanceStats {
    let Found {
        count,
        effective,
        sum: light,
    } = found;
    let part = |light: f64| {
        if light > 0.0 {
            light / (light + b)
        } else {
            0.0
        }
    };
    let share = if b > 0.0 { (light / b).min(1.0) } else { 0.0 };
    let missing = if effective >= FEW {
        0.0
    } else if effective > 0.0 {
        part(light * (2.0 * effective.sqrt() + 3.0) / effective)
    } else if least > 0.0 {
        part(3.0 * hidden.radiance / least)
    } else {
        1.0
    };
    ChanceStats {
        hidden: hidden.clone(),
        tried,
        found: count,
        effective,
        share,
        missing: missing.min(hidden.possible),
    }
}

impl ChanceStats {
    /// So little of it is missing at most, or it has been found so often, that the error estimate
    /// can be trusted.
    pub fn is_known(&self) -> bool {
        self.missing < MATTERS
    }

    /// What is said at the end of a render that does not know it.
    pub fn warning(&self) -> Option<String> {
        if self.is_known() {
            return None;
        }
        let what = self.hidden.what();
        let (tried, missing) = (self.tried, 100.0 * self.missing);
        Some(match self.found {
            0 => format!(
                "{what}: this light may be missing, up to {missing:.0} % of all; only paths that hit the lamp by chance bring it, and none \
                 of {tried:.1e} independent ones has (docs/error.md)"
            ),
            n => format!(
                "{what}: this light, {:.0} % of the picture's, rests on {n} of {tried:.1e} independent paths that have hit the lamp by \
                 chance; up to {missing:.0} % of all may be missing (docs/error.md)",
                100.0 * self.share
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(radiance: f64, effective: f64, light: f64, tried: f64) -> ChanceStats {
        let hidden = Hidden {
            radiance,
            possible: 0.9,
            ..Hidden::default()
        };
        let found = Found {
            count: effective.ceil() as u64,
            effective,
            sum: light,
        };
        stats(&hidden, found, [tried; 2], 1.0)
    }

    #[test]
    fn what_has_not_been_met_is_bounded_by_the_trials_and_by_the_power() {
        assert_eq!(seen(1e9, 0.0, 0.0, 1e6).missing, 0.9);
        let many = seen(1e4, 0.0, 0.0, 3e6);
        assert!((many.missing - 0.01 / 1.01).abs() < 1e-12);
        assert!(many.is_known() && many.warning().is_none());
        assert_eq!(seen(0.0, 0.0, 0.0, 0.0).missing, 0.9);
    }

    #[test]
    fn few_discoveries_leave_room_for_more() {
        let one = seen(1e9, 1.0, 1.0, 1e6);
        assert_eq!(one.missing, 5.0 / 6.0);
        assert!(one.warning().unwrap().contains("rests on 1 of"));
        assert!(seen(1e9, FEW, 1.0, 1e6).is_known());
    }
}
