//! The test bench: a vehicle on a flat pad, driven run by run.

use std::ops::ControlFlow;

use super::report::{RunReport, Warning};
use super::trace::{Trace, TraceRow};
use super::{Figure, ManoeuvreError};
use crate::parameters::VehicleParameters;
use crate::simulation::{
    Command, DEFAULT_SUBSTEP_S, InitialPose, LongitudinalDemand, Observation, Simulation,
    SimulationError,
};
use crate::terrain::Terrain;
use crate::units::DEGREE;

/// Height of both wheels of one side that counts as two-wheel lift, where a manoeuvre does not say
/// otherwise: two inches, m.
pub const TWO_WHEEL_LIFT_M: f64 = 0.0508;

/// How the runs are computed. The defaults are what the figures of this project are made with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunSettings {
    /// Integration step, s.
    pub substep_s: f64,
    /// Time over which a command is held, s. A steering machine is far faster than a driver's tick,
    /// and a wave held over 10 ms would come 5 ms late.
    pub tick_s: f64,
    /// Time between two stored rows, s: a whole number of ticks.
    pub row_s: f64,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self {
            substep_s: DEFAULT_SUBSTEP_S,
            tick_s: 1e-3,
            row_s: 1e-2,
        }
    }
}

/// Told after every run; [`ControlFlow::Break`] stops the manoeuvre.
pub type OnRun<'a> = &'a mut dyn FnMut(&Trace) -> ControlFlow<()>;

/// What a run does, tick by tick.
pub(super) trait Plan {
    /// Handwheel angle (rad, before the vehicle's limits) and pedals for the tick that follows
    /// `seen`; `None` at the end of the run.
    fn next(&mut self, seen: &Observation, tick_s: f64) -> Option<Command>;
}

impl<F: FnMut(&Observation, f64) -> Option<Command>> Plan for F {
    fn next(&mut self, seen: &Observation, tick_s: f64) -> Option<Command> {
        self(seen, tick_s)
    }
}

/// A vehicle, the pad under it and everything that is kept of its runs.
pub(super) struct Bench<'a> {
    pub vehicle: &'a VehicleParameters,
    pub friction: f64,
    /// Height of both wheels of one side that counts as two-wheel lift, m.
    pub two_wheel_lift_m: f64,
    pub runs: Vec<RunReport>,
    pub traces: Vec<Trace>,
    pub warnings: Vec<Warning>,
    settings: RunSettings,
    on_run: OnRun<'a>,
    /// The last vehicle set rolling, by speed: many runs of a manoeuvre start alike.
    rolling: Option<(f64, Simulation)>,
}

impl<'a> Bench<'a> {
    pub fn new(
        vehicle: &'a VehicleParameters,
        friction: f64,
        settings: RunSettings,
        on_run: OnRun<'a>,
    ) -> Self {
        Self {
            vehicle,
            friction,
            two_wheel_lift_m: TWO_WHEEL_LIFT_M,
            runs: Vec::new(),
            traces: Vec::new(),
            warnings: Vec::new(),
            settings,
            on_run,
            rolling: None,
        }
    }

    /// A vehicle rolling straight along x at `speed_m_s` from the origin.
    pub fn rolling(&mut self, run: &str, speed_m_s: f64) -> Result<Simulation, ManoeuvreError> {
        let known = self.rolling.as_ref();
        // The very same speed, to the bit.
        let same = known.filter(|known| known.0.to_bits() == speed_m_s.to_bits());
        if let Some((_, simulation)) = same {
            return Ok(simulation.clone());
        }
        let pose = InitialPose {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
            speed_m_s,
        };
        let ground = Terrain::flat(self.friction);
        let simulation =
            Simulation::with_substep(self.vehicle, ground, pose, self.settings.substep_s)
                .map_err(|source| failed(run, source))?;
        self.rolling = Some((speed_m_s, simulation.clone()));
        Ok(simulation)
    }

    /// Drives a run that starts straight at `speed_m_s`, without keeping it.
    pub fn drive(
        &mut self,
        name: &str,
        speed_m_s: f64,
        plan: &mut dyn Plan,
    ) -> Result<Trace, ManoeuvreError> {
        let mut simulation = self.rolling(name, speed_m_s)?;
        self.drive_from(name, &mut simulation, plan, &mut |_, _| Ok(()))
    }

    /// Drives a run from a given state; `before_tick` may act on the simulation, such as by tilting
    /// the table.
    pub fn drive_from(
        &mut self,
        name: &str,
        simulation: &mut Simulation,
        plan: &mut dyn Plan,
        before_tick: &mut dyn FnMut(&mut Simulation, f64) -> Result<(), SimulationError>,
    ) -> Result<Trace, ManoeuvreError> {
        let RunSettings { tick_s, row_s, .. } = self.settings;
        // A positive ratio of two times of a run.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let ticks_per_row = (row_s / tick_s).round().max(1.0) as u64;
        let mut trace = Trace::new(name);
        let mut seen = simulation.observation();
        let (mut asked_rad, mut rate_rad_s) = (0.0_f64, 0.0_f64);
        let mut last = 0.0_f64;
        for tick in 0_u64.. {
            let command = plan.next(&seen, tick_s);
            if let Some(command) = command {
                asked_rad = asked_rad.max(command.handwheel_rad.abs());
                rate_rad_s = rate_rad_s.max((command.handwheel_rad - last).abs() / tick_s);
                last = command.handwheel_rad;
            }
            if tick.is_multiple_of(ticks_per_row) || command.is_none() {
                trace.rows.push(TraceRow {
                    handwheel_command_rad: last,
                    seen,
                });
            }
            let Some(command) = command else { break };
            before_tick(simulation, tick_s).map_err(|source| failed(name, source))?;
            seen = simulation
                .step(command, tick_s)
                .map_err(|source| failed(name, source))?;
            if !trace.note(&seen, self.two_wheel_lift_m) {
                trace.rows.push(TraceRow {
                    handwheel_command_rad: last,
                    seen,
                });
                break;
            }
        }
        self.hold_against_limits(name, asked_rad, rate_rad_s);
        Ok(trace)
    }

    /// Keeps a run with its figures, and tells the caller.
    pub fn keep(&mut self, trace: Trace, figures: Vec<Figure>) -> Result<(), ManoeuvreError> {
        self.runs.push(RunReport {
            name: trace.name.clone(),
            ended: trace.ended,
            figures,
        });
        let go_on = (self.on_run)(&trace);
        self.traces.push(trace);
        match go_on {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(ManoeuvreError::Interrupted {
                runs_done: self.runs.len(),
            }),
        }
    }

    /// Warns once for each limit of the steering that a run's demand exceeds.
    fn hold_against_limits(&mut self, run: &str, asked_rad: f64, rate_rad_s: f64) {
        // Differences of a ramp over a tick carry rounding.
        const ROUNDING: f64 = 1.0 + 1e-6;
        let steering = &self.vehicle.steering;
        for (field, demanded, allowed, unit) in [
            (
                "steering.handwheel_limit_deg",
                asked_rad / DEGREE,
                steering.handwheel_limit_deg,
                "deg",
            ),
            (
                "steering.handwheel_rate_limit_deg_per_s",
                rate_rad_s / DEGREE,
                steering.handwheel_rate_limit_deg_per_s,
                "deg/s",
            ),
        ] {
            if demanded <= allowed * ROUNDING {
                continue;
            }
            let known = self.warnings.iter_mut().find_map(|warning| match warning {
                Warning::SteeringDemand {
                    field: known,
                    demanded,
                    ..
                } if *known == field => Some(demanded),
                _ => None,
            });
            match known {
                Some(largest) => *largest = largest.max(demanded),
                None => self.warnings.push(Warning::SteeringDemand {
                    field,
                    demanded,
                    allowed,
                    unit,
                    run: run.to_owned(),
                }),
            }
        }
    }
}

fn failed(run: &str, source: SimulationError) -> ManoeuvreError {
    ManoeuvreError::Simulation {
        run: run.to_owned(),
        source,
    }
}

/// The command of a steering machine with the pedals at `longitudinal`.
pub(super) fn steer(handwheel_rad: f64, longitudinal: LongitudinalDemand) -> Command {
    Command {
        handwheel_rad,
        longitudinal,
    }
}

/// Both directions of a test, left first, with their names and signs.
pub(super) const DIRECTIONS: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];
