//! `vehicles`: the list, the check of a file, a file to start from.

use super::{assert_says, fail, folder, read, succeed, write};

const NAMES: [&str; 6] = [
    "sedan",
    "sedan-unladen",
    "utility-truck",
    "utility-truck-laden",
    "suv",
    "hmmwv",
];

fn json(text: &str) -> serde_json::Value {
    serde_json::from_str(text).expect("the output is JSON")
}

#[test]
fn the_list_has_every_vehicle_with_its_figures() {
    let folder = folder();
    let list = succeed(folder.path(), &["vehicles"]);
    assert_says(&list, &NAMES);
    assert_says(
        &list,
        &["mass, kg", "wheelbase", "SSF", "lift-off", "1263", "0.950"],
    );
    let rows = json(&succeed(folder.path(), &["vehicles", "--json"]));
    let names: Vec<&str> = rows
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|row| row["name"].as_str())
        .collect();
    assert_eq!(names, NAMES);
    let lift_off = rows[0]["lift_off_g"].as_f64().expect("a number");
    assert!(lift_off > 0.7 && lift_off < 0.949, "{lift_off} g");
}

#[test]
fn a_vehicle_shown_is_a_file_to_start_from() {
    let folder = folder();
    let shown = succeed(folder.path(), &["vehicles", "show", "utility-truck"]);
    write(&folder.path().join("mine.toml"), &shown);
    let report = succeed(folder.path(), &["vehicles", "check", "mine.toml"]);
    assert_says(
        &report,
        &[
            "utility-truck",
            "roll gradient",
            "understeer gradient",
            "heave frequency",
            "front wheel hop frequency",
            "top speed by power",
            "stability factor",
        ],
    );
    let message = fail(folder.path(), &["vehicles", "show", "lorry"]);
    assert_says(&message, &["lorry", "utility-truck"]);
}

#[test]
fn a_wrong_unit_within_its_range_is_flagged_but_not_refused() {
    let folder = folder();
    let shown = succeed(folder.path(), &["vehicles", "show", "sedan"]);
    // Horsepower instead of watts is refused; a tyre ten times as soft as it should be is not.
    let soft = shown.replace("= 190000.0", "= 45000.0");
    write(&folder.path().join("soft.toml"), &soft);
    let report = succeed(folder.path(), &["vehicles", "check", "soft.toml"]);
    assert_says(
        &report,
        &[
            "looks like a wrong unit?",
            "tyre.vertical_stiffness_front_n_per_m",
        ],
    );
    let figures = json(&succeed(
        folder.path(),
        &["vehicles", "check", "soft.toml", "--json"],
    ));
    let unusual = figures["figures"]
        .as_array()
        .expect("a list")
        .iter()
        .any(|figure| figure["is_usual"] == false);
    assert!(unusual);
    write(
        &folder.path().join("bad.toml"),
        &shown.replace("= 95000.0", "= 95.0"),
    );
    let message = fail(folder.path(), &["vehicles", "check", "bad.toml"]);
    assert_says(
        &message,
        &["bad.toml", "powertrain.max_power_w = 95", "[1000, 1e7] W"],
    );
}

#[test]
fn the_schema_is_the_one_beside_the_vehicles() {
    let folder = folder();
    let schema = succeed(folder.path(), &["vehicles", "schema"]);
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/vehicle.schema.json");
    assert_eq!(schema, read(&path));
}

/// What the README tells a new user to do, with a scenario that leaves the driver to the vehicle.
#[test]
fn a_new_vehicle_drives_a_scenario_with_its_own_driver() {
    let folder = folder();
    let mine =
        succeed(folder.path(), &["vehicles", "show", "hmmwv"]).replace("\"hmmwv\"", "\"mine\"");
    write(&folder.path().join("mine.toml"), &mine);
    let scenario = include_str!("../../../../scenarios/sedan-s1.toml");
    let start = scenario.find("[driver]").expect("a driver");
    let end = scenario.find("[course]").expect("a course");
    let without = format!("{}{}", &scenario[..start], &scenario[end..])
        .replace("duration_s = 35.0", "duration_s = 10.0");
    write(&folder.path().join("bare.toml"), &without);
    let run = |vehicle: &str| {
        let arguments = [
            "run",
            "bare.toml",
            "--vehicle",
            vehicle,
            "--json",
            "--out",
            "out",
        ];
        json(&succeed(folder.path(), &arguments))
    };
    let summary = run("mine.toml");
    assert_eq!(summary["vehicle"], "mine");
    assert_eq!(summary["outcome"], "completed");

    let driver = mine.find("[driver]").expect("a driver");
    write(&folder.path().join("alone.toml"), &mine[..driver]);
    let message = fail(
        folder.path(),
        &["run", "bare.toml", "--vehicle", "alone.toml"],
    );
    assert_says(&message, &["[driver]", "mine"]);
}
