//! A recording, and the models identified from it.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use anyhow::{Context, Result};
use deepc_core::data::Dataset;
use sysid::{Identification, IdentificationSettings, Progress, SysidError, identify_with};

use crate::interrupt::{Interrupt, Interrupted};

/// Follows work that takes seconds and may stop it.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Stops it.
    pub interrupt: &'a Interrupt,
    /// Is told how far it is.
    pub progress: &'a dyn Fn(&Progress),
}

/// A recording, and the models identified from it so far: controllers with the same settings of the
/// identification, on several threads too, share one model.
pub struct Recorded<'a> {
    data: &'a Dataset,
    models: Mutex<Vec<(IdentificationSettings, Slot)>>,
}

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

    /// The model that the recording gives with these settings.
    ///
    /// # Errors
    /// When the recording does not give one; the message says what to record. As [`Interrupted`] when
    /// the user stops it.
    pub fn identification(
        &self,
        settings: &IdentificationSettings,
        watch: Watch<'_>,
    ) -> Result<Arc<Identification>> {
        let slot = self.slot(settings);
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(made) = slot.as_ref() {
            return Ok(Arc::clone(made));
        }
        let made = Arc::new(identify(self.data, settings, watch)?);
        *slot = Some(Arc::clone(&made));
        Ok(made)
    }

    fn slot(&self, settings: &IdentificationSettings) -> Slot {
        let mut models = self.models.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, slot)) = models.iter().find(|(of, _)| of == settings) {
            return Arc::clone(slot);
        }
        let slot = Slot::default();
        models.push((settings.clone(), Arc::clone(&slot)));
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
