//! What an expert chooses.

use deepc_core::hankel::FactorMethod;
use serde::{Deserialize, Serialize};

use super::projection::Weighting;
use crate::error::SysidError;

/// How B and D are found once A and C are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum InputMatrices {
    /// From the triangular factor, with the states of the subspace method (Van Overschee and De
    /// Moor 1996, robust algorithm of chapter 4). Needs no further pass over the data; poor where the inputs are
    /// strongly coloured.
    Subspace,
    /// By least squares on the simulated output, with the initial states (Verhaegen and Varga 1994).
    /// Usually the better choice; the model must be stable, or its response stay finite over a record.
    Simulation,
}

/// What is taken from the channels before anything else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Offsets {
    /// The means over all records. A record that begins far from its operating point makes them a
    /// little wrong, and the model with them.
    Means,
    /// Known operating points, in the units of the channels: inputs, then measured disturbances
    /// (M values), and outputs (p values).
    Given {
        /// M values.
        inputs: Vec<f64>,
        /// p values.
        outputs: Vec<f64>,
    },
    /// Means, corrected: a row of ones is projected out with the inputs, so that A, B, C, D do not
    /// depend on any constant, and the outputs' offsets follow from the simulated output. Exact
    /// without noise. (An unstable model keeps the means: its simulated output says nothing.)
    Free,
}

/// What an output is divided by while the subspace is sought. The canonical variate weighting
/// does not see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputScaling {
    /// Its own standard deviation: all outputs count the same.
    EachItsOwn,
    /// The same number for all: outputs with larger numbers count more, as in tools that do not
    /// scale.
    Common,
}

/// What happens when A comes out unstable, as it may with noise or a short recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnstablePoles {
    /// The model is refused with its spectral radius.
    Refuse,
    /// Poles outside `radius` are mirrored into it; B, D and the noise follow from the stable A.
    MoveInside {
        /// Above 0 and below 1.
        radius: f64,
    },
    /// The model is returned as it is; [`SubspaceModel::radius`](super::SubspaceModel::radius) tells.
    Keep,
}

/// Settings of [`subspace_model`](super::subspace_model).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubspaceSettings {
    /// Past horizon in samples, from 1. About as long as an input or a disturbance is felt.
    pub past: usize,
    /// Future horizon f in samples, from 2. It should cover half the slowest period.
    pub future: usize,
    /// Order n of the model, from 1 to p(f − 1).
    pub order: usize,
    /// Weights of the projection.
    pub weighting: Weighting,
    /// Where B and D come from.
    pub input_matrices: InputMatrices,
    /// How the triangular factor is computed; the fast way falls back to QR by itself.
    pub factor: FactorMethod,
    /// Operating point.
    pub offsets: Offsets,
    /// Scales of the outputs.
    pub output_scaling: OutputScaling,
    /// What happens to poles outside the unit circle.
    pub unstable_poles: UnstablePoles,
}

impl SubspaceSettings {
    /// MOESP with equal horizons, B and D from the simulated output, and offsets that are found with
    /// them.
    #[must_use]
    pub fn new(block_rows: usize, order: usize) -> Self {
        Self {
            past: block_rows,
            future: block_rows,
            order,
            weighting: Weighting::Moesp,
            input_matrices: InputMatrices::Simulation,
            factor: FactorMethod::Gram,
            offsets: Offsets::Free,
            output_scaling: OutputScaling::EachItsOwn,
            unstable_poles: UnstablePoles::Refuse,
        }
    }

    /// What SLICOT's IB01AD with METH = M and IB01BD with METH = C compute: MOESP for A and C with
    /// `block_rows` samples of past and of future, the N4SID equations for B, D and the noise.
    #[must_use]
    pub fn slicot(block_rows: usize, order: usize) -> Self {
        Self {
            past: block_rows,
            future: block_rows,
            order,
            weighting: Weighting::Moesp,
            input_matrices: InputMatrices::Subspace,
            factor: FactorMethod::BlockQr,
            offsets: Offsets::Means,
            output_scaling: OutputScaling::Common,
            unstable_poles: UnstablePoles::Refuse,
        }
    }

    /// Checks the offsets for `inputs` (M) and `outputs` (p) channels.
    pub(super) fn check(&self, inputs: usize, outputs: usize) -> Result<(), SysidError> {
        if let UnstablePoles::MoveInside { radius } = self.unstable_poles
            && !(radius > 0.0 && radius < 1.0)
        {
            return Err(SysidError::Setting {
                field: "unstable_poles.move_inside.radius",
                found: radius.to_string(),
                allowed: "give a value above 0 and below 1".into(),
            });
        }
        if let Offsets::Given {
            inputs: u,
            outputs: y,
        } = &self.offsets
        {
            for (field, values, count) in [
                ("offsets.inputs", u, inputs),
                ("offsets.outputs", y, outputs),
            ] {
                if values.len() != count || values.iter().any(|value| !value.is_finite()) {
                    return Err(SysidError::Setting {
                        field,
                        found: format!("{values:?}"),
                        allowed: format!("give {count} finite values"),
                    });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_survive_a_file_and_unknown_fields_do_not() {
        let mut settings = SubspaceSettings::slicot(20, 4);
        settings.offsets = Offsets::Given {
            inputs: vec![0.0, 80.0],
            outputs: vec![1.5],
        };
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(
            serde_json::from_str::<SubspaceSettings>(&text).unwrap(),
            settings
        );
        let text = text.replace("\"past\"", "\"pats\"");
        let error = serde_json::from_str::<SubspaceSettings>(&text).unwrap_err();
        assert!(error.to_string().contains("pats"), "{error}");
    }
}
