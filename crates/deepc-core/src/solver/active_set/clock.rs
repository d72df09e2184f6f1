//! The budget of one solve.

use std::time::Instant;

use super::super::{QpStatus, SolveBudget};

/// Counts iterations and watches the time.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Clock {
    start: Instant,
    budget: SolveBudget,
    pub iterations: u32,
}

impl Clock {
    pub fn start(budget: &SolveBudget) -> Self {
        Self {
            start: Instant::now(),
            budget: *budget,
            iterations: 0,
        }
    }

    /// Begins an iteration, or ends the solve with the limit that is spent.
    pub fn tick(&mut self) -> Result<(), QpStatus> {
        if self.iterations >= self.budget.max_iterations {
            return Err(QpStatus::IterationLimit);
        }
        // An infinite budget need not ask the time.
        let limit = self.budget.max_time_s;
        if !(limit.is_infinite() || self.start.elapsed().as_secs_f64() < limit) {
            return Err(QpStatus::TimeLimit);
        }
        self.iterations += 1;
        Ok(())
    }

    pub fn elapsed(&self) -> std::time::Duration {
        self.start.elapsed()
    }

    /// The same clock with no more than `iterations` ahead.
    pub fn limited(&self, iterations: u32) -> Self {
        let limit = self.iterations.saturating_add(iterations);
        let mut limited = *self;
        limited.budget.max_iterations = self.budget.max_iterations.min(limit);
        limited
    }

    /// Iterations that remain.
    pub fn remaining(&self) -> u32 {
        self.budget.max_iterations.saturating_sub(self.iterations)
    }
}
