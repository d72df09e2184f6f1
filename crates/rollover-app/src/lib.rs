//! Rollover prevention by data-enabled predictive control: the one place where the vehicle
//! (`vehicle-dyn`) and the controller (`deepc-core`) meet.
//!
//! ```text
//! scenario file ─→ record ─→ recording.csv ─→ closed_loop ─→ log.csv ─→ summary, report
//! ```
//!
//! [`scenario`] says what is driven; [`record`] makes the data a controller works from;
//! [`closed_loop`] runs one controller on one scenario and writes a [`run_log`]; [`campaign`]
//! makes one run, [`mod@paper`] all of the paper; [`summary`] and [`report`] read logs only. [`manoeuvre`] drives a standard manoeuvre
//! without a controller; [`timing`] measures what a step costs.

pub mod campaign;
pub mod cli;
pub mod closed_loop;
pub mod identify;
pub mod interrupt;
pub mod manoeuvre;
pub mod output;
pub mod paper;
pub mod progress;
pub mod record;
pub mod report;
pub mod run_log;
pub mod scenario;
pub mod scenarios_command;
pub mod summary;
pub mod terrain;
pub mod timing;
pub mod toml_place;
pub mod vehicles_command;

use anyhow::Result;
use interrupt::Interrupt;

/// Carries out a command.
///
/// # Errors
/// When it cannot be carried out; the message says what to do. A run that ends in a rollover is
/// not an error.
pub fn execute(command: &cli::Command, interrupt: &Interrupt) -> Result<()> {
    match command {
        cli::Command::Paper(args) => paper::paper(args, interrupt),
        cli::Command::Run(args) => campaign::single(args, interrupt),
        cli::Command::Terrain(args) => terrain::command(args, interrupt),
        cli::Command::Record(args) => campaign::record_only(args, interrupt),
        cli::Command::Identify(args) => identify::identify(args, interrupt),
        cli::Command::Manoeuvre(args) => manoeuvre::manoeuvre(args, interrupt),
        cli::Command::Scenarios(args) => scenarios_command::scenarios(args),
        cli::Command::Vehicles(args) => vehicles_command::vehicles(args),
        cli::Command::Report(args) => report::command(args),
        cli::Command::Completions(args) => cli::completions(args),
    }
}
