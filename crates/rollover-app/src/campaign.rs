//! Arranges runs: one, or all of the paper's at once; writes their results.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Context, Result, anyhow};
use deepc_core::data::Dataset;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use serde::Serialize;
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::Course;

use crate::cli::{PaperArgs, RecordArgs, RunArgs};
use crate::closed_loop::{self, Run};
use crate::interrupt::Interrupt;
use crate::record::{self, record};
use crate::report::{self, Figure, Page, PageRun, Polyline, RunTrace};
use crate::run_log::{LogRow, write_whole};
use crate::scenario::{self, DRIVER, Scenario};
use crate::summary::{RunIdentity, Summary};

/// The main job's scenario and controllers.
const PAPER_SCENARIO: &str = "sedan-s1";
const PAPER_CONTROLLERS: [&str; 4] = [DRIVER, "rd-deepc-1", "rd-deepc-2", "rd-deepc-1-paper"];

/// `paper`: every controller of the main job, a table and a page.
///
/// # Errors
/// When a run cannot be made or a result cannot be written.
pub fn paper(args: &PaperArgs, interrupt: &Interrupt) -> Result<()> {
    let scenario = scenario::load(PAPER_SCENARIO)?;
    let vehicle = load_vehicle(&scenario.vehicle)?;
    create_folder(&args.out)?;
    let dataset = recording(&scenario, &vehicle, args.seed, &args.out)?;
    let job = |controller: &'static str| Job {
        scenario: &scenario,
        vehicle: &vehicle,
        controller,
        seed: args.seed,
        speed_reference_kmh: scenario.speed_reference_kmh,
        data: (controller != DRIVER).then_some(&dataset),
        out: args.out.join(controller),
    };
    let jobs: Vec<Job<'_>> = PAPER_CONTROLLERS.into_iter().map(job).collect();
    let results = run_all(
        &jobs,
        args.jobs.map_or_else(cores, std::num::NonZero::get),
        interrupt,
    );
    let runs = results.into_iter().collect::<Result<Vec<_>>>()?;

    let traces: Vec<RunTrace<'_>> = runs.iter().map(RunResult::trace).collect();
    let comparison = report::draw_all(&traces, &road_edges(&scenario)?)?;
    write_figures(&args.out, &comparison)?;
    let summaries: Vec<Summary> = runs.iter().map(|r| r.summary.clone()).collect();
    let pages: Vec<PageRun> = runs.into_iter().map(|r| r.into_page(&scenario)).collect();
    let index = args.out.join("index.html");
    let page = Page {
        title: format!("Rollover prevention: {} on {}", vehicle.name, scenario.name),
        description: &scenario.description,
        seed: args.seed,
        comparison: &comparison,
        runs: &pages,
    };
    report::write_index(&index, &page)?;
    if args.json {
        print_json(&summaries)?;
    } else {
        println!("{}", report::summary_table(&summaries));
        println!("figures: {}", index.display());
    }
    Ok(())
}

/// `run`: one controller on one scenario.
///
/// # Errors
/// When the run cannot be made or a result cannot be written.
pub fn single(args: &RunArgs, interrupt: &Interrupt) -> Result<()> {
    let scenario = scenario::load(&args.scenario)?;
    let settings = scenario.controller(&args.controller)?;
    let vehicle = load_vehicle(args.vehicle.as_ref().unwrap_or(&scenario.vehicle))?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&scenario).join(&args.controller));
    create_folder(&out)?;
    let data = match (settings, &args.recording) {
        (None, _) => None,
        (Some(_), Some(file)) => Some(record::read(file, &scenario)?),
        (Some(_), None) => Some(recording(&scenario, &vehicle, args.seed, &out)?),
    };
    let job = Job {
        scenario: &scenario,
        vehicle: &vehicle,
        controller: &args.controller,
        seed: args.seed,
        speed_reference_kmh: args.speed.unwrap_or(scenario.speed_reference_kmh),
        data: data.as_ref(),
        out,
    };
    let bar = step_bar(&scenario, &args.controller);
    let result = job.run(interrupt, &bar)?;
    bar.finish_and_clear();
    if args.json {
        print_json(&result.summary)
    } else {
        println!(
            "{}",
            report::summary_table(std::slice::from_ref(&result.summary))
        );
        println!("results: {}", job.out.display());
        Ok(())
    }
}

/// `record`: the recording alone.
///
/// # Errors
/// When the recording cannot be made or written.
pub fn record_only(args: &RecordArgs) -> Result<()> {
    let scenario = scenario::load(&args.scenario)?;
    let vehicle = load_vehicle(args.vehicle.as_ref().unwrap_or(&scenario.vehicle))?;
    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&scenario));
    create_folder(&out)?;
    let (dataset, summary) = record(&scenario, &vehicle, args.seed)?;
    let path = out.join("recording.csv");
    record::write(&path, &dataset)?;
    write_json(&out.join("recording.json"), &summary)?;
    if args.json {
        print_json(&summary)
    } else {
        println!(
            "{}: {} samples, max |LTR| {:.3}, at most {:.2} m off the path",
            path.display(),
            summary.samples,
            summary.ltr_abs_max,
            summary.path_deviation_max_m
        );
        Ok(())
    }
}

/// One run to be made.
struct Job<'a> {
    scenario: &'a Scenario,
    vehicle: &'a VehicleParameters,
    controller: &'a str,
    seed: u64,
    speed_reference_kmh: f64,
    data: Option<&'a Dataset>,
    out: PathBuf,
}

/// A run that was made.
struct RunResult {
    summary: Summary,
    rows: Vec<LogRow>,
    figures: Vec<Figure>,
}

impl Job<'_> {
    /// Runs, then writes summary and figures beside the log.
    fn run(&self, interrupt: &Interrupt, bar: &ProgressBar) -> Result<RunResult> {
        create_folder(&self.out)?;
        self.remove_old_results()?;
        let settings = self.scenario.controller(self.controller)?;
        let controller = match (settings, self.data) {
            (Some(settings), Some(data)) => {
                Some(closed_loop::controller(self.scenario, settings, data)?)
            }
            _ => None,
        };
        let run = Run {
            scenario: self.scenario,
            vehicle: self.vehicle,
            speed_reference_kmh: self.speed_reference_kmh,
            controller,
        };
        let log = self.out.join("log.csv");
        let finished = closed_loop::run(run, &log, interrupt, || bar.inc(1))?;
        let summary = Summary::of_log(
            RunIdentity {
                scenario: self.scenario.name.clone(),
                vehicle: self.vehicle.name.clone(),
                controller: self.controller.to_owned(),
                seed: self.seed,
            },
            finished.outcome,
            &finished.rows,
            settings.map(|s| &s.input_weights),
            self.scenario.sample_time_s,
        );
        write_json(&self.out.join("summary.json"), &summary)?;
        let mut result = RunResult {
            summary,
            rows: finished.rows,
            figures: Vec::new(),
        };
        result.figures = report::draw_all(&[result.trace()], &road_edges(self.scenario)?)?;
        write_figures(&self.out, &result.figures)?;
        Ok(result)
    }

    /// A summary of an earlier run beside a fresh log would be a lie if this run is interrupted.
    fn remove_old_results(&self) -> Result<()> {
        let old = self.out.join("summary.json");
        match std::fs::remove_file(&old) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                Err(e).with_context(|| format!("cannot replace {}", old.display()))
            }
            _ => Ok(()),
        }
    }
}

impl RunResult {
    fn trace(&self) -> RunTrace<'_> {
        RunTrace {
            name: &self.summary.controller,
            rows: &self.rows,
            ended_early: matches!(self.summary.outcome, Outcome::RolledOver | Outcome::SpunOut),
        }
    }

    fn into_page(self, scenario: &Scenario) -> PageRun {
        let settings = scenario.controllers.get(&self.summary.controller);
        PageRun {
            description: settings
                .map_or_else(|| "The driver alone.".into(), |s| s.description.clone()),
            folder: self.summary.controller.clone(),
            summary: self.summary,
            figures: self.figures,
        }
    }
}

/// Makes the runs, `workers` at a time, in the order given.
fn run_all(jobs: &[Job<'_>], workers: usize, interrupt: &Interrupt) -> Vec<Result<RunResult>> {
    let bars = MultiProgress::new();
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<Result<RunResult>>>> =
        jobs.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..workers.min(jobs.len()) {
            scope.spawn(|| {
                while let Some((job, result)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    jobs.get(index).zip(results.get(index))
                } {
                    let bar = bars.add(step_bar(job.scenario, job.controller));
                    let made = job
                        .run(interrupt, &bar)
                        .with_context(|| format!("run {}", job.controller));
                    bar.finish();
                    *result
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner) = Some(made);
                }
            });
        }
    });
    let made = results.into_iter().map(|r| {
        r.into_inner()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    });
    made.map(|r| r.unwrap_or_else(|| Err(anyhow!("the run was not made: its thread stopped"))))
        .collect()
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
}

fn step_bar(scenario: &Scenario, name: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:18} {bar:32} {percent:>3} %  {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(scenario.steps() as u64)
        .with_style(style)
        .with_prefix(name.to_owned())
}

/// Records, and keeps the recording beside the results made from it.
fn recording(
    scenario: &Scenario,
    vehicle: &VehicleParameters,
    seed: u64,
    out: &Path,
) -> Result<Dataset> {
    let (dataset, summary) = record(scenario, vehicle, seed)?;
    record::write(&out.join("recording.csv"), &dataset)?;
    write_json(&out.join("recording.json"), &summary)?;
    Ok(dataset)
}

fn load_vehicle(name_or_path: &str) -> Result<VehicleParameters> {
    Ok(vehicle_dyn::vehicles::find(name_or_path)?)
}

/// The two edges of the road, a point every metre.
fn road_edges(scenario: &Scenario) -> Result<Vec<Polyline>> {
    let course = Course::new(&scenario.course)?;
    let half = 0.5 * course.width_m();
    let mut edges = vec![Vec::new(), Vec::new()];
    let mut station = 0.0;
    while station <= course.total_length_m() {
        let p = course.point(station);
        let (sin, cos) = p.heading_rad.sin_cos();
        edges[0].push((p.x_m - half * sin, p.y_m + half * cos));
        edges[1].push((p.x_m + half * sin, p.y_m - half * cos));
        station += 1.0;
    }
    Ok(edges)
}

fn default_folder(scenario: &Scenario) -> PathBuf {
    Path::new("out").join(&scenario.name)
}

fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).with_context(|| {
        format!(
            "cannot create the output folder {}: choose another with --out",
            path.display()
        )
    })
}

fn write_figures(folder: &Path, figures: &[Figure]) -> Result<()> {
    figures
        .iter()
        .try_for_each(|f| write_whole(&folder.join(f.name).with_extension("svg"), &f.svg))
}

fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    write_whole(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

fn print_json<T: Serialize>(value: &T) -> Result<()> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}
