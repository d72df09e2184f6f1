//! The place in a scenario file of what is wrong with it.

use super::load::ScenarioError;
use crate::toml_place::{Place, meant};

/// What the parser says, with the place and what may be meant.
pub(super) fn malformed(error: &toml::de::Error, text: &str, origin: &str) -> ScenarioError {
    let message = error.message().trim_end();
    // What is wrong with a controller as a whole has the place of the first of them.
    let of_controller = message
        .strip_prefix("in ")
        .and_then(|rest| rest.split_once(": "))
        .and_then(|(field, _)| Place::of_field(text, field));
    let place = of_controller.or_else(|| Place::of_span(text, &error.span()?));
    let message = match meant(message) {
        Some(meant) => format!("{message}; {meant}"),
        None => message.to_owned(),
    };
    let origin = origin.to_owned();
    ScenarioError::Malformed { origin, message }.at(place)
}

impl ScenarioError {
    /// The field of the file that it is about.
    pub(super) fn field(&self) -> Option<String> {
        match self {
            Self::OutOfRange { field, .. } | Self::Course { field, .. } => Some(field.clone()),
            Self::Ground { of, source, .. } => {
                let table = &of.table;
                // Its message begins with the field.
                let message = source.to_string();
                let field = message.split([' ', ':']).next().unwrap_or_default();
                Some(format!("{table}{field}"))
            }
            _ => None,
        }
    }

    /// The same with a place, if there is one.
    pub(super) fn at(self, place: Option<Place>) -> Self {
        match place {
            Some(place) => Self::At {
                error: Box::new(self),
                place,
            },
            None => self,
        }
    }
}
