//! The command line itself: help, names, completions, quiet, exit statuses, output that nobody reads.

use super::{assert_says, command, fail, folder, read, run, succeed, write};

const SCENARIO: &str = include_str!("../../../../scenarios/sedan-s1.toml");
const DWELL: &str = include_str!("../../../../scenarios/manoeuvres/sine-with-dwell.toml");

/// Checks a changed copy of a file and returns the message.
fn fail_check(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "the file holds `{from}`");
    let folder = folder();
    write(
        &folder.path().join("mine.toml"),
        &text.replacen(from, to, 1),
    );
    fail(folder.path(), &["scenarios", "check", "mine.toml"])
}

/// Line and column of a piece of the changed file, as messages write them.
fn place(text: &str, from: &str, to: &str, piece: &str) -> String {
    let changed = text.replacen(from, to, 1);
    let at = changed.find(piece).expect("the piece is there");
    let line = changed[..at].matches('\n').count() + 1;
    let column = at - changed[..at].rfind('\n').map_or(0, |end| end + 1) + 1;
    format!("line {line}, column {column}")
}

#[test]
fn help_has_examples_and_exit_statuses() {
    let folder = folder();
    let help = succeed(folder.path(), &["--help"]);
    assert_says(
        &help,
        &[
            "Examples:",
            "Exit status:",
            "130",
            "--quiet",
            "NO_COLOR",
            "scenarios check",
        ],
    );
    let order = [
        "paper",
        "run",
        "record",
        "identify",
        "manoeuvre",
        "scenarios",
        "completions",
    ];
    let places = order.map(|name| help.find(&format!("\n  {name} ")).expect("it is listed"));
    assert!(places.is_sorted(), "the main job comes first: {help}");
    for name in [
        "paper",
        "run",
        "record",
        "identify",
        "manoeuvre",
        "terrain",
        "scenarios",
        "vehicles",
        "completions",
    ] {
        let help = succeed(folder.path(), &[name, "--help"]);
        assert_says(
            &help,
            &["Examples:", &format!("rollover-app {name}"), "--quiet"],
        );
    }
}

#[test]
fn exit_statuses_tell_usage_from_failure() {
    let folder = folder();
    let status = |arguments: &[&str]| run(folder.path(), arguments).status.code();
    assert_eq!(status(&["scenarios"]), Some(0));
    assert_eq!(status(&["run", "nowhere"]), Some(1));
    assert_eq!(status(&["runn", "sedan-s1"]), Some(2));
    assert_eq!(status(&["run", "sedan-s1", "--sed", "3"]), Some(2));
    assert_eq!(status(&["paper", "--jobs", "0"]), Some(2));
    assert_eq!(status(&[]), Some(2));
}

#[test]
fn misspelt_names_get_a_suggestion() {
    let folder = folder();
    let ends_with = |arguments: &[&str], piece: &str| {
        assert_says(&fail(folder.path(), arguments), &[piece]);
    };
    ends_with(&["runn", "sedan-s1"], "'run'");
    ends_with(&["run", "sedan-s1", "--controler", "x"], "'--controller'");
    ends_with(&["run", "sedan-s11"], "did you mean `sedan-s1`?");
    ends_with(
        &["run", "sedan-s1", "--controller", "rd-depc-2"],
        "did you mean `rd-deepc-2`?",
    );
    ends_with(
        &["run", "sedan-s1", "--vehicle", "sedn"],
        "did you mean `sedan`?",
    );
    ends_with(&["manoeuvre", "fishhok-1b"], "did you mean `fishhook-1b`?");
    ends_with(&["scenarios", "show", "j-trn"], "did you mean `j-turn`?");
    ends_with(
        &["scenarios", "check", "sedan-1"],
        "did you mean `sedan-s1`?",
    );
    ends_with(&["vehicles", "show", "sedn"], "did you mean `sedan`?");
    ends_with(&["completions", "bahs"], "'bash'");
}

#[test]
fn every_shell_gets_its_completions() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = succeed(folder.path(), &["completions", shell]);
        assert_says(
            &script,
            &["rollover-app", "identify", "controller", "schema"],
        );
    }
}

#[test]
fn scenarios_and_manoeuvres_are_listed() {
    let folder = folder();
    let list = succeed(folder.path(), &["scenarios"]);
    assert_says(
        &list,
        &["sedan-s1", "three sharp turns", "tilt-table", "lift angle"],
    );
    let json = succeed(folder.path(), &["scenarios", "--json"]);
    let all: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    let all = all.as_array().expect("it is a list");
    let of = |name: &str| {
        let found = all.iter().find(|listed| listed["name"] == name);
        found.unwrap_or_else(|| panic!("{name} is listed"))
    };
    assert_eq!(of("sedan-s1")["kind"], "scenario");
    assert_eq!(of("sedan-s1")["controllers"][0], "driver");
    assert_eq!(of("iso-3888-1")["kind"], "manoeuvre");
    assert_eq!(of("iso-3888-1")["standard"], "ISO 3888-1");
}

#[test]
fn what_is_shown_can_be_checked_and_used() {
    let folder = folder();
    assert_eq!(
        succeed(folder.path(), &["scenarios", "show", "sedan-s1"]),
        SCENARIO
    );
    let json = succeed(folder.path(), &["scenarios", "--json"]);
    let all: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    for listed in all.as_array().expect("it is a list") {
        let name = listed["name"].as_str().expect("it has a name");
        let text = succeed(folder.path(), &["scenarios", "show", name]);
        write(&folder.path().join("mine.toml"), &text);
        let found = succeed(folder.path(), &["scenarios", "check", "mine.toml"]);
        assert_says(&found, &["mine.toml: every value is allowed", name]);
        let found = succeed(
            folder.path(),
            &["scenarios", "check", "mine.toml", "--json"],
        );
        let found: serde_json::Value = serde_json::from_str(&found).expect("it is JSON");
        assert_eq!(&found, listed);
    }
}

#[test]
fn what_is_wrong_with_a_scenario_has_a_place() {
    let cases = [
        // A misspelt key, a value out of range, in a list, in a table, of a ground, of a wrong type.
        (
            "duration_s =",
            "durations_s =",
            "durations_s",
            "did you mean `duration_s`?",
        ),
        (
            "lambda_u = 1e8",
            "lamda_u = 1e8",
            "lamda_u",
            "did you mean `lambda_u`?",
        ),
        (
            "method = \"lmpc\"",
            "method = \"lmcp\"",
            "\"lmcp\"",
            "did you mean `lmpc`?",
        ),
        (
            "[100.0, 120.0]",
            "[100.0, 920.0]",
            "920.0]",
            "bounds.target_speed_kmh[1]",
        ),
        (
            "ltr_limit = 0.92",
            "ltr_limit = 9.2",
            "ltr_limit = 9.2",
            "controllers.lmpc-1.ltr_limit",
        ),
        (
            "friction = 0.85",
            "friction = 8.5",
            "friction = 8.5",
            "ground.friction",
        ),
        (
            "duration_s = 35.0",
            "duration_s = \"long\"",
            "\"long\"",
            "expected f64",
        ),
        (
            "straight_m = 430.0",
            "straight_m = 3.0",
            "course]",
            "lengthen",
        ),
        // What is missing has the place of its table.
        ("order_bound = 8\n", "", "rd-deepc-1]", "order_bound"),
        ("duration_s = 35.0\n", "", "", "missing field `duration_s`"),
    ];
    for (from, to, piece, says) in cases {
        let message = fail_check(SCENARIO, from, to);
        let place = place(SCENARIO, from, to, piece);
        assert_says(&message, &["mine.toml", says, &place]);
        let marked = message.lines().any(|line| line.trim_end().ends_with('^'));
        assert!(marked || piece.is_empty(), "the line is marked: {message}");
    }
}

#[test]
fn what_is_wrong_with_a_manoeuvre_has_a_place() {
    let cases = [
        (
            "speed_kmh = 80.0 ",
            "sped_kmh = 80.0 ",
            "sped_kmh",
            "did you mean `speed_kmh`?",
        ),
        (
            "speed_kmh = 80.0 ",
            "speed_kmh = 8000.0 ",
            "speed_kmh = 8000",
            "manoeuvre.speed_kmh",
        ),
        (
            "friction = 0.85",
            "friction = 85.0",
            "friction = 85",
            "[0.01, 5]",
        ),
    ];
    for (from, to, piece, says) in cases {
        let message = fail_check(DWELL, from, to);
        assert_says(
            &message,
            &["mine.toml", says, &place(DWELL, from, to, piece)],
        );
    }
}

#[test]
fn a_scenario_without_its_vehicle_is_refused() {
    let message = fail_check(SCENARIO, "vehicle = \"sedan\"", "vehicle = \"sedn\"");
    assert_says(&message, &["sedn", "did you mean `sedan`?"]);
    assert_says(
        &fail(folder().path(), &["scenarios", "check", "absent.toml"]),
        &["absent.toml", "cannot read"],
    );
}

#[test]
fn quiet_keeps_results_and_errors() {
    let folder = folder();
    let path = folder.path();
    let output = run(path, &["--quiet", "run", "sedan-s1", "--out", "here"]);
    assert!(output.status.success());
    assert!(
        output.stdout.is_empty() && output.stderr.is_empty(),
        "{output:?}"
    );
    assert_says(&read(&path.join("here/summary.json")), &["rolled_over"]);
    let json = succeed(path, &["record", "sedan-s1", "-q", "--json", "--out", "."]);
    assert_says(&json, &["\"samples\": 3200"]);
    assert_says(&succeed(path, &["scenarios", "-q"]), &["sedan-s1"]);
    assert_says(&succeed(path, &["vehicles", "-q"]), &["sedan"]);
    let output = run(path, &["run", "nowhere", "-q"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_says(&message, &["error: there is no scenario `nowhere`"]);
}

#[test]
fn colours_follow_the_environment() {
    let folder = folder();
    let message = |variables: &[(&str, &str)], arguments: &[&str]| {
        let mut command = command(folder.path(), arguments);
        for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
            command.env_remove(name);
        }
        let output = command.envs(variables.iter().copied()).output();
        String::from_utf8(output.expect("it starts").stderr).expect("it is UTF-8")
    };
    // Our own errors and those of the command line.
    for arguments in [["run", "nowhere"], ["runn", "nowhere"]] {
        let coloured = |variables: &[(&str, &str)]| {
            message(variables, arguments.as_slice()).contains('\u{1b}')
        };
        assert!(!coloured(&[]), "no terminal, no colour");
        assert!(coloured(&[("CLICOLOR_FORCE", "1")]));
        assert!(!coloured(&[("CLICOLOR", "0")]));
        assert!(!coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]));
    }
}

/// The shell opens what a test cannot: a closed pipe, a closed stream, a full disk.
#[cfg(unix)]
#[test]
fn output_that_nobody_reads_is_no_crash() {
    let folder = folder();
    let shell = |script: &str| {
        let program = env!("CARGO_BIN_EXE_rollover-app");
        let output = std::process::Command::new("sh")
            .args(["-c", &script.replace("APP", &format!("'{program}'"))])
            .current_dir(folder.path())
            .output()
            .expect("sh starts");
        let text = [output.stdout, output.stderr].map(|t| String::from_utf8_lossy(&t).into_owned());
        assert!(!text[1].contains("panicked"), "{script}: {}", text[1]);
        text
    };
    for command in [
        "scenarios",
        "vehicles",
        "completions bash",
        "scenarios show sedan-s1",
        "--help",
    ] {
        let [status, _] = shell(&format!(
            "{{ APP {command}; echo $? >status; }} | true; cat status"
        ));
        assert_eq!(status.trim(), "0", "{command} into a closed pipe");
    }
    // An error that cannot be told still has its status.
    assert_eq!(shell("APP run nowhere 2>&-; echo $?")[0].trim(), "1");
    assert_eq!(
        shell("{ APP run nowhere; echo $? >status; } 2>&1 | true; cat status")[0].trim(),
        "1"
    );
    if std::path::Path::new("/dev/full").exists() {
        let [status, message] = shell("APP scenarios >/dev/full; echo $?");
        assert_eq!(status.trim(), "1");
        assert_says(&message, &["cannot write to standard output"]);
    }
}

/// Where `script` can make a terminal of 40 columns.
#[cfg(target_os = "linux")]
#[test]
fn a_narrow_terminal_breaks_no_line() {
    let folder = folder();
    let screen = |arguments: &str| {
        let program = env!("CARGO_BIN_EXE_rollover-app");
        let inside = format!("stty cols 40 rows 24 && '{program}' {arguments}");
        let output = std::process::Command::new("script")
            .args(["-qec", &inside, "/dev/null"])
            .env("NO_COLOR", "1")
            .current_dir(folder.path())
            .stdin(std::process::Stdio::null())
            .output()
            .ok()?;
        Some(String::from_utf8_lossy(&output.stdout).into_owned())
    };
    for arguments in ["vehicles", "scenarios", "--help"] {
        let Some(text) = screen(arguments).filter(|text| text.contains("sedan")) else {
            println!("skipped: `script` makes no terminal here");
            return;
        };
        let longest = text.lines().max_by_key(|line| line.chars().count());
        let longest = longest.unwrap_or_default();
        let example = arguments == "--help";
        assert!(
            longest.chars().count() <= 40 || example,
            "{arguments}: {longest}"
        );
    }
    let text = screen("record sedan-s1 --out .").unwrap_or_default();
    assert_says(&text, &[" % ", " recording"]);
    let text = screen("-q record sedan-s1 --out .").unwrap_or_default();
    assert_eq!(text.trim(), "");
}
