//! A recording, and the models and predictors made from it.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, Result, bail};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use sysid::{Identification, IdentificationSettings, Progress, SysidError, identify_with};

use crate::interrupt::{Interrupt, Interrupted};
use crate::record::first_records;
use crate::scenario::DataMatrix;

/// Follows work that takes seconds and may stop it.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Stops it.
    pub interrupt: &'a Interrupt,
    /// Is told how far it is.
    pub progress: &'a dyn Fn(&Progress),
}

/// A recording, and what was made from it so far: controllers that need the same model or the same
/// predictor, on several threads too, share it.
pub struct Recorded<'a> {
    data: &'a Dataset,
    models: Memo<(Option<usize>, IdentificationSettings), Identification>,
    predictors: Memo<PredictorOf, Predictor>,
}

/// What a predictor is made of, beside the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PredictorOf {
    /// Records it is made from, the first ones; all if `None`.
    pub(super) records: Option<usize>,
    /// Length of the past window and horizon.
    pub(super) horizons: Horizons,
    /// Upper bound on the plant's order, for the excitation check.
    pub(super) order_bound: usize,
    /// Which matrix.
    pub(super) matrix: DataMatrix,
}

impl<'a> Recorded<'a> {
    /// A recording from which nothing was made yet.
    #[must_use]
    pub fn new(data: &'a Dataset) -> Self {
        Self {
            data,
            models: Memo::default(),
            predictors: Memo::default(),
        }
    }

    /// The recording.
    #[must_use]
    pub fn data(&self) -> &'a Dataset {
        self.data
    }

    /// The model that the first `records` records, or all of them, give with these settings.
    ///
    /// # Errors
    /// When the recording has fewer records, or does not give a model; the message says what to record.
    /// As [`Interrupted`] when the user stops it.
    pub fn identification(
        &self,
        records: Option<usize>,
        settings: &IdentificationSettings,
        watch: Watch<'_>,
    ) -> Result<Arc<Identification>> {
        self.models.get(&(records, settings.clone()), || {
            identify(&*first_records(self.data, records)?, settings, watch)
        })
    }

    /// The predictor that the recording gives.
    pub(super) fn predictor(&self, of: PredictorOf) -> Result<Arc<Predictor>> {
        self.predictors.get(&of, || {
            predictor(&*first_records(self.data, of.records)?, of)
        })
    }
}

/// What was made already, by what it was made of.
struct Memo<K, V>(Mutex<Vec<(K, Slot<V>)>>);

/// Held while its value is being made, so that whoever else wants it waits.
type Slot<V> = Arc<Mutex<Option<Arc<V>>>>;

impl<K, V> Default for Memo<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq + Clone, V> Memo<K, V> {
    fn get(&self, of: &K, make: impl FnOnce() -> Result<V>) -> Result<Arc<V>> {
        let slot = self.slot(of);
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = slot.as_ref() {
            return Ok(Arc::clone(made));
        }
        let made = Arc::new(make()?);
        *slot = Some(Arc::clone(&made));
        Ok(made)
    }

    fn slot(&self, of: &K) -> Slot<V> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, slot)) = all.iter().find(|(made_of, _)| made_of == of) {
            return Arc::clone(slot);
        }
        let slot = Slot::default();
        all.push((of.clone(), Arc::clone(&slot)));
        slot
    }
}

fn predictor(data: &Dataset, of: PredictorOf) -> Result<Predictor> {
    let hankel = HankelMatrix::build(data, of.horizons).context("the recording cannot be used")?;
    let exciting = hankel
        .require_persistently_exciting(of.order_bound)
        .context("the recording cannot be used")?;
    if let Some((name, value)) = exciting.report().and_then(|r| r.constant_outputs.first()) {
        bail!(
            "the recording cannot be used: output `{name}` is constant at {value}, so nothing can \
             be learnt about it; check its sensor and record again"
        );
    }
    Ok(match of.matrix {
        DataMatrix::Whole => Predictor::full(&exciting),
        DataMatrix::Reduced => Predictor::exact(&exciting)?,
    })
}

fn identify(
    data: &Dataset,
    settings: &IdentificationSettings,
    watch: Watch<'_>,
) -> Result<Identification> {
    let mut follow = |progress: &Progress| {
        (watch.progress)(progress);
        if watch.interrupt.is_raised() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    match identify_with(data, settings, &mut follow) {
        Err(SysidError::Interrupted { done, total }) => Err(Interrupted {
            after: format!("after step {done} of {total} of the identification"),
            kept: "no model was written".into(),
        }
        .into()),
        made => made.context("the recording cannot be used"),
    }
}
