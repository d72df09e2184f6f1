//! The driven vehicle as the controllers see it: steering wheel and target speed in, LTR out.

use anyhow::Result;
use deepc_core::controller::{Plant, PlantError};
use vehicle_dyn::driver::Driver;
use vehicle_dyn::metrics::{Outcome, OutcomeMonitor};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription, Location};
use vehicle_dyn::simulation::{Command, InitialPose, Observation, Simulation};
use vehicle_dyn::terrain::Terrain;

use crate::scenario::Scenario;

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
    seen: Observation,
    location: Location,
    sample_time_s: f64,
}

impl DrivenVehicle {
    /// Puts the vehicle at the start of the course, rolling at `speed_kmh`.
    ///
    /// # Errors
    /// When the vehicle or the course cannot be built.
    pub fn new(
        scenario: &Scenario,
        vehicle: &VehicleParameters,
        course: &CourseDescription,
        speed_kmh: f64,
    ) -> Result<Self> {
        let course = Course::new(course)?;
        let start = course.point(0.0);
        let pose = InitialPose {
            x_m: start.x_m,
            y_m: start.y_m,
            yaw_rad: start.heading_rad,
            speed_m_s: speed_kmh / 3.6,
        };
        let simulation = Simulation::new(vehicle, Terrain::flat(scenario.ground.friction), pose)?;
        let seen = simulation.observation();
        Ok(Self {
            location: course.locate(seen.x_m, seen.y_m, Some(0.0)),
            monitor: OutcomeMonitor::new(course.width_m()),
            driver: Driver::new(&scenario.driver_of(vehicle)?)?,
            sample_time_s: scenario.sample_time_s,
            seen,
            simulation,
            course,
        })
    }

    /// The steering-wheel angle the driver asks for now, deg. Call it once per step.
    pub fn driver_steering_deg(&mut self) -> f64 {
        self.driver
            .step(&self.course, &self.seen, self.sample_time_s)
            .handwheel_deg
    }

    /// What was measured at the end of the last step.
    #[must_use]
    pub fn observation(&self) -> &Observation {
        &self.seen
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
