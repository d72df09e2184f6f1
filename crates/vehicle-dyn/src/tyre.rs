//! Tyre forces: the paper's combined-slip Magic Formula (eq. magic) and the radial spring.
//!
//! With the load ratio `n = Fz/(m g)` and the slip `s = (s_x, s_y)`, `s_x = λ`, `s_y = tan α`:
//!
//! ```text
//! F   = F_P · sin(C1 · atan[(s_c/C1)(1 − E1) + E1 · atan(s_c/C1)]) · s/|s|
//! s_c = C_α |s| / F_P
//! C_α = B1 C1 D1 m g (1 − exp(−c2 n)) / (4 (1 − exp(−c2/4)))
//! F_P = D1 Fz (1 + (q/4)³) / (1 + (q n)³)
//! D1  = mu_tyre · mu_road
//! ```
//!
//! The paper's constants 1.5 and 1.0527 = 1 + (1.5/4)³ are the case `q_load = 1.5`. Written with
//! `q` they say: the friction at the load m g/4 is `D1`, and it falls as a wheel carries more.

use std::sync::Arc;

use crate::parameters::TyreParameters;

/// Slip below which the force is taken from its slope; keeps `s/|s|` defined at rest.
const SMALL_SLIP: f64 = 1e-9;
/// Intervals of the tabulated shape: its error is then below 1e-9 of the peak.
const SHAPE_INTERVALS: usize = 512;
/// Largest `E1` for the table. Near 1 the force creeps to its limit over very large slips, which
/// equal steps do not resolve; such tyres take the formula itself.
const TABULATED_E1: f64 = 0.5;
/// Slip that stands for an infinite one at the end of the table.
const INFINITE_SLIP: f64 = 1e9;

/// The Magic Formula of one axle with its constants computed once.
#[derive(Debug, Clone, PartialEq)]
pub struct MagicFormula {
    mu_tyre: f64,
    /// 1/(m g), 1/N.
    inverse_weight: f64,
    /// (q/(m g))³, 1/N³.
    load_loss: f64,
    /// 1 + (q/4)³.
    load_gain: f64,
    /// `C_α/D1` over its saturation with load: `B1 C1 m g/(4 (1 − exp(−c2/4)))`, N.
    stiffness_scale: f64,
    c1: f64,
    e1: f64,
    c2: f64,
    /// Value and slope of the shape `P` over `u = s_c/(1 + s_c)`, at equal steps of `u` in [0, 1].
    /// Arc tangent and sine would otherwise take a quarter of the simulation's time.
    shape: Arc<[[f64; 2]]>,
}

/// The paper's `P(s_c, C1, E1)` and its derivative by `s_c`.
#[must_use]
pub fn shape(reduced_slip: f64, c1: f64, e1: f64) -> [f64; 2] {
    let x = reduced_slip / c1;
    let argument = x * (1.0 - e1) + e1 * x.atan();
    let argument_slope = (1.0 - e1 + e1 / (1.0 + x * x)) / c1;
    let (sin, cos) = (c1 * argument.atan()).sin_cos();
    [sin, cos * c1 * argument_slope / (1.0 + argument * argument)]
}

impl MagicFormula {
    /// Prepares the formula for tyres with stiffness factor `b1` on a vehicle of weight
    /// `weight_n` = m g.
    #[must_use]
    pub fn new(tyre: &TyreParameters, b1: f64, weight_n: f64) -> Self {
        let (c1, c2, q) = (
            tyre.shape_factor_c1,
            tyre.stiffness_saturation_c2,
            tyre.q_load,
        );
        // With c2 = 0 the stiffness is proportional to the load: the limit of the paper's formula.
        let stiffness_scale = if c2 == 0.0 {
            b1 * c1
        } else {
            b1 * c1 * weight_n / (4.0 * -(-0.25 * c2).exp_m1())
        };
        let knot = |index: usize| {
            let u = index as f64 / SHAPE_INTERVALS as f64;
            let slip = if index < SHAPE_INTERVALS {
                u / (1.0 - u)
            } else {
                INFINITE_SLIP
            };
            let [value, slope] = shape(slip, c1, tyre.curvature_factor_e1);
            [value, slope * (1.0 + slip) * (1.0 + slip)]
        };
        Self {
            mu_tyre: tyre.mu_tyre,
            inverse_weight: 1.0 / weight_n,
            load_loss: (q / weight_n).powi(3),
            load_gain: 1.0 + (0.25 * q).powi(3),
            stiffness_scale,
            c1,
            e1: tyre.curvature_factor_e1,
            c2,
            shape: (0..=SHAPE_INTERVALS).map(knot).collect(),
        }
    }

    /// Largest horizontal force `F_P` at the load `load_n` on a road of friction `mu_road`, N.
    #[must_use]
    #[inline]
    pub fn peak_force_n(&self, load_n: f64, mu_road: f64) -> f64 {
        if load_n <= 0.0 {
            return 0.0;
        }
        let denominator = 1.0 + self.load_loss * load_n * load_n * load_n;
        self.mu_tyre * mu_road * load_n * self.load_gain / denominator
    }

    /// Cornering stiffness `C_α` at the load `load_n` on a road of friction `mu_road`, N per unit
    /// slip.
    #[must_use]
    #[inline]
    pub fn stiffness_n(&self, load_n: f64, mu_road: f64) -> f64 {
        if load_n <= 0.0 {
            return 0.0;
        }
        let shape = if self.c2 == 0.0 {
            load_n
        } else {
            1.0 - (-self.c2 * load_n * self.inverse_weight).exp()
        };
        self.mu_tyre * mu_road * self.stiffness_scale * shape
    }

    /// Force `[F_x, F_y]` in N that a tyre under `load_n` exerts on the vehicle at the slip
    /// `[s_x, s_y]`, on a road of friction `mu_road`. Zero when the load is not positive.
    #[must_use]
    #[inline]
    pub fn force_n(&self, load_n: f64, mu_road: f64, slip: [f64; 2]) -> [f64; 2] {
        let peak = self.peak_force_n(load_n, mu_road);
        if peak <= 0.0 {
            return [0.0, 0.0];
        }
        let stiffness = self.stiffness_n(load_n, mu_road);
        let magnitude = (slip[0] * slip[0] + slip[1] * slip[1]).sqrt();
        if magnitude < SMALL_SLIP {
            return [stiffness * slip[0], stiffness * slip[1]];
        }
        // u = s_c/(1 + s_c) with s_c = C_α |s|/F_P.
        let linear = stiffness * magnitude;
        let relative = if self.e1 <= TABULATED_E1 {
            self.interpolated(linear / (peak + linear))
        } else {
            shape(linear / peak, self.c1, self.e1)[0]
        };
        let scale = peak * relative / magnitude;
        [scale * slip[0], scale * slip[1]]
    }

    /// Cubic Hermite interpolation of the shape at `u` in [0, 1].
    #[inline]
    fn interpolated(&self, u: f64) -> f64 {
        let position = u * SHAPE_INTERVALS as f64;
        // NaN becomes 0 and the division of positive numbers stays in [0, 1].
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let index = (position as usize).min(SHAPE_INTERVALS - 1);
        let t = position - index as f64;
        let ([y0, d0], [y1, d1]) = (self.shape[index], self.shape[index + 1]);
        let step = 1.0 / SHAPE_INTERVALS as f64;
        let rise = y1 - y0;
        let (a, b) = (d0 * step - rise, rise - d1 * step);
        y0 + t * rise + t * (1.0 - t) * (a * (1.0 - t) + b * t)
    }
}

/// Radial spring and damper of one tyre on its local ground plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RadialSpring {
    /// Stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Damping, N s/m.
    pub damping_n_s_per_m: f64,
}

impl RadialSpring {
    /// Force normal to the ground plane, N, never negative.
    ///
    /// `deflection_m` is the radial compression `ρ = R0 − r_c − (h − r_c)/cos γ` in the wheel plane,
    /// `closing_speed_m_s` the speed of the contact point into the ground along its normal,
    /// `inverse_cos` one over the cosine of the camber. The elastic part `k ρ/cos γ` at the contact point is the gradient of `½ k ρ²` for both height
    /// and camber, so it gives and takes no energy on a plane.
    #[must_use]
    #[inline]
    pub fn load_n(&self, deflection_m: f64, closing_speed_m_s: f64, inverse_cos: f64) -> f64 {
        if deflection_m <= 0.0 {
            return 0.0;
        }
        let radial_speed = closing_speed_m_s * inverse_cos;
        let radial = self.stiffness_n_per_m * deflection_m + self.damping_n_s_per_m * radial_speed;
        (radial * inverse_cos).max(0.0)
    }

    /// Stored energy, J.
    #[must_use]
    pub fn energy_j(&self, deflection_m: f64) -> f64 {
        0.5 * self.stiffness_n_per_m * deflection_m.max(0.0).powi(2)
    }
}
