//! The program `vehicle-validation` as a stranger uses it, with folders that are not quite right.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

const RUNS: [&str; 2] = ["step_v20_d0.0100", "brake_v30_a6"];

fn reference() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/vehicle")
}

/// A folder with two runs of one vehicle, and a summary with what Python writes.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    fs::create_dir(path.join("car")).expect("created");
    for run in RUNS {
        let file = format!("{run}.csv");
        fs::copy(
            reference().join("bmw_320i").join(&file),
            path.join("car").join(&file),
        )
        .expect("copied");
    }
    fs::copy(
        reference().join("bmw_320i.parameters.json"),
        path.join("car.parameters.json"),
    )
    .expect("copied");
    let summary = r#"[
        {"vehicle": "car", "name": "step_v20_d0.0100", "v0": 20.0, "valid_until": NaN,
         "gain": -Infinity, "note": "it's NaN, [1, 2"},
        {"vehicle": "car", "name": "brake_v30_a6", "v0": 30.0, "new_key": {"a": [NaN, 1e3]}}
    ]"#;
    fs::write(path.join("summary.json"), summary).expect("written");
    folder
}

fn run(data: &Path, out: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_vehicle-validation"))
        .arg("--reference-only")
        .arg("--data")
        .arg(data)
        .arg("--out")
        .arg(out)
        .arg("--docs")
        .arg(out.join("docs"))
        .args(more)
        .env("RUST_BACKTRACE", "0")
        .output()
        .expect("the program starts")
}

/// What the program says when it refuses.
fn refusal(data: &Path, more: &[&str]) -> String {
    let out = tempfile::tempdir().expect("a folder");
    let output = run(data, out.path(), more);
    assert!(!output.status.success(), "not refused");
    assert!(!out.path().join("vehicle-validation.json").exists());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

fn require(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in: {text}");
    }
}

fn rows(out: &Path) -> Vec<serde_json::Value> {
    let text = fs::read_to_string(out.join("vehicle-validation.json")).expect("written");
    let rows: Vec<serde_json::Value> = serde_json::from_str(&text).expect("JSON");
    rows.into_iter()
        .filter(|row| row["group"] == "reference")
        .collect()
}

#[test]
fn some_kinds_of_runs_and_a_summary_as_python_writes_it_are_enough() {
    let (data, out) = (folder(), tempfile::tempdir().expect("a folder"));
    let output = run(data.path(), out.path(), &[]);
    assert!(output.status.success(), "{output:?}");
    let rows = rows(out.path());
    assert_eq!(rows.len(), 5, "{rows:?}");
    for row in rows {
        assert_eq!(row["pass"], true, "{row}");
        assert_eq!(row["vehicle"], "car");
    }
    let page = fs::read_to_string(out.path().join("docs/vehicle-validation.md")).expect("written");
    require(
        &page,
        &["vehicle-car-steps-20.svg", "Against an independent model"],
    );
    assert!(out.path().join("car.toml").exists());
    // Nothing that is half written stays.
    for entry in walk(out.path()) {
        assert!(!entry.ends_with(".partial"), "{entry}");
    }
}

fn walk(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            found.extend(walk(&path));
        } else {
            found.push(path.display().to_string());
        }
    }
    found
}

#[test]
fn a_vehicle_file_stands_for_the_only_vehicle_of_the_folder() {
    let (data, out) = (folder(), tempfile::tempdir().expect("a folder"));
    assert!(run(data.path(), out.path(), &[]).status.success());
    let converted = out.path().join("car.toml");
    let again = tempfile::tempdir().expect("a folder");
    let file = converted.to_str().expect("a path in UTF-8");
    let output = run(data.path(), again.path(), &["--vehicle", file]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(rows(out.path()), rows(again.path()));
    let several = refusal(&reference(), &["--vehicle", file]);
    require(
        &several,
        &["3 vehicles", "bmw_320i", "give a folder with one"],
    );
}

#[test]
fn a_missing_file_or_a_broken_row_is_named() {
    let data = folder();
    let csv = data.path().join("car/brake_v30_a6.csv");
    let text = fs::read_to_string(&csv).expect("readable");

    // Cut in the middle of a row, as an interrupted copy leaves it.
    let half = &text[..text.len() / 2];
    let cut = half.rfind(',').expect("a comma");
    fs::write(&csv, &half[..cut]).expect("written");
    let truncated = refusal(data.path(), &[]);
    require(&truncated, &["brake_v30_a6.csv", "line"]);

    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut fields: Vec<&str> = lines[3].split(',').collect();
    fields[1] = "nan";
    lines[3] = fields.join(",");
    fs::write(&csv, lines.join("\n")).expect("written");
    let not_a_number = refusal(data.path(), &[]);
    require(&not_a_number, &["brake_v30_a6.csv", "line 4", "is NaN"]);

    fs::remove_file(&csv).expect("removed");
    require(&refusal(data.path(), &[]), &["brake_v30_a6.csv"]);
    fs::remove_file(data.path().join("summary.json")).expect("removed");
    require(&refusal(data.path(), &[]), &["summary.json"]);
    fs::remove_file(data.path().join("car.parameters.json")).expect("removed");
    require(&refusal(data.path(), &[]), &["NAME.parameters.json"]);
}

#[test]
fn a_summary_without_a_speed_or_without_the_vehicle_is_refused() {
    let data = folder();
    let write = |text: &str| fs::write(data.path().join("summary.json"), text).expect("written");
    write(r#"[{"vehicle": "car", "name": "step_v20_d0.0100", "v0": NaN}]"#);
    require(
        &refusal(data.path(), &[]),
        &["v0", "step_v20_d0.0100", "NaN"],
    );
    write(r#"[{"vehicle": "bus", "name": "step_v20_d0.0100", "v0": 20.0}]"#);
    require(&refusal(data.path(), &[]), &["no run of vehicle `car`"]);
    write("[{");
    require(
        &refusal(data.path(), &[]),
        &["summary.json", "no summary of runs"],
    );
}

#[test]
fn a_parameter_set_that_is_no_possible_vehicle_is_refused_by_file_and_field() {
    let data = folder();
    let path = data.path().join("car.parameters.json");
    let text = fs::read_to_string(&path).expect("readable");
    let mut set: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    // Less than the wheels alone have: nothing is left for the body.
    set["I_z"] = 100.0.into();
    fs::write(&path, set.to_string()).expect("written");
    let refused = refusal(data.path(), &[]);
    require(
        &refused,
        &[
            "car.parameters.json",
            "sprung_yaw_inertia_kg_m2",
            "converts to",
        ],
    );
    set.as_object_mut().expect("an object").remove("K_zt");
    fs::write(&path, set.to_string()).expect("written");
    require(&refusal(data.path(), &[]), &["car.parameters.json", "K_zt"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_the_work() {
    let (data, out) = (folder(), tempfile::tempdir().expect("a folder"));
    let file = out.path().join("a-file");
    fs::write(&file, "").expect("written");
    let output = run(data.path(), &file.join("below"), &[]);
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr);
    require(&text, &["cannot create the folder", "a-file"]);
    // A folder in the place of the probe stands for a folder without the right to write, which the
    // super-user always has.
    let blocked = out.path().join("blocked");
    fs::create_dir_all(blocked.join(".writable.partial")).expect("created");
    let output = run(data.path(), &blocked, &[]);
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr);
    require(&text, &["cannot write into the folder", "blocked"]);
}
