//! Step steer and continuous sine: how fast and how strongly the vehicle answers.

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{refused, rising, within};
use super::report::{Curve, Figure, RunReport, Verdict};
use super::signal::{SineFit, StepResponse, first_reach, mean, sine_fit, step_response};
use super::steering::RampHoldReturn;
use super::trace::{Trace, TraceRow};
use super::{Conclusion, LEAD_IN_S, ManoeuvreError};
use crate::parameters::VehicleParameters;
use crate::simulation::{LongitudinalDemand, Observation};
use crate::units::{DEGREE, KMH, wrap_angle};

/// Steps that the search for the handwheel angle may take; three or four are usual.
const SEARCH_STEPS: usize = 12;

/// Step input: `kind = "step_steer"`. The handwheel angle is sought that gives the wanted lateral
/// acceleration in the end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepSteer {
    /// Speed held, km/h.
    pub speed_kmh: f64,
    /// Lateral acceleration in the end, m/s².
    pub lateral_acceleration_m_s2: f64,
    /// How far the end may be from it, m/s².
    pub lateral_acceleration_tolerance_m_s2: f64,
    /// Rate of the handwheel, deg/s.
    pub handwheel_rate_deg_per_s: f64,
    /// Time after the start of steering from which the response counts as steady, s.
    pub steady_from_s: f64,
    /// Time after the start of steering at which the run ends, s.
    pub end_s: f64,
}

/// A response over time that ISO 7401 evaluates: name, unit, per what the gain is, value of a row.
type Response = (
    &'static str,
    &'static str,
    &'static str,
    fn(&TraceRow) -> f64,
);

const RESPONSES: [Response; 3] = [
    ("yaw rate", "deg/s", "1/s", |row| {
        row.seen.yaw_rate_rad_s / DEGREE
    }),
    ("lateral acceleration", "m/s²", "(m/s²)/deg", |row| {
        row.seen.lateral_acceleration_m_s2
    }),
    ("roll angle", "deg", "deg/deg", |row| {
        row.seen.roll_rad / DEGREE
    }),
];

impl StepSteer {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        within("speed_kmh", self.speed_kmh, [10.0, 250.0], "km/h")?;
        within(
            "lateral_acceleration_m_s2",
            self.lateral_acceleration_m_s2,
            [0.1, 15.0],
            "m/s²",
        )?;
        within(
            "lateral_acceleration_tolerance_m_s2",
            self.lateral_acceleration_tolerance_m_s2,
            [1e-6, 1.0],
            "m/s²",
        )?;
        within(
            "handwheel_rate_deg_per_s",
            self.handwheel_rate_deg_per_s,
            [10.0, 5000.0],
            "deg/s",
        )?;
        within("steady_from_s", self.steady_from_s, [0.5, 30.0], "s")?;
        // At least half a second to average over.
        if self.end_s >= self.steady_from_s + 0.5 && self.end_s <= 60.0 {
            return Ok(());
        }
        let allowed = "at least 0.5 s after steady_from_s and at most 60 s";
        Err(refused("end_s", &self.end_s.to_string(), allowed))
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let angle_deg = self.find_angle(bench)?;
        for (direction, sign) in DIRECTIONS {
            let trace = self.drive(bench, &format!("step-{direction}"), sign, angle_deg)?;
            let figures = self.figures(&trace, sign);
            bench.keep(trace, figures)?;
        }
        let mut figures = vec![Figure::number("handwheel angle", angle_deg, "deg")];
        figures.extend(means(&bench.runs));
        Ok(Conclusion {
            figures,
            curves: Vec::new(),
            verdict: Verdict {
                passed: None,
                rule: "ISO 7401 measures and sets no limit".into(),
            },
        })
    }

    /// The handwheel angle (deg) for the wanted lateral acceleration, by the secant method.
    fn find_angle(&self, bench: &mut Bench<'_>) -> Result<f64, ManoeuvreError> {
        let target = self.lateral_acceleration_m_s2;
        let speed = self.speed_kmh * KMH;
        let derived = bench.vehicle.derived();
        let reached = |bench: &mut Bench<'_>, angle_deg: f64| {
            let trace = self.drive(bench, "search", 1.0, angle_deg)?;
            let signal = trace.signal(|row| row.seen.lateral_acceleration_m_s2);
            let from = LEAD_IN_S + self.steady_from_s;
            Ok::<_, ManoeuvreError>(mean(&signal, from, f64::MAX))
        };
        // A vehicle that neither understeers nor oversteers takes this angle.
        let neutral =
            target * derived.wheelbase_m / (speed * speed) * bench.vehicle.steering.ratio / DEGREE;
        let mut last = (0.0, 0.0);
        let mut angle = 0.5 * neutral;
        for _ in 0..SEARCH_STEPS {
            let Some(found) = reached(bench, angle)? else {
                // It rolled over: less than half of the way to what is known to be too little.
                angle = last.0 + 0.4 * (angle - last.0);
                continue;
            };
            if (found - target).abs() <= self.lateral_acceleration_tolerance_m_s2 {
                return Ok(angle);
            }
            let slope = (found - last.1) / (angle - last.0);
            // Near the friction limit more angle brings nothing.
            if slope.is_nan() || slope <= 0.02 * target / neutral {
                last = (angle, found);
                break;
            }
            let next = angle + (target - found) / slope;
            last = (angle, found);
            angle = next.clamp(0.1 * neutral, 3.0 * angle);
        }
        Err(ManoeuvreError::SubTest {
            test: "the search for the handwheel angle",
            reason: format!(
                "{:.1} deg gave {:.3} m/s² and {target} m/s² are wanted. Lower lateral_acceleration_m_s2 or widen its tolerance",
                last.0, last.1
            ),
        })
    }

    fn drive(
        &self,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
        angle_deg: f64,
    ) -> Result<Trace, ManoeuvreError> {
        let shape = RampHoldReturn {
            amplitude_deg: angle_deg,
            rate_deg_per_s: self.handwheel_rate_deg_per_s,
            hold_s: f64::INFINITY,
            return_s: 1.0,
        };
        let speed = self.speed_kmh * KMH;
        let mut plan = |seen: &Observation, tick_s: f64| {
            let since_s = seen.time_s + 0.5 * tick_s - LEAD_IN_S;
            let command = steer(
                sign * shape.at(since_s) * DEGREE,
                LongitudinalDemand::TargetSpeed(speed),
            );
            (since_s <= self.end_s).then_some(command)
        };
        bench.drive(name, speed, &mut plan)
    }

    /// Figures of one step from its trace alone. `sign` is that of the turn.
    #[must_use]
    pub fn figures(&self, trace: &Trace, sign: f64) -> Vec<Figure> {
        const UNSTEADY: &str = "the run ended before the response was steady, or there is none";
        let steady_s = LEAD_IN_S + self.steady_from_s;
        let steady = |value: &dyn Fn(&TraceRow) -> f64| {
            mean(&trace.signal(|row| sign * value(row)), steady_s, f64::MAX)
        };
        let handwheel = trace.signal(|row| sign * row.seen.handwheel_actual_deg());
        let angle = mean(&handwheel, steady_s, f64::MAX).filter(|angle| *angle > 0.0);
        // The time of reference is that of half the angle.
        let reference = angle.and_then(|angle| first_reach(&handwheel, 0.5 * angle, 0.0));
        let mut figures = vec![Figure::optional(
            "steady handwheel angle",
            angle,
            "deg",
            UNSTEADY,
        )];
        let mut yaw_peak_s = None;
        for (name, unit, gain_unit, value) in RESPONSES {
            let end = steady(&value);
            let response: Option<StepResponse> = reference.zip(end).and_then(|(from, end)| {
                step_response(&trace.signal(|row| sign * value(row)), from, end)
            });
            let response_s = response.and_then(|response| response.response_time_s);
            let peak_s = response.and_then(|response| response.peak_time_s);
            let overshoot = response.and_then(|response| response.overshoot);
            let gain = end.zip(angle).map(|(end, angle)| end / angle);
            if name == "yaw rate" {
                yaw_peak_s = peak_s;
            }
            figures.extend([
                Figure::optional(&format!("steady {name}"), end, unit, UNSTEADY),
                Figure::optional(&format!("{name} gain"), gain, gain_unit, UNSTEADY),
                Figure::optional(
                    &format!("{name} response time"),
                    response_s,
                    "s",
                    "the response never reaches 90 % of its steady value",
                ),
                Figure::optional(
                    &format!("{name} peak response time"),
                    peak_s,
                    "s",
                    "the response has no peak",
                ),
                Figure::optional(
                    &format!("{name} overshoot"),
                    overshoot.map(|share| 100.0 * share),
                    "%",
                    UNSTEADY,
                ),
            ]);
        }
        let sideslip = steady(&|row: &TraceRow| row.seen.sideslip_rad / DEGREE);
        let tb = yaw_peak_s
            .zip(sideslip)
            .map(|(time, sideslip)| time * sideslip);
        figures.push(Figure::optional(
            "steady sideslip angle",
            sideslip,
            "deg",
            UNSTEADY,
        ));
        figures.push(Figure::optional("TB factor", tb, "deg s", "the yaw rate has no peak").noted(
            "yaw rate peak response time times steady sideslip angle, which is negative once the tail hangs out",
        ));
        figures.push(Figure::number("largest LTR", trace.extremes.ltr, ""));
        figures
    }
}

/// Figures of all runs by name: the mean of those that have a value.
fn means(runs: &[RunReport]) -> Vec<Figure> {
    let Some(first) = runs.first() else {
        return Vec::new();
    };
    let mean_of = |figure: &Figure| {
        let values: Vec<f64> = runs
            .iter()
            .filter_map(|run| run.figure(&figure.name)?.as_number())
            .collect();
        let count = values.len();
        let value = (count > 0).then(|| values.iter().sum::<f64>() / count as f64);
        let missing = figure.note.as_deref().unwrap_or("no run gives it");
        Figure::optional(&figure.name, value, &figure.unit, missing)
    };
    first.figures.iter().map(mean_of).collect()
}

/// Continuous sinusoidal input: `kind = "frequency_response"`. One run for each frequency.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrequencyResponse {
    /// Speed held, km/h.
    pub speed_kmh: f64,
    /// Lateral acceleration of a neutral vehicle in a steady turn at the amplitude of the handwheel,
    /// m/s²: it sets that amplitude.
    pub lateral_acceleration_amplitude_m_s2: f64,
    /// Frequencies, rising, Hz.
    pub frequencies_hz: Vec<f64>,
    /// Periods left to the transient (no unit).
    pub settling_periods: f64,
    /// Transients get at least this time, s.
    pub settling_least_s: f64,
    /// Whole periods evaluated (no unit).
    pub evaluated_periods: u32,
}

impl FrequencyResponse {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        within("speed_kmh", self.speed_kmh, [10.0, 250.0], "km/h")?;
        within(
            "lateral_acceleration_amplitude_m_s2",
            self.lateral_acceleration_amplitude_m_s2,
            [0.01, 15.0],
            "m/s²",
        )?;
        rising("frequencies_hz", &self.frequencies_hz, [0.05, 10.0], "Hz")?;
        within("settling_periods", self.settling_periods, [0.0, 100.0], "")?;
        within("settling_least_s", self.settling_least_s, [0.0, 60.0], "s")?;
        within(
            "evaluated_periods",
            f64::from(self.evaluated_periods),
            [1.0, 100.0],
            "",
        )
    }

    /// Amplitude of the handwheel, deg.
    #[must_use]
    pub fn amplitude_deg(&self, vehicle: &VehicleParameters) -> f64 {
        let speed = self.speed_kmh * KMH;
        self.lateral_acceleration_amplitude_m_s2 * vehicle.derived().wheelbase_m / (speed * speed)
            * vehicle.steering.ratio
            / DEGREE
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let amplitude = self.amplitude_deg(bench.vehicle);
        let speed = self.speed_kmh * KMH;
        let mut curves: Vec<Curve> = FREQUENCY_RESPONSES
            .into_iter()
            .flat_map(|(name, unit, _)| [(name, "gain", unit), (name, "phase", "deg")])
            .map(|(name, what, unit)| Curve {
                name: format!("{name}: {what} against the handwheel"),
                x: "frequency / Hz".into(),
                y: format!("{what} / ({unit})"),
                points: Vec::new(),
            })
            .collect();
        for &frequency in &self.frequencies_hz {
            let settle_s = (self.settling_periods / frequency).max(self.settling_least_s);
            let end_s = settle_s + f64::from(self.evaluated_periods) / frequency;
            let mut plan = |seen: &Observation, tick_s: f64| {
                let phase = std::f64::consts::TAU * frequency * (seen.time_s + 0.5 * tick_s);
                let angle = amplitude * DEGREE * phase.sin();
                // Half a tick more, so that rounding does not end the run a tick early.
                (seen.time_s < end_s + 0.5 * tick_s)
                    .then(|| steer(angle, LongitudinalDemand::TargetSpeed(speed)))
            };
            let trace = bench.drive(&format!("sine-{frequency}-hz"), speed, &mut plan)?;
            let figures = Self::figures(&trace, frequency, settle_s);
            for (curve, figure) in curves.iter_mut().zip(&figures) {
                curve
                    .points
                    .extend(figure.as_number().map(|value| [frequency, value]));
            }
            bench.keep(trace, figures)?;
        }
        for curve in curves.iter_mut().skip(1).step_by(2) {
            unwrap_phase_deg(&mut curve.points);
        }
        Ok(Conclusion {
            figures: vec![Figure::number("handwheel amplitude", amplitude, "deg")],
            curves,
            verdict: Verdict {
                passed: None,
                rule: "ISO 7401 measures and sets no limit".into(),
            },
        })
    }

    /// Gain and phase of every response of one run against the measured handwheel.
    #[must_use]
    pub fn figures(trace: &Trace, frequency_hz: f64, from_s: f64) -> Vec<Figure> {
        let fit = |value: fn(&TraceRow) -> f64| -> Option<SineFit> {
            sine_fit(&trace.signal(value), frequency_hz, from_s, f64::MAX)
        };
        let handwheel = fit(|row| row.seen.handwheel_actual_rad).filter(|fit| fit.amplitude > 0.0);
        let missing = "the run ended before, or the handwheel did not move";
        FREQUENCY_RESPONSES
            .into_iter()
            .flat_map(|(name, unit, value)| {
                let both = handwheel.zip(fit(value));
                let gain = both.map(|(input, output)| output.amplitude / input.amplitude);
                let phase = both
                    .map(|(input, output)| wrap_angle(output.phase_rad - input.phase_rad) / DEGREE);
                [
                    Figure::optional(&format!("{name} gain"), gain, unit, missing),
                    Figure::optional(&format!("{name} phase"), phase, "deg", missing),
                ]
            })
            .collect()
    }
}

/// A response as the frequency response has it: name, unit of the gain, value of a row.
type Output = (&'static str, &'static str, fn(&TraceRow) -> f64);

const FREQUENCY_RESPONSES: [Output; 4] = [
    ("yaw rate", "1/s", |row| row.seen.yaw_rate_rad_s),
    ("lateral acceleration", "(m/s²)/rad", |row| {
        row.seen.lateral_acceleration_m_s2
    }),
    ("roll angle", "rad/rad", |row| row.seen.roll_rad),
    ("LTR", "1/rad", |row| row.seen.ltr),
];

/// Adds whole turns so that the phase does not jump from one frequency to the next.
fn unwrap_phase_deg(points: &mut [[f64; 2]]) {
    for index in 1..points.len() {
        let last = points[index - 1][1];
        let jump = points[index][1] - last;
        points[index][1] -= 360.0 * (jump / 360.0).round();
    }
}
