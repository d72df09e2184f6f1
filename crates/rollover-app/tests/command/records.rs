//! Recordings of several records: files, seeds and messages.

use std::path::Path;

use serde_json::Value;

use super::{assert_says, fail, folder, read, succeed, write};

const SCENARIO: &str = include_str!("../../../../scenarios/riverbed-s3.toml");

/// Checks a changed scenario and returns the message.
fn fail_with_scenario(from: &str, to: &str) -> String {
    assert!(SCENARIO.contains(from), "the scenario holds `{from}`");
    let folder = folder();
    write(
        &folder.path().join("mine.toml"),
        &SCENARIO.replacen(from, to, 1),
    );
    fail(folder.path(), &["scenarios", "check", "mine.toml"])
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&read(path)).expect("the file is JSON")
}

/// Line of the first line of the scenario that holds a text, from 1.
fn line_of(text: &str) -> String {
    let line = SCENARIO.lines().position(|line| line.contains(text));
    format!("line {}", line.expect("it is there") + 1)
}

#[test]
fn each_record_has_its_file_and_its_numbers() {
    let folder = folder();
    let said = succeed(
        folder.path(),
        &["record", "riverbed-s3", "--seed", "3", "--out", "."],
    );
    assert_says(&said, &["recording.csv: 3200 ", "recording-2.csv: "]);
    let summary = json(&folder.path().join("recording.json"));
    let records = summary["records"].as_array().expect("there are several");
    let samples: Vec<u64> = records
        .iter()
        .filter_map(|record| record["samples"].as_u64())
        .collect();
    assert_eq!(samples.len(), 2);
    assert_eq!(summary["samples"], samples.iter().sum::<u64>());
    for (name, samples) in ["recording.csv", "recording-2.csv"].iter().zip(samples) {
        let lines = read(&folder.path().join(name)).lines().count() as u64;
        assert_eq!(lines, samples + 1, "{name}");
    }
    assert_eq!(records[0]["seed"], 3);
    assert_ne!(records[1]["seed"], 3);

    // What a longer recording left would pass for a part of a shorter one.
    succeed(folder.path(), &["record", "sedan-s1", "--out", "."]);
    assert!(folder.path().join("recording.csv").exists());
    assert!(!folder.path().join("recording-2.csv").exists());
    let summary = json(&folder.path().join("recording.json"));
    assert!(summary.get("records").is_none(), "{summary}");
}

#[test]
fn records_read_back_give_the_same_run() {
    let folder = folder();
    let run = ["run", "riverbed-s3", "--controller", "rd-deepc-1"];
    let go = |arguments: &[&str]| succeed(folder.path(), &[&run, arguments].concat());
    go(&["--seed", "4", "--out", "made"]);
    let (first, second) = ("made/recording.csv", "made/recording-2.csv");
    let both = format!("{first},{second}");
    go(&["--seed", "4", "--recording", &both, "--out", "listed"]);
    go(&[
        "--seed",
        "4",
        "--recording",
        first,
        "--recording",
        second,
        "--out",
        "given",
    ]);
    let columns = |out: &str| -> Vec<String> {
        let log = read(&folder.path().join(out).join("log.csv"));
        let without_time = |line: &str| line.rsplit_once(',').map(|(kept, _)| kept.to_owned());
        log.lines().filter_map(without_time).collect()
    };
    assert_eq!(columns("made"), columns("listed"));
    assert_eq!(columns("made"), columns("given"));
    let summary = json(&folder.path().join("given/summary.json"));
    assert_eq!(summary["recording"], format!("{first}, {second}"));
}

#[test]
fn too_few_files_for_a_controller_are_told() {
    let folder = folder();
    let text = SCENARIO.replacen("records = 1", "records = 2", 1);
    write(&folder.path().join("mine.toml"), &text);
    succeed(folder.path(), &["record", "mine.toml", "--out", "."]);
    let run = ["run", "mine.toml", "--controller", "rd-deepc-1-smooth-data"];
    let message = fail(
        folder.path(),
        &[&run[..], &["--recording", "recording.csv"]].concat(),
    );
    assert_says(&message, &["2 records", "`records`", "has 1"]);
}

#[test]
fn values_of_a_further_record_are_checked_at_their_place() {
    let message = fail_with_scenario(
        "[[recording.more]]\n",
        "[[recording.more]]\ntarget_speed_noise_kmh = -1.0\n",
    );
    assert_says(
        &message,
        &[
            "`recording.more[0].target_speed_noise_kmh` = -1",
            "in [0, 50]",
            "target_speed_noise_kmh = -1.0\n",
        ],
    );
    let message = fail_with_scenario("[[recording.more]]\n", "[[recording.more]]\nnoise = 1\n");
    assert_says(&message, &["unknown field `noise`", "noise = 1\n"]);
}

#[test]
fn a_further_road_that_is_too_short_is_told() {
    let message = fail_with_scenario(
        "[[recording.more]]\nduration_s = 10.0",
        "[[recording.more]]\nduration_s = 60.0",
    );
    assert_says(
        &message,
        &[
            "recording.more[0].course: the road is",
            "60 s at 100 km/h",
            &line_of("[recording.more.course]"),
        ],
    );
}

#[test]
fn grounds_of_further_records_are_checked_at_their_place() {
    let ground = "[recording.more.ground]\nfriction = 0.85";
    let message = fail_with_scenario(ground, "[recording.more.ground]\nfriction = -0.85");
    let line = line_of("[recording.more.ground]");
    let number: usize = line["line ".len()..].parse().expect("a number");
    assert_says(
        &message,
        &[
            "recording.more[0].ground.friction",
            "-0.85",
            &format!("line {}", number + 1),
        ],
    );
}

#[test]
fn a_ground_taken_over_must_fit_the_further_course() {
    let own = SCENARIO
        .find("[recording.more.ground]")
        .expect("it is there");
    let course = SCENARIO
        .find("[recording.more.course]")
        .expect("it is there");
    let without = SCENARIO[..own].to_owned() + &SCENARIO[course..];
    let bump = "[recording.ground]\nbumps = [{ station_m = 500.0, offset_m = 0.0, length_m = 1.5, \
                width_m = 3.0, height_m = 0.06 }]\n";
    let folder = folder();
    let text = without.replacen("[recording.ground]\n", bump, 1);
    write(&folder.path().join("mine.toml"), &text);
    let message = fail(folder.path(), &["scenarios", "check", "mine.toml"]);
    assert_says(
        &message,
        &[
            "recording.more[0].course has no [recording.more.ground] of its own",
            "recording.ground.bumps",
            "500",
        ],
    );
}

#[test]
fn a_controller_uses_no_more_records_than_there_are() {
    let message = fail_with_scenario("records = 1\n", "records = 3\n");
    assert_says(
        &message,
        &[
            "`controllers.rd-deepc-1-smooth-data.records` = 3",
            "in [1, 2]",
            "records = 3\n",
        ],
    );
    let message = fail_with_scenario("records = 1\n", "records = 0\n");
    assert_says(&message, &["= 0", "in [1, 2]"]);
}
