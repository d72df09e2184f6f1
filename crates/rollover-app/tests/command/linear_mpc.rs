//! Controllers with an identified model: what may stand in their settings, and what is written.

use std::path::Path;

use serde_json::Value;

use super::reproducible::log_without_times;
use super::{assert_says, fail, folder, read, succeed, write};

const SCENARIO: &str = include_str!("../../../../scenarios/sedan-s1.toml");

/// Replaces `from` by `to` in one controller's settings and returns the message of loading them.
fn fail_with_controller(name: &str, from: &str, to: &str) -> String {
    let (before, settings) = SCENARIO
        .split_once(&format!("[controllers.{name}]\n"))
        .expect("the scenario has this controller");
    assert!(settings.contains(from), "its settings hold `{from}`");
    let settings = settings.replacen(from, to, 1);
    let folder = folder();
    let text = format!("{before}[controllers.{name}]\n{settings}");
    write(&folder.path().join("mine.toml"), &text);
    fail(folder.path(), &["run", "mine.toml"])
}

#[test]
fn a_field_of_another_method_is_named_with_its_controller() {
    for (field, value) in [
        ("lambda_u", "1e8"),
        ("lambda_y", "1e8"),
        ("order_bound", "8"),
        (
            "regularisation",
            "{ lambda_g = 60.0, normalisation = \"per_column\" }",
        ),
    ] {
        let with = format!("past_steps = 100\n{field} = {value}");
        let message = fail_with_controller("lmpc-1", "past_steps = 100", &with);
        let names = [
            "mine.toml",
            "[controllers.lmpc-1]",
            "line",
            &format!("`{field}`"),
            "method = \"lmpc\"",
            "remove it",
        ];
        assert_says(&message, &names);
    }
    for (field, value) in [
        ("identification", "{ order = 4 }"),
        ("offset_handling", "\"none\""),
    ] {
        let with = format!("past_steps = 100\n{field} = {value}");
        let message = fail_with_controller("rd-deepc-1", "past_steps = 100", &with);
        let names = [
            "mine.toml",
            "[controllers.rd-deepc-1]",
            &format!("`{field}`"),
            "method = \"rd-deepc\"",
            "has no model",
        ];
        assert_says(&message, &names);
    }
}

#[test]
fn a_missing_field_is_named_with_the_method_that_needs_it() {
    let message = fail_with_controller("rd-deepc-1", "lambda_u = 1e8\n", "");
    let names = [
        "mine.toml",
        "[controllers.rd-deepc-1]",
        "missing field `lambda_u`",
        "\"rd-deepc\"",
    ];
    assert_says(&message, &names);
    let message = fail_with_controller("lmpc-1", "method = \"lmpc\"", "method = \"pid\"");
    assert_says(&message, &["mine.toml", "`pid`", "rd-deepc", "lmpc"]);
}

#[test]
fn settings_of_an_identification_are_checked_on_loading() {
    let controller = "lmpc-1-paper";
    let message = fail_with_controller(controller, "order = 4", "order = 0");
    assert_says(
        &message,
        &[
            "mine.toml",
            "controllers.lmpc-1-paper.identification.order",
            "0",
            "at least 1",
        ],
    );
    let message = fail_with_controller(controller, "order = 4", "without_effect = [\"speed\"]");
    assert_says(
        &message,
        &[
            "controllers.lmpc-1-paper.identification.without_effect",
            "`speed`",
            "`target_speed_kmh`",
        ],
    );
    let message = fail_with_controller(controller, "offsets = \"means\"", "offsets = \"raw\"");
    assert_says(
        &message,
        &["mine.toml", "line", "`raw`", "`found`, `means`, `none`"],
    );
    let message = fail_with_controller(controller, "order = 4", "ordre = 4");
    assert_says(&message, &["mine.toml", "line", "ordre"]);
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&read(path)).expect("it is JSON")
}

#[test]
fn a_run_is_reproducible_and_says_what_the_data_do_not_identify() {
    let folder = folder();
    let drive = |out: &str| {
        let arguments = [
            "run",
            "sedan-s1",
            "--controller",
            "lmpc-1",
            "--seed",
            "10",
            "--out",
            out,
        ];
        succeed(folder.path(), &arguments)
    };
    let printed = drive("a");
    drive("b");
    let file = |out: &str, name: &str| folder.path().join(out).join(name);
    let log = |out: &str| log_without_times(&file(out, "log.csv"));
    assert_eq!(log("a"), log("b"));
    for name in ["model.json", "identification.json", "identification.txt"] {
        assert_eq!(read(&file("a", name)), read(&file("b", name)), "{name}");
    }
    sysid::StateSpace::from_json(&read(&file("a", "model.json"))).expect("a model reads back");

    let summary = json(&file("a", "summary.json"));
    let effects = summary["model"]["effects"].as_array();
    let speed = effects
        .expect("a model has effects")
        .iter()
        .find(|effect| effect["input"] == "target_speed_kmh")
        .expect("the speed is an input");
    assert_eq!(speed["verdict"], "not_identified");
    assert_says(
        &printed,
        &[
            "lmpc-1: model of order",
            "target_speed_kmh → ltr not identified",
        ],
    );
    assert!(summary["step_time_us"]["median"].as_f64() > Some(0.0));
}

#[test]
fn a_constant_input_is_told_before_a_model_is_made() {
    let folder = folder();
    succeed(folder.path(), &["record", "sedan-s1", "--out", "."]);
    let path = folder.path().join("recording.csv");
    let hold = |(index, line): (usize, &str)| match line.split(',').collect::<Vec<_>>()[..] {
        [time, steering, _, ltr] if index > 0 => format!("{time},{steering},100,{ltr}"),
        _ => line.to_owned(),
    };
    let lines: Vec<String> = read(&path).lines().enumerate().map(hold).collect();
    write(&path, &(lines.join("\n") + "\n"));
    let run = [
        "run",
        "sedan-s1",
        "--controller",
        "lmpc-1",
        "--recording",
        "recording.csv",
    ];
    let message = fail(folder.path(), &run);
    assert_says(
        &message,
        &["recording cannot be used", "`target_speed_kmh`", "constant"],
    );
}
