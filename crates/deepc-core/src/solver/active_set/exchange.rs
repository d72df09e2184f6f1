//! Rows that push wrongly out, rows that are violated in, at once: the fastest way to the optimal
//! working set, and the one without a guarantee.
//!
//! An exchange solves for the multipliers of the working set, takes them whatever their signs, and
//! looks at all rows (block principal pivoting, Júdice and Pires, Comput. Oper. Res. 21, 1994). In
//! control an arc of neighbouring samples stands at a bound and moves by some samples from step to
//! step. To let all rows of a wrong sign go before looking at the others would take the arc apart:
//! its multipliers have the wrong sign only because its new end is missing. For the same reason
//! rows come and go the worst first, and none beside one that is nearly the same: holding or
//! freeing one corrects its neighbours.
//!
//! The number of contradictions must fall within a few exchanges; where it does not, `rounds` take
//! over.

use super::super::QpStatus;
use super::clock::Clock;
use super::dual::{Dual, Insertion};
use crate::columns::{Columns, position_of_largest};

/// Solves, at most.
const MAX_EXCHANGES: u32 = 30;

/// Exchanges without fewer contradictions than ever before.
const PATIENCE: u32 = 4;

/// Cosine of the angle below which two rows do not join or leave at once.
const MAX_COUPLING: f64 = 0.7;

/// Whether exchanges ended in the optimum. If not, the working set is the last one, with
/// multipliers that it allows.
pub(super) fn exchange(dual: &mut Dual, clock: &mut Clock) -> Result<bool, QpStatus> {
    let ended = exchange_while_it_helps(dual, clock);
    if ended != Ok(true) {
        dual.suspend();
        for &i in &dual.factored {
            let (low, high) = dual.rows[i].interval(dual.states[i]);
            dual.multipliers[i] = dual.multipliers[i].max(low).min(high);
        }
    }
    ended
}

fn exchange_while_it_helps(dual: &mut Dual, clock: &mut Clock) -> Result<bool, QpStatus> {
    let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
    for _ in 0..MAX_EXCHANGES {
        clock.tick()?;
        dual.solve_factored();
        let wrong = take_solution(dual);
        dual.compute_values();
        dual.measure_excess();
        let violated = dual.excess.iter().filter(|excess| **excess > 0.0).count();
        let contradictions = wrong + violated;
        if contradictions == 0 {
            dual.refine();
            dual.measure_excess();
            return Ok(dual.pending.is_empty() && dual.worst().is_none());
        }
        if contradictions < fewest {
            (fewest, patience) = (contradictions, PATIENCE);
        } else {
            patience -= 1;
            if patience == 0 {
                return Ok(false);
            }
        }
        if wrong > 0 && !let_go(dual) {
            return Ok(false);
        }
        if violated > 0 {
            join(dual);
        }
    }
    Ok(false)
}

/// Takes the multipliers as they come, and how far each is from what its state allows into
/// `discord`; how many are.
fn take_solution(dual: &mut Dual) -> usize {
    dual.discord.fill(0.0);
    let mut wrong = 0;
    for (&i, &wanted) in dual.factored.iter().zip(&dual.solution) {
        let (low, high) = dual.rows[i].interval(dual.states[i]);
        dual.multipliers[i] = wanted;
        if wanted < low || wanted > high {
            dual.discord[i] = (low - wanted).max(wanted - high);
            wrong += 1;
        }
    }
    wrong
}

/// Lets the worst of the wrong rows leave their state; whether those that have another one fit the
/// factor in it.
fn let_go(dual: &mut Dual) -> bool {
    dual.leaving.clear();
    while let Some(i) = position_of_largest(&dual.discord) {
        dual.leaving.push(i);
        silence(&mut dual.discord, &dual.constant.gram, i);
    }
    // From behind: a row that leaves late in the factor leaves cheaply.
    for index in (0..dual.factored.len()).rev() {
        let i = dual.factored[index];
        if dual.leaving.contains(&i) {
            let (low, high) = dual.rows[i].interval(dual.states[i]);
            let end = if dual.multipliers[i] < low { low } else { high };
            dual.take_out(index);
            dual.pass(i, end);
        }
    }
    while let Some(i) = dual.pending.pop() {
        if dual.insert(i) == Insertion::Dependent {
            dual.pending.push(i);
            return false;
        }
    }
    true
}

/// Adds the worst of the violated rows.
fn join(dual: &mut Dual) {
    while let Some(i) = dual.worst() {
        let before = dual.states[i];
        dual.begin(i);
        if dual.insert(i) == Insertion::Dependent {
            dual.revert(i, before);
        }
        silence(&mut dual.excess, &dual.constant.gram, i);
    }
}

/// Clears the scores of row i and of those close to it.
fn silence(scores: &mut [f64], gram: &Columns, i: usize) {
    for (score, coupling) in scores.iter_mut().zip(gram.column(i)) {
        let coupled = coupling.abs() >= MAX_COUPLING;
        *score = if coupled { 0.0 } else { *score };
    }
    scores[i] = 0.0;
}
