//! Ctrl-C, seen by long work between two steps.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use thiserror::Error;

/// Set once the user has asked the program to stop.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// An interrupt raised by Ctrl-C (SIGINT) and by SIGTERM.
    ///
    /// # Errors
    /// When the process has such a handler already.
    pub fn on_signals() -> Result<Self, ctrlc::Error> {
        let interrupt = Self::default();
        let raised = interrupt.clone();
        ctrlc::set_handler(move || raised.raise())?;
        Ok(interrupt)
    }

    /// Asks running work to stop after its current step.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether work should stop.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Work stopped because the user asked for it.
#[derive(Debug, Error)]
#[error("interrupted {after}; {kept}")]
pub struct Interrupted {
    /// How far the work had come.
    pub after: String,
    /// What is on disk now.
    pub kept: String,
}
