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
use crate::progress;
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
    /// Samples of the LTR that the sensor lost; lines between their neighbours stand for them.
    pub ltr_filled_samples: usize,
    /// Largest true |LTR|: above 1 wheels lifted, and data beyond lift-off mislead a linear predictor.
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
        (seed, "recording"),
    )?;
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let steering_noise = normal(recipe.steering_wheel_noise_deg)?;
    let speed_noise = normal(recipe.target_speed_noise_kmh)?;
    let samples = scenario.recording_samples();
    let mut inputs: Vec<[f64; INPUTS]> = Vec::with_capacity(samples);
    let mut measured: Vec<f64> = Vec::with_capacity(samples);
    let mut ltr_abs_max = 0.0_f64;
    let mut deviation_m = 0.0_f64;
    let bar = progress::bar(samples, "recording");
    for _ in 0..samples {
        interrupt.check("while recording", "no recording was written")?;
        let input = [
            plant.driver_steering_deg() + steering_noise.sample(&mut noise),
            recipe.target_speed_kmh + speed_noise.sample(&mut noise),
        ];
        let mut output = [0.0];
        plant.step(&input, &mut output)?;
        inputs.push(input);
        measured.push(plant.measured_ltr());
        ltr_abs_max = ltr_abs_max.max(output[0].abs());
        deviation_m = deviation_m.max(plant.location().lateral_offset_m.abs());
        anyhow::ensure!(
            plant.outcome() == Outcome::Completed,
            "the vehicle did not survive the recording: {} at {:.2} s with seed {seed}; record at a lower target speed or on wider turns",
            plant.outcome(),
            plant.observation().time_s,
        );
        bar.inc(1);
    }
    bar.finish_and_clear();
    let summary = RecordingSummary {
        scenario: scenario.name.clone(),
        vehicle: vehicle.name.clone(),
        seed,
        samples,
        ltr_filled_samples: fill_gaps(&mut measured)
            .context("the LTR sensor lost every sample of the recording: lower its drop-outs")?,
        ltr_abs_max,
        path_deviation_max_m: deviation_m,
    };
    let mut dataset = Dataset::new(scenario.sample_time_s, INPUT_COLUMNS, OUTPUT_COLUMNS)?;
    dataset.push_record(
        Mat::from_fn(samples, INPUTS, |k, i| inputs[k][i]),
        Mat::from_fn(samples, OUTPUTS, |k, _| measured[k]),
    )?;
    Ok((dataset, summary))
}

/// Fills what is not finite by straight lines between the values around it, and before the first
/// and after the last by these. Returns how many were filled, or `None` if there is no value at all.
fn fill_gaps(values: &mut [f64]) -> Option<usize> {
    let known: Vec<usize> = (0..values.len())
        .filter(|&k| values[k].is_finite())
        .collect();
    let (&first, &last) = (known.first()?, known.last()?);
    let (at_first, at_last) = (values[first], values[last]);
    values[..first].fill(at_first);
    values[last + 1..].fill(at_last);
    for pair in known.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let (start, rise) = (values[from], values[to] - values[from]);
        let steps = (to - from) as f64;
        for (step, value) in values[from..to].iter_mut().enumerate().skip(1) {
            *value = start + rise * step as f64 / steps;
        }
    }
    Some(values.len() - known.len())
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

#[cfg(test)]
mod tests {
    use super::fill_gaps;

    #[test]
    fn gaps_are_filled_by_lines() {
        let nan = f64::NAN;
        let mut values = [nan, 1.0, nan, nan, 4.0, 3.0, nan];
        assert_eq!(fill_gaps(&mut values), Some(4));
        for (found, expected) in values.iter().zip([1.0, 1.0, 2.0, 3.0, 4.0, 3.0, 3.0]) {
            assert!((found - expected).abs() < 1e-12, "{values:?}");
        }
        assert_eq!(fill_gaps(&mut [nan, nan]), None);
        let mut whole = [0.1, -0.0, 0.3];
        assert_eq!(fill_gaps(&mut whole), Some(0));
        assert_eq!(whole.map(f64::to_bits), [0.1, -0.0, 0.3].map(f64::to_bits));
    }
}
