//! Steady-state circular driving: how the vehicle steers, rolls and slips per lateral acceleration.

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{ordered, within};
use super::report::{Curve, Figure, RunReport, Verdict};
use super::signal::linear_fit;
use super::trace::{Trace, TraceRow};
use super::{Conclusion, ManoeuvreError};
use crate::parameters::VehicleParameters;
use crate::simulation::{LongitudinalDemand, Observation};
use crate::units::{DEGREE, GRAVITY_M_S2, KMH};

/// Time the steering machine takes to bring the vehicle onto the circle, s.
const STEERING_TIME_S: f64 = 1.0;
/// Width of the classes of the curves, g.
const CURVE_STEP_G: f64 = 0.01;

/// Steady-state circular driving: `kind = "circular"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circular {
    /// What is held and what grows.
    pub method: CircularMethod,
    /// Begin of the range in which the gradients are read, g.
    pub gradient_from_g: f64,
    /// End of that range, g.
    pub gradient_to_g: f64,
    /// Lateral acceleration at which the run ends at the latest, g.
    pub end_lateral_acceleration_g: f64,
}

/// What is held and what grows in steady-state circular driving.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CircularMethod {
    /// The radius is held, the speed grows slowly.
    ConstantRadius(ConstantRadius),
    /// The speed is held, the handwheel turns slowly.
    ConstantSpeed(ConstantSpeed),
}

/// Circular driving on a constant radius, at a speed that grows slowly. The steering machine holds
/// the curvature of the path, so no driver is part of the result.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantRadius {
    /// Radius of the path of the CG, m.
    pub radius_m: f64,
    /// Speed at the start, km/h.
    pub first_speed_kmh: f64,
    /// Growth of the speed, (km/h)/s.
    pub speed_rate_kmh_per_s: f64,
    /// Time to settle on the circle before the speed grows, s.
    pub settling_s: f64,
    /// The run ends when the radius is off by this share (no unit): the vehicle cannot hold it.
    pub radius_tolerance: f64,
}

/// Circular driving at a constant speed, with a handwheel that turns slowly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantSpeed {
    /// Speed, km/h.
    pub speed_kmh: f64,
    /// Rate of the handwheel, deg/s.
    pub handwheel_rate_deg_per_s: f64,
    /// Handwheel angle at which the run ends at the latest, deg.
    pub largest_handwheel_deg: f64,
}

impl ConstantRadius {
    fn check(&self) -> Result<(), ManoeuvreError> {
        let field = |key: &str| format!("method.constant_radius.{key}");
        within(&field("radius_m"), self.radius_m, [10.0, 2000.0], "m")?;
        within(
            &field("first_speed_kmh"),
            self.first_speed_kmh,
            [5.0, 250.0],
            "km/h",
        )?;
        within(
            &field("speed_rate_kmh_per_s"),
            self.speed_rate_kmh_per_s,
            [0.01, 5.0],
            "(km/h)/s",
        )?;
        within(&field("settling_s"), self.settling_s, [1.0, 120.0], "s")?;
        within(
            &field("radius_tolerance"),
            self.radius_tolerance,
            [0.001, 0.5],
            "",
        )
    }
}

impl ConstantSpeed {
    fn check(&self) -> Result<(), ManoeuvreError> {
        let field = |key: &str| format!("method.constant_speed.{key}");
        within(&field("speed_kmh"), self.speed_kmh, [10.0, 250.0], "km/h")?;
        within(
            &field("handwheel_rate_deg_per_s"),
            self.handwheel_rate_deg_per_s,
            [0.1, 50.0],
            "deg/s",
        )?;
        within(
            &field("largest_handwheel_deg"),
            self.largest_handwheel_deg,
            [10.0, 2000.0],
            "deg",
        )
    }
}

/// Name, unit and value of a row of what is read over lateral acceleration.
type Quantity = (&'static str, &'static str, fn(&TraceRow) -> f64);

const QUANTITIES: [Quantity; 4] = [
    ("steering wheel angle", "deg", |row| {
        row.seen.handwheel_actual_deg()
    }),
    ("sideslip angle", "deg", |row| {
        row.seen.sideslip_rad / DEGREE
    }),
    ("roll angle", "deg", |row| row.seen.roll_rad / DEGREE),
    ("LTR", "", |row| row.seen.ltr),
];

impl Circular {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        within("gradient_from_g", self.gradient_from_g, [0.0, 2.0], "g")?;
        ordered(
            "gradient_from_g, gradient_to_g",
            self.gradient_from_g,
            self.gradient_to_g,
            "g",
        )?;
        within("gradient_to_g", self.gradient_to_g, [0.01, 2.0], "g")?;
        within(
            "end_lateral_acceleration_g",
            self.end_lateral_acceleration_g,
            [0.01, 2.0],
            "g",
        )?;
        match &self.method {
            CircularMethod::ConstantRadius(method) => method.check(),
            CircularMethod::ConstantSpeed(method) => method.check(),
        }
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let mut curves = Vec::new();
        for (direction, sign) in DIRECTIONS {
            let name = format!("circle-{direction}");
            let (trace, from_s) = match &self.method {
                CircularMethod::ConstantRadius(method) => (
                    self.on_radius(method, bench, &name, sign)?,
                    method.settling_s,
                ),
                CircularMethod::ConstantSpeed(method) => {
                    (self.at_speed(method, bench, &name, sign)?, 0.0)
                }
            };
            let figures = self.figures(&trace, sign, from_s, bench.vehicle);
            curves.extend(QUANTITIES.map(|(quantity, unit, value)| Curve {
                name: format!("{quantity}, {direction}"),
                x: "lateral acceleration / g".into(),
                y: format!(
                    "{quantity}{}{unit}",
                    if unit.is_empty() { "" } else { " / " }
                ),
                points: classes(&points(&trace, sign, from_s, value)),
            }));
            bench.keep(trace, figures)?;
        }
        Ok(Conclusion {
            figures: mean_of_directions(&bench.runs),
            curves,
            verdict: Verdict {
                passed: None,
                rule: "ISO 4138 measures and sets no limit".into(),
            },
        })
    }

    fn done(&self, seen: &Observation, sign: f64) -> bool {
        sign * seen.lateral_acceleration_m_s2 > self.end_lateral_acceleration_g * GRAVITY_M_S2
            || seen.two_wheel_lift()
    }

    fn on_radius(
        &self,
        method: &ConstantRadius,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
    ) -> Result<Trace, ManoeuvreError> {
        let first_speed = method.first_speed_kmh * KMH;
        let wheelbase = bench.vehicle.derived().wheelbase_m;
        let gain = bench.vehicle.steering.ratio * wheelbase / STEERING_TIME_S;
        let largest = bench.vehicle.steering.handwheel_limit_deg * DEGREE;
        let mut angle = 0.0_f64;
        let mut plan = |seen: &Observation, tick_s: f64| {
            let speed = seen.speed_m_s.hypot(seen.lateral_speed_m_s).max(0.1);
            // The path's curvature in steady state, where the sideslip angle rests.
            let error = 1.0 / method.radius_m - sign * seen.yaw_rate_rad_s / speed;
            angle = (angle + gain * error * tick_s).clamp(0.0, largest);
            let growing_s = (seen.time_s - method.settling_s).max(0.0);
            let target = first_speed + method.speed_rate_kmh_per_s * KMH * growing_s;
            let lost = growing_s > 0.0 && (error * method.radius_m).abs() > method.radius_tolerance;
            (!lost && !self.done(seen, sign) && target < 150.0)
                .then(|| steer(sign * angle, LongitudinalDemand::TargetSpeed(target)))
        };
        bench.drive(name, first_speed, &mut plan)
    }

    fn at_speed(
        &self,
        method: &ConstantSpeed,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
    ) -> Result<Trace, ManoeuvreError> {
        let speed = method.speed_kmh * KMH;
        let mut plan = |seen: &Observation, tick_s: f64| {
            let angle = method.handwheel_rate_deg_per_s * (seen.time_s + 0.5 * tick_s);
            (angle <= method.largest_handwheel_deg && !self.done(seen, sign)).then(|| {
                steer(
                    sign * angle * DEGREE,
                    LongitudinalDemand::TargetSpeed(speed),
                )
            })
        };
        bench.drive(name, speed, &mut plan)
    }

    /// Figures of one direction from its trace alone, from `from_s` on. `sign` is that of the turn.
    #[must_use]
    pub fn figures(
        &self,
        trace: &Trace,
        sign: f64,
        from_s: f64,
        vehicle: &VehicleParameters,
    ) -> Vec<Figure> {
        const MISSING: &str =
            "the lateral acceleration does not pass through the range of the gradients";
        let slope = |value: fn(&TraceRow) -> f64| {
            let all = points(trace, sign, from_s, value);
            let inside: Vec<(f64, f64)> = all
                .into_iter()
                .take_while(|point| point.0 <= self.gradient_to_g)
                .filter(|point| point.0 >= self.gradient_from_g)
                .collect();
            linear_fit(&inside)
                .filter(|line| line.points >= 3)
                .map(|line| line.slope)
        };
        let mut figures = Vec::new();
        for (name, unit, value) in QUANTITIES {
            let unit = if unit.is_empty() {
                "1/g".to_owned()
            } else {
                format!("{unit}/g")
            };
            figures.push(Figure::optional(
                &format!("{name} gradient"),
                slope(value),
                &unit,
                MISSING,
            ));
        }
        // The angle that the turn itself needs: constant on a constant radius, and falling with the
        // square of the speed at a constant one.
        let ackermann = match self.method {
            CircularMethod::ConstantRadius(_) => 0.0,
            CircularMethod::ConstantSpeed(method) => {
                let speed = method.speed_kmh * KMH;
                vehicle.derived().wheelbase_m * GRAVITY_M_S2 / (speed * speed) / DEGREE
            }
        };
        let steering =
            slope(QUANTITIES[0].2).map(|slope| slope / vehicle.steering.ratio - ackermann);
        figures.insert(
            0,
            Figure::optional("understeer gradient", steering, "deg/g", MISSING),
        );
        figures.push(Figure::number(
            "largest lateral acceleration",
            trace.extremes.lateral_acceleration_m_s2 / GRAVITY_M_S2,
            "g",
        ));
        figures.push(Figure::flag(
            "both wheels of one side without load",
            trace.extremes.unloaded_side_s.is_some(),
        ));
        figures
    }
}

/// Points (lateral acceleration in g, value) from `from_s` on, both as in a turn to the left.
fn points(trace: &Trace, sign: f64, from_s: f64, value: fn(&TraceRow) -> f64) -> Vec<(f64, f64)> {
    trace
        .rows
        .iter()
        .filter(|row| row.seen.time_s >= from_s)
        .map(|row| {
            (
                sign * row.seen.lateral_acceleration_m_s2 / GRAVITY_M_S2,
                sign * value(row),
            )
        })
        .collect()
}

/// Mean point of each class of lateral acceleration, in driving order.
fn classes(points: &[(f64, f64)]) -> Vec<[f64; 2]> {
    let mut curve = Vec::new();
    // Lateral accelerations of a few g: the class fits.
    #[allow(clippy::cast_possible_truncation)]
    let class = |point: &(f64, f64)| (point.0 / CURVE_STEP_G).floor() as i64;
    for group in points.chunk_by(|a, b| class(a) == class(b)) {
        let count = group.len() as f64;
        let sum = group
            .iter()
            .fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        curve.push([sum.0 / count, sum.1 / count]);
    }
    curve
}

/// Mean of left and right of every number.
fn mean_of_directions(runs: &[RunReport]) -> Vec<Figure> {
    let Some(first) = runs.first() else {
        return Vec::new();
    };
    let mean = |figure: &Figure| {
        let values: Vec<f64> = runs
            .iter()
            .filter_map(|run| run.figure(&figure.name)?.as_number())
            .collect();
        let value =
            (values.len() == runs.len()).then(|| values.iter().sum::<f64>() / values.len() as f64);
        let missing = figure
            .note
            .as_deref()
            .unwrap_or("a direction does not give it");
        Figure::optional(&figure.name, value, &figure.unit, missing)
    };
    first
        .figures
        .iter()
        .filter(|figure| figure.as_flag().is_none())
        .map(mean)
        .collect()
}
