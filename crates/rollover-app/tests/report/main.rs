//! The report: from logs of any origin to a page that opens without a network.

mod browser;
mod claims;
mod command;
mod files;
mod logs;
mod page;
mod paper;

use rollover_app::report::data::{
    Claim, Columns, HeightProfile, Limits, Provenance, Reason, Report, Road, Role, Run, RunLink,
    Scene, Settings, TerrainMap, TimingRow, VehicleShape, Verdict,
};
use rollover_app::report::{run_figures, seed_rows};
use rollover_app::run_log::{LogRow, LogWriter, SolveStatus};
use vehicle_dyn::metrics::Outcome;

/// A made-up run: a left turn in which the inner wheels lift, or not.
fn columns(rows: u32, lean: f64) -> Columns {
    let mut columns = Columns::new();
    let time: Vec<f64> = (1..=rows).map(|k| f64::from(k) / 100.0).collect();
    let mut put = |name: &str, f: &dyn Fn(f64) -> f64| {
        columns.insert(name.into(), time.iter().map(|&t| f(t)).collect());
    };
    let end = f64::from(rows) / 100.0;
    let ltr = move |t: f64| lean * (std::f64::consts::PI * t / end).sin();
    put("time_s", &|t| t);
    put("ltr", &ltr);
    put("speed_kmh", &|t| 100.0 - t);
    put("target_speed_kmh", &|_| 100.0);
    put("target_speed_reference_kmh", &|_| 100.0);
    put("steering_wheel_deg", &|t| 60.0 * ltr(t));
    put("steering_wheel_reference_deg", &|t| 65.0 * ltr(t));
    put("steering_correction_deg", &|t| -5.0 * ltr(t));
    put("roll_deg", &|t| 6.0 * ltr(t));
    put("path_deviation_m", &|t| 0.5 * ltr(t));
    put("lateral_acceleration_m_s2", &|t| 8.0 * ltr(t));
    put("yaw_rate_deg_s", &|t| 15.0 * ltr(t));
    put("step_time_us", &|t| 10.0 + t);
    put("x_m", &|t| 27.0 * t);
    put("y_m", &|t| 0.9 * t * t);
    put("yaw_deg", &|t| 3.8 * t);
    put("two_wheel_clearance_m", &|t| (ltr(t).abs() - 1.0).max(0.0));
    for (name, side) in [
        ("load_front_left_n", -1.0),
        ("load_front_right_n", 1.0),
        ("load_rear_left_n", -1.0),
        ("load_rear_right_n", 1.0),
    ] {
        put(name, &|t| (3000.0 * (1.0 + side * ltr(t))).max(0.0));
    }
    columns
}

fn run(label: &str, role: Role, rows: u32, lean: f64, outcome: Outcome) -> Run {
    let columns = columns(rows, lean);
    Run {
        controller: label.into(),
        label: label.into(),
        description: format!("What {label} is."),
        role,
        seed: Some(10),
        ltr_limit: Some(0.9),
        outcome: Some(outcome),
        figures: run_figures(&columns, None),
        columns,
        ..Run::default()
    }
}

fn road() -> Road {
    let line = |offset: f64| {
        let points = (0..=120).map(|k| f64::from(k) * 2.0);
        points
            .map(|x| [x, 0.9 * (x / 27.0) * (x / 27.0) + offset])
            .collect()
    };
    Road {
        centre: line(0.0),
        left: line(3.5),
        right: line(-3.5),
        width_m: 7.0,
    }
}

fn scene() -> Scene {
    Scene {
        name: "turn".into(),
        title: "A turn".into(),
        description: "A made-up turn.".into(),
        road: Some(road()),
        terrain: Some(TerrainMap {
            x_min_m: -20.0,
            y_min_m: -40.0,
            spacing_m: 2.0,
            columns: 140,
            rows: 80,
            heights_m: (0..140 * 80)
                .map(|k| 0.02 * f64::from(k % 140) + 0.1 * f64::from(k / 140).sin())
                .collect(),
        }),
        profile: Some(HeightProfile {
            station_m: (0..200).map(f64::from).collect(),
            left_m: (0..200).map(|k| 0.03 * f64::from(k).sin()).collect(),
            right_m: (0..200).map(|k| 0.03 * f64::from(k).cos()).collect(),
        }),
        vehicle: Some(VehicleShape {
            name: "sedan".into(),
            assumed: false,
            ..VehicleShape::typical()
        }),
        limits: Limits {
            ltr: Some(1.0),
            target_speed_kmh: Some([90.0, 120.0]),
            steering_wheel_deg: Some([-200.0, 200.0]),
        },
        runs: vec![
            run("driver", Role::Driver, 500, 1.3, Outcome::RolledOver),
            run("rd-deepc-1", Role::Deepc, 800, 0.9, Outcome::Completed),
            run("lmpc", Role::Lmpc, 800, 1.02, Outcome::Completed),
        ],
    }
}

/// A report with everything in it.
fn full() -> Report {
    let scenes = vec![scene()];
    Report {
        title: "Everything".into(),
        asked: vec!["Does it hold?".into()],
        claims: vec![Claim {
            id: "lmpc-rolls".into(),
            group: "Sedan".into(),
            settings: Some(Settings::Recommended),
            claim: "The linear MPC rolls over.".into(),
            paper: "It rolls at 23 s.".into(),
            ours: "It stays on its wheels.".into(),
            seeds: (10..20).collect(),
            judged: 20,
            fraction: Some(0.1),
            verdict: Verdict::of_fraction(0.1),
            reason: Some(Reason {
                text: "Its speed gain is not identified.".into(),
                run: Some(RunLink {
                    scene: "turn".into(),
                    label: "lmpc".into(),
                }),
            }),
        }],
        timing: vec![TimingRow {
            method: "DeePC".into(),
            size: "600×3001".into(),
            paper_cost: Some(9.94),
            paper_time_s: Some(1.446),
            cost: Some(9.5),
            time_s: Some(0.8),
            ratio: Some(1.0),
            note: "three steps".into(),
        }],
        seeds: seed_rows(&scenes),
        scenes,
        unlogged: Vec::new(),
        problems: Vec::new(),
        notes: vec!["A note.".into()],
        provenance: Provenance {
            version: "0".into(),
            command: "none".into(),
            seeds: vec![10],
            machine: "a test".into(),
        },
    }
}

/// Row `step` of a log.
fn log_row(step: u32) -> LogRow {
    let k = f64::from(step);
    let lean = (k / 60.0).sin();
    LogRow {
        time_s: k / 100.0,
        steering_wheel_deg: 50.0 * lean,
        target_speed_kmh: 104.0,
        steering_wheel_reference_deg: 52.0 * lean,
        target_speed_reference_kmh: 105.0,
        ltr: 1.05 * lean,
        ltr_measured: (step % 5 != 3).then_some(lean),
        load_transfer_index: Some(lean),
        lateral_acceleration_m_s2: Some(7.0 * lean),
        yaw_rate_deg_s: Some(12.0 * lean),
        roll_rate_deg_s: Some(0.1),
        two_wheel_clearance_m: Some(0.0),
        load_front_left_n: 3000.0 * (1.0 - lean),
        load_front_right_n: 3000.0 * (1.0 + lean),
        load_rear_left_n: 2900.0 * (1.0 - lean),
        load_rear_right_n: 2900.0 * (1.0 + lean),
        roll_deg: 5.0 * lean,
        speed_kmh: 104.0 - k / 700.0,
        path_deviation_m: 0.3 * lean,
        station_m: Some(0.29 * k),
        x_m: 0.29 * k,
        y_m: 3.0 * lean,
        yaw_deg: 2.0 * lean,
        sideslip_deg: -0.2,
        solve_status: if step == 7 {
            SolveStatus::FallbackHold
        } else {
            SolveStatus::Solved
        },
        predicted_violation: 0.0,
        iterations: 3,
        step_time_us: 12.5,
    }
}

/// Writes a log of `rows` rows.
fn write_log(path: &std::path::Path, rows: u32) {
    let folder = path.parent().expect("a folder");
    std::fs::create_dir_all(folder).expect("a folder can be made");
    let mut writer = LogWriter::create(path).expect("the folder can be written");
    for step in 1..=rows {
        writer.append(&log_row(step)).expect("there is room");
    }
    writer.finish().expect("there is room");
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

fn text(path: &std::path::Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Asserts that a text holds every piece.
fn assert_says(text: &str, pieces: &[&str]) {
    for piece in pieces {
        assert!(text.contains(piece), "expected `{piece}` in: {text}");
    }
}
