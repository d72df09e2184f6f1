//! How much is measured, progress and interruption.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, bail};
use benches::case::{Activity, Case};
use indicatif::{ProgressBar, ProgressStyle};

use crate::condensed::{self, CaseResult};
use crate::rows::Row;

/// How much is measured.
#[derive(Debug, Clone, Copy)]
pub struct Extent {
    /// Condensed steps per back end, after the first.
    pub steps: usize,
    /// A back end stops early when its steps have taken this long.
    pub backend_s: f64,
    /// Set-ups of which the median is given.
    pub set_ups: usize,
    /// Consecutive steps as written, after the first.
    pub written_steps: usize,
    /// Time budget of one step as written.
    pub written_step_s: f64,
    /// Moments at which the full problem is solved for reference.
    pub references: usize,
    /// Steps per size of a sweep.
    pub sweep_steps: usize,
    pub bandwidth_bytes: &'static [usize],
    pub sweep_samples: &'static [usize],
    pub sweep_horizons: &'static [usize],
    pub sweep_channels: &'static [usize],
}

impl Extent {
    pub fn whole() -> Self {
        Self {
            steps: 3000,
            backend_s: 60.0,
            set_ups: 5,
            written_steps: 3,
            written_step_s: 60.0,
            references: 3,
            sweep_steps: 500,
            bandwidth_bytes: &[32 << 10, 256 << 10, 1_200_000, 4 << 20, 16 << 20, 256 << 20],
            sweep_samples: &[1000, 3200, 10_000, 32_000, 100_000, 1_000_000],
            sweep_horizons: &[25, 50, 100, 200],
            sweep_channels: &[1, 2, 4],
        }
    }

    pub fn quick() -> Self {
        Self {
            steps: 200,
            backend_s: 5.0,
            set_ups: 1,
            written_steps: 1,
            written_step_s: 20.0,
            references: 1,
            sweep_steps: 50,
            bandwidth_bytes: &[256 << 10, 1_200_000, 64 << 20],
            sweep_samples: &[1000, 3200, 10_000],
            sweep_horizons: &[25, 50, 100],
            sweep_channels: &[1, 2],
        }
    }
}

/// A run under way.
pub struct Run {
    extent: Extent,
    interrupted: Arc<AtomicBool>,
    progress: ProgressBar,
}

impl Run {
    pub fn start(extent: Extent) -> Result<Self> {
        let interrupted = Arc::new(AtomicBool::new(false));
        let raised = Arc::clone(&interrupted);
        ctrlc::set_handler(move || {
            // Whoever asks twice does not want to wait for the present step.
            if raised.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        })
        .context("cannot listen to Ctrl-C")?;
        let progress = ProgressBar::new_spinner();
        progress.set_style(ProgressStyle::with_template(
            "{elapsed_precise} {spinner} {msg}",
        )?);
        progress.enable_steady_tick(std::time::Duration::from_millis(500));
        Ok(Self {
            extent,
            interrupted,
            progress,
        })
    }

    pub fn extent(&self) -> &Extent {
        &self.extent
    }

    /// Says what is measured now.
    pub fn stage(&self, what: impl Into<String>) {
        let what = what.into();
        if self.progress.is_hidden() {
            eprintln!("{what}");
        }
        self.progress.set_message(what);
    }

    /// Ends the run between two steps if the user asked for it.
    pub fn check(&self) -> Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            bail!("interrupted; nothing was written");
        }
        Ok(())
    }

    pub fn finish(&self) {
        self.progress.finish_and_clear();
    }
}

/// All formulations and back ends on the size of the original study.
pub struct Comparison {
    pub cases: Vec<CaseResult>,
}

impl Comparison {
    pub fn rows(&self) -> Vec<Row> {
        self.cases
            .iter()
            .flat_map(|case| case.rows.iter().cloned())
            .collect()
    }
}

/// The cases, and whether they are also solved as written.
fn cases() -> [(Case, bool); 4] {
    [
        (Case::paper(Activity::Some, 0.0), true),
        (Case::paper(Activity::Some, 10.0), true),
        (Case::paper(Activity::None, 0.0), false),
        (Case::paper(Activity::NearlyAll, 0.0), false),
    ]
}

/// Measures the comparison, with the linear MPC of the crate `sysid` as one more formulation that
/// replays the same moments.
pub fn comparison(run: &Run) -> Result<Comparison> {
    let mut results = Vec::new();
    for (case, as_written) in cases() {
        results.push(condensed::measure(run, &case, as_written)?);
    }
    Ok(Comparison { cases: results })
}
