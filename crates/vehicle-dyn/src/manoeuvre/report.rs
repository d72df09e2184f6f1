//! What a manoeuvre came to: plain data that can be written and shown.

use std::fmt;

use serde::Serialize;

/// Value of a figure of merit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number in the figure's unit.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// The run does not give this figure; [`Figure::note`] says why.
    Missing,
}

/// What a figure must be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// At most this number, in the figure's unit.
    AtMost(f64),
    /// At least this number, in the figure's unit.
    AtLeast(f64),
    /// This answer.
    Answer(bool),
}

/// What a figure must be, and who says so.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Requirement {
    /// The bound.
    pub bound: Bound,
    /// The standard and its clause, or whose rule it is.
    pub source: String,
}

/// One figure of merit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Name in the words of the standard.
    pub name: String,
    /// What was found.
    pub value: Value,
    /// Unit of the value; empty for pure numbers and answers.
    pub unit: String,
    /// What it must be, where the standard says so.
    pub requirement: Option<Requirement>,
    /// Whether it is that; `None` without a requirement or without a value.
    pub met: Option<bool>,
    /// Why there is no value, or how to read it.
    pub note: Option<String>,
}

impl Figure {
    /// A number with its unit. What is not finite counts as missing.
    #[must_use]
    pub fn number(name: &str, value: f64, unit: &str) -> Self {
        let found = Some(value).filter(|value| value.is_finite());
        Self::optional(name, found, unit, "the run gives no finite number")
    }

    /// A number that a run may not give; `why_missing` is the note in that case.
    #[must_use]
    pub fn optional(name: &str, value: Option<f64>, unit: &str, why_missing: &str) -> Self {
        Self {
            name: name.to_owned(),
            value: value.map_or(Value::Missing, Value::Number),
            unit: unit.to_owned(),
            requirement: None,
            met: None,
            note: value.is_none().then(|| why_missing.to_owned()),
        }
    }

    /// An answer.
    #[must_use]
    pub fn flag(name: &str, value: bool) -> Self {
        Self {
            value: Value::Flag(value),
            ..Self::optional(name, Some(0.0), "", "")
        }
    }

    /// The figure with a note on how to read it.
    #[must_use]
    pub fn noted(mut self, note: &str) -> Self {
        self.note.get_or_insert_with(|| note.to_owned());
        self
    }

    /// The figure judged by a bound that `source` sets.
    #[must_use]
    pub fn required(mut self, bound: Bound, source: &str) -> Self {
        self.met = match (self.value, bound) {
            (Value::Number(value), Bound::AtMost(limit)) => Some(value <= limit),
            (Value::Number(value), Bound::AtLeast(limit)) => Some(value >= limit),
            (Value::Flag(value), Bound::Answer(asked)) => Some(value == asked),
            _ => None,
        };
        self.requirement = Some(Requirement {
            bound,
            source: source.to_owned(),
        });
        self
    }

    /// The number, if there is one.
    #[must_use]
    pub fn as_number(&self) -> Option<f64> {
        match self.value {
            Value::Number(value) => Some(value),
            Value::Flag(_) | Value::Missing => None,
        }
    }

    /// The answer, if the figure is one.
    #[must_use]
    pub fn as_flag(&self) -> Option<bool> {
        match self.value {
            Value::Flag(value) => Some(value),
            Value::Number(_) | Value::Missing => None,
        }
    }
}

/// Figures of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    /// Name, unique within the manoeuvre, usable as a folder's name.
    pub name: String,
    /// How the run ended.
    pub ended: crate::metrics::Outcome,
    /// The figures.
    pub figures: Vec<Figure>,
}

impl RunReport {
    /// The figure `name`, if there is one.
    #[must_use]
    pub fn figure(&self, name: &str) -> Option<&Figure> {
        self.figures.iter().find(|figure| figure.name == name)
    }

    /// Whether every requirement is met: `Some(false)` when one is not, `None` when one cannot be
    /// judged or there is none.
    #[must_use]
    pub fn passed(&self) -> Option<bool> {
        judge(&self.figures)
    }
}

/// A curve over something else than time, such as the handwheel angle over lateral acceleration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// What it shows.
    pub name: String,
    /// Quantity and unit along x.
    pub x: String,
    /// Quantity and unit along y.
    pub y: String,
    /// Points `[x, y]`.
    pub points: Vec<[f64; 2]>,
}

/// The judgement on the whole manoeuvre.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether the rule holds; `None` when the manoeuvre only measures, or cannot be judged.
    pub passed: Option<bool>,
    /// The rule, in a sentence.
    pub rule: String,
}

/// Something that makes a manoeuvre other than what its standard asks for.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Warning {
    /// The steering is asked for more than the vehicle file allows; the handwheel saturates.
    SteeringDemand {
        /// Key of the vehicle file.
        field: &'static str,
        /// Largest demand of the manoeuvre.
        demanded: f64,
        /// What the vehicle file allows.
        allowed: f64,
        /// Unit of both.
        unit: &'static str,
        /// First run concerned.
        run: String,
    },
    /// The vehicle is outside the standard's scope.
    OutOfScope {
        /// What is outside, with the number found and the scope.
        what: String,
    },
    /// A part of the test could not be carried out.
    NotReached {
        /// What happened, with its number.
        what: String,
    },
}

/// What a manoeuvre came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ManoeuvreReport {
    /// Name of the manoeuvre.
    pub manoeuvre: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// The standard.
    pub standard: String,
    /// Friction of the ground (no unit).
    pub friction: f64,
    /// Figures of every run, in driving order.
    pub runs: Vec<RunReport>,
    /// Figures of the manoeuvre as a whole.
    pub figures: Vec<Figure>,
    /// Curves over something else than time.
    pub curves: Vec<Curve>,
    /// The judgement.
    pub verdict: Verdict,
    /// What made it other than what the standard asks for.
    pub warnings: Vec<Warning>,
}

impl ManoeuvreReport {
    /// The figure `name` of the whole manoeuvre, if there is one.
    #[must_use]
    pub fn figure(&self, name: &str) -> Option<&Figure> {
        self.figures.iter().find(|figure| figure.name == name)
    }

    /// The run `name`, if there is one.
    #[must_use]
    pub fn run(&self, name: &str) -> Option<&RunReport> {
        self.runs.iter().find(|run| run.name == name)
    }
}

/// Whether all requirements are met.
pub(super) fn judge(figures: &[Figure]) -> Option<bool> {
    let mut judged = figures
        .iter()
        .filter(|figure| figure.requirement.is_some())
        .map(|figure| figure.met)
        .peekable();
    judged.peek()?;
    all_of(judged)
}

/// `Some(false)` if one is false, else `None` if one is unknown, else `Some(true)`.
pub(super) fn all_of(mut judged: impl Iterator<Item = Option<bool>>) -> Option<bool> {
    judged
        .try_fold(Some(true), |all, one| match (all, one) {
            (_, Some(false)) => Err(Some(false)),
            (None, _) | (_, None) => Ok(None),
            (Some(_), Some(_)) => Ok(Some(true)),
        })
        .unwrap_or_else(|failed: Option<bool>| failed)
}

/// A number with four digits; nothing of a magnitude that people read becomes a power of ten.
fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if (0.001..1e6).contains(&size) {
        let decimals = if size >= 1000.0 {
            0
        } else if size >= 100.0 {
            1
        } else if size >= 10.0 {
            2
        } else {
            3
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.2e}")
    }
}

impl fmt::Display for Value {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => formatter.write_str(&short(*value)),
            Self::Flag(true) => formatter.write_str("yes"),
            Self::Flag(false) => formatter.write_str("no"),
            Self::Missing => formatter.write_str("–"),
        }
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(limit) => write!(formatter, "at most {}", short(*limit)),
            Self::AtLeast(limit) => write!(formatter, "at least {}", short(*limit)),
            Self::Answer(answer) => write!(formatter, "{}", Value::Flag(*answer)),
        }
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.name, self.value)?;
        if !self.unit.is_empty() && self.value != Value::Missing {
            write!(formatter, " {}", self.unit)?;
        }
        if let Some(requirement) = &self.requirement {
            let met = match self.met {
                Some(true) => "met",
                Some(false) => "NOT met",
                None => "not judged",
            };
            write!(formatter, " ({}: {met})", requirement.bound)?;
        }
        if let Some(note) = &self.note {
            write!(formatter, " – {note}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let passed = match self.passed {
            Some(true) => "passed",
            Some(false) => "failed",
            None => "no verdict",
        };
        write!(formatter, "{passed}; the rule: {}", self.rule)
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SteeringDemand {
                field,
                demanded,
                allowed,
                unit,
                run,
            } => write!(
                formatter,
                "the manoeuvre demands {} {unit} in run {run}, but the vehicle file allows {field} = {} {unit}: the handwheel saturates",
                short(*demanded),
                short(*allowed)
            ),
            Self::OutOfScope { what } | Self::NotReached { what } => formatter.write_str(what),
        }
    }
}

impl fmt::Display for ManoeuvreReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "{} with {} on friction {} ({})",
            self.manoeuvre, self.vehicle, self.friction, self.standard
        )?;
        writeln!(formatter, "{}", self.verdict)?;
        for figure in &self.figures {
            writeln!(formatter, "  {figure}")?;
        }
        for run in &self.runs {
            writeln!(formatter, "{} ({})", run.name, run.ended)?;
            for figure in &run.figures {
                writeln!(formatter, "  {figure}")?;
            }
        }
        for warning in &self.warnings {
            writeln!(formatter, "warning: {warning}")?;
        }
        Ok(())
    }
}
