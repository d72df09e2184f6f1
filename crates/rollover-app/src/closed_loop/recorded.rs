//! A recording, and the models identified from it.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, Result};
use deepc_core::data::Dataset;
use sysid::{Identification, IdentificationSettings, Progress, SysidError, identify_with};

use crate::interrupt::{Interrupt, Interrupted};
use crate::record::first_records;

/// Follows work that takes seconds and may stop it.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Stops it.
    pub interrupt: &'a Interrupt,
    /// Is told how far it is.
    pub progress: &'a dyn Fn(&Progress),
}

/// A recording, and the models identified from it so far: controllers with the same settings of the
/// identification and the same number of records, on several threads too, share one model.
pub struct Recorded<'a> {
    data: &'a Dataset,
    models: Mutex<Vec<(Origin, Slot)>>,
}

/// What a model was made from: number of records, `None` for all, and settings.
type Origin = (Option<usize>, IdentificationSettings);

/// Held while its model is being made, so that whoever else wants it waits.
type Slot = Arc<Mutex<Option<Arc<Identification>>>>;

impl<'a> Recorded<'a> {
    /// A recording without any model yet.
    #[must_use]
    pub fn new(data: &'a Dataset) -> Self {
        Self {
            data,
            models: Mutex::default(),
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
    /// When the recording has fewer records. When the recording does not give one; the message says what to record. As [`Interrupted`] when
    /// the user stops it.
    pub fn identification(
        &self,
        records: Option<usize>,
        settings: &IdentificationSettings,
        watch: Watch<'_>,
    ) -> Result<Arc<Identification>> {
        let slot = self.slot(&(records, settings.clone()));
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = slot.as_ref() {
            return Ok(Arc::clone(made));
        }
        let data = first_records(self.data, records)?;
        let made = Arc::new(identify(&data, settings, watch)?);
        *slot = Some(Arc::clone(&made));
        Ok(made)
    }

    fn slot(&self, origin: &Origin) -> Slot {
        let mut models = self.models.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, slot)) = models.iter().find(|(of, _)| of == origin) {
            return Arc::clone(slot);
        }
        let slot = Slot::default();
        models.push((origin.clone(), Arc::clone(&slot)));
        slot
    }
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
