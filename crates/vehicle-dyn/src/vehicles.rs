//! The vehicles built into the binary, so that it works anywhere. A file given by the user wins.

use crate::parameters::{ParameterError, VehicleParameters};

/// Name and text of every embedded vehicle file.
const EMBEDDED: &[(&str, &str)] = &[
    ("sedan", include_str!("../../../vehicles/sedan.toml")),
    (
        "sedan-unladen",
        include_str!("../../../vehicles/sedan-unladen.toml"),
    ),
    (
        "utility-truck",
        include_str!("../../../vehicles/utility-truck.toml"),
    ),
    (
        "utility-truck-laden",
        include_str!("../../../vehicles/utility-truck-laden.toml"),
    ),
    ("suv", include_str!("../../../vehicles/suv.toml")),
    ("hmmwv", include_str!("../../../vehicles/hmmwv.toml")),
];

/// Names of the embedded vehicles.
#[must_use]
pub fn names() -> Vec<&'static str> {
    EMBEDDED.iter().map(|(name, _)| *name).collect()
}

/// TOML text of the embedded vehicle `name`, or `None` when there is none of that name.
#[must_use]
pub fn embedded_text(name: &str) -> Option<&'static str> {
    EMBEDDED
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}

/// The embedded vehicle `name`.
///
/// # Errors
/// [`ParameterError::Unreadable`] with the known names when there is none of that name.
pub fn embedded(name: &str) -> Result<VehicleParameters, ParameterError> {
    let text = embedded_text(name).ok_or_else(|| ParameterError::Unreadable {
        origin: name.to_owned(),
        reason: "no embedded vehicle has this name".to_owned(),
        embedded: names().join(", "),
    })?;
    VehicleParameters::from_toml(text, &format!("vehicles/{name}.toml"))
}

/// The vehicle that a user names: a path to a file when one exists there, else an embedded name.
///
/// # Errors
/// As [`VehicleParameters::read`].
pub fn find(name_or_path: &str) -> Result<VehicleParameters, ParameterError> {
    if std::path::Path::new(name_or_path).is_file() || embedded_text(name_or_path).is_none() {
        VehicleParameters::read(name_or_path)
    } else {
        embedded(name_or_path)
    }
}
