//! A vehicle against the trajectories of the reference model.
//!
//! Which run serves which check is decided by its name and its numbers alone, so that any parameter
//! set of the reference can be judged: `step_v20_…` is a step of the front wheels' angle at
//! 20 m/s from 0.5 s on, `chirp_v30_…` a frequency sweep, `brake_…` a braking.

use anyhow::Result;
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::simulation::Observation;
use vehicle_dyn::units::GRAVITY_M_S2;

use super::Row;
use super::response::{frequency_response, relative_difference, rise_time_s};
use crate::reference::drive::drive;
use crate::reference::trajectory::{Sample, Trajectory};

/// Steps of the reference begin here, s.
const STEP_START_S: f64 = 0.5;
/// Up to this the reference is noisy: its tyres shift with the sign of the camber.
const LEAST_ACCELERATION_M_S2: f64 = 0.05 * GRAVITY_M_S2;
/// Steps whose transient is judged end above this: they leave the noisy range early.
const TRANSIENT_ACCELERATION_M_S2: f64 = 0.1 * GRAVITY_M_S2;

/// A run of the reference and ours beside it, at the same times.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The reference.
    pub run: Trajectory,
    /// Ours.
    pub ours: Vec<Observation>,
}

impl Pair {
    /// Times, s.
    #[must_use]
    pub fn time_s(&self) -> Vec<f64> {
        self.theirs(|sample| sample.t_s)
    }

    /// A signal of the reference.
    pub fn theirs(&self, of: impl Fn(&Sample) -> f64) -> Vec<f64> {
        self.run.samples.iter().map(of).collect()
    }

    /// A signal of ours.
    pub fn ours(&self, of: impl Fn(&Observation) -> f64) -> Vec<f64> {
        self.ours.iter().map(of).collect()
    }

    fn is(&self, prefix: &str) -> bool {
        self.run.summary.name.starts_with(prefix)
    }

    fn complete(&self) -> bool {
        self.run.summary.valid_until.is_none()
    }

    fn ends(&self) -> (&Sample, &Observation) {
        let last = self.run.samples.len() - 1;
        (&self.run.samples[last], &self.ours[last])
    }

    fn acceleration_m_s2(&self) -> f64 {
        self.ends().0.ay_total_mps2.abs()
    }
}

/// Drives `vehicle` through every run.
///
/// # Errors
/// When a simulation fails.
pub fn pairs(
    vehicle: &VehicleParameters,
    runs: Vec<Trajectory>,
    mut progress: impl FnMut(),
) -> Result<Vec<Pair>> {
    runs.into_iter()
        .map(|run| {
            let ours = drive(vehicle, &run)?;
            progress();
            Ok(Pair { run, ours })
        })
        .collect()
}

/// All rows that the runs at hand allow.
#[must_use]
pub fn rows(pairs: &[Pair]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut speeds: Vec<f64> = pairs
        .iter()
        .filter(|pair| pair.is("step_"))
        .map(|pair| pair.run.summary.v0)
        .collect();
    speeds.sort_by(f64::total_cmp);
    speeds.dedup();
    for speed in speeds {
        rows.extend(step_rows(pairs, speed));
    }
    for pair in pairs.iter().filter(|pair| pair.is("chirp_")) {
        rows.extend(chirp_rows(pair));
    }
    for pair in pairs {
        if ["brake_", "accel_"].iter().any(|prefix| pair.is(prefix)) {
            rows.push(longitudinal_row(pair));
        }
    }
    for pair in pairs {
        if ["ramp_", "swd_", "fishhook_"]
            .iter()
            .any(|prefix| pair.is(prefix))
        {
            rows.extend(transient_rows(pair));
        }
    }
    rows
}

/// Steady state and rise of the steps at one speed. The smallest step shows the linear range; the
/// steady state of larger ones is judged up to 0.4 g.
fn step_rows(pairs: &[Pair], speed_m_s: f64) -> Vec<Row> {
    const LINEAR_UP_TO_M_S2: f64 = 0.4 * GRAVITY_M_S2;
    let mut steps: Vec<&Pair> = pairs
        .iter()
        .filter(|pair| pair.is("step_") && pair.complete())
        .filter(|pair| pair.run.summary.v0.total_cmp(&speed_m_s).is_eq())
        .filter(|pair| {
            (LEAST_ACCELERATION_M_S2..LINEAR_UP_TO_M_S2).contains(&pair.acceleration_m_s2())
        })
        .collect();
    steps.sort_by(|a, b| a.acceleration_m_s2().total_cmp(&b.acceleration_m_s2()));
    let mut rows = Vec::new();
    for pair in &steps {
        let (theirs, ours) = pair.ends();
        let name = |what: &str| {
            let g = theirs.ay_total_mps2 / GRAVITY_M_S2;
            format!("{what} at {speed_m_s:.1} m/s, {g:.2} g")
        };
        let lateral = ours.lateral_acceleration_m_s2;
        rows.push(Row::relative(
            name("yaw rate per angle of the front wheels"),
            "1/s",
            theirs.yawrate_radps / theirs.delta_rad,
            10.0,
            ours.yaw_rate_rad_s / ours.road_wheel_rad,
        ));
        let degrees_per_g = |roll: f64, lateral: f64| roll.to_degrees() / lateral * GRAVITY_M_S2;
        rows.push(Row::relative(
            name("roll angle per lateral acceleration"),
            "deg/g",
            degrees_per_g(theirs.roll_rad, theirs.ay_total_mps2),
            10.0,
            degrees_per_g(ours.roll_rad, lateral),
        ));
        rows.push(Row::relative(
            name("LTR per lateral acceleration"),
            "1/g",
            theirs.LTR / theirs.ay_total_mps2 * GRAVITY_M_S2,
            5.0,
            ours.ltr / lateral * GRAVITY_M_S2,
        ));
    }
    let transient = steps
        .iter()
        .find(|pair| pair.acceleration_m_s2() >= TRANSIENT_ACCELERATION_M_S2);
    if let Some(pair) = transient {
        let rise = |signal: &[f64]| rise_time_s(&pair.time_s(), signal, STEP_START_S);
        rows.push(Row::absolute(
            format!(
                "time to 90 % of the yaw rate at {speed_m_s:.1} m/s, {:.2} g",
                pair.acceleration_m_s2() / GRAVITY_M_S2
            ),
            "s",
            rise(&pair.theirs(|sample| sample.yawrate_radps)),
            0.05,
            rise(&pair.ours(|seen| seen.yaw_rate_rad_s)),
        ));
    }
    rows
}

fn chirp_rows(pair: &Pair) -> Vec<Row> {
    const ROLL_LATER: &str = "The reference's tyres see the sideways speed of the body's centre of \
        gravity, not that of the wheels, so its body rolls sooner than its own equations for the \
        axles allow; see the report.";
    let sample_time = (pair.run.samples[1].t_s - pair.run.samples[0].t_s).abs();
    let steered = pair.theirs(|sample| sample.delta_rad);
    let steered_ours = pair.ours(|seen| seen.road_wheel_rad);
    let signals = [
        (
            "yaw rate",
            "1/s",
            pair.theirs(|sample| sample.yawrate_radps),
            pair.ours(|seen| seen.yaw_rate_rad_s),
        ),
        (
            "LTR",
            "1/rad",
            pair.theirs(|sample| sample.LTR),
            pair.ours(|seen| seen.ltr),
        ),
    ];
    let mut rows = Vec::new();
    for (signal, unit, theirs, ours) in &signals {
        for frequency in [0.2, 0.5, 1.0] {
            let [gain, phase] = frequency_response(&steered, theirs, sample_time, frequency);
            let [our_gain, our_phase] =
                frequency_response(&steered_ours, ours, sample_time, frequency);
            let at = format!("{frequency} Hz, {:.0} m/s", pair.run.summary.v0);
            rows.push(Row::relative(
                format!("gain from steering to {signal} at {at}"),
                unit,
                gain,
                15.0,
                our_gain,
            ));
            let row = Row::absolute(
                format!("phase from steering to {signal} at {at}"),
                "deg",
                phase,
                12.0,
                our_phase,
            );
            let remark = if row.pass { "" } else { ROLL_LATER };
            rows.push(row.remarked(remark));
        }
    }
    rows
}

/// Mean acceleration while the last command holds and the vehicle still moves.
fn longitudinal_row(pair: &Pair) -> Row {
    let commanded = pair.run.samples[pair.run.samples.len() / 2].acc_cmd_mps2;
    let held: Vec<usize> = (0..pair.run.samples.len())
        .filter(|&k| {
            let sample = &pair.run.samples[k];
            sample.t_s > 1.0
                && sample.vx_mps > 5.0
                && (sample.acc_cmd_mps2 - commanded).abs() < 1e-3
        })
        .collect();
    let mean = |speed: &dyn Fn(usize) -> f64| match (held.first(), held.last()) {
        (Some(&first), Some(&last)) if last > first => {
            let time = |k: usize| pair.run.samples[k].t_s;
            (speed(last) - speed(first)) / (time(last) - time(first))
        }
        _ => f64::NAN,
    };
    Row::relative(
        format!("acceleration under a command of {commanded} m/s²"),
        "m/s²",
        mean(&|k| pair.run.samples[k].vx_mps),
        3.0,
        mean(&|k| pair.ours[k].speed_m_s),
    )
}

/// Largest values reached, and the yaw rate over time.
fn transient_rows(pair: &Pair) -> Vec<Row> {
    let peak = |signal: &[f64]| signal.iter().fold(0.0_f64, |peak, v| peak.max(v.abs()));
    let name = &pair.run.summary.name;
    let until = pair
        .run
        .summary
        .valid_until
        .map_or_else(String::new, |end| format!(" up to {end} s"));
    vec![
        Row::absolute(
            format!("{name}{until}: rms difference in yaw rate over its rms"),
            "",
            0.0,
            0.1,
            relative_difference(
                &pair.theirs(|sample| sample.yawrate_radps),
                &pair.ours(|seen| seen.yaw_rate_rad_s),
            ),
        ),
        Row::relative(
            format!("{name}{until}: largest |LTR|"),
            "",
            peak(&pair.theirs(|sample| sample.LTR)),
            10.0,
            peak(&pair.ours(|seen| seen.ltr)),
        ),
    ]
}
