//! The starting state: rolling straight ahead in equilibrium.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::dynamics::{Dynamics, HeldInput};
use super::state::State;
use super::{InitialPose, LARGEST_SPEED_M_S, LongitudinalDemand, SimulationError, advanced};
use crate::powertrain::PowertrainState;
use crate::terrain::Terrain;
use crate::units::GRAVITY_M_S2;

/// Time given to pitch and heave to come to rest, s.
const SETTLING_TIME_S: f64 = 8.0;

/// Refuses poses that are no numbers or too fast.
pub(crate) fn check_pose(pose: &InitialPose) -> Result<(), SimulationError> {
    for (what, value) in [
        ("x_m", pose.x_m),
        ("y_m", pose.y_m),
        ("yaw_rad", pose.yaw_rad),
    ] {
        if !value.is_finite() {
            return Err(SimulationError::Initial {
                what,
                value,
                range: "(-inf, inf)",
            });
        }
    }
    if !(0.0..=LARGEST_SPEED_M_S).contains(&pose.speed_m_s) {
        return Err(SimulationError::Initial {
            what: "speed_m_s",
            value: pose.speed_m_s,
            range: "[0, 150] m/s",
        });
    }
    Ok(())
}

/// The vehicle rolling along x at `speed_m_s` on level ground, all transients gone.
pub(super) fn rolling_state(dynamics: &Dynamics, speed_m_s: f64, substep_s: f64) -> State {
    let drag = dynamics.drag_kg_per_m * speed_m_s * speed_m_s;
    let rolling = if speed_m_s > 0.0 {
        dynamics.wheels[0].rolling_resistance * dynamics.total_mass_kg * GRAVITY_M_S2
    } else {
        0.0
    };
    let nominal = dynamics.nominal_radius_m;
    let mut state = State {
        position_m: Vector3::new(0.0, 0.0, design_height_m(dynamics)),
        orientation: Quaternion::identity(),
        velocity_m_s: Vector3::new(speed_m_s, 0.0, 0.0),
        angular_rad_s: Vector3::zeros(),
        travel_m: [0.0; 4],
        travel_rate_m_s: [0.0; 4],
        spin_rad_s: [0, 0, 1, 1].map(|axle: usize| speed_m_s / nominal[axle]),
        slip: [[0.0; 2]; 4],
        steering: [0.0; 2],
        powertrain: PowertrainState {
            drive_n: drag + rolling,
            brake_n: 0.0,
            integral_m_s2: (drag + rolling) / dynamics.total_mass_kg,
        },
    };
    let input = HeldInput {
        handwheel_rad: 0.0,
        longitudinal: LongitudinalDemand::TargetSpeed(speed_m_s),
    };
    let ground = Terrain::flat(1.0);
    // Positive and at most 8 s over the least allowed step, so it fits.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let steps = (SETTLING_TIME_S / substep_s).ceil() as u64;
    for _ in 0..steps {
        state = advanced(dynamics, &state, &input, &ground, substep_s);
    }
    state.position_m.x = 0.0;
    state.position_m.y = 0.0;
    state
}

/// Height of the sprung CG above level ground at rest, m.
fn design_height_m(dynamics: &Dynamics) -> f64 {
    let wheel = &dynamics.wheels[0];
    let static_load = dynamics.axles[0].preload_n + dynamics.unsprung_kg[0] * GRAVITY_M_S2;
    wheel.radius_m - static_load / wheel.radial.stiffness_n_per_m - dynamics.hub_m[0].z
}

/// `settled` moved to a pose and laid onto the plane of the ground there.
pub(super) fn placed(settled: &State, terrain: &Terrain, pose: &InitialPose) -> State {
    let ground = terrain.ground(pose.x_m, pose.y_m);
    let normal = ground.normal();
    let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.yaw_rad);
    // `None` only for opposite vectors, and a normal never points down.
    let tilt = UnitQuaternion::rotation_between(&Vector3::z(), &normal)
        .unwrap_or_else(UnitQuaternion::identity);
    let turn = tilt * yaw;
    let height = Vector3::new(0.0, 0.0, settled.position_m.z);
    State {
        position_m: Vector3::new(pose.x_m, pose.y_m, ground.height_m) + turn * height,
        orientation: (turn * UnitQuaternion::from_quaternion(settled.orientation)).into_inner(),
        velocity_m_s: turn * settled.velocity_m_s,
        ..*settled
    }
}
