//! Recordings that `identify` cannot use: the message names the place and what to do, and nothing is
//! written.

use super::identify::{tanks, with};
use super::{assert_says, folder, run, write};

/// Runs on a changed recording and returns the message, after making sure that nothing was written.
fn fail_with(text: &str, more: &[&str]) -> String {
    fail_as(text, &with(more))
}

fn fail_as(text: &str, arguments: &[&str]) -> String {
    let folder = folder();
    write(&folder.path().join("tanks.csv"), text);
    let output = run(folder.path(), arguments);
    let message = String::from_utf8(output.stderr).expect("the message is UTF-8");
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty(), "nothing is printed but the error");
    let entries = std::fs::read_dir(folder.path()).expect("the folder is there");
    assert_eq!(entries.count(), 1, "nothing is written: {message}");
    message
}

/// The tanks with one field of one line (from 1, the header) replaced.
fn with_field(line: usize, column: usize, value: &str) -> String {
    let text = tanks(300, 1);
    let lines = text.lines().enumerate().map(|(index, text)| {
        let mut fields: Vec<&str> = text.split(',').collect();
        if index + 1 == line {
            fields[column] = value;
        }
        fields.join(",") + "\n"
    });
    lines.collect()
}

/// The tanks with a column that stands still.
fn with_constant(column: usize) -> String {
    let text = tanks(300, 1);
    let lines = text.lines().enumerate().map(|(index, text)| {
        let mut fields: Vec<&str> = text.split(',').collect();
        if index > 0 {
            fields[column] = "3.5";
        }
        fields.join(",") + "\n"
    });
    lines.collect()
}

#[test]
fn a_missing_file_is_named() {
    let message = fail_as(&tanks(300, 1), &["identify", "absent.csv"]);
    assert_says(&message, &["absent.csv", "cannot open"]);
    let message = fail_with(&tanks(300, 1), &["--validate", "away.csv"]);
    assert_says(&message, &["away.csv", "for validation"]);
}

#[test]
fn a_missing_column_is_answered_with_those_there() {
    let arguments = [
        "identify",
        "tanks.csv",
        "--inputs",
        "pumps",
        "--outputs",
        "left",
    ];
    let message = fail_as(&tanks(300, 1), &arguments);
    assert_says(
        &message,
        &["tanks.csv", "`pumps`", "pump", "valve", "right"],
    );
    let message = fail_as(&tanks(300, 1), &["identify", "tanks.csv"]);
    assert_says(
        &message,
        &["inputs", "--inputs", "time_s, pump, valve, left, right"],
    );
    let message = fail_as(
        &tanks(300, 1),
        &["identify", "tanks.csv", "--inputs", "pump"],
    );
    assert_says(&message, &["--outputs", "left, right"]);
    let message = fail_with(&tanks(300, 1), &["--time", "clock"]);
    assert_says(&message, &["`clock`", "time_s"]);
    let message = fail_with(&tanks(300, 1), &["--without-effect", "pomp"]);
    assert_says(&message, &["without_effect", "`pomp`", "`pump`"]);
}

#[test]
fn an_unknown_sample_time_is_asked_for() {
    let text = tanks(300, 1).replacen("time_s", "stamp", 1);
    let message = fail_with(&text, &[]);
    assert_says(&message, &["tanks.csv", "--sample-time", "--time"]);
    let message = fail_with(&tanks(300, 1), &["--sample-time", "0"]);
    assert_says(&message, &["sample time", "0"]);
    let message = fail_with(&with_field(3, 0, "0"), &[]);
    assert_says(&message, &["`time_s`", "0 and 0", "grow"]);
    let message = fail_with(&with_field(200, 0, "1234"), &[]);
    assert_says(&message, &["tanks.csv", "200", "1234"]);
}

#[test]
fn a_value_that_is_no_number_is_named_with_its_line() {
    let message = fail_with(&with_field(123, 3, "NaN"), &[]);
    assert_says(&message, &["tanks.csv", "123", "left", "NaN"]);
    let message = fail_with(&with_field(123, 2, "open"), &[]);
    assert_says(&message, &["tanks.csv", "123", "valve", "open"]);
    let message = fail_with(&with_field(3, 0, "noon"), &[]);
    assert_says(&message, &["tanks.csv", "line 3", "time_s", "noon"]);
}

#[test]
fn a_constant_channel_is_named_with_its_value() {
    assert_says(
        &fail_with(&with_constant(2), &[]),
        &["input", "`valve`", "constant at 3.5"],
    );
    assert_says(
        &fail_with(&with_constant(3), &[]),
        &["output", "`left`", "constant at 3.5"],
    );
}

#[test]
fn a_short_recording_is_told_with_the_samples_needed() {
    assert_says(
        &fail_with(&tanks(12, 1), &[]),
        &["12 samples", "takes 60 samples", "Record longer"],
    );
    assert_says(&fail_with(&tanks(1, 1), &[]), &["tanks.csv", "1 sample"]);
    assert_says(&fail_with(&tanks(0, 1), &[]), &["tanks.csv", "0 sample"]);
}

#[test]
fn an_order_that_the_data_do_not_carry_is_told_with_the_largest() {
    let arguments = [
        "identify",
        "tanks.csv",
        "--inputs",
        "pump,valve",
        "--outputs",
        "left,right",
        "--order",
        "500",
    ];
    assert_says(
        &fail_as(&tanks(300, 1), &arguments),
        &["order 500", "at most"],
    );
    let zero = [&arguments[..7], &["0"]].concat();
    assert_says(
        &fail_as(&tanks(300, 1), &zero),
        &["order", "0", "at least 1"],
    );
    let message = fail_with(&tanks(300, 1), &["--steps", "0"]);
    assert_says(&message, &["steps", "0", "at least 1"]);
}

#[test]
fn a_folder_that_cannot_be_made_is_named_before_the_work() {
    let message = fail_with(&tanks(300, 1), &["--out", "tanks.csv/here"]);
    assert_says(&message, &["tanks.csv/here", "is a file", "--out"]);
    let message = fail_with(&tanks(300, 1), &["--out", "tanks.csv"]);
    assert_says(&message, &["tanks.csv", "is a file", "--out"]);
}
