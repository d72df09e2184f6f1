//! The paper's own vehicle model: five chassis equations with all wheels on the ground
//! (eq. veh-dyn), its tyre (eq. magic) and its load transfer ratio.
//!
//! It is a second plant beside [`crate::simulation::Simulation`]: it takes the same vehicle and the
//! same [`Command`], is far simpler, and can be linearised in closed form ([`LinearModel`]). Use it
//! for reference poles and as the model that a model-based controller would have. Do not use it once
//! a wheel is about to lift: it holds wheels to the ground ([`PaperModel::all_wheels_loaded`]).
//!
//! # The equations, checked against a derivation
//! The undercarriage (mass `m_uc`) moves in the horizontal plane with `v_x`, `v_y` and turns with
//! `r`. The sprung mass (`m_SM`) hangs on a level hinge along x and its centre of gravity lies `h_SM`
//! above the hinge; it rolls by `φ` with `p = φ̇`. With `c = cos φ`, `s = sin φ`, ISO 8855 signs and
//! `A_x = v̇_x − v_y r`, `A_y = v̇_y + v_x r`, Newton and Euler give
//!
//! ```text
//! F_x = m A_x + m_SM h_SM (2 r p c + ṙ s)
//! F_y = m A_y − m_SM h_SM (ṗ c − p² s − r² s)
//! N   = I_zz(φ) ṙ + 2 (I_yy,SM − I_zz,SM) s c p r + m_SM h_SM s (A_x + h_SM (ṙ s + 2 r p c))
//! (I_xx,SM + m_SM h_SM²) ṗ = L + m_SM h_SM (g s + c A_y + r² h_SM s c) + (I_yy,SM − I_zz,SM) r² s c
//! L   = −K_s tan φ − D_s p cos φ
//! ```
//!
//! This is [`Equations::Derived`]; free of forces it keeps energy and momentum, which a test holds.
//! [`Equations::Printed`] are the paper's five. Against the derivation they
//!
//! - print `m_SM h_SM p cos φ` in the first equation, which is no force (kg m/s) and would turn its
//!   sign in a mirrored run. The Coriolis term `2 r p` fits unit and sign, so that is what is used:
//!   the only change made to the printed equations;
//! - leave out `ṙ s` there, `r² s` in the second, everything but `I_zz ṙ` in the fourth: all of second
//!   or higher order in roll and yaw;
//! - take the sprung centre of gravity in the fifth as if it neither rose nor fell: then
//!   `I_xx,SM ṗ = L + m_SM h_SM (g s + c a)` with its lateral acceleration
//!   `a = F_y/m − (m_uc/m) h_SM (ṗ c − p² s)`. With `cos φ = 1` beside `F_y` and `p²`, and for one of
//!   two factors in the denominator, this is the printed one. All of it is exact to first order, and the
//!   loads add up to `m g`;
//! - add `−m g (Δk + Δd)` to `L`, which is a force, not a moment. Springs that differ by the fraction
//!   `Δk` between left and right at half-distance `b` give the factor `1 − Δk²` as printed, and the
//!   moment `m_SM g b Δk`: the weight is the sprung one, and the arm is missing. For dampers no such
//!   term exists, because a damper makes no force at rest. Vehicles here are alike left and right, so
//!   `Δk = Δd = 0` and all of it vanishes.
//!
//! To first order in `φ`, `p`, `r`, `v_y` printed and derived equations are the same.
//!
//! # What the paper leaves open, and how it is closed
//! - **Roll axis.** The paper lets the sprung mass turn about the centre of mass of the undercarriage:
//!   [`RollAxis::Undercarriage`]. Roll centres of cars lie lower; [`RollAxis::RollCentres`] takes them
//!   from the vehicle. The equations are the same, only `h_SM` changes.
//! - **Roll stiffness.** `K_s` is the suspension's, and tyres are rigid: [`RollStiffness::Suspension`].
//!   [`RollStiffness::WithTyres`] puts the tyres' vertical stiffness in series to springs, bars and
//!   dampers. What the links' moment `h F_y` tilts the tyres by is left out still, and so is the roll of
//!   wheels that lean with the body: the higher the roll centres and the heavier the wheels, the more
//!   roll is missing (5 % of the sedan's, more of a truck's).
//! - **Wheel loads.** Not printed; they follow from the balance of the undercarriage about the ground,
//!   axle by axle (track `T`, height `h` of the roll axis, height `h_u` and lateral acceleration `a_u`
//!   of its mass `m_u`):
//!   `(F_z,R − F_z,L) T/2 = K tan φ + D p cos φ + h F_y + (h_u − h) m_u a_u`, and along x from
//!   `m A_x h_CG` and the drag. Loads and tyre forces depend on each other and are found together.
//! - **Slip ratio.** No equation for the wheel speeds is printed, and the paper takes speed as an
//!   input. Here the powertrain of the vehicle sets the force of each wheel, and the wheel takes the
//!   `λ` at which a tyre rolling straight would give it, up to 95 % of the peak: a wheel neither spins
//!   nor locks. Lateral slip then takes its share of the force, as in the combined law.
//! - **Drag** acts along x at the centre of gravity of the sprung mass. There is no rolling
//!   resistance, camber, relaxation of slip or differential.
//! - Slip angles use one speed `u` for both sides, as printed, and at least 1 m/s.

mod constants;
mod equations;
mod linear;
mod load_search;
mod observation;

pub use linear::LinearModel;
pub use observation::{PaperObservation, PaperState};

use serde::{Deserialize, Serialize};

use crate::parameters::VehicleParameters;
use crate::powertrain::PowertrainState;
use crate::simulation::{
    Command, DEFAULT_SUBSTEP_S, HeldInput, InitialPose, SimulationError, check_pose,
    checked_command, whole_substeps,
};
use constants::Constants;
use equations::Instant;

/// Which right-hand side is integrated; see the [module](self).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Equations {
    /// The paper's five equations, with the unit of one term repaired.
    Printed,
    /// The same two bodies without neglect.
    Derived,
}

/// The axis about which the sprung mass rolls.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RollAxis {
    /// Level, through the centre of mass of the undercarriage: the paper's assumption.
    Undercarriage,
    /// Through the roll centres of both axles, level at its height below the sprung mass.
    RollCentres,
}

/// What `K_s` and `D_s` stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RollStiffness {
    /// Springs, anti-roll bars and dampers on rigid tyres: the paper's.
    Suspension,
    /// In series with the vertical stiffness of the tyres.
    WithTyres,
}

/// The choices that the paper's equations leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperModelSettings {
    /// Right-hand side.
    pub equations: Equations,
    /// Roll axis.
    pub roll_axis: RollAxis,
    /// Roll stiffness and damping.
    pub roll_stiffness: RollStiffness,
}

impl PaperModelSettings {
    /// The paper's equations with the paper's assumptions.
    pub const PAPER: Self = Self {
        equations: Equations::Printed,
        roll_axis: RollAxis::Undercarriage,
        roll_stiffness: RollStiffness::Suspension,
    };

    /// The choices closest to the vehicle: nothing neglected in the equations, its roll centres, its
    /// tyres in series.
    pub const MATCHED: Self = Self {
        equations: Equations::Derived,
        roll_axis: RollAxis::RollCentres,
        roll_stiffness: RollStiffness::WithTyres,
    };
}

/// The paper's model of a vehicle on level ground. Cloning it copies the state.
#[derive(Debug, Clone)]
pub struct PaperModel {
    constants: Constants,
    state: PaperState,
    substeps_done: u64,
    first_unloaded_s: Option<f64>,
}

impl PaperModel {
    /// The vehicle on level ground of friction `friction`, rolling straight ahead in equilibrium, with
    /// [`PaperModelSettings::PAPER`].
    ///
    /// # Errors
    /// [`SimulationError`] when parameters, pose or friction are out of range.
    pub fn new(
        vehicle: &VehicleParameters,
        friction: f64,
        initial: InitialPose,
    ) -> Result<Self, SimulationError> {
        Self::with_settings(vehicle, friction, initial, PaperModelSettings::PAPER)
    }

    /// As [`PaperModel::new`] with other choices.
    ///
    /// # Errors
    /// As [`PaperModel::new`].
    pub fn with_settings(
        vehicle: &VehicleParameters,
        friction: f64,
        initial: InitialPose,
        settings: PaperModelSettings,
    ) -> Result<Self, SimulationError> {
        vehicle.check()?;
        check_pose(&initial)?;
        if !(0.0..=3.0).contains(&friction) {
            return Err(SimulationError::Initial {
                what: "friction",
                value: friction,
                range: "[0, 3]",
            });
        }
        let constants = Constants::new(vehicle, friction, settings);
        let drag = constants.drag_n(initial.speed_m_s);
        let state = PaperState {
            x_m: initial.x_m,
            y_m: initial.y_m,
            yaw_rad: initial.yaw_rad,
            forward_speed_m_s: initial.speed_m_s,
            powertrain: PowertrainState {
                drive_n: drag,
                brake_n: 0.0,
                integral_m_s2: drag / constants.total_kg,
            },
            ..PaperState::default()
        };
        let mut model = Self {
            constants,
            state,
            substeps_done: 0,
            first_unloaded_s: None,
        };
        model.note_loads(&model.instant());
        Ok(model)
    }

    /// Advances by `tick_s` with the command held, by RK4 in steps of 1 ms, and observes. Nothing is
    /// allocated.
    ///
    /// # Errors
    /// As [`crate::simulation::Simulation::step`]; the state is unchanged unless it diverged.
    pub fn step(
        &mut self,
        command: Command,
        tick_s: f64,
    ) -> Result<PaperObservation, SimulationError> {
        let input = checked_command(command, &self.constants.steering, self.time_s())?;
        for _ in 0..whole_substeps(tick_s, DEFAULT_SUBSTEP_S)? {
            let now = self
                .constants
                .rk4(&mut self.state, &input, DEFAULT_SUBSTEP_S);
            self.note_loads(&now);
            self.substeps_done += 1;
        }
        if !self.state.is_finite() {
            return Err(SimulationError::Diverged {
                time_s: self.time_s(),
            });
        }
        let now = self.instant();
        self.note_loads(&now);
        Ok(self.observed(&now))
    }

    /// Measured state at this instant.
    #[must_use]
    pub fn observation(&self) -> PaperObservation {
        self.observed(&self.instant())
    }

    /// Simulated time, s.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.substeps_done as f64 * DEFAULT_SUBSTEP_S
    }

    /// The full state.
    #[must_use]
    pub fn state(&self) -> &PaperState {
        &self.state
    }

    /// Goes on from another state of the same vehicle.
    ///
    /// # Errors
    /// [`SimulationError::Diverged`] when the state is not finite.
    pub fn set_state(&mut self, state: PaperState) -> Result<(), SimulationError> {
        if !state.is_finite() {
            return Err(SimulationError::Diverged {
                time_s: self.time_s(),
            });
        }
        self.state = state;
        self.first_unloaded_s = None;
        self.note_loads(&self.instant());
        Ok(())
    }

    /// Whether every wheel presses on the ground now, as the equations assume. Where this is false a
    /// computed load is zero or negative: the real vehicle lifts that wheel, this model goes on as if
    /// it were held to the ground (without tyre force), and its numbers are no prediction.
    #[must_use]
    pub fn all_wheels_loaded(&self) -> bool {
        self.instant().all_loaded()
    }

    /// When a computed wheel load was first zero or negative, s; results up to here are within the
    /// model's assumption. Counts from the last [`PaperModel::set_state`].
    #[must_use]
    pub fn first_unloaded_s(&self) -> Option<f64> {
        self.first_unloaded_s
    }

    /// The model linearised about straight running at `speed_m_s`.
    ///
    /// # Errors
    /// [`SimulationError::Initial`] when `speed_m_s` is not in [1, 150] m/s.
    pub fn linearise(&self, speed_m_s: f64) -> Result<LinearModel, SimulationError> {
        linear::linearise(&self.constants, speed_m_s)
    }

    /// Kinetic and potential energy, J; gravity counts from the height of the hinge.
    #[must_use]
    pub fn energy_j(&self) -> f64 {
        self.constants.energy_j(&self.state)
    }

    fn instant(&self) -> Instant {
        let mut search = self.constants.search();
        self.constants
            .rates(&self.state, &HeldInput::AT_REST, &mut search)
            .1
    }

    fn note_loads(&mut self, now: &Instant) {
        if self.first_unloaded_s.is_none() && !now.all_loaded() {
            self.first_unloaded_s = Some(self.time_s());
        }
    }
}
