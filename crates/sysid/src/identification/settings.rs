//! What an expert may fix; the rest is found from the data.

use serde::{Deserialize, Serialize};

use crate::error::SysidError;
use crate::subspace::Weighting;

/// Which inputs (and measured disturbances, counted together) act within their own interval: D.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Feedthrough {
    /// None unless the data show it, input by input: a free D absorbs noise.
    Automatic,
    /// None.
    None,
    /// As given, one entry per input and measured disturbance.
    PerInput(Vec<bool>),
}

/// What the refined model is made to predict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FocusChoice {
    /// Whatever predicts held-out samples best.
    Automatic,
    /// The simulated output (output error); K is fitted afterwards.
    Simulation,
    /// One step ahead (innovation form).
    Prediction,
}

/// What is taken from the channels, so that the model is one of deviations.
///
/// Recommended: [`Found`](Self::Found). A plant that works about an operating point does not go through
/// the origin, and a record seldom begins at its mean; both are then no matter. The others are what
/// tools do that are given a recording as it is, or with its means removed: they are there for
/// comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OffsetChoice {
    /// The means of all channels, and a constant per output that is estimated with the model. Exact without
    /// noise.
    #[default]
    Found,
    /// The means of all channels over all records, nothing else. While transients last, the means are
    /// not the operating point, and the model is wrong by as much.
    Means,
    /// Nothing: the model goes through the origin, y = G u in the units of the recording. Right for a
    /// plant that does. Otherwise the gain of an input that stays away from 0 also explains what its
    /// mean seems to do, and standard errors do not tell; a warning does.
    None,
}

/// Settings of [`identify_with`](crate::identify_with). [`Default`] is what
/// [`identify`](crate::identify) does: everything is found from the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct IdentificationSettings {
    /// Model order n, at least 1; absent: the best on held-out samples.
    pub order: Option<usize>,
    /// Largest order tried where it is not fixed, at least 1.
    pub max_order: usize,
    /// Past and future horizons (block rows s) tried, each at least 2; absent: a ladder that covers
    /// half the slowest period of the outputs, as far as the recording is long enough.
    pub horizons: Option<Vec<usize>>,
    /// Weightings tried, at least one.
    pub weightings: Vec<Weighting>,
    /// Where D may differ from zero.
    pub feedthrough: Feedthrough,
    /// Names of inputs or measured disturbances whose effect is held at zero: those that the data do
    /// not identify.
    pub without_effect: Vec<String>,
    /// What is taken from the channels.
    pub offsets: OffsetChoice,
    /// What the refinement minimises.
    pub focus: FocusChoice,
    /// Whether the subspace model is refined by prediction error at all.
    pub refine: bool,
    /// The model's poles are held within this radius, above 0 and below 1.
    pub stability_radius: f64,
    /// Parts that the recording is cut into while order and focus are chosen, 2 to 10; each is held
    /// out once.
    pub folds: usize,
    /// Steps ahead of the predictions that K is made for and that, beside the simulation, judge a
    /// model, at least 1.
    pub steps_ahead: usize,
    /// Iterations of one refinement, at least 1.
    pub max_iterations: usize,
}

impl Default for IdentificationSettings {
    fn default() -> Self {
        Self {
            order: None,
            max_order: 10,
            horizons: None,
            weightings: vec![Weighting::Moesp, Weighting::Cva, Weighting::N4sid],
            feedthrough: Feedthrough::Automatic,
            without_effect: Vec::new(),
            offsets: OffsetChoice::Found,
            focus: FocusChoice::Automatic,
            refine: true,
            stability_radius: 0.99999,
            folds: 3,
            steps_ahead: 10,
            max_iterations: 60,
        }
    }
}

impl IdentificationSettings {
    /// With the order fixed.
    #[must_use]
    pub fn of_order(order: usize) -> Self {
        Self {
            order: Some(order),
            ..Self::default()
        }
    }

    /// Checks every field against its range, for channels of these names.
    ///
    /// # Errors
    /// Names the first field out of range.
    pub fn check(&self, input_names: &[String]) -> Result<(), SysidError> {
        let wrong = |field, found: String, allowed: String| {
            Err(SysidError::Setting {
                field,
                found,
                allowed,
            })
        };
        for (field, found) in [
            ("order", self.order.unwrap_or(1)),
            ("max_order", self.max_order),
            ("steps_ahead", self.steps_ahead),
            ("max_iterations", self.max_iterations),
        ] {
            if found == 0 {
                return wrong(field, found.to_string(), "at least 1".into());
            }
        }
        if let Some(horizons) = &self.horizons {
            if horizons.is_empty() {
                return wrong("horizons", "empty".into(), "at least one".into());
            }
            if let Some(found) = horizons.iter().find(|&&s| s < 2) {
                return wrong("horizons", found.to_string(), "at least 2 each".into());
            }
        }
        if self.weightings.is_empty() {
            return wrong("weightings", "empty".into(), "at least one".into());
        }
        if let Feedthrough::PerInput(flags) = &self.feedthrough
            && flags.len() != input_names.len()
        {
            return wrong(
                "feedthrough",
                format!("{} entries", flags.len()),
                format!(
                    "{}, one per input and measured disturbance",
                    input_names.len()
                ),
            );
        }
        for name in &self.without_effect {
            if !input_names.contains(name) {
                return wrong(
                    "without_effect",
                    format!("`{name}`"),
                    format!("one of the inputs {}", quoted(input_names)),
                );
            }
        }
        if !(self.stability_radius > 0.0 && self.stability_radius < 1.0) {
            return wrong(
                "stability_radius",
                self.stability_radius.to_string(),
                "above 0 and below 1".into(),
            );
        }
        if !(2..=10).contains(&self.folds) {
            return wrong("folds", self.folds.to_string(), "from 2 to 10".into());
        }
        Ok(())
    }
}

fn quoted(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    names.join(", ")
}
