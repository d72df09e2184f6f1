//! The optima of `tests/reference`, which four other solvers agree on.

use crate::common;
use common::Solved;

use std::path::PathBuf;

use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, CondensedProgram, DeepcSettings, Moment, OutputBounds, PredictiveProgram,
    ProgramOptions, Regularisation, Slack, SparseProgram,
};
use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, ClarabelSettings, ClarabelSolver, QpSolver, SolveBudget,
};
use faer::Mat;
use serde::Deserialize;

#[derive(Debug, Deserialize)]
struct Expected {
    m: usize,
    p: usize,
    #[serde(rename = "Tini")]
    past: usize,
    #[serde(rename = "N")]
    future: usize,
    cols: usize,
    rows: usize,
    lam_g: f64,
    lam_y: f64,
    q: f64,
    r: f64,
    ub: f64,
    yb: f64,
    objective: f64,
    u0: Vec<f64>,
    u_sum: f64,
    y_last: Vec<f64>,
}

struct Case {
    name: String,
    expected: Expected,
    data: Dataset,
    past_inputs: Mat<f64>,
    past_outputs: Mat<f64>,
    output_reference: Mat<f64>,
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/reference")
}

fn series(file: &str) -> Mat<f64> {
    let reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_path(folder().join(file));
    let rows: Vec<Vec<f64>> = reader.unwrap().deserialize().map(Result::unwrap).collect();
    Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn cases() -> Vec<Case> {
    let text = std::fs::read_to_string(folder().join("expected.json")).unwrap();
    let all: std::collections::BTreeMap<String, Expected> = serde_json::from_str(&text).unwrap();
    assert_eq!(all.len(), 4);
    all.into_iter()
        .map(|(name, expected)| {
            let set = name.split('_').next().unwrap().to_owned();
            let inputs = series(&format!("{set}_ud.csv"));
            let outputs = series(&format!("{set}_yd.csv"));
            Case {
                data: common::dataset(vec![(inputs, outputs)]),
                past_inputs: series(&format!("{set}_u_ini.csv")),
                past_outputs: series(&format!("{set}_y_ini.csv")),
                output_reference: series(&format!("{set}_ref.csv")),
                name,
                expected,
            }
        })
        .collect()
}

impl Case {
    fn predictor(&self) -> Predictor {
        let Expected { past, future, .. } = self.expected;
        let hankel = HankelMatrix::build(&self.data, Horizons { past, future }).unwrap();
        assert_eq!(
            hankel.stacked().shape(),
            (self.expected.rows, self.expected.cols)
        );
        Predictor::full(&hankel.require_persistently_exciting(2).unwrap())
    }

    fn settings(&self) -> DeepcSettings {
        let e = &self.expected;
        DeepcSettings {
            input_weights: vec![e.r; e.m],
            output_weights: vec![e.q; e.p],
            regularisation: Regularisation::raw(e.lam_g),
            input_slack: Slack::Hard,
            output_slack: Slack::Penalty(e.lam_y),
            input_bounds: vec![Bounds::between(-e.ub, e.ub); e.m],
            output_bounds: vec![OutputBounds::hard(-e.yb, e.yb); e.p],
            options: ProgramOptions::default(),
        }
    }

    fn solve(&self, program: &mut dyn PredictiveProgram, solver: &mut dyn QpSolver) -> Solved {
        let input_reference = Mat::zeros(self.expected.future, self.expected.m);
        let moment = Moment {
            past_inputs: self.past_inputs.as_ref(),
            past_outputs: self.past_outputs.as_ref(),
            input_reference: input_reference.as_ref(),
            output_reference: self.output_reference.as_ref(),
            disturbances: None,
        };
        program
            .solve(&moment, solver, &SolveBudget::generous())
            .unwrap();
        Solved::of(program)
    }

    fn check(&self, form: &str, plan: &Solved) {
        let (e, name) = (&self.expected, &self.name);
        assert!(plan.is_usable(), "{name} {form}: {:?}", plan.status);
        let gap = (plan.objective - e.objective).abs() / e.objective;
        assert!(
            gap <= 1e-6,
            "{name} {form}: objective {} gap {gap:e}",
            plan.objective
        );
        for (i, &u0) in e.u0.iter().enumerate() {
            let error = (plan.inputs[(0, i)] - u0).abs();
            assert!(
                error <= 1e-5,
                "{name} {form}: first input {i} off by {error:e}"
            );
        }
        for (i, &y_last) in e.y_last.iter().enumerate() {
            let error = (plan.outputs[(e.future - 1, i)] - y_last).abs();
            assert!(
                error <= 1e-5,
                "{name} {form}: last output {i} off by {error:e}"
            );
        }
        assert!(
            (plan.inputs.sum() - e.u_sum).abs() <= 1e-4,
            "{name} {form}: sum of inputs"
        );
        println!(
            "{name} {form}: gap {gap:.1e}, residual {:.1e}, {:?}",
            plan.residual, plan.origin
        );
    }
}

#[test]
fn the_condensed_form_finds_the_reference_optima_with_every_solver() {
    for case in cases() {
        let settings = ClarabelSettings::default();
        let mut program = CondensedProgram::new(&case.predictor(), &case.settings()).unwrap();
        let mut direct = ClarabelSolver::new(program.qp(), settings).unwrap();
        case.check(
            "condensed, clarabel",
            &case.solve(&mut program, &mut direct),
        );
        let mut active = ActiveSet::new(program.qp(), ActiveSetSettings::default()).unwrap();
        case.check(
            "condensed, active set",
            &case.solve(&mut program, &mut active),
        );
    }
}

#[test]
fn the_sparse_form_finds_the_reference_optima() {
    for case in cases() {
        let mut program = SparseProgram::new(&case.predictor(), &case.settings()).unwrap();
        let mut direct = ClarabelSolver::new(program.qp(), ClarabelSettings::default()).unwrap();
        case.check("sparse, clarabel", &case.solve(&mut program, &mut direct));
    }
}
