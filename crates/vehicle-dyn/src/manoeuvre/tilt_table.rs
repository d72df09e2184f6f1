//! Tilt table: at which angle does a standing vehicle tip over?

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::bench::{Bench, DIRECTIONS, steer};
use super::range::{refused, within};
use super::report::{Figure, Verdict};
use super::trace::Trace;
use super::{Conclusion, ManoeuvreError};
use crate::parameters::VehicleParameters;
use crate::simulation::{LongitudinalDemand, Observation, Simulation};
use crate::units::{DEGREE, GRAVITY_M_S2};

/// Tilt table: `kind = "tilt_table"`. A table that tilts is gravity that turns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TiltTable {
    /// Rate of the table, deg/s.
    pub tilt_rate_deg_per_s: f64,
    /// Angle at which the test ends at the latest, deg.
    pub largest_angle_deg: f64,
}

const AXLES: [&str; 2] = ["front", "rear"];
/// Steps of the iteration for the leaning vehicle; each gains a digit or more.
const LEAN_STEPS: usize = 60;

impl TiltTable {
    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        if !(self.tilt_rate_deg_per_s > 0.0 && self.tilt_rate_deg_per_s <= 5.0) {
            let found = self.tilt_rate_deg_per_s.to_string();
            return Err(refused("tilt_rate_deg_per_s", &found, "in (0, 5] deg/s"));
        }
        within(
            "largest_angle_deg",
            self.largest_angle_deg,
            [1.0, 85.0],
            "deg",
        )
    }

    pub(super) fn run(&self, bench: &mut Bench<'_>) -> Result<Conclusion, ManoeuvreError> {
        for (direction, sign) in DIRECTIONS {
            let name = format!("tilt-{direction}");
            let mut simulation = bench.rolling(&name, 0.0)?;
            let trace = self.drive(bench, &name, sign, &mut simulation)?;
            let figures = self.figures(&trace, sign, bench.vehicle);
            bench.keep(trace, figures)?;
        }
        let figures = bench
            .runs
            .first()
            .map_or_else(Vec::new, |run| run.figures.clone());
        Ok(Conclusion {
            figures,
            curves: Vec::new(),
            verdict: Verdict {
                passed: None,
                rule: "the tilt table measures and has no limit".into(),
            },
        })
    }

    /// `sign` is that of the side that goes up: for the left one the body leans to the right, as in
    /// a turn to the left.
    fn drive(
        &self,
        bench: &mut Bench<'_>,
        name: &str,
        sign: f64,
        simulation: &mut Simulation,
    ) -> Result<Trace, ManoeuvreError> {
        let mut plan = |seen: &Observation, _tick_s: f64| {
            let angle = self.tilt_rate_deg_per_s * seen.time_s;
            (angle < self.largest_angle_deg && !seen.two_wheel_lift())
                .then(|| steer(0.0, LongitudinalDemand::TargetSpeed(0.0)))
        };
        let rate = self.tilt_rate_deg_per_s * DEGREE;
        bench.drive_from(name, simulation, &mut plan, &mut |simulation, tick_s| {
            let angle = rate * (simulation.time_s() + 0.5 * tick_s);
            let down = Vector3::new(0.0, -sign * angle.sin(), -angle.cos());
            simulation.set_gravity_m_s2(down * GRAVITY_M_S2)
        })
    }

    /// Figures of one side from its trace alone.
    #[must_use]
    pub fn figures(&self, trace: &Trace, sign: f64, vehicle: &VehicleParameters) -> Vec<Figure> {
        // Wheels of the side that goes up.
        let up = if sign > 0.0 { [0, 2] } else { [1, 3] };
        let angle_deg = |time_s: f64| self.tilt_rate_deg_per_s * time_s;
        let lifts = up.map(|wheel| {
            trace
                .rows
                .iter()
                .find(|row| row.seen.wheel_loads_n[wheel] <= 0.0)
                .map(|row| angle_deg(row.seen.time_s))
        });
        let both = trace.extremes.unloaded_side_s.map(angle_deg);
        let none = format!("no lift up to {} deg", self.largest_angle_deg);
        let rigid = rigid_lift_angle_deg(vehicle);
        let leaning = leaning_lift_angle_deg(vehicle);
        let mut figures: Vec<Figure> = AXLES
            .into_iter()
            .zip(lifts)
            .map(|(axle, lift)| {
                Figure::optional(
                    &format!("tilt angle at lift of the {axle} wheel"),
                    lift,
                    "deg",
                    &none,
                )
            })
            .collect();
        let front_first = match lifts {
            [Some(front), Some(rear)] => Some(front < rear),
            [Some(_), None] => Some(true),
            [None, Some(_)] => Some(false),
            [None, None] => None,
        };
        if let Some(front_first) = front_first {
            figures.push(Figure::flag("the front axle lifts first", front_first));
        }
        let unsettled = "the leaning vehicle tips at no angle by this formula";
        figures.extend([
            Figure::optional("tilt angle at lift of both wheels", both, "deg", &none),
            Figure::optional(
                "tilt table ratio",
                both.map(|angle| (angle * DEGREE).tan()),
                "",
                &none,
            ),
            Figure::number("lift angle of a rigid vehicle", rigid, "deg")
                .noted("atan(T/2h) with the track where the centre of gravity is"),
            Figure::optional(
                "lift angle of a vehicle that leans",
                leaning,
                "deg",
                unsettled,
            )
            .noted("linear springs, bars and tyres; no stops, no jacking"),
            Figure::optional(
                "lift angle over that of a rigid vehicle",
                both.map(|angle| angle / rigid),
                "",
                &none,
            ),
            Figure::optional(
                "roll angle of the body against the table at lift",
                both.and(trace.rows.last())
                    .map(|row| sign * row.seen.roll_rad / DEGREE),
                "deg",
                &none,
            ),
        ]);
        figures
    }
}

/// Half the track at the station of the centre of gravity, m.
fn half_track_m(vehicle: &VehicleParameters) -> f64 {
    let derived = vehicle.derived();
    let share = derived.cg_to_front_axle_m / derived.wheelbase_m;
    let geometry = &vehicle.geometry;
    0.5 * (geometry.track_front_m * (1.0 - share) + geometry.track_rear_m * share)
}

/// `atan(T/2h)`: the tilt angle at which a rigid vehicle tips, deg.
#[must_use]
pub fn rigid_lift_angle_deg(vehicle: &VehicleParameters) -> f64 {
    (half_track_m(vehicle) / vehicle.derived().cg_height_m).atan() / DEGREE
}

/// The tilt angle at which a vehicle tips whose body leans on its springs and whose tyres give,
/// in linear theory, deg: `tan α = (T/2 − Δy)/h`, where Δy is how far the centre of gravity moves to
/// the low side at α. `None` when there is no such angle.
#[must_use]
pub fn leaning_lift_angle_deg(vehicle: &VehicleParameters) -> Option<f64> {
    let (derived, geometry) = (vehicle.derived(), &vehicle.geometry);
    let (mass, sprung) = (derived.total_mass_kg, vehicle.mass.sprung_mass_kg);
    let (height, half_track) = (derived.cg_height_m, half_track_m(vehicle));
    // Height of the sprung centre of gravity over the roll axis.
    let wheelbase = derived.wheelbase_m;
    let share = geometry.sprung_cg_to_front_axle_m / wheelbase;
    let axis = geometry.roll_centre_height_front_m * (1.0 - share)
        + geometry.roll_centre_height_rear_m * share;
    let arm = vehicle.mass.sprung_cg_height_m - axis;
    let springs = derived.roll_stiffness_front_nm_per_rad + derived.roll_stiffness_rear_nm_per_rad;
    let tyres = 0.5
        * (vehicle.tyre.vertical_stiffness_front_n_per_m * geometry.track_front_m.powi(2)
            + vehicle.tyre.vertical_stiffness_rear_n_per_m * geometry.track_rear_m.powi(2));
    let mut angle = (half_track / height).atan();
    for _ in 0..LEAN_STEPS {
        let (sin, cos) = angle.sin_cos();
        let left = springs - sprung * GRAVITY_M_S2 * arm * cos;
        let left_tyres = tyres - mass * GRAVITY_M_S2 * height * cos;
        if left <= 0.0 || left_tyres <= 0.0 {
            return None;
        }
        let lean = sprung * GRAVITY_M_S2 * arm * sin / left;
        let tyre_lean = mass * GRAVITY_M_S2 * height * sin / left_tyres;
        let moved = arm * lean * sprung / mass + height * tyre_lean;
        angle = ((half_track - moved) / height).atan();
    }
    (angle > 0.0).then_some(angle / DEGREE)
}
