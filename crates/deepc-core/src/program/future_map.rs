//! What is left to choose once g and the slacks are eliminated.
//!
//! Everything is linear in coordinates c of the known part z: a = `L₁₁⁻¹z` where all of g is charged
//! (module `past_factor`), z itself otherwise.

use faer::{Mat, MatRef};

use super::common::Common;
use super::error::ProgramError;
use super::free_past::FreePast;
use super::model::{PredictionModel, Tracking};
use super::past_factor::PastFactor;
use super::regularisation::{Regularisation, RegularisedPart};
use crate::hankel::Block;
use crate::linalg;
use crate::predictor::Predictor;

/// f = Φc + F ζ + B η: the stacked future f = col(u, y), n entries, from coordinates c of the known
/// part, at the model cost (terms of c alone) + ‖ζ‖². η is free.
#[derive(Debug, Clone)]
pub(super) struct FutureMap {
    /// Φ, n×(length of c).
    pub known: Mat<f64>,
    /// F, n×(at most n).
    pub charged: Mat<f64>,
    /// B.
    pub free: Mat<f64>,
    /// From ζ to the charges it was packed from, if there were more than n of them.
    unpack: Option<Mat<f64>>,
}

impl FutureMap {
    pub fn new(known: Mat<f64>, charged: Mat<f64>, free: Mat<f64>) -> Self {
        // Only FFᵀ matters: more directions than entries are too many.
        let (charged, unpack) = if charged.ncols() > charged.nrows() {
            let qr = charged.transpose().qr();
            let packed = linalg::lower_from_upper(qr.thin_R());
            (packed, Some(qr.compute_thin_Q()))
        } else {
            (charged, None)
        };
        Self {
            known,
            charged,
            free,
            unpack,
        }
    }

    /// The cheapest charges that do what ζ does.
    pub fn unpacked(&self, zeta: &[f64]) -> Vec<f64> {
        let Some(unpack) = &self.unpack else {
            return zeta.to_vec();
        };
        let mut charges = vec![0.0; unpack.nrows()];
        linalg::multiply(&mut charges, unpack.as_ref(), zeta);
        charges
    }

    /// [F B].
    pub fn directions(&self) -> Mat<f64> {
        let charged = self.charged.ncols();
        Mat::from_fn(
            self.charged.nrows(),
            charged + self.free.ncols(),
            |i, j| match j.checked_sub(charged) {
                None => self.charged[(i, j)],
                Some(j) => self.free[(i, j)],
            },
        )
    }
}

/// How g and the slacks are eliminated.
pub(super) enum Elimination {
    /// All of g is charged alike.
    Charged(Box<(PastFactor, FutureMap)>),
    /// What the past fixes is free.
    Free(Box<FreePast>),
    /// There is no g: a model predicts, and an estimator knows c.
    Model(Box<(Tracking, FutureMap)>),
}

impl Elimination {
    /// `columns`: J before any reduction. `compliance`: 1/λ of every known entry, 0 where slack is
    /// hard.
    pub fn new(
        predictor: &Predictor,
        regularisation: &Regularisation,
        columns: usize,
        compliance: &[f64],
    ) -> Result<Self, ProgramError> {
        match regularisation.part {
            RegularisedPart::OneNorm => Err(ProgramError::Form {
                form: "the condensed form",
                part: "one_norm",
                remedy: "use `SparseProgram`, which keeps g",
            }),
            RegularisedPart::SquaredNorm => {
                let lambda_g = regularisation.raw_lambda_g(columns);
                let factor = PastFactor::new(predictor, lambda_g, compliance)?;
                let free = Mat::zeros(factor.future.nrows(), 0);
                let map =
                    FutureMap::new(factor.coordinate_map().clone(), factor.future.clone(), free);
                Ok(Self::Charged(Box::new((factor, map))))
            }
            _ => {
                let free = FreePast::new(predictor, regularisation, columns, compliance)?;
                Ok(Self::Free(Box::new(free)))
            }
        }
    }

    /// Without data.
    pub fn of_model(model: PredictionModel) -> Self {
        let charged = Mat::zeros(model.known.nrows(), 0);
        let map = FutureMap::new(model.known, charged, model.free);
        let preview = model.shape.rows_of(Block::FutureDisturbances).len();
        Self::Model(Box::new((Tracking::new(model.estimator, preview), map)))
    }

    pub fn map(&self) -> &FutureMap {
        match self {
            Self::Model(model) => &model.1,
            Self::Charged(charged) => &charged.1,
            Self::Free(free) => &free.map,
        }
    }

    /// Relative part of the known entries whose slack is hard that the data cannot explain.
    pub fn inconsistency(&mut self, known: &[f64]) -> f64 {
        match self {
            Self::Charged(charged) => charged.0.inconsistency(known),
            Self::Free(free) => free.inconsistency(known),
            Self::Model(_) => 0.0,
        }
    }

    /// The estimator of a model.
    pub fn tracking(&mut self) -> Option<&mut Tracking> {
        match self {
            Self::Model(model) => Some(&mut model.0),
            Self::Charged(_) | Self::Free(_) => None,
        }
    }

    /// Whether c is z itself.
    pub fn is_direct(&self) -> bool {
        matches!(self, Self::Free(_))
    }

    /// Writes c for a known part.
    pub fn write_coordinates(&self, known: &[f64], c: &mut [f64]) {
        match self {
            Self::Model(model) => model.0.write(known, c),
            Self::Charged(charged) => charged.0.write_coordinates(known, c),
            Self::Free(_) => c.copy_from_slice(known),
        }
    }

    /// X with X z = `gain`·c for every known part z.
    pub fn on_known(&self, gain: MatRef<'_, f64>) -> Mat<f64> {
        match self {
            Self::Charged(charged) => charged.0.on_past(gain),
            Self::Free(_) | Self::Model(_) => gain.to_owned(),
        }
    }

    /// Model cost of the known part at ζ = 0. Allocates.
    pub fn known_cost(&self, common: &Common) -> f64 {
        match self {
            Self::Charged(charged) => {
                let a = charged.0.coordinates(&common.known);
                linalg::dot(&a, &a)
            }
            Self::Free(free) => {
                let nothing = vec![0.0; free.map.charged.ncols()];
                let slack = free.slack(&common.known, &nothing);
                let (inputs, outputs) = common.slack_costs(&slack);
                inputs + outputs
            }
            Self::Model(_) => 0.0,
        }
    }
}
