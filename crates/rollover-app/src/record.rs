//! Recording the data the controllers work from: the paper's recipe.

use std::path::Path;

use anyhow::{Context, Result};
use deepc_core::controller::Plant;
use deepc_core::data::{CsvLayout, Dataset, OutputTiming};
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::parameters::VehicleParameters;

use crate::closed_loop::{DrivenVehicle, INPUTS, OUTPUTS};
use crate::interrupt::Interrupt;
use crate::output::write_whole;
use crate::scenario::Scenario;
use crate::terrain;

/// Names of the input columns of a recording.
pub const INPUT_COLUMNS: [&str; 2] = ["steering_wheel_deg", "target_speed_kmh"];
/// Names of the output columns of a recording.
pub const OUTPUT_COLUMNS: [&str; 1] = ["ltr"];
/// Name of the time column of a recording.
pub const TIME_COLUMN: &str = "time_s";

/// What a recording came to.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingSummary {
    /// Name of the scenario.
    pub scenario: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Samples recorded.
    pub samples: usize,
    /// Largest |LTR|: above 1 wheels lifted, and data beyond lift-off mislead a linear predictor.
    pub ltr_abs_max: f64,
    /// Largest distance from the centre line, m.
    pub path_deviation_max_m: f64,
}

/// Drives the scenario's recording course with noise on both inputs.
///
/// # Errors
/// When the vehicle cannot be simulated or does not stay on its wheels and on the road.
pub fn record(
    scenario: &Scenario,
    vehicle: &VehicleParameters,
    seed: u64,
    interrupt: &Interrupt,
) -> Result<(Dataset, RecordingSummary)> {
    let recipe = &scenario.recording;
    let terrain = terrain::build(scenario.recording_ground(), &recipe.course, interrupt)?;
    let mut plant = DrivenVehicle::new(
        scenario,
        vehicle,
        &recipe.course,
        terrain,
        recipe.target_speed_kmh,
    )?;
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let steering_noise = normal(recipe.steering_wheel_noise_deg)?;
    let speed_noise = normal(recipe.target_speed_noise_kmh)?;
    let samples = scenario.recording_samples();
    let mut inputs: Vec<[f64; INPUTS]> = Vec::with_capacity(samples);
    let mut outputs: Vec<[f64; OUTPUTS]> = Vec::with_capacity(samples);
    let mut deviation_m = 0.0_f64;
    for _ in 0..samples {
        interrupt.check("while recording", "no recording was written")?;
        let input = [
            plant.driver_steering_deg() + steering_noise.sample(&mut noise),
            recipe.target_speed_kmh + speed_noise.sample(&mut noise),
        ];
        let mut output = [0.0];
        plant.step(&input, &mut output)?;
        inputs.push(input);
        outputs.push(output);
        deviation_m = deviation_m.max(plant.location().lateral_offset_m.abs());
        anyhow::ensure!(
            plant.outcome() == Outcome::Completed,
            "the vehicle did not survive the recording: {} at {:.2} s with seed {seed}; record at a lower target speed or on wider turns",
            plant.outcome(),
            plant.observation().time_s,
        );
    }
    let summary = RecordingSummary {
        scenario: scenario.name.clone(),
        vehicle: vehicle.name.clone(),
        seed,
        samples,
        ltr_abs_max: outputs
            .iter()
            .flatten()
            .fold(0.0, |max: f64, y| max.max(y.abs())),
        path_deviation_max_m: deviation_m,
    };
    let mut dataset = Dataset::new(scenario.sample_time_s, INPUT_COLUMNS, OUTPUT_COLUMNS)?;
    dataset.push_record(
        Mat::from_fn(samples, INPUTS, |k, i| inputs[k][i]),
        Mat::from_fn(samples, OUTPUTS, |k, i| outputs[k][i]),
    )?;
    Ok((dataset, summary))
}

fn normal(standard_deviation: f64) -> Result<Normal<f64>> {
    Normal::new(0.0, standard_deviation).context("the recording's noise has no finite deviation")
}

/// Writes a recording as CSV.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, dataset: &Dataset) -> Result<()> {
    let mut text = Vec::new();
    dataset.write_csv_to(1, &mut text, &path.display().to_string(), TIME_COLUMN)?;
    write_whole(
        path,
        &String::from_utf8(text).context("channel names are UTF-8")?,
    )
}

/// Reads a recording with the scenario's sample time.
///
/// # Errors
/// When the file is missing, malformed, or lacks a column; the message names the place.
pub fn read(path: &Path, scenario: &Scenario) -> Result<Dataset> {
    let layout = CsvLayout {
        time: Some(TIME_COLUMN.to_owned()),
        inputs: INPUT_COLUMNS.map(str::to_owned).to_vec(),
        disturbances: Vec::new(),
        outputs: OUTPUT_COLUMNS.map(str::to_owned).to_vec(),
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: scenario.sample_time_s,
    };
    Dataset::read_csv(&layout, &[path]).context("the recording cannot be used")
}
