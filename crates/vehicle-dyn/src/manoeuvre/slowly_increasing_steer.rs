//! Slowly increasing steer: how much handwheel the vehicle takes for a lateral acceleration.

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{ordered, within};
use super::report::{Curve, Figure, Verdict};
use super::signal::{Line, linear_fit};
use super::trace::Trace;
use super::{Conclusion, ManoeuvreError};
use crate::simulation::{LongitudinalDemand, Observation};
use crate::units::{DEGREE, GRAVITY_M_S2, KMH};

/// Slowly increasing steer at constant speed, to the left and to the right: `kind =
/// "slowly_increasing_steer"`. The handwheel angle at a lateral acceleration comes from a straight
/// line through a range of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlowlyIncreasingSteer {
    /// Speed held, km/h.
    pub speed_kmh: f64,
    /// Rate of the handwheel, deg/s.
    pub handwheel_rate_deg_per_s: f64,
    /// Handwheel angle at which the run ends at the latest, deg.
    pub largest_handwheel_deg: f64,
    /// Lateral acceleration at which the run ends, g.
    pub end_lateral_acceleration_g: f64,
    /// Begin of the range of the line, g.
    pub regression_from_g: f64,
    /// End of the range of the line, g.
    pub regression_to_g: f64,
    /// Lateral acceleration at which the line is read, g.
    pub target_lateral_acceleration_g: f64,
}

/// What slowly increasing steer came to: the scale of the steering of other tests.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteeringScale {
    /// Handwheel angle A at the target lateral acceleration, mean of left and right, rounded to
    /// 0.1 deg as the rules ask, deg.
    pub angle_deg: f64,
    /// Handwheel angle per lateral acceleration, mean of left and right, deg/g.
    pub slope_deg_per_g: f64,
    /// Understeer gradient: `slope/ratio − L·g/v²`, deg/g.
    pub understeer_deg_per_g: f64,
}

impl SlowlyIncreasingSteer {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        within("speed_kmh", self.speed_kmh, [10.0, 250.0], "km/h")?;
        within(
            "handwheel_rate_deg_per_s",
            self.handwheel_rate_deg_per_s,
            [0.1, 100.0],
            "deg/s",
        )?;
        within(
            "largest_handwheel_deg",
            self.largest_handwheel_deg,
            [10.0, 2000.0],
            "deg",
        )?;
        within(
            "end_lateral_acceleration_g",
            self.end_lateral_acceleration_g,
            [0.01, 2.0],
            "g",
        )?;
        within("regression_from_g", self.regression_from_g, [0.0, 2.0], "g")?;
        within(
            "target_lateral_acceleration_g",
            self.target_lateral_acceleration_g,
            [0.01, 2.0],
            "g",
        )?;
        ordered(
            "regression_from_g, regression_to_g",
            self.regression_from_g,
            self.regression_to_g,
            "g",
        )?;
        ordered(
            "regression_to_g, end_lateral_acceleration_g",
            self.regression_to_g,
            self.end_lateral_acceleration_g,
            "g",
        )
    }

    /// Runs both directions and reads the line; the runs are kept.
    pub(super) fn scale(&self, bench: &mut Bench<'_>) -> Result<SteeringScale, ManoeuvreError> {
        let mut angles = [0.0; 2];
        let mut slopes = [0.0; 2];
        for (index, (direction, sign)) in DIRECTIONS.into_iter().enumerate() {
            let name = format!("slowly-increasing-steer-{direction}");
            let trace = self.drive(bench, &name, sign)?;
            let line = self.line(&trace, sign);
            let reached = trace.extremes.lateral_acceleration_m_s2 / GRAVITY_M_S2;
            let angle = line.map(|line| line.at(self.target_lateral_acceleration_g));
            let slope = line.map(|line| line.slope);
            let why = "the lateral acceleration does not pass through the range of the line";
            bench.keep(
                trace,
                vec![
                    Figure::optional(&self.angle_name(), angle, "deg", why),
                    Figure::optional("steering wheel angle gradient", slope, "deg/g", why),
                    Figure::number("largest lateral acceleration", reached, "g"),
                ],
            )?;
            let usable = line.filter(|line| {
                line.slope > 0.0 && line.at(self.target_lateral_acceleration_g) > 0.0
            });
            let Some(line) = usable else {
                return Err(ManoeuvreError::SubTest {
                    test: "slowly increasing steer",
                    reason: format!(
                        "the lateral acceleration reached {reached:.3} g in run {name}, and a line that rises is needed from {} g to {} g. Give more friction, a larger largest_handwheel_deg or a lower range",
                        self.regression_from_g, self.regression_to_g
                    ),
                });
            };
            angles[index] = line.at(self.target_lateral_acceleration_g);
            slopes[index] = line.slope;
        }
        let slope = 0.5 * (slopes[0] + slopes[1]);
        let speed = self.speed_kmh * KMH;
        let wheelbase = bench.vehicle.derived().wheelbase_m;
        let ackermann = wheelbase * GRAVITY_M_S2 / (speed * speed) / DEGREE;
        Ok(SteeringScale {
            angle_deg: (0.5 * (angles[0] + angles[1]) * 10.0).round() / 10.0,
            slope_deg_per_g: slope,
            understeer_deg_per_g: slope / bench.vehicle.steering.ratio - ackermann,
        })
    }

    /// The manoeuvre by itself.
    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let scale = self.scale(bench)?;
        let curves = bench
            .traces
            .iter()
            .zip(DIRECTIONS)
            .map(|(trace, (direction, sign))| Curve {
                name: format!("Handwheel angle, {direction}"),
                x: "lateral acceleration / g".into(),
                y: "handwheel angle / deg".into(),
                points: trace
                    .rows
                    .iter()
                    .map(|row| row_point(&row.seen, sign).into())
                    .collect(),
            })
            .collect();
        Ok(Conclusion {
            figures: scale.figures(self.target_lateral_acceleration_g),
            curves,
            verdict: Verdict {
                passed: None,
                rule: "slowly increasing steer measures and has no limit".into(),
            },
        })
    }

    fn angle_name(&self) -> String {
        angle_name(self.target_lateral_acceleration_g)
    }

    fn drive(&self, bench: &mut Bench<'_>, name: &str, sign: f64) -> Result<Trace, ManoeuvreError> {
        let speed = self.speed_kmh * KMH;
        let mut plan = |seen: &Observation, tick_s: f64| {
            let angle = self.handwheel_rate_deg_per_s * (seen.time_s + 0.5 * tick_s);
            let reached = sign * seen.lateral_acceleration_m_s2
                > self.end_lateral_acceleration_g * GRAVITY_M_S2;
            (angle <= self.largest_handwheel_deg && !reached).then(|| {
                steer(
                    sign * angle * DEGREE,
                    LongitudinalDemand::TargetSpeed(speed),
                )
            })
        };
        bench.drive(name, speed, &mut plan)
    }

    /// The line of one direction from its trace alone: handwheel angle in deg over lateral
    /// acceleration in g, through the rows within the range up to the first beyond it. `None` for
    /// fewer than three rows.
    #[must_use]
    pub fn line(&self, trace: &Trace, sign: f64) -> Option<Line> {
        let points: Vec<(f64, f64)> = trace
            .rows
            .iter()
            .map(|row| row_point(&row.seen, sign))
            .take_while(|point| point.0 <= self.regression_to_g)
            .filter(|point| point.0 >= self.regression_from_g)
            .collect();
        linear_fit(&points).filter(|line| line.points >= 3)
    }
}

impl SteeringScale {
    /// The figures of the scale.
    pub(super) fn figures(&self, target_g: f64) -> Vec<Figure> {
        vec![
            Figure::number(&angle_name(target_g), self.angle_deg, "deg"),
            Figure::number(
                "steering wheel angle gradient",
                self.slope_deg_per_g,
                "deg/g",
            ),
            Figure::number("understeer gradient", self.understeer_deg_per_g, "deg/g")
                .noted("of the ramp, with its lag; ISO 4138 measures it in steady state"),
        ]
    }
}

fn angle_name(target_g: f64) -> String {
    format!("handwheel angle A at {target_g} g")
}

fn row_point(seen: &Observation, sign: f64) -> (f64, f64) {
    (
        sign * seen.lateral_acceleration_m_s2 / GRAVITY_M_S2,
        sign * seen.handwheel_actual_deg(),
    )
}
