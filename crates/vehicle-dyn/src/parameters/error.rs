//! What can be wrong with a vehicle file.

/// A vehicle file that cannot be used; the message says where and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// The file cannot be read.
    #[error(
        "cannot read vehicle file {origin}: {reason}. Give a readable file or one of the embedded names ({embedded})"
    )]
    Unreadable {
        /// Path as given.
        origin: String,
        /// Operating system's reason.
        reason: String,
        /// Names of the embedded vehicles.
        embedded: String,
    },
    /// A key that no vehicle has, often one without its unit.
    #[error(
        "unknown key `{key}` at line {line}, column {column} of {origin}: {suggestion}every key carries its unit"
    )]
    UnknownKey {
        /// The key as written.
        key: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the file.
        origin: String,
        /// Empty, or ``did you mean `…`? ``.
        suggestion: String,
    },
    /// A required key is absent.
    #[error(
        "missing key `{key}` in {table} at line {line} of {origin}: add it with its value (see vehicles/README.md)"
    )]
    MissingKey {
        /// The absent key.
        key: String,
        /// Table that lacks it, such as `[mass]`.
        table: String,
        /// Line where the table begins, from 1.
        line: usize,
        /// Name of the file.
        origin: String,
    },
    /// Not TOML, a key given twice, or a value of the wrong type.
    #[error(
        "{message} at line {line}, column {column} of {origin}: `{excerpt}`. Correct this line"
    )]
    Syntax {
        /// What the TOML reader says.
        message: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Name of the file.
        origin: String,
        /// The offending line.
        excerpt: String,
    },
    /// The vehicle has no name.
    #[error("name is empty in {origin}: give a short one, as it stands in logs and tables")]
    NoName {
        /// Name of the file.
        origin: String,
    },
    /// The name cannot stand in the name of a folder, where results go.
    #[error(
        "name = `{name}` in {origin}: must not begin with `.` nor hold `/`, `\\` or control characters"
    )]
    BadName {
        /// Name found.
        name: String,
        /// Name of the file.
        origin: String,
    },
    /// A value outside its allowed range.
    #[error("{field} = {value} in {origin}: must be in {range}")]
    OutOfRange {
        /// Table and key, such as `mass.sprung_mass_kg`.
        field: String,
        /// Value found.
        value: f64,
        /// Allowed interval with its unit, such as `(0, 1e5] kg`.
        range: String,
        /// Name of the file.
        origin: String,
    },
    /// Values that are allowed one by one but contradict each other.
    #[error("{fields} in {origin}: {reason}")]
    Contradiction {
        /// The fields concerned, with their values.
        fields: String,
        /// What must hold.
        reason: String,
        /// Name of the file.
        origin: String,
    },
}
