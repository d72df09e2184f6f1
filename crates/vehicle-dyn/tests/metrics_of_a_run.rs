//! Time to rollover, simulated and estimated, and the peaks of a run.

mod common;

use common::{TICK_S, on_flat, sedan};
use vehicle_dyn::metrics::{
    LoadTransferIndex, ROLLOVER_ROLL_RAD, RunMeasures, RunRecorder, RunSample, TimeToLift,
    time_to_roll_angle_s, time_to_rollover,
};
use vehicle_dyn::simulation::{Command, Observation, Simulation, SimulationError};

const FAST: f64 = 100.0;

fn fishhook_like() -> (Simulation, Command) {
    (
        on_flat(&sedan(), 0.85, FAST),
        Command::from_deg_kmh(60.0, FAST),
    )
}

#[test]
fn the_simulated_time_to_rollover_is_when_it_happens() {
    let (mut simulation, command) = fishhook_like();
    let before = *simulation.state();
    let ahead = time_to_rollover(&simulation, command, 5.0).expect("finite");
    assert_eq!(*simulation.state(), before, "the simulation is untouched");
    let lift_s = ahead.two_wheel_lift_s.expect("lifts");
    let rollover_s = ahead.rollover_s.expect("rolls over");
    assert!(lift_s < rollover_s);
    let mut lifted = None;
    let mut last = simulation.observation();
    while last.roll_rad.abs() <= ROLLOVER_ROLL_RAD {
        last = simulation.step(command, TICK_S).expect("finite");
        if lifted.is_none() && last.two_wheel_lift() {
            lifted = Some(last.time_s);
        }
        if lifted.is_some() && last.roll_rad.abs() <= ROLLOVER_ROLL_RAD {
            let rest = time_to_rollover(&simulation, command, 5.0).expect("finite");
            let expected = rollover_s - last.time_s;
            assert!((rest.rollover_s.expect("ahead") - expected).abs() < 1e-9);
        }
    }
    assert!((lifted.expect("lifts") - lift_s).abs() < 1e-9);
    assert!((last.time_s - rollover_s).abs() < 1e-9);
    let now = time_to_rollover(&simulation, command, 1.0).expect("finite");
    assert_eq!(now.rollover_s, Some(0.0));
}

#[test]
fn what_does_not_happen_within_the_horizon_has_no_time() {
    let (simulation, command) = fishhook_like();
    let near = time_to_rollover(&simulation, command, 0.2).expect("finite");
    assert_eq!((near.two_wheel_lift_s, near.rollover_s), (None, None));
    let straight = Command::from_deg_kmh(0.0, FAST);
    let never = time_to_rollover(&simulation, straight, 3.0).expect("finite");
    assert_eq!((never.two_wheel_lift_s, never.rollover_s), (None, None));
    for horizon_s in [0.0, -1.0, f64::NAN, 61.0] {
        let refused = time_to_rollover(&simulation, straight, horizon_s);
        assert!(matches!(refused, Err(SimulationError::TimeStep { .. })));
    }
    let no_command = Command::from_deg_kmh(f64::NAN, FAST);
    let refused = time_to_rollover(&simulation, no_command, 1.0);
    assert!(matches!(refused, Err(SimulationError::Command { .. })));
}

#[test]
fn the_estimates_agree_with_the_simulation_shortly_before() {
    let vehicle = sedan();
    let (mut simulation, command) = fishhook_like();
    let index = LoadTransferIndex::new(&vehicle);
    let mut to_lift = TimeToLift::new(TICK_S, 0.05);
    let ahead = time_to_rollover(&simulation, command, 5.0).expect("finite");
    let (lift_s, rollover_s) = (
        ahead.two_wheel_lift_s.expect("lifts"),
        ahead.rollover_s.expect("rolls over"),
    );
    loop {
        let seen = simulation.step(command, TICK_S).expect("finite");
        let value = index.index(
            seen.roll_rad,
            seen.roll_rate_rad_s,
            seen.lateral_acceleration_m_s2,
        );
        let lift = to_lift.update(value);
        let roll = time_to_roll_angle_s(seen.roll_rad, seen.roll_rate_rad_s, ROLLOVER_ROLL_RAD);
        let before_lift = lift_s - seen.time_s;
        if (0.05..0.3).contains(&before_lift) {
            // Early by up to a tenth of a second: the transfer rises more slowly towards the end.
            let error = lift.expect("rises") - before_lift;
            assert!((-0.12..0.02).contains(&error), "{error} at {before_lift} s");
        }
        let before_rollover = rollover_s - seen.time_s;
        if before_rollover < 0.3 {
            // Late, and the later the farther away: a tipping vehicle speeds up.
            let error = roll.expect("tips") - before_rollover;
            let allowed = 2.1 * before_rollover * before_rollover + 0.01;
            assert!(
                (-0.01..allowed).contains(&error),
                "{error} at {before_rollover} s"
            );
        }
        if seen.time_s >= rollover_s - 1e-9 {
            break;
        }
    }
}

#[test]
fn the_time_to_lift_is_exact_for_a_ramp_on_either_side() {
    for side in [1.0, -1.0] {
        let mut estimator = TimeToLift::new(TICK_S, 0.05);
        assert_eq!(estimator.update(0.0), None);
        for tick in 1..40 {
            let value = side * 0.02 * f64::from(tick);
            let time_s = estimator.update(value).expect("rises");
            let expected = (1.0 - value.abs()) / 2.0;
            assert!((time_s - expected).abs() < 1e-9, "{time_s} for {expected}");
        }
        assert_eq!(estimator.update(side * 1.3), Some(0.0));
    }
    let mut unfiltered = TimeToLift::new(TICK_S, 0.0);
    unfiltered.update(0.5);
    assert_eq!(unfiltered.update(0.4), None, "it falls");
    assert_eq!(unfiltered.update(f64::NAN), None);
    assert_eq!(unfiltered.update(0.3), None, "no rate over the gap");
}

#[test]
fn the_time_to_a_roll_angle_is_that_at_the_present_rate() {
    assert_eq!(time_to_roll_angle_s(0.5, 0.25, 1.0), Some(2.0));
    assert_eq!(time_to_roll_angle_s(-0.5, -0.25, 1.0), Some(2.0));
    assert_eq!(time_to_roll_angle_s(0.0, -0.5, 1.0), Some(2.0));
    assert_eq!(time_to_roll_angle_s(0.5, -0.25, 1.0), None);
    assert_eq!(time_to_roll_angle_s(0.5, 0.0, 1.0), None);
    assert_eq!(time_to_roll_angle_s(-1.5, 1.0, 1.0), Some(0.0));
}

fn samples(seen: &[Observation]) -> Vec<RunSample> {
    let index = LoadTransferIndex::new(&sedan());
    let sample = |o: &Observation| {
        let value = index.index(o.roll_rad, o.roll_rate_rad_s, o.lateral_acceleration_m_s2);
        RunSample::new(o, -0.1 * o.time_s, Some(value))
    };
    seen.iter().map(sample).collect()
}

#[test]
fn measures_of_a_run_are_its_peaks_and_times() {
    let (mut simulation, command) = fishhook_like();
    let mut seen = Vec::new();
    for _ in 0..150 {
        seen.push(simulation.step(command, TICK_S).expect("finite"));
    }
    let found = RunMeasures::of(TICK_S, samples(&seen));
    let peak = seen
        .iter()
        .max_by(|a, b| a.ltr.abs().total_cmp(&b.ltr.abs()))
        .expect("not empty");
    assert_eq!(found.ltr_abs_max.to_bits(), peak.ltr.abs().to_bits());
    assert_eq!(found.ltr_abs_max_time_s, Some(peak.time_s));
    let last = seen.last().expect("not empty");
    assert_eq!(found.roll_abs_max_time_s, Some(last.time_s));
    assert_eq!(found.roll_abs_max_rad.to_bits(), last.roll_rad.to_bits());
    let lifted: Vec<_> = seen.iter().filter(|o| o.two_wheel_lift()).collect();
    assert_eq!(found.two_wheel_lift_first_s, Some(lifted[0].time_s));
    assert!((found.two_wheel_lift_s - lifted.len() as f64 * TICK_S).abs() < 1e-9);
    assert!(found.two_wheel_clearance_max_m.expect("known") > 0.2);
    assert_eq!(found.time_to_lift_min_s, Some(0.0));
    assert!((found.path_deviation_abs_max_m - 0.15).abs() < 1e-9);
    assert!(found.load_transfer_index_abs_max.expect("known") > 1.5);
    assert!(found.sideslip_abs_max_rad > 0.0);
}

#[test]
fn samples_that_are_no_numbers_count_for_nothing() {
    let seen = on_flat(&sedan(), 0.85, FAST).observation();
    let mut recorder = RunRecorder::new(TICK_S);
    for value in [f64::NAN, 0.3, f64::INFINITY] {
        let mut sample = RunSample::new(&seen, value, Some(value));
        (sample.ltr, sample.roll_rad, sample.sideslip_rad) = (value, value, value);
        recorder.observe(&sample);
    }
    let found = recorder.measures();
    for peak in [
        found.ltr_abs_max,
        found.roll_abs_max_rad,
        found.sideslip_abs_max_rad,
        found.path_deviation_abs_max_m,
        found.load_transfer_index_abs_max.expect("known"),
    ] {
        assert_eq!(peak.to_bits(), 0.3_f64.to_bits());
    }
}

#[test]
fn measuring_allocates_nothing() {
    let (mut simulation, command) = fishhook_like();
    let seen: Vec<Observation> = (0..100)
        .map(|_| simulation.step(command, TICK_S).expect("finite"))
        .collect();
    let samples = samples(&seen);
    let mut recorder = RunRecorder::new(TICK_S);
    let mut to_lift = TimeToLift::new(TICK_S, 0.05);
    let counted = allocation_counter::measure(|| {
        for (sample, seen) in samples.iter().zip(&seen) {
            recorder.observe(sample);
            to_lift.update(seen.ltr);
        }
    });
    assert_eq!(counted.count_total, 0);
}
