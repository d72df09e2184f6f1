//! Reading a vehicle file: TOML, with the line and a suggestion when a key is wrong.

use std::ops::Range;
use std::path::Path;

use super::{ParameterError, VehicleParameters};

impl VehicleParameters {
    /// Reads and checks a vehicle from TOML text; `origin_name` names it in messages.
    ///
    /// # Errors
    /// [`ParameterError`] with line and column, or with field, value and range.
    pub fn from_toml(text: &str, origin_name: &str) -> Result<Self, ParameterError> {
        let parameters: Self =
            toml::from_str(text).map_err(|error| explain(&error, text, origin_name))?;
        parameters.check_as(origin_name)?;
        Ok(parameters)
    }

    /// Reads and checks a vehicle file.
    ///
    /// # Errors
    /// As [`VehicleParameters::from_toml`], or [`ParameterError::Unreadable`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ParameterError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|error| ParameterError::Unreadable {
            origin: path.display().to_string(),
            reason: error.to_string(),
            embedded: crate::vehicles::names().join(", "),
        })?;
        Self::from_toml(&text, &path.display().to_string())
    }
}

fn explain(error: &toml::de::Error, text: &str, origin: &str) -> ParameterError {
    let span = error.span().unwrap_or(0..0);
    let (line, column) = line_and_column(text, &span);
    let message = error.message();
    if let Some(rest) = message.strip_prefix("unknown field `") {
        let key = rest.split('`').next().unwrap_or_default().to_owned();
        // serde lists the accepted keys in backticks behind "expected".
        let accepted: Vec<&str> = rest.split('`').skip(2).step_by(2).collect();
        return ParameterError::UnknownKey {
            suggestion: suggestion(&key, &accepted),
            key,
            line,
            column,
            origin: origin.to_owned(),
        };
    }
    if let Some(rest) = message.strip_prefix("missing field `") {
        return ParameterError::MissingKey {
            key: rest.trim_end_matches('`').to_owned(),
            table: table_at(text, span.start),
            line,
            origin: origin.to_owned(),
        };
    }
    ParameterError::Syntax {
        message: message.to_owned(),
        line,
        column,
        origin: origin.to_owned(),
        excerpt: text
            .lines()
            .nth(line - 1)
            .unwrap_or_default()
            .trim()
            .to_owned(),
    }
}

/// Line and column of the start of `span`, both from 1.
fn line_and_column(text: &str, span: &Range<usize>) -> (usize, usize) {
    let before = text.get(..span.start).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    (line, column)
}

/// The table that holds the byte `offset`, for a message.
fn table_at(text: &str, offset: usize) -> String {
    // The span of a missing key is its table, whose header is the line at the span's start.
    let end = text[offset.min(text.len())..]
        .find('\n')
        .map_or(text.len(), |length| offset + length);
    text[..end]
        .lines()
        .map(str::trim)
        .rfind(|line| line.starts_with('['))
        .filter(|_| offset > 0)
        .map_or_else(
            || "the top level".to_owned(),
            |line| line.split('#').next().unwrap_or(line).trim().to_owned(),
        )
}

/// The accepted key nearest to a wrong one: the same name with a unit first, then by spelling.
fn suggestion(key: &str, accepted: &[&str]) -> String {
    const SIMILAR_ENOUGH: f64 = 0.8;
    let with_unit = accepted
        .iter()
        .find(|name| name.starts_with(&format!("{key}_")));
    let nearest = accepted
        .iter()
        .map(|name| (strsim::jaro_winkler(key, name), name))
        .filter(|(similarity, _)| *similarity >= SIMILAR_ENOUGH)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name);
    with_unit
        .or(nearest)
        .map_or_else(String::new, |name| format!("did you mean `{name}`? "))
}
