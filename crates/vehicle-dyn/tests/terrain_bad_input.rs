//! Grounds that cannot be: each is refused with its field, its number and the range.

mod common;

use common::three_turns;
use vehicle_dyn::road::Course;
use vehicle_dyn::terrain::{GroundDescription, Terrain};

const GOOD: &str = r#"
    friction = 0.85
    fade_in_m = 50.0
    roughness = { class = "c", contact_length_m = 0.13, seed = 1 }
    undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }
    bank = [{ station_m = 10.0, percent = 1.0 }, { station_m = 300.0, percent = -3.0 }]
    bumps = [{ station_m = 70.0, offset_m = 0.7, length_m = 1.0, width_m = 1.1, height_m = 0.05 }]
    split = { left = 0.9, right = 0.7, edge_m = 1.0 }
    patches = [
        { from_m = 30.0, to_m = 40.0, right_m = -2.0, left_m = 1.5, friction = 0.1, edge_m = 0.5 },
    ]
"#;

/// What is said of the good ground with a change.
fn message(from: &str, to: &str) -> String {
    assert_eq!(GOOD.matches(from).count(), 1, "`{from}` stands there once");
    let text = GOOD.replace(from, to);
    match toml::from_str::<GroundDescription>(&text) {
        Err(error) => error.to_string(),
        Ok(ground) => {
            let course = Course::new(&three_turns()).expect("valid");
            // As building says it, before any work.
            Terrain::build(&ground, &course)
                .expect_err("refused")
                .to_string()
        }
    }
}

#[track_caller]
fn assert_refused(from: &str, to: &str, pieces: &[&str]) {
    let found = message(from, to);
    for piece in pieces {
        assert!(found.contains(piece), "expected `{piece}` in: {found}");
    }
}

#[test]
fn the_good_ground_is_good_and_written_back() {
    let ground: GroundDescription = toml::from_str(GOOD).expect("valid");
    assert_eq!(ground.check(), Ok(()));
    let again: GroundDescription =
        toml::from_str(&toml::to_string(&ground).expect("writable")).expect("valid");
    assert_eq!(again, ground);
    assert_eq!(ground.mirrored().mirrored(), ground);
}

/// Field in the message, where it stands in the file, its key, and numbers just outside.
const RANGES: [(&str, &str, &str, [&str; 2]); 22] = [
    ("friction", "friction = 0.85", "friction", ["0.0", "1.6"]),
    ("fade_in_m", "fade_in_m = 50.0", "fade_in_m", ["0.5", "2e4"]),
    (
        "roughness.contact_length_m",
        "contact_length_m = 0.13",
        "contact_length_m",
        ["-0.1", "0.6"],
    ),
    (
        "undulation.height_rms_m",
        "height_rms_m = 0.05",
        "height_rms_m",
        ["-0.05", "60.0"],
    ),
    (
        "undulation.shortest_m",
        "shortest_m = 25.0",
        "shortest_m",
        ["0.0", "2e4"],
    ),
    (
        "undulation.longest_m",
        "longest_m = 80.0",
        "longest_m",
        ["-80.0", "2e4"],
    ),
    (
        "bank[0].station_m",
        "station_m = 10.0",
        "station_m",
        ["-1.0", "2e5"],
    ),
    (
        "bank[1].percent",
        "percent = -3.0",
        "percent",
        ["-51.0", "51.0"],
    ),
    (
        "bumps[0].station_m",
        "station_m = 70.0",
        "station_m",
        ["-1.0", "2e5"],
    ),
    (
        "bumps[0].offset_m",
        "offset_m = 0.7",
        "offset_m",
        ["-101.0", "101.0"],
    ),
    (
        "bumps[0].length_m",
        "length_m = 1.0,",
        "length_m",
        ["0.0", "101.0"],
    ),
    (
        "bumps[0].width_m",
        "width_m = 1.1",
        "width_m",
        ["0.01", "101.0"],
    ),
    (
        "bumps[0].height_m",
        "height_m = 0.05",
        "height_m",
        ["-1.1", "1.1"],
    ),
    ("split.left", "left = 0.9", "left", ["0.0", "1.6"]),
    ("split.right", "right = 0.7", "right", ["-0.7", "1.6"]),
    ("split.edge_m", "edge_m = 1.0", "edge_m", ["0.0", "21.0"]),
    (
        "patches[0].from_m",
        "from_m = 30.0",
        "from_m",
        ["-1.0", "2e5"],
    ),
    ("patches[0].to_m", "to_m = 40.0", "to_m", ["-1.0", "2e5"]),
    (
        "patches[0].right_m",
        "right_m = -2.0",
        "right_m",
        ["-101.0", "101.0"],
    ),
    (
        "patches[0].left_m",
        "left_m = 1.5",
        "left_m",
        ["-101.0", "101.0"],
    ),
    (
        "patches[0].friction",
        "friction = 0.1",
        "friction",
        ["0.0", "1.6"],
    ),
    (
        "patches[0].edge_m",
        "edge_m = 0.5",
        "edge_m",
        ["0.1", "21.0"],
    ),
];

#[test]
fn every_number_has_its_range() {
    for (field, found, key, outside) in RANGES {
        for value in outside.into_iter().chain(["nan", "inf", "-inf"]) {
            let comma = if found.ends_with(',') { "," } else { "" };
            let number = value.parse::<f64>().expect("a number");
            assert_refused(
                found,
                &format!("{key} = {value}{comma}"),
                &[&format!("ground.{field} = {number}: must be in [")],
            );
        }
    }
}

#[test]
fn what_contradicts_itself_is_refused_with_both_numbers() {
    assert_refused(
        "fade_in_m = 50.0",
        "",
        &["ground.fade_in_m is missing", "50.0"],
    );
    assert_refused(
        "class = \"c\", ",
        "",
        &["ground.roughness.class is missing"],
    );
    assert_refused(
        "class = \"c\"",
        "class = \"c\", gd_n0_m3 = 1e-4",
        &["roughness.gd_n0_m3 = 0.0001", "one of them"],
    );
    assert_refused(
        "class = \"c\"",
        "gd_n0_m3 = 2.0",
        &["ground.roughness.gd_n0_m3 = 2: must be in [0.00000001, 1] m³"],
    );
    assert_refused(
        "longest_m = 80.0",
        "longest_m = 20.0",
        &["longest_m = 20", "shortest_m = 25"],
    );
    assert_refused(
        "height_rms_m = 0.05",
        "height_rms_m = 5.0",
        &["0.200 of the shortest wave"],
    );
    assert_refused(
        "station_m = 300.0",
        "station_m = 12.0",
        &[
            "bank[1].station_m = 12",
            "bank[0].station_m = 10",
            "at least 5 m",
        ],
    );
    assert_refused(
        "height_m = 0.05",
        "height_m = 0.5",
        &["bumps[0]", "rises 1.57 m per m"],
    );
    assert_refused("to_m = 40.0", "to_m = 20.0", &["from_m = 30", "to_m = 20"]);
    assert_refused(
        "left_m = 1.5",
        "left_m = -3.0",
        &["right_m = -2", "left_m = -3"],
    );
    let ground: GroundDescription =
        toml::from_str("friction = 0.85\nfade_in_m = 50.0").expect("valid fields");
    let message = ground.check().expect_err("nothing to fade in").to_string();
    assert!(
        message.contains("fade_in_m") && message.contains("remove it"),
        "{message}"
    );
}

#[test]
fn what_does_not_lie_on_the_course_is_refused_with_its_length() {
    assert_refused(
        "fade_in_m = 50.0",
        "fade_in_m = 1200.0",
        &["fade_in_m = 1200", "1105 m"],
    );
    assert_refused(
        "station_m = 300.0",
        "station_m = 1200.0",
        &["bank[1].station_m", "1105 m"],
    );
    assert_refused(
        "station_m = 70.0",
        "station_m = 1200.0",
        &["bumps[0].station_m", "1105 m"],
    );
    assert_refused(
        "offset_m = 0.7",
        "offset_m = 30.0",
        &["bumps[0].offset_m = 30", "18.5 m"],
    );
    assert_refused(
        "to_m = 40.0",
        "to_m = 1200.0",
        &["patches[0].to_m = 1200", "1105 m"],
    );
}

#[test]
fn unknown_fields_and_classes_are_refused() {
    assert_refused("fade_in_m", "fadein_m", &["unknown field `fadein_m`"]);
    assert_refused(
        "contact_length_m",
        "contact_m",
        &["unknown field `contact_m`"],
    );
    assert_refused("\"c\"", "\"z\"", &["unknown variant `z`"]);
    assert_refused(
        "seed = 1 }\n    undulation",
        "seed = -1 }\n    undulation",
        &["-1"],
    );
    assert_refused(
        "percent = 1.0",
        "degrees = 1.0",
        &["unknown field `degrees`"],
    );
}
