//! What a row allows its multiplier, and what follows when it wants more.
//!
//! All numbers are of scaled rows (length 1 in the metric of P). The dual cost of a row is
//!
//! ```text
//! φ(μ) = u μ for μ ≥ 0,  l μ for μ ≤ 0,  and (|μ| − ρ)²/(2w) more beyond |μ| = ρ
//! ```
//!
//! so that its value v = c − Gμ stands at a bound while 0 < |μ| < ρ, and beyond it by
//! (|μ| − ρ)/w where |μ| > ρ. Without a w the multiplier ends at ρ.

use super::super::SoftPenalty;

/// Which side of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solver) enum RowSide {
    Upper,
    Lower,
}

impl RowSide {
    pub fn sign(self) -> f64 {
        match self {
            Self::Upper => 1.0,
            Self::Lower => -1.0,
        }
    }

    pub fn of(multiplier: f64) -> Self {
        if multiplier < 0.0 {
            Self::Lower
        } else {
            Self::Upper
        }
    }
}

/// What a row does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solver) enum RowState {
    /// Does not push.
    Inactive,
    /// Stands at a bound; 0 ≤ |μ| ≤ ρ.
    Tight(RowSide),
    /// Soft, beyond its bound by (|μ| − ρ)/w.
    Exceeded(RowSide),
    /// Soft without a w, beyond its bound: |μ| = ρ.
    Capped(RowSide),
}

impl RowState {
    pub fn is_tight(self) -> bool {
        matches!(self, Self::Tight(_))
    }
}

/// The constant price of violating a scaled row.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Price {
    /// ρ; infinite for a hard row.
    cap: f64,
    /// 1/w; zero for none.
    give: f64,
}

impl Price {
    /// Of a row that was divided by `scale`.
    pub fn scaled(penalty: Option<SoftPenalty>, scale: f64) -> Self {
        let Some(penalty) = penalty else {
            return Self {
                cap: f64::INFINITY,
                give: 0.0,
            };
        };
        let give = if penalty.quadratic > 0.0 {
            // Divided twice, because the square of a scale may overflow.
            1.0 / scale / scale / penalty.quadratic
        } else {
            0.0
        };
        Self {
            cap: penalty.linear * scale,
            give,
        }
    }

    pub fn is_hard(self) -> bool {
        self.cap.is_infinite()
    }

    /// The state in which a violated row begins to push.
    pub fn begin(self, side: RowSide) -> RowState {
        if self.cap > 0.0 {
            RowState::Tight(side)
        } else {
            RowState::Exceeded(side)
        }
    }

    /// What `state` adds to the row's diagonal entry of G.
    pub fn diagonal(self, state: RowState) -> f64 {
        match state {
            RowState::Exceeded(_) => self.give,
            _ => 0.0,
        }
    }

    /// ½(|μ| − ρ)²/w where |μ| > ρ: the part of φ beyond the bound's.
    pub fn conjugate(self, multiplier: f64) -> f64 {
        let excess = (multiplier.abs() - self.cap).max(0.0);
        0.5 * self.give * excess * excess
    }
}

/// One scaled row at one step.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Row {
    pub lower: f64,
    pub upper: f64,
    pub price: Price,
}

impl Row {
    pub fn bound(&self, side: RowSide) -> f64 {
        match side {
            RowSide::Upper => self.upper,
            RowSide::Lower => self.lower,
        }
    }

    fn is_equality(&self) -> bool {
        self.lower >= self.upper
    }

    /// t with v − εμ = t, where ε is the diagonal of the state.
    pub fn target(&self, state: RowState) -> f64 {
        match state {
            RowState::Exceeded(side) => {
                self.bound(side) - side.sign() * self.price.cap * self.price.give
            }
            RowState::Tight(side) | RowState::Capped(side) => self.bound(side),
            RowState::Inactive => 0.0,
        }
    }

    /// The multipliers for which `state` holds, from low to high.
    pub fn interval(&self, state: RowState) -> (f64, f64) {
        let cap = self.price.cap;
        match state {
            RowState::Inactive => (0.0, 0.0),
            // One bound on both sides: the multiplier changes its sign without a change of slope.
            RowState::Tight(_) if self.is_equality() => (-cap, cap),
            RowState::Tight(RowSide::Upper) => (0.0, cap),
            RowState::Tight(RowSide::Lower) => (-cap, 0.0),
            RowState::Exceeded(RowSide::Upper) => (cap, f64::INFINITY),
            RowState::Exceeded(RowSide::Lower) => (f64::NEG_INFINITY, -cap),
            RowState::Capped(side) => (side.sign() * cap, side.sign() * cap),
        }
    }

    /// The state beyond an end of the interval of `state`.
    pub fn beyond(&self, state: RowState, end: f64) -> RowState {
        let side = RowSide::of(end);
        match state {
            _ if end == 0.0 => RowState::Inactive,
            RowState::Tight(_) if self.price.give > 0.0 => RowState::Exceeded(side),
            RowState::Tight(_) => RowState::Capped(side),
            RowState::Exceeded(side) | RowState::Capped(side) => RowState::Tight(side),
            RowState::Inactive => RowState::Inactive,
        }
    }

    /// The value z of the row with the least cost of violation + ½σ(z − t)².
    pub fn proximal(&self, t: f64, sigma: f64) -> f64 {
        let bound = if t > self.upper {
            self.upper
        } else if t < self.lower {
            self.lower
        } else {
            return t;
        };
        let distance = t - bound;
        // A slope of at most ρ holds the row at its bound; beyond, s = (σd − ρ)/(σ + w).
        let slope = sigma * distance.abs() - self.price.cap;
        if slope <= 0.0 {
            return bound;
        }
        let give = self.price.give;
        let violation = if give > 0.0 {
            slope * give / (1.0 + sigma * give)
        } else {
            slope / sigma
        };
        bound + violation.copysign(distance)
    }

    /// The state to which a nonzero multiplier belongs.
    pub fn state_of(&self, multiplier: f64) -> RowState {
        let side = RowSide::of(multiplier);
        if multiplier.abs() < self.price.cap {
            RowState::Tight(side)
        } else if self.price.give > 0.0 {
            RowState::Exceeded(side)
        } else {
            RowState::Capped(side)
        }
    }

    /// φ(μ).
    pub fn dual_cost(&self, multiplier: f64) -> f64 {
        if multiplier == 0.0 {
            return 0.0;
        }
        let bound = self.bound(RowSide::of(multiplier));
        bound * multiplier + self.price.conjugate(multiplier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(lower: f64, upper: f64, linear: f64, quadratic: f64) -> Row {
        let penalty = SoftPenalty { linear, quadratic };
        Row {
            lower,
            upper,
            price: Price::scaled(Some(penalty), 1.0),
        }
    }

    #[test]
    fn states_meet_at_their_ends() {
        let upper = RowState::Tight(RowSide::Upper);
        let both = row(-1.0, 2.0, 3.0, 4.0);
        assert_eq!(both.interval(upper), (0.0, 3.0));
        assert_eq!(both.beyond(upper, 0.0), RowState::Inactive);
        let exceeded = both.beyond(upper, 3.0);
        assert_eq!(exceeded, RowState::Exceeded(RowSide::Upper));
        assert_eq!(both.beyond(exceeded, 3.0), upper);
        let linear = row(-1.0, 2.0, 3.0, 0.0);
        let lower = RowState::Tight(RowSide::Lower);
        assert_eq!(linear.beyond(lower, -3.0), RowState::Capped(RowSide::Lower));
        let quadratic = row(-1.0, 2.0, 0.0, 4.0);
        let begun = quadratic.price.begin(RowSide::Lower);
        assert_eq!(begun, RowState::Exceeded(RowSide::Lower));
        assert_eq!(quadratic.beyond(begun, -0.0), RowState::Inactive);
    }

    #[test]
    fn a_value_beyond_the_bound_follows_the_slope_of_the_dual_cost() {
        let row = row(-1.0, 2.0, 3.0, 4.0);
        let state = RowState::Exceeded(RowSide::Lower);
        let (multiplier, step) = (-5.0, 1e-4);
        let slope =
            (row.dual_cost(multiplier + step) - row.dual_cost(multiplier - step)) / (2.0 * step);
        let value = row.target(state) + row.price.diagonal(state) * multiplier;
        assert!((value - slope).abs() < 1e-9, "{value} {slope}");
        assert!((value - (-1.0 - 2.0 / 4.0)).abs() < 1e-12);
    }
}
