//! `rollover-app report` as a user meets it.

use std::path::Path;
use std::process::{Command, Output};

use super::{assert_says, folder, text, write_log};

fn report(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rollover-app"))
        .current_dir(folder)
        .arg("report")
        .args(arguments)
        .output()
        .expect("the command starts")
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_folder_with_a_cut_log_is_reported_and_the_file_named() {
    let folder = folder();
    let out = folder.path().join("out");
    write_log(&out.join("good/log.csv"), 200);
    write_log(&out.join("cut/log.csv"), 200);
    let whole = text(&out.join("cut/log.csv"));
    std::fs::write(out.join("cut/log.csv"), &whole[..whole.len() / 2]).expect("writable");
    std::fs::create_dir(out.join("bad")).expect("a folder can be made");
    std::fs::write(out.join("bad/log.csv"), [0; 100]).expect("writable");
    let output = report(folder.path(), &["out", "--json"]);
    let says = errors(&output);
    assert_eq!(output.status.code(), Some(0), "{says}");
    assert_says(
        &says,
        &["out/cut/log.csv, line ", "out/bad/log.csv", "binary"],
    );
    let printed: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(printed["runs"].as_array().map(Vec::len), Some(2));
    assert_eq!(printed["problems"].as_array().map(Vec::len), Some(2));
    let page = text(&out.join("report.html"));
    assert_says(&page, &["out/cut/log.csv", "out/bad/log.csv"]);
    assert!(out.join("figures/scenes/logs-ltr.svg").exists());
    assert_says(
        &text(&out.join("tables/problems.csv")),
        &["out/bad/log.csv"],
    );
}

#[test]
fn a_log_of_a_real_vehicle_is_reported() {
    let folder = folder();
    let row = |k: u32| format!("{:.2},{},{}", f64::from(k) / 50.0, 80 + k % 7, k % 30);
    let rows = (0..300).map(row).collect::<Vec<_>>().join("\n");
    std::fs::write(
        folder.path().join("drive.csv"),
        format!("Time,VehSpd,SteerAng\n{rows}"),
    )
    .expect("writable");
    let arguments = [
        "drive.csv",
        "--column",
        "time_s=Time",
        "--column",
        "speed_kmh=VehSpd",
        "--column",
        "steering_wheel_deg=SteerAng",
        "--title",
        "Test drive",
        "--out",
        "made/page.html",
    ];
    let output = report(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    assert_says(
        &String::from_utf8_lossy(&output.stdout),
        &["made/page.html", "1 run of 1 scene"],
    );
    assert_says(
        &text(&folder.path().join("made/page.html")),
        &["<title>Test drive</title>"],
    );
}

#[test]
fn nothing_to_report_is_an_error() {
    let folder = folder();
    std::fs::write(folder.path().join("a.csv"), "").expect("writable");
    let output = report(folder.path(), &["a.csv", "absent"]);
    assert_eq!(output.status.code(), Some(1));
    assert_says(
        &errors(&output),
        &[
            "a.csv: is empty",
            "absent: cannot be read",
            "no log could be read",
        ],
    );
    assert!(!folder.path().join("report.html").exists());
    let output = report(folder.path(), &["a.csv", "--column", "sped=x"]);
    assert_eq!(output.status.code(), Some(2));
    assert_says(&errors(&output), &["`sped`", "speed_kmh"]);
}

#[test]
fn a_run_is_reported_and_rebuilt_to_the_same_page() {
    let folder = folder();
    let output = Command::new(env!("CARGO_BIN_EXE_rollover-app"))
        .current_dir(folder.path())
        .args(["run", "sedan-s1", "--out", "out/driver"])
        .output()
        .expect("the command starts");
    assert!(output.status.success(), "{}", errors(&output));
    let out = folder.path().join("out/driver");
    for name in [
        "report.html",
        "log.mat",
        "scene.json",
        "figures/scenes/sedan-s1-road.svg",
        "tables/runs.csv",
    ] {
        assert!(out.join(name).exists(), "{name} is missing");
    }
    let without_command = |page: &str| {
        let start = page.find("\"command\":").expect("a command");
        let end = start + page[start..].find("\",").expect("it ends");
        format!("{}{}", &page[..start], &page[end..])
    };
    let made = text(&out.join("report.html"));
    let output = report(folder.path(), &["out/driver"]);
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let rebuilt = text(&out.join("report.html"));
    assert_eq!(without_command(&made), without_command(&rebuilt));
    // The summary alone names scenario and vehicle as well.
    std::fs::remove_file(out.join("scene.json")).expect("it is there");
    report(folder.path(), &["out/driver"]);
    let by_summary = text(&out.join("report.html"));
    assert_eq!(without_command(&made), without_command(&by_summary));
}
