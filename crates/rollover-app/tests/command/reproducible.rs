//! The same seed gives the same bytes; another seed another recording.

use std::path::Path;

use super::{command, folder, read, succeed};

/// The log without its last column, the measured time of each step.
pub(super) fn log_without_times(path: &Path) -> String {
    let text = read(path);
    let header = text.lines().next().expect("a log has a header");
    assert!(
        header.ends_with(",step_time_us"),
        "the last column is the time: {header}"
    );
    let cut = |line: &str| line.rsplit_once(',').map(|(rest, _)| rest.to_owned());
    text.lines().filter_map(cut).collect::<Vec<_>>().join("\n")
}

fn drive(folder: &Path, out: &str, seed: &str) {
    let arguments = [
        "run",
        "sedan-s1",
        "--controller",
        "rd-deepc-1",
        "--seed",
        seed,
        "--out",
        out,
        "--json",
    ];
    let summary: serde_json::Value =
        serde_json::from_str(&succeed(folder, &arguments)).expect("--json prints JSON");
    assert_eq!(summary["seed"].to_string(), seed);
}

#[test]
fn a_seed_fixes_recording_and_log() {
    let folder = folder();
    for (out, seed) in [("a", "3"), ("b", "3"), ("c", "4")] {
        drive(folder.path(), out, seed);
    }
    let file = |out: &str, name: &str| folder.path().join(out).join(name);
    assert_eq!(
        read(&file("a", "recording.csv")),
        read(&file("b", "recording.csv"))
    );
    assert_ne!(
        read(&file("a", "recording.csv")),
        read(&file("c", "recording.csv"))
    );
    assert_eq!(
        log_without_times(&file("a", "log.csv")),
        log_without_times(&file("b", "log.csv"))
    );
    assert_ne!(
        log_without_times(&file("a", "log.csv")),
        log_without_times(&file("c", "log.csv"))
    );
}

#[test]
fn record_and_run_make_the_same_recording() {
    let folder = folder();
    succeed(
        folder.path(),
        &["record", "sedan-s1", "--seed", "7", "--out", "recorded"],
    );
    drive(folder.path(), "run", "7");
    let file = |out: &str| folder.path().join(out).join("recording.csv");
    assert_eq!(read(&file("recorded")), read(&file("run")));
}

#[test]
fn a_recording_read_back_gives_the_same_run() {
    let folder = folder();
    drive(folder.path(), "made", "5");
    let again = [
        "run",
        "sedan-s1",
        "--controller",
        "rd-deepc-1",
        "--recording",
        "made/recording.csv",
        "--out",
        "read",
    ];
    succeed(folder.path(), &again);
    let log = |out: &str| log_without_times(&folder.path().join(out).join("log.csv"));
    assert_eq!(log("made"), log("read"));
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let folder = folder();
    let mut running = command(folder.path(), &["run", "sedan-s1", "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(running.stdout.take());
    let output = running.wait_with_output().expect("the command ends");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "a closed pipe must not fail the run: {errors}"
    );
}
