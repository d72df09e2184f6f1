//! Logs that are not whole: the rest is read, and what is wrong is named.

use std::path::PathBuf;

use rollover_app::report::data::{Report, Role};
use rollover_app::report::log::{COLUMN_NAMES, Renamed, STATUS_NAMES, Table, parse};
use rollover_app::report::{collect, has_runs, run_figures};
use rollover_app::run_log;
use rollover_app::summary::{InputWeights, RunIdentity, Summary};
use vehicle_dyn::metrics::Outcome;

use super::{assert_says, folder, text, write_log};

fn parse_text(text: &str) -> Table {
    parse("a.csv", text.as_bytes(), &Renamed::new())
}

/// The only problem of a table, as it is printed.
fn problem(table: &Table) -> String {
    assert_eq!(table.problems.len(), 1, "{:?}", table.problems);
    table.problems[0].to_string()
}

fn collect_one(path: PathBuf) -> Report {
    collect(&[path], &Renamed::new())
}

#[test]
fn column_names_are_those_of_the_log() {
    let folder = folder();
    let path = folder.path().join("log.csv");
    write_log(&path, 2);
    let header = text(&path).lines().next().expect("a header").to_owned();
    assert_eq!(header, COLUMN_NAMES.join(","));
}

#[test]
fn status_names_are_those_of_the_log() {
    for (name, status) in STATUS_NAMES {
        assert_eq!(serde_json::to_value(status).expect("a word"), name);
    }
}

#[test]
fn numbers_from_columns_are_those_of_the_summary() {
    let folder = folder();
    let path = folder.path().join("log.csv");
    write_log(&path, 400);
    let weights = InputWeights {
        steering_wheel_per_deg2: 1.0,
        target_speed_per_kmh2: 5e-4,
    };
    let identity = RunIdentity {
        scenario: "s".into(),
        vehicle: "v".into(),
        controller: "c".into(),
        seed: 1,
        recording: None,
        speed_reference_kmh: 105.0,
        ..RunIdentity::default()
    };
    let rows = run_log::read(&path).expect("the log is whole");
    let summary = Summary::of_log(identity, Outcome::Completed, &rows, Some(&weights), 0.01);
    let report = collect_one(path);
    let columns = &report.scenes[0].runs[0].columns;
    let found = run_figures(columns, Some(&weights));
    let close = |a: Option<f64>, b: f64| {
        let a = a.expect("the log tells it");
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} is not {b}");
    };
    close(found.ltr_abs_max, summary.ltr_abs_max);
    close(found.ltr_violation_s, summary.ltr_violation_s);
    close(found.speed_min_kmh, summary.speed_min_kmh);
    close(found.speed_mean_kmh, summary.speed_mean_kmh);
    close(found.path_deviation_max_m, summary.path_deviation_max_m);
    close(
        found.steering_correction_max_deg,
        summary.steering_correction_max_deg,
    );
    close(found.cost, summary.cost.expect("there are weights"));
    close(found.step_time_median_us, summary.step_time_us.median);
    close(found.end_time_s, summary.end_time_s);
    assert_eq!(found.steps, summary.steps);
    assert_eq!(found.fallback_steps, Some(summary.fallback_steps));
    assert_eq!(report.scenes[0].runs[0].outcome, Some(Outcome::Completed));
}

#[test]
fn half_a_last_row_costs_that_row_only() {
    let folder = folder();
    let path = folder.path().join("log.csv");
    write_log(&path, 50);
    let whole = text(&path);
    // Within the last row, and within its last number.
    for (cut, says) in [(60, "fields"), (2, "does not end")] {
        let table = parse_text(&whole[..whole.len() - cut]);
        assert_eq!(table.rows(), 49);
        assert_says(&problem(&table), &["a.csv", "line 51", says]);
    }
}

#[test]
fn spoilt_lines_in_the_middle_are_left_out() {
    let table =
        parse_text("time_s,ltr\n0.1,0.5\n0.2\n0.3,0.4\nx,0.1\n0.2,0.1\n0.4,oops\n0.5,0.2\n");
    assert_eq!(table.rows(), 4);
    let ltr = &table.columns["ltr"];
    assert!(ltr[2].is_nan(), "a gap and no zero");
    let lines: Vec<_> = table.problems.iter().map(|p| p.line).collect();
    assert_eq!(lines, [Some(3), Some(5), Some(6), Some(7)]);
}

#[test]
fn one_kind_of_problem_is_told_once() {
    let rows: Vec<String> = (0..500).map(|k| format!("{k},?")).collect();
    let table = parse_text(&format!("time_s,ltr\n{}\n", rows.join("\n")));
    assert_says(&problem(&table), &["line 2", "first of 500", "`ltr`"]);
    assert!(!table.columns.contains_key("ltr"), "it holds no number");
}

#[test]
fn files_that_are_no_logs_are_named() {
    for (bytes, says) in [
        (&b""[..], "empty"),
        (b"  \n\n", "empty"),
        (b"\x7fELF\x00\x01\x02", "binary"),
        (b"time_s,ltr\n", "no rows"),
        (b"time_s,colour\n1,red\n", "colour"),
        (b"t,ltr\n1,2\n", "time_s"),
        (b"\xff\xfe\xfd", "time_s"),
    ] {
        let table = parse("a.csv", bytes, &Renamed::new());
        assert_eq!(table.rows(), 0);
        assert_says(&problem(&table), &["a.csv", says, "left out"]);
    }
}

#[test]
fn columns_of_other_names_are_read_where_told() {
    let renamed: Renamed = [("time_s", "Time"), ("speed_kmh", "VehSpd")]
        .map(|(ours, theirs)| (ours.to_owned(), theirs.to_owned()))
        .into();
    for separator in [",", ";", "\t"] {
        let text = "\u{feff}Time,VehSpd,ltr\n0.0,100.0,\n0.1,99.5,0.2\n".replace(',', separator);
        let table = parse("a.csv", text.as_bytes(), &renamed);
        assert!(table.problems.is_empty(), "{:?}", table.problems);
        assert_eq!(table.columns["speed_kmh"].len(), 2);
        assert!(table.columns["ltr"][0].is_nan());
    }
}

#[test]
fn a_folder_with_spoilt_logs_shows_the_others() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name).join("log.csv");
    write_log(&at("good"), 100);
    write_log(&at("deep/er/rd-deepc-1"), 100);
    for name in ["empty", "binary"] {
        std::fs::create_dir_all(folder.path().join(name)).expect("a folder can be made");
    }
    std::fs::write(at("empty"), "").expect("writable");
    std::fs::write(at("binary"), [0, 159, 146, 150]).expect("writable");
    std::fs::write(folder.path().join("good/summary.json"), "{ half").expect("writable");
    let report = collect_one(folder.path().to_path_buf());
    let labels: Vec<&str> = report.scenes[0]
        .runs
        .iter()
        .map(|r| r.label.as_str())
        .collect();
    assert_eq!(labels, ["rd-deepc-1", "good"]);
    assert_eq!(report.scenes[0].runs[0].role, Role::Deepc);
    let problems: Vec<String> = report.problems.iter().map(ToString::to_string).collect();
    let all = problems.join("\n");
    assert_eq!(problems.len(), 3, "{all}");
    assert_says(&all, &["empty", "binary", "summary.json, line 1"]);
}

#[test]
fn nothing_to_show_is_said() {
    let folder = folder();
    for path in [
        folder.path().to_path_buf(),
        folder.path().join("absent.csv"),
    ] {
        let report = collect_one(path);
        assert!(!has_runs(&report));
        assert_eq!(report.problems.len(), 1, "{:?}", report.problems);
    }
}

#[test]
fn a_log_cut_short_is_judged_by_what_is_there() {
    let folder = folder();
    let path = folder.path().join("log.csv");
    write_log(&path, 100);
    let summary =
        serde_json::json!({ "controller": "lmpc", "outcome": "rolled_over", "steps": 2300 });
    std::fs::write(folder.path().join("summary.json"), summary.to_string()).expect("writable");
    let report = collect_one(folder.path().to_path_buf());
    let run = &report.scenes[0].runs[0];
    assert_eq!((run.label.as_str(), run.role), ("lmpc", Role::Lmpc));
    assert_eq!(run.outcome, Some(Outcome::Completed));
    assert_says(
        &report.problems[0].to_string(),
        &["`completed`", "`rolled_over`"],
    );
}

#[test]
fn a_rollover_is_seen_in_the_log_alone() {
    let folder = folder();
    let path = folder.path().join("car.csv");
    let row = |k: u32| format!("{},{}", f64::from(k) / 10.0, f64::from(k) * 0.7);
    let rows = (0..100).map(row).collect::<Vec<_>>().join("\n");
    std::fs::write(&path, format!("time_s,roll_deg\n{rows}\n")).expect("writable");
    let report = collect_one(path);
    assert_eq!(report.scenes[0].runs[0].outcome, Some(Outcome::RolledOver));
    assert_eq!(report.scenes[0].runs[0].label, "car");
    assert_says(&report.notes.join(" "), &["do not say what vehicle"]);
}

#[test]
fn a_log_without_roll_has_no_outcome() {
    let folder = folder();
    let path = folder.path().join("car.csv");
    std::fs::write(&path, "time_s,speed_kmh\n0,100\n1,99\n").expect("writable");
    assert_eq!(collect_one(path).scenes[0].runs[0].outcome, None);
}

#[test]
fn runs_of_one_name_are_told_apart_by_their_folders() {
    let folder = folder();
    for name in ["a/driver", "b/driver"] {
        let path = folder.path().join(name).join("log.csv");
        write_log(&path, 20);
    }
    let report = collect_one(folder.path().to_path_buf());
    let labels: Vec<&str> = report.scenes[0]
        .runs
        .iter()
        .map(|run| run.label.as_str())
        .collect();
    assert_eq!(labels, ["driver (a/driver)", "driver (b/driver)"]);
}
