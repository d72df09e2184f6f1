//! Steady cornering from the parameters: roll, load transfer, lift-off, understeer.
//!
//! # Roll and load transfer
//! A lateral acceleration `a` does the work of these forces on the roll angle `φ` of the body and the
//! travels `d` of the axles (`axle.rs`), from tyre forces `F` on the ground (shared by the axles as the
//! weight is), inertia, links and the sideways shift of the contact patches by the compliance `c`:
//!
//! ```text
//! Q_φ = Σ (F h_s − 2 m_u a (h_s − h_hub) + c F N + 2 (I/r) a)
//! Q_d = F h_rc/(T/2) + λ c F N
//! ```
//!
//! (`I/r`: what turns the axes of the spinning wheels with the yaw rate `a/v`) and `K (φ, d) = Q` with the stiffness of tyres, springs, bars and gravity. All of it is linear,
//! but for the patch shift: with the share `τ` of its load transferred, an axle has
//! `N = N₀ (1 + τ²)`, because the outer wheel carries more of both load and force.
//!
//! # Understeer
//! The gradient is the derivative at straight running: axle force over cornering stiffness at the
//! static load, plus the slip that the camber thrust of the rolled wheels costs, front less rear
//! (ISO 4138; Gillespie 1992, chapter 6). The loss of cornering stiffness by load transfer is of
//! second order in the lateral acceleration, so it is not in it. Nor is what the powertrain adds:
//! drive forces at leaning wheels and a stiff differential.

use nalgebra::Vector3;
use serde::Serialize;

use super::axle::{Axle, Stand, axles, roll_stiffness};
use crate::parameters::VehicleParameters;
use crate::tyre::MagicFormula;
use crate::units::{DEGREE, GRAVITY_M_S2};

/// Step of the lateral acceleration on the way to lift-off, g.
const STEP_G: f64 = 0.001;
/// A vehicle that still stands at this lateral acceleration is said not to lift, g.
const LARGEST_G: f64 = 5.0;

/// Figures of steady cornering on level ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CorneringFigures {
    /// Friction of the road that the figures hold for (no unit).
    pub road_friction: f64,
    /// Roll angle of the body per lateral acceleration, at straight running, deg/g.
    pub roll_gradient_deg_per_g: f64,
    /// Load transfer ratio per lateral acceleration, at straight running, 1/g.
    pub ltr_per_g: f64,
    /// Share of the front axle in the load transfer, at straight running (no unit).
    pub load_transfer_share_front: f64,
    /// Lateral acceleration at which the second inner wheel lifts, quasi-static, g.
    pub lift_off_g: f64,
    /// Lateral acceleration that the outer wheels can hold when they carry all load, g. Below
    /// `lift_off_g` the vehicle slides before it lifts.
    pub grip_on_two_wheels_g: f64,
    /// Road-wheel angle beyond that of the curve per lateral acceleration, deg/g; positive
    /// understeers.
    pub understeer_gradient_deg_per_g: f64,
    /// Characteristic speed of an understeering vehicle, where its yaw response is largest, m/s.
    pub characteristic_speed_m_s: Option<f64>,
    /// Critical speed of an oversteering vehicle, beyond which it does not run straight, m/s.
    pub critical_speed_m_s: Option<f64>,
}

impl VehicleParameters {
    /// Figures of steady cornering on a level road of friction `road_friction`.
    #[must_use]
    pub fn cornering_figures(&self, road_friction: f64) -> CorneringFigures {
        let figures = self.derived();
        let axles = axles(self, &figures);
        let turn = Turn {
            vehicle: self,
            axles: &axles,
            forces_n: [
                figures.wheelbase_m - figures.cg_to_front_axle_m,
                figures.cg_to_front_axle_m,
            ]
            .map(|arm| figures.total_mass_kg * arm / figures.wheelbase_m),
        };
        // Small enough to be linear, per m/s².
        let at = turn.solve(&turn.load(1.0, [0.0; 2]), [Stand::AT_REST; 2]);
        let transfers = [0, 1].map(|i| 2.0 * turn.transfer_n(i, &at));
        let weight = figures.total_mass_kg * GRAVITY_M_S2;
        let [slip_front, slip_rear] = [0, 1].map(|i| {
            let formula = self.formula(i, weight);
            let axle = &axles[i];
            let camber = at[0] + axle.lean_per_m * at[1 + i];
            let stiffness = formula.stiffness_n(axle.load_n, road_friction);
            0.5 * turn.forces_n[i] / stiffness + self.tyre.camber_thrust_ratio * camber
        });
        let understeer = slip_front - slip_rear;
        let speed = (figures.wheelbase_m / understeer.abs()).sqrt();
        let grip = [0, 1].map(|i| {
            self.formula(i, weight)
                .peak_force_n(2.0 * axles[i].load_n, road_friction)
        });
        CorneringFigures {
            road_friction,
            roll_gradient_deg_per_g: at[0] * GRAVITY_M_S2 / DEGREE,
            ltr_per_g: (transfers[0] + transfers[1]) / figures.total_mass_kg,
            load_transfer_share_front: transfers[0] / (transfers[0] + transfers[1]),
            lift_off_g: turn.lift_off_g(),
            grip_on_two_wheels_g: (grip[0] + grip[1]) / weight,
            understeer_gradient_deg_per_g: understeer * GRAVITY_M_S2 / DEGREE,
            characteristic_speed_m_s: (understeer > 0.0).then_some(speed),
            critical_speed_m_s: (understeer < 0.0).then_some(speed),
        }
    }

    fn formula(&self, axle: usize, weight_n: f64) -> MagicFormula {
        let b1 = if axle == 0 {
            self.tyre.stiffness_factor_b1_front
        } else {
            self.tyre.stiffness_factor_b1_rear
        };
        MagicFormula::new(&self.tyre, b1, weight_n)
    }
}

/// A steady turn to the left.
struct Turn<'a> {
    vehicle: &'a VehicleParameters,
    axles: &'a [Axle; 2],
    /// Lateral force of each axle per lateral acceleration, N/(m/s²).
    forces_n: [f64; 2],
}

impl Turn<'_> {
    /// The generalised forces `Q` at a lateral acceleration in m/s², with the share of its load that
    /// each axle has transferred.
    fn load(&self, acceleration_m_s2: f64, transferred: [f64; 2]) -> Vector3<f64> {
        let height = self.vehicle.mass.sprung_cg_height_m;
        let compliance = self.vehicle.tyre.lateral_compliance_m_per_n;
        let mut load = Vector3::zeros();
        for (i, axle) in self.axles.iter().enumerate() {
            let force = self.forces_n[i] * acceleration_m_s2;
            let shifted = compliance * force * axle.load_n * (1.0 + transferred[i].powi(2));
            load[0] += force * height + shifted + 2.0 * axle.spin_kg_m * acceleration_m_s2
                - 2.0 * axle.unsprung_kg * acceleration_m_s2 * axle.drop_m;
            load[1 + i] = force * axle.jacking_slope + axle.lean_per_m * shifted;
        }
        load
    }

    fn solve(&self, load: &Vector3<f64>, stands: [Stand; 2]) -> Vector3<f64> {
        // A vehicle that passed the checks stands upright. One that falls over while an axle hangs in
        // the air is at its lift-off already.
        roll_stiffness(self.axles, stands)
            .cholesky()
            .map_or_else(|| Vector3::repeat(f64::INFINITY), |root| root.solve(load))
    }

    /// Load that moves from the inner to the outer wheel of an axle, N.
    fn transfer_n(&self, i: usize, at: &Vector3<f64>) -> f64 {
        let axle = &self.axles[i];
        axle.tyre_n_per_m * (axle.half_track_m * at[0] + at[1 + i])
    }

    /// Load that moves between the two tyres of a leaning wheel of an axle, N.
    fn between_twins_n(&self, i: usize, at: &Vector3<f64>) -> f64 {
        let axle = &self.axles[i];
        let lean = at[0] + axle.lean_per_m * at[1 + i];
        axle.tyre_n_per_m * axle.half_twin_spacing_m * lean
    }

    /// Lateral acceleration at which the second inner wheel lifts, g; infinite when none does. Tyres
    /// and springs are linear, but each tyre that lifts is taken out.
    fn lift_off_g(&self) -> f64 {
        let mut at = Vector3::zeros();
        let mut stands = [Stand::AT_REST; 2];
        let mut transferred = [0.0; 2];
        let mut load = Vector3::zeros();
        let mut acceleration_g = 0.0;
        while acceleration_g < LARGEST_G {
            acceleration_g += STEP_G;
            let next = self.load(acceleration_g * GRAVITY_M_S2, transferred);
            at += self.solve(&(next - load), stands);
            load = next;
            for (i, stand) in stands.iter_mut().enumerate() {
                let at_rest = self.axles[i].load_n;
                if !stand.lifted {
                    transferred[i] = (self.transfer_n(i, &at) / at_rest).min(1.0);
                    stand.lifted = transferred[i] >= 1.0;
                }
                let between = self.between_twins_n(i, &at).abs();
                let whole = [1.0 + transferred[i], 1.0 - transferred[i]]
                    .iter()
                    .filter(|share| between < *share * at_rest)
                    .count();
                stand.twins = whole as f64;
            }
            if stands.iter().all(|stand| stand.lifted) {
                return acceleration_g;
            }
        }
        f64::INFINITY
    }
}
