//! The flags of `phalanx compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, value_parser};

use crate::cli::args::parse::number_in;
use crate::metrics::{Figures, Map, flip};

/// Tell how far a picture is from a reference
///
/// MSE, RMSE, relMSE and SMAPE of linear RGB; PSNR of what a display shows (sRGB, clamped to 0 to
/// 1); FLIP, how visible the differences are (LDR-FLIP if either picture is a .png, else HDR-FLIP);
/// and the means of both, whose ratio tells bias. Of the whole picture and by tiles. To stdout, as
/// tables or as JSON.
///
/// Pixels that are infinite or not a number in either picture are left out, with a warning.
///
/// Exit codes: 0 success; 1 a limit of --max or --min does not hold, or a file could not be
/// written; 2 bad arguments, or pictures that cannot be read or compared.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true, args_override_self = true)]
pub struct CompareArgs {
    /// Picture to judge: .exr, .pfm or .png (8 or 16 bits, sRGB)
    #[arg(value_name = "A")]
    pub picture: PathBuf,

    /// Reference: the same, of the same size
    #[arg(value_name = "B")]
    pub reference: PathBuf,

    /// Draw the error of every pixel into FILE: .png in false colours, .exr and .pfm as it is; may
    /// be repeated
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,

    /// What to draw, and to order tiles by
    #[arg(
        long,
        value_name = "METRIC",
        default_value = "relmse",
        ignore_case = true,
        help_heading = "Output"
    )]
    pub map: MapName,

    /// Error that has the last colour of a .png [default: 1 for FLIP; else a round number that 95
    /// % of the pixels are below]
    #[arg(long, value_name = "MAX", value_parser = scale, help_heading = "Output")]
    pub scale: Option<f64>,

    /// Write all figures, of every tile, too, to FILE, as JSON; `-` is stdout, and takes the place
    /// of the tables
    ///
    /// `null` for `psnr_db` is infinity: no difference that a display shows.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Side of the tiles, in pixels
    #[arg(
        long,
        value_name = "N",
        default_value_t = 16,
        value_parser = value_parser!(u32).range(1..=1 << 20),
        help_heading = "Metrics"
    )]
    pub tiles: u32,

    /// Pixels per degree of visual angle, for FLIP, 10 to 1000
    ///
    /// The default is that of the paper: 0.7 m from a display 0.7 m and 3840 pixels wide.
    #[arg(
        long,
        value_name = "N",
        default_value_t = flip::PPD,
        value_parser = ppd,
        help_heading = "Metrics"
    )]
    pub ppd: f32,

    /// Fail if METRIC of the whole picture is above VALUE: mse, rmse, relmse, smape, flip or bias;
    /// may be repeated
    ///
    /// `bias` is how far the ratio of the means, A to B, is from 1. With any limit, pixels of A
    /// that are not finite fail, too.
    #[arg(long, value_name = "METRIC=VALUE", value_parser = most, help_heading = "Limits")]
    pub max: Vec<Limit>,

    /// Fail if METRIC of the whole picture is below VALUE: psnr, in dB
    #[arg(long, value_name = "METRIC=VALUE", value_parser = least, help_heading = "Limits")]
    pub min: Vec<Limit>,

    /// Print nothing but the figures, warnings and errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MapName {
    /// A - B, with its sign
    Difference,
    Mse,
    Rmse,
    Relmse,
    Smape,
    Flip,
}

impl MapName {
    pub fn map(self) -> Map {
        match self {
            Self::Difference => Map::Difference,
            Self::Mse => Map::Mse,
            Self::Rmse => Map::Rmse,
            Self::Relmse => Map::Relmse,
            Self::Smape => Map::Smape,
            Self::Flip => Map::Flip,
        }
    }

    /// As it is written.
    pub fn title(self) -> &'static str {
        match self {
            Self::Difference => "A - B",
            Self::Mse => "MSE",
            Self::Rmse => "RMSE",
            Self::Relmse => "relMSE",
            Self::Smape => "SMAPE",
            Self::Flip => "FLIP",
        }
    }
}

/// What a limit may be set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Limited {
    Mse,
    Rmse,
    Relmse,
    Smape,
    Flip,
    Bias,
    Psnr,
}

impl Limited {
    pub fn title(self) -> &'static str {
        match self {
            Self::Mse => "MSE",
            Self::Rmse => "RMSE",
            Self::Relmse => "relMSE",
            Self::Smape => "SMAPE",
            Self::Flip => "FLIP",
            Self::Bias => "bias",
            Self::Psnr => "PSNR",
        }
    }

    pub fn value(self, figures: &Figures) -> f64 {
        match self {
            Self::Mse => figures.mse,
            Self::Rmse => figures.rmse,
            Self::Relmse => figures.relmse,
            Self::Smape => figures.smape,
            Self::Flip => figures.flip,
            Self::Bias => figures.ratio.map_or(f64::INFINITY, |r| (r - 1.0).abs()),
            Self::Psnr => figures.psnr_db,
        }
    }
}

/// `METRIC=VALUE`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    pub metric: Limited,
    pub value: f64,
}

fn limit(text: &str) -> Result<Limit, String> {
    let expected = || "expected a metric and its limit, like relmse=0.01".to_string();
    let (name, value) = text.split_once('=').ok_or_else(expected)?;
    let metric = Limited::from_str(name.trim(), true).map_err(|_| {
        format!("{name} has no limits: mse, rmse, relmse, smape, flip, bias and psnr do")
    })?;
    Ok(Limit {
        metric,
        value: number_in(value, 0.0, f64::MAX)?,
    })
}

fn most(text: &str) -> Result<Limit, String> {
    match limit(text)? {
        l if l.metric == Limited::Psnr => Err(format!("more is better: use --min {text}")),
        l => Ok(l),
    }
}

fn least(text: &str) -> Result<Limit, String> {
    match limit(text)? {
        l if l.metric != Limited::Psnr => Err(format!("less is better: use --max {text}")),
        l => Ok(l),
    }
}

fn scale(text: &str) -> Result<f64, String> {
    number_in(text, 1e-30, 1e30)
}

fn ppd(text: &str) -> Result<f32, String> {
    let [least, most] = flip::PPD_RANGE.map(f64::from);
    number_in(text, least, most).map(|v| v as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits() {
        let expected = Limit {
            metric: Limited::Relmse,
            value: 0.01,
        };
        assert_eq!(most("relMSE=1e-2"), Ok(expected));
        assert_eq!(least("psnr=30").unwrap().value, 30.0);
        for bad in [
            "relmse", "relmse=", "relmse=x", "mse=-1", "mse=nan", "ssim=1", "psnr=30", "=1", "",
        ] {
            assert!(most(bad).is_err(), "{bad}");
        }
        assert!(most("psnr=30").unwrap_err().contains("--min psnr=30"));
        assert!(least("flip=0.1").unwrap_err().contains("--max flip=0.1"));
    }
}
