//! Makes one run or one recording, and writes their results. [`crate::paper`] makes many.

pub(crate) mod job;

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use deepc_core::data::Dataset;
use vehicle_dyn::simulation::ReadyVehicle;

use crate::cli::{RecordArgs, RunArgs};
use crate::closed_loop::Recorded;
use crate::interrupt::Interrupt;
use crate::output::{create_folder, print_json, print_line, write_json};
use crate::record::{self, record};
use crate::report::{self, REPORT_FILE};
use crate::scenario::{self, Scenario};
use crate::summary::Summary;
use crate::terrain;
use crate::vehicles_command;
use job::{Job, step_bar};

/// Name of the first record's file.
pub(crate) const RECORDING: &str = "recording.csv";

/// `run`: one controller on one scenario.
///
/// # Errors
/// When the run cannot be made or a result cannot be written.
pub fn single(args: &RunArgs, interrupt: &Interrupt) -> Result<()> {
    let (mut scenario, vehicle) = scenario_with_vehicle(&args.scenario, args.vehicle.as_deref())?;
    if args.mirror {
        scenario = scenario.mirrored();
    }
    let scenario = scenario;
    let settings = scenario.controller(&args.controller)?;
    let speed_reference_kmh = args.speed.unwrap_or(scenario.speed_reference_kmh);
    scenario.check_road_at(speed_reference_kmh)?;
    let [lowest, highest] = scenario.bounds.target_speed_kmh;
    ensure!(
        settings.is_none() || (lowest..=highest).contains(&speed_reference_kmh),
        "--speed {speed_reference_kmh} is outside what {} may command: \
         bounds.target_speed_kmh = [{lowest}, {highest}] in scenario {}",
        args.controller,
        scenario.name
    );
    let terrain = match &args.terrain {
        Some(file) => terrain::read(file, &scenario)?,
        None => terrain::build(&scenario.ground, &scenario.course, interrupt)?,
    };
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&scenario).join(&args.controller));
    create_folder(&out)?;
    let data = match (settings, args.recording.as_slice()) {
        (None, _) => None,
        (Some(_), files @ [_, ..]) => Some(record::read(files, &scenario)?),
        (Some(_), []) => Some(recording(&scenario, &vehicle, args.seed, &out, interrupt)?),
    };
    let recorded = data.as_ref().map(Recorded::new);
    let job = Job {
        scenario: &scenario,
        vehicle: &vehicle,
        terrain,
        controller: &args.controller,
        seed: args.seed,
        mirrored: args.mirror,
        speed_reference_kmh,
        recorded: recorded.as_ref(),
        recording: if recorded.is_some() {
            &args.recording
        } else {
            &[]
        },
        logged: true,
        out,
    };
    let bar = step_bar(&scenario, &args.controller);
    let summary = job.run(interrupt, &bar)?;
    bar.finish_and_clear();
    let mut report = report::collect(std::slice::from_ref(&job.out), &report::log::Renamed::new());
    report.provenance.command = format!(
        "rollover-app run {} --controller {} --seed {}{}",
        args.scenario,
        args.controller,
        args.seed,
        if args.mirror { " --mirror" } else { "" }
    );
    let written = report::write(&report, &job.out.join(REPORT_FILE))?;
    if args.json {
        print_json(&summary)
    } else {
        print_line(&report::summary_table(std::slice::from_ref(&summary)))?;
        print_models(std::slice::from_ref(&summary))?;
        print_line(&format!(
            "results: {}\nreport: {}",
            job.out.display(),
            written.page.display()
        ))
    }
}

/// `record`: the recording alone.
///
/// # Errors
/// When the recording cannot be made or written.
pub fn record_only(args: &RecordArgs, interrupt: &Interrupt) -> Result<()> {
    let (scenario, vehicle) = scenario_with_vehicle(&args.scenario, args.vehicle.as_deref())?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&scenario));
    create_folder(&out)?;
    let (dataset, summary) = record(&scenario, &vehicle, args.seed, interrupt)?;
    let files = record::write(&out.join(RECORDING), &dataset)?;
    write_json(&out.join("recording.json"), &summary)?;
    if args.json {
        return print_json(&summary);
    }
    let line = |file: &Path, samples: usize, ltr: f64, deviation_m: f64| {
        print_line(&format!(
            "{}: {samples} samples, max |LTR| {ltr:.3}, at most {deviation_m:.2} m off the path",
            file.display()
        ))
    };
    let s = &summary;
    if let ([file], []) = (files.as_slice(), s.records.as_slice()) {
        return line(file, s.samples, s.ltr_abs_max, s.path_deviation_max_m);
    }
    for (file, r) in files.iter().zip(&s.records) {
        line(file, r.samples, r.ltr_abs_max, r.path_deviation_max_m)?;
    }
    Ok(())
}

/// A line for every run that predicts with an identified model.
fn print_models(summaries: &[Summary]) -> Result<()> {
    let models = summaries
        .iter()
        .filter_map(|s| Some((&s.controller, s.model.as_ref()?)));
    for (controller, model) in models {
        print_line(&format!("{controller}: {model}"))?;
    }
    Ok(())
}

/// Records, and keeps the recording beside the results made from it.
pub(crate) fn recording(
    scenario: &Scenario,
    vehicle: &ReadyVehicle,
    seed: u64,
    out: &Path,
    interrupt: &Interrupt,
) -> Result<Dataset> {
    let (dataset, summary) = record(scenario, vehicle, seed, interrupt)?;
    record::write(&out.join(RECORDING), &dataset)?;
    write_json(&out.join("recording.json"), &summary)?;
    Ok(dataset)
}

/// A scenario with its vehicle, or with the one that the user names instead.
fn scenario_with_vehicle(
    scenario: &str,
    instead: Option<&str>,
) -> Result<(Scenario, ReadyVehicle)> {
    let mut scenario = scenario::load(scenario)?;
    let vehicle = load_vehicle(instead.unwrap_or(&scenario.vehicle))?;
    if instead.is_some() {
        scenario.swap_vehicle(vehicle.parameters());
    }
    Ok((scenario, vehicle))
}

pub(crate) fn load_vehicle(name_or_path: &str) -> Result<ReadyVehicle> {
    Ok(ReadyVehicle::new(vehicles_command::load(name_or_path)?)?)
}

pub(crate) fn default_folder(scenario: &Scenario) -> PathBuf {
    Path::new("out").join(&scenario.name)
}
