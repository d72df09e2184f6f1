//! Which columns of which files are the recording.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use deepc_core::data::{CsvLayout, Dataset, OutputTiming};

use crate::cli::IdentifyArgs;
use crate::record::{INPUT_COLUMNS, OUTPUT_COLUMNS, TIME_COLUMN};

/// Layout of the recordings: as the arguments say, else as `record` writes them.
///
/// # Errors
/// The columns or the sample time are neither given nor found in the first file.
pub(super) fn layout(args: &IdentifyArgs) -> Result<CsvLayout> {
    let first = args.recordings.first().context("no recording was given")?;
    let header = header(first)?;
    let has = |name: &str| header.iter().any(|column| column == name);
    let columns = |given: &[String], recorded: &[&str], option: &str| -> Result<Vec<String>> {
        if !given.is_empty() {
            return Ok(given.to_vec());
        }
        ensure!(
            recorded.iter().all(|name| has(name)),
            "which columns of {} are the {option}? Name them with --{option}; it has {}",
            first.display(),
            header.join(", ")
        );
        Ok(recorded.iter().map(|&name| name.to_owned()).collect())
    };
    let time = match &args.time {
        Some(name) => Some(name.clone()),
        None => has(TIME_COLUMN).then(|| TIME_COLUMN.to_owned()),
    };
    let sample_time_s = match (args.sample_time, &time) {
        (Some(given), _) => given,
        (None, Some(column)) => interval(first, &header, column)?,
        (None, None) => bail!(
            "the sample time of {} is not known: give --sample-time in seconds, or name the column of \
             time stamps with --time",
            first.display()
        ),
    };
    Ok(CsvLayout {
        time,
        inputs: columns(&args.inputs, &INPUT_COLUMNS, "inputs")?,
        disturbances: args.disturbances.clone(),
        outputs: columns(&args.outputs, &OUTPUT_COLUMNS, "outputs")?,
        outputs_measured: if args.outputs_at_start {
            OutputTiming::StartOfInterval
        } else {
            OutputTiming::EndOfInterval
        },
        sample_time_s,
    })
}

/// Reads one record per file.
///
/// # Errors
/// A file is missing or malformed; the message names the place.
pub(super) fn read(layout: &CsvLayout, files: &[PathBuf], what: &str) -> Result<Dataset> {
    Dataset::read_csv(layout, files).with_context(|| format!("{what} cannot be used"))
}

fn reader(path: &Path) -> Result<csv::Reader<std::fs::File>> {
    csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .with_context(|| format!("cannot open {}", path.display()))
}

fn header(path: &Path) -> Result<Vec<String>> {
    let mut reader = reader(path)?;
    let header = reader
        .headers()
        .with_context(|| format!("cannot read {}", path.display()))?;
    Ok(header.iter().map(str::to_owned).collect())
}

/// Seconds between two stamps; whether all of them keep to it is checked on reading.
fn interval(path: &Path, header: &[String], column: &str) -> Result<f64> {
    let Some(index) = header.iter().position(|name| name == column) else {
        bail!(
            "{} has no column `{column}`; it has {}",
            path.display(),
            header.join(", ")
        );
    };
    let mut stamps = Vec::new();
    for row in reader(path)?.records() {
        let row = row.with_context(|| format!("cannot read {}", path.display()))?;
        let text = row.get(index).unwrap_or_default();
        let line = row.position().map_or(0, csv::Position::line);
        let stamp: f64 = text.parse().with_context(|| {
            format!(
                "{}, line {line}, column `{column}`: `{text}` is not a number",
                path.display()
            )
        })?;
        stamps.push(stamp);
    }
    let [start, next, ..] = stamps[..] else {
        bail!(
            "{} has {} sample(s); a model needs hundreds",
            path.display(),
            stamps.len()
        );
    };
    ensure!(
        next > start && (next - start).is_finite(),
        "{}, column `{column}`: the first two time stamps are {start} and {next}; they must grow",
        path.display()
    );
    Ok(common_interval(&stamps, next - start))
}

/// Relative difference of intervals that are the same but for the digits of the stamps.
const SAME_INTERVAL: f64 = 1e-3;

/// The interval that all stamps keep to as nearly as they are printed, else the first one.
fn common_interval(stamps: &[f64], first: f64) -> f64 {
    let (start, end) = (stamps[0], stamps[stamps.len() - 1]);
    let intervals = (stamps.len() - 1) as f64;
    let mean = (end - start) / intervals;
    if (mean - first).abs() > SAME_INTERVAL * first {
        return first;
    }
    // Rounding of the stamps must not make 0.009999999999999787 of 0.01.
    let scale = 10_f64.powf(6.0 - mean.log10().floor());
    let short = (mean * scale).round() / scale;
    let doubt = (1e-6 * mean + 4.0 * f64::EPSILON * end.abs()) / intervals;
    if (short - mean).abs() <= doubt {
        short
    } else {
        mean
    }
}

#[cfg(test)]
mod tests {
    use super::common_interval;

    fn stamps(count: u32, stamp: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..count).map(|k| stamp(f64::from(k))).collect()
    }

    fn found(stamps: &[f64]) -> f64 {
        common_interval(stamps, stamps[1] - stamps[0])
    }

    #[test]
    fn short_decimals_come_out_as_they_were_meant() {
        for sample_time_s in [0.01, 0.02, 1.0, 0.000_025, 3600.0] {
            for start in [0.0, 1234.5] {
                let stamps = stamps(1000, |k| start + k * sample_time_s);
                assert!(
                    (found(&stamps) - sample_time_s).abs() <= f64::EPSILON * sample_time_s,
                    "{sample_time_s} from {start}: {}",
                    found(&stamps)
                );
            }
        }
    }

    #[test]
    fn a_long_recording_refines_what_two_stamps_say() {
        let third = stamps(30_001, |k| (k / 3.0 * 1e4).round() / 1e4);
        assert!(
            (found(&third) - 1.0 / 3.0).abs() < 1e-8,
            "{}",
            found(&third)
        );
    }

    #[test]
    fn a_gap_does_not_change_the_interval() {
        let gap = stamps(100, |k| if k < 50.0 { k } else { k + 7.0 });
        assert!((found(&gap) - 1.0).abs() < 1e-15);
    }
}
