//! Both plants behind one face, and what is read off their runs.
#![allow(dead_code)] // Each test file uses its own part.

use vehicle_dyn::paper_model::{PaperModel, PaperModelSettings};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::{Command, InitialPose, LongitudinalDemand, Simulation};
use vehicle_dyn::terrain::Terrain;

pub const FRICTION: f64 = 0.85;
pub const TICK_S: f64 = 0.01;
pub const GRAVITY: f64 = 9.81;

/// A vehicle with hardly anything left that the paper's equations do not know: no camber, rolling
/// resistance, differential or gyroscopic wheels, roll centres on the ground, dampers alike in bump and
/// rebound, light wheels, stiff tyres whose slip follows within a few milliseconds.
pub fn bare(mut vehicle: VehicleParameters) -> VehicleParameters {
    vehicle.geometry.roll_centre_height_front_m = 0.0;
    vehicle.geometry.roll_centre_height_rear_m = 0.0;
    vehicle.mass.unsprung_mass_front_each_kg = 5.0;
    vehicle.mass.unsprung_mass_rear_each_kg = 5.0;
    vehicle.wheel.gyroscopic_inertia_front_kg_m2 = 1e-3;
    vehicle.wheel.gyroscopic_inertia_rear_kg_m2 = 1e-3;
    vehicle.tyre.vertical_stiffness_front_n_per_m *= 2.0;
    vehicle.tyre.vertical_stiffness_rear_n_per_m *= 2.0;
    vehicle.tyre.relaxation_length_lateral_m = 0.05;
    without_extras(vehicle)
}

/// Without what can be taken away and leave the vehicle as heavy and as stiff: camber, rolling
/// resistance, differential, dampers that differ in bump and rebound.
pub fn without_extras(mut vehicle: VehicleParameters) -> VehicleParameters {
    let suspension = &mut vehicle.suspension;
    suspension.camber_gain_front_rad_per_m = 0.0;
    suspension.camber_gain_rear_rad_per_m = 0.0;
    let mean = |x: f64, y: f64| 0.5 * (x + y);
    let front = mean(
        suspension.damping_bump_front_n_s_per_m,
        suspension.damping_rebound_front_n_s_per_m,
    );
    let rear = mean(
        suspension.damping_bump_rear_n_s_per_m,
        suspension.damping_rebound_rear_n_s_per_m,
    );
    suspension.damping_bump_front_n_s_per_m = front;
    suspension.damping_rebound_front_n_s_per_m = front;
    suspension.damping_bump_rear_n_s_per_m = rear;
    suspension.damping_rebound_rear_n_s_per_m = rear;
    vehicle.tyre.camber_thrust_ratio = 0.0;
    vehicle.tyre.rolling_resistance_coefficient = 0.0;
    vehicle.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    vehicle
}

/// What both plants measure.
#[derive(Debug, Clone, Copy)]
pub struct Seen {
    pub time_s: f64,
    pub handwheel_rad: f64,
    pub yaw_rate: f64,
    pub lateral_g: f64,
    pub roll_rad: f64,
    pub ltr: f64,
    pub least_load_n: f64,
}

#[derive(Clone)]
pub enum Plant {
    Full(Box<Simulation>),
    Paper(Box<PaperModel>),
}

pub fn pose(speed_m_s: f64) -> InitialPose {
    InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s,
    }
}

pub fn full(vehicle: &VehicleParameters, speed_m_s: f64) -> Plant {
    let simulation = Simulation::new(vehicle, Terrain::flat(FRICTION), pose(speed_m_s));
    Plant::Full(Box::new(simulation.expect("valid")))
}

pub fn paper(vehicle: &VehicleParameters, speed_m_s: f64, settings: PaperModelSettings) -> Plant {
    let model = PaperModel::with_settings(vehicle, FRICTION, pose(speed_m_s), settings);
    Plant::Paper(Box::new(model.expect("valid")))
}

impl Plant {
    pub fn step(&mut self, handwheel_rad: f64, speed_m_s: f64) -> Seen {
        let command = Command {
            handwheel_rad,
            longitudinal: LongitudinalDemand::TargetSpeed(speed_m_s),
        };
        let least = |loads: [f64; 4]| loads.into_iter().fold(f64::INFINITY, f64::min);
        match self {
            Self::Full(simulation) => {
                let seen = simulation.step(command, TICK_S).expect("finite");
                Seen {
                    time_s: seen.time_s,
                    handwheel_rad: seen.handwheel_actual_rad,
                    yaw_rate: seen.yaw_rate_rad_s,
                    lateral_g: seen.lateral_acceleration_m_s2 / GRAVITY,
                    roll_rad: seen.roll_rad,
                    ltr: seen.ltr,
                    least_load_n: least(seen.wheel_loads_n),
                }
            }
            Self::Paper(model) => {
                let seen = model.step(command, TICK_S).expect("finite");
                Seen {
                    time_s: seen.time_s,
                    handwheel_rad: seen.handwheel_actual_rad,
                    yaw_rate: seen.yaw_rate_rad_s,
                    lateral_g: seen.lateral_acceleration_m_s2 / GRAVITY,
                    roll_rad: seen.roll_rad,
                    ltr: seen.ltr,
                    least_load_n: least(seen.wheel_loads_n),
                }
            }
        }
    }
}

/// Figures of a step steer.
#[derive(Debug, Clone, Copy)]
pub struct StepFigures {
    /// Yaw rate per handwheel angle, 1/s.
    pub yaw_gain: f64,
    /// Roll angle per lateral acceleration, rad/g.
    pub roll_per_g: f64,
    /// Load transfer ratio per lateral acceleration, 1/g.
    pub ltr_per_g: f64,
    pub lateral_g: f64,
    /// From the step to 90 % of the steady value of yaw rate and LTR, s.
    pub yaw_t90_s: f64,
    pub ltr_t90_s: f64,
}

pub fn step_figures(mut plant: Plant, handwheel_rad: f64, speed_m_s: f64) -> StepFigures {
    const TICKS: usize = 500;
    let seen: Vec<Seen> = (0..TICKS)
        .map(|_| plant.step(handwheel_rad, speed_m_s))
        .collect();
    let mean = |of: fn(&Seen) -> f64| {
        let tail = &seen[TICKS - 50..];
        tail.iter().map(of).sum::<f64>() / tail.len() as f64
    };
    let rise = |of: fn(&Seen) -> f64| {
        let wanted = 0.9 * mean(of);
        let after = seen
            .iter()
            .position(|s| of(s) / wanted >= 1.0)
            .expect("a steady value is reached");
        let before = if after == 0 {
            0.0
        } else {
            of(&seen[after - 1])
        };
        let share = (wanted - before) / (of(&seen[after]) - before);
        TICK_S * (after as f64 + share)
    };
    let lateral = mean(|s| s.lateral_g);
    StepFigures {
        yaw_gain: mean(|s| s.yaw_rate) / handwheel_rad,
        roll_per_g: mean(|s| s.roll_rad) / lateral,
        ltr_per_g: mean(|s| s.ltr) / lateral,
        lateral_g: lateral,
        yaw_t90_s: rise(|s| s.yaw_rate),
        ltr_t90_s: rise(|s| s.ltr),
    }
}

/// Gain and phase (rad, behind the handwheel is negative) of yaw rate and LTR to a sine of the
/// handwheel.
#[derive(Debug, Clone, Copy)]
pub struct Response {
    pub yaw: [f64; 2],
    pub ltr: [f64; 2],
}

pub fn response(
    mut plant: Plant,
    amplitude_rad: f64,
    frequency_hz: f64,
    speed_m_s: f64,
) -> Response {
    // Whole cycles and whole ticks; the first ones are left out.
    const SETTLING: f64 = 4.0;
    const MEASURED: f64 = 5.0;
    let omega = std::f64::consts::TAU * frequency_hz;
    let per_cycle = 1.0 / (frequency_hz * TICK_S);
    let from = (SETTLING * per_cycle).round();
    let to = ((SETTLING + MEASURED) * per_cycle).round();
    let mut sums = [[0.0; 2]; 3];
    let ticks = (0..).map(f64::from).take_while(|tick| *tick < to);
    for tick in ticks {
        let time = tick * TICK_S;
        let seen = plant.step(amplitude_rad * (omega * time).sin(), speed_m_s);
        if tick < from {
            continue;
        }
        let (sin, cos) = (omega * seen.time_s).sin_cos();
        for (sum, value) in sums
            .iter_mut()
            .zip([seen.handwheel_rad, seen.yaw_rate, seen.ltr])
        {
            sum[0] += value * cos;
            sum[1] -= value * sin;
        }
    }
    let polar = |sum: [f64; 2]| [sum[0].hypot(sum[1]), sum[1].atan2(sum[0])];
    let input = polar(sums[0]);
    let relative = |sum: [f64; 2]| {
        let [size, angle] = polar(sum);
        let turn = std::f64::consts::TAU;
        let lag = angle - input[1];
        [size / input[0], lag - turn * (lag / turn).round()]
    };
    Response {
        yaw: relative(sums[1]),
        ltr: relative(sums[2]),
    }
}
