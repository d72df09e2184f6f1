//! What tells whether a finished run is still what would be made now.

use std::hash::{DefaultHasher, Hash, Hasher};

use anyhow::{Context, Result};

use super::plan::{Plan, PlannedRun};

/// The program itself, hashed.
#[derive(Clone, Copy)]
pub(super) struct Program(u64);

impl Program {
    /// Of the program that runs: a rebuilt one may give other results.
    ///
    /// # Errors
    /// When its file cannot be read.
    pub(super) fn running() -> Result<Self> {
        let file = std::env::current_exe().context("the program does not find its own file")?;
        let bytes = std::fs::read(&file)
            .with_context(|| format!("the program cannot read its own file {}", file.display()))?;
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        Ok(Self(hasher.finish()))
    }

    /// The fingerprint of a run: the program, and everything that the run depends on.
    pub(super) fn of_run(self, plan: &Plan, run: &PlannedRun) -> String {
        let scenario = &plan.driven(run).scenario;
        let vehicle = plan.scenes[run.scene].vehicle.parameters();
        let mut hasher = DefaultHasher::new();
        self.0.hash(&mut hasher);
        // The parts of a scenario that other controllers share, then the one that drives.
        let shared = crate::scenario::Scenario {
            controllers: std::collections::BTreeMap::new(),
            ..scenario.clone()
        };
        format!("{shared:?} {vehicle:?}").hash(&mut hasher);
        format!("{:?}", scenario.controllers.get(&run.controller)).hash(&mut hasher);
        (&run.controller, run.seed, run.mirrored, run.logged).hash(&mut hasher);
        format!("{:016x}\n", hasher.finish())
    }

    /// The fingerprint of the timing of a plan.
    pub(super) fn of_timing(self, plan: &Plan, run: &PlannedRun) -> String {
        let mut hasher = DefaultHasher::new();
        (self.of_run(plan, run), plan.moments, plan.deepc_as_written).hash(&mut hasher);
        format!("{:?}", plan.driven(run).scenario.controllers).hash(&mut hasher);
        format!("{:016x}\n", hasher.finish())
    }
}
