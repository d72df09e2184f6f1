//! Fishhook and J-turn: series of rising entrance speed until both wheels of one side lift.

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{refused, rising, within};
use super::report::{Bound, Figure, RunReport, Verdict, Warning};
use super::slowly_increasing_steer::SlowlyIncreasingSteer;
use super::steering::{FishhookShape, RampHoldReturn};
use super::trace::Trace;
use super::{Conclusion, LEAD_IN_S, ManoeuvreError};
use crate::metrics::Outcome;
use crate::simulation::{Command, LongitudinalDemand, Observation};
use crate::units::{DEGREE, GRAVITY_M_S2, MPH};

/// Time a run goes on after the steering is straight again, s.
const RUN_OUT_S: f64 = 1.0;

/// The fishhook: `kind = "fishhook"`. Turn in, reverse, hold, straighten; throttle dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fishhook {
    /// The test that gives A.
    pub slowly_increasing_steer: SlowlyIncreasingSteer,
    /// Amplitude in multiples of A (no unit).
    pub amplitude_multiple: f64,
    /// Rate of the handwheel, deg/s.
    pub handwheel_rate_deg_per_s: f64,
    /// When the reversal begins.
    pub reversal: Reversal,
    /// Time at the second angle, s.
    pub hold_s: f64,
    /// Time of the ramp back to zero, s.
    pub return_s: f64,
    /// Speeds at the start of steering, rising, mph.
    pub entrance_speeds_mph: Vec<f64>,
    /// Height of both wheels of one side that counts as two-wheel lift, m.
    pub two_wheel_lift_m: f64,
}

/// When the reversal of a fishhook begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Reversal {
    /// A fixed time after the first angle is reached (fishhook 1a).
    FixedTiming {
        /// That time, s.
        dwell_s: f64,
    },
    /// When the roll rate has fallen to a threshold: the roll angle is largest (fishhook 1b).
    RollRateFeedback {
        /// Threshold, deg/s.
        threshold_deg_per_s: f64,
        /// The reversal begins at the latest so long after the first angle is reached, s.
        longest_dwell_s: f64,
    },
}

/// The J-turn: `kind = "j_turn"`. Turn in, hold, straighten; throttle dropped.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JTurn {
    /// The test that gives A.
    pub slowly_increasing_steer: SlowlyIncreasingSteer,
    /// Amplitude in multiples of A (no unit).
    pub amplitude_multiple: f64,
    /// Rate of the handwheel, deg/s.
    pub handwheel_rate_deg_per_s: f64,
    /// Time at the angle, s.
    pub hold_s: f64,
    /// Time of the ramp back to zero, s.
    pub return_s: f64,
    /// Speeds at the start of steering, rising, mph.
    pub entrance_speeds_mph: Vec<f64>,
    /// Height of both wheels of one side that counts as two-wheel lift, m.
    pub two_wheel_lift_m: f64,
}

impl Fishhook {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        self.slowly_increasing_steer.check()?;
        match self.reversal {
            Reversal::FixedTiming { dwell_s } => {
                within("reversal.fixed_timing.dwell_s", dwell_s, [0.0, 10.0], "s")?;
            }
            Reversal::RollRateFeedback {
                threshold_deg_per_s,
                longest_dwell_s,
            } => {
                let table = "reversal.roll_rate_feedback";
                let field = format!("{table}.threshold_deg_per_s");
                within(&field, threshold_deg_per_s, [0.0, 100.0], "deg/s")?;
                within(
                    &format!("{table}.longest_dwell_s"),
                    longest_dwell_s,
                    [0.1, 20.0],
                    "s",
                )?;
            }
        }
        self.series().check()
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        self.series()
            .run(bench, &mut |bench, name, sign, speed, angle| {
                let (trace, reversal) = self.drive(bench, name, sign, speed, angle)?;
                let figure = Figure::optional(
                    "start of the reversal after the start of steering",
                    reversal,
                    "s",
                    "the run ended before the reversal",
                );
                Ok((trace, vec![figure]))
            })
    }

    fn series(&self) -> Series<'_> {
        Series {
            sub_test: &self.slowly_increasing_steer,
            amplitude_multiple: self.amplitude_multiple,
            handwheel_rate_deg_per_s: self.handwheel_rate_deg_per_s,
            hold_s: self.hold_s,
            return_s: self.return_s,
            speeds_mph: &self.entrance_speeds_mph,
            two_wheel_lift_m: self.two_wheel_lift_m,
        }
    }

    fn drive(
        &self,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
        speed_m_s: f64,
        amplitude_deg: f64,
    ) -> Result<(Trace, Option<f64>), ManoeuvreError> {
        let shape = FishhookShape {
            amplitude_deg,
            rate_deg_per_s: self.handwheel_rate_deg_per_s,
            hold_s: self.hold_s,
            return_s: self.return_s,
        };
        let mut timer = ReversalTimer::new(self.reversal, shape.first_ramp_s(), sign);
        let mut plan = |seen: &Observation, tick_s: f64| -> Option<Command> {
            let since_s = seen.time_s - LEAD_IN_S;
            timer.watch(since_s, seen.roll_rate_rad_s / DEGREE);
            if timer
                .start_s
                .is_some_and(|start| since_s > shape.end_s(start) + RUN_OUT_S)
            {
                return None;
            }
            let angle = shape.at(since_s + 0.5 * tick_s, timer.start_s);
            Some(coasting(sign * angle * DEGREE, speed_m_s, since_s))
        };
        let trace = bench.drive(name, speed_m_s, &mut plan)?;
        if timer.timed_out {
            bench.warnings.push(Warning::NotReached {
                what: format!(
                    "in run {name} the roll rate did not fall to the threshold: the reversal began after the longest dwell"
                ),
            });
        }
        Ok((trace, timer.start_s))
    }
}

/// Decides when a fishhook reverses, from the roll rate as it is measured.
struct ReversalTimer {
    rule: Reversal,
    armed_s: f64,
    sign: f64,
    last: Option<(f64, f64)>,
    start_s: Option<f64>,
    timed_out: bool,
}

impl ReversalTimer {
    fn new(rule: Reversal, first_ramp_s: f64, sign: f64) -> Self {
        let start_s = match rule {
            Reversal::FixedTiming { dwell_s } => Some(first_ramp_s + dwell_s),
            Reversal::RollRateFeedback { .. } => None,
        };
        Self {
            rule,
            armed_s: first_ramp_s,
            sign,
            last: None,
            start_s,
            timed_out: false,
        }
    }

    /// Takes note of the roll rate (deg/s) at `since_s` after the start of steering.
    fn watch(&mut self, since_s: f64, roll_rate_deg_per_s: f64) {
        let Reversal::RollRateFeedback {
            threshold_deg_per_s,
            longest_dwell_s,
        } = self.rule
        else {
            return;
        };
        // In a turn to the left the body rolls to the right, which is positive.
        let rate = self.sign * roll_rate_deg_per_s;
        if self.start_s.is_none() && since_s >= self.armed_s {
            if rate <= threshold_deg_per_s {
                // Within the tick, so that the time does not jump from one tick to the next.
                let crossing = self
                    .last
                    .filter(|last| last.1 > threshold_deg_per_s)
                    .map(|last| {
                        let share = (last.1 - threshold_deg_per_s) / (last.1 - rate);
                        last.0 + share * (since_s - last.0)
                    });
                self.start_s = Some(crossing.unwrap_or(since_s).max(self.armed_s));
            } else if since_s >= self.armed_s + longest_dwell_s {
                self.start_s = Some(since_s);
                self.timed_out = true;
            }
        }
        self.last = Some((since_s, rate));
    }
}

impl JTurn {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        self.slowly_increasing_steer.check()?;
        self.series().check()
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        self.series()
            .run(bench, &mut |bench, name, sign, speed, angle| {
                let shape = RampHoldReturn {
                    amplitude_deg: angle,
                    rate_deg_per_s: self.handwheel_rate_deg_per_s,
                    hold_s: self.hold_s,
                    return_s: self.return_s,
                };
                let mut plan = |seen: &Observation, tick_s: f64| {
                    let since_s = seen.time_s - LEAD_IN_S;
                    let angle = sign * shape.at(since_s + 0.5 * tick_s) * DEGREE;
                    (since_s <= shape.end_s() + RUN_OUT_S).then(|| coasting(angle, speed, since_s))
                };
                Ok((bench.drive(name, speed, &mut plan)?, Vec::new()))
            })
    }

    fn series(&self) -> Series<'_> {
        Series {
            sub_test: &self.slowly_increasing_steer,
            amplitude_multiple: self.amplitude_multiple,
            handwheel_rate_deg_per_s: self.handwheel_rate_deg_per_s,
            hold_s: self.hold_s,
            return_s: self.return_s,
            speeds_mph: &self.entrance_speeds_mph,
            two_wheel_lift_m: self.two_wheel_lift_m,
        }
    }
}

/// Speed held up to the start of steering, then throttle dropped.
fn coasting(handwheel_rad: f64, speed_m_s: f64, since_s: f64) -> Command {
    let pedals = if since_s < 0.0 {
        LongitudinalDemand::TargetSpeed(speed_m_s)
    } else {
        LongitudinalDemand::Released
    };
    steer(handwheel_rad, pedals)
}

/// What fishhook and J-turn share.
struct Series<'a> {
    sub_test: &'a SlowlyIncreasingSteer,
    amplitude_multiple: f64,
    handwheel_rate_deg_per_s: f64,
    hold_s: f64,
    return_s: f64,
    speeds_mph: &'a [f64],
    two_wheel_lift_m: f64,
}

/// Drives one run: bench, name, sign, speed (m/s), amplitude (deg) to trace and figures of its own.
type Drive<'d> = &'d mut dyn FnMut(
    &mut Bench<'_>,
    &str,
    f64,
    f64,
    f64,
) -> Result<(Trace, Vec<Figure>), ManoeuvreError>;

impl Series<'_> {
    fn check(&self) -> Result<(), ManoeuvreError> {
        within(
            "amplitude_multiple",
            self.amplitude_multiple,
            [0.1, 20.0],
            "",
        )?;
        within(
            "handwheel_rate_deg_per_s",
            self.handwheel_rate_deg_per_s,
            [1.0, 5000.0],
            "deg/s",
        )?;
        within("hold_s", self.hold_s, [0.0, 60.0], "s")?;
        within("return_s", self.return_s, [0.01, 60.0], "s")?;
        rising("entrance_speeds_mph", self.speeds_mph, [5.0, 150.0], "mph")?;
        if !(self.two_wheel_lift_m > 0.0 && self.two_wheel_lift_m <= 1.0) {
            let found = self.two_wheel_lift_m.to_string();
            return Err(refused("two_wheel_lift_m", &found, "in (0, 1] m"));
        }
        Ok(())
    }

    /// Each direction with rising speed, up to the first run in which two wheels lift.
    fn run(&self, bench: &mut Bench<'_>, drive: Drive<'_>) -> Result<Conclusion, ManoeuvreError> {
        bench.two_wheel_lift_m = self.two_wheel_lift_m;
        let scale = self.sub_test.scale(bench)?;
        let amplitude = self.amplitude_multiple * scale.angle_deg;
        let mut first_lifts = [None; 2];
        let before = bench.runs.len();
        for (lift, (direction, sign)) in first_lifts.iter_mut().zip(DIRECTIONS) {
            for &speed_mph in self.speeds_mph {
                let name = format!("{direction}-{speed_mph}-mph");
                let (trace, own) = drive(bench, &name, sign, speed_mph * MPH, amplitude)?;
                let lifted = trace.extremes.two_wheel_lift_s.is_some();
                let figures = self.figures(&trace, speed_mph, own);
                bench.keep(trace, figures)?;
                if lifted {
                    *lift = Some(speed_mph);
                    break;
                }
            }
        }
        let mut figures = scale.figures(self.sub_test.target_lateral_acceleration_g);
        figures.push(Figure::number("handwheel amplitude", amplitude, "deg"));
        figures.extend(self.conclusions(&bench.runs[before..], first_lifts));
        Ok(Conclusion {
            figures,
            curves: Vec::new(),
            verdict: Verdict {
                passed: Some(first_lifts == [None; 2]),
                rule: format!(
                    "no run lifts both wheels of one side by {:.1} mm at once",
                    1e3 * self.two_wheel_lift_m
                ),
            },
        })
    }

    fn conclusions(&self, runs: &[RunReport], first_lifts: [Option<f64>; 2]) -> Vec<Figure> {
        let most = |name: &str| {
            let values = runs.iter().filter_map(|run| run.figure(name)?.as_number());
            values.reduce(f64::max)
        };
        let fastest = self.speeds_mph.last().copied().unwrap_or_default();
        let none = format!("no two-wheel lift up to {fastest} mph");
        let lowest = first_lifts.into_iter().flatten().reduce(f64::min);
        let mut figures = vec![
            Figure::flag("two-wheel lift", lowest.is_some()).required(
                Bound::Answer(false),
                "NHTSA rollover rating: tip-up or no tip-up",
            ),
            Figure::optional(
                "lowest entrance speed with two-wheel lift",
                lowest,
                "mph",
                &none,
            ),
        ];
        for (lift, (direction, _)) in first_lifts.into_iter().zip(DIRECTIONS) {
            let name = format!("entrance speed of two-wheel lift, first turn to the {direction}");
            figures.push(Figure::optional(&name, lift, "mph", &none));
        }
        for (name, unit) in [
            ("largest LTR", ""),
            ("largest roll angle", "deg"),
            ("largest lateral acceleration", "g"),
        ] {
            figures.push(Figure::optional(name, most(name), unit, "no run"));
        }
        figures
    }

    fn figures(&self, trace: &Trace, speed_mph: f64, own: Vec<Figure>) -> Vec<Figure> {
        let worst = &trace.extremes;
        let at_start = trace
            .rows
            .iter()
            .find(|row| row.seen.time_s >= LEAD_IN_S - 1e-9)
            .map(|row| row.seen.speed_m_s / MPH);
        let lifted = worst.two_wheel_lift_s;
        let height = format!(
            "both wheels of one side never {:.1} mm high",
            1e3 * self.two_wheel_lift_m
        );
        let mut figures = vec![
            Figure::number("entrance speed asked for", speed_mph, "mph"),
            Figure::optional(
                "entrance speed",
                at_start,
                "mph",
                "the run ended before the steering",
            ),
            Figure::flag("two-wheel lift", lifted.is_some()).required(
                Bound::Answer(false),
                "NHTSA rollover rating: tip-up or no tip-up",
            ),
            Figure::optional(
                "two-wheel lift after the start of steering",
                lifted.map(|time| time - LEAD_IN_S),
                "s",
                &height,
            ),
            Figure::number(
                "largest height of both wheels of one side",
                1e3 * worst.pair_clearance_m,
                "mm",
            ),
            Figure::flag("rolled over", trace.ended == Outcome::RolledOver),
            Figure::number("largest LTR", worst.ltr, ""),
            Figure::number("largest roll angle", worst.roll_rad / DEGREE, "deg"),
            Figure::number(
                "largest lateral acceleration",
                worst.lateral_acceleration_m_s2 / GRAVITY_M_S2,
                "g",
            ),
            Figure::number("largest sideslip angle", worst.sideslip_rad / DEGREE, "deg"),
        ];
        figures.extend(own);
        figures
    }
}
