//! Physically impossible vehicles: each is refused with the field, the number and the range.

use vehicle_dyn::parameters::{VehicleParameters, fields};
use vehicle_dyn::vehicles;

/// The truck has every optional table.
fn truck() -> String {
    vehicles::embedded_text("utility-truck")
        .expect("embedded")
        .to_owned()
}

/// The truck with values at paths such as `suspension.travel_m`.
fn changed(changes: &[(&str, f64)]) -> String {
    let mut file: toml::Table = truck().parse().expect("TOML");
    for (path, value) in changes {
        let (tables, key) = path.rsplit_once('.').expect("a table and a key");
        let mut table = &mut file;
        for name in tables.split('.') {
            table = table[name].as_table_mut().expect("a table");
        }
        assert!(table.contains_key(key), "{path}");
        table.insert(key.to_owned(), toml::Value::Float(*value));
    }
    toml::to_string(&file).expect("writable")
}

fn message(file: &str) -> String {
    VehicleParameters::from_toml(file, "x.toml")
        .expect_err("must be refused")
        .to_string()
}

#[test]
fn every_value_outside_its_range_is_refused_with_field_number_and_range() {
    for field in fields() {
        let interval = field.interval;
        let scale = (interval.high - interval.low).abs();
        let below = if interval.low_belongs {
            interval.low - 1e-3 * scale
        } else {
            interval.low
        };
        let path = format!("{}.{}", field.table, field.key);
        for value in [
            below,
            interval.high + 1e-3 * scale,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ] {
            let message = message(&changed(&[(&path, value)]));
            assert_eq!(
                message,
                format!("{path} = {value} in x.toml: must be in {}", field.range())
            );
        }
    }
}

/// Impossible values: what is changed, then what the message must say.
#[allow(clippy::type_complexity, reason = "a table")]
const IMPOSSIBLE: &[(&[(&str, f64)], &[&str])] = &[
    (&[("mass.sprung_mass_kg", -4455.0)], &["(0, 1e5] kg"]),
    (
        &[("mass.unsprung_mass_rear_each_kg", 0.0)],
        &["(0, 1e4] kg"],
    ),
    (
        &[("mass.sprung_pitch_inertia_kg_m2", 0.0)],
        &["(0, 1e6] kg m²"],
    ),
    (&[("mass.sprung_cg_height_m", -1.2)], &["(0, 5] m"]),
    (
        &[("mass.sprung_yaw_inertia_kg_m2", 90_000.0)],
        &["2283.9/35402.8/90000", "none may exceed the sum"],
    ),
    (
        &[("mass.sprung_roll_yaw_product_kg_m2", 9000.0)],
        &["product_kg_m2 = 9000", "its square must be below"],
    ),
    (&[("geometry.track_rear_m", 0.0)], &["(0, 5] m"]),
    (
        &[("geometry.sprung_cg_to_front_axle_m", -1.11)],
        &["(0, 20] m"],
    ),
    // Springs in N/mm.
    (
        &[("suspension.spring_rate_front_n_per_m", 250.0)],
        &["[1000, 1e7] N/m"],
    ),
    (
        &[("suspension.damping_bump_front_n_s_per_m", -1.0)],
        &["[0, 2e5] N s/m"],
    ),
    (&[("suspension.travel_m", -0.09)], &["(0, 1] m"]),
    (
        &[("suspension.anti_roll_rear_nm_per_rad", -400_000.0)],
        &[
            "roll stiffness",
            "both must be positive",
            "falls over at rest",
        ],
    ),
    // Springs that stand together hold no body upright.
    (
        &[("suspension.solid_axle_rear.spring_spacing_m", 0.0)],
        &["solid_axle_rear.spring_spacing_m = 0", "[0.1, 5] m"],
    ),
    (
        &[("suspension.solid_axle_front.damper_spacing_m", 0.0)],
        &["solid_axle_front.damper_spacing_m = 0", "[0.1, 5] m"],
    ),
    (
        &[
            ("suspension.solid_axle_front.spring_spacing_m", 0.1),
            ("suspension.anti_roll_front_nm_per_rad", -1500.0),
        ],
        &["roll stiffness -250 N m/rad front"],
    ),
    (
        &[("suspension.camber_gain_rear_rad_per_m", 0.4)],
        &[
            "camber_gain_rear_rad_per_m = 0.4 with suspension.solid_axle_rear",
            "lean with the axle: give 0",
        ],
    ),
    (
        &[("tyre.crown_radius_m", 0.6)],
        &[
            "crown_radius_m = 0.6 with tyre.unloaded_radius_m = 0.53",
            "must not exceed",
        ],
    ),
    (
        &[
            ("tyre.twin_spacing_rear_m", 0.9),
            ("geometry.track_rear_m", 0.8),
        ],
        &[
            "twin_spacing_rear_m = 0.9 with geometry.track_rear_m = 0.8",
            "would overlap",
        ],
    ),
    (&[("tyre.twin_spacing_rear_m", -0.3)], &["[0, 1] m"]),
    (&[("tyre.lateral_compliance_m_per_n", -1e-6)], &["m/N"]),
    (&[("tyre.mu_tyre", 0.0)], &["(0, 3]"]),
    (
        &[("tyre.vertical_stiffness_front_n_per_m", 50_000.0)],
        &["under 19797 N", "more than half its radius"],
    ),
    (
        &[("wheel.gyroscopic_inertia_rear_kg_m2", 30.0)],
        &[
            "gyroscopic_inertia_rear_kg_m2 = 30 with wheel.spin_inertia_rear_kg_m2 = 20",
            "a part of what resists spinning up",
        ],
    ),
    (
        &[("steering.ratio", 10.0)],
        &[
            "handwheel_limit_deg = 720 with steering.ratio = 10",
            "60 deg",
        ],
    ),
    // Kilowatts.
    (&[("powertrain.max_power_w", 175.0)], &["[1000, 1e7] W"]),
    (&[("powertrain.brake_share_front", 1.01)], &["[0, 1]"]),
    (&[("aerodynamics.drag_area_m2", -4.7)], &["[0, 50] m²"]),
    (&[("driver.preview_time_s", 0.0)], &["[0.05, 10] s"]),
    (
        &[("mass.unsprung_mass_front_each_kg", 1.0)],
        &["unsprung_mass_front_each_kg = 1 with", "hop at a rate of"],
    ),
];

#[test]
fn each_impossible_vehicle_is_refused_with_what_is_wrong() {
    for (changes, expected) in IMPOSSIBLE {
        let message = message(&changed(changes));
        for piece in *expected {
            assert!(message.contains(piece), "`{piece}` in: {message}");
        }
        let (_, key) = changes[0].0.rsplit_once('.').expect("a key");
        assert!(
            message.contains(key)
                || message.contains("roll stiffness")
                || message.contains("sprung_roll/pitch/yaw"),
            "{message}"
        );
    }
}

#[test]
fn wide_springs_count_with_their_motion_for_the_integration_step() {
    let wide = [
        ("suspension.solid_axle_front.spring_spacing_m", 5.0),
        ("suspension.spring_rate_front_n_per_m", 1e7),
        ("suspension.solid_axle_front.damper_spacing_m", 5.0),
    ];
    let light = ("mass.unsprung_mass_front_each_kg", 30.0);
    let message = message(&changed(&[wide[0], wide[1], wide[2], light]));
    assert!(message.contains("hop at a rate of"), "{message}");
    let narrow = changed(&[wide[1], light]);
    VehicleParameters::from_toml(&narrow, "x.toml").expect("slow enough");
}

#[test]
fn keys_missing_and_unknown_in_optional_tables_are_named_with_their_line() {
    let line_of = |text: &str, start: &str| {
        1 + text
            .lines()
            .position(|line| line.starts_with(start))
            .expect("present")
    };
    for (table, line_start, key) in [
        (
            "[suspension.solid_axle_rear]",
            "spring_spacing_m = 1.00",
            "spring_spacing_m",
        ),
        ("[driver]", "preview_time_s", "preview_time_s"),
    ] {
        let text = truck();
        let without: Vec<&str> = text
            .lines()
            .filter(|line| !line.starts_with(line_start))
            .collect();
        let without = without.join("\n");
        let message = message(&without);
        let line = line_of(&without, table);
        assert!(
            message.contains(&format!(
                "missing key `{key}` in {table} at line {line} of x.toml"
            )),
            "{message}"
        );
    }
    let text = truck().replace(
        "[suspension.solid_axle_rear]\n",
        "[suspension.solid_axle_rear]\nspring_spacing = 1.0\n",
    );
    let line = line_of(&text, "spring_spacing = ");
    let found = message(&text);
    assert!(
        found.contains(&format!(
            "unknown key `spring_spacing` at line {line}, column 1 of x.toml: did you mean \
             `spring_spacing_m`?"
        )),
        "{found}"
    );
    let text = truck().replace(
        "[suspension.solid_axle_rear]",
        "[suspension.beam_axle_rear]",
    );
    let found = message(&text);
    assert!(found.contains("unknown key `beam_axle_rear`"), "{found}");
    let text = truck().replace("[driver]", "[drivers]");
    let found = message(&text);
    assert!(
        found.contains("unknown key `drivers`") && found.contains("did you mean `driver`?"),
        "{found}"
    );
}
