//! Whether the integration step is small enough: the same manoeuvre with half of it.

use std::ops::ControlFlow;

use serde::Serialize;

use super::{ManoeuvreError, ManoeuvreFile, RunSettings, Trace};
use crate::parameters::VehicleParameters;

/// How far a run with half the step is from the same run with the whole one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunConvergence {
    /// Name of the run.
    pub run: String,
    /// Largest difference of LTR over the rows that both runs have (no unit).
    pub ltr_difference: f64,
    /// When it occurs, s.
    pub time_s: f64,
    /// The same up to the first moment without load on a whole side (no unit).
    pub ltr_difference_before_lift: f64,
    /// By how much the two runs differ in length, s: not zero when an event ends them.
    pub length_difference_s: f64,
}

/// Performs a manoeuvre twice, with the step of `settings` and with half of it, and compares LTR run
/// by run. Every tick is compared, whatever `settings.row_s` says.
///
/// # Errors
/// As [`ManoeuvreFile::perform`], and [`ManoeuvreError::SubTest`] when the two do not consist of the
/// same runs, so that nothing can be compared.
pub fn converges(
    file: &ManoeuvreFile,
    vehicle: &VehicleParameters,
    settings: RunSettings,
) -> Result<Vec<RunConvergence>, ManoeuvreError> {
    let perform = |substep_s: f64| {
        let settings = RunSettings {
            substep_s,
            row_s: settings.tick_s,
            ..settings
        };
        file.perform(vehicle, settings, &mut |_| ControlFlow::Continue(()))
    };
    let whole = perform(settings.substep_s)?.traces;
    let half = perform(0.5 * settings.substep_s)?.traces;
    let names = |traces: &[Trace]| {
        let names: Vec<&str> = traces.iter().map(|trace| trace.name.as_str()).collect();
        names.join(", ")
    };
    if names(&whole) != names(&half) {
        return Err(ManoeuvreError::SubTest {
            test: "halving the integration step",
            reason: format!(
                "the runs differ: {} with the whole step, {} with half of it. The step is too large for a decision between runs",
                names(&whole),
                names(&half)
            ),
        });
    }
    Ok(whole
        .iter()
        .zip(&half)
        .map(|(one, other)| compare(one, other))
        .collect())
}

fn compare(one: &Trace, other: &Trace) -> RunConvergence {
    let lift = |trace: &Trace| trace.extremes.unloaded_side_s.unwrap_or(f64::INFINITY);
    let lift_s = lift(one).min(lift(other));
    let mut result = RunConvergence {
        run: one.name.clone(),
        ltr_difference: 0.0,
        time_s: 0.0,
        ltr_difference_before_lift: 0.0,
        length_difference_s: (one.end_s() - other.end_s()).abs(),
    };
    for (a, b) in one.rows.iter().zip(&other.rows) {
        let difference = (a.seen.ltr - b.seen.ltr).abs();
        if difference > result.ltr_difference {
            result.ltr_difference = difference;
            result.time_s = a.seen.time_s;
        }
        if a.seen.time_s < lift_s {
            result.ltr_difference_before_lift = result.ltr_difference_before_lift.max(difference);
        }
    }
    result
}
