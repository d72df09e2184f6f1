//! The campaign: what it leaves, that it goes on where it stopped, and that its results do not depend
//! on the number of threads.

use std::path::Path;

use serde_json::Value;

use super::{assert_says, fail, folder, read, succeed, write};

/// A campaign of seconds: three policies, two seeds, the course and its mirror image.
const SHORT: [&str; 7] = [
    "paper",
    "--only",
    "truck-s2",
    "--controllers",
    "driver,floor,rd-deepc-1",
    "--seeds",
    "10-11",
];
/// Runs of [`SHORT`]: driver and floor once per course.
const RUNS: usize = 2 + 2 + 4;

fn short(folder: &Path, more: &[&str]) -> String {
    let arguments: Vec<&str> = SHORT.iter().chain(more).copied().collect();
    succeed(folder, &arguments)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&read(path)).expect("it is JSON")
}

/// The results without measured times.
fn without_times(path: &Path) -> Value {
    let mut results = json(path);
    results["timing"] = Value::Null;
    for run in results["runs"].as_array_mut().expect("there are runs") {
        run["step_time_us"] = Value::Null;
    }
    results
}

#[test]
fn results_do_not_depend_on_threads_and_finished_runs_are_not_made_again() {
    let folder = folder();
    short(folder.path(), &["--out", "one", "--jobs", "1"]);
    short(folder.path(), &["--out", "two", "--jobs", "2"]);
    let results = |out: &str| folder.path().join(out).join("paper.json");
    let one = without_times(&results("one"));
    assert_eq!(one, without_times(&results("two")));
    assert_eq!(one["runs"].as_array().map(Vec::len), Some(RUNS));

    let again = short(folder.path(), &["--out", "one"]);
    assert_says(
        &again,
        &["0 runs made", &format!("{RUNS} were there already")],
    );
    assert_eq!(one, without_times(&results("one")));

    // A run that is not whole is made again, and no other.
    let run = folder
        .path()
        .join("one/truck-s2/rd-deepc-1/seed-11-mirrored");
    write(&run.join("summary.json"), "{ \"scenario\": \"truck-s2\", ");
    let again = short(folder.path(), &["--out", "one"]);
    assert_says(&again, &["1 runs made"]);
    assert_eq!(one, without_times(&results("one")));
}

#[test]
fn claims_are_judged_by_runs_on_both_courses() {
    let folder = folder();
    let printed = short(folder.path(), &["--out", "out", "--json"]);
    let results: Value = serde_json::from_str(&printed).expect("--json prints JSON");
    assert_eq!(results, json(&folder.path().join("out/paper.json")));
    let claims = results["claims"].as_array().expect("claims");
    let claim = claims
        .iter()
        .find(|claim| claim["id"] == "s2-rd-deepc")
        .expect("there are runs for it");
    let runs = results["runs"].as_array().expect("runs");
    let of_claim: Vec<&Value> = runs
        .iter()
        .filter(|run| run["controller"] == "rd-deepc-1")
        .collect();
    assert_eq!(of_claim.len(), 4);
    let safe = of_claim
        .iter()
        .filter(|run| run["outcome"] == "completed" && run["ltr_violation_s"] == 0.0)
        .count();
    assert_eq!(claim["fraction"].as_f64(), Some(safe as f64 / 4.0));
    assert_eq!(claim["seeds"], serde_json::json!([10, 11]));
    let verdict = match safe {
        4 => "reproduced",
        1..=3 => "partly",
        _ => "not reproduced",
    };
    assert_eq!(claim["verdict"], verdict);
    assert!(
        !claims.iter().any(|claim| claim["id"] == "s2-lmpc"),
        "no verdict without a run"
    );
}

#[test]
fn a_report_from_the_folder_alone_is_the_campaigns_and_names_a_spoilt_log() {
    let folder = folder();
    let out = folder.path().join("out");
    short(folder.path(), &["--out", "out"]);
    let page = read(&out.join("report.html"));
    succeed(folder.path(), &["report", "out", "--out", "again.html"]);
    assert_eq!(page, read(&folder.path().join("again.html")));

    let log = out.join("truck-s2/rd-deepc-1/seed-10/log.csv");
    let whole = read(&log);
    write(&log, &whole[..whole.len() / 2]);
    let printed = succeed(folder.path(), &["report", "out", "--json"]);
    let printed: Value = serde_json::from_str(&printed).expect("JSON");
    let problems = printed["problems"].to_string();
    assert_says(&problems, &["rd-deepc-1/seed-10/log.csv"]);
    assert!(
        printed["runs"]
            .as_array()
            .is_some_and(|runs| runs.len() == 3)
    );
}

#[test]
fn wrong_arguments_are_told_with_what_is_allowed() {
    let folder = folder();
    let told = |arguments: &[&str], pieces: &[&str]| {
        assert_says(&fail(folder.path(), arguments), pieces);
    };
    told(&["paper", "--seeds", "19-10"], &["10 comes before 19"]);
    told(&["paper", "--seeds", "ten"], &["`ten` is not a seed"]);
    told(
        &["paper", "--only", "sedan-s2"],
        &["sedan-s1", "truck-s2", "riverbed-s3"],
    );
    told(
        &["paper", "--only", "truck-s2", "--controllers", "rd-deepc"],
        &["--controllers rd-deepc", "did you mean", "lmpc-1"],
    );
}

#[cfg(unix)]
#[test]
fn a_stopped_campaign_leaves_no_results_and_goes_on() {
    use super::interruption::{interrupt, wait_for_file};
    use std::process::Stdio;

    let folder = folder();
    let out = folder.path().join("out");
    let arguments: Vec<&str> = SHORT
        .iter()
        .chain(&["--out", "out", "--jobs", "1"])
        .copied()
        .collect();
    let running = super::command(folder.path(), &arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    wait_for_file(&out.join("truck-s2/driver/seed-10/summary.json"));
    interrupt(running.id());
    let output = running.wait_with_output().expect("the command ends");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{message}");
    assert_says(
        &message,
        &[
            "interrupted",
            &format!("of {RUNS} runs"),
            "goes on from there",
        ],
    );
    for name in ["report.html", "paper.json"] {
        assert!(!out.join(name).exists(), "no {name} of half a campaign");
    }
    let again = short(folder.path(), &["--out", "out"]);
    assert!(!again.contains("\n0 were there already"), "{again}");
    assert_eq!(
        json(&out.join("paper.json"))["runs"]
            .as_array()
            .map(Vec::len),
        Some(RUNS)
    );
}
