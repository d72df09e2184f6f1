//! The same noisy recording under every regulariser, judged by the errors of the closed loop.
//! `cargo run --release -p deepc-core --example regularisers`

use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{Bounds, OutputBounds, ProgramOptions, Regularisation, Slack};
use deepc_core::program::{DeepcSettings, PredictiveProgram, SparseProgram};
use deepc_core::solver::{ClarabelSettings, ClarabelSolver, SolveBudget};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

fn step(x: &mut [f64; 2], u: &[f64]) -> [f64; 2] {
    let [a, b] = *x;
    x[0] = 0.95 * a + 0.2 * b + 0.05 * u[0];
    x[1] = 0.85 * b - 0.2 * a + 0.1 * u[1];
    *x
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (shake, noise) = (Normal::new(0.0, 1.0)?, Normal::new(0.0, 0.05)?);
    let (mut x, mut inputs, mut outputs, mut best) = ([0.0; 2], vec![], vec![], f64::INFINITY);
    for _ in 0..120 {
        let u = [(); 2].map(|()| shake.sample(&mut rng));
        outputs.extend(step(&mut x, &u).map(|y| y + noise.sample(&mut rng)));
        inputs.extend(u);
    }
    let mut data = Dataset::new(0.1, ["u_1", "u_2"], ["y_1", "y_2"])?;
    data.push_rows(&inputs, &outputs)?;
    let hankel = HankelMatrix::build(&data, Horizons::new(4, 10))?;
    let predictor = Predictor::full(&hankel.require_persistently_exciting(2)?);
    for (name, regularisation) in [
        ("none", Regularisation::none()),
        ("squared 2-norm", Regularisation::per_column(0.004)),
        ("1-norm", Regularisation::one_norm(0.3)),
        ("squared projection", Regularisation::projection(0.1)),
        ("gamma-DDPC", Regularisation::gamma(1e-3, Some(1.0))),
        ("least squares (SPC)", Regularisation::spc()),
    ] {
        let settings = DeepcSettings {
            input_weights: vec![0.05; 2],
            output_weights: vec![1.0; 2],
            regularisation,
            input_slack: Slack::Hard,
            output_slack: Slack::Penalty(1e4),
            input_bounds: vec![Bounds::between(-3.0, 3.0); 2],
            output_bounds: vec![OutputBounds::none(); 2],
            options: ProgramOptions::default(),
        };
        let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
        let mut controller = if name == "1-norm" {
            let program = SparseProgram::new(&predictor, &settings)?;
            let solver = ClarabelSolver::new(program.qp(), ClarabelSettings::default())?;
            DeepcController::new(Box::new(program), Box::new(solver), horizon)?
        } else {
            DeepcController::condensed(&predictor, &settings, horizon)?
        };
        let mut reference = controller.new_reference();
        reference.hold(&[0.5; 2], &[1.0, 0.0])?;
        let (mut x, mut cost, mut rng) = ([0.0; 2], 0.0, ChaCha8Rng::seed_from_u64(7));
        for _ in 0..60 {
            let u = controller.decide(&reference).input.clone();
            let y = step(&mut x, &u);
            controller.observe(&u, &y.map(|y| y + noise.sample(&mut rng)));
            cost += (y[0] - 1.0).powi(2) + y[1].powi(2);
        }
        println!("{name:20} squared errors {cost:5.1}");
        best = cost.min(best);
    }
    println!("goal: at most 9 for the best; reached {best:.1}");
    (best < 9.0).then_some(()).ok_or("goal missed".into())
}
