//! Recording the data the controllers work from: the paper's recipe.

use std::borrow::Cow;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use deepc_core::controller::Plant;
use deepc_core::data::{CsvLayout, Dataset, OutputTiming};
use faer::Mat;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::sensors::derived_seed;
use vehicle_dyn::simulation::ReadyVehicle;

use crate::closed_loop::{DrivenVehicle, INPUTS, OUTPUTS};
use crate::interrupt::Interrupt;
use crate::output::write_whole;
use crate::progress;
use crate::scenario::{RecordRecipe, Scenario};
use crate::terrain;

/// Names of the input columns of a recording.
pub const INPUT_COLUMNS: [&str; 2] = ["steering_wheel_deg", "target_speed_kmh"];
/// Names of the output columns of a recording.
pub const OUTPUT_COLUMNS: [&str; 1] = ["ltr"];
/// Name of the time column of a recording.
pub const TIME_COLUMN: &str = "time_s";

/// What a recording came to, over all its records.
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
    /// The records one by one, where there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub records: Vec<RecordSummary>,
}

/// What one record came to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RecordSummary {
    /// Seed of its noise.
    pub seed: u64,
    /// Samples recorded.
    pub samples: usize,
    /// Samples of the LTR that the sensor lost.
    pub ltr_filled_samples: usize,
    /// Largest true |LTR|.
    pub ltr_abs_max: f64,
    /// Largest distance from the centre line, m.
    pub path_deviation_max_m: f64,
}

/// Drives the scenario's recording courses with noise on both inputs: one record each.
///
/// # Errors
/// When the vehicle cannot be simulated or does not stay on its wheels and on the road.
pub fn record(
    scenario: &Scenario,
    vehicle: &ReadyVehicle,
    seed: u64,
    interrupt: &Interrupt,
) -> Result<(Dataset, RecordingSummary)> {
    let mut dataset = Dataset::new(scenario.sample_time_s, INPUT_COLUMNS, OUTPUT_COLUMNS)?;
    let mut records = Vec::new();
    for (index, recipe) in scenario.records().iter().enumerate() {
        let order = (recipe, index + 1, record_seed(seed, index + 1));
        let (inputs, outputs, summary) = drive(scenario, vehicle, order, interrupt)?;
        dataset.push_record(inputs, outputs)?;
        records.push(summary);
    }
    let largest = |of: fn(&RecordSummary) -> f64| records.iter().map(of).fold(0.0, f64::max);
    let summary = RecordingSummary {
        scenario: scenario.name.clone(),
        vehicle: vehicle.parameters().name.clone(),
        seed,
        samples: dataset.samples(),
        ltr_filled_samples: records.iter().map(|r| r.ltr_filled_samples).sum(),
        ltr_abs_max: largest(|r| r.ltr_abs_max),
        path_deviation_max_m: largest(|r| r.path_deviation_max_m),
        records: if records.len() > 1 {
            records
        } else {
            Vec::new()
        },
    };
    Ok((dataset, summary))
}

/// Seed of a record, counted from 1: that of the recording for the first, one derived from it for
/// the others.
#[must_use]
pub fn record_seed(seed: u64, number: usize) -> u64 {
    if number == 1 {
        seed
    } else {
        derived_seed(seed, &format!("record {number}"))
    }
}

/// Drives the record of a recipe, number (from 1) and seed: inputs, outputs and what it came to.
fn drive(
    scenario: &Scenario,
    vehicle: &ReadyVehicle,
    (recipe, number, seed): (&RecordRecipe<'_>, usize, u64),
    interrupt: &Interrupt,
) -> Result<(Mat<f64>, Mat<f64>, RecordSummary)> {
    let terrain = terrain::build(recipe.ground, recipe.course, interrupt)?;
    let mut plant = DrivenVehicle::new(
        scenario,
        vehicle,
        recipe.course,
        terrain,
        recipe.target_speed_kmh,
        (seed, "recording"),
    )?;
    let mut noise = ChaCha8Rng::seed_from_u64(seed);
    let steering_noise = normal(recipe.steering_wheel_noise_deg)?;
    let speed_noise = normal(recipe.target_speed_noise_kmh)?;
    let samples = recipe.samples(scenario.sample_time_s);
    let mut inputs: Vec<[f64; INPUTS]> = Vec::with_capacity(samples);
    let mut measured: Vec<f64> = Vec::with_capacity(samples);
    let mut ltr_abs_max = 0.0_f64;
    let mut deviation_m = 0.0_f64;
    let what = match number {
        1 => "the recording".to_owned(),
        _ => format!("record {number} of the recording"),
    };
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
            "the vehicle did not survive {what}: {} at {:.2} s with seed {seed}; record at a lower target speed or on wider turns",
            plant.outcome(),
            plant.observation().time_s,
        );
        bar.inc(1);
    }
    bar.finish_and_clear();
    let summary = RecordSummary {
        seed,
        samples,
        ltr_filled_samples: fill_gaps(&mut measured).with_context(|| {
            format!("the LTR sensor lost every sample of {what}: lower its drop-outs")
        })?,
        ltr_abs_max,
        path_deviation_max_m: deviation_m,
    };
    Ok((
        Mat::from_fn(samples, INPUTS, |k, i| inputs[k][i]),
        Mat::from_fn(samples, OUTPUTS, |k, _| measured[k]),
        summary,
    ))
}

/// The first `count` records of a recording, or all of them.
///
/// # Errors
/// When it has fewer.
pub fn first_records(dataset: &Dataset, count: Option<usize>) -> Result<Cow<'_, Dataset>> {
    let found = dataset.records().len();
    let count = count.unwrap_or(found);
    anyhow::ensure!(
        (1..=found).contains(&count),
        "the controller works from {count} records (its `records`), but the recording has {found}"
    );
    if count == found {
        return Ok(Cow::Borrowed(dataset));
    }
    let mut first = Dataset::new(dataset.sample_time_s(), INPUT_COLUMNS, OUTPUT_COLUMNS)?;
    for record in &dataset.records()[..count] {
        first.push_record(record.inputs().to_owned(), record.outputs().to_owned())?;
    }
    Ok(Cow::Owned(first))
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

/// Writes a recording as CSV: the first record to `path`, `recording.csv` for example, the others
/// beside it, to `recording-2.csv` and so on. Those that an earlier, longer recording left there are
/// removed. Returns the files.
///
/// # Errors
/// When a file cannot be written or removed.
pub fn write(path: &Path, dataset: &Dataset) -> Result<Vec<PathBuf>> {
    let records = dataset.records().len();
    let files: Vec<PathBuf> = (1..=records).map(|n| numbered(path, n)).collect();
    for (index, file) in files.iter().enumerate() {
        let mut text = Vec::new();
        let name = file.display().to_string();
        dataset.write_csv_to(index + 1, &mut text, &name, TIME_COLUMN)?;
        write_whole(
            file,
            &String::from_utf8(text).context("channel names are UTF-8")?,
        )?;
    }
    for number in records + 1.. {
        let old = numbered(path, number);
        match std::fs::remove_file(&old) {
            Ok(()) => {}
            Err(e) if e.kind() == ErrorKind::NotFound => break,
            Err(e) => return Err(e).with_context(|| format!("cannot remove {}", old.display())),
        }
    }
    Ok(files)
}

/// File of a record, counted from 1.
fn numbered(path: &Path, number: usize) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}-{number}.csv"))
}

/// Reads a recording with the scenario's sample time, one record per file.
///
/// # Errors
/// When a file is missing, malformed, or lacks a column; the message names the place.
pub fn read(files: &[PathBuf], scenario: &Scenario) -> Result<Dataset> {
    let layout = CsvLayout {
        time: Some(TIME_COLUMN.to_owned()),
        inputs: INPUT_COLUMNS.map(str::to_owned).to_vec(),
        disturbances: Vec::new(),
        outputs: OUTPUT_COLUMNS.map(str::to_owned).to_vec(),
        outputs_measured: OutputTiming::EndOfInterval,
        sample_time_s: scenario.sample_time_s,
    };
    Dataset::read_csv(&layout, files).context("the recording cannot be used")
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
