//! Sensors between the vehicle and its controller, and runs that cannot go on.

use std::path::{Path, PathBuf};

use deepc_core::controller::{Controller, Reference, Step};
use rollover_app::closed_loop::{Finished, Recorded, Run, Watch, controller, run};
use rollover_app::interrupt::Interrupt;
use rollover_app::record::{RecordingSummary, record};
use rollover_app::run_log::{self, LogRow};
use rollover_app::scenario::{DRIVER, Scenario, load};
use rollover_app::summary::{RunIdentity, Summary};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

const SCENARIO: &str = include_str!("../../../scenarios/sedan-s1.toml");
const CONTROLLER: &str = "rd-deepc-1";

/// The shipped scenario with sensors, shortened to its first turn.
fn with_sensors(sensors: &str) -> Result<Scenario, String> {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let file = folder.path().join("mine.toml");
    let short = SCENARIO.replacen("duration_s = 35.0", "duration_s = 9.0", 1);
    std::fs::write(&file, format!("{short}\n{sensors}\n")).expect("writable");
    load(&file.display().to_string()).map_err(|error| format!("{:#}", anyhow_of(error)))
}

fn anyhow_of(error: impl std::error::Error + Send + Sync + 'static) -> anyhow::Error {
    error.into()
}

fn vehicle(scenario: &Scenario) -> ReadyVehicle {
    let vehicle = vehicle_dyn::vehicles::find(&scenario.vehicle).expect("its vehicle is built in");
    ReadyVehicle::new(vehicle).expect("its parameters are allowed")
}

/// The controller from the recording of a seed, and what the recording came to.
fn built(scenario: &Scenario, seed: u64) -> (Box<dyn Controller>, RecordingSummary) {
    let vehicle = vehicle(scenario);
    let (data, summary) =
        record(scenario, &vehicle, seed, &Interrupt::default()).expect("survived");
    let watch = Watch {
        interrupt: &Interrupt::default(),
        progress: &|_| (),
    };
    let settings = scenario
        .controller(CONTROLLER)
        .expect("the scenario has it")
        .expect("it is not the driver");
    let built = controller(scenario, settings, &Recorded::new(&data), watch).expect("excited");
    (built.controller, summary)
}

fn drive(
    scenario: &Scenario,
    seed: u64,
    controller: Option<Box<dyn Controller>>,
    log: &Path,
) -> anyhow::Result<Finished> {
    let vehicle = vehicle(scenario);
    let order = Run {
        seed,
        controller,
        ..Run::of_driver(scenario, &vehicle, Terrain::flat(scenario.ground.friction))
    };
    run(order, Some(log), &Interrupt::default(), || ())
}

fn temporary_log() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log = folder.path().join("log.csv");
    (folder, log)
}

/// Drives with the controller of a seed and returns the rows.
fn rows(sensors: &str, seed: u64) -> Vec<LogRow> {
    let scenario = with_sensors(sensors).expect("valid");
    let (_folder, log) = temporary_log();
    let controller = built(&scenario, seed).0;
    drive(&scenario, seed, Some(controller), &log)
        .expect("the simulation runs")
        .rows
}

/// What two runs of one seed share: everything but the measured time.
fn without_times(rows: &[LogRow]) -> Vec<LogRow> {
    let timeless = |row: &LogRow| LogRow {
        step_time_us: 0.0,
        ..*row
    };
    rows.iter().map(timeless).collect()
}

#[test]
fn without_sensors_the_measured_ratio_is_the_true_one_to_the_bit() {
    let none = rows("", 10);
    for row in &none {
        assert_eq!(row.ltr_measured.map(f64::to_bits), Some(row.ltr.to_bits()));
    }
    let perfect = rows("[sensors.ltr]\n[sensors.x_m]", 10);
    assert_eq!(without_times(&perfect), without_times(&none));
}

#[test]
fn a_noisy_sensor_is_what_controller_and_recording_see_and_its_seed_fixes_it() {
    let noisy = "[sensors.ltr]\nnoise_standard_deviation = 0.01";
    let first = rows(noisy, 10);
    assert_eq!(without_times(&first), without_times(&rows(noisy, 10)));
    let errors: Vec<f64> = first
        .iter()
        .map(|r| r.ltr_measured.expect("none is lost") - r.ltr)
        .collect();
    let count = errors.len() as f64;
    let deviation = (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt();
    assert!((deviation - 0.01).abs() < 0.001, "{deviation}");
    // The controller acts on it.
    let quiet = rows("", 10);
    let differs = |(a, b): (&LogRow, &LogRow)| {
        a.steering_wheel_deg.to_bits() != b.steering_wheel_deg.to_bits()
    };
    assert!(first.iter().zip(&quiet).any(differs));
    let other = rows(noisy, 11);
    let other_error = other[0].ltr_measured.expect("none is lost") - other[0].ltr;
    assert!((other_error - errors[0]).abs() > 1e-9);
}

#[test]
fn the_recording_holds_measured_values_and_fills_those_that_were_lost() {
    let recorded = |sensors: &str| {
        let scenario = with_sensors(sensors).expect("valid");
        record(&scenario, &vehicle(&scenario), 10, &Interrupt::default()).expect("survived")
    };
    let (quiet, at_rest) = recorded("");
    let (noisy, summary) = recorded("[sensors.ltr]\nnoise_standard_deviation = 0.01");
    assert_eq!(summary.ltr_filled_samples, 0);
    assert_eq!(
        summary.ltr_abs_max.to_bits(),
        at_rest.ltr_abs_max.to_bits(),
        "the true one"
    );
    let outputs = |data: &deepc_core::data::Dataset| -> Vec<f64> {
        let outputs = data.records()[0].outputs();
        (0..outputs.nrows()).map(|k| outputs[(k, 0)]).collect()
    };
    let (quiet, noisy) = (outputs(&quiet), outputs(&noisy));
    let squares = quiet.iter().zip(&noisy).map(|(a, b)| (a - b).powi(2));
    let deviation = (squares.sum::<f64>() / quiet.len() as f64).sqrt();
    assert!((deviation - 0.01).abs() < 0.001, "{deviation}");

    let (lossy, summary) = recorded("[sensors.ltr]\ndrop_out_probability = 0.05");
    let lossy = outputs(&lossy);
    assert!(
        (100..230).contains(&summary.ltr_filled_samples),
        "{summary:?}"
    );
    let worst = quiet.iter().zip(&lossy).map(|(a, b)| (a - b).abs());
    assert!(worst.fold(0.0, f64::max) < 0.05);
    let dead = with_sensors("[sensors.ltr]\ndrop_out_probability = 1.0").expect("valid");
    let error = record(&dead, &vehicle(&dead), 10, &Interrupt::default()).expect_err("nothing");
    assert!(error.to_string().contains("lost every sample"), "{error:#}");
}

#[test]
fn a_run_with_drop_outs_ends_properly_and_the_log_shows_them() {
    let scenario = with_sensors("[sensors.ltr]\ndrop_out_probability = 0.05").expect("valid");
    let (_folder, log) = temporary_log();
    let controller = built(&scenario, 10).0;
    let finished = drive(&scenario, 10, Some(controller), &log).expect("the simulation runs");
    let read = run_log::read(&log).expect("the log is whole");
    assert_eq!(read, finished.rows);
    assert_eq!(read.len(), scenario.steps());
    let lost = read.iter().filter(|r| r.ltr_measured.is_none()).count();
    assert!((20..80).contains(&lost), "{lost}");
    // A lost sample is met by the plan at hand, and the next sample has a plan of its own.
    let mut answered = 0;
    for pair in read[150..].windows(2) {
        if pair[0].ltr_measured.is_none() {
            assert!(pair[1].solve_status.is_fallback(), "{:?}", pair[1]);
            answered += 1;
        } else {
            assert!(!pair[1].solve_status.is_fallback(), "{:?}", pair[1]);
        }
        assert!(pair[1].ltr.is_finite());
    }
    assert!(answered > 10);
    let identity = RunIdentity {
        scenario: "s".into(),
        vehicle: "v".into(),
        controller: "c".into(),
        seed: 10,
        recording: None,
        speed_reference_kmh: 105.0,
        ..RunIdentity::default()
    };
    let summary = Summary::of_log(identity, finished.outcome, &read, None, 0.01);
    assert_eq!(summary.ltr_lost_steps, lost);
}

#[test]
fn the_driver_steers_by_measured_position_and_holds_what_is_lost() {
    let with = |sensors: &str| {
        let scenario = with_sensors(sensors).expect("valid");
        let (_folder, log) = temporary_log();
        drive(&scenario, 10, None, &log)
            .expect("the simulation runs")
            .rows
    };
    let quiet = with("");
    let shifted = with("[sensors.y_m]\nbias = 1.0");
    // On the first straight the road lies along x: the driver keeps where he believes the middle is.
    let end = shifted[350];
    assert!((end.path_deviation_m + 1.0).abs() < 0.1, "{end:?}");
    assert!(quiet[350].path_deviation_m.abs() < 0.01);
    let lossy = with(
        "[sensors.y_m]\ndrop_out_probability = 0.5\n[sensors.yaw_rad]\ndrop_out_probability = 0.5",
    );
    assert_eq!(lossy.len(), quiet.len());
    assert!(lossy.iter().all(|r| r.path_deviation_m.abs() < 1.5));
    let blind = with("[sensors.y_m]\ndrop_out_probability = 1.0");
    assert!(blind.iter().all(|r| r.steering_wheel_deg.is_finite()));
}

/// Passes on a controller's decisions but for one.
struct Faulty {
    inner: Box<dyn Controller>,
    step: Option<Step>,
    decisions: usize,
    fails_at: usize,
}

impl Controller for Faulty {
    fn inputs(&self) -> usize {
        self.inner.inputs()
    }

    fn outputs(&self) -> usize {
        self.inner.outputs()
    }

    fn horizon(&self) -> usize {
        self.inner.horizon()
    }

    fn sample_time_s(&self) -> f64 {
        self.inner.sample_time_s()
    }

    fn decide(&mut self, reference: &Reference) -> &Step {
        let mut step = self.inner.decide(reference).clone();
        if self.decisions == self.fails_at {
            step.input[0] = f64::NAN;
        }
        self.decisions += 1;
        self.step.insert(step)
    }

    fn observe(&mut self, input: &[f64], output: &[f64]) {
        self.inner.observe(input, output);
    }

    fn reset(&mut self) {
        self.inner.reset();
    }
}

#[test]
fn a_command_that_is_no_number_stops_the_run_with_its_time_and_keeps_the_log() {
    let scenario = with_sensors("").expect("valid");
    for fails_at in [0, 137] {
        let faulty = Faulty {
            inner: built(&scenario, 10).0,
            step: None,
            decisions: 0,
            fails_at,
        };
        let (_folder, log) = temporary_log();
        let Err(error) = drive(&scenario, 10, Some(Box::new(faulty)), &log) else {
            panic!("a command that is no number must stop the run");
        };
        let message = format!("{error:#}");
        let time = format!("{:.2} s", fails_at as f64 * 0.01);
        for piece in [
            log.display().to_string(),
            format!("holds the {fails_at} steps taken"),
            format!("stopped after {time}"),
            format!("command handwheel_rad = NaN at {time}"),
        ] {
            assert!(message.contains(&piece), "expected `{piece}` in: {message}");
        }
        let kept = std::fs::read_to_string(&log).expect("the log stays");
        assert_eq!(kept.lines().count().saturating_sub(1), fails_at);
        if fails_at > 0 {
            assert_eq!(run_log::read(&log).expect("whole rows").len(), fails_at);
        }
    }
}

#[test]
fn sensors_that_cannot_be_are_refused_with_field_number_and_range() {
    for (sensors, pieces) in [
        (
            "[sensors.ltr]\nnoise_standard_deviation = -1.0",
            [
                "mine.toml",
                "`sensors.ltr.noise_standard_deviation` = -1",
                "[0, 1e6]",
            ],
        ),
        (
            "[sensors.ltr]\ndelay_s = 0.025",
            [
                "`sensors.ltr.delay_s` = 0.025",
                "whole number of samples",
                "0.030000",
            ],
        ),
        (
            "[sensors.roll_rate_rad_s]\nbias = 0.1",
            [
                "`sensors.roll_rate_rad_s`",
                "controllers read `ltr`",
                "`speed_m_s`",
            ],
        ),
        (
            "[sensors.ltr]\nnoise = 0.1",
            [
                "unknown field `noise`",
                "noise_standard_deviation",
                "mine.toml",
            ],
        ),
        (
            "[sensors.speed]\nbias = 0.1",
            ["unknown variant `speed`", "`speed_m_s`", "mine.toml"],
        ),
    ] {
        let message = with_sensors(sensors).expect_err("refused");
        for piece in pieces {
            assert!(message.contains(piece), "expected `{piece}` in: {message}");
        }
    }
    assert!(with_sensors("").expect("valid").controller(DRIVER).is_ok());
}
