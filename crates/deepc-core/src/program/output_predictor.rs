//! The outputs that follow from a past and given inputs, from the data alone.

use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, MatMut, MatRef, Par};

use super::common::{NamedSeries, check_series, stack_all};
use super::error::ProgramError;
use super::past_factor::PastFactor;
use super::plan::MeasuredDisturbances;
use super::regularisation::{Regularisation, RegularisedPart};
use super::settings::{Slack, check_regularisation};
use crate::hankel::{Block, RANK_TOLERANCE, Shape, stacked_position, unstack_into};
use crate::linalg;
use crate::predictor::Predictor;

/// Predicts the outputs that follow a past when given inputs are applied:
///
/// ```text
/// min  λ_g‖g‖² + λ_u‖σ_u‖² + λ_y‖σ_y‖²     s.t.  U_p g = u_ini + σ_u,  Y_p g = y_ini + σ_y,
/// g,σ                                            U_f g = u;            ŷ = Y_f g
/// ```
///
/// the `DeePC` problem (Coulson, Lygeros, Dörfler 2019, eq. 6) without a cost on the plan and with
/// the inputs given. With both slacks hard g is the least-norm solution and
/// `ŷ = Y_f [U_p; Y_p; U_f]⁺ col(u_ini, y_ini, u)` whatever `λ_g`: the least-squares predictor of
/// subspace predictive control (Favoreel, De Moor, Gevers 1999). Only the ratios of the λ matter.
///
/// With f = f0 + F z (module `past_factor`) and F = [`F_uu` 0; `F_yu` `F_yy`] the inputs fix
/// `z_u = F_uu⁻¹(u − f0_u)`, the cost asks for `z_y` = 0, and `ŷ = f0_y + F_yu z_u`: one constant
/// matrix times what is known.
///
/// If the past has hard slack and the data, having no noise, do not span it, it is projected onto
/// what they span.
///
/// ```
/// # use deepc_core::{data::Dataset, hankel::{HankelMatrix, Horizons}, predictor::Predictor};
/// # use deepc_core::program::{OutputPredictor, Regularisation, Slack};
/// # use faer::mat;
/// // y(k) = 2·u(k): one input, one output.
/// let mut data = Dataset::new(1.0, ["u"], ["y"])?;
/// data.push_rows(&[1.0, -1.0, 2.0, 0.5, 3.0, -2.0], &[2.0, -2.0, 4.0, 1.0, 6.0, -4.0])?;
/// let exciting = HankelMatrix::build(&data, Horizons::new(1, 2))?.require_persistently_exciting(0)?;
/// let predictor = Predictor::exact(&exciting)?;
/// let mut outputs =
///     OutputPredictor::new(&predictor, Regularisation::per_column(1.0), Slack::Hard, Slack::Hard)?;
/// let y = outputs.predict(mat![[1.0]].as_ref(), mat![[2.0]].as_ref(), mat![[5.0], [7.0]].as_ref(), None)?;
/// assert!((y[(0, 0)] - 10.0).abs() < 1e-9 && (y[(1, 0)] - 14.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct OutputPredictor {
    shape: Shape,
    gain: Mat<f64>,
    known: Vec<f64>,
    predicted: Vec<f64>,
}

impl OutputPredictor {
    /// Set-up: one QR decomposition of the data matrix, cheap if it is reduced.
    ///
    /// # Errors
    /// A λ is not finite and above 0, the inputs do not excite, or data and weights span too many
    /// orders of magnitude.
    pub fn new(
        predictor: &Predictor,
        regularisation: Regularisation,
        input_slack: Slack,
        output_slack: Slack,
    ) -> Result<Self, ProgramError> {
        if regularisation.part != RegularisedPart::SquaredNorm {
            return Err(ProgramError::Form {
                form: "the output predictor",
                part: "other than squared_norm",
                remedy: "charge the squared norm of g; with both slacks hard its size is of no matter",
            });
        }
        check_regularisation(&regularisation)?;
        input_slack.check("input_slack")?;
        output_slack.check("output_slack")?;
        let shape = predictor.shape();
        let (inputs, outputs) = (
            shape.rows_of(Block::FutureInputs).len(),
            shape.rows_of(Block::FutureOutputs).len(),
        );
        let mut compliance = vec![0.0; shape.known_rows()];
        compliance[shape.rows_of(Block::PastInputs)].fill(input_slack.compliance());
        compliance[shape.rows_of(Block::PastOutputs)].fill(output_slack.compliance());
        let lambda_g = regularisation.raw_lambda_g(predictor.reduction().columns_before);
        let factor = PastFactor::new(predictor, lambda_g, &compliance)?;
        let future = factor.future.as_ref();
        check_excitation(predictor, future, lambda_g)?;

        // X F_uu = F_yu, as F_uuᵀXᵀ = F_yuᵀ; row by row, which keeps the error of X·u small.
        let mut from_inputs = future
            .submatrix(inputs, 0, outputs, inputs)
            .transpose()
            .to_owned();
        let f_uu = future.submatrix(0, 0, inputs, inputs);
        solve_upper_triangular_in_place(f_uu.transpose(), from_inputs.as_mut(), Par::Seq);
        let from_inputs = from_inputs.transpose();
        let known = factor.on_past(factor.coordinate_map().as_ref());
        let from_past = known.subrows(inputs, outputs) - from_inputs * known.subrows(0, inputs);
        let past = compliance.len();
        let gain = Mat::from_fn(outputs, past + inputs, |i, j| match j.checked_sub(past) {
            None => from_past[(i, j)],
            Some(j) => from_inputs[(i, j)],
        });
        Ok(Self {
            shape,
            known: vec![0.0; past + inputs],
            predicted: vec![0.0; outputs],
            gain,
        })
    }

    /// Sizes m, p, `T_ini`, N.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The constant matrix of `ŷ = gain·col(u_ini, d_ini, y_ini, d, u)`, pN×(known + mN), all
    /// stacked time-major.
    #[must_use]
    pub fn gain(&self) -> MatRef<'_, f64> {
        self.gain.as_ref()
    }

    /// Outputs (N×p) after a past of inputs (`T_ini`×m) and outputs (`T_ini`×p), for future inputs
    /// (N×m) and, where the data have them, measured disturbances.
    ///
    /// # Errors
    /// A shape does not fit.
    pub fn predict(
        &mut self,
        past_inputs: MatRef<'_, f64>,
        past_outputs: MatRef<'_, f64>,
        future_inputs: MatRef<'_, f64>,
        disturbances: Option<MeasuredDisturbances<'_>>,
    ) -> Result<Mat<f64>, ProgramError> {
        let mut outputs = Mat::zeros(self.shape.horizons.future, self.shape.outputs);
        self.predict_into(
            past_inputs,
            past_outputs,
            future_inputs,
            disturbances,
            outputs.as_mut(),
        )?;
        Ok(outputs)
    }

    /// As [`predict`](Self::predict), into `outputs` (N×p); allocates nothing.
    ///
    /// # Errors
    /// A shape does not fit; `outputs` is left as it was.
    pub fn predict_into(
        &mut self,
        past_inputs: MatRef<'_, f64>,
        past_outputs: MatRef<'_, f64>,
        future_inputs: MatRef<'_, f64>,
        disturbances: Option<MeasuredDisturbances<'_>>,
        outputs: MatMut<'_, f64>,
    ) -> Result<(), ProgramError> {
        let Shape {
            inputs: m,
            disturbances: q,
            outputs: p,
            horizons,
        } = self.shape;
        let measured = MeasuredDisturbances::or_none(disturbances);
        let (past, future) = (horizons.past, horizons.future);
        // Nothing is expected where there is nothing.
        let steps = |steps: usize| if q == 0 { 0 } else { steps };
        let series: [NamedSeries<'_>; 5] = [
            ("the past of the inputs", past_inputs, past, m),
            (
                "the past of the disturbances",
                measured.past,
                steps(past),
                q,
            ),
            ("the past of the outputs", past_outputs, past, p),
            (
                "the preview of the disturbances",
                measured.preview,
                steps(future),
                q,
            ),
            ("the future of the inputs", future_inputs, future, m),
        ];
        for (name, series, rows, columns) in series {
            check_series(name, series, rows, columns)?;
        }
        check_series("the room for the outputs", outputs.as_ref(), future, p)?;
        stack_all(&series, &mut self.known);
        linalg::multiply(&mut self.predicted, self.gain.as_ref(), &self.known);
        unstack_into(&self.predicted, outputs);
        Ok(())
    }
}

/// Every future input must have a part of its own, beside the past and the inputs before it.
fn check_excitation(
    predictor: &Predictor,
    future: MatRef<'_, f64>,
    lambda_g: f64,
) -> Result<(), ProgramError> {
    let shape = predictor.shape();
    for step in 0..shape.horizons.future {
        for (channel, name) in predictor.input_names().iter().enumerate() {
            let row = stacked_position(step, channel, shape.inputs);
            let size = predictor.blocks().future_inputs.row(row).norm_l2() / lambda_g.sqrt();
            let own = future[(row, row)].abs();
            let pivot = if size > 0.0 { own / size } else { 0.0 };
            if pivot <= RANK_TOLERANCE {
                return Err(ProgramError::InputsNotExciting {
                    channel: name.clone(),
                    step,
                    pivot,
                    needed: RANK_TOLERANCE,
                });
            }
        }
    }
    Ok(())
}
