//! `manoeuvre`: what it writes, and what it says of wrong input.

use vehicle_dyn::manoeuvre;

use super::{assert_says, fail, folder, read, succeed, write};

#[test]
fn a_manoeuvre_writes_its_report_pictures_and_a_log_per_run() {
    let folder = folder();
    let said = succeed(
        folder.path(),
        &["manoeuvre", "fishhook-1b", "--out", "hook"],
    );
    assert_says(&said, &["two-wheel lift", "failed", "hook/index.html"]);
    let out = folder.path().join("hook");
    let report: serde_json::Value =
        serde_json::from_str(&read(&out.join("summary.json"))).expect("JSON");
    assert_eq!(report["verdict"]["passed"], false);
    let runs = report["runs"].as_array().expect("runs");
    assert!(
        runs.len() >= 4,
        "slowly increasing steer and fishhooks, both ways"
    );
    for run in runs {
        let name = run["name"].as_str().expect("a name");
        let log = read(&out.join("runs").join(name).join("log.csv"));
        let mut rows = csv::Reader::from_reader(log.as_bytes());
        let rows = rows
            .deserialize::<rollover_app::manoeuvre::ManoeuvreLogRow>()
            .collect::<Result<Vec<_>, _>>()
            .expect("whole rows");
        assert!(rows.len() > 50, "{name}: {} rows", rows.len());
    }
    let page = read(&out.join("index.html"));
    assert_says(&page, &["<svg", "Figures of merit", "left-35-mph"]);
    assert!(out.join("figure-ltr.svg").is_file());
}

#[test]
fn old_results_of_another_manoeuvre_do_not_stay_and_other_files_do() {
    let folder = folder();
    let out = folder.path().join("out");
    succeed(
        folder.path(),
        &["manoeuvre", "slowly-increasing-steer", "--out", "out"],
    );
    let old = out.join("runs/slowly-increasing-steer-left/log.csv");
    assert!(old.is_file());
    write(&out.join("runs/mine.txt"), "mine");
    succeed(
        folder.path(),
        &["manoeuvre", "iso-7401-step", "--out", "out"],
    );
    assert!(!old.exists(), "a log of the manoeuvre before");
    assert_eq!(read(&out.join("runs/mine.txt")), "mine");
}

#[test]
fn json_on_standard_output_is_the_summary() {
    let folder = folder();
    let arguments = ["manoeuvre", "iso-7401-step", "--json", "--out", "out"];
    let said = succeed(folder.path(), &arguments);
    let file = read(&folder.path().join("out/summary.json"));
    assert_eq!(said, file);
    // Without --out the folder has the names of manoeuvre and vehicle.
    succeed(folder.path(), &["manoeuvre", "iso-7401-step"]);
    assert!(
        folder
            .path()
            .join("out/iso-7401-step/sedan/index.html")
            .is_file()
    );
}

#[test]
fn a_manoeuvre_may_be_a_file_and_a_wrong_one_is_refused_before_anything_is_written() {
    let folder = folder();
    let text = manoeuvre::embedded_text("iso-7401-step").expect("embedded");
    let slow = text.replacen("speed_kmh = 80.0", "speed_kmh = 60.0", 1);
    write(&folder.path().join("mine.toml"), &slow);
    succeed(folder.path(), &["manoeuvre", "mine.toml", "--out", "mine"]);

    write(
        &folder.path().join("wrong.toml"),
        &text.replacen("= 80.0", "= -80.0", 1),
    );
    let said = fail(
        folder.path(),
        &["manoeuvre", "wrong.toml", "--out", "wrong"],
    );
    assert_says(&said, &["manoeuvre.speed_kmh = -80", "[10, 250] km/h"]);
    assert!(!folder.path().join("wrong").exists());
}

#[test]
fn unknown_names_are_answered_with_the_nearest() {
    let folder = folder();
    let said = fail(folder.path(), &["manoeuvre", "fishook-1b"]);
    assert_says(&said, &["did you mean `fishhook-1b`?", "tilt-table"]);
    let said = fail(
        folder.path(),
        &["manoeuvre", "fishhook-1b", "--vehicle", "nothing"],
    );
    assert_says(&said, &["nothing", "sedan"]);
    let said = fail(folder.path(), &["run", "fishhook-1b"]);
    assert_says(&said, &["rollover-app manoeuvre fishhook-1b"]);
    let help = succeed(folder.path(), &["manoeuvre", "--help"]);
    assert_says(&help, &["fishhook-1b", "iso-4138-constant-radius"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_whole_logs_and_no_page() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    const PATIENCE: Duration = Duration::from_mins(2);

    let folder = folder();
    // Hundreds of runs, so that it is still at work on any machine.
    let text = manoeuvre::embedded_text("sine-with-dwell").expect("embedded");
    write(
        &folder.path().join("long.toml"),
        &text.replacen("multiple_step = 0.5", "multiple_step = 0.05", 1),
    );
    let running = super::command(folder.path(), &["manoeuvre", "long.toml", "--out", "out"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let out = folder.path().join("out");
    let first = out.join("runs/slowly-increasing-steer-left/log.csv");
    let started = Instant::now();
    while !first.is_file() {
        assert!(started.elapsed() < PATIENCE, "the manoeuvre does not begin");
        std::thread::sleep(Duration::from_millis(2));
    }
    let sent = Command::new("kill")
        .args(["-INT", &running.id().to_string()])
        .status();
    assert!(sent.expect("kill starts").success(), "the signal is sent");
    let output = running.wait_with_output().expect("the command ends");
    assert_eq!(output.status.code(), Some(130));
    assert_says(
        &String::from_utf8_lossy(&output.stderr),
        &["interrupted after", "runs"],
    );
    assert!(read(&first).ends_with('\n'), "a whole log");
    assert!(
        !out.join("index.html").exists(),
        "no page over half of the runs"
    );
}
