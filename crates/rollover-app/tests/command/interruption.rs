//! Ctrl-C during a run.
#![cfg(unix)]

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rollover_app::run_log;

use super::{assert_says, command, folder};

/// Generous: a loaded machine may take long to get the run going.
const PATIENCE: Duration = Duration::from_mins(2);

#[test]
fn what_was_logged_before_ctrl_c_stays_readable() {
    let folder = folder();
    let arguments = [
        "run",
        "sedan-s1",
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
    let started = Instant::now();
    // The first flush shows that the run is under way.
    while std::fs::metadata(&log).map_or(0, |m| m.len()) == 0 {
        assert!(started.elapsed() < PATIENCE, "the run does not begin");
        std::thread::sleep(Duration::from_millis(2));
    }
    let id = running.id().to_string();
    let sent = Command::new("kill")
        .args(["-INT", &id])
        .status()
        .expect("kill starts");
    assert!(sent.success(), "the signal is sent");
    let output = running.wait_with_output().expect("the command ends");

    assert_eq!(
        output.status.code(),
        Some(130),
        "the shell's status for an interrupted program"
    );
    let message = String::from_utf8_lossy(&output.stderr);
    let rows = run_log::read(&log).expect("every row is whole");
    assert!(
        !rows.is_empty() && rows.len() < 3500,
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
