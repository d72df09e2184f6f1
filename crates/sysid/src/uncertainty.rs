//! How well the data determine what a model says: standard errors of gains and responses.
//!
//! From the Jacobian of the innovations (Ljung 1999, chapter 9). Only functions that no change of
//! the state basis moves have a standard error; they are taken in local coordinates, where the
//! information matrix is regular as far as the data go. A function that leans on a direction which
//! the data do not see at all has an infinite one.

use deepc_core::faer::linalg::solvers::Solve;
use deepc_core::faer::{Mat, c64};

use crate::error::SysidError;
use crate::input_fit::InputStructure;
use crate::least_squares::{ThinSvd, thin_svd};
use crate::prediction_error::{
    Basis, Entry, Evaluation, Focus, Layout, OutputWeights, linearise, prepared,
};
use crate::regressors::{Packed, add_product, add_scaled};
use crate::state_space::SystemMatrices;
use crate::working::WorkingData;

/// Directions whose effect is below this fraction of the largest are not seen by the data.
const SEEN: f64 = 1e-10;

/// A function leans on a direction if this fraction of its gradient lies there.
const LEANS: f64 = 1e-6;

/// Spans of samples over which scores are summed when the innovations are coloured.
const SPANS: usize = 30;

/// Lags of the whiteness test, if the records are long enough.
const LAGS: usize = 25;

/// Normal quantile of the whiteness test: white innovations pass 999 times in 1000.
const WHITENESS_QUANTILE: f64 = 3.090_232;

/// A value for every output and input, with its standard error; both p×M, of scaled channels.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    pub value: Mat<f64>,
    /// Zero for an input that is not active: nothing was estimated.
    pub standard_error: Mat<f64>,
}

/// Standard errors of a frequency response at one frequency, of scaled channels.
#[derive(Debug, Clone)]
pub(crate) struct ResponseError {
    /// In radians per sample.
    pub frequency: f64,
    /// The response, p×M.
    pub response: Mat<c64>,
    /// Root mean square distance of the complex response from the true one, p×M.
    pub complex: Mat<f64>,
    /// Standard error of the magnitude, p×M.
    pub magnitude: Mat<f64>,
}

/// Second-order properties of a model's parameters.
#[derive(Debug, Clone)]
pub(crate) struct Uncertainty {
    model: SystemMatrices,
    layout: Layout,
    information: Information,
    /// D with all its columns free, and its t-values; over active inputs.
    feedthrough: (Mat<f64>, Mat<f64>),
    active: Vec<usize>,
    inputs: usize,
    /// The innovations are not white: standard errors are those of the sandwich formula.
    pub coloured: bool,
}

impl Uncertainty {
    /// Of a model that was fitted to these data. With K the parameters are those of the innovation
    /// form, with K = 0 those of an output-error model. Standard errors are those of the minimum of
    /// the prediction errors: of a model from elsewhere (subspace), they are what refining it would
    /// give. Coloured innovations (a portmanteau test at 0.1 %: Hosking 1980) are allowed for by
    /// summing scores over spans of the data.
    ///
    /// # Errors
    /// A shape does not fit, A or A − KC is not stable, or a decomposition fails.
    pub fn of(
        data: &WorkingData,
        matrices: &SystemMatrices,
        structure: &InputStructure,
    ) -> Result<Self, SysidError> {
        let focus = if matrices.k.norm_max() > 0.0 {
            Focus::Prediction
        } else {
            Focus::Simulation
        };
        let (packed, model, layout) = prepared(data, matrices, structure, focus)?;
        let evaluate = |model: &SystemMatrices, whitening: &Mat<f64>| {
            Evaluation::new(&packed, model, whitening, OutputWeights::Covariance)
        };
        let first = evaluate(&model, &Mat::identity(layout.p, layout.p))?;
        let model = Basis::balanced(&model, &first)?.apply(&model);
        let run = evaluate(&model, &first.whitening)?;
        let coloured = !is_white(&packed, &run);
        let information = Information::new(&packed, &model, &run, &layout, coloured)?;
        let all = Layout {
            feedthrough: (0..layout.inputs).collect(),
            ..layout.clone()
        };
        let feedthrough = free_feedthrough(&packed, &model, &run, &all, coloured)?;
        Ok(Self {
            model,
            layout,
            information,
            feedthrough,
            active: structure.active(),
            inputs: structure.dynamics.len(),
            coloured,
        })
    }

    /// `C (I − A)⁻¹ B + D` with its standard error.
    pub fn steady_state_gain(&self) -> Estimate {
        let response = self.at(c64::new(1.0, 0.0));
        let mut estimate = Estimate {
            value: self.zeros(),
            standard_error: self.zeros(),
        };
        for entry in &response {
            let at = (entry.output, self.active[entry.input]);
            estimate.value[at] = entry.value.re;
            estimate.standard_error[at] = self.information.standard_error(&entry.gradient_re);
        }
        estimate
    }

    /// Standard errors of the frequency response at these frequencies, in radians per sample.
    pub fn frequency_response_error(&self, omega: &[f64]) -> Vec<ResponseError> {
        let at = omega.iter().map(|&frequency| {
            let mut error = ResponseError {
                frequency,
                response: Mat::zeros(self.layout.p, self.inputs),
                complex: self.zeros(),
                magnitude: self.zeros(),
            };
            for entry in self.at(c64::new(frequency.cos(), frequency.sin())) {
                let at = (entry.output, self.active[entry.input]);
                let re = self.information.standard_error(&entry.gradient_re);
                let im = self.information.standard_error(&entry.gradient_im);
                error.response[at] = entry.value;
                error.complex[at] = re.hypot(im);
                let size = entry.value.re.hypot(entry.value.im);
                error.magnitude[at] = if size > 0.0 {
                    let mut along = vec![0.0; entry.gradient_re.len()];
                    add_scaled(&mut along, entry.value.re / size, &entry.gradient_re);
                    add_scaled(&mut along, entry.value.im / size, &entry.gradient_im);
                    self.information.standard_error(&along)
                } else {
                    error.complex[at]
                };
            }
            error
        });
        at.collect()
    }

    /// t-values of D, p×M, when every active input may have feedthrough (for columns that are fixed
    /// at zero: one Gauss-Newton step with them free). Zero where D is not identified.
    pub fn feedthrough_t(&self) -> Mat<f64> {
        self.spread(&self.feedthrough.1)
    }

    /// D, p×M, when every active input may have feedthrough.
    pub fn free_feedthrough(&self) -> Mat<f64> {
        self.spread(&self.feedthrough.0)
    }

    fn spread(&self, active: &Mat<f64>) -> Mat<f64> {
        let mut all = self.zeros();
        for (position, &j) in self.active.iter().enumerate() {
            all.col_mut(j).copy_from(active.col(position));
        }
        all
    }

    fn zeros(&self) -> Mat<f64> {
        Mat::zeros(self.layout.p, self.inputs)
    }

    /// `G(z) = C (zI − A)⁻¹ B + D` and its derivatives
    /// `dG = C N dA N B + C N dB + dC N B + dD`, N = (zI − A)⁻¹.
    fn at(&self, z: c64) -> Vec<Response> {
        let (model, n) = (&self.model, self.layout.n);
        let complex = |m: &Mat<f64>| {
            Mat::<c64>::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0))
        };
        let mut resolvent = complex(&model.a);
        resolvent *= deepc_core::faer::Scale(c64::new(-1.0, 0.0));
        (0..n).for_each(|i| resolvent[(i, i)] += z);
        let solver = resolvent.partial_piv_lu();
        let right = solver.solve(complex(&model.b));
        let transposed = resolvent.transpose().partial_piv_lu();
        let left = transposed
            .solve(complex(&model.c).transpose())
            .transpose()
            .to_owned();
        let entries = self.layout.entries();
        let mut responses = Vec::new();
        for l in 0..self.layout.p {
            for j in 0..self.layout.inputs {
                let mut value = c64::new(model.d[(l, j)], 0.0);
                for i in 0..n {
                    value += right[(i, j)] * c64::new(model.c[(l, i)], 0.0);
                }
                let gradient = entries.iter().map(|&entry| match entry {
                    Entry::A(i, h) => left[(l, i)] * right[(h, j)],
                    Entry::B(i, input) if input == j => left[(l, i)],
                    Entry::C(output, h) if output == l => right[(h, j)],
                    Entry::D(output, input) if (output, input) == (l, j) => c64::new(1.0, 0.0),
                    _ => c64::new(0.0, 0.0),
                });
                let (gradient_re, gradient_im) = gradient.map(|g| (g.re, g.im)).unzip();
                responses.push(Response {
                    output: l,
                    input: j,
                    value,
                    gradient_re,
                    gradient_im,
                });
            }
        }
        responses
    }
}

/// One entry of a response with its derivatives by all free entries.
struct Response {
    output: usize,
    input: usize,
    value: c64,
    gradient_re: Vec<f64>,
    gradient_im: Vec<f64>,
}

/// What the data say about the parameters.
#[derive(Debug, Clone)]
struct Information {
    to_full: Mat<f64>,
    svd: ThinSvd,
    seen: usize,
    /// Uᵀ r.
    right: Vec<f64>,
    /// Scores over directions of the singular value decomposition, if the sandwich is needed.
    scores: Option<Mat<f64>>,
    /// Allows for the parameters that were fitted.
    inflation: f64,
}

impl Information {
    fn new(
        packed: &Packed,
        model: &SystemMatrices,
        run: &Evaluation,
        layout: &Layout,
        coloured: bool,
    ) -> Result<Self, SysidError> {
        let span = coloured.then(|| (packed.samples() / SPANS).max(1));
        let linear = linearise(packed, model, run, layout, span)?;
        let svd = thin_svd(linear.triangle.as_ref(), "the information matrix")?;
        let seen = svd.rank(SEEN);
        let right = (0..seen)
            .map(|j| {
                let u = svd.u.col_as_slice(j).iter();
                u.zip(&linear.right).map(|(u, r)| u * r).sum()
            })
            .collect();
        let numbers = (packed.samples() * layout.p) as f64;
        let free = linear.to_full.ncols() as f64;
        Ok(Self {
            scores: coloured.then(|| &linear.scores * svd.v.subcols(0, seen)),
            inflation: (numbers / (numbers - free).max(1.0)).sqrt(),
            to_full: linear.to_full,
            svd,
            seen,
            right,
        })
    }

    /// Of a function with this gradient by all free entries.
    fn standard_error(&self, gradient: &[f64]) -> f64 {
        let local: Vec<f64> = (0..self.to_full.ncols())
            .map(|j| {
                let column = self.to_full.col_as_slice(j).iter();
                column.zip(gradient).map(|(a, b)| a * b).sum()
            })
            .collect();
        let mut along: Vec<f64> = (0..self.seen)
            .map(|j| {
                let column = self.svd.v.col_as_slice(j).iter();
                column.zip(&local).map(|(a, b)| a * b).sum()
            })
            .collect();
        let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let unseen = size(&local) - size(&along);
        if self.seen < local.len() && unseen > LEANS * LEANS * size(&local) {
            return f64::INFINITY;
        }
        for (along, value) in along.iter_mut().zip(&self.svd.values) {
            *along /= value;
        }
        let deviation = match &self.scores {
            None => size(&along).sqrt(),
            Some(scores) => {
                for (along, value) in along.iter_mut().zip(&self.svd.values) {
                    *along /= value;
                }
                let mut sums = vec![0.0; scores.nrows()];
                add_product(&mut sums, scores, &along);
                let spans = scores.nrows() as f64;
                (size(&sums) * spans / (spans - 1.0).max(1.0)).sqrt()
            }
        };
        deviation * self.inflation
    }
}

/// D after one Gauss-Newton step with all columns free, and its t-values.
fn free_feedthrough(
    packed: &Packed,
    model: &SystemMatrices,
    run: &Evaluation,
    layout: &Layout,
    coloured: bool,
) -> Result<(Mat<f64>, Mat<f64>), SysidError> {
    let information = Information::new(packed, model, run, layout, coloured)?;
    let mut local = vec![0.0; information.to_full.ncols()];
    for (j, (r, value)) in information
        .right
        .iter()
        .zip(&information.svd.values)
        .enumerate()
    {
        add_scaled(&mut local, -r / value, information.svd.v.col_as_slice(j));
    }
    let mut change = vec![0.0; information.to_full.nrows()];
    add_product(&mut change, &information.to_full, &local);
    let mut d = model.d.clone();
    let mut t = Mat::zeros(layout.p, layout.inputs);
    let entries = layout.entries();
    let mut gradient = vec![0.0; entries.len()];
    for (index, &entry) in entries.iter().enumerate() {
        if let Entry::D(l, j) = entry {
            d[(l, j)] += change[index];
            gradient[index] = 1.0;
            let error = information.standard_error(&gradient);
            gradient[index] = 0.0;
            t[(l, j)] = if error > 0.0 { d[(l, j)] / error } else { 0.0 };
        }
    }
    Ok((d, t))
}

/// The multivariate portmanteau test (Hosking 1980): `N Σ tr(RᵀR)` over the lags, R the
/// autocovariances of the whitened innovations, against χ² with p² degrees of freedom per lag
/// (quantile by Wilson and Hilferty 1931).
fn is_white(packed: &Packed, run: &Evaluation) -> bool {
    let p = packed.outputs;
    let samples = packed.samples() as f64;
    let whitened: Vec<Vec<f64>> = run
        .innovations
        .iter()
        .map(|series| {
            let mut white = vec![0.0; series.len()];
            for (white, e) in white.chunks_exact_mut(p).zip(series.chunks_exact(p)) {
                add_product(white, &run.whitening, e);
            }
            white
        })
        .collect();
    let lags = LAGS.min(packed.longest() / 4);
    if lags == 0 {
        return true;
    }
    let mut statistic = 0.0;
    for lag in 1..=lags {
        let mut covariance = vec![0.0; p * p];
        for series in &whitened {
            let later = series.chunks_exact(p).skip(lag);
            for (now, then) in later.zip(series.chunks_exact(p)) {
                for (i, now) in now.iter().enumerate() {
                    add_scaled(&mut covariance[i * p..(i + 1) * p], *now, then);
                }
            }
        }
        let squares = covariance.iter().map(|c| (c / samples).powi(2));
        statistic += samples * squares.sum::<f64>();
    }
    let freedom = (p * p * lags) as f64;
    let part = 2.0 / (9.0 * freedom);
    let limit = freedom * (1.0 - part + WHITENESS_QUANTILE * part.sqrt()).powi(3);
    statistic <= limit
}

#[cfg(test)]
mod tests;
