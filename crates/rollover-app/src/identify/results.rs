//! What an identification came to.

use anyhow::Result;
use serde::Serialize;
use sysid::{Identification, IdentificationReport, Mode, Validation};

/// What the validation used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum JudgedOn {
    /// The recording that the model was made from.
    SameRecording,
    /// Recordings that it has not seen.
    Others(Vec<String>),
}

impl JudgedOn {
    /// In words, as the object of `on`.
    pub fn words(&self) -> String {
        match self {
            Self::SameRecording => "the recording it was made from".to_owned(),
            Self::Others(files) => files.join(", "),
        }
    }
}

/// The file `report.json`.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Report {
    /// Files that the model was made from.
    pub recordings: Vec<String>,
    /// How it was found, and how far it can be trusted.
    pub identification: IdentificationReport,
    /// What the validation used.
    pub validated_on: JudgedOn,
    /// Fits over the horizon and tests of the residuals.
    pub validation: Validation,
    /// Poles with their frequencies and dampings.
    pub poles: Vec<Mode>,
}

/// A model with all that is known about it.
pub(super) struct Results {
    pub identification: Identification,
    pub report: Report,
}

impl Results {
    pub fn new(
        recordings: Vec<String>,
        validated_on: JudgedOn,
        identification: Identification,
        validation: Validation,
    ) -> Result<Self> {
        let report = Report {
            recordings,
            identification: identification.report.clone(),
            validated_on,
            validation,
            poles: identification.model.modes()?,
        };
        Ok(Self {
            identification,
            report,
        })
    }
}
