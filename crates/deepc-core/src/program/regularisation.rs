//! What keeps the combination of columns g in check.
//!
//! With the triangular factor of the data, rows ordered `z = col(u_ini, d_ini, y_ini, d)`, u, y,
//!
//! ```text
//! ⎡Z  ⎤   ⎡L₁₁          ⎤ ⎡Q₁⎤         z = L₁₁γ₁
//! ⎢U_f⎥ = ⎢L₂₁ L₂₂      ⎥ ⎢Q₂⎥         u = L₂₁γ₁ + L₂₂γ₂
//! ⎣Y_f⎦   ⎣L₃₁ L₃₂ L₃₃  ⎦ ⎣Q₃⎦         y = L₃₁γ₁ + L₃₂γ₂ + L₃₃γ₃        γᵢ = Qᵢg
//! ```
//!
//! γ₁ is what the known past fixes, γ₂ what the inputs choose, and γ₃ what no linear predictor
//! explains: noise and nonlinearity. All quadratic methods differ only in what they charge for
//! each (Breschi, Chiuso, Formentin 2023):
//!
//! | method | γ₁ | γ₂ | γ₃ | where from |
//! |---|---|---|---|---|
//! | [`Regularisation::raw`], [`per_column`](Regularisation::per_column) | λ_g | λ_g | λ_g | Coulson, Lygeros, Dörfler 2019; the paper's eq. (deepc) |
//! | [`Regularisation::projection`] | 0 | 0 | λ_g | Dörfler, Coulson, Markovsky 2023, λ‖(I − Π)g‖² |
//! | [`Regularisation::gamma`] | 0 | λ₂ = `lambda_g` | λ₃ (absent: γ₃ = 0) | γ-DDPC: Breschi, Chiuso, Formentin 2023 |
//! | [`Regularisation::spc`] | 0 | 0 | γ₃ = 0 | Favoreel, De Moor, Gevers 1999: subspace predictive control |
//! | [`Regularisation::none`] | 0 | 0 | 0 | for data without noise |
//! | [`Regularisation::one_norm`] | | | | λ_g‖g‖₁: Coulson, Lygeros, Dörfler 2019; sparse form only |

use serde::{Deserialize, Serialize};

/// What `λ_g` multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalisation {
    /// `λ_g‖g‖²` with H as it is, as the papers write it. Its meaning changes with the length of
    /// the recording: twice the columns J act like half the `λ_g`.
    Raw,
    /// `λ_g‖g‖²` with H/√J in place of H, that is `λ_g·J` of the raw form. Its meaning does not
    /// change when more data of the same kind are recorded. ‖g‖₁ keeps its meaning by itself and is
    /// the same in both.
    PerColumn,
}

/// Which part of g is charged, and how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RegularisedPart {
    /// `λ_g‖g‖²`. The condensed form is exact, and so is a reduction to the numerical rank.
    #[default]
    SquaredNorm,
    /// `λ_g‖g‖₁`: prefers few columns. Cannot be condensed, and a reduced data matrix makes it
    /// another problem: use [`super::SparseProgram`] on [`crate::predictor::Predictor::full`].
    OneNorm,
    /// `λ_g‖(I − Π)g‖²` with Π the projection onto the rows of (`U_p`, `Y_p`, `U_f`): charges only
    /// what least squares would not predict. The condensed form is exact.
    SquaredProjection,
    /// `λ_g‖γ₂‖² + λ₃‖γ₃‖²`, or γ₃ = 0 without `lambda_3`. The condensed form is exact, and the only
    /// one.
    Gamma {
        /// Weight of γ₃, finite and above 0; absent for γ₃ = 0.
        lambda_3: Option<f64>,
    },
    /// γ₃ = 0 and nothing charged: the least-squares predictor. The condensed form is exact, and
    /// the only one.
    Spc,
    /// Nothing charged; the condensed form is exact. With noise in the data any output can then be promised for any input.
    None,
}

/// Regularisation of g.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regularisation {
    /// `λ_g`, finite and above 0; 0 where nothing is charged ([`RegularisedPart::Spc`],
    /// [`RegularisedPart::None`]).
    pub lambda_g: f64,
    /// What it multiplies.
    pub normalisation: Normalisation,
    /// Which part of g it charges.
    #[serde(default)]
    pub part: RegularisedPart,
}

impl Regularisation {
    /// `lambda_g`·‖g‖² with H as it is.
    #[must_use]
    pub fn raw(lambda_g: f64) -> Self {
        Self {
            lambda_g,
            normalisation: Normalisation::Raw,
            part: RegularisedPart::SquaredNorm,
        }
    }

    /// `lambda_g`·‖g‖² with H/√J in place of H.
    #[must_use]
    pub fn per_column(lambda_g: f64) -> Self {
        Self {
            normalisation: Normalisation::PerColumn,
            ..Self::raw(lambda_g)
        }
    }

    /// `lambda_g`·‖g‖₁; its meaning does not change when more data of the same kind are recorded.
    #[must_use]
    pub fn one_norm(lambda_g: f64) -> Self {
        Self {
            part: RegularisedPart::OneNorm,
            ..Self::per_column(lambda_g)
        }
    }

    /// `lambda_g`·‖(I − Π)g‖² with H/√J in place of H.
    #[must_use]
    pub fn projection(lambda_g: f64) -> Self {
        Self {
            part: RegularisedPart::SquaredProjection,
            ..Self::per_column(lambda_g)
        }
    }

    /// γ-DDPC: `lambda_2`·‖γ₂‖² + `lambda_3`·‖γ₃‖² with H/√J in place of H; γ₃ = 0 without
    /// `lambda_3`.
    #[must_use]
    pub fn gamma(lambda_2: f64, lambda_3: Option<f64>) -> Self {
        Self {
            part: RegularisedPart::Gamma { lambda_3 },
            ..Self::per_column(lambda_2)
        }
    }

    /// Subspace predictive control: γ₃ = 0.
    #[must_use]
    pub fn spc() -> Self {
        Self {
            part: RegularisedPart::Spc,
            ..Self::per_column(0.0)
        }
    }

    /// Nothing.
    #[must_use]
    pub fn none() -> Self {
        Self {
            part: RegularisedPart::None,
            ..Self::per_column(0.0)
        }
    }

    /// `λ_g` of the raw form, for a Hankel matrix of J columns (before any reduction).
    #[must_use]
    pub fn raw_lambda_g(&self, columns: usize) -> f64 {
        self.raw_value(self.lambda_g, columns)
    }

    /// λ of γ₃ in the raw form, for [`RegularisedPart::Gamma`].
    pub(super) fn raw_value(&self, lambda: f64, columns: usize) -> f64 {
        let columns = columns as f64;
        // Columns that are there twice share their part of g: ‖g‖₁ stays what it was.
        let per_column =
            self.normalisation == Normalisation::PerColumn && self.part != RegularisedPart::OneNorm;
        if per_column { lambda * columns } else { lambda }
    }

    /// Whether `lambda_g` is charged at all.
    pub(super) fn charges(&self) -> bool {
        !matches!(self.part, RegularisedPart::Spc | RegularisedPart::None)
    }
}
