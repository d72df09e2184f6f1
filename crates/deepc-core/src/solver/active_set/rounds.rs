//! Many rows at a time: the fast way to the optimal working set, without a guarantee.
//!
//! A round solves for the multipliers of the working set, lets every row go whose multiplier has
//! the wrong sign or size (Hintermüller, Ito and Kunisch, SIAM J. Optim. 13, 2003), looks at all
//! rows, and adds the violated ones, several at once: but no two that are nearly the same row,
//! because neighbouring samples of a smooth signal are, and holding one holds the other. The
//! dual cost must fall from round to round; where it does not, the descent takes over.

use super::super::QpStatus;
use super::clock::Clock;
use super::dual::{Dual, Insertion};

/// Rounds of adding rows.
const MAX_ROUNDS: u32 = 40;

/// Solves between two rounds.
const MAX_CORRECTIONS: u32 = 10;

/// Cosine of the angle below which two rows are not joined in one round.
const MAX_COUPLING: f64 = 0.7;

/// Whether rounds ended in the optimum; if not, the descent goes on from `Dual::best`.
pub(in crate::solver) fn rounds(dual: &mut Dual, clock: &mut Clock) -> Result<bool, QpStatus> {
    for _ in 0..MAX_ROUNDS {
        if !settle(dual, clock)? {
            return Ok(false);
        }
        dual.evaluate();
        let objective = dual.objective();
        let falls = objective < dual.best.objective;
        if !falls || !dual.pending.is_empty() {
            return Ok(false);
        }
        dual.measure_excess();
        let Some(worst) = dual.worst() else {
            return Ok(true);
        };
        dual.save(objective);
        if !add_weakly_coupled(dual, worst) {
            return Ok(false);
        }
    }
    Ok(false)
}

/// Solves for the multipliers and corrects the states until they agree; whether they do.
fn settle(dual: &mut Dual, clock: &mut Clock) -> Result<bool, QpStatus> {
    for _ in 0..MAX_CORRECTIONS {
        clock.tick()?;
        dual.solve_factored();
        let mut agrees = true;
        // From behind: a row that leaves late in the factor leaves cheaply.
        for index in (0..dual.factored.len()).rev() {
            let i = dual.factored[index];
            let (low, high) = dual.rows[i].interval(dual.states[i]);
            let wanted = dual.solution[index];
            if wanted < low || wanted > high {
                agrees = false;
                dual.take_out(index);
                dual.pass(i, if wanted < low { low } else { high });
            } else {
                dual.multipliers[i] = wanted;
            }
        }
        while let Some(i) = dual.pending.pop() {
            if dual.insert(i) == Insertion::Dependent {
                dual.pending.push(i);
                return Ok(false);
            }
        }
        if agrees {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Adds the worst row, then the worst of those not close to it, and so on; whether any could be.
fn add_weakly_coupled(dual: &mut Dual, worst: usize) -> bool {
    let mut added = false;
    let mut next = Some(worst);
    while let Some(i) = next {
        let before = dual.states[i];
        dual.begin(i);
        if dual.insert(i) == Insertion::Done {
            added = true;
        } else {
            dual.revert(i, before);
        }
        let couplings = dual.constant.gram.column(i);
        for (excess, coupling) in dual.excess.iter_mut().zip(couplings) {
            let coupled = coupling.abs() >= MAX_COUPLING;
            *excess = if coupled { 0.0 } else { *excess };
        }
        dual.excess[i] = 0.0;
        next = dual.worst();
    }
    added
}
