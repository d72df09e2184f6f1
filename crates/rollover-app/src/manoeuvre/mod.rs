//! `manoeuvre`: a standard manoeuvre with a vehicle, its figures of merit, logs, pictures and a page.
//!
//! ```text
//! OUT/runs/RUN/log.csv   written whole, as each run ends
//! OUT/*.svg, summary.json, index.html   at the end, the page last
//! ```

mod figures;
mod files;
mod log;
mod page;

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Error, Result};
use indicatif::{ProgressBar, ProgressStyle};
use vehicle_dyn::manoeuvre::{ManoeuvreError, ManoeuvreFile, Performed, RunSettings, find};
use vehicle_dyn::parameters::VehicleParameters;

use crate::cli::ManoeuvreArgs;
use crate::interrupt::Interrupt;
use crate::output::{print_json, print_line};

pub use log::ManoeuvreLogRow;

/// Names of the manoeuvres that travel with the binary, for the help.
#[must_use]
pub fn help() -> String {
    format!("Manoeuvres: {}", vehicle_dyn::manoeuvre::names().join(", "))
}

/// Drives a manoeuvre and writes what there is to know about it.
///
/// # Errors
/// The manoeuvre or the vehicle cannot be used, a result cannot be written, or the user stopped the
/// program. A failed manoeuvre is none.
pub fn manoeuvre(args: &ManoeuvreArgs, interrupt: &Interrupt) -> Result<()> {
    let file = find(&args.manoeuvre)?;
    let vehicle = vehicle_dyn::vehicles::find(&args.vehicle)?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(&file.name).join(&vehicle.name));
    files::prepare(&out)?;
    let done = drive(&file, &vehicle, &out, interrupt)?;
    let figures = figures::draw_all(&done)?;
    let page = page::render(&file, &done, &figures)?;
    files::write_all(&out, &done.report, &figures, &page)?;
    if args.json {
        return print_json(&done.report);
    }
    print_line(&page::text(&done.report))?;
    print_line(&format!("page: {}", out.join(files::PAGE).display()))
}

/// All runs, each one's log written as it ends.
fn drive(
    file: &ManoeuvreFile,
    vehicle: &VehicleParameters,
    out: &Path,
    interrupt: &Interrupt,
) -> Result<Performed> {
    let style = ProgressStyle::with_template("{spinner} {pos:>3} runs  {elapsed}  {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    let bar = ProgressBar::new_spinner().with_style(style);
    let mut refused: Option<Error> = None;
    let done = file.perform(vehicle, RunSettings::default(), &mut |trace| {
        bar.inc(1);
        bar.set_message(trace.name.clone());
        if let Err(error) = log::write(out, trace) {
            refused = Some(error);
            return ControlFlow::Break(());
        }
        if interrupt.is_raised() {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    if let Some(error) = refused {
        return Err(error);
    }
    if let Err(ManoeuvreError::Interrupted { runs_done }) = &done {
        let kept = format!("their logs are in {}", out.join(files::RUNS).display());
        interrupt.check(&format!("after {runs_done} runs"), &kept)?;
    }
    Ok(done?)
}
