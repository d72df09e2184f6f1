//! The files in `vehicles/`: schema and documentation follow from the types, and every vehicle says
//! where its values come from.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde_json::Value;
use vehicle_dyn::parameters::{fields, schema};
use vehicle_dyn::vehicles;

/// Set to rewrite the schema and the README's fields instead of comparing them.
const UPDATE: &str = "UPDATE_VEHICLE_FILES";
const BEGIN: &str = "<!-- fields: written by tests/vehicle_files.rs -->\n";
const END: &str = "<!-- end of fields -->\n";

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../vehicles")
        .join(name)
}

fn read(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap_or_default()
}

fn compare_or_update(name: &str, found: &str, expected: &str) {
    if std::env::var_os(UPDATE).is_some() {
        std::fs::write(path(name), expected).expect("writable");
        return;
    }
    assert!(
        found == expected,
        "vehicles/{name} is out of date: run `{UPDATE}=1 cargo test -p vehicle-dyn --test \
         vehicle_files` and look at the difference"
    );
}

/// The schema of a table such as `suspension.solid_axle_rear`.
fn table_schema<'a>(schema: &'a Value, table: &str) -> &'a Value {
    let mut at = schema;
    for name in table.split('.') {
        if let Some(options) = at.get("anyOf") {
            at = &options[0];
        }
        at = &at["properties"][name];
    }
    at
}

fn description(of: &Value) -> String {
    of["description"].as_str().expect("documented").to_owned()
}

/// Documentation of every field, table by table.
fn documentation() -> String {
    let schema = schema::schema();
    let mut text = String::new();
    let mut table = "";
    for field in fields() {
        let within = table_schema(&schema, field.table);
        if field.table != table {
            table = field.table;
            let optional = if within.get("anyOf").is_some() {
                " (optional)"
            } else {
                ""
            };
            let about = description(within);
            write!(
                text,
                "\n### `[{table}]`{optional}\n{about}\n\n| Key | Allowed | Meaning |\n|---|---|---|\n"
            )
            .expect("text");
        }
        let properties = within.get("anyOf").map_or(within, |options| &options[0]);
        let about = description(&properties["properties"][field.key]);
        let (key, range) = (field.key, field.range());
        writeln!(text, "| `{key}` | {range} | {about} |").expect("text");
    }
    text + "\n"
}

#[test]
fn the_schema_for_editors_is_that_of_the_types() {
    compare_or_update(
        "vehicle.schema.json",
        &read("vehicle.schema.json"),
        &schema::schema_text(),
    );
}

#[test]
fn the_readme_documents_every_field_and_no_other() {
    let readme = read("README.md");
    let (before, rest) = readme.split_once(BEGIN).expect("the marker of the fields");
    let (_, after) = rest.split_once(END).expect("the end of the fields");
    let expected = format!("{before}{BEGIN}{}{END}{after}", documentation());
    compare_or_update("README.md", &readme, &expected);
}

#[test]
fn the_schema_and_the_table_of_ranges_have_the_same_numbers() {
    fn count(value: &Value) -> usize {
        match value {
            Value::Object(members) => {
                let own = usize::from(members.get("type") == Some(&Value::from("number")));
                own + members.values().map(count).sum::<usize>()
            }
            Value::Array(members) => members.iter().map(count).sum(),
            _ => 0,
        }
    }
    let schema = schema::schema();
    assert_eq!(count(&schema), fields().count());
    for field in fields() {
        let within = table_schema(&schema, field.table);
        let table = within.get("anyOf").map_or(within, |options| &options[0]);
        let number = &table["properties"][field.key];
        let low = number
            .get("minimum")
            .or(number.get("exclusiveMinimum"))
            .and_then(Value::as_f64);
        assert_eq!(low, Some(field.interval.low), "{}", field.key);
        assert_eq!(
            number.get("minimum").is_some(),
            field.interval.low_belongs,
            "{}",
            field.key
        );
        assert_eq!(
            number["maximum"].as_f64(),
            Some(field.interval.high),
            "{}",
            field.key
        );
    }
}

#[test]
fn every_vehicle_names_its_schema_and_the_origin_of_every_value() {
    for name in vehicles::names() {
        let text = vehicles::embedded_text(name).expect("embedded");
        assert!(
            text.starts_with("#:schema ./vehicle.schema.json\n"),
            "{name}"
        );
        for origin in ["sourced", "derived", "estimate"] {
            assert!(text.contains(&format!("#   {origin} ")), "{name}: {origin}");
        }
        let mut table_has_origin = false;
        for line in text.lines() {
            if line.starts_with('[') {
                table_has_origin = line.contains('#');
            } else if line.contains(" = ") && !line.starts_with(['#', 'n', 'd']) {
                assert!(
                    line.contains('#') || table_has_origin,
                    "{name}: no origin in `{line}`"
                );
            }
        }
    }
}

#[test]
fn every_file_in_the_folder_is_embedded() {
    let mut files: Vec<String> = std::fs::read_dir(path("."))
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    files.sort();
    let mut names = vehicles::names();
    names.sort_unstable();
    assert_eq!(files, names);
}

#[test]
fn the_roll_stiffness_of_the_suv_is_that_of_its_source() {
    let suv = vehicles::embedded("suv").expect("valid");
    let figures = suv.derived();
    for (found, sourced) in [
        (figures.roll_stiffness_front_nm_per_rad, 127_122.0),
        (figures.roll_stiffness_rear_nm_per_rad, 62_341.0),
    ] {
        assert!((found / sourced - 1.0).abs() < 1e-3, "{found} {sourced}");
    }
    assert!((figures.total_mass_kg - 2030.0).abs() < 0.1);
    assert!((figures.cg_height_m / 0.8261 - 1.0).abs() < 0.005);
    assert!((figures.cg_to_front_axle_m / 1.3514 - 1.0).abs() < 0.002);
    assert!((figures.total_yaw_inertia_kg_m2 / 3742.6 - 1.0).abs() < 0.002);
    // Without the roof load it rolls by the 3.47 deg/g that the source shows; its tyres there are
    // stiff sideways.
    let mut unladen = suv;
    unladen.mass.sprung_mass_kg = 1590.0;
    unladen.mass.sprung_cg_height_m = 0.720;
    unladen.tyre.lateral_compliance_m_per_n = 0.0;
    let gradient = unladen.cornering_figures(0.85).roll_gradient_deg_per_g;
    assert!((gradient / 3.47 - 1.0).abs() < 0.1, "{gradient} deg/g");
}
