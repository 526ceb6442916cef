//! Who brings the light of which depth, for people and for programs.

use serde::Serialize;
use std::fmt;

/// How light is shared out among samples and chains.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Shares {
    /// Expected squared error of samples alone over that of what was chosen, for the same rays.
    pub gain: f64,
    /// Expected squared relative error after a thousand rays a pixel.
    pub expected: f64,
    /// Part of all rays that samples trace.
    pub rays: f64,
    /// Samples are paths from the camera alone.
    pub forward: bool,
    /// Those with light.
    pub depths: Vec<Share>,
}

/// How a depth is shared.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Share {
    /// Scattering events on the paths.
    pub depth: u32,
    /// Mean radiance that the pilot has found.
    pub light: f64,
    /// The most of a contribution that samples keep; 0 where chains bring all, `None` where
    /// samples do.
    pub kept: Option<f64>,
}

impl fmt::Display for Shares {
    /// `samples: depths 0-1; both: 2-4; chains: 5-8 (0.12 of the error of samples alone)`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        type Is = fn(&Share) -> bool;
        let kinds: [(&str, Is); 3] = [
            (
                match self.forward {
                    true => "paths from the camera",
                    false => "samples",
                },
                |s| s.kept.is_none(),
            ),
            ("samples and chains", |s| s.kept.is_some_and(|d| d > 0.0)),
            ("chains", |s| s.kept == Some(0.0)),
        ];
        let mut first = true;
        for (name, is) in kinds {
            let depths: Vec<u32> = self
                .depths
                .iter()
                .filter(|s| is(s))
                .map(|s| s.depth)
                .collect();
            if depths.is_empty() {
                continue;
            }
            let runs = depths.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
                [first, .., last] => format!("{first}-{last}"),
                run => run.iter().map(u32::to_string).collect(),
            });
            let runs: Vec<String> = runs.collect();
            let comma = if first { "" } else { "; " };
            let plural = if depths.len() > 1 { "s" } else { "" };
            write!(f, "{comma}{name} for depth{plural} {}", runs.join(", "))?;
            first = false;
        }
        if self.depths.iter().any(|s| s.kept.is_some()) {
            let part = 1.0 / self.gain.max(1e-9);
            write!(
                f,
                ": {part:.2} of the squared error of samples alone is expected"
            )?;
        } else if !first {
            let why = match self.forward {
                true => "neither paths from lights nor chains would pay",
                false => "chains would not pay",
            };
            write!(f, ": {why}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_in_words() {
        let depth = |depth, kept| Share {
            depth,
            light: 1.0,
            kept,
        };
        let mut shares = Shares {
            gain: 4.0,
            expected: 0.1,
            rays: 0.5,
            forward: false,
            depths: vec![
                depth(0, None),
                depth(1, None),
                depth(2, Some(0.5)),
                depth(4, Some(0.0)),
            ],
        };
        assert_eq!(
            shares.to_string(),
            "samples for depths 0-1; samples and chains for depth 2; chains for depth 4: 0.25 of \
             the squared error of samples alone is expected"
        );
        shares.depths.truncate(2);
        assert_eq!(
            shares.to_string(),
            "samples for depths 0-1: chains would not pay"
        );
        shares.forward = true;
        assert_eq!(
            shares.to_string(),
            "paths from the camera for depths 0-1: neither paths from lights nor chains would pay"
        );
    }
}
