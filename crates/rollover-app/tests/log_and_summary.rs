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
        ltr_measured: (step != 3).then_some(-0.9 - k / 201.0),
        load_transfer_index: Some(-0.9 - k / 190.0),
        lateral_acceleration_m_s2: Some(-6.1),
        yaw_rate_deg_s: Some(-12.3),
        roll_rate_deg_s: Some(0.1),
        two_wheel_clearance_m: Some(k / 1000.0),
        load_front_left_n: 3000.0 + 0.1,
        load_front_right_n: 3000.0,
        load_rear_left_n: 2900.0,
        load_rear_right_n: 0.0,
        roll_deg: -1.0 / 3.0,
        speed_kmh: 104.0 - k / 7.0,
        path_deviation_m: -k / 10.0,
        station_m: Some(29.0 * k / 100.0),
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

fn identity() -> RunIdentity {
    RunIdentity {
        scenario: "scenario".into(),
        vehicle: "vehicle".into(),
        controller: "controller".into(),
        seed: 7,
        recording: None,
        speed_reference_kmh: 105.0,
        ..RunIdentity::default()
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
fn a_log_without_measured_values_stays_readable() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let path = folder.path().join("log.csv");
    let mut writer = LogWriter::create(&path).expect("the folder can be written");
    for row in rows(5) {
        writer.append(&row).expect("there is room");
    }
    writer.finish().expect("there is room");
    let text = std::fs::read_to_string(&path).expect("the log is readable");
    let header: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
    let newer = [
        "ltr_measured",
        "load_transfer_index",
        "lateral_acceleration_m_s2",
        "yaw_rate_deg_s",
        "roll_rate_deg_s",
        "two_wheel_clearance_m",
    ];
    let older = |line: &str| -> String {
        let cells = header.iter().zip(line.split(','));
        let kept: Vec<&str> = cells
            .filter(|(name, _)| !newer.contains(name))
            .map(|(_, cell)| cell)
            .collect();
        kept.join(",") + "\n"
    };
    std::fs::write(&path, text.lines().map(older).collect::<String>()).expect("writable");
    let read = read(&path).expect("an older log is a log");
    assert_eq!(read.len(), 5);
    assert_eq!(read[1].ltr.to_bits(), row(2).ltr.to_bits());
    assert!(read.iter().all(|r| r.ltr_measured.is_none()));
    let summary = Summary::of_log(identity(), Outcome::Completed, &read, None, 0.01);
    assert_eq!(summary.ltr_lost_steps, 0);
    assert_eq!(summary.measures.load_transfer_index_abs_max, None);
    assert!((summary.measures.ltr_abs_max - 0.925).abs() < 1e-12);
}

#[test]
fn a_summary_written_before_there_were_measures_stays_readable() {
    let summary = Summary::of_log(identity(), Outcome::Completed, &rows(3), None, 0.01);
    let mut json = serde_json::to_value(&summary).expect("a summary is JSON");
    assert_eq!(
        serde_json::from_value::<Summary>(json.clone()).expect("it reads back"),
        summary
    );
    let fields = json.as_object_mut().expect("an object");
    fields.remove("measures").expect("it has measures");
    fields
        .remove("ltr_lost_steps")
        .expect("it counts lost samples");
    let older = serde_json::from_value::<Summary>(json).expect("an older summary is one");
    assert_eq!(older.ltr_lost_steps, 0);
}

#[test]
fn a_summary_has_the_rollover_measures_of_its_log() {
    let summary = Summary::of_log(identity(), Outcome::Completed, &rows(100), None, 0.01);
    let found = summary.measures;
    assert_eq!(summary.ltr_lost_steps, 1);
    assert!((found.ltr_abs_max - 1.4).abs() < 1e-12);
    assert_eq!(found.ltr_abs_max_time_s, Some(1.0));
    // Only one right wheel carries nothing.
    assert_eq!(found.two_wheel_lift_first_s, None);
    assert_eq!(found.two_wheel_clearance_max_m, Some(0.1));
    assert!((found.roll_abs_max_rad - (1.0_f64 / 3.0).to_radians()).abs() < 1e-12);
    assert_eq!(found.time_to_lift_min_s, Some(0.0));
    assert!((found.path_deviation_abs_max_m - 10.0).abs() < 1e-12);
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
    let weights = InputWeights {
        steering_wheel_per_deg2: 2.0,
        target_speed_per_kmh2: 0.5,
    };
    let rows = rows(100);
    let summary = Summary::of_log(identity(), Outcome::LeftRoad, &rows, Some(&weights), 0.01);
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
    let cost = summary.cost.expect("there are weights");
    assert!((cost - 100.0 * (2.0 * 9.0 + 0.5 * 4.0)).abs() < 1e-9);
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
    let weights = InputWeights {
        steering_wheel_per_deg2: 1.0,
        target_speed_per_kmh2: 5e-4,
    };
    let summary = Summary::of_log(
        identity(),
        Outcome::RolledOver,
        &rows(3),
        Some(&weights),
        0.01,
    );
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
