//! The dual program at one step, the set of rows that push, and the factor that goes with it.
//!
//! min D(μ) = ½μᵀGμ − cᵀμ + Σ φᵢ(μᵢ)        v = c − Gμ
//!
//! G never changes, so the factor of (G + diag ε) over the working set is kept from step to step
//! and follows the rows that join and leave.

use super::super::problem::OwnedVectors;
use super::bounds::{Row, RowSide, RowState};
use super::constant::Constant;
use super::factor::PackedCholesky;
use crate::columns::dot;

/// A pivot below this part of its diagonal entry is recomputed from V.
const DOUBTFUL_PIVOT: f64 = 1e-6;

/// Squared distance from the span of the others (of rows of length 1) below which a row counts
/// as dependent: its multiplier would exceed what it corrects by this factor's inverse.
const DEPENDENT: f64 = 1e-14;

/// The same for what soft rows give way: far above the square of rounding, beside which it has to
/// stand.
const GIVEN: f64 = 1e-28;

/// Whether a row could join the factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solver) enum Insertion {
    Done,
    /// It is a combination of the present rows, left in `Dual::combination`.
    Dependent,
}

/// A pivot without cancellation.
struct AccuratePivot {
    pivot: f64,
    /// xᵀEx + ε: what soft rows give way, which is exact however little it is.
    given: f64,
    /// 1 + ‖x‖².
    size: f64,
}

impl AccuratePivot {
    fn is_rounding(&self) -> bool {
        let small = self.pivot <= DEPENDENT * self.size && self.given <= GIVEN * self.size;
        small || self.pivot.is_nan() || self.pivot <= 0.0
    }
}

/// See the module.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Dual {
    pub constant: Constant,
    pub rows: Vec<Row>,
    /// The bounds of `rows` once more, each in a slice of its own.
    pub(super) lowers: Vec<f64>,
    pub(super) uppers: Vec<f64>,
    /// c, and whether all of it is zero.
    pub unconstrained: Vec<f64>,
    pub(super) origin: bool,
    /// v at the present multipliers.
    pub values: Vec<f64>,
    /// μ.
    pub multipliers: Vec<f64>,
    pub states: Vec<RowState>,
    /// The rows of the factor in its order.
    pub factored: Vec<usize>,
    pub(super) factor: PackedCholesky,
    pub capped: Vec<usize>,
    /// Rows in a factored state that wait to join the factor; their multiplier is fixed so long.
    pub pending: Vec<usize>,
    /// Multipliers that solve the factored system, in its order.
    pub solution: Vec<f64>,
    /// See [`Insertion::Dependent`].
    pub combination: Vec<f64>,
    /// How far every row is from what its state demands, beyond rounding; 0 if it is not.
    pub excess: Vec<f64>,
    /// How far every multiplier is from what its row's state allows, where rows are exchanged.
    pub(super) discord: Vec<f64>,
    pub(super) leaving: Vec<usize>,
    /// (row, μ) of the rows that push.
    pub pushing: Vec<(usize, f64)>,
    pub best: Snapshot,
    pub(super) order: Vec<usize>,
    residual: Vec<f64>,
    pub(super) correction: Vec<f64>,
    /// (row, number) of the factored rows, for products with their columns.
    pub terms: Vec<(usize, f64)>,
    /// A copy of x.
    pub point: Vec<f64>,
}

/// A point the search may return to.
#[derive(Debug, Clone)]
pub(in crate::solver) struct Snapshot {
    pub objective: f64,
    multipliers: Vec<f64>,
    states: Vec<RowState>,
    factored: Vec<usize>,
}

impl Dual {
    pub fn new(constant: Constant, variables: usize) -> Self {
        let r = constant.prices.len();
        let rows = constant.prices.iter().map(|&price| Row {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            price,
        });
        Self {
            rows: rows.collect(),
            lowers: vec![f64::NEG_INFINITY; r],
            uppers: vec![f64::INFINITY; r],
            unconstrained: vec![0.0; r],
            origin: true,
            values: vec![0.0; r],
            multipliers: vec![0.0; r],
            states: vec![RowState::Inactive; r],
            factored: Vec::with_capacity(r),
            factor: PackedCholesky::with_capacity(r),
            capped: Vec::with_capacity(r),
            pending: Vec::with_capacity(r),
            solution: vec![0.0; r],
            combination: vec![0.0; r],
            excess: vec![0.0; r],
            discord: vec![0.0; r],
            leaving: Vec::with_capacity(r),
            pushing: Vec::with_capacity(r),
            best: Snapshot {
                objective: f64::INFINITY,
                multipliers: vec![0.0; r],
                states: vec![RowState::Inactive; r],
                factored: Vec::with_capacity(r),
            },
            order: Vec::with_capacity(r),
            residual: vec![0.0; variables],
            point: vec![0.0; variables],
            correction: vec![0.0; r],
            terms: Vec::with_capacity(r + 1),
            constant,
        }
    }

    /// Takes the step's vectors; x becomes the unconstrained optimum.
    pub fn load(&mut self, vectors: &OwnedVectors, x: &mut [f64]) {
        if vectors.linear.iter().any(|q| *q != 0.0) {
            self.constant
                .unconstrained(&vectors.linear, x, &mut self.unconstrained);
            self.origin = false;
        } else {
            x.fill(0.0);
            self.unconstrained.fill(0.0);
            self.origin = true;
        }
        for (i, reciprocal) in self.constant.reciprocals.iter().enumerate() {
            self.lowers[i] = vectors.lower[i] * reciprocal;
            self.uppers[i] = vectors.upper[i] * reciprocal;
        }
        let bounds = self.lowers.iter().zip(&self.uppers);
        for (row, (&lower, &upper)) in self.rows.iter_mut().zip(bounds) {
            row.lower = lower;
            row.upper = upper;
        }
    }

    /// Forgets which rows push.
    pub fn clear(&mut self) {
        self.multipliers.fill(0.0);
        self.states.fill(RowState::Inactive);
        self.factored.clear();
        self.factor.clear();
        self.capped.clear();
        self.pending.clear();
    }

    /// Keeps what an unfinished search has found, for the next one to go on from.
    pub fn suspend(&mut self) {
        while let Some(i) = self.pending.pop() {
            self.drop_row(i);
        }
    }

    /// Makes last step's rows fit this step's bounds, and adds all hard equalities.
    pub fn start(&mut self) {
        for index in (0..self.factored.len()).rev() {
            let i = self.factored[index];
            let side = match self.states[i] {
                // It joined when the last solve ran out of its budget.
                RowState::Tight(side) | RowState::Exceeded(side) if self.multipliers[i] == 0.0 => {
                    side
                }
                _ => RowSide::of(self.multipliers[i]),
            };
            if self.rows[i].bound(side).is_infinite() {
                self.take_out(index);
                self.drop_row(i);
            } else if self.states[i].is_tight() {
                // An equality may have become an inequality.
                self.states[i] = RowState::Tight(side);
            }
        }
        for index in (0..self.capped.len()).rev() {
            let i = self.capped[index];
            if self.rows[i]
                .bound(RowSide::of(self.multipliers[i]))
                .is_infinite()
            {
                self.capped.swap_remove(index);
                self.drop_row(i);
            }
        }
        for i in 0..self.rows.len() {
            let row = &self.rows[i];
            if row.lower >= row.upper && row.price.is_hard() && self.states[i] == RowState::Inactive
            {
                self.states[i] = RowState::Tight(RowSide::Upper);
                if self.insert(i) == Insertion::Dependent {
                    self.states[i] = RowState::Inactive;
                }
            }
        }
        self.save(f64::INFINITY);
    }

    /// Remembers the present multipliers.
    pub fn save(&mut self, objective: f64) {
        let best = &mut self.best;
        best.objective = objective;
        best.multipliers.copy_from_slice(&self.multipliers);
        best.states.copy_from_slice(&self.states);
        best.factored.clone_from(&self.factored);
    }

    /// Returns to what was remembered. Rows that no longer fit the factor are left pending.
    pub fn restore(&mut self) {
        self.multipliers.copy_from_slice(&self.best.multipliers);
        self.states.copy_from_slice(&self.best.states);
        self.capped.clear();
        self.pending.clear();
        for (i, state) in self.states.iter().enumerate() {
            if matches!(state, RowState::Capped(_)) {
                self.capped.push(i);
            }
        }
        self.order.clone_from(&self.best.factored);
        self.refactor();
    }

    /// Computes the factor afresh for the rows of `order`. Those that do not fit are left
    /// pending.
    pub(super) fn refactor(&mut self) {
        self.factored.clear();
        self.factor.clear();
        for index in 0..self.order.len() {
            let i = self.order[index];
            if self.insert(i) == Insertion::Dependent {
                self.pending.push(i);
            }
        }
    }

    /// Lets row i, whose state is set, join the factor.
    pub fn insert(&mut self, i: usize) -> Insertion {
        let column = self.constant.gram.column(i);
        let give = self.rows[i].price.diagonal(self.states[i]);
        let diagonal = column[i] + give;
        let couplings = self.factored.iter().map(|&j| column[j]);
        let mut pivot = diagonal - self.factor.prepare(couplings);
        if pivot <= DOUBTFUL_PIVOT * diagonal {
            let accurate = self.accurate_pivot(i, give);
            pivot = accurate.pivot;
            if accurate.is_rounding() {
                return Insertion::Dependent;
            }
        }
        self.factor.append(pivot);
        self.factored.push(i);
        Insertion::Done
    }

    /// The pivot of the prepared row i as min over x of `‖Vᵢ − V_A x‖² + xᵀEx + ε`, which has no
    /// cancellation. Leaves x in `combination`.
    fn accurate_pivot(&mut self, i: usize, give: f64) -> AccuratePivot {
        let k = self.factored.len();
        let x = &mut self.combination[..k];
        self.factor.combination(x);
        for refinement in [true, false] {
            self.terms.clear();
            self.terms
                .extend(self.factored.iter().copied().zip(x.iter().copied()));
            let vectors = &self.constant.reduced_columns;
            self.residual.copy_from_slice(vectors.column(i));
            vectors.subtract(&mut self.residual, &self.terms);
            if refinement {
                let correction = &mut self.correction[..k];
                vectors.products(correction, &self.factored, &self.residual);
                for ((value, x), &j) in correction.iter_mut().zip(x.iter()).zip(&self.factored) {
                    *value -= self.rows[j].price.diagonal(self.states[j]) * x;
                }
                self.factor.solve(correction);
                for (x, correction) in x.iter_mut().zip(correction) {
                    *x += *correction;
                }
            }
        }
        let (mut given, mut size) = (give, 1.0);
        for (x, &j) in x.iter().zip(&self.factored) {
            size += x * x;
            given += self.rows[j].price.diagonal(self.states[j]) * x * x;
        }
        AccuratePivot {
            pivot: given + dot(&self.residual, &self.residual),
            given,
            size,
        }
    }

    /// Takes the row at `index` out of the factor and returns it.
    pub fn take_out(&mut self, index: usize) -> usize {
        self.factor.remove(index);
        self.factored.remove(index)
    }

    /// Moves row i, which is in no list, beyond an `end` of its interval. A new state that
    /// belongs in the factor is left pending.
    pub fn pass(&mut self, i: usize, end: f64) {
        let state = self.rows[i].beyond(self.states[i], end);
        self.multipliers[i] = if state == RowState::Inactive {
            0.0
        } else {
            end
        };
        self.states[i] = state;
        match state {
            RowState::Inactive => {}
            RowState::Capped(_) => self.capped.push(i),
            RowState::Tight(_) | RowState::Exceeded(_) => self.pending.push(i),
        }
    }

    /// Row i, which is in no list, no longer pushes.
    pub fn drop_row(&mut self, i: usize) {
        self.multipliers[i] = 0.0;
        self.states[i] = RowState::Inactive;
    }

    /// Undoes [`Self::begin`].
    pub fn revert(&mut self, i: usize, before: RowState) {
        self.states[i] = before;
        if matches!(before, RowState::Capped(_)) {
            self.capped.push(i);
        }
    }

    /// What row i demands of its value: c − (fixed multipliers) − target.
    pub fn demand(&self, i: usize) -> f64 {
        let column = self.constant.gram.column(i);
        let fixed = self.capped.iter().chain(&self.pending);
        let fixed = fixed.filter(|&&j| j != i);
        let pushed: f64 = fixed.map(|&j| column[j] * self.multipliers[j]).sum();
        self.unconstrained[i] - pushed - self.rows[i].target(self.states[i])
    }

    /// Solves (G + diag ε)μ = demand over the factored rows into `solution`.
    pub fn solve_factored(&mut self) {
        for index in 0..self.factored.len() {
            self.solution[index] = self.demand(self.factored[index]);
        }
        self.factor.solve(&mut self.solution[..self.factored.len()]);
    }

    /// Sets the state in which row i, which has an excess, joins the working set.
    pub fn begin(&mut self, i: usize) {
        let row = &self.rows[i];
        self.states[i] = if let RowState::Capped(side) = self.states[i] {
            self.capped.retain(|&j| j != i);
            RowState::Tight(side)
        } else if self.values[i] > row.upper {
            row.price.begin(RowSide::Upper)
        } else {
            row.price.begin(RowSide::Lower)
        };
    }
}
