//! The JSON schema of a vehicle file, for editors: generated from the types, their documentation
//! and the table of allowed ranges, so that it cannot disagree with the checks.

use serde_json::{Map, Value, json};

use super::{VehicleParameters, fields};

/// The schema (JSON Schema 2020-12). Every number carries the range that
/// [`VehicleParameters::check`] allows.
#[must_use]
pub fn schema() -> Value {
    let mut schema = schemars::generate::SchemaSettings::draft2020_12()
        // A table may be used twice with different ranges, so none is shared.
        .with(|settings| settings.inline_subschemas = true)
        .into_generator()
        .into_root_schema_for::<VehicleParameters>()
        .to_value();
    join_lines(&mut schema);
    for field in fields() {
        let Some(number) = property(&mut schema, field.table, field.key) else {
            continue;
        };
        let interval = field.interval;
        let least = if interval.low_belongs {
            "minimum"
        } else {
            "exclusiveMinimum"
        };
        number.remove("format");
        number.insert(least.to_owned(), json!(interval.low));
        number.insert("maximum".to_owned(), json!(interval.high));
    }
    schema
}

/// The schema as it stands in `vehicles/vehicle.schema.json`.
#[must_use]
pub fn schema_text() -> String {
    // Alternate form of a `Value` is indented JSON, and cannot fail.
    format!("{:#}\n", schema())
}

/// The property `key` in the table of that name, such as `suspension.solid_axle_rear`.
fn property<'a>(
    schema: &'a mut Value,
    table: &str,
    key: &str,
) -> Option<&'a mut Map<String, Value>> {
    let mut at = schema;
    for name in table.split('.').chain([key]) {
        // The schema of an optional table is its own or null.
        if at.get("anyOf").is_some() {
            at = at.get_mut("anyOf")?.get_mut(0)?;
        }
        at = at.get_mut("properties")?.get_mut(name)?;
    }
    at.as_object_mut()
}

/// Descriptions come with the line ends of the source.
fn join_lines(value: &mut Value) {
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                match member {
                    Value::String(text) if name == "description" => {
                        *text = text.replace('\n', " ");
                    }
                    _ => join_lines(member),
                }
            }
        }
        Value::Array(members) => members.iter_mut().for_each(join_lines),
        _ => {}
    }
}
