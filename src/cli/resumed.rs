//! What a render is resumed from.

use super::args::RenderArgs;
use super::failure::Failure;
use super::units;
use crate::integrate::{Checkpoint, Settings, State};

/// A render that is gone on with.
pub struct Resumed<'a> {
    /// Of the file.
    pub name: String,
    pub checkpoint: &'a Checkpoint,
    /// What to go on from: one state, or those of all shards.
    pub shards: Vec<&'a State>,
    /// Of the render, but for new flags of effort.
    pub settings: Settings,
    /// What ends it is another thing than before.
    pub new_effort: bool,
}

impl Resumed<'_> {
    /// Settings to go on with; `pixels` is the size of the crop window.
    ///
    /// # Errors
    /// There is less to do than has been done.
    pub fn settings(&self, args: &RenderArgs, pixels: u64) -> Result<Settings, Failure> {
        let mut settings = self.settings.clone();
        let wanted = args.errors.wanted();
        settings.error_layers |= wanted.is_some();
        if let (Some(flag), false) = (wanted, settings.estimate_error) {
            return Err(Failure::Input(format!(
                "{flag}: the render in {} does not estimate its error (--no-estimate)",
                self.name
            )));
        }
        if !self.new_effort {
            return Ok(settings);
        }
        args.check_effort(settings.integrator)?;
        let before = (settings.mutations_per_pixel, settings.samples_per_pixel);
        let part = self.checkpoint.state.made.part;
        args.apply_effort(&mut settings, pixels);
        // These count from the beginning. What time allows counts from now on.
        let counted = args.chains.mutations.is_some() || args.spp.is_some();
        if args.time.is_some() && !counted {
            let further = |now: &mut u64, before: u64| {
                *now = now.saturating_add((part * before as f64).ceil() as u64);
            };
            further(&mut settings.mutations_per_pixel, before.0);
            further(&mut settings.samples_per_pixel, before.1);
        }
        if settings.target_error.is_some() && !settings.estimate_error {
            return Err(Failure::Input(format!(
                "--target-error: the render in {} does not estimate its error (--no-estimate)",
                self.name
            )));
        }
        let (flag, before, now) = match settings.integrator.mutates() {
            true => ("--mutations", before.0, settings.mutations_per_pixel),
            false => ("--spp", before.1, settings.samples_per_pixel),
        };
        let made = part * before as f64;
        if (now as f64) < made {
            return Err(Failure::Input(format!(
                "{flag}: {} has had {} per pixel already, and {now} is less",
                self.name,
                units::digits(made, 4)
            )));
        }
        Ok(settings)
    }
}
