//! Engine, brakes and the speed controller that turns a target speed into wheel torques.

use crate::parameters::PowertrainParameters;
use crate::suspension::Pair;

/// Speed below which the available engine force stops growing as power over speed, m/s.
const LEAST_POWER_SPEED_M_S: f64 = 1.0;
/// Wheel speed over which brake torque fades to zero at standstill, rad/s.
const BRAKE_FADE_RAD_S: f64 = 1.0;

/// What engine and brakes are asked for over one control tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LongitudinalDemand {
    /// The vehicle's speed controller holds this speed, m/s.
    TargetSpeed(f64),
    /// Drive or brake force of mass times this acceleration, m/s², without speed control.
    Acceleration(f64),
    /// Both pedals released: neither drive nor brake force, as a test with dropped throttle asks.
    Released,
}

/// Constants of engine, brakes and speed controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Powertrain {
    total_mass_kg: f64,
    max_power_w: f64,
    max_drive_n: f64,
    max_brake_n: f64,
    inverse_engine_lag: f64,
    inverse_brake_lag: f64,
    gain_per_s: f64,
    integral_per_s2: f64,
    coupling_nm_s: f64,
    /// Share of one wheel in the drive force, `[front, rear]`.
    drive_share: [f64; 2],
    /// Share of one wheel in the brake force, `[front, rear]`.
    brake_share: [f64; 2],
}

/// State of the powertrain and, with the same fields per second, its rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PowertrainState {
    /// Drive force of all wheels, N.
    pub drive_n: f64,
    /// Brake force of all wheels, N, positive when braking.
    pub brake_n: f64,
    /// Acceleration asked by the integral part of the speed controller, m/s².
    pub integral_m_s2: f64,
}

impl Powertrain {
    /// Prepares the powertrain of a vehicle of `total_mass_kg`.
    #[must_use]
    pub fn new(powertrain: &PowertrainParameters, total_mass_kg: f64) -> Self {
        let split = |front: f64| [0.5 * front, 0.5 * (1.0 - front)];
        Self {
            total_mass_kg,
            max_power_w: powertrain.max_power_w,
            max_drive_n: powertrain.max_drive_force_n,
            max_brake_n: powertrain.max_brake_force_n,
            inverse_engine_lag: 1.0 / powertrain.engine_lag_s,
            inverse_brake_lag: 1.0 / powertrain.brake_lag_s,
            gain_per_s: powertrain.speed_gain_per_s,
            integral_per_s2: powertrain.speed_integral_gain_per_s2,
            coupling_nm_s: powertrain.differential_coupling_nm_s_per_rad,
            drive_share: split(powertrain.drive_share_front),
            brake_share: split(powertrain.brake_share_front),
        }
    }

    /// Rates of the powertrain's state at forward speed `speed_m_s` (m/s). The integral of the speed
    /// controller rests while speed is not controlled.
    #[must_use]
    pub fn rates(
        &self,
        state: &PowertrainState,
        speed_m_s: f64,
        demand: LongitudinalDemand,
    ) -> PowertrainState {
        let (wanted, error) = match demand {
            LongitudinalDemand::TargetSpeed(target_m_s) => {
                let error = target_m_s - speed_m_s;
                (self.gain_per_s * error + state.integral_m_s2, error)
            }
            // Without speed control there is no error to integrate.
            LongitudinalDemand::Acceleration(asked_m_s2) => (asked_m_s2, 0.0),
            LongitudinalDemand::Released => (0.0, 0.0),
        };
        let wanted_n = self.total_mass_kg * wanted;
        let power_n = self.max_power_w / speed_m_s.abs().max(LEAST_POWER_SPEED_M_S);
        let given_n = wanted_n.clamp(-self.max_brake_n, self.max_drive_n.min(power_n));
        // Anti-windup: what engine or brakes cannot give must not be asked for later.
        let winding_up = (wanted_n - given_n) * error > 0.0;
        PowertrainState {
            drive_n: (given_n.max(0.0) - state.drive_n) * self.inverse_engine_lag,
            brake_n: ((-given_n).max(0.0) - state.brake_n) * self.inverse_brake_lag,
            integral_m_s2: if winding_up {
                0.0
            } else {
                self.integral_per_s2 * error
            },
        }
    }

    /// Torques `[left, right]` on the wheels of one axle (0 front, 1 rear), N m, at wheel speeds
    /// `spin_rad_s`. `radius_m` turns forces into torques.
    #[must_use]
    pub fn axle_torques_nm(
        &self,
        axle: usize,
        state: &PowertrainState,
        spin_rad_s: Pair,
        radius_m: f64,
    ) -> Pair {
        let share = self.drive_share[axle];
        let drive = share * state.drive_n * radius_m;
        let brake = self.brake_share[axle] * state.brake_n * radius_m;
        let coupling = if share > 0.0 {
            self.coupling_nm_s * (spin_rad_s[1] - spin_rad_s[0])
        } else {
            0.0
        };
        let braking = |spin: f64| brake * (spin / BRAKE_FADE_RAD_S).clamp(-1.0, 1.0);
        [
            drive + coupling - braking(spin_rad_s[0]),
            drive - coupling - braking(spin_rad_s[1]),
        ]
    }
}
