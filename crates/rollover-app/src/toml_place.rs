//! Where in a TOML file something is wrong: line, column and the line itself; and what was meant.

use std::fmt;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// A place in a file, for the end of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// The line.
    pub text: String,
    /// Characters to underline.
    length: usize,
}

impl Place {
    /// The place of a span of bytes, as the parser gives it.
    #[must_use]
    pub fn of_span(text: &str, span: &Range<usize>) -> Option<Self> {
        let before = text.get(..span.start)?;
        let begin = before.rfind('\n').map_or(0, |at| at + 1);
        let line = text.get(begin..)?.lines().next().unwrap_or_default();
        let column = text.get(begin..span.start)?.chars().count();
        let inside = text.get(span.start..span.end).unwrap_or_default();
        let length = inside.lines().next().unwrap_or_default().chars().count();
        Some(Self {
            line: before.matches('\n').count() + 1,
            column: column + 1,
            text: line.to_owned(),
            length: length.max(1),
        })
    }

    /// The place of a field such as `bounds.target_speed_kmh[0]`, or of the table nearest to it, since
    /// a field may be taken over from elsewhere or missing. `None` if nothing of it is there.
    #[must_use]
    pub fn of_field(text: &str, field: &str) -> Option<Self> {
        let document = DeTable::parse(text).ok()?;
        let mut table = document.get_ref();
        let mut found = None;
        let mut path = field;
        while let Some((key, value, rest)) = step(table, path) {
            // The header of a table, or the key and its value.
            found = Some(match value.get_ref() {
                DeValue::Table(_) => key.clone(),
                _ => key.start..value.span().end,
            });
            let (mut value, mut rest) = (value, rest);
            while let Some((index, after)) = indexed(rest) {
                let Some(entry) = value.get_ref().as_array().and_then(|a| a.get(index)) else {
                    break;
                };
                (value, rest) = (entry, after);
                found = Some(entry.span());
            }
            match value.get_ref() {
                DeValue::Table(inner) => table = inner,
                _ => break,
            }
            path = rest.trim_start_matches('.');
        }
        Self::of_span(text, &found?)
    }

    /// The place of a key of this name, wherever it stands.
    #[must_use]
    pub fn of_key(text: &str, name: &str) -> Option<Self> {
        let document = DeTable::parse(text).ok()?;
        Self::of_span(text, &key_within(document.get_ref(), name)?)
    }
}

/// The first key of this name in a table or the tables within it.
fn key_within(table: &DeTable<'_>, name: &str) -> Option<Range<usize>> {
    table.iter().find_map(|(key, value)| {
        if key.get_ref() == name {
            return Some(key.span());
        }
        match value.get_ref() {
            DeValue::Table(inner) => key_within(inner, name),
            DeValue::Array(entries) => entries
                .iter()
                .filter_map(|entry| entry.get_ref().as_table())
                .find_map(|inner| key_within(inner, name)),
            _ => None,
        }
    })
}

/// The entry that a dotted path begins with. Names may hold dots themselves: the longest wins.
fn step<'t, 'p>(
    table: &'t DeTable<'_>,
    path: &'p str,
) -> Option<(Range<usize>, &'t toml::Spanned<DeValue<'t>>, &'p str)> {
    let begins = |name: &str| {
        let rest = path.strip_prefix(name)?;
        (rest.is_empty() || rest.starts_with(['.', '['])).then_some(rest)
    };
    table
        .iter()
        .filter_map(|(key, value)| Some((key, value, begins(key.get_ref())?)))
        .max_by_key(|(key, ..)| key.get_ref().len())
        .map(|(key, value, rest)| (key.span(), value, rest))
}

/// `[3].rest` → 3 and `.rest`.
fn indexed(path: &str) -> Option<(usize, &str)> {
    let (index, rest) = path.strip_prefix('[')?.split_once(']')?;
    Some((index.parse().ok()?, rest))
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        writeln!(f, "at line {number}, column {}", self.column)?;
        writeln!(f, "{margin} |")?;
        writeln!(f, "{number} | {}", self.text)?;
        let indent = " ".repeat(self.column - 1);
        write!(f, "{margin} | {indent}{}", "^".repeat(self.length))
    }
}

/// The key that serde's message says is unknown.
#[must_use]
pub fn unknown_key(message: &str) -> Option<&str> {
    let (_, rest) = message.split_once("unknown field `")?;
    rest.split('`').next()
}

/// "did you mean `x`?" for serde's messages about unknown fields and variants, else nothing.
#[must_use]
pub fn meant(message: &str) -> Option<String> {
    let rest = ["unknown field `", "unknown variant `"]
        .iter()
        .find_map(|start| message.find(start).map(|at| &message[at + start.len()..]))?;
    // What is accepted stands in backticks behind "expected".
    let mut names = rest.split('`');
    let wrong = names.next()?;
    let accepted: Vec<&str> = names.skip(1).step_by(2).collect();
    nearest(wrong, &accepted).map(|name| format!("did you mean `{name}`?"))
}

/// The known name nearest to a wrong one: the same with a unit first, then by spelling.
#[must_use]
pub fn nearest<'a>(wrong: &str, known: &[&'a str]) -> Option<&'a str> {
    const SIMILAR_ENOUGH: f64 = 0.75;
    let with_unit = known
        .iter()
        .find(|name| name.starts_with(&format!("{wrong}_")));
    let by_spelling = known
        .iter()
        .map(|name| (strsim::jaro_winkler(wrong, name), name))
        .filter(|(similarity, _)| *similarity > SIMILAR_ENOUGH)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name);
    with_unit.or(by_spelling).copied()
}

/// " (did you mean `x`?)" for a wrong name, or nothing.
#[must_use]
pub fn suggested<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    nearest(wrong, &known).map_or_else(String::new, |name| format!(" (did you mean `{name}`?)"))
}

#[cfg(test)]
mod tests {
    use super::{Place, meant};

    const TEXT: &str = "name = \"ä\"\n[a]\nlist = [1, 22, 3]\n[a.b-1.5]\nx = { y = 3 }\n";

    fn at(field: &str) -> Option<(usize, usize, String)> {
        let place = Place::of_field(TEXT, field)?;
        let marked = place.text.chars().skip(place.column - 1);
        let marked = marked.take(place.length).collect();
        Some((place.line, place.column, marked))
    }

    #[test]
    fn fields_are_found() {
        assert_eq!(at("name"), Some((1, 1, "name = \"ä\"".into())));
        assert_eq!(at("a.list[1]"), Some((3, 12, "22".into())));
        assert_eq!(at("a.list"), Some((3, 1, "list = [1, 22, 3]".into())));
        assert_eq!(at("a.list[7]"), Some((3, 1, "list = [1, 22, 3]".into())));
        assert_eq!(at("none"), None);
        let place = Place::of_key(TEXT, "y").map(|place| (place.line, place.column));
        assert_eq!(place, Some((5, 7)));
    }

    #[test]
    fn what_is_missing_is_placed_at_its_table() {
        assert_eq!(at("a.nothing.here"), Some((2, 2, "a".into())));
    }

    #[test]
    fn what_was_meant_is_found() {
        let message = "unknown field `duration`, expected one of `name`, `duration_s`";
        assert_eq!(meant(message), Some("did you mean `duration_s`?".into()));
        let message = "unknown variant `lmcp`, expected one of `deepc`, `lmpc`";
        assert_eq!(meant(message), Some("did you mean `lmpc`?".into()));
        assert_eq!(meant("unknown field `qqq`, expected `name`"), None);
        assert_eq!(meant("missing field `name`"), None);
    }
}
