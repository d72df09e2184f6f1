//! Ctrl-C during a run.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rollover_app::run_log;

use super::{assert_says, command, folder, write};

/// Generous: a loaded machine may take long to get the run going.
const PATIENCE: Duration = Duration::from_mins(2);

/// Sends Ctrl-C.
pub(super) fn interrupt(process: u32) {
    let sent = Command::new("kill")
        .args(["-INT", &process.to_string()])
        .status();
    assert!(sent.expect("kill starts").success(), "the signal is sent");
}

/// Waits until a file holds something.
pub(super) fn wait_for_file(file: &Path) {
    let started = Instant::now();
    while std::fs::metadata(file).map_or(0, |m| m.len()) == 0 {
        assert!(started.elapsed() < PATIENCE, "no {}", file.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn what_was_logged_before_ctrl_c_stays_readable() {
    let folder = folder();
    // Ten times as long as the real one, so that it is still running on a machine under load.
    let long = include_str!("../../../../scenarios/sedan-s1.toml")
        .replacen("duration_s = 35.0", "duration_s = 350.0", 1)
        .replacen("straight_m = 430.0", "straight_m = 9800.0", 1);
    write(&folder.path().join("long.toml"), &long);
    let arguments = [
        "run",
        "long.toml",
        "--controller",
        "rd-deepc-1",
        "--out",
        "stopped",
    ];
    let running = command(folder.path(), &arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let log = folder.path().join("stopped/log.csv");
    // The first flush shows that the run is under way.
    wait_for_file(&log);
    interrupt(running.id());
    let output = running.wait_with_output().expect("the command ends");

    assert_eq!(
        output.status.code(),
        Some(130),
        "the shell's status for an interrupted program"
    );
    let message = String::from_utf8_lossy(&output.stderr);
    let rows = run_log::read(&log).expect("every row is whole");
    assert!(
        !rows.is_empty() && rows.len() < 35_000,
        "{} rows were written",
        rows.len()
    );
    assert_says(
        &message,
        &["interrupted", "log.csv", &format!("{} steps", rows.len())],
    );
    assert!(
        !folder.path().join("stopped/summary.json").exists(),
        "no summary of half a run"
    );
}

/// Waits until a process handles Ctrl-C itself; before that the signal would just kill it.
fn wait_for_handler(process: u32) {
    let started = Instant::now();
    let handles = || {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
        let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:"))?;
        // SIGINT is 2, the second lowest bit.
        Some(u64::from_str_radix(mask.trim(), 16).ok()? & 2 != 0)
    };
    while handles() == Some(false) {
        assert!(started.elapsed() < PATIENCE, "the command does not begin");
        std::thread::sleep(Duration::from_millis(1));
    }
    if handles().is_none() {
        // No such file on this system.
        std::thread::sleep(Duration::from_secs(1));
    }
}

#[test]
fn an_identification_that_is_stopped_leaves_what_was_there() {
    let folder = folder();
    let file = |name: &str| folder.path().join("out").join(name);
    write(
        &folder.path().join("tanks.csv"),
        &super::identify::tanks(300, 1),
    );
    super::succeed(folder.path(), &super::identify::with(&["--out", "out"]));
    let before = ["model.json", "report.json", "index.html"].map(|name| super::read(&file(name)));
    // Long enough to be under way on any machine.
    write(
        &folder.path().join("tanks.csv"),
        &super::identify::tanks(50_000, 2),
    );
    let running = command(folder.path(), &super::identify::with(&["--out", "out"]))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    wait_for_handler(running.id());
    interrupt(running.id());
    let output = running.wait_with_output().expect("the command ends");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert_says(&message, &["interrupted", "nothing was written"]);
    let after = ["model.json", "report.json", "index.html"].map(|name| super::read(&file(name)));
    assert_eq!(before, after, "one run's results, whole");
    let entries = std::fs::read_dir(folder.path().join("out")).expect("the folder is there");
    for entry in entries {
        let name = entry.expect("an entry").file_name();
        let name = name.to_string_lossy();
        assert!(!name.ends_with(".partial"), "{name} is half a file");
    }
}
