//! Wrong files and settings: the message names the place, the number and what to do.

use std::path::Path;

use super::{assert_says, fail, folder, read, succeed, write};

const SEDAN: &str = include_str!("../../../../vehicles/sedan.toml");
const SCENARIO: &str = include_str!("../../../../scenarios/sedan-s1.toml");

/// Runs with a changed sedan and returns the message.
fn fail_with_vehicle(from: &str, to: &str) -> String {
    assert!(SEDAN.contains(from), "the sedan's file holds `{from}`");
    let folder = folder();
    write(&folder.path().join("mine.toml"), &SEDAN.replace(from, to));
    fail(
        folder.path(),
        &["run", "sedan-s1", "--vehicle", "mine.toml"],
    )
}

#[test]
fn an_unknown_key_of_a_vehicle_is_named_with_its_line() {
    let message = fail_with_vehicle("[mass]", "[mass]\nsprung_mas_kg = 3.0");
    assert_says(
        &message,
        &["mine.toml", "sprung_mas_kg", "line", "sprung_mass_kg"],
    );
}

#[test]
fn a_negative_mass_is_named_with_its_range() {
    let message = fail_with_vehicle("sprung_mass_kg = 1135.7", "sprung_mass_kg = -1135.7");
    assert_says(
        &message,
        &["mine.toml", "mass.sprung_mass_kg", "-1135.7", "kg"],
    );
}

#[test]
fn a_missing_unit_is_pointed_out() {
    let message = fail_with_vehicle("sprung_mass_kg", "sprung_mass");
    assert_says(
        &message,
        &["mine.toml", "`sprung_mass`", "`sprung_mass_kg`", "unit"],
    );
}

/// Runs `rd-deepc-1` on a recording changed line by line and returns the message.
fn fail_with_recording(change: impl Fn(Vec<String>) -> Vec<String>) -> String {
    let folder = folder();
    succeed(folder.path(), &["record", "sedan-s1", "--out", "."]);
    let path = folder.path().join("recording.csv");
    let lines = read(&path).lines().map(str::to_owned).collect();
    write(&path, &(change(lines).join("\n") + "\n"));
    let run = [
        "run",
        "sedan-s1",
        "--controller",
        "rd-deepc-1",
        "--recording",
        "recording.csv",
    ];
    fail(folder.path(), &run)
}

/// Replaces one field of a line.
fn replace_field(line: &str, column: usize, value: &str) -> String {
    let mut fields: Vec<&str> = line.split(',').collect();
    fields[column] = value;
    fields.join(",")
}

#[test]
fn nan_in_a_recording_is_named_with_channel_and_line() {
    let message = fail_with_recording(|mut lines| {
        lines[813] = replace_field(&lines[813], 2, "NaN");
        lines
    });
    assert_says(
        &message,
        &[
            "recording.csv",
            "target_speed_kmh",
            "NaN",
            "sample 812",
            "line 814",
        ],
    );
}

#[test]
fn a_missing_column_is_named_with_those_found() {
    let message = fail_with_recording(|mut lines| {
        lines[0] = lines[0].replace("ltr", "load_transfer");
        lines
    });
    assert_says(
        &message,
        &[
            "recording.csv",
            "`ltr`",
            "load_transfer",
            "steering_wheel_deg",
        ],
    );
}

#[test]
fn too_few_samples_are_told_with_the_number_needed() {
    let message = fail_with_recording(|lines| lines[..=300].to_vec());
    // (m + 1)(L + n) − 1 = 3·(200 + 8) − 1
    assert_says(&message, &["300", "623", "samples"]);
}

#[test]
fn a_constant_input_is_told_with_ranks_and_what_to_record() {
    let message = fail_with_recording(|lines| {
        let hold = |(index, line): (usize, &String)| {
            if index == 0 {
                line.clone()
            } else {
                replace_field(line, 2, "100")
            }
        };
        lines.iter().enumerate().map(hold).collect()
    });
    assert_says(
        &message,
        &[
            "persistently exciting",
            "rank",
            "needed 416",
            "`target_speed_kmh`",
            "constant",
            "noise",
        ],
    );
}

#[test]
fn an_empty_recording_is_told() {
    let message = fail_with_recording(|lines| lines[..1].to_vec());
    assert_says(&message, &["recording.csv", "no samples"]);
}

#[test]
fn a_recording_that_does_not_exist_is_named() {
    let run = [
        "run",
        "sedan-s1",
        "--controller",
        "rd-deepc-1",
        "--recording",
        "absent.csv",
    ];
    assert_says(&fail(folder().path(), &run), &["absent.csv"]);
}

#[test]
fn an_output_folder_that_cannot_be_written_is_named() {
    let folder = folder();
    write(
        &folder.path().join("taken"),
        "a file stands where the folder should be",
    );
    let message = fail(folder.path(), &["run", "sedan-s1", "--out", "taken/here"]);
    assert_says(&message, &["taken/here", "--out"]);
}

#[test]
fn unknown_names_are_answered_with_the_known_ones() {
    let folder = folder();
    let message = fail(folder.path(), &["run", "sedan-s11"]);
    assert_says(&message, &["`sedan-s11`", "did you mean `sedan-s1`?"]);
    let message = fail(folder.path(), &["run", "sedan-s1", "--controller", "pid"]);
    assert_says(&message, &["`pid`", "driver", "rd-deepc-1"]);
    let message = fail(folder.path(), &["run", "sedan-s1", "--vehicle", "tank"]);
    assert_says(&message, &["tank", "sedan"]);
}

/// Runs with a changed scenario file and returns the message.
fn fail_with_scenario(from: &str, to: &str) -> String {
    assert!(
        SCENARIO.contains(from),
        "the scenario's file holds `{from}`"
    );
    let folder = folder();
    let path = folder.path().join("mine.toml");
    write(&path, &SCENARIO.replacen(from, to, 1));
    fail(folder.path(), &["run", "mine.toml"])
}

#[test]
fn a_wrong_scenario_is_told_with_line_or_field() {
    let message = fail_with_scenario("duration_s = 35.0", "duration = 35.0");
    assert_says(&message, &["mine.toml", "line", "duration"]);
    let message = fail_with_scenario("duration_s = 35.0", "duration_s = 350.0");
    assert_says(&message, &["mine.toml", "course", "m long", "lengthen"]);
    let message = fail_with_scenario("friction = 0.85", "friction = -0.85");
    assert_says(
        &message,
        &["mine.toml", "ground.friction", "-0.85", "[0.01, 1.5]"],
    );
    let message = fail_with_scenario("horizon_steps = 100", "horizon_steps = 0");
    assert_says(&message, &["horizon_steps", "0", "[1, 10000]"]);
}

#[test]
fn a_speed_out_of_range_is_refused() {
    let message = fail(folder().path(), &["run", "sedan-s1", "--speed", "fast"]);
    assert_says(&message, &["fast", "km/h"]);
    let message = fail(folder().path(), &["run", "sedan-s1", "--speed", "-5"]);
    assert_says(&message, &["-5 km/h", "[10, 250]"]);
    let message = fail(folder().path(), &["run", "sedan-s1", "--speed", "150"]);
    assert_says(&message, &["150 km/h", "m long", "lengthen"]);
}

#[test]
fn a_failed_run_leaves_no_summary_behind() {
    let folder = folder();
    write(&folder.path().join("summary.json"), "{}");
    let message = fail(
        folder.path(),
        &[
            "run",
            "sedan-s1",
            "--controller",
            "rd-deepc-1",
            "--recording",
            "no.csv",
            "--out",
            ".",
        ],
    );
    assert_says(&message, &["no.csv"]);
    let log = folder.path().join("log.csv");
    assert!(!Path::new(&log).exists(), "nothing ran, so there is no log");
}

#[test]
fn a_dead_output_is_told() {
    let message = fail_with_recording(|lines| {
        let kill = |(index, line): (usize, &String)| {
            if index == 0 {
                line.clone()
            } else {
                replace_field(line, 3, "0.25")
            }
        };
        lines.iter().enumerate().map(kill).collect()
    });
    assert_says(&message, &["`ltr`", "constant at 0.25", "sensor"]);
}

#[test]
fn a_reference_outside_the_bounds_is_refused() {
    let controlled = [
        "run",
        "sedan-s1",
        "--controller",
        "rd-deepc-1",
        "--speed",
        "60",
    ];
    let message = fail(folder().path(), &controlled);
    assert_says(
        &message,
        &["60", "bounds.target_speed_kmh = [100, 120]", "rd-deepc-1"],
    );
    let message = fail_with_scenario(
        "target_speed_kmh = [100.0, 120.0]",
        "target_speed_kmh = [110.0, 120.0]",
    );
    assert_says(
        &message,
        &["bounds.target_speed_kmh", "[110, 120]", "around 105"],
    );
}

#[test]
fn a_name_that_would_leave_the_output_folder_is_refused() {
    let message = fail_with_scenario("name = \"sedan-s1\"", "name = \"../elsewhere\"");
    assert_says(&message, &["name", "`../elsewhere`", "letters"]);
}

#[test]
fn a_recording_that_leaves_the_road_is_refused() {
    let folder = folder();
    let sleepy = SCENARIO.replace(
        "preview_gain_deg_per_m = 24.0",
        "preview_gain_deg_per_m = 8.0",
    );
    write(&folder.path().join("mine.toml"), &sleepy);
    let message = fail(folder.path(), &["record", "mine.toml", "--out", "."]);
    assert_says(
        &message,
        &["did not survive the recording", "left_road", "wider turns"],
    );
    assert!(
        !folder.path().join("recording.csv").exists(),
        "nothing is kept of it"
    );
}
