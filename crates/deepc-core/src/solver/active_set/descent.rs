//! One row at a time: a descent of the dual cost that ends.
//!
//! A primal active-set method on the dual (Lawson and Hanson 1974, chapter 23; for rows that
//! depend on others Goldfarb and Idnani, Math. Programming 27, 1983): the multipliers move
//! towards the minimum over the working set as far as every row allows, the row that stops them
//! changes its state, and when the minimum is reached the most violated row joins. Every row
//! that joins lowers the dual cost, so no working set returns and there are finitely many; where
//! rounding hides the decrease, the row is left out until the cost falls again.

use super::super::QpStatus;
use super::clock::Clock;
use super::dual::{Dual, Insertion};

/// Smallest decrease of the dual cost that counts, relative to it.
const DECREASE: f64 = 1e-15;

/// A slope, relative to the numbers it is the sum of, that may be rounding.
const FLAT: f64 = 1e-13;

/// A share in a combination of rows, relative to the largest, that may be rounding.
const NO_SHARE: f64 = 1e-10;

/// Goes from `Dual::best` to the optimum. An error is how the solve ends without one.
pub(super) fn descend(
    dual: &mut Dual,
    left_out: &mut [bool],
    clock: &mut Clock,
) -> Result<(), QpStatus> {
    dual.restore();
    left_out.fill(false);
    let mut best = f64::INFINITY;
    let mut joined = None;
    loop {
        minimise_over_working_set(dual, clock)?;
        dual.evaluate();
        if !dual.pending.is_empty() {
            // The factor was computed afresh, and not every row fitted again.
            continue;
        }
        let objective = dual.objective();
        if objective < best - DECREASE * best.abs() || best.is_infinite() {
            best = objective;
            left_out.fill(false);
        } else if let Some(row) = joined {
            left_out[row] = true;
        }
        dual.measure_excess();
        for (excess, left_out) in dual.excess.iter_mut().zip(left_out.iter()) {
            if *left_out {
                *excess = 0.0;
            }
        }
        joined = dual.worst();
        let Some(row) = joined else { return Ok(()) };
        dual.begin(row);
        dual.pending.push(row);
    }
}

fn minimise_over_working_set(dual: &mut Dual, clock: &mut Clock) -> Result<(), QpStatus> {
    loop {
        while let Some(row) = dual.pending.pop() {
            join(dual, row, clock)?;
        }
        clock.tick()?;
        dual.solve_factored();
        let mut step = 1.0;
        let mut stop = None;
        for (index, &i) in dual.factored.iter().enumerate() {
            let (low, high) = dual.rows[i].interval(dual.states[i]);
            let (from, to) = (dual.multipliers[i], dual.solution[index]);
            let end = if to < low {
                low
            } else if to > high {
                high
            } else {
                continue;
            };
            let share = ((end - from) / (to - from)).max(0.0);
            if share < step {
                step = share;
                stop = Some((index, end));
            }
        }
        let Some((index, end)) = stop else {
            for (&i, &to) in dual.factored.iter().zip(&dual.solution) {
                let (low, high) = dual.rows[i].interval(dual.states[i]);
                dual.multipliers[i] = to.max(low).min(high);
            }
            return Ok(());
        };
        for (&i, &to) in dual.factored.iter().zip(&dual.solution) {
            let (low, high) = dual.rows[i].interval(dual.states[i]);
            let from = dual.multipliers[i];
            dual.multipliers[i] = (from + step * (to - from)).max(low).min(high);
        }
        let i = dual.take_out(index);
        dual.pass(i, end);
    }
}

/// Lets a row that was pending join the factor. If it is a combination of the present rows,
/// `Vᵢ = V_A x`, then Gμ does not change along μᵢ + t, `μ_A − t x`, and the dual cost is linear
/// there: the multipliers go down until a row stops them, and that row leaves.
fn join(dual: &mut Dual, row: usize, clock: &mut Clock) -> Result<(), QpStatus> {
    if dual.insert(row) == Insertion::Done {
        return Ok(());
    }
    clock.tick()?;
    let own = dual.demand(row);
    let (mut slope, mut size, mut largest) = (-own, own.abs(), 1.0_f64);
    for index in 0..dual.factored.len() {
        let share = dual.combination[index];
        let part = share * dual.demand(dual.factored[index]);
        slope += part;
        size += part.abs();
        largest = largest.max(share.abs());
    }
    let (low, high) = dual.rows[row].interval(dual.states[row]);
    let multiplier = dual.multipliers[row];
    let flat = slope.abs() <= FLAT * size;
    // On flat ground the row hands its multiplier to the others, who can do without it.
    let (direction, own_end) = match flat {
        true if multiplier > 0.0 => (-1.0, low.max(0.0)),
        true => (1.0, high.min(0.0)),
        false if slope < 0.0 => (1.0, high),
        false => (-1.0, low),
    };
    let mut step = (own_end - multiplier).abs();
    let mut stop = None;
    for (index, &i) in dual.factored.iter().enumerate() {
        let rate = -direction * dual.combination[index];
        if rate.abs() <= NO_SHARE * largest {
            continue;
        }
        let (low, high) = dual.rows[i].interval(dual.states[i]);
        let end = if rate < 0.0 { low } else { high };
        let length = ((end - dual.multipliers[i]) / rate).max(0.0);
        if length < step {
            step = length;
            stop = Some((index, end));
        }
    }
    if step.is_nan() {
        return Err(QpStatus::NumericalError);
    }
    if step.is_infinite() {
        return Err(QpStatus::Infeasible);
    }
    for (&i, share) in dual.factored.iter().zip(&dual.combination) {
        let (low, high) = dual.rows[i].interval(dual.states[i]);
        let moved = dual.multipliers[i] - direction * step * share;
        dual.multipliers[i] = moved.max(low).min(high);
    }
    if let Some((index, end)) = stop {
        dual.multipliers[row] += direction * step;
        // The row that leaves goes first if it comes back in another state.
        dual.pending.push(row);
        let i = dual.take_out(index);
        dual.pass(i, end);
        return Ok(());
    }
    if flat && own_end == 0.0 {
        dual.drop_row(row);
    } else {
        dual.pass(row, own_end);
    }
    Ok(())
}
