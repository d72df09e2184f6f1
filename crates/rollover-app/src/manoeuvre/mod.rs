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

use anyhow::{Error, Result, anyhow};
use vehicle_dyn::manoeuvre::{
    Manoeuvre, ManoeuvreError, ManoeuvreFile, Performed, RunSettings, find,
};
use vehicle_dyn::parameters::VehicleParameters;

use crate::cli::ManoeuvreArgs;
use crate::interrupt::Interrupt;
use crate::output::{print_json, print_line};
use crate::progress;
use crate::toml_place::{Place, meant, unknown_key};

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
    let file = load(&args.manoeuvre)?;
    let vehicle = crate::vehicles_command::load(&args.vehicle)?;
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

/// A manoeuvre by name or file; what is wrong with a file is told with its place.
///
/// # Errors
/// There is no such manoeuvre, or it cannot be used.
pub fn load(name_or_path: &str) -> Result<ManoeuvreFile> {
    find(name_or_path).map_err(|error| {
        // Built-in files hold no such errors.
        let text = std::fs::read_to_string(name_or_path).unwrap_or_default();
        match &error {
            ManoeuvreError::OutOfRange { field, .. } => {
                let place = Place::of_field(&text, field);
                let place = place.map_or_else(String::new, |place| format!("\n{place}"));
                anyhow!("{name_or_path}: {error}{place}")
            }
            // The parser knows only the table in which an unknown key stands.
            ManoeuvreError::Malformed { message, .. } => {
                let said = message.lines().last().unwrap_or_default();
                match (meant(said), unknown_key(said)) {
                    (Some(meant), Some(key)) => match Place::of_key(&text, key) {
                        Some(place) => {
                            anyhow!("{name_or_path} is not a manoeuvre: {said}; {meant}\n{place}")
                        }
                        None => anyhow!("{error}; {meant}"),
                    },
                    (Some(meant), None) => anyhow!("{error}; {meant}"),
                    (None, _) => error.into(),
                }
            }
            _ => error.into(),
        }
    })
}

/// How many runs a manoeuvre takes at most, or about, where that shows on the way. For the time left.
fn expected_runs(manoeuvre: &Manoeuvre) -> usize {
    /// To the left and to the right.
    const SIDES: usize = 2;
    // Runs of the sub-test that gives the handwheel angle.
    let series = |runs: usize| SIDES + SIDES * runs;
    match manoeuvre {
        Manoeuvre::Fishhook(fishhook) => series(fishhook.entrance_speeds_mph.len()),
        Manoeuvre::JTurn(j_turn) => series(j_turn.entrance_speeds_mph.len()),
        Manoeuvre::SineWithDwell(sine) => {
            let multiples = (sine.last_multiple - sine.first_multiple) / sine.multiple_step;
            series(whole(multiples) + 1)
        }
        Manoeuvre::LaneChange(lanes) => {
            let range = lanes.search_to_kmh - lanes.search_from_kmh;
            // At the entry speed, at both ends of the search, and its halvings.
            series(3 + whole((range / lanes.search_resolution_kmh).log2()))
        }
        Manoeuvre::FrequencyResponse(response) => response.frequencies_hz.len(),
        _ => SIDES,
    }
}

/// The next whole number from above.
fn whole(count: f64) -> usize {
    // Checked files give small positive numbers; more than this is no use to anybody.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped"
    )]
    let whole = count.clamp(0.0, 1e4).ceil() as usize;
    whole
}

/// All runs, each one's log written as it ends.
fn drive(
    file: &ManoeuvreFile,
    vehicle: &VehicleParameters,
    out: &Path,
    interrupt: &Interrupt,
) -> Result<Performed> {
    let bar = progress::bar(expected_runs(&file.manoeuvre), &file.name);
    let mut refused: Option<Error> = None;
    let done = file.perform(vehicle, RunSettings::default(), &mut |trace| {
        // More runs than expected do not make the line say that all is done.
        if bar.length() == Some(bar.position() + 1) {
            bar.inc_length(1);
        }
        bar.inc(1);
        bar.set_message(format!("{}: after {}", file.name, trace.name));
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
