//! A controller as it stands in a scenario file: flat, with a `method` that says which fields apply.

use std::fmt;

use deepc_core::program::Regularisation;
use serde::Deserialize;
use sysid::IdentificationSettings;
use sysid::lmpc::OffsetHandling;
use thiserror::Error;

use super::controllers::{
    ControllerSettings, DataMatrix, DataSettings, LtrPenalty, ModelSettings, Prediction,
};
use crate::summary::InputWeights;

/// The fields of every method. Which must be there and which must not, `method` decides.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControllerEntry {
    description: String,
    method: Method,
    past_steps: usize,
    horizon_steps: usize,
    moves_per_solve: usize,
    ltr_limit: f64,
    ltr_penalty: LtrPenalty,
    input_weights: InputWeights,
    order_bound: Option<usize>,
    regularisation: Option<Regularisation>,
    lambda_u: Option<f64>,
    lambda_y: Option<f64>,
    identification: Option<IdentificationSettings>,
    offset_handling: Option<OffsetHandling>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Method {
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
pub(super) enum FieldError {
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

impl TryFrom<ControllerEntry> for ControllerSettings {
    type Error = FieldError;

    fn try_from(entry: ControllerEntry) -> Result<Self, FieldError> {
        let prediction = match entry.method {
            Method::Deepc => Prediction::Data(entry.data(DataMatrix::Whole)?),
            Method::RdDeepc => Prediction::Data(entry.data(DataMatrix::Reduced)?),
            Method::Lmpc => Prediction::Model(entry.model()?),
        };
        Ok(Self {
            description: entry.description,
            past_steps: entry.past_steps,
            horizon_steps: entry.horizon_steps,
            moves_per_solve: entry.moves_per_solve,
            ltr_limit: entry.ltr_limit,
            ltr_penalty: entry.ltr_penalty,
            input_weights: entry.input_weights,
            prediction,
        })
    }
}

impl ControllerEntry {
    fn data(&self, matrix: DataMatrix) -> Result<DataSettings, FieldError> {
        let method = self.method;
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

    fn model(&self) -> Result<ModelSettings, FieldError> {
        let method = self.method;
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
