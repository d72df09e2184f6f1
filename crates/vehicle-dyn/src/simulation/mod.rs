//! Running a vehicle: fixed-step RK4, 1 ms by default, ten steps to a control tick of 10 ms. A step in
//! which a wheel leaves the ground or touches down is taken in 16 parts.
//!
//! The same inputs give the same bits on every run. Nothing is allocated while stepping.

mod diagnostics;
mod dynamics;
mod observation;
mod observe;
mod ready;
mod settle;
mod state;

pub use diagnostics::{Energy, Momentum};
pub use observation::Observation;
pub use ready::ReadyVehicle;
pub use state::State;

use nalgebra::Vector3;

use crate::parameters::{ParameterError, VehicleParameters};
pub use crate::powertrain::LongitudinalDemand;
use crate::steering::SteeringActuator;
use crate::terrain::Terrain;
use crate::units::{DEGREE, KMH, wrap_angle};
use crate::wheels::Contact;
use dynamics::Dynamics;
pub(crate) use dynamics::HeldInput;
pub(crate) use settle::check_pose;

/// Integration step unless another is asked for, s.
pub const DEFAULT_SUBSTEP_S: f64 = 1e-3;
/// Longest time one call of [`Simulation::step`] may advance, s.
const LONGEST_TICK_S: f64 = 10.0;
/// Largest speed a simulation may start with or be asked for, m/s.
pub(crate) const LARGEST_SPEED_M_S: f64 = 150.0;
/// Largest acceleration that may be asked for, m/s².
const LARGEST_ACCELERATION_M_S2: f64 = 100.0;

/// Inputs to the vehicle over one control tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Handwheel angle before the steering actuator, positive to the left, rad.
    pub handwheel_rad: f64,
    /// What engine and brakes are asked for.
    pub longitudinal: LongitudinalDemand,
}

impl Command {
    /// The command in the units of the paper: degrees of handwheel and km/h.
    #[must_use]
    pub fn from_deg_kmh(handwheel_deg: f64, target_speed_kmh: f64) -> Self {
        Self {
            handwheel_rad: handwheel_deg * DEGREE,
            longitudinal: LongitudinalDemand::TargetSpeed(target_speed_kmh * KMH),
        }
    }
}

/// Where and how fast a simulation begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InitialPose {
    /// World x of the sprung mass, m.
    pub x_m: f64,
    /// World y of the sprung mass, m.
    pub y_m: f64,
    /// Heading, rad.
    pub yaw_rad: f64,
    /// Forward speed, m/s.
    pub speed_m_s: f64,
}

/// Why a simulation cannot begin or go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The vehicle's parameters are not allowed.
    #[error(transparent)]
    Parameters(#[from] ParameterError),
    /// The starting pose is not usable.
    #[error("initial {what} = {value}: must be in {range}")]
    Initial {
        /// Field of [`InitialPose`].
        what: &'static str,
        /// Value found.
        value: f64,
        /// Allowed interval with its unit.
        range: &'static str,
    },
    /// A command is not a usable number; the state is left as it was.
    #[error(
        "command {what} = {value} at {time_s:.2} s: must be {range}; the simulation stopped before it"
    )]
    Command {
        /// Field of [`Command`].
        what: &'static str,
        /// Value found.
        value: f64,
        /// What is allowed.
        range: &'static str,
        /// Simulated time, s.
        time_s: f64,
    },
    /// A time step cannot be used.
    #[error("{what} = {value} s: must be {range}")]
    TimeStep {
        /// Which step.
        what: &'static str,
        /// Value found, s.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// The state is no longer finite.
    #[error(
        "the vehicle's state is not finite after {time_s:.3} s: reduce the substep or check the vehicle's stiffest parameters"
    )]
    Diverged {
        /// Simulated time, s.
        time_s: f64,
    },
}

/// A vehicle on its terrain at an instant. Cloning it copies the state, so that several futures
/// can be tried from one past.
#[derive(Debug, Clone)]
pub struct Simulation {
    dynamics: Dynamics,
    terrain: Terrain,
    substep_s: f64,
    state: State,
    /// Ticks are counted in time, added up in whole substeps.
    substeps_done: u64,
    /// Continuous yaw, rad.
    yaw_rad: f64,
}

impl Simulation {
    /// Puts a vehicle on a terrain, rolling straight ahead in equilibrium at its speed.
    ///
    /// The equilibrium is found on level ground of friction 1 and then laid onto the ground under
    /// the vehicle, so on rough or banked ground the first moments still hold a small transient.
    /// For many simulations of one vehicle [`ReadyVehicle`] finds it once.
    ///
    /// # Errors
    /// [`SimulationError`] when parameters or pose are out of range.
    pub fn new(
        vehicle: &VehicleParameters,
        terrain: Terrain,
        initial: InitialPose,
    ) -> Result<Self, SimulationError> {
        Self::with_substep(vehicle, terrain, initial, DEFAULT_SUBSTEP_S)
    }

    /// As [`Simulation::new`] with another integration step, such as for a convergence study.
    ///
    /// # Errors
    /// As [`Simulation::new`], and when `substep_s` is not in (0, 5e-3] s.
    pub fn with_substep(
        vehicle: &VehicleParameters,
        terrain: Terrain,
        initial: InitialPose,
        substep_s: f64,
    ) -> Result<Self, SimulationError> {
        vehicle.check()?;
        if !(substep_s > 0.0 && substep_s <= 5e-3) {
            return Err(SimulationError::TimeStep {
                what: "substep",
                value: substep_s,
                range: "in (0, 5e-3]",
            });
        }
        check_pose(&initial)?;
        let dynamics = Dynamics::new(vehicle);
        let rolling = settle::rolling_state(&dynamics, initial.speed_m_s, substep_s);
        Self::placed(dynamics, &rolling, terrain, &initial, substep_s)
    }

    /// The vehicle in its equilibrium, put on the ground.
    fn placed(
        dynamics: Dynamics,
        rolling: &State,
        terrain: Terrain,
        initial: &InitialPose,
        substep_s: f64,
    ) -> Result<Self, SimulationError> {
        let state = settle::placed(rolling, &terrain, initial);
        if !state.is_finite() {
            return Err(SimulationError::Diverged { time_s: 0.0 });
        }
        Ok(Self {
            dynamics,
            terrain,
            substep_s,
            state,
            substeps_done: 0,
            yaw_rad: initial.yaw_rad,
        })
    }

    /// Advances by `tick_s` (10 ms in the paper) with the command held, and observes.
    ///
    /// # Errors
    /// [`SimulationError::Command`] for a command that is not finite (the state is unchanged),
    /// [`SimulationError::TimeStep`] when `tick_s` is no whole number of substeps, and
    /// [`SimulationError::Diverged`] when the state is no longer finite.
    pub fn step(&mut self, command: Command, tick_s: f64) -> Result<Observation, SimulationError> {
        let input = self.checked(command)?;
        let substeps = self.substeps_in(tick_s)?;
        for _ in 0..substeps {
            self.state = advanced(
                &self.dynamics,
                &self.state,
                &input,
                &self.terrain,
                self.substep_s,
            );
        }
        self.substeps_done += substeps;
        if !self.state.is_finite() {
            return Err(SimulationError::Diverged {
                time_s: self.time_s(),
            });
        }
        let rotation = self.state.rotation();
        let yaw = rotation[(1, 0)].atan2(rotation[(0, 0)]);
        self.yaw_rad += wrap_angle(yaw - self.yaw_rad);
        Ok(self.observation())
    }

    /// Simulated time, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.substeps_done as f64 * self.substep_s
    }

    /// The integration step, s.
    #[must_use]
    pub fn substep_s(&self) -> f64 {
        self.substep_s
    }

    /// The full state, for checks and for saving.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Goes on from another state of the same vehicle, such as a saved or disturbed one.
    ///
    /// # Errors
    /// [`SimulationError::Diverged`] when the state is not finite.
    pub fn set_state(&mut self, state: State) -> Result<(), SimulationError> {
        let length = state.orientation.norm();
        if !state.is_finite() || length < 0.5 {
            return Err(SimulationError::Diverged {
                time_s: self.time_s(),
            });
        }
        self.state = State {
            orientation: state.orientation / length,
            ..state
        };
        let rotation = self.state.rotation();
        self.yaw_rad = rotation[(1, 0)].atan2(rotation[(0, 0)]);
        Ok(())
    }

    /// Tilts gravity, as a tilt table does, in world axes; (0, 0, −9.81) m/s² at the start.
    ///
    /// # Errors
    /// [`SimulationError::Initial`] when a component is not finite.
    pub fn set_gravity_m_s2(&mut self, gravity: Vector3<f64>) -> Result<(), SimulationError> {
        if let Some(value) = gravity.iter().find(|value| !value.is_finite()) {
            return Err(SimulationError::Initial {
                what: "gravity",
                value: *value,
                range: "(-inf, inf) m/s²",
            });
        }
        self.dynamics.gravity_m_s2 = gravity;
        Ok(())
    }

    fn checked(&self, command: Command) -> Result<HeldInput, SimulationError> {
        checked_command(command, &self.dynamics.steering, self.time_s())
    }

    fn substeps_in(&self, tick_s: f64) -> Result<u64, SimulationError> {
        whole_substeps(tick_s, self.substep_s)
    }
}

/// The command as the vehicle takes it, or what is wrong with it at `time_s`.
pub(crate) fn checked_command(
    command: Command,
    steering: &SteeringActuator,
    time_s: f64,
) -> Result<HeldInput, SimulationError> {
    let refuse = |what, value, range| {
        Err(SimulationError::Command {
            what,
            value,
            range,
            time_s,
        })
    };
    if !command.handwheel_rad.is_finite() {
        return refuse("handwheel_rad", command.handwheel_rad, "a finite number");
    }
    match command.longitudinal {
        LongitudinalDemand::TargetSpeed(speed) if !(0.0..=LARGEST_SPEED_M_S).contains(&speed) => {
            return refuse("target_speed_m_s", speed, "in [0, 150] m/s");
        }
        LongitudinalDemand::Acceleration(asked)
            if !(-LARGEST_ACCELERATION_M_S2..=LARGEST_ACCELERATION_M_S2).contains(&asked) =>
        {
            return refuse("acceleration_m_s2", asked, "in [-100, 100] m/s²");
        }
        _ => {}
    }
    Ok(HeldInput {
        handwheel_rad: steering.limited_rad(command.handwheel_rad),
        longitudinal: command.longitudinal,
    })
}

/// How many steps of `substep_s` make up `tick_s`.
pub(crate) fn whole_substeps(tick_s: f64, substep_s: f64) -> Result<u64, SimulationError> {
    const WHOLE: f64 = 1e-6;
    let ratio = tick_s / substep_s;
    let whole = ratio.round();
    if !(tick_s > 0.0 && tick_s <= LONGEST_TICK_S) || (ratio - whole).abs() > WHOLE {
        return Err(SimulationError::TimeStep {
            what: "tick",
            value: tick_s,
            range: "a whole number of substeps in (0, 10]",
        });
    }
    // In (0, 10 s / substep], so it fits and is not negative.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Ok(whole as u64)
}

/// Parts of a step in which a tyre leaves the ground or touches down.
const CONTACT_PARTS: u32 = 16;

/// One step, in parts when a tyre leaves the ground or touches down within it: there the forces have
/// a kink, which costs the integrator its order.
fn advanced(
    dynamics: &Dynamics,
    state: &State,
    input: &HeldInput,
    terrain: &Terrain,
    step: f64,
) -> State {
    let (mut next, even) = rk4(dynamics, state, input, terrain, step);
    if !even {
        next = *state;
        for _ in 0..CONTACT_PARTS {
            (next, _) = rk4(
                dynamics,
                &next,
                input,
                terrain,
                step / f64::from(CONTACT_PARTS),
            );
        }
    }
    next
}

/// One classical Runge–Kutta step of fourth order, and whether the same tyres touched the ground in
/// all its stages.
fn rk4(
    dynamics: &Dynamics,
    state: &State,
    input: &HeldInput,
    terrain: &Terrain,
    step: f64,
) -> (State, bool) {
    let (k1, c1) = dynamics.rates(state, input, terrain);
    let (k2, c2) = dynamics.rates(&state.advanced(&k1, 0.5 * step), input, terrain);
    let (k3, c3) = dynamics.rates(&state.advanced(&k2, 0.5 * step), input, terrain);
    let (k4, c4) = dynamics.rates(&state.advanced(&k3, step), input, terrain);
    let mut next = state
        .advanced(&k1, step / 6.0)
        .advanced(&k2, step / 3.0)
        .advanced(&k3, step / 3.0)
        .advanced(&k4, step / 6.0);
    next.orientation /= next.orientation.norm();
    let touching = |contacts: &[Contact; 4]| contacts.map(|contact| contact.tyres_down);
    let first = touching(&c1);
    let even = [c2, c3, c4]
        .iter()
        .all(|contacts| touching(contacts) == first);
    (next, even)
}
