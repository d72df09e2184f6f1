//! The ground of a scenario: its table, the command `terrain`, runs on a file.

use super::{assert_says, fail, folder, read, succeed, write};

const SCENARIO: &str = include_str!("../../../../scenarios/sedan-s1.toml");
const FLAT: &str = "[ground]\nfriction = 0.85\n";
const ROUGH: &str = r#"
fade_in_m = 50.0
roughness = { class = "b", contact_length_m = 0.13, seed = 1 }
"#;

/// The shipped scenario with more on its ground, as `mine.toml` in a folder.
fn scenario_with(more: &str) -> tempfile::TempDir {
    assert!(SCENARIO.contains(FLAT), "the ground of the scenario");
    let folder = folder();
    let text = SCENARIO.replace(FLAT, &format!("{FLAT}{more}"));
    write(&folder.path().join("mine.toml"), &text);
    folder
}

#[test]
fn a_terrain_is_written_drawn_and_run_on() {
    let folder = scenario_with(ROUGH);
    let path = folder.path();
    let said = succeed(path, &["terrain", "mine.toml", "--out", "ground"]);
    assert_says(&said, &["terrain.npz", "1105 m", "rms", "terrain.svg"]);
    let picture = read(&path.join("ground/terrain.svg"));
    assert_says(
        &picture,
        &["ISO 8608 class B", "height, m", "cross slope, %", "<image"],
    );
    let file = "ground/terrain.npz";
    let own = succeed(
        path,
        &["run", "mine.toml", "--speed", "90", "--out", "a", "--json"],
    );
    let run = [
        "run",
        "sedan-s1",
        "--speed",
        "90",
        "--terrain",
        file,
        "--out",
        "b",
        "--json",
    ];
    succeed(path, &run);
    // The file is the ground it was made from, to the last bit.
    assert_eq!(read(&path.join("a/log.csv")), read(&path.join("b/log.csv")));
    assert_says(&own, &["completed"]);
    let again = succeed(
        path,
        &["terrain", "mine.toml", "--mirror", "--out", "m", "--json"],
    );
    assert_says(&again, &["\"mirrored\": true"]);
}

#[test]
fn terrains_that_do_not_fit_are_refused() {
    let folder = scenario_with(ROUGH);
    let path = folder.path();
    succeed(
        path,
        &["terrain", "mine.toml", "--recording", "--out", "other"],
    );
    let run = ["run", "sedan-s1", "--terrain", "other/terrain.npz"];
    let message = fail(path, &run);
    assert_says(
        &message,
        &[
            "other/terrain.npz",
            "sedan-s1",
            "ends before the road",
            "of 1105 m",
        ],
    );
    write(&path.join("broken.npz"), "no archive");
    let message = fail(path, &["run", "sedan-s1", "--terrain", "broken.npz"]);
    assert_says(&message, &["broken.npz", "no terrain file"]);
}

#[test]
fn a_ground_that_cannot_be_is_refused_with_file_field_and_number() {
    let said = |more: &str| fail(scenario_with(more).path(), &["run", "mine.toml"]);
    assert_says(
        &said("bank = [{ station_m = 0.0, percent = 80.0 }]\n"),
        &["mine.toml", "ground.bank[0].percent = 80", "[-50, 50] %"],
    );
    assert_says(&said("rougness = 1\n"), &["mine.toml", "rougness"]);
    // On the course, but not on that of the recording.
    let bump = "bumps = [{ station_m = 1000.0, offset_m = 0.0, length_m = 1.0, width_m = 1.0, height_m = 0.05 }]\n";
    assert_says(
        &said(bump),
        &[
            "recording.course has no [recording.ground]",
            "bumps[0].station_m = 1000 m",
        ],
    );
}
