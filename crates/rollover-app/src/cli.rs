//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Keeps a vehicle from rolling over by data-enabled predictive control.
#[derive(Debug, Parser)]
#[command(name = "rollover-app", version, about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job: the paper's sedan scenario with each controller, a table and a report.
    Paper(PaperArgs),
    /// One scenario with one controller: log, summary and report.
    Run(RunArgs),
    /// The ground of a scenario: a file to run on and to look into, and a picture.
    Terrain(TerrainArgs),
    /// Records the data a controller works from, by the paper's recipe.
    Record(RecordArgs),
    /// Identifies a linear model from recordings: model file, report, figures.
    Identify(IdentifyArgs),
    /// A standard manoeuvre with a vehicle: figures of merit, logs, pictures.
    #[command(after_help = crate::manoeuvre::help())]
    Manoeuvre(ManoeuvreArgs),
    /// Lists the built-in vehicles; checks and shows vehicle files.
    Vehicles(VehiclesArgs),
    /// Makes the interactive report from logs alone, also logs of a real vehicle.
    Report(ReportArgs),
}

/// Arguments of `report`.
#[derive(Debug, Args)]
#[command(
    after_help = "What cannot be read is named on standard error and in the page; the rest is shown. The exit status is 0 if any log was shown, 1 if none was or the page cannot be written, 2 for a wrong command line."
)]
pub struct ReportArgs {
    /// Folders, searched for `log.csv` at any depth, or CSV files.
    #[arg(required = true, value_name = "DIR|LOG.csv")]
    pub paths: Vec<PathBuf>,
    /// The page; by default `report.html` in the first folder, or here. Figures and tables go into
    /// folders beside it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Name of a column in the files that differs from ours, for example `speed_kmh=VehSpd`.
    #[arg(long, value_name = "OURS=THEIRS", value_parser = column_name)]
    pub column: Vec<(String, String)>,
    /// Heading of the page.
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Print the runs' numbers and the problems as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `paper`.
#[derive(Debug, Args)]
pub struct PaperArgs {
    /// Seed of the recording the controllers share.
    #[arg(long, default_value_t = 10)]
    pub seed: u64,
    /// Folder for the results.
    #[arg(long, default_value = "out/paper", value_name = "DIR")]
    pub out: PathBuf,
    /// Runs at once; by default one per core.
    #[arg(long, value_name = "N")]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Print the summaries as JSON on standard output instead of the table.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Name of a scenario, or path of a scenario file.
    pub scenario: String,
    /// Name of one of the scenario's controllers.
    #[arg(long, default_value = crate::scenario::DRIVER, value_name = "NAME")]
    pub controller: String,
    /// Seed of the recording the controller works from.
    #[arg(long, default_value_t = 10)]
    pub seed: u64,
    /// Folder for the results; by default `out/SCENARIO/CONTROLLER`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Vehicle file or name, instead of the scenario's.
    #[arg(long, value_name = "VEHICLE")]
    pub vehicle: Option<String>,
    /// Recording to work from, instead of making one from the seed.
    #[arg(long, value_name = "FILE")]
    pub recording: Option<PathBuf>,
    /// Terrain file that `terrain` wrote, or map of measured heights (`.npz`, `.csv`), instead of the
    /// scenario's ground.
    #[arg(long, value_name = "FILE")]
    pub terrain: Option<PathBuf>,
    /// Speed at the start and reference afterwards, instead of the scenario's.
    #[arg(long, value_name = "KMH", value_parser = speed_kmh, allow_negative_numbers = true)]
    pub speed: Option<f64>,
    /// Print the summary as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `terrain`.
#[derive(Debug, Args)]
pub struct TerrainArgs {
    /// Name of a scenario, or path of a scenario file.
    pub scenario: String,
    /// Folder for `terrain.npz`, `terrain.svg` and `terrain.json`; by default `out/SCENARIO`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// The ground of the recording's course instead of that of the runs.
    #[arg(long)]
    pub recording: bool,
    /// The mirror image: the course and its ground with left and right exchanged.
    #[arg(long)]
    pub mirror: bool,
    /// Print the terrain's summary as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `record`.
#[derive(Debug, Args)]
pub struct RecordArgs {
    /// Name of a scenario, or path of a scenario file.
    pub scenario: String,
    /// Seed of the noise on the inputs.
    #[arg(long, default_value_t = 10)]
    pub seed: u64,
    /// Folder for `recording.csv`; by default `out/SCENARIO`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Vehicle file or name, instead of the scenario's.
    #[arg(long, value_name = "VEHICLE")]
    pub vehicle: Option<String>,
    /// Print the recording's summary as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `identify`.
#[derive(Debug, Args)]
pub struct IdentifyArgs {
    /// CSV files with a header line, one uninterrupted record each.
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Columns that are inputs; by default those that `record` writes.
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…")]
    pub inputs: Vec<String>,
    /// Columns that are outputs; by default those that `record` writes.
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…")]
    pub outputs: Vec<String>,
    /// Columns of measured disturbances: they act on the plant, but no controller decides them.
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…")]
    pub disturbances: Vec<String>,
    /// Column of time stamps in seconds; by default `time_s`, if there is one.
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// Sample time; by default the interval between the first two time stamps.
    #[arg(long, value_name = "S")]
    pub sample_time: Option<f64>,
    /// The outputs of a row were measured when its inputs began to act, not at the end of their
    /// interval.
    #[arg(long)]
    pub outputs_at_start: bool,
    /// Model order; by default the best on held-out samples.
    #[arg(long, value_name = "N")]
    pub order: Option<usize>,
    /// Largest order tried where it is not given.
    #[arg(long, value_name = "N", default_value_t = 10, conflicts_with = "order")]
    pub max_order: usize,
    /// Inputs whose effect is held at zero, because the data do not identify it.
    #[arg(long, value_delimiter = ',', value_name = "COLUMN,…")]
    pub without_effect: Vec<String>,
    /// Recordings that judge the model; by default it is judged on those it was made from.
    #[arg(long, value_delimiter = ',', value_name = "RECORDING,…")]
    pub validate: Vec<PathBuf>,
    /// Steps ahead of the farthest prediction that is judged.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub steps: usize,
    /// Folder for the results.
    #[arg(long, default_value = "out/identify", value_name = "DIR")]
    pub out: PathBuf,
    /// Print the report as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `manoeuvre`.
#[derive(Debug, Args)]
pub struct ManoeuvreArgs {
    /// Name of a manoeuvre, or path of a manoeuvre file.
    pub manoeuvre: String,
    /// Vehicle file or name.
    #[arg(long, default_value = "sedan", value_name = "VEHICLE")]
    pub vehicle: String,
    /// Folder for the results; by default `out/MANOEUVRE/VEHICLE`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the report as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `vehicles`.
#[derive(Debug, Args)]
pub struct VehiclesArgs {
    /// What to do instead of listing.
    #[command(subcommand)]
    pub action: Option<VehiclesAction>,
    /// Print the list or the figures as JSON on standard output.
    #[arg(long, global = true)]
    pub json: bool,
    /// Friction of the road for the figures that depend on it.
    #[arg(long, global = true, value_name = "MU", default_value_t = 0.85, value_parser = friction)]
    pub friction: f64,
}

/// What to do with vehicles.
#[derive(Debug, Subcommand)]
pub enum VehiclesAction {
    /// Checks a vehicle file and prints the figures that follow from it, so that a wrong unit shows.
    Check {
        /// Path of a vehicle file, or name of a built-in vehicle.
        vehicle: String,
    },
    /// Prints the file of a built-in vehicle, to start one of your own from.
    Show {
        /// Name of a built-in vehicle.
        name: String,
    },
    /// Prints the JSON schema of vehicle files, for editors.
    Schema,
}

fn friction(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(friction) if (0.01..=1.5).contains(&friction) => Ok(friction),
        Ok(friction) => Err(format!("{friction} is not in [0.01, 1.5]")),
        Err(_) => Err("not a number".into()),
    }
}

fn column_name(text: &str) -> Result<(String, String), String> {
    let (ours, theirs) = text
        .split_once('=')
        .ok_or("write OURS=THEIRS, for example speed_kmh=VehSpd")?;
    let known = crate::report::log::COLUMN_NAMES;
    if known.contains(&ours) {
        return Ok((ours.into(), theirs.into()));
    }
    Err(format!(
        "a log has no column `{ours}`, but {}",
        known.join(", ")
    ))
}

fn speed_kmh(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if (10.0..=250.0).contains(&speed) => Ok(speed),
        Ok(speed) => Err(format!("{speed} km/h is not in [10, 250]")),
        Err(_) => Err("not a number of km/h".into()),
    }
}
