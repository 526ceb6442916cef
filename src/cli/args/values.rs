//! Values that flags take by name.

use std::fmt;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use crate::chain::mutate::Mutation;
use crate::formats::tone::Tonemap;
use crate::integrate::{Settings, StrategyChoice};
use crate::plan::Forced;
use crate::scene::{IntegratorKind, PathSamplerKind};

impl ValueEnum for Forced {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
}

impl ValueEnum for IntegratorKind {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        // As a sentence begins.
        let mut title = self.title().to_owned();
        title[..1].make_ascii_uppercase();
        let value = PossibleValue::new(self.name()).help(title);
        Some(match self {
            Self::Pssmlt(Host::DEFAULT) => value.alias("pssmlt"),
            _ => value,
        })
    }
}

/// Whose samples are mutated, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Host {
    /// Bidirectional path tracing
    Bdpt,
    /// Path tracing
    Pt,
}

impl Host {
    pub const DEFAULT: PathSamplerKind = PathSamplerKind::Bdpt;

    pub fn kind(self) -> PathSamplerKind {
        match self {
            Host::Bdpt => PathSamplerKind::Bdpt,
            Host::Pt => PathSamplerKind::Pt,
        }
    }
}

impl ValueEnum for Mutation {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Gaussian => "Normally distributed",
            Self::Kelemen => {
                "All orders of magnitude between two bounds alike (Kelemen et al. 2002)"
            }
            Self::Cauchy => "Mostly short, now and then very long",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// A number, or none: it is tuned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tuned {
    Auto,
    Is(f32),
}

impl Tuned {
    /// Sigma. Where it is tuned, the search begins at what the settings have.
    pub fn set_sigma(self, s: &mut Settings) {
        s.tune.sigma = self == Tuned::Auto;
        if let Tuned::Is(value) = self {
            s.sigma = value;
        }
    }

    /// The probability of large steps.
    pub fn set_large_step(self, s: &mut Settings) {
        s.tune.large_step = self == Tuned::Auto;
        if let Tuned::Is(value) = self {
            s.large_step_probability = value;
        }
    }
}

impl fmt::Display for Tuned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Tuned::Auto => write!(f, "auto"),
            Tuned::Is(value) => write!(f, "{value}"),
        }
    }
}

/// How much brighter a picture is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// By its own brightness.
    Auto,
    /// By so many factors of two.
    Stops(f32),
}

/// How accurate a picture shall be, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Quality {
    /// 20 % of relative error
    Draft,
    /// 5 %
    Good,
    /// 1 %
    Final,
}

impl Quality {
    /// The relative error.
    pub const fn error(self) -> f64 {
        match self {
            Self::Draft => 0.2,
            Self::Good => 0.05,
            Self::Final => 0.01,
        }
    }
}

impl ValueEnum for Tonemap {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Shoulder => "As it is up to 80 % of white, then ever more slowly towards it",
            Self::Linear => "As it is, cut off at white",
            Self::Filmic => "An S-shaped curve: dark and bright parts lose contrast",
            Self::AgxLike => "The same over stops, after AgX: bright colours go to white",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// How chains choose strategies, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ChoiceName {
    /// Each strategy of a depth as often as any other
    Uniform,
    /// More often those that the bootstrap has seen carry light, none less than half as often as
    /// uniformly
    Learned,
}

impl ChoiceName {
    /// The setting of that name.
    pub fn setting(self) -> StrategyChoice {
        match self {
            ChoiceName::Uniform => StrategyChoice::Uniform,
            ChoiceName::Learned => StrategyChoice::Learned,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Lanes {
    #[value(name = "1")]
    One,
    #[value(name = "8")]
    Eight,
}
