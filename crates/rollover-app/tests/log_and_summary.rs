//! The run log reads back what was written, and the summary is computed from it alone.

use rollover_app::run_log::{LogRow, LogWriter, SolveStatus, read};
use rollover_app::summary::{InputWeights, RunIdentity, Summary};
use vehicle_dyn::metrics::Outcome;

/// Row `step` of a made-up run at 10 ms, with numbers that do not print exactly.
fn row(step: u32) -> LogRow {
    let k = f64::from(step);
    LogRow {
        time_s: k / 100.0,
        steering_wheel_deg: 10.0 + k / 3.0,
        target_speed_kmh: 105.0 - 2.0,
        steering_wheel_reference_deg: 10.0 + k / 3.0 + 3.0,
        target_speed_reference_kmh: 105.0,
        ltr: -0.9 - k / 200.0,
        load_front_left_n: 3000.0 + 0.1,
        load_front_right_n: 3000.0,
        load_rear_left_n: 2900.0,
        load_rear_right_n: 0.0,
        roll_deg: -1.0 / 3.0,
        speed_kmh: 104.0 - k / 7.0,
        path_deviation_m: -k / 10.0,
        x_m: 29.0 * k / 100.0,
        y_m: 0.1,
        yaw_deg: 0.0,
        sideslip_deg: -0.2,
        solve_status: if step == 2 {
            SolveStatus::FallbackHold
        } else {
            SolveStatus::Solved
        },
        predicted_violation: 1e-17,
        iterations: step,
        step_time_us: k,
    }
}

fn rows(count: u32) -> Vec<LogRow> {
    (1..=count).map(row).collect()
}

#[test]
fn a_log_reads_back_to_the_same_bits() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("log.csv");
    let mut writer = LogWriter::create(&path).expect("the folder can be written");
    for row in rows(123) {
        writer.append(&row).expect("there is room");
    }
    writer.finish().expect("there is room");
    assert_eq!(read(&path).expect("the log is whole"), rows(123));
}

#[test]
fn a_truncated_log_is_refused_with_its_name() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("log.csv");
    let mut writer = LogWriter::create(&path).expect("the folder can be written");
    writer.append(&row(1)).expect("there is room");
    writer.append(&row(2)).expect("there is room");
    writer.finish().expect("there is room");
    let text = std::fs::read_to_string(&path).expect("the log is readable");
    std::fs::write(&path, &text[..text.len() - 40]).expect("the folder can be written");
    let message = format!("{:#}", read(&path).expect_err("half a row is missing"));
    assert!(
        message.contains("log.csv") && message.contains("line: 3"),
        "{message}"
    );
}

#[test]
fn a_summary_counts_what_the_log_holds() {
    let identity = RunIdentity {
        scenario: "scenario".into(),
        vehicle: "vehicle".into(),
        controller: "controller".into(),
        seed: 7,
        recording: None,
        speed_reference_kmh: 105.0,
        model: None,
    };
    let weights = InputWeights {
        steering_wheel_per_deg2: 2.0,
        target_speed_per_kmh2: 0.5,
    };
    let rows = rows(100);
    let summary = Summary::of_log(identity, Outcome::LeftRoad, &rows, Some(&weights), 0.01);
    assert_eq!(
        (summary.steps, summary.fallback_steps, summary.solver_steps),
        (100, 1, 99)
    );
    assert_eq!(summary.end_time_s.to_bits(), 1.0_f64.to_bits());
    assert!((summary.ltr_abs_max - 1.4).abs() < 1e-12);
    // |LTR| = 0.9 + k/200 exceeds 1 from k = 21 on.
    assert!(
        (summary.ltr_violation_s - 0.80).abs() < 1e-12,
        "{}",
        summary.ltr_violation_s
    );
    assert!((summary.cost - 100.0 * (2.0 * 9.0 + 0.5 * 4.0)).abs() < 1e-9);
    assert!((summary.path_deviation_max_m - 10.0).abs() < 1e-12);
    assert!((summary.steering_correction_max_deg - 3.0).abs() < 1e-12);
    assert!((summary.speed_min_kmh - (104.0 - 100.0 / 7.0)).abs() < 1e-12);
    assert!((summary.speed_mean_kmh - (104.0 - 50.5 / 7.0)).abs() < 1e-12);
    let times = summary.step_time_us;
    assert_eq!(
        [times.median, times.p99, times.max].map(f64::to_bits),
        [50.0, 99.0, 100.0].map(f64::to_bits)
    );
}

#[test]
fn summary_json_has_the_fields_programs_rely_on() {
    let identity = RunIdentity {
        scenario: "s".into(),
        vehicle: "v".into(),
        controller: "c".into(),
        seed: 1,
        recording: None,
        speed_reference_kmh: 105.0,
        model: None,
    };
    let summary = Summary::of_log(identity, Outcome::RolledOver, &rows(3), None, 0.01);
    let json = serde_json::to_value(&summary).expect("a summary is JSON");
    let fields = [
        "scenario",
        "vehicle",
        "controller",
        "seed",
        "outcome",
        "end_time_s",
        "ltr_abs_max",
        "ltr_violation_s",
        "speed_min_kmh",
        "speed_mean_kmh",
        "path_deviation_max_m",
        "cost",
        "steps",
        "fallback_steps",
        "step_time_us",
    ];
    for field in fields {
        assert!(!json[field].is_null(), "`{field}` is missing");
    }
    assert_eq!(json["outcome"], "rolled_over");
    for field in ["median", "p99", "max"] {
        assert!(
            json["step_time_us"][field].is_number(),
            "`step_time_us.{field}` is missing"
        );
    }
}
