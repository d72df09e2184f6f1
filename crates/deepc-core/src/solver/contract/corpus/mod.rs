//! Quadratic programs with known answers, for all back ends.

mod generated;

use faer::{Mat, mat};

pub use generated::moving_problem;

use crate::solver::{QpMatrix, QpProblem, QpStatus, QpVectors, SoftPenalty};

const INF: f64 = f64::INFINITY;

/// What a solve should find.
#[derive(Debug, Clone)]
pub enum Expected {
    /// This optimum, worked out by hand.
    Optimum {
        /// x.
        primal: Vec<f64>,
        /// ½xᵀPx + qᵀx + penalties.
        objective: f64,
    },
    /// An optimum, shown by its certificate.
    Certified,
    /// No optimum, and why.
    Status(QpStatus),
}

/// One program with its vectors.
#[derive(Debug, Clone)]
pub struct CorpusProblem {
    /// What it is about.
    pub name: &'static str,
    /// Whether its Hessian is only semidefinite.
    pub semidefinite: bool,
    /// The constant part.
    pub problem: QpProblem,
    /// q.
    pub linear: Vec<f64>,
    /// l.
    pub lower: Vec<f64>,
    /// u.
    pub upper: Vec<f64>,
    /// What should come out.
    pub expected: Expected,
}

impl CorpusProblem {
    /// Its vectors.
    #[must_use]
    pub fn vectors(&self) -> QpVectors<'_> {
        QpVectors {
            linear: &self.linear,
            lower: &self.lower,
            upper: &self.upper,
        }
    }
}

/// A program under construction.
struct Draft {
    name: &'static str,
    hessian: Mat<f64>,
    linear: Vec<f64>,
    rows: Mat<f64>,
    bounds: Vec<(f64, f64)>,
    soft: Vec<Option<SoftPenalty>>,
}

impl Draft {
    fn hard(
        name: &'static str,
        hessian: Mat<f64>,
        linear: &[f64],
        rows: Mat<f64>,
        bounds: &[(f64, f64)],
    ) -> Self {
        Self {
            name,
            hessian,
            linear: linear.to_vec(),
            soft: vec![None; rows.nrows()],
            rows,
            bounds: bounds.to_vec(),
        }
    }

    /// min ½(x − 2)² (but for the constant) with one soft row l ≤ x ≤ u.
    fn soft(name: &'static str, bounds: (f64, f64), linear: f64, quadratic: f64) -> Self {
        let mut draft = Self::hard(name, mat![[1.0]], &[-2.0], mat![[1.0]], &[bounds]);
        draft.soft = vec![Some(SoftPenalty { linear, quadratic })];
        draft
    }

    fn expecting(self, expected: Expected) -> CorpusProblem {
        let rows = QpMatrix::Dense(self.rows);
        let problem = QpProblem::new(QpMatrix::Dense(self.hessian), rows, self.soft)
            .expect("corpus problems are well formed");
        CorpusProblem {
            name: self.name,
            semidefinite: false,
            problem,
            linear: self.linear,
            lower: self.bounds.iter().map(|b| b.0).collect(),
            upper: self.bounds.iter().map(|b| b.1).collect(),
            expected,
        }
    }

    fn at(self, primal: &[f64], objective: f64) -> CorpusProblem {
        self.expecting(Expected::Optimum {
            primal: primal.to_vec(),
            objective,
        })
    }

    fn ends(self, status: QpStatus) -> CorpusProblem {
        self.expecting(Expected::Status(status))
    }
}

fn semidefinite(mut problem: CorpusProblem) -> CorpusProblem {
    problem.semidefinite = true;
    problem
}

/// All programs: those worked out by hand, then generated ones.
#[must_use]
pub fn corpus() -> Vec<CorpusProblem> {
    let mut all = hard_rows();
    all.extend(soft_rows());
    all.extend(awkward());
    all.extend(small_costs());
    for (name, n, seed) in [
        ("generated, 3 variables", 3, 1),
        ("generated, 8 variables", 8, 2),
        ("generated, 20 variables", 20, 3),
        ("generated, 40 variables", 40, 4),
    ] {
        all.push(generated::generated(name, n, seed));
    }
    all.extend(generated::special());
    all
}

fn hard_rows() -> Vec<CorpusProblem> {
    let two = || mat![[2.0, 0.0], [0.0, 2.0]];
    let eye = || Mat::identity(2, 2);
    vec![
        Draft::hard(
            "no rows",
            mat![[4.0, 1.0], [1.0, 2.0]],
            &[1.0, 1.0],
            Mat::zeros(0, 2),
            &[],
        )
        .at(&[-1.0 / 7.0, -3.0 / 7.0], -2.0 / 7.0),
        Draft::hard(
            "no finite bound",
            two(),
            &[-6.0, 2.0],
            eye(),
            &[(-INF, INF); 2],
        )
        .at(&[3.0, -1.0], -10.0),
        Draft::hard(
            "box",
            two(),
            &[-6.0, 2.0],
            eye(),
            &[(-1.0, 2.0), (-0.5, 5.0)],
        )
        .at(&[2.0, -0.5], -8.75),
        Draft::hard(
            "one-sided",
            two(),
            &[-6.0, 2.0],
            eye(),
            &[(-INF, 2.0), (-0.5, INF)],
        )
        .at(&[2.0, -0.5], -8.75),
        Draft::hard(
            "equality",
            Mat::identity(3, 3),
            &[0.0; 3],
            mat![[1.0, 1.0, 1.0]],
            &[(3.0, 3.0)],
        )
        .at(&[1.0, 1.0, 1.0], 1.5),
        Draft::hard(
            "equality and inequality",
            Mat::identity(2, 2),
            &[0.0, 0.0],
            mat![[1.0, 1.0], [1.0, 0.0]],
            &[(2.0, 2.0), (1.5, INF)],
        )
        .at(&[1.5, 0.5], 1.25),
        Draft::hard(
            "bound at the optimum",
            two(),
            &[-6.0, 2.0],
            eye(),
            &[(-INF, 3.0), (-1.0, 0.0)],
        )
        .at(&[3.0, -1.0], -10.0),
        Draft::hard(
            "contradicting rows",
            Mat::identity(2, 2),
            &[0.0, 0.0],
            mat![[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]],
            &[(-INF, 0.0), (1.0, INF), (1.0, INF)],
        )
        .ends(QpStatus::Infeasible),
        Draft::hard(
            "contradicting equalities",
            Mat::identity(2, 2),
            &[0.0, 0.0],
            mat![[1.0, 1.0], [2.0, 2.0]],
            &[(1.0, 1.0), (3.0, 3.0)],
        )
        .ends(QpStatus::Infeasible),
    ]
}

fn soft_rows() -> Vec<CorpusProblem> {
    vec![
        Draft::soft("linear penalty, large enough", (-INF, 1.0), 5.0, 0.0).at(&[1.0], -1.5),
        Draft::soft("linear penalty, too small", (-INF, 1.0), 0.25, 0.0).at(&[1.75], -1.781_25),
        Draft::soft("quadratic penalty", (-INF, 1.0), 0.0, 3.0).at(&[1.25], -1.625),
        Draft::soft("both penalties", (-INF, 1.0), 0.4, 1.0).at(&[1.3], -1.59),
        Draft::soft("both penalties, large enough", (-INF, 1.0), 4.0, 1.0).at(&[1.0], -1.5),
        Draft::soft("soft lower side", (3.0, INF), 0.25, 0.0).at(&[2.25], -1.781_25),
        Draft::soft("soft lower side, quadratic", (3.0, INF), 0.0, 1.0).at(&[2.5], -1.75),
        Draft::soft("soft equality", (0.0, 0.0), 0.5, 0.0).at(&[1.5], -1.125),
        Draft::soft("soft row that holds", (-INF, 2.5), 0.1, 0.1).at(&[2.0], -2.0),
        Draft::soft("very large linear penalty", (-INF, 1.0), 1e8, 0.0).at(&[1.0], -1.5),
        Draft::soft("very large quadratic penalty", (-INF, 1.0), 0.0, 1e8)
            .at(&[1.0 + 1.0 / (1.0 + 1e8)], -1.5),
        soft_against_hard(),
    ]
}

/// A soft row yields to a hard one: min ½x² + ½y², x + y ≥ 4 soft (ρ = 1), x ≤ 0.25 hard.
/// At the optimum μ = ρ = 1, so y = 1 and x would be 1: held at 0.25, s = 2.75.
fn soft_against_hard() -> CorpusProblem {
    let mut draft = Draft::hard(
        "soft row against a hard one",
        Mat::identity(2, 2),
        &[0.0, 0.0],
        mat![[1.0, 1.0], [1.0, 0.0]],
        &[(4.0, INF), (-INF, 0.25)],
    );
    draft.soft[0] = Some(SoftPenalty {
        linear: 1.0,
        quadratic: 0.0,
    });
    draft.at(&[0.25, 1.0], 0.031_25 + 0.5 + 2.75)
}

fn awkward() -> Vec<CorpusProblem> {
    vec![
        Draft::hard(
            "the same row three times",
            mat![[2.0, 0.0], [0.0, 2.0]],
            &[-6.0, 2.0],
            mat![[1.0, 0.0], [1.0, 0.0], [10.0, 0.0]],
            &[(-INF, 2.0), (-1.0, 2.0), (-INF, 20.0)],
        )
        .at(&[2.0, -1.0], -9.0),
        Draft::hard(
            "four rows through one corner",
            Mat::identity(2, 2),
            &[-5.0, -5.0],
            mat![[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 2.0]],
            &[(-INF, 1.0), (-INF, 1.0), (-INF, 2.0), (-INF, 3.0)],
        )
        .at(&[1.0, 1.0], -9.0),
        Draft::hard(
            "a row of zeros that holds",
            mat![[1.0]],
            &[-2.0],
            mat![[0.0], [1.0]],
            &[(-1.0, 1.0), (-INF, 1.0)],
        )
        .at(&[1.0], -1.5),
        Draft::hard(
            "a row of zeros that cannot hold",
            mat![[1.0]],
            &[-2.0],
            mat![[0.0]],
            &[(1.0, 2.0)],
        )
        .ends(QpStatus::Infeasible),
        Draft::hard(
            "variables of 1e6 and 1e-6",
            mat![[1e-12, 0.0], [0.0, 1e12]],
            &[-2e-6, -1e6],
            mat![[1e-6, 0.0], [0.0, 1e6]],
            &[(-INF, 1.0), (-INF, 2.0)],
        )
        .at(&[1e6, 1e-6], -2.0),
        Draft::hard(
            "rows of 1e6 and 1e-6",
            Mat::identity(2, 2),
            &[-2.0, -2.0],
            mat![[1e6, 0.0], [0.0, 1e-6]],
            &[(-INF, 1e6), (-INF, 1e-6)],
        )
        .at(&[1.0, 1.0], -3.0),
        semidefinite(
            Draft::hard(
                "flat direction",
                mat![[1.0, 0.0], [0.0, 0.0]],
                &[-1.0, 1.0],
                Mat::identity(2, 2),
                &[(-INF, INF), (0.0, INF)],
            )
            .at(&[1.0, 0.0], -0.5),
        ),
        semidefinite(
            Draft::hard(
                "no lower end",
                mat![[0.0]],
                &[-1.0],
                mat![[1.0]],
                &[(0.0, INF)],
            )
            .ends(QpStatus::Unbounded),
        ),
    ]
}

/// Costs of 1e-8 and far below: `Solved` must mean as much as for costs of 1.
fn small_costs() -> Vec<CorpusProblem> {
    let mut dear = Draft::hard(
        "small weights, soft",
        mat![[1e-14]],
        &[-2e-14],
        mat![[1.0]],
        &[(-INF, 1.0)],
    );
    dear.soft[0] = Some(SoftPenalty {
        linear: 0.4e-14,
        quadratic: 1e-14,
    });
    vec![
        Draft::hard(
            "small weights",
            mat![[2e-8, 0.0], [0.0, 2e-8]],
            &[-6e-8, 2e-8],
            Mat::identity(2, 2),
            &[(-1.0, 2.0), (-0.5, 5.0)],
        )
        .at(&[2.0, -0.5], -8.75e-8),
        Draft::hard(
            "small q and bounds",
            mat![[2.0, 0.0], [0.0, 2.0]],
            &[-6e-5, 2e-5],
            Mat::identity(2, 2),
            &[(-1e-5, 2e-5), (-0.5e-5, 5e-5)],
        )
        .at(&[2e-5, -0.5e-5], -8.75e-10),
        Draft::hard(
            "small equality",
            Mat::identity(3, 3),
            &[0.0; 3],
            mat![[1.0, 1.0, 1.0]],
            &[(3e-5, 3e-5)],
        )
        .at(&[1e-5, 1e-5, 1e-5], 1.5e-10),
        dear.at(&[1.3], -1.59e-14),
        Draft::hard(
            "no cost at the optimum",
            Mat::identity(2, 2),
            &[-1e-5, 1e-5],
            Mat::identity(2, 2),
            &[(-1e-5, 0.0), (0.0, 1e-5)],
        )
        .at(&[0.0, 0.0], 0.0),
        Draft::hard(
            "nothing to do",
            Mat::identity(2, 2),
            &[0.0, 0.0],
            Mat::identity(2, 2),
            &[(-1.0, 1.0), (0.0, 1.0)],
        )
        .at(&[0.0, 0.0], 0.0),
    ]
}
