//! The driven vehicle as the controllers see it: steering wheel and target speed in, LTR out.
//!
//! As a [`Plant`] it gives the true LTR. [`DrivenVehicle::measured_ltr`] is what the scenario's sensor
//! makes of it, which may be lost; the driver steers by the measured speed, heading and position.

use anyhow::Result;
use deepc_core::controller::{Plant, PlantError};
use vehicle_dyn::driver::Driver;
use vehicle_dyn::metrics::{LoadTransferIndex, Outcome, OutcomeMonitor};
use vehicle_dyn::road::{Course, CourseDescription, Location};
use vehicle_dyn::sensors::{Channel, Sensors, derived_seed};
use vehicle_dyn::simulation::{Command, InitialPose, Observation, ReadyVehicle, Simulation};
use vehicle_dyn::terrain::Terrain;

use crate::scenario::{DRIVER_CHANNELS, Scenario};

/// Number of inputs: steering-wheel angle (deg) and target speed (km/h).
pub const INPUTS: usize = 2;
/// Number of outputs: LTR.
pub const OUTPUTS: usize = 1;

/// A vehicle on a course with its driver.
pub struct DrivenVehicle {
    simulation: Simulation,
    course: Course,
    driver: Driver,
    monitor: OutcomeMonitor,
    load_transfer: LoadTransferIndex,
    sensors: Sensors,
    seen: Observation,
    measured: Observation,
    /// What the driver knows: the measured state, a lost channel as it was last.
    known: Observation,
    location: Location,
    sample_time_s: f64,
}

impl DrivenVehicle {
    /// Puts the vehicle at the start of the course on its terrain, rolling at `speed_kmh`. The sensors' random
    /// numbers come from `seed` and from `purpose`, so that a run and the recording it works from
    /// differ.
    ///
    /// # Errors
    /// When the vehicle, the course or a sensor cannot be built, or the terrain is smaller than the
    /// course.
    pub fn new(
        scenario: &Scenario,
        vehicle: &ReadyVehicle,
        course: &CourseDescription,
        terrain: Terrain,
        speed_kmh: f64,
        (seed, purpose): (u64, &str),
    ) -> Result<Self> {
        let course = Course::new(course)?;
        terrain.check_covers(&course)?;
        let start = course.point(0.0);
        let pose = InitialPose {
            x_m: start.x_m,
            y_m: start.y_m,
            yaw_rad: start.heading_rad,
            speed_m_s: speed_kmh / 3.6,
        };
        let simulation = vehicle.simulation(terrain, pose)?;
        let vehicle = vehicle.parameters();
        let seen = simulation.observation();
        let mut sensors = Sensors::new(
            &scenario.sensors,
            scenario.sample_time_s,
            derived_seed(seed, purpose),
        )?;
        let mut driven = Self {
            location: course.locate(seen.x_m, seen.y_m, Some(0.0)),
            monitor: OutcomeMonitor::new(course.width_m()),
            driver: Driver::new(&scenario.driver_of(vehicle)?)?,
            sample_time_s: scenario.sample_time_s,
            load_transfer: LoadTransferIndex::new(vehicle),
            measured: sensors.measure(&seen),
            // At the start the driver knows where he stands.
            known: seen,
            sensors,
            seen,
            simulation,
            course,
        };
        driven.learn();
        Ok(driven)
    }

    /// The driver takes over what was measured.
    fn learn(&mut self) {
        let before = self.known;
        self.known = self.measured;
        for channel in DRIVER_CHANNELS {
            let value = channel.field(&mut self.known);
            if !value.is_finite() {
                *value = channel.value(&before);
            }
        }
    }

    /// The steering-wheel angle the driver asks for now, deg. Call it once per step.
    pub fn driver_steering_deg(&mut self) -> f64 {
        self.driver
            .step(&self.course, &self.known, self.sample_time_s)
            .handwheel_deg
    }

    /// The true state at the end of the last step.
    #[must_use]
    pub fn observation(&self) -> &Observation {
        &self.seen
    }

    /// What the sensor read of the LTR at the end of the last step; not a number if the sample was
    /// lost.
    #[must_use]
    pub fn measured_ltr(&self) -> f64 {
        Channel::LoadTransferRatio.value(&self.measured)
    }

    /// The load-transfer index of the true state.
    #[must_use]
    pub fn load_transfer_index(&self) -> f64 {
        self.load_transfer.index(
            self.seen.roll_rad,
            self.seen.roll_rate_rad_s,
            self.seen.lateral_acceleration_m_s2,
        )
    }

    /// When the state could not be judged, s ([`OutcomeMonitor::not_finite_s`]).
    #[must_use]
    pub fn not_finite_s(&self) -> Option<f64> {
        self.monitor.not_finite_s()
    }

    /// Where the vehicle is on the course.
    #[must_use]
    pub fn location(&self) -> &Location {
        &self.location
    }

    /// Whether the run is over: the vehicle has rolled over or spun out.
    #[must_use]
    pub fn ended(&self) -> bool {
        self.monitor.ended()
    }

    /// The outcome so far.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        self.monitor.outcome()
    }
}

impl Plant for DrivenVehicle {
    fn inputs(&self) -> usize {
        INPUTS
    }

    fn outputs(&self) -> usize {
        OUTPUTS
    }

    fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        let command = Command::from_deg_kmh(input[0], input[1]);
        self.seen = self
            .simulation
            .step(command, self.sample_time_s)
            .map_err(PlantError::new)?;
        self.measured = self.sensors.measure(&self.seen);
        self.learn();
        self.location =
            self.course
                .locate(self.seen.x_m, self.seen.y_m, Some(self.location.station_m));
        self.monitor
            .observe(&self.seen, self.location.lateral_offset_m);
        // A driver whose wheel is held by someone else must not go on learning from it.
        self.driver.notify_applied(input[0], DRIVER_NOTICES_DEG);
        output[0] = self.seen.ltr;
        Ok(())
    }
}

/// Difference between the driver's and the applied steering-wheel angle that a driver notices.
const DRIVER_NOTICES_DEG: f64 = 1.0;
