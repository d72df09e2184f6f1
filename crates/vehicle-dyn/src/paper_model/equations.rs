//! Right-hand side: loads, tyre forces and accelerations found together.

use super::Equations;
use super::constants::Constants;
use super::load_search::LoadSearch;
use super::observation::PaperState;
use crate::simulation::HeldInput;
use crate::units::GRAVITY_M_S2;

/// Least speed in the slip angles, m/s; their rates grow as one over the speed.
pub(super) const LEAST_SLIP_SPEED_M_S: f64 = 1.0;
/// Change of the loads, over the vehicle's weight, at which they count as found.
const LOAD_TOLERANCE: f64 = 1e-11;
/// Rounds after which the loads are taken as they are; two to six are usual.
const MOST_ROUNDS: usize = 40;

/// What a state says of the wheels whatever they carry.
struct Given {
    /// Sine and cosine of the angle of the front wheels.
    steer: (f64, f64),
    /// Sine and cosine of the roll angle.
    roll: (f64, f64),
    /// `tan α` of both axles (eq. `alpha_f`, `alpha_r`), written without the arc tangent.
    lateral_slips: [f64; 2],
    /// Drive less brake force asked of `[left, right]` of both axles, N.
    wheel_n: [[f64; 2]; 2],
    drag_n: f64,
}

/// Loads and forces at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Instant {
    /// Front left, front right, rear left, rear right, N.
    pub loads_n: [f64; 4],
    /// `F_x,T` with the drag, N.
    pub longitudinal_n: f64,
    /// `F_y,T`, N.
    pub lateral_n: f64,
    accelerations: Accelerations,
}

impl Instant {
    pub fn all_loaded(&self) -> bool {
        self.loads_n.iter().all(|&load| load > 0.0)
    }
}

/// Forces of the tyres in the axes of the undercarriage.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Forces {
    /// With the drag, N.
    longitudinal_n: f64,
    /// Of both axles, N.
    lateral_n: [f64; 2],
    /// `N_T` with the moment of the drag, N m.
    yaw_nm: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Accelerations {
    /// `A_x = v̇_x − v_y r`, m/s².
    longitudinal: f64,
    /// `A_y = v̇_y + v_x r`, m/s².
    lateral: f64,
    yaw: f64,
    roll: f64,
    /// Of the sprung centre of gravity, upwards, m/s².
    vertical: f64,
}

impl Constants {
    /// One step of the classical Runge–Kutta method; returns the instant it began with.
    pub fn rk4(&self, state: &mut PaperState, input: &HeldInput, step: f64) -> Instant {
        // What the first stage learns of the loads serves the others.
        let mut search = self.search();
        let (k1, now) = self.rates(state, input, &mut search);
        let (k2, _) = self.rates(&state.advanced(&k1, 0.5 * step), input, &mut search);
        let (k3, _) = self.rates(&state.advanced(&k2, 0.5 * step), input, &mut search);
        let (k4, _) = self.rates(&state.advanced(&k3, step), input, &mut search);
        *state = state
            .advanced(&k1, step / 6.0)
            .advanced(&k2, step / 3.0)
            .advanced(&k3, step / 3.0)
            .advanced(&k4, step / 6.0);
        now
    }

    /// Loads to begin with: those at rest.
    pub fn search(&self) -> LoadSearch {
        let [front, rear] = [&self.axles[0], &self.axles[1]].map(|axle| axle.static_load_n);
        LoadSearch::new([front, front, rear, rear])
    }

    /// Rate of the state.
    pub fn rates(
        &self,
        state: &PaperState,
        input: &HeldInput,
        search: &mut LoadSearch,
    ) -> (PaperState, Instant) {
        let now = self.instant(state, search);
        let found = &now.accelerations;
        let (speed, lateral) = (state.forward_speed_m_s, state.lateral_speed_m_s);
        let yaw_rate = state.yaw_rate_rad_s;
        let (sin, cos) = state.yaw_rad.sin_cos();
        let rate = PaperState {
            x_m: speed * cos - lateral * sin,
            y_m: speed * sin + lateral * cos,
            yaw_rad: yaw_rate,
            forward_speed_m_s: found.longitudinal + lateral * yaw_rate,
            lateral_speed_m_s: found.lateral - speed * yaw_rate,
            yaw_rate_rad_s: found.yaw,
            roll_rad: state.roll_rate_rad_s,
            roll_rate_rad_s: found.roll,
            steering: self.steering.rates(state.steering, input.handwheel_rad),
            powertrain: self
                .powertrain
                .rates(&state.powertrain, speed, input.longitudinal),
        };
        (rate, now)
    }

    /// Loads and tyre forces depend on each other; rounds of one after the other find both.
    fn instant(&self, state: &PaperState, search: &mut LoadSearch) -> Instant {
        let given = self.given(state);
        let tolerance = LOAD_TOLERANCE * self.total_kg * GRAVITY_M_S2;
        search.begin();
        let mut round = 0;
        loop {
            let forces = self.forces(&given, &search.loads_n());
            let accelerations = self.accelerations(state, &given, &forces);
            let found = self.loads(state, &given, &forces, &accelerations);
            round += 1;
            if search.take(&found) <= tolerance || round == MOST_ROUNDS {
                return Instant {
                    loads_n: found,
                    longitudinal_n: forces.longitudinal_n,
                    lateral_n: forces.lateral_n[0] + forces.lateral_n[1],
                    accelerations,
                };
            }
        }
    }

    fn given(&self, state: &PaperState) -> Given {
        let steer = self.steering.road_wheel_rad(state.steering[0]).sin_cos();
        let speed = state.forward_speed_m_s;
        let slip = |axle: usize, (sin, cos): (f64, f64)| {
            let across = state.lateral_speed_m_s + self.axles[axle].ahead_m * state.yaw_rate_rad_s;
            let along = speed * cos + across * sin;
            let sideways = across * cos - speed * sin;
            -sideways / along.abs().max(LEAST_SLIP_SPEED_M_S)
        };
        let wheel_n = |i: usize| {
            let radius = self.axles[i].radius_m;
            let spin = speed / radius;
            let power = &state.powertrain;
            self.powertrain
                .axle_torques_nm(i, power, [spin, spin], radius)
                .map(|torque| torque / radius)
        };
        Given {
            steer,
            roll: state.roll_rad.sin_cos(),
            lateral_slips: [slip(0, steer), slip(1, (0.0, 1.0))],
            wheel_n: [wheel_n(0), wheel_n(1)],
            drag_n: self.drag_n(speed),
        }
    }

    fn forces(&self, given: &Given, loads: &[f64; 4]) -> Forces {
        let (roll_sin, _) = given.roll;
        // The drag acts at the sprung mass, which leans away from the heading's line.
        let mut total = Forces {
            longitudinal_n: -given.drag_n,
            lateral_n: [0.0; 2],
            yaw_nm: -given.drag_n * self.roll_arm_m * roll_sin,
        };
        let (sin, cos) = given.steer;
        for (i, axle) in self.axles.iter().enumerate() {
            let side = |side: usize| {
                let load = loads[2 * i + side];
                let ratio = self.slip_ratio(i, load, given.wheel_n[i][side]);
                let slip = [ratio, given.lateral_slips[i]];
                let [along, across] = axle.tyre.force_n(load, self.friction, slip);
                if i == 0 {
                    [along * cos - across * sin, along * sin + across * cos]
                } else {
                    [along, across]
                }
            };
            let (left, right) = (side(0), side(1));
            total.longitudinal_n += left[0] + right[0];
            total.lateral_n[i] = left[1] + right[1];
            total.yaw_nm +=
                axle.ahead_m * total.lateral_n[i] + 0.5 * axle.track_m * (right[0] - left[0]);
        }
        total
    }

    fn accelerations(&self, state: &PaperState, given: &Given, forces: &Forces) -> Accelerations {
        let (sin, cos) = given.roll;
        let (m, sprung, arm) = (self.total_kg, self.sprung_kg, self.roll_arm_m);
        let first = sprung * arm;
        let (roll_rate, yaw_rate) = (state.roll_rate_rad_s, state.yaw_rate_rad_s);
        let squared = roll_rate * roll_rate;
        let lateral_n = forces.lateral_n[0] + forces.lateral_n[1];
        let roll_nm = -self.roll_stiffness * (sin / cos) - self.roll_damping * roll_rate * cos;
        let coriolis = 2.0 * yaw_rate * roll_rate * cos;
        let [inertia_x, inertia_y, inertia_z] = self.sprung_inertia;
        match self.equations {
            Equations::Printed => {
                let share = self.undercarriage_kg / m;
                let roll = (first * (lateral_n / m + sin * (GRAVITY_M_S2 + arm * share * squared))
                    + roll_nm)
                    / (inertia_x + first * arm * share * cos);
                Accelerations {
                    longitudinal: (forces.longitudinal_n - first * coriolis) / m,
                    lateral: (lateral_n + first * (roll * cos - squared * sin)) / m,
                    yaw: forces.yaw_nm / self.yaw_inertia,
                    roll,
                    vertical: 0.0,
                }
            }
            Equations::Derived => {
                let centrifugal = yaw_rate * yaw_rate * sin;
                // F_y = m A_y − first (ṗ c − p² s − r² s) put into the roll equation.
                let still = (lateral_n - first * (squared * sin + centrifugal)) / m;
                let difference = inertia_y - inertia_z;
                let roll = (roll_nm
                    + first * (GRAVITY_M_S2 * sin + cos * (still + arm * centrifugal))
                    + difference * centrifugal * cos)
                    / (inertia_x + first * arm - first * first * cos * cos / m);
                // Force along x and moment about z in A_x and ṙ.
                let coupling = first * sin;
                let yaw_inertia = self.yaw_inertia + (difference + first * arm) * sin * sin;
                let force = forces.longitudinal_n - first * coriolis;
                let moment =
                    forces.yaw_nm - coupling * arm * coriolis - difference * sin * coriolis;
                let determinant = m * yaw_inertia - coupling * coupling;
                Accelerations {
                    longitudinal: (yaw_inertia * force - coupling * moment) / determinant,
                    lateral: still + first * roll * cos / m,
                    yaw: (m * moment - coupling * force) / determinant,
                    roll,
                    vertical: -arm * (roll * sin + squared * cos),
                }
            }
        }
    }

    fn loads(
        &self,
        state: &PaperState,
        given: &Given,
        forces: &Forces,
        found: &Accelerations,
    ) -> [f64; 4] {
        let mut loads = [0.0; 4];
        let pitch_nm = self.total_kg * found.longitudinal * self.cg_height_m
            + given.drag_n * self.sprung_cg_height_m;
        let shift = 0.5 * pitch_nm / self.wheelbase_m;
        let (sin, cos) = given.roll;
        let tan = sin / cos;
        for (i, axle) in self.axles.iter().enumerate() {
            let ahead = if i == 0 { -shift } else { shift };
            let mean = axle.static_load_n
                + ahead
                + 0.5 * axle.sprung_share * self.sprung_kg * found.vertical;
            let undercarriage = found.lateral + axle.ahead_m * found.yaw;
            let moment = axle.roll_stiffness * tan
                + axle.roll_damping * state.roll_rate_rad_s * cos
                + axle.axis_height_m * forces.lateral_n[i]
                + (axle.unsprung_height_m - axle.axis_height_m) * axle.unsprung_kg * undercarriage;
            let transfer = moment / axle.track_m;
            loads[2 * i] = mean - transfer;
            loads[2 * i + 1] = mean + transfer;
        }
        loads
    }

    /// Kinetic and potential energy of both bodies, J.
    pub fn energy_j(&self, state: &PaperState) -> f64 {
        let (sin, cos) = state.roll_rad.sin_cos();
        let (vx, vy) = (state.forward_speed_m_s, state.lateral_speed_m_s);
        let (p, r) = (state.roll_rate_rad_s, state.yaw_rate_rad_s);
        let (sprung, arm) = (self.sprung_kg, self.roll_arm_m);
        let [inertia_x, inertia_y, inertia_z] = self.sprung_inertia;
        let velocity = [vx + r * arm * sin, vy - arm * cos * p, -arm * sin * p];
        let squared: f64 = velocity.iter().map(|v| v * v).sum();
        // What of the yaw inertia is the undercarriage's, and the tilted body's.
        let yaw = self.yaw_inertia + (inertia_y - inertia_z) * sin * sin;
        0.5 * (self.undercarriage_kg * (vx * vx + vy * vy)
            + sprung * squared
            + inertia_x * p * p
            + yaw * r * r)
            + sprung * GRAVITY_M_S2 * arm * cos
            - self.roll_stiffness * cos.ln()
    }
}
