//! A vehicle that many simulations start from.

use std::sync::{Mutex, PoisonError};

use super::dynamics::Dynamics;
use super::{
    DEFAULT_SUBSTEP_S, InitialPose, Simulation, SimulationError, State, check_pose, settle,
};
use crate::parameters::{ParameterError, VehicleParameters};
use crate::terrain::Terrain;

/// Checked parameters, and the equilibria that were found with them: to find one takes as long as
/// 8 s of a run, and it depends on the vehicle and its speed only. Threads may share it.
#[derive(Debug)]
pub struct ReadyVehicle {
    parameters: VehicleParameters,
    dynamics: Dynamics,
    rolling: Mutex<Vec<(f64, State)>>,
}

impl ReadyVehicle {
    /// Nothing is simulated yet.
    ///
    /// # Errors
    /// When a parameter is not allowed.
    pub fn new(parameters: VehicleParameters) -> Result<Self, ParameterError> {
        parameters.check()?;
        Ok(Self {
            dynamics: Dynamics::new(&parameters),
            rolling: Mutex::default(),
            parameters,
        })
    }

    /// What it was made of.
    #[must_use]
    pub fn parameters(&self) -> &VehicleParameters {
        &self.parameters
    }

    /// The simulation that [`Simulation::new`] gives, bit for bit.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn simulation(
        &self,
        terrain: Terrain,
        initial: InitialPose,
    ) -> Result<Simulation, SimulationError> {
        check_pose(&initial)?;
        let rolling = self.rolling_state(initial.speed_m_s);
        let dynamics = self.dynamics.clone();
        Simulation::placed(dynamics, &rolling, terrain, &initial, DEFAULT_SUBSTEP_S)
    }

    fn rolling_state(&self, speed_m_s: f64) -> State {
        // Held while an equilibrium is sought, so that whoever else wants it waits for it.
        let mut known = self.rolling.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |(speed, _): &&(f64, State)| speed.to_bits() == speed_m_s.to_bits();
        if let Some((_, state)) = known.iter().find(same) {
            return *state;
        }
        let state = settle::rolling_state(&self.dynamics, speed_m_s, DEFAULT_SUBSTEP_S);
        known.push((speed_m_s, state));
        state
    }
}
