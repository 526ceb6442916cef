//! Whether flags fit the integrator that they are given to.

use super::{ChainArgs, RenderArgs};
use crate::cli::failure::Failure;
use crate::scene::IntegratorKind;

impl RenderArgs {
    /// Whether the effort, if it is given, is given as the integrator counts it. Given in both ways
    /// it is for any integrator.
    ///
    /// # Errors
    /// Only samples for chains, or only mutations for samples.
    pub fn check_effort(&self, integrator: IntegratorKind) -> Result<(), Failure> {
        let (flag, other) = match (self.spp, self.chains.mutations) {
            (Some(_), None) if integrator.mutates() => ("--spp", "--mutations"),
            (None, Some(_)) if !integrator.mutates() => ("--mutations", "--spp"),
            _ => return Ok(()),
        };
        let name = integrator.name();
        let instead = match integrator {
            IntegratorKind::Auto => "; --integrator pt, lt and bdpt take --spp",
            _ => "",
        };
        Err(Failure::Input(format!(
            "{flag}: the integrator {name} takes {other}{instead}"
        )))
    }

    /// Flags given that mean nothing to an integrator.
    pub fn idle(&self, integrator: IntegratorKind) -> Vec<&'static str> {
        let mut idle = match integrator.mutates() {
            true => Vec::new(),
            false => self.chains.given(),
        };
        idle.retain(|flag| *flag != "--mutations");
        let whole = matches!(integrator, IntegratorKind::Pssmlt(_));
        if whole && self.chains.strategy_choice.is_some() {
            idle.push("--strategy-choice");
        }
        if !whole && self.host.is_some() {
            idle.push("--host");
        }
        if self.strategies && integrator != IntegratorKind::Bdpt {
            idle.push("--strategies");
        }
        idle
    }
}

impl ChainArgs {
    /// Flags given that only chains know.
    pub fn given(&self) -> Vec<&'static str> {
        let flags = [
            ("--mutations", self.mutations.is_some()),
            ("--chains", self.chains.is_some()),
            ("--bootstrap", self.bootstrap.is_some()),
            ("--large-step", self.large_step.is_some()),
            ("--mutation", self.mutation.is_some()),
            ("--sigma", self.sigma.is_some()),
            ("--strategy-choice", self.strategy_choice.is_some()),
        ];
        flags.into_iter().filter(|f| f.1).map(|f| f.0).collect()
    }
}
