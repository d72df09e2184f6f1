//! Sine with dwell: does the vehicle come straight again, and does it answer at all?

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{ordered, within};
use super::report::{Bound, Figure, RunReport, Verdict, Warning, all_of};
use super::signal::{double_integral, first_peak, first_reach, value_at};
use super::slowly_increasing_steer::SlowlyIncreasingSteer;
use super::steering::SineWithDwell as Wave;
use super::trace::Trace;
use super::{Conclusion, LEAD_IN_S, ManoeuvreError};
use crate::metrics::Outcome;
use crate::simulation::{LongitudinalDemand, Observation};
use crate::units::{DEGREE, KMH};

/// The sine with dwell: `kind = "sine_with_dwell"`. Amplitudes rise in steps of the handwheel angle
/// A that slowly increasing steer finds; the vehicle coasts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SineWithDwell {
    /// The test that gives A.
    pub slowly_increasing_steer: SlowlyIncreasingSteer,
    /// Speed at the start of steering, km/h.
    pub speed_kmh: f64,
    /// Frequency of the sine, Hz.
    pub frequency_hz: f64,
    /// Dwell at the second peak, s.
    pub dwell_s: f64,
    /// First amplitude in multiples of A (no unit).
    pub first_multiple: f64,
    /// Step of the amplitude in multiples of A (no unit).
    pub multiple_step: f64,
    /// Last amplitude in multiples of A (no unit), unless the next two say otherwise.
    pub last_multiple: f64,
    /// The last amplitude is at least this, deg.
    pub last_amplitude_least_deg: f64,
    /// The last amplitude is at most this, deg.
    pub last_amplitude_most_deg: f64,
    /// Handwheel angle at which steering counts as begun, deg.
    pub begin_of_steer_deg: f64,
    /// First time after completion of steer at which the yaw rate is read, s.
    pub first_yaw_time_s: f64,
    /// Largest yaw rate there, in percent of its peak.
    pub first_yaw_percent: f64,
    /// Second time after completion of steer, s.
    pub second_yaw_time_s: f64,
    /// Largest yaw rate there, in percent of its peak.
    pub second_yaw_percent: f64,
    /// Time after the begin of steer at which the lateral displacement is read, s.
    pub displacement_time_s: f64,
    /// Least displacement of a vehicle up to the mass limit, m.
    pub displacement_light_m: f64,
    /// Least displacement of a heavier vehicle, m.
    pub displacement_heavy_m: f64,
    /// Gross mass up to which a vehicle is light here, kg. The vehicle file has no gross vehicle
    /// weight rating, so its mass as it stands is compared.
    pub light_mass_limit_kg: f64,
    /// Least amplitude, in multiples of A, for which the displacement is judged (no unit).
    pub displacement_from_multiple: f64,
    /// Largest mass in the scope of the standard, kg.
    pub scope_mass_limit_kg: f64,
}

/// Where the demands come from.
const YAW_SOURCE: &str = "FMVSS 126, S5.2.1 and S5.2.2";
const DISPLACEMENT_SOURCE: &str = "FMVSS 126, S5.2.3";
/// Nothing within this time around the yaw-rate peak is larger: no ripple is taken for it.
const PEAK_GUARD_S: f64 = 0.05;
/// Share of the amplitude to which the handwheel must have come back for completion of steer. An
/// actuator with lag nears zero without end.
const COMPLETION_SHARE: f64 = 0.01;

impl SineWithDwell {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        self.slowly_increasing_steer.check()?;
        let times = [0.01, 10.0];
        let percents = [0.1, 1000.0];
        let multiples = [0.1, 20.0];
        let displacements = [0.0, 20.0];
        let masses = [1.0, 1e5];
        for (field, value, range, unit) in [
            ("speed_kmh", self.speed_kmh, [10.0, 250.0], "km/h"),
            ("frequency_hz", self.frequency_hz, [0.1, 5.0], "Hz"),
            ("dwell_s", self.dwell_s, [0.0, 10.0], "s"),
            ("first_multiple", self.first_multiple, multiples, ""),
            ("multiple_step", self.multiple_step, [0.05, 20.0], ""),
            ("last_multiple", self.last_multiple, multiples, ""),
            (
                "last_amplitude_least_deg",
                self.last_amplitude_least_deg,
                [0.0, 2000.0],
                "deg",
            ),
            (
                "begin_of_steer_deg",
                self.begin_of_steer_deg,
                [0.1, 100.0],
                "deg",
            ),
            ("first_yaw_time_s", self.first_yaw_time_s, times, "s"),
            ("second_yaw_time_s", self.second_yaw_time_s, times, "s"),
            ("first_yaw_percent", self.first_yaw_percent, percents, "%"),
            ("second_yaw_percent", self.second_yaw_percent, percents, "%"),
            ("displacement_time_s", self.displacement_time_s, times, "s"),
            (
                "displacement_light_m",
                self.displacement_light_m,
                displacements,
                "m",
            ),
            (
                "displacement_heavy_m",
                self.displacement_heavy_m,
                displacements,
                "m",
            ),
            (
                "light_mass_limit_kg",
                self.light_mass_limit_kg,
                masses,
                "kg",
            ),
            (
                "displacement_from_multiple",
                self.displacement_from_multiple,
                multiples,
                "",
            ),
            (
                "scope_mass_limit_kg",
                self.scope_mass_limit_kg,
                masses,
                "kg",
            ),
        ] {
            within(field, value, range, unit)?;
        }
        ordered(
            "last_amplitude_least_deg, last_amplitude_most_deg",
            self.last_amplitude_least_deg,
            self.last_amplitude_most_deg,
            "deg",
        )
    }

    /// Amplitudes of one series for a handwheel angle A of `angle_deg`, rising, deg.
    #[must_use]
    pub fn amplitudes_deg(&self, angle_deg: f64) -> Vec<f64> {
        let most = self.last_amplitude_most_deg;
        let last = (self.last_multiple * angle_deg)
            .max(self.last_amplitude_least_deg)
            .min(most);
        let mut amplitudes: Vec<f64> = (0_u32..1000)
            .map(|step| angle_deg * (self.first_multiple + self.multiple_step * f64::from(step)))
            // Rounding must not make a run of its own out of the last one.
            .take_while(|amplitude| *amplitude < last - 1e-6)
            .collect();
        amplitudes.push(last);
        amplitudes
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let mass = bench.vehicle.derived().total_mass_kg;
        if mass > self.scope_mass_limit_kg {
            bench.warnings.push(Warning::OutOfScope {
                what: format!(
                    "the vehicle's mass of {mass:.0} kg is beyond the standard's scope of {} kg",
                    self.scope_mass_limit_kg
                ),
            });
        }
        let sub_test = &self.slowly_increasing_steer;
        let scale = sub_test.scale(bench)?;
        let mut figures = scale.figures(sub_test.target_lateral_acceleration_g);
        let before = bench.runs.len();
        for (direction, sign) in DIRECTIONS {
            for amplitude in self.amplitudes_deg(scale.angle_deg) {
                let name = format!("{direction}-{amplitude:.1}-deg");
                let trace = self.drive(bench, &name, sign, amplitude)?;
                let judged = self.figures(&trace, sign, amplitude, scale.angle_deg, mass);
                bench.keep(trace, judged)?;
            }
        }
        let runs = &bench.runs[before..];
        figures.extend(worst(runs, "yaw rate ratio", f64::max, "largest"));
        figures.extend(worst(
            runs,
            "lateral displacement",
            f64::min,
            "least judged",
        ));
        Ok(Conclusion {
            figures,
            curves: Vec::new(),
            verdict: Verdict {
                passed: all_of(runs.iter().map(RunReport::passed)),
                rule: "every run stays on its wheels, its yaw rate has died down at both times, and from 5A on it is displaced far enough".into(),
            },
        })
    }

    fn drive(
        &self,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
        amplitude_deg: f64,
    ) -> Result<Trace, ManoeuvreError> {
        let wave = Wave {
            amplitude_deg,
            frequency_hz: self.frequency_hz,
            dwell_s: self.dwell_s,
        };
        let speed = self.speed_kmh * KMH;
        // Completion of steer comes later than that of the command by the actuator's lag.
        let after_s = 0.5 + self.first_yaw_time_s.max(self.second_yaw_time_s);
        let end_s = LEAD_IN_S + wave.end_s() + after_s;
        let mut plan = |seen: &Observation, tick_s: f64| {
            let since_s = seen.time_s + 0.5 * tick_s - LEAD_IN_S;
            let pedals = if since_s < 0.0 {
                LongitudinalDemand::TargetSpeed(speed)
            } else {
                LongitudinalDemand::Released
            };
            (seen.time_s < end_s).then(|| steer(sign * wave.at(since_s) * DEGREE, pedals))
        };
        bench.drive(name, speed, &mut plan)
    }

    /// Figures of one run of either direction, from its trace alone. `sign` is that of the first
    /// turn, `angle_deg` is A, `mass_kg` that of the vehicle.
    #[must_use]
    pub fn figures(
        &self,
        trace: &Trace,
        sign: f64,
        amplitude_deg: f64,
        angle_deg: f64,
        mass_kg: f64,
    ) -> Vec<Figure> {
        let handwheel = trace.signal(|row| sign * row.seen.handwheel_actual_deg());
        let begin = first_reach(&handwheel, self.begin_of_steer_deg, 0.0);
        let mirrored = trace.signal(|row| -sign * row.seen.handwheel_actual_deg());
        let sign_change = begin.and_then(|begin| first_reach(&mirrored, 0.0, begin));
        let turned_back =
            sign_change.and_then(|from| first_reach(&mirrored, 0.5 * amplitude_deg, from));
        let level = -COMPLETION_SHARE * amplitude_deg;
        let completion = turned_back.and_then(|from| first_reach(&handwheel, level, from));
        let yaw_rate = trace.signal(|row| -sign * row.seen.yaw_rate_rad_s / DEGREE);
        let peak = sign_change
            .and_then(|from| first_peak(&yaw_rate, from, PEAK_GUARD_S))
            .map(|peak| peak.1);
        let ratio = |after_s: f64| {
            let rate = value_at(&yaw_rate, completion? + after_s)?;
            Some(100.0 * rate / peak?)
        };
        let ratio_figure = |time_s: f64, limit: f64| {
            Figure::optional(
                &format!("yaw rate ratio {time_s:.2} s after completion of steer"),
                ratio(time_s),
                "%",
                "the run has no second peak of yaw rate, or ended before",
            )
            .required(Bound::AtMost(limit), YAW_SOURCE)
        };
        let multiple = amplitude_deg / angle_deg;
        let missing = "the steering did not begin, or the run ended before";
        let acceleration = trace.signal(|row| sign * row.seen.lateral_acceleration_m_s2);
        let reading = begin.map(|begin| begin + self.displacement_time_s);
        let integrated = begin.and_then(|begin| {
            double_integral(&acceleration, begin, begin + self.displacement_time_s)
        });
        let path = trace.signal(|row| sign * row.seen.y_m);
        let moved = reading
            .zip(begin)
            .and_then(|(to, from)| Some(value_at(&path, to)? - value_at(&path, from)?));
        let mut displacement = Figure::optional(
            &format!(
                "lateral displacement {:.2} s after begin of steer",
                self.displacement_time_s
            ),
            integrated,
            "m",
            missing,
        );
        // A hair below 5.0 from the rounding of A is still that run.
        if multiple >= self.displacement_from_multiple - 1e-6 {
            let least = if mass_kg <= self.light_mass_limit_kg {
                self.displacement_light_m
            } else {
                self.displacement_heavy_m
            };
            displacement = displacement.required(Bound::AtLeast(least), DISPLACEMENT_SOURCE);
        }
        vec![
            Figure::number("amplitude", amplitude_deg, "deg"),
            Figure::number("amplitude in multiples of A", multiple, ""),
            ratio_figure(self.first_yaw_time_s, self.first_yaw_percent),
            ratio_figure(self.second_yaw_time_s, self.second_yaw_percent),
            displacement,
            Figure::optional("lateral displacement of the path", moved, "m", missing),
            Figure::optional(
                "second peak of yaw rate",
                peak,
                "deg/s",
                "the yaw rate has no second peak",
            ),
            Figure::number("largest LTR", trace.extremes.ltr, ""),
            Figure::number(
                "largest roll angle",
                trace.extremes.roll_rad / DEGREE,
                "deg",
            ),
            Figure::number(
                "largest sideslip angle",
                trace.extremes.sideslip_rad / DEGREE,
                "deg",
            ),
            Figure::flag("stayed on its wheels", trace.ended != Outcome::RolledOver).required(
                Bound::Answer(true),
                "implied by FMVSS 126: a run that rolls over is over",
            ),
        ]
    }
}

/// The worst of the judged figures whose name begins so, over all runs.
fn worst(runs: &[RunReport], begin: &str, pick: fn(f64, f64) -> f64, word: &str) -> Vec<Figure> {
    let mut names: Vec<&str> = Vec::new();
    let figures = || {
        runs.iter()
            .flat_map(|run| &run.figures)
            .filter(|figure| figure.requirement.is_some() && figure.name.starts_with(begin))
    };
    for figure in figures() {
        if !names.contains(&figure.name.as_str()) {
            names.push(&figure.name);
        }
    }
    names
        .into_iter()
        .filter_map(|name| {
            let mut same = figures().filter(|figure| figure.name == name);
            let first = same.clone().next()?;
            let requirement = first.requirement.clone()?;
            let value = same.by_ref().filter_map(Figure::as_number).reduce(pick);
            let title = format!("{word} {name}");
            Some(
                Figure::optional(&title, value, &first.unit, "no run gives it")
                    .required(requirement.bound, &requirement.source),
            )
        })
        .collect()
}
