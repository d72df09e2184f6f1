//! A controller as it stands in a scenario file: flat, with a `method` that says which fields apply.

use std::collections::BTreeMap;
use std::fmt;

use deepc_core::program::Regularisation;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use sysid::IdentificationSettings;
use sysid::lmpc::OffsetHandling;
use thiserror::Error;

use super::controllers::{
    ControllerSettings, DataMatrix, DataSettings, LtrPenalty, ModelSettings, Prediction,
    ReferenceAhead,
};
use crate::summary::InputWeights;

/// The fields of every method. Which must be there and which must not, `method` decides.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ControllerEntry {
    /// Another controller of the file: fields that are not given are taken from it.
    like: Option<String>,
    description: Option<String>,
    method: Option<Method>,
    past_steps: Option<usize>,
    horizon_steps: Option<usize>,
    moves_per_solve: Option<usize>,
    ltr_limit: Option<f64>,
    ltr_penalty: Option<LtrPenalty>,
    input_weights: Option<InputWeights>,
    reference: Option<ReferenceAhead>,
    records: Option<usize>,
    order_bound: Option<usize>,
    regularisation: Option<Regularisation>,
    lambda_u: Option<f64>,
    lambda_y: Option<f64>,
    identification: Option<IdentificationSettings>,
    offset_handling: Option<OffsetHandling>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Method {
    Deepc,
    RdDeepc,
    Lmpc,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Deepc => "deepc",
            Self::RdDeepc => "rd-deepc",
            Self::Lmpc => "lmpc",
        })
    }
}

/// A field that does not go with the method.
#[derive(Debug, Error)]
enum FieldError {
    #[error("missing field `{field}`")]
    Absent { field: &'static str },
    #[error("`like` = \"{like}\" names no controller of this file: choose one of {known}")]
    UnknownLike { like: String, known: String },
    #[error("`like` leads back to itself: {chain}")]
    Circle { chain: String },
    #[error("missing field `{field}`, which method = \"{method}\" needs")]
    Missing { field: &'static str, method: Method },
    #[error("field `{field}` does not apply to method = \"{method}\", {why}: remove it")]
    Foreign {
        field: &'static str,
        method: Method,
        why: &'static str,
    },
}

impl Method {
    fn needs<T>(self, field: &'static str, value: Option<T>) -> Result<T, FieldError> {
        value.ok_or(FieldError::Missing {
            field,
            method: self,
        })
    }

    fn has_no<T>(self, field: &'static str, value: Option<&T>) -> Result<(), FieldError> {
        let why = match self {
            Self::Deepc | Self::RdDeepc => "which predicts by the recording and has no model",
            Self::Lmpc => "which predicts by a model and has neither g nor slacks",
        };
        match value {
            None => Ok(()),
            Some(_) => Err(FieldError::Foreign {
                field,
                method: self,
                why,
            }),
        }
    }
}

/// The `[controllers]` table, with what `like` takes over filled in.
pub(super) fn controllers<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, ControllerSettings>, D::Error> {
    let entries = BTreeMap::<String, ControllerEntry>::deserialize(deserializer)?;
    // What others are like comes first: a mistake in it is told of where it was made.
    let (like, own): (Vec<_>, Vec<_>) = entries.keys().partition(|&n| entries[n].like.is_some());
    own.into_iter()
        .chain(like)
        .map(|name| {
            let settings = resolved(name, &entries).and_then(ControllerSettings::try_from);
            let wrong = |error| D::Error::custom(format!("in controllers.{name}: {error}"));
            Ok((name.clone(), settings.map_err(wrong)?))
        })
        .collect()
}

/// The entry `name` with the fields it does not give from those it is like.
fn resolved(
    name: &str,
    entries: &BTreeMap<String, ControllerEntry>,
) -> Result<ControllerEntry, FieldError> {
    let mut chain = vec![name];
    let mut entry = entries[name].clone();
    while let Some(like) = entry.like.take() {
        let Some((base_name, base)) = entries.get_key_value(&like) else {
            let known: Vec<&str> = entries.keys().map(String::as_str).collect();
            return Err(FieldError::UnknownLike {
                like,
                known: known.join(", "),
            });
        };
        chain.push(base_name);
        if chain[..chain.len() - 1].contains(&base_name.as_str()) {
            return Err(FieldError::Circle {
                chain: chain.join(" → "),
            });
        }
        entry = entry.or(base);
    }
    Ok(entry)
}

impl TryFrom<ControllerEntry> for ControllerSettings {
    type Error = FieldError;

    fn try_from(entry: ControllerEntry) -> Result<Self, FieldError> {
        let method = given("method", entry.method)?;
        let prediction = match method {
            Method::Deepc => Prediction::Data(entry.data(method, DataMatrix::Whole)?),
            Method::RdDeepc => Prediction::Data(entry.data(method, DataMatrix::Reduced)?),
            Method::Lmpc => Prediction::Model(entry.model(method)?),
        };
        Ok(Self {
            description: given("description", entry.description)?,
            past_steps: given("past_steps", entry.past_steps)?,
            horizon_steps: given("horizon_steps", entry.horizon_steps)?,
            moves_per_solve: given("moves_per_solve", entry.moves_per_solve)?,
            ltr_limit: given("ltr_limit", entry.ltr_limit)?,
            ltr_penalty: given("ltr_penalty", entry.ltr_penalty)?,
            input_weights: given("input_weights", entry.input_weights)?,
            reference: entry.reference.unwrap_or_default(),
            records: entry.records,
            prediction,
        })
    }
}

fn given<T>(field: &'static str, value: Option<T>) -> Result<T, FieldError> {
    value.ok_or(FieldError::Absent { field })
}

impl ControllerEntry {
    /// Fields that are not given, from `base`; what `base` is like is followed next.
    fn or(self, base: &Self) -> Self {
        let base = base.clone();
        Self {
            like: base.like,
            description: self.description.or(base.description),
            method: self.method.or(base.method),
            past_steps: self.past_steps.or(base.past_steps),
            horizon_steps: self.horizon_steps.or(base.horizon_steps),
            moves_per_solve: self.moves_per_solve.or(base.moves_per_solve),
            ltr_limit: self.ltr_limit.or(base.ltr_limit),
            ltr_penalty: self.ltr_penalty.or(base.ltr_penalty),
            input_weights: self.input_weights.or(base.input_weights),
            reference: self.reference.or(base.reference),
            records: self.records.or(base.records),
            order_bound: self.order_bound.or(base.order_bound),
            regularisation: self.regularisation.or(base.regularisation),
            lambda_u: self.lambda_u.or(base.lambda_u),
            lambda_y: self.lambda_y.or(base.lambda_y),
            identification: self.identification.or(base.identification),
            offset_handling: self.offset_handling.or(base.offset_handling),
        }
    }

    fn data(&self, method: Method, matrix: DataMatrix) -> Result<DataSettings, FieldError> {
        method.has_no("identification", self.identification.as_ref())?;
        method.has_no("offset_handling", self.offset_handling.as_ref())?;
        Ok(DataSettings {
            matrix,
            order_bound: method.needs("order_bound", self.order_bound)?,
            regularisation: method.needs("regularisation", self.regularisation)?,
            lambda_u: method.needs("lambda_u", self.lambda_u)?,
            lambda_y: method.needs("lambda_y", self.lambda_y)?,
        })
    }

    fn model(&self, method: Method) -> Result<ModelSettings, FieldError> {
        method.has_no("order_bound", self.order_bound.as_ref())?;
        method.has_no("regularisation", self.regularisation.as_ref())?;
        method.has_no("lambda_u", self.lambda_u.as_ref())?;
        method.has_no("lambda_y", self.lambda_y.as_ref())?;
        Ok(ModelSettings {
            identification: self.identification.clone().unwrap_or_default(),
            offset_handling: self.offset_handling.unwrap_or_default(),
        })
    }
}
