//! Manoeuvre files: embedded ones by name, and any a user passes.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Manoeuvre, ManoeuvreError};

macro_rules! embedded {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../../../scenarios/manoeuvres/", $name, ".toml")))),*]
    };
}

/// Name and text of every embedded manoeuvre.
const EMBEDDED: &[(&str, &str)] = embedded![
    "slowly-increasing-steer",
    "j-turn",
    "fishhook-1a",
    "fishhook-1b",
    "sine-with-dwell",
    "iso-3888-1",
    "iso-3888-2",
    "iso-7401-step",
    "iso-7401-frequency",
    "iso-4138-constant-radius",
    "iso-4138-constant-speed",
    "tilt-table",
];

/// A manoeuvre file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ManoeuvreFile {
    /// Short name, also the name of its file.
    pub name: String,
    /// What it shows, in a sentence or two.
    pub description: String,
    /// The standard it follows.
    pub standard: String,
    /// Friction of the flat pad (no unit); the tyre's own factor is in the vehicle file.
    pub friction: f64,
    /// The manoeuvre.
    pub manoeuvre: Manoeuvre,
}

impl ManoeuvreFile {
    /// Reads and checks a manoeuvre from TOML text; `origin` names it in messages.
    ///
    /// # Errors
    /// [`ManoeuvreError`] with the place, or with field, value and range.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, ManoeuvreError> {
        let file: Self = toml::from_str(text).map_err(|error| ManoeuvreError::Malformed {
            origin: origin.to_owned(),
            message: error.to_string().trim_end().to_owned(),
        })?;
        file.check()?;
        Ok(file)
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`ManoeuvreError::OutOfRange`] with field, number and range.
    pub fn check(&self) -> Result<(), ManoeuvreError> {
        let refused = |field: &str, value: String, allowed: &str| {
            Err(ManoeuvreError::OutOfRange {
                field: field.to_owned(),
                value,
                allowed: allowed.to_owned(),
            })
        };
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        let name = &self.name;
        // Names become names of folders.
        if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
            let allowed = "made of letters, digits, `-`, `_` and `.`, not beginning with `.`";
            return refused("name", format!("`{name}`"), allowed);
        }
        if !(0.01..=5.0).contains(&self.friction) {
            return refused("friction", self.friction.to_string(), "in [0.01, 5]");
        }
        self.manoeuvre.check()
    }
}

/// Names of the embedded manoeuvres.
#[must_use]
pub fn names() -> Vec<&'static str> {
    EMBEDDED.iter().map(|(name, _)| *name).collect()
}

/// TOML text of the embedded manoeuvre `name`, or `None` when there is none of that name.
#[must_use]
pub fn embedded_text(name: &str) -> Option<&'static str> {
    EMBEDDED
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, text)| *text)
}

/// The manoeuvre that a user names: a file when there is one or the name ends in `.toml`, else an
/// embedded one.
///
/// # Errors
/// [`ManoeuvreError`] with the known names and the nearest one, or what is wrong with the file.
pub fn find(name_or_path: &str) -> Result<ManoeuvreFile, ManoeuvreError> {
    let path = Path::new(name_or_path);
    if path.is_file()
        || path
            .extension()
            .is_some_and(|extension| extension == "toml")
    {
        let text = std::fs::read_to_string(path).map_err(|error| ManoeuvreError::Unreadable {
            origin: name_or_path.to_owned(),
            reason: error.to_string(),
            known: names().join(", "),
        })?;
        return ManoeuvreFile::from_toml(&text, name_or_path);
    }
    match embedded_text(name_or_path) {
        Some(text) => {
            ManoeuvreFile::from_toml(text, &format!("the built-in manoeuvre {name_or_path}"))
        }
        None => Err(unknown(name_or_path)),
    }
}

fn unknown(name: &str) -> ManoeuvreError {
    const SIMILAR_ENOUGH: f64 = 0.75;
    let nearest = names()
        .into_iter()
        .map(|known| (strsim::jaro_winkler(known, name), known))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(similarity, _)| *similarity > SIMILAR_ENOUGH);
    ManoeuvreError::Unknown {
        name: name.to_owned(),
        suggestion: nearest.map_or_else(String::new, |(_, known)| {
            format!(" (did you mean `{known}`?)")
        }),
        known: names().join(", "),
    }
}
