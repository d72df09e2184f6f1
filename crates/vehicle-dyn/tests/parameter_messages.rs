//! Bad vehicle files: every message names the field, the number and what to do.

mod common;

use common::sedan;
use vehicle_dyn::parameters::{ParameterError, VehicleParameters};
use vehicle_dyn::vehicles;

fn text() -> String {
    vehicles::embedded_text("sedan")
        .expect("embedded")
        .to_owned()
}

/// The sedan's file with the line of `key` replaced.
fn with_line(key: &str, line: &str) -> String {
    let changed: Vec<String> = text()
        .lines()
        .map(|old| {
            if old.starts_with(&format!("{key} ")) {
                line.to_owned()
            } else {
                old.to_owned()
            }
        })
        .collect();
    assert_ne!(
        changed.join("\n"),
        text().trim_end(),
        "no line begins with {key}"
    );
    changed.join("\n")
}

fn line_of(file: &str, start: &str) -> usize {
    1 + file
        .lines()
        .position(|line| line.starts_with(start))
        .expect("present")
}

fn message(file: &str) -> String {
    VehicleParameters::from_toml(file, "vehicles/x.toml")
        .expect_err("must be refused")
        .to_string()
}

#[test]
fn every_embedded_vehicle_is_valid_and_has_its_own_name() {
    for name in vehicles::names() {
        let vehicle = vehicles::embedded(name).expect("valid");
        assert_eq!(vehicle.name, name);
    }
}

#[test]
fn the_sedan_is_the_published_compact_with_its_roof_box() {
    let figures = sedan().derived();
    assert!((figures.total_mass_kg - 1263.3).abs() < 0.05);
    assert!((figures.cg_height_m - 0.724).abs() < 1e-3);
    assert!((figures.static_stability_factor - 0.949).abs() < 1e-3);
    assert!((figures.total_yaw_inertia_kg_m2 - 1849.0).abs() < 0.1);
    assert!((figures.wheelbase_m - 2.5789).abs() < 1e-9);
}

#[test]
fn a_key_without_its_unit_gets_a_suggestion() {
    let file = with_line("sprung_mass_kg", "sprung_mass = 1135.7");
    let line = line_of(&file, "sprung_mass =");
    assert_eq!(
        message(&file),
        format!(
            "unknown key `sprung_mass` at line {line}, column 1 of vehicles/x.toml: did you mean \
             `sprung_mass_kg`? every key carries its unit"
        )
    );
}

#[test]
fn a_misspelt_key_gets_the_nearest_one() {
    let file = with_line(
        "relaxation_length_lateral_m",
        "relaxation_lenght_lateral_m = 0.4",
    );
    assert!(
        message(&file).contains("did you mean `relaxation_length_lateral_m`?"),
        "{}",
        message(&file)
    );
    let file = text().replace("[aerodynamics]", "[aero]");
    assert!(
        message(&file).contains("unknown key `aero`"),
        "{}",
        message(&file)
    );
}

#[test]
fn a_key_like_no_other_gets_no_suggestion() {
    let file = with_line("ratio", "zzz = 1.0");
    let message = message(&file);
    assert!(
        message.contains("unknown key `zzz`") && !message.contains("did you mean"),
        "{message}"
    );
}

#[test]
fn a_negative_mass_is_refused_with_its_range() {
    let file = with_line("sprung_mass_kg", "sprung_mass_kg = -1135.7");
    assert_eq!(
        message(&file),
        "mass.sprung_mass_kg = -1135.7 in vehicles/x.toml: must be in (0, 1e5] kg"
    );
}

#[test]
fn a_missing_key_is_named_with_its_table() {
    let file = with_line("track_rear_m", "");
    let line = line_of(&file, "[geometry]");
    assert_eq!(
        message(&file),
        format!(
            "missing key `track_rear_m` in [geometry] at line {line} of vehicles/x.toml: add it \
             with its value (see vehicles/README.md)"
        )
    );
}

#[test]
fn a_missing_table_is_named() {
    let without_steering: Vec<String> = {
        let mut inside = false;
        text()
            .lines()
            .filter(|line| {
                if line.starts_with('[') {
                    inside = *line == "[steering]";
                }
                !inside
            })
            .map(str::to_owned)
            .collect()
    };
    let message = message(&without_steering.join("\n"));
    assert!(
        message.starts_with("missing key `steering` in the top level"),
        "{message}"
    );
}

#[test]
fn nan_and_infinity_are_refused() {
    for value in ["nan", "inf", "-inf"] {
        let file = with_line("mu_tyre", &format!("mu_tyre = {value}"));
        let message = message(&file);
        assert!(
            message.starts_with("tyre.mu_tyre = ") && message.ends_with("must be in (0, 3]"),
            "{message}"
        );
    }
}

#[test]
fn a_key_given_twice_is_refused_with_its_line() {
    let file = with_line("ratio", "ratio = 17.0\nratio = 18.0");
    let message = message(&file);
    let line = line_of(&file, "ratio = 18.0");
    assert!(
        message.contains("duplicate key") && message.contains(&format!("line {line}")),
        "{message}"
    );
}

#[test]
fn a_value_of_the_wrong_type_is_refused_with_its_line() {
    let file = with_line("ratio", "ratio = \"17\"");
    let message = message(&file);
    let line = line_of(&file, "ratio = ");
    assert!(
        message.contains("invalid type: string \"17\"")
            && message.contains(&format!("line {line}")),
        "{message}"
    );
    assert!(message.contains("`ratio = \"17\"`"), "{message}");
}

#[test]
fn each_impossible_value_is_refused_with_field_and_range() {
    for (table, key, value, range) in [
        ("mass", "unsprung_mass_rear_each_kg", "0.0", "(0, 1e4] kg"),
        (
            "mass",
            "sprung_roll_inertia_kg_m2",
            "-1.0",
            "(0, 1e6] kg m²",
        ),
        ("geometry", "track_front_m", "-1.4", "(0, 5] m"),
        ("geometry", "sprung_cg_to_rear_axle_m", "0.0", "(0, 20] m"),
        (
            "suspension",
            "spring_rate_front_n_per_m",
            "25.0",
            "[1000, 1e7] N/m",
        ),
        (
            "suspension",
            "damping_bump_rear_n_s_per_m",
            "-1400.0",
            "[0, 2e5] N s/m",
        ),
        ("suspension", "travel_m", "0.0", "(0, 1] m"),
        (
            "tyre",
            "vertical_stiffness_rear_n_per_m",
            "190.0",
            "[1e4, 1e8] N/m",
        ),
        ("tyre", "shape_factor_c1", "3.0", "[0.5, 2]"),
        ("tyre", "q_load", "-0.1", "[0, 2]"),
        (
            "tyre",
            "relaxation_length_longitudinal_m",
            "0.0",
            "[0.05, 5] m",
        ),
        (
            "wheel",
            "spin_inertia_rear_kg_m2",
            "0.0",
            "[0.05, 1000] kg m²",
        ),
        ("steering", "ratio", "0.0", "[1, 60]"),
        ("steering", "handwheel_limit_deg", "-260.0", "(0, 2000] deg"),
        ("powertrain", "max_power_w", "95.0", "[1000, 1e7] W"),
        ("powertrain", "drive_share_front", "1.5", "[0, 1]"),
        ("aerodynamics", "drag_area_m2", "-0.75", "[0, 50] m²"),
    ] {
        let message = message(&with_line(key, &format!("{key} = {value}")));
        assert!(
            message.starts_with(&format!("{table}.{key} = ")),
            "{message}"
        );
        assert!(
            message.ends_with(&format!("must be in {range}")),
            "{message}"
        );
    }
}

#[test]
fn values_that_contradict_each_other_are_refused() {
    for (key, value, hint) in [
        (
            "sprung_yaw_inertia_kg_m2",
            "9000.0",
            "none may exceed the sum of the other two",
        ),
        (
            "sprung_roll_yaw_product_kg_m2",
            "5000.0",
            "its square must be below",
        ),
        (
            "anti_roll_front_nm_per_rad",
            "-60000.0",
            "falls over at rest",
        ),
        (
            "vertical_stiffness_front_n_per_m",
            "15000.0",
            "more than half its radius",
        ),
    ] {
        let message = message(&with_line(key, &format!("{key} = {value}")));
        assert!(message.contains(hint), "{message}");
    }
}

#[test]
fn a_wheel_too_light_for_the_integration_step_is_refused_with_its_rate() {
    let file = with_line(
        "unsprung_mass_rear_each_kg",
        "unsprung_mass_rear_each_kg = 0.5",
    );
    let message = message(&file);
    assert!(
        message.starts_with(
            "mass.unsprung_mass_rear_each_kg = 0.5 with tyre.vertical_stiffness_rear_n_per_m = \
             190000, suspension.spring_rate_rear_n_per_m = 22000"
        ),
        "{message}"
    );
    assert!(
        message.contains("in vehicles/x.toml: the wheel would hop at a rate of")
            && message.contains("step of 1 ms follows at most 1000 1/s"),
        "{message}"
    );
}

#[test]
fn a_vehicle_just_within_the_limit_of_the_integration_step_runs() {
    // The lightest wheels that pass, found by halving the interval.
    let with_mass = |mass_kg: f64| {
        let mut vehicle = sedan();
        vehicle.mass.unsprung_mass_front_each_kg = mass_kg;
        vehicle.mass.unsprung_mass_rear_each_kg = mass_kg;
        vehicle
    };
    let (mut refused, mut allowed) = (0.1, 31.9);
    for _ in 0..30 {
        let middle = 0.5 * (refused + allowed);
        if with_mass(middle).check().is_ok() {
            allowed = middle;
        } else {
            refused = middle;
        }
    }
    assert!((1.0..10.0).contains(&allowed), "{allowed} kg");
    let seen = common::step_steer(common::on_flat(&with_mass(allowed), 0.85, 80.0), 40.0, 80.0);
    let last = seen.last().expect("not empty");
    assert!(last.ltr > 0.3 && last.ltr < 0.9, "{}", last.ltr);
}

#[test]
fn an_empty_name_is_refused() {
    for name in ["", "  "] {
        assert_eq!(
            message(&with_line("name", &format!("name = \"{name}\""))),
            "name is empty in vehicles/x.toml: give a short one, as it stands in logs and tables"
        );
    }
}

#[test]
fn a_file_that_is_not_there_says_what_else_there_is() {
    let error = vehicles::find("no/such/file.toml").expect_err("absent");
    assert!(matches!(error, ParameterError::Unreadable { .. }));
    let message = error.to_string();
    assert!(
        message.contains("no/such/file.toml") && message.contains("(sedan"),
        "{message}"
    );
    assert_eq!(vehicles::find("sedan").expect("embedded"), sedan());
}

#[test]
fn a_vehicle_written_and_read_again_is_the_same() {
    let written = toml::to_string(&sedan()).expect("writable");
    assert_eq!(
        VehicleParameters::from_toml(&written, "copy").expect("valid"),
        sedan()
    );
}

#[test]
fn a_name_that_would_leave_the_folder_of_results_is_refused() {
    for name in ["../../x", ".hidden", "a/b", "a\\b"] {
        let vehicle = VehicleParameters {
            name: name.to_owned(),
            ..sedan()
        };
        let message = vehicle.check().expect_err("refused").to_string();
        assert!(message.contains(&format!("name = `{name}`")), "{message}");
    }
}
