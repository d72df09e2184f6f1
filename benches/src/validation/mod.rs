//! What is known about the rightness of `vehicle-dyn`, as rows of target, tolerance and result.
//!
//! [`mod@reference`] holds a vehicle against the trajectories of an independent model, the other modules
//! hold it against theory. The program `vehicle-validation` writes them all into a report; tests
//! require them one by one.

pub mod derived;
pub mod manoeuvres;
pub mod mechanics;
pub mod reference;
pub mod response;
pub mod step;
pub mod tyre;

use serde::Serialize;

/// One check. It passes when the result lies within the tolerance of the target.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Part of the report it belongs to.
    pub group: &'static str,
    /// Vehicle that was checked; empty when the check is of a law.
    pub vehicle: String,
    /// What was checked.
    pub check: String,
    /// Unit of the three numbers; empty when they have none.
    pub unit: &'static str,
    /// What should come out.
    pub target: f64,
    /// How far from the target the result may lie.
    pub tolerance: f64,
    /// The tolerance as it is stated, such as `10 %`.
    pub tolerance_as: String,
    /// What came out.
    pub result: f64,
    /// Whether it is within the tolerance.
    pub pass: bool,
    /// Where target or result come from, or why a check fails; may be empty.
    pub remark: String,
}

impl Row {
    /// A row with a tolerance in the unit of the target.
    #[must_use]
    pub fn absolute(
        check: impl Into<String>,
        unit: &'static str,
        target: f64,
        tolerance: f64,
        result: f64,
    ) -> Self {
        Self {
            group: "",
            vehicle: String::new(),
            check: check.into(),
            unit,
            target,
            tolerance,
            tolerance_as: format!("{tolerance} {unit}").trim_end().to_owned(),
            result,
            // NaN passes nothing.
            pass: (result - target).abs() <= tolerance,
            remark: String::new(),
        }
    }

    /// A row with a tolerance in per cent of the target.
    #[must_use]
    pub fn relative(
        check: impl Into<String>,
        unit: &'static str,
        target: f64,
        percent: f64,
        result: f64,
    ) -> Self {
        let tolerance = (0.01 * percent * target).abs();
        Self {
            tolerance_as: format!("{percent} %"),
            ..Self::absolute(check, unit, target, tolerance, result)
        }
    }

    /// The row with a remark.
    #[must_use]
    pub fn remarked(self, remark: impl Into<String>) -> Self {
        Self {
            remark: remark.into(),
            ..self
        }
    }
}

/// Puts rows into a group and under a vehicle's name.
#[must_use]
pub fn under(group: &'static str, vehicle: &str, rows: Vec<Row>) -> Vec<Row> {
    rows.into_iter()
        .map(|row| Row {
            group,
            vehicle: vehicle.to_owned(),
            ..row
        })
        .collect()
}
