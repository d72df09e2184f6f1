//! The command line.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

use crate::output::print_text;

/// Keeps a vehicle from rolling over by data-enabled predictive control.
#[derive(Debug, Parser)]
#[command(
    name = "rollover-app",
    version,
    about,
    max_term_width = 100,
    after_help = HELP
)]
pub struct Cli {
    /// Print only errors and what is asked for: JSON, lists, files shown.
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The end of the help.
const HELP: &str = "\
Examples:
  rollover-app paper
  rollover-app run sedan-s1 --controller rd-deepc-1
  rollover-app scenarios show sedan-s1 > mine.toml
  rollover-app scenarios check mine.toml

Exit status:
  0    done; a vehicle that rolls over is a result, not a failure
  1    failed; the message says where and what to do
  2    the command line is wrong
  130  stopped by Ctrl-C or SIGTERM; the message says what was kept

NO_COLOR=1 or CLICOLOR=0 turns colours off.";

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job: every experiment of the paper, its claims judged, a report.
    #[command(after_help = "\
Examples:
  rollover-app paper
  rollover-app paper --quick
  rollover-app paper --only sedan-s1 --seeds 0-9 --out out/tuning

Interrupted, or run again, it makes only the runs that are not there yet.")]
    Paper(PaperArgs),
    /// One scenario with one controller: log, summary and report.
    #[command(after_help = "\
Examples:
  rollover-app run sedan-s1
  rollover-app run sedan-s1 --controller rd-deepc-1 --seed 3 --out out/mine
  rollover-app run mine.toml --controller driver --speed 100 --json")]
    Run(RunArgs),
    /// Records the data a controller works from, by the paper's recipe.
    #[command(after_help = "\
Examples:
  rollover-app record sedan-s1 --seed 3
  rollover-app run sedan-s1 --controller lmpc --recording out/sedan-s1/recording.csv")]
    Record(RecordArgs),
    /// Identifies a linear model from recordings: model file, report, figures.
    #[command(after_help = "\
Examples:
  rollover-app identify out/sedan-s1/recording.csv
  rollover-app identify pump-1.csv pump-2.csv --inputs pump,valve --outputs level --validate pump-3.csv")]
    Identify(IdentifyArgs),
    /// A standard manoeuvre with a vehicle: figures of merit, logs, pictures.
    #[command(after_help = format!("\
Examples:
  rollover-app manoeuvre fishhook-1b
  rollover-app manoeuvre sine-with-dwell --vehicle my-car.toml --out out/sine

{}", crate::manoeuvre::help()))]
    Manoeuvre(ManoeuvreArgs),
    /// The ground of a scenario: a file to run on and to look into, and a picture.
    #[command(after_help = "\
Examples:
  rollover-app terrain mine.toml --out out/ground
  rollover-app run mine.toml --terrain out/ground/terrain.npz")]
    Terrain(TerrainArgs),
    /// Lists the built-in scenarios and manoeuvres; checks and shows their files.
    #[command(after_help = "\
Examples:
  rollover-app scenarios
  rollover-app scenarios show sedan-s1 > mine.toml
  rollover-app scenarios check mine.toml")]
    Scenarios(ScenariosArgs),
    /// Lists the built-in vehicles; checks and shows vehicle files.
    #[command(after_help = "\
Examples:
  rollover-app vehicles
  rollover-app vehicles show sedan > my-car.toml
  rollover-app vehicles check my-car.toml")]
    Vehicles(VehiclesArgs),
    /// Prints a script by which a shell completes commands and options.
    #[command(after_help = "\
Examples:
  rollover-app completions bash > ~/.local/share/bash-completion/completions/rollover-app
  rollover-app completions zsh > ~/.zfunc/_rollover-app
  rollover-app completions fish > ~/.config/fish/completions/rollover-app.fish")]
    Completions(CompletionsArgs),
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
    /// A first look: one recording seed, no mirror image, and the slowest program is not timed.
    #[arg(long)]
    pub quick: bool,
    /// Recording seeds; the logs of the first are kept. [default: 10-19, which no setting was chosen on]
    #[arg(long, value_name = "FIRST-LAST", value_parser = seeds)]
    pub seeds: Option<Seeds>,
    /// Scenarios; by default all of the paper.
    #[arg(long, value_name = "SCENARIO,…", value_delimiter = ',', value_parser = paper_scenario)]
    pub only: Vec<String>,
    /// Controllers; by default all of every scenario.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub controllers: Vec<String>,
    /// Folder for the results.
    #[arg(long, default_value = "out/paper", value_name = "DIR")]
    pub out: PathBuf,
    /// Threads; by default one per core. The results do not depend on it.
    #[arg(long, value_name = "N")]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Print the results as JSON, as in paper.json, on standard output instead of the tables.
    #[arg(long)]
    pub json: bool,
}

/// Recording seeds from first to last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds(pub std::ops::RangeInclusive<u64>);

impl std::fmt::Display for Seeds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.0.start(), self.0.end())
    }
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
    /// Recording to work from, instead of making one from the seed: a file for each record, separated
    /// by commas or each with its own --recording.
    #[arg(long, value_delimiter = ',', value_name = "FILE,…")]
    pub recording: Vec<PathBuf>,
    /// Terrain file that `terrain` wrote, or map of measured heights (`.npz`, `.csv`), instead of the
    /// scenario's ground.
    #[arg(long, value_name = "FILE")]
    pub terrain: Option<PathBuf>,
    /// Speed at the start and reference afterwards, instead of the scenario's.
    #[arg(long, value_name = "KMH", value_parser = speed_kmh, allow_negative_numbers = true)]
    pub speed: Option<f64>,
    /// Drive the mirror image: the course and its ground with left and right exchanged. The recording
    /// stays as it is.
    #[arg(long)]
    pub mirror: bool,
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
    /// Folder for `recording.csv`, and `recording-2.csv` and so on where there are more records; by default `out/SCENARIO`.
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
    /// What is taken from the channels, so that the model is one of deviations.
    #[arg(long, value_enum, default_value = "found", value_name = "HOW")]
    pub offsets: Offsets,
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

/// What is taken from the channels before a model is made of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Offsets {
    /// Means, and a constant per output that is estimated with the model.
    Found,
    /// Means, nothing else.
    Means,
    /// Nothing: the model goes through the origin.
    None,
}

impl From<Offsets> for sysid::OffsetChoice {
    fn from(offsets: Offsets) -> Self {
        match offsets {
            Offsets::Found => Self::Found,
            Offsets::Means => Self::Means,
            Offsets::None => Self::None,
        }
    }
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

/// Arguments of `scenarios`.
#[derive(Debug, Args)]
pub struct ScenariosArgs {
    /// What to do instead of listing.
    #[command(subcommand)]
    pub action: Option<ScenariosAction>,
    /// Print the list or what the check found as JSON on standard output.
    #[arg(long, global = true)]
    pub json: bool,
}

/// What to do with scenarios and manoeuvres.
#[derive(Debug, Subcommand)]
pub enum ScenariosAction {
    /// Prints the file of a built-in scenario or manoeuvre, to start one of your own from.
    Show {
        /// Name of a built-in scenario or manoeuvre.
        name: String,
    },
    /// Checks a scenario or manoeuvre file without driving anything.
    Check {
        /// Path of a file, or name of a built-in scenario or manoeuvre.
        #[arg(value_name = "FILE")]
        file: String,
    },
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

/// Prints the completion script of a shell.
///
/// # Errors
/// When standard output cannot be written.
pub fn completions(args: &CompletionsArgs) -> Result<()> {
    let mut command = Cli::command();
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    print_text(&String::from_utf8(script)?)
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

fn friction(text: &str) -> std::result::Result<f64, String> {
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

fn seeds(text: &str) -> std::result::Result<Seeds, String> {
    const MOST: u64 = 1000;
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |text: &str| {
        let number = text.trim().parse::<u64>();
        number.map_err(|_| format!("`{text}` is not a seed; write 10-19, or 10"))
    };
    let (first, last) = (number(first)?, number(last)?);
    match last.checked_sub(first) {
        None => Err(format!("{last} comes before {first}")),
        Some(more) if more >= MOST => Err(format!(
            "these are {} seeds, at most {MOST} are allowed",
            more + 1
        )),
        Some(_) => Ok(Seeds(first..=last)),
    }
}

fn paper_scenario(text: &str) -> std::result::Result<String, String> {
    let known = crate::report::claims::SCENARIOS;
    if known.contains(&text) {
        return Ok(text.to_owned());
    }
    let suggestion = crate::toml_place::suggested(text, known);
    Err(format!(
        "no scenario of the paper{suggestion}: choose from {}",
        known.join(", ")
    ))
}

fn speed_kmh(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if (10.0..=250.0).contains(&speed) => Ok(speed),
        Ok(speed) => Err(format!("{speed} km/h is not in [10, 250]")),
        Err(_) => Err("not a number of km/h".into()),
    }
}
