//! Ctrl-C, seen by long work between two steps.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use thiserror::Error;

/// Exit status of a program that could not do its work. A wrong command line has clap's 2.
pub const FAILED_STATUS: i32 = 1;

/// Exit status of a program stopped by Ctrl-C, as shells report it.
pub const INTERRUPTED_STATUS: i32 = 130;

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
        ctrlc::set_handler(move || {
            // Whoever asks twice does not want to wait for the current step.
            if raised.is_raised() {
                std::process::exit(INTERRUPTED_STATUS);
            }
            raised.raise();
        })?;
        Ok(interrupt)
    }

    /// Asks running work to stop after its current step.
    pub fn raise(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Stops work that should stop, between two pieces of it.
    ///
    /// # Errors
    /// [`Interrupted`] when the user has asked for it.
    pub fn check(&self, after: &str, kept: &str) -> Result<(), Interrupted> {
        if self.is_raised() {
            return Err(Interrupted {
                after: after.to_owned(),
                kept: kept.to_owned(),
            });
        }
        Ok(())
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
