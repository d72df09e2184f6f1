//! A linear MPC written down anew: dense matrices of its own, Clarabel, the true state.

use deepc_core::faer::{Col, Mat};
use deepc_core::solver::{
    ClarabelSettings, ClarabelSolver, QpMatrix, QpProblem, QpSolver, QpVectors, SoftPenalty,
    SolveBudget,
};
use sysid::SystemMatrices;
use sysid::lmpc::LmpcSettings;

/// min over the stacked inputs U (channel by channel within a step), outputs Y = F x + H U + P d.
pub struct Textbook {
    matrices: SystemMatrices,
    steps: usize,
    settings: LmpcSettings,
    /// H, 2N×2N.
    h: Mat<f64>,
    /// Differences ΔU = T U − (u(−1), 0, …).
    t: Mat<f64>,
    solver: ClarabelSolver,
}

impl Textbook {
    pub fn new(matrices: SystemMatrices, settings: &LmpcSettings, steps: usize) -> Self {
        // Column j of H: the answer to a unit pulse in entry j.
        let mut h = Mat::zeros(2 * steps, 2 * steps);
        for j in 0..2 * steps {
            let mut x: Col<f64> = Col::zeros(3);
            for k in 0..steps {
                let pulse = |i: usize| if 2 * k + i == j { 1.0 } else { 0.0 };
                let u = Col::from_fn(3, |i| if i < 2 { pulse(i) } else { 0.0 });
                let y = &matrices.c * &x + &matrices.d * &u;
                (h[(2 * k, j)], h[(2 * k + 1, j)]) = (y[0], y[1]);
                x = &matrices.a * &x + &matrices.b * &u;
            }
        }
        let t = Mat::from_fn(2 * steps, 2 * steps, |i, j| {
            f64::from(u8::from(i == j)) - f64::from(u8::from(i == j + 2))
        });
        let diagonal = |weights: &[f64]| {
            let weights = [weights[0], weights[1]];
            Mat::from_fn(2 * steps, 2 * steps, |i, j| {
                if i == j { weights[i % 2] } else { 0.0 }
            })
        };
        let q = diagonal(&settings.output_weights);
        let r = diagonal(&settings.input_weights);
        let s = diagonal(&settings.options.input_change_weights);
        let mut hessian = h.transpose() * q * &h + r + t.transpose() * s * &t;
        hessian *= deepc_core::faer::Scale(2.0);
        let hessian = Mat::from_fn(2 * steps, 2 * steps, |i, j| {
            f64::midpoint(hessian[(i, j)], hessian[(j, i)])
        });
        // Rows: U, then the first output.
        let rows = Mat::from_fn(3 * steps, 2 * steps, |i, j| {
            match i.checked_sub(2 * steps) {
                None => f64::from(u8::from(i == j)),
                Some(k) => h[(2 * k, j)],
            }
        });
        let penalty = SoftPenalty {
            linear: 100.0,
            quadratic: 10.0,
        };
        let mut soft = vec![None; 2 * steps];
        soft.extend(vec![Some(penalty); steps]);
        let problem =
            QpProblem::new(QpMatrix::Dense(hessian), QpMatrix::Dense(rows), soft).unwrap();
        let tight = ClarabelSettings { tolerance: 1e-10 };
        Self {
            solver: ClarabelSolver::new(&problem, tight).unwrap(),
            matrices,
            steps,
            settings: settings.clone(),
            h,
            t,
        }
    }

    /// The first input for the state, u(−1), the preview of the disturbance and held references;
    /// whether bounds on inputs and on the output are active.
    pub fn decide(
        &mut self,
        state: &Col<f64>,
        last: [f64; 2],
        preview: f64,
        references: ([f64; 2], [f64; 2]),
    ) -> ([f64; 2], [bool; 2]) {
        let (steps, settings) = (self.steps, &self.settings);
        let mut free = Col::zeros(2 * steps);
        let mut x = state.clone();
        for k in 0..steps {
            let u = Col::from_fn(3, |i| if i == 2 { preview } else { 0.0 });
            let y = &self.matrices.c * &x + &self.matrices.d * &u;
            (free[2 * k], free[2 * k + 1]) = (y[0], y[1]);
            x = &self.matrices.a * &x + &self.matrices.b * &u;
        }
        let (u_r, y_r) = references;
        let error = Col::from_fn(2 * steps, |i| {
            settings.output_weights[i % 2] * (free[i] - y_r[i % 2])
        });
        let changes = Col::from_fn(2 * steps, |i| {
            let start = if i < 2 { last[i] } else { 0.0 };
            -settings.options.input_change_weights[i % 2] * start
        });
        let pull = Col::from_fn(2 * steps, |i| -settings.input_weights[i % 2] * u_r[i % 2]);
        let gradient = self.h.transpose() * error + self.t.transpose() * changes + pull;
        let linear: Vec<f64> = (0..2 * steps).map(|i| 2.0 * gradient[i]).collect();
        let side = |upper: bool| -> Vec<f64> {
            let pick = |lower: f64, above: f64| if upper { above } else { lower };
            let inputs = (0..2 * steps).map(|i| {
                let bounds = &settings.input_bounds[i % 2];
                pick(bounds.lower_value(), bounds.upper_value())
            });
            let outputs = (0..steps).map(|k| {
                let bounds = &settings.output_bounds[0].bounds;
                pick(bounds.lower_value(), bounds.upper_value()) - free[2 * k]
            });
            inputs.chain(outputs).collect()
        };
        let (lower, upper) = (side(false), side(true));
        self.solver
            .update(QpVectors {
                linear: &linear,
                lower: &lower,
                upper: &upper,
            })
            .unwrap();
        let solution = self.solver.solve(&SolveBudget::generous());
        assert!(solution.status.is_usable(), "{:?}", solution.status);
        let pushes = |range: std::ops::Range<usize>| {
            solution.dual[range]
                .iter()
                .any(|multiplier| multiplier.abs() > 1e-4)
        };
        let active = [pushes(0..2 * steps), pushes(2 * steps..3 * steps)];
        ([solution.primal[0], solution.primal[1]], active)
    }
}
