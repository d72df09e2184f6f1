//! Double lane change between cones, driven by a driver.

use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::lanes::{LaneDescription, Outline, Track, TrackMonitor};
use super::range::{ordered, refused, within};
use super::report::{Bound, Curve, Figure, RunReport, Verdict, Warning};
use super::slowly_increasing_steer::{SlowlyIncreasingSteer, SteeringScale};
use super::trace::Trace;
use super::{Conclusion, ManoeuvreError};
use crate::driver::{Driver, DriverParameters};
use crate::metrics::Outcome;
use crate::road::Course;
use crate::simulation::{Command, LongitudinalDemand, Observation};
use crate::units::{DEGREE, GRAVITY_M_S2, KMH};

/// Straight ahead of the first lane, on which the vehicle settles, m.
const APPROACH_M: f64 = 30.0;
/// Path after the last lane, m.
const RUN_OUT_M: f64 = 100.0;
/// Way after the last lane at which a run ends, m.
const END_AFTER_M: f64 = 10.0;
/// A run takes at most so many times the time of the straight way.
const PATIENCE: f64 = 3.0;
/// Time between two decisions of the driver, s.
const DRIVER_TICK_S: f64 = 0.01;

/// Double lane change: `kind = "lane_change"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaneChange {
    /// The test that tells the driver how much handwheel this vehicle takes.
    pub slowly_increasing_steer: SlowlyIncreasingSteer,
    /// Speed at the begin of the first lane of the run that is reported first, km/h.
    pub entry_speed_kmh: f64,
    /// Whether the speed is held; otherwise the throttle is dropped.
    pub hold_speed: bool,
    /// Where the throttle is dropped, behind the begin of the first lane, m; not used while speed is
    /// held.
    pub throttle_drop_m: f64,
    /// The highest speed passed is sought from here, km/h.
    pub search_from_kmh: f64,
    /// And up to here, km/h.
    pub search_to_kmh: f64,
    /// The search ends when pass and fail are so close, km/h.
    pub search_resolution_kmh: f64,
    /// Lanes in driving order.
    pub lanes: Vec<LaneDescription>,
    /// Radius of a cone's foot, m.
    pub cone_radius_m: f64,
    /// The vehicle seen from above.
    pub outline: Outline,
    /// The driver, in terms that fit any vehicle.
    pub driver: LaneChangeDriver,
}

/// A driver that knows the vehicle: the gains follow from how much handwheel it takes.
///
/// With `G` the handwheel angle per steady lateral acceleration at the speed and `T` the preview
/// time, an offset `y` at the preview point asks for the arc that leads there: lateral acceleration
/// `2 y/T²`, handwheel `2 G/T²` per metre.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaneChangeDriver {
    /// Preview time, s.
    pub preview_time_s: f64,
    /// Handwheel at the preview point's offset, in parts of `2 G/T²` (no unit).
    pub preview_gain_factor: f64,
    /// Handwheel per speed of drifting, in parts of `G/T` (no unit).
    pub drift_gain_factor: f64,
    /// Time constant of the driver's arms, s.
    pub lag_s: f64,
    /// Largest handwheel rate of the driver, deg/s.
    pub handwheel_rate_limit_deg_per_s: f64,
    /// How far before a lane's end the path begins to leave its middle, m.
    pub path_lead_m: f64,
    /// By how much of the room beside the vehicle the path keeps to the side that it comes from (no
    /// unit); 0 is the middle of the lanes.
    pub path_inside_share: f64,
}

impl LaneChangeDriver {
    /// The driver of a vehicle that takes `handwheel_deg_s2_per_m` of handwheel per steady lateral
    /// acceleration, and whose handwheel ends at `handwheel_limit_deg`.
    #[must_use]
    pub fn parameters(
        &self,
        handwheel_deg_s2_per_m: f64,
        handwheel_limit_deg: f64,
    ) -> DriverParameters {
        let preview = self.preview_time_s;
        DriverParameters {
            preview_time_s: preview,
            preview_gain_deg_per_m: self.preview_gain_factor * 2.0 * handwheel_deg_s2_per_m
                / (preview * preview),
            error_rate_gain_deg_s_per_m: self.drift_gain_factor * handwheel_deg_s2_per_m / preview,
            integral_gain_deg_per_m_s: 0.0,
            lag_s: self.lag_s,
            handwheel_limit_deg,
            handwheel_rate_limit_deg_per_s: self.handwheel_rate_limit_deg_per_s,
        }
    }
}

/// Everything a run needs.
struct Setup {
    direction: &'static str,
    track: Track,
    course: Course,
    scale: SteeringScale,
}

impl LaneChange {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        self.slowly_increasing_steer.check()?;
        let driver = &self.driver;
        for (field, value, range, unit) in [
            (
                "entry_speed_kmh",
                self.entry_speed_kmh,
                [10.0, 250.0],
                "km/h",
            ),
            ("throttle_drop_m", self.throttle_drop_m, [0.0, 1000.0], "m"),
            (
                "search_from_kmh",
                self.search_from_kmh,
                [10.0, 250.0],
                "km/h",
            ),
            ("search_to_kmh", self.search_to_kmh, [10.0, 250.0], "km/h"),
            (
                "search_resolution_kmh",
                self.search_resolution_kmh,
                [0.01, 50.0],
                "km/h",
            ),
            ("cone_radius_m", self.cone_radius_m, [0.01, 1.0], "m"),
            (
                "driver.preview_time_s",
                driver.preview_time_s,
                [0.1, 5.0],
                "s",
            ),
            (
                "driver.preview_gain_factor",
                driver.preview_gain_factor,
                [0.01, 10.0],
                "",
            ),
            (
                "driver.drift_gain_factor",
                driver.drift_gain_factor,
                [0.0, 10.0],
                "",
            ),
            ("driver.lag_s", driver.lag_s, [0.0, 2.0], "s"),
            (
                "driver.handwheel_rate_limit_deg_per_s",
                driver.handwheel_rate_limit_deg_per_s,
                [1.0, 5000.0],
                "deg/s",
            ),
            ("driver.path_lead_m", driver.path_lead_m, [0.0, 50.0], "m"),
            (
                "driver.path_inside_share",
                driver.path_inside_share,
                [0.0, 1.0],
                "",
            ),
        ] {
            within(field, value, range, unit)?;
        }
        ordered(
            "search_from_kmh, search_to_kmh",
            self.search_from_kmh,
            self.search_to_kmh,
            "km/h",
        )?;
        self.outline.check()?;
        if self.lanes.len() < 2 {
            let found = format!("{} lanes", self.lanes.len());
            return Err(refused("lanes", &found, "at least two lanes"));
        }
        for (index, lane) in self.lanes.iter().enumerate() {
            lane.check(index)?;
        }
        for (index, pair) in self.lanes.windows(2).enumerate() {
            let end = pair[0].begin_m + pair[0].length_m;
            if pair[1].begin_m < end {
                let field = format!("lanes[{}].begin_m", index + 1);
                let allowed = format!("at least {end} m, where the lane before it ends");
                return Err(refused(&field, &pair[1].begin_m.to_string(), &allowed));
            }
        }
        Ok(())
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        let scale = self.slowly_increasing_steer.scale(bench)?;
        let width = self.outline.width_m(bench.vehicle);
        let mut passed = [Some(false); 2];
        let mut highest = [None; 2];
        let mut curves = Vec::new();
        for (index, (direction, sign)) in DIRECTIONS.into_iter().enumerate() {
            let track = Track::new(&self.lanes, width, APPROACH_M, self.cone_radius_m, sign);
            let course = track.path(
                self.driver.path_lead_m,
                self.driver.path_inside_share,
                RUN_OUT_M,
            )?;
            curves.extend(outline_curves(direction, &track, &course));
            let setup = Setup {
                direction,
                track,
                course,
                scale,
            };
            passed[index] = Some(self.attempt(bench, &setup, self.entry_speed_kmh)?);
            highest[index] = self.highest_passed(bench, &setup)?;
        }
        let mut figures = vec![
            Figure::number("width of the vehicle", width, "m")
                .noted("wider track and width_beyond_track_m: the vehicle file has no body"),
        ];
        let none = format!("not even {} km/h is passed", self.search_from_kmh);
        for (speed, (direction, _)) in highest.into_iter().zip(DIRECTIONS) {
            let name = format!("highest speed passed, first to the {direction}");
            figures.push(Figure::optional(&name, speed, "km/h", &none));
        }
        let lowest = highest.iter().flatten().copied().reduce(f64::min);
        let both = lowest.filter(|_| highest.iter().all(Option::is_some));
        figures.push(Figure::optional(
            "highest speed passed in both directions",
            both,
            "km/h",
            &none,
        ));
        figures.extend(self.at_entry_speed(&bench.runs));
        Ok(Conclusion {
            figures,
            curves,
            verdict: Verdict {
                passed: super::report::all_of(passed.into_iter()),
                rule: format!(
                    "at {} km/h no cone is hit, no lane left, no two-wheel lift, no spin, in both directions",
                    self.entry_speed_kmh
                ),
            },
        })
    }

    fn at_entry_speed(&self, runs: &[RunReport]) -> Vec<Figure> {
        let name = run_name(DIRECTIONS[0].0, self.entry_speed_kmh);
        let Some(run) = runs.iter().find(|run| run.name == name) else {
            return Vec::new();
        };
        ["cones hit", "largest LTR", "largest lateral acceleration"]
            .into_iter()
            .filter_map(|figure| run.figure(figure))
            .map(|figure| Figure {
                name: format!("{} at {} km/h", figure.name, self.entry_speed_kmh),
                ..figure.clone()
            })
            .collect()
    }

    /// The highest speed passed, by bisection; `None` when the lowest is not.
    ///
    /// Bisection takes for granted that what passes at a speed passes at every lower one.
    fn highest_passed(
        &self,
        bench: &mut Bench<'_>,
        setup: &Setup,
    ) -> Result<Option<f64>, ManoeuvreError> {
        let (mut pass, mut fail) = (self.search_from_kmh, self.search_to_kmh);
        if !self.attempt(bench, setup, pass)? {
            return Ok(None);
        }
        if self.attempt(bench, setup, fail)? {
            bench.warnings.push(Warning::NotReached {
                what: format!(
                    "first to the {}: the end of the search, {fail} km/h, is passed: raise search_to_kmh to find the limit",
                    setup.direction
                ),
            });
            return Ok(Some(fail));
        }
        while fail - pass > self.search_resolution_kmh {
            let speed = 0.5 * (pass + fail);
            if self.attempt(bench, setup, speed)? {
                pass = speed;
            } else {
                fail = speed;
            }
        }
        Ok(Some(pass))
    }

    /// Drives the track once at a speed and keeps the run. Returns whether it passed.
    fn attempt(
        &self,
        bench: &mut Bench<'_>,
        setup: &Setup,
        speed_kmh: f64,
    ) -> Result<bool, ManoeuvreError> {
        let name = run_name(setup.direction, speed_kmh);
        if let Some(known) = bench.runs.iter().find(|run| run.name == name) {
            return Ok(known.passed() == Some(true));
        }
        let speed = speed_kmh * KMH;
        let parameters = self.driver_parameters(bench, setup, speed);
        let mut driver = Driver::new(&parameters)?;
        let mut monitor = TrackMonitor::new(&setup.track, bench.vehicle, &self.outline);
        let end_m = setup.track.end_m() + END_AFTER_M;
        let longest_s = PATIENCE * end_m / speed;
        let mut next_decision_s = 0.0;
        // Between two decisions the hands move evenly: from one angle to the next, rad.
        let mut hands = [0.0_f64; 2];
        let (mut off_path_m, mut entry_speed) = (0.0_f64, None);
        let mut plan = |seen: &Observation, tick_s: f64| -> Option<Command> {
            monitor.observe(seen);
            let in_track_m = seen.x_m - APPROACH_M;
            if in_track_m >= 0.0 {
                entry_speed.get_or_insert(seen.speed_m_s);
            }
            if seen.x_m > end_m || seen.time_s > longest_s {
                return None;
            }
            // Half a tick less, so that rounding does not shift a decision.
            if seen.time_s >= next_decision_s - 0.5 * tick_s {
                let action = driver.step(&setup.course, seen, DRIVER_TICK_S);
                hands = [hands[1], action.handwheel_deg * DEGREE];
                off_path_m = off_path_m.max(action.location.lateral_offset_m.abs());
                next_decision_s += DRIVER_TICK_S;
            }
            let coast = !self.hold_speed && in_track_m >= self.throttle_drop_m;
            let pedals = if coast {
                LongitudinalDemand::Released
            } else {
                LongitudinalDemand::TargetSpeed(speed)
            };
            let left =
                ((next_decision_s - seen.time_s - 0.5 * tick_s) / DRIVER_TICK_S).clamp(0.0, 1.0);
            Some(steer(hands[1] + (hands[0] - hands[1]) * left, pedals))
        };
        let trace = bench.drive(&name, speed, &mut plan)?;
        let at_end = trace.rows.last().is_some_and(|row| row.seen.x_m > end_m);
        let figures = figures(&trace, &monitor, at_end, entry_speed, off_path_m);
        bench.keep(trace, figures)?;
        Ok(bench.runs.last().and_then(RunReport::passed) == Some(true))
    }

    fn driver_parameters(
        &self,
        bench: &Bench<'_>,
        setup: &Setup,
        speed_m_s: f64,
    ) -> DriverParameters {
        let vehicle = bench.vehicle;
        // Degrees of road wheel per g: what the turn needs, and what understeer adds.
        let turn = vehicle.derived().wheelbase_m * GRAVITY_M_S2 / (speed_m_s * speed_m_s) / DEGREE;
        // An oversteering vehicle beyond its critical speed would turn the sign.
        let road_wheel = (turn + setup.scale.understeer_deg_per_g).max(0.2 * turn);
        let handwheel = vehicle.steering.ratio * road_wheel / GRAVITY_M_S2;
        self.driver
            .parameters(handwheel, vehicle.steering.handwheel_limit_deg)
    }
}

fn run_name(direction: &str, speed_kmh: f64) -> String {
    format!("{direction}-{speed_kmh:.2}-kmh")
}

fn figures(
    trace: &Trace,
    monitor: &TrackMonitor,
    at_end: bool,
    entry_speed_m_s: Option<f64>,
    off_path_m: f64,
) -> Vec<Figure> {
    const RULE: &str = "this project's reading of ISO 3888, which sets the track and no limit";
    let worst = &trace.extremes;
    let exit = trace.rows.last().map(|row| row.seen.speed_m_s / KMH);
    let entry = entry_speed_m_s.map(|speed| speed / KMH);
    vec![
        Figure::optional(
            "entry speed",
            entry,
            "km/h",
            "the vehicle did not get to the first lane",
        ),
        Figure::optional("speed at the end", exit, "km/h", "no row"),
        Figure::number("cones hit", monitor.cones_hit() as f64, "")
            .required(Bound::AtMost(0.0), RULE),
        Figure::number("largest lane excursion", monitor.excursion_m(), "m")
            .required(Bound::AtMost(0.0), RULE),
        Figure::flag("two-wheel lift", worst.two_wheel_lift_s.is_some())
            .required(Bound::Answer(false), RULE),
        Figure::flag("all lanes driven", at_end).required(Bound::Answer(true), RULE),
        Figure::flag("kept its direction", trace.ended == Outcome::Completed)
            .required(Bound::Answer(true), RULE),
        Figure::number("largest distance from the path", off_path_m, "m"),
        Figure::number("largest LTR", worst.ltr, ""),
        Figure::number(
            "largest height of both wheels of one side",
            1e3 * worst.pair_clearance_m,
            "mm",
        ),
        Figure::number("largest roll angle", worst.roll_rad / DEGREE, "deg"),
        Figure::number(
            "largest lateral acceleration",
            worst.lateral_acceleration_m_s2 / GRAVITY_M_S2,
            "g",
        ),
        Figure::number("largest sideslip angle", worst.sideslip_rad / DEGREE, "deg"),
    ]
}

/// Lanes and path as a picture needs them.
fn outline_curves(direction: &str, track: &Track, course: &Course) -> Vec<Curve> {
    let curve = |what: String, points: Vec<[f64; 2]>| Curve {
        name: format!("{what}, first to the {direction}"),
        x: "x / m".into(),
        y: "y / m".into(),
        points,
    };
    let mut curves = Vec::new();
    for (index, lane) in track.lanes.iter().enumerate() {
        for (side, y) in [("right", lane.right_m), ("left", lane.left_m)] {
            let points = vec![[lane.begin_m, y], [lane.end_m, y]];
            curves.push(curve(format!("{side} edge of lane {}", index + 1), points));
        }
    }
    let end = track.end_m() + END_AFTER_M;
    // A few hundred metres at most.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let count = end.ceil() as u32;
    let path = (0..=count).map(|station| course.point(f64::from(station)));
    curves.push(curve(
        "path".into(),
        path.map(|point| [point.x_m, point.y_m]).collect(),
    ));
    curves
}
