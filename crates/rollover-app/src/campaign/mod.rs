//! Arranges runs: one, or all of the paper's at once; writes their results.

mod job;

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use deepc_core::data::Dataset;
use vehicle_dyn::parameters::VehicleParameters;

use crate::cli::{PaperArgs, RecordArgs, RunArgs};
use crate::closed_loop::Recorded;
use crate::interrupt::Interrupt;
use crate::output::{create_folder, print_json, print_line, write_json};
use crate::record::{self, record};
use crate::report::{self, REPORT_FILE};
use crate::scenario::{self, DRIVER, Scenario};
use crate::summary::Summary;
use crate::terrain;
use job::{Job, RunResult, cores, remove_old_results, run_all, step_bar};

/// The main job's scenario and controllers.
const PAPER_SCENARIO: &str = "sedan-s1";
const PAPER_QUESTION: &str = "Does a controller that knows the vehicle only from a recorded drive keep it on its wheels where the driver alone rolls over? And how does control on a model identified from the same recording do?";
const PAPER_CONTROLLERS: [&str; 6] = [
    DRIVER,
    "rd-deepc-1",
    "rd-deepc-2",
    "rd-deepc-1-paper",
    "lmpc",
    "lmpc-no-speed-effect",
];

/// Name of the first record's file.
const RECORDING: &str = "recording.csv";

/// `paper`: every controller of the main job, a table and a report.
///
/// # Errors
/// When a run cannot be made or a result cannot be written.
pub fn paper(args: &PaperArgs, interrupt: &Interrupt) -> Result<()> {
    let scenario = scenario::load(PAPER_SCENARIO)?;
    let vehicle = load_vehicle(&scenario.vehicle)?;
    create_folder(&args.out)?;
    remove_old_results(&args.out)?;
    let dataset = recording(&scenario, &vehicle, args.seed, &args.out, interrupt)?;
    let recorded = Recorded::new(&dataset);
    let terrain = terrain::build(&scenario.ground, &scenario.course, interrupt)?;
    let job = |controller: &'static str| Job {
        scenario: &scenario,
        vehicle: &vehicle,
        terrain: terrain.clone(),
        controller,
        seed: args.seed,
        speed_reference_kmh: scenario.speed_reference_kmh,
        recorded: (controller != DRIVER).then_some(&recorded),
        recording: &[],
        out: args.out.join(controller),
    };
    let jobs: Vec<Job<'_>> = PAPER_CONTROLLERS.into_iter().map(job).collect();
    let results = run_all(
        &jobs,
        args.jobs.map_or_else(cores, std::num::NonZero::get),
        interrupt,
    );
    let runs = all_or_every_error(results)?;

    let summaries: Vec<Summary> = runs.into_iter().map(|run| run.summary).collect();
    let folders = PAPER_CONTROLLERS.map(|controller| args.out.join(controller));
    let mut report = report::collect(&folders, &report::log::Renamed::new());
    report.title = format!("Rollover prevention: {} on {}", vehicle.name, scenario.name);
    report.asked = vec![PAPER_QUESTION.into()];
    report.provenance.command = format!("rollover-app paper --seed {}", args.seed);
    let written = report::write(&report, &args.out.join(REPORT_FILE))?;
    if args.json {
        print_json(&summaries)
    } else {
        print_line(&report::summary_table(&summaries))?;
        print_models(&summaries)?;
        print_line(&format!("report: {}", written.page.display()))
    }
}

/// `run`: one controller on one scenario.
///
/// # Errors
/// When the run cannot be made or a result cannot be written.
pub fn single(args: &RunArgs, interrupt: &Interrupt) -> Result<()> {
    let (scenario, vehicle) = scenario_with_vehicle(&args.scenario, args.vehicle.as_deref())?;
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
        speed_reference_kmh,
        recorded: recorded.as_ref(),
        recording: if recorded.is_some() {
            &args.recording
        } else {
            &[]
        },
        out,
    };
    let bar = step_bar(&scenario, &args.controller);
    let result = job.run(interrupt, &bar)?;
    bar.finish_and_clear();
    let mut report = report::collect(std::slice::from_ref(&job.out), &report::log::Renamed::new());
    report.provenance.command = format!(
        "rollover-app run {} --controller {} --seed {}",
        args.scenario, args.controller, args.seed
    );
    let written = report::write(&report, &job.out.join(REPORT_FILE))?;
    if args.json {
        print_json(&result.summary)
    } else {
        print_line(&report::summary_table(std::slice::from_ref(
            &result.summary,
        )))?;
        print_models(std::slice::from_ref(&result.summary))?;
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

/// The runs, or one error that tells of all that were not made.
fn all_or_every_error(results: Vec<Result<RunResult>>) -> Result<Vec<RunResult>> {
    let (made, failed): (Vec<_>, Vec<_>) = results.into_iter().partition(Result::is_ok);
    let mut errors = failed.into_iter().filter_map(Result::err);
    match errors.next() {
        None => Ok(made.into_iter().flatten().collect()),
        Some(first) => {
            let others: Vec<String> = errors.map(|error| format!("{error:#}")).collect();
            Err(if others.is_empty() {
                first
            } else {
                first.context(others.join("; "))
            })
        }
    }
}

/// Records, and keeps the recording beside the results made from it.
fn recording(
    scenario: &Scenario,
    vehicle: &VehicleParameters,
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
) -> Result<(Scenario, VehicleParameters)> {
    let mut scenario = scenario::load(scenario)?;
    let vehicle = load_vehicle(instead.unwrap_or(&scenario.vehicle))?;
    if instead.is_some() {
        scenario.swap_vehicle(&vehicle);
    }
    Ok((scenario, vehicle))
}

fn load_vehicle(name_or_path: &str) -> Result<VehicleParameters> {
    crate::vehicles_command::load(name_or_path)
}

pub(crate) fn default_folder(scenario: &Scenario) -> PathBuf {
    Path::new("out").join(&scenario.name)
}
