//! A pole on a cart, unstable and nonlinear, held upright and moved with a bounded force.
//!
//! Left alone it falls within a second, so it is recorded under a feedback that holds it, with a
//! force shaken on top. The shaking must stand out: what the feedback does by itself follows from
//! the past and excites nothing, and in data it makes noise look like the plant's doing.
//!
//! `cargo run --release -p deepc-core --example inverted_pendulum`

use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::DeepcSettings;
use deepc_core::program::{Bounds, OutputBounds, ProgramOptions, Regularisation, Slack};
use deepc_core::solver::SolveBudget;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Position and speed of a cart of 1 kg, angle and rate of a pole of 0.1 kg and 1 m (m, s, rad).
/// Equations: Barto, Sutton, Anderson, IEEE Trans. Systems, Man, and Cybernetics 13(5), 1983.
fn step(x: &mut [f64; 4], force_n: f64, mut noise: impl FnMut() -> f64) -> [f64; 2] {
    for _ in 0..50 {
        let (sin, cos) = x[2].sin_cos();
        let push = (force_n + 0.05 * x[3] * x[3] * sin) / 1.1;
        let angular = (9.81 * sin - cos * push) / (0.5 * (4.0 / 3.0 - 0.1 * cos * cos / 1.1));
        let rates = [x[1], push - 0.05 * angular * cos / 1.1, x[3], angular];
        (0..4).for_each(|i| x[i] += 0.001 * rates[i]);
    }
    [x[0], x[2]].map(|y| y + noise())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let hold = |x: &[f64; 4]| 3.0 * x[0] + 4.5 * x[1] + 40.0 * x[2] + 11.0 * x[3];
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (shake, noise) = (Normal::new(0.0, 4.0)?, Normal::new(0.0, 3e-4)?);
    let (mut x, mut inputs, mut outputs) = ([0.0; 4], Vec::new(), Vec::new());
    for _ in 0..600 {
        let force = hold(&x) + shake.sample(&mut rng);
        inputs.push(force);
        outputs.extend(step(&mut x, force, || noise.sample(&mut rng)));
    }
    let mut data = Dataset::new(0.05, ["force_n"], ["position_m", "angle_rad"])?;
    data.push_rows(&inputs, &outputs)?;
    let hankel = HankelMatrix::build(&data, Horizons::new(10, 20))?;
    let predictor = Predictor::compact(&hankel.require_persistently_exciting(4)?);
    let settings = DeepcSettings {
        input_weights: vec![1e-3],
        output_weights: vec![1.0; 2],
        regularisation: Regularisation::projection(0.1),
        input_slack: Slack::Hard,
        output_slack: Slack::Penalty(1e4), // an unstable plant forgives no loose past: try 1e2
        input_bounds: vec![Bounds::between(-5.0, 5.0)],
        output_bounds: vec![
            OutputBounds::none(),
            OutputBounds::soft(-0.1, 0.1, 10.0, 10.0),
        ],
        options: ProgramOptions::default(),
    };
    let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
    let mut controller = DeepcController::condensed(&predictor, &settings, horizon)?;
    let mut reference = controller.new_reference();
    reference.hold(&[0.0], &[0.5, 0.0])?;
    for k in 0..120 {
        let decided = controller.decide(&reference).input[0];
        let force = if k < 15 { hold(&x) } else { decided }; // it watches first
        let y = step(&mut x, force, || noise.sample(&mut rng));
        controller.observe(&[force], &y);
        if k % 5 == 0 {
            let (t_s, origin) = (0.05 * f64::from(k), controller.step().origin);
            println!("{t_s:4.2} s  {force:5.2} N  [m, rad] {y:6.3?}  {origin:?}");
        }
    }
    let off_m = (x[0] - 0.5).abs();
    println!("goal: upright at most 1 cm from 0.5 m in the end; reached {off_m:.4} m");
    (off_m < 0.01).then_some(()).ok_or("goal missed".into())
}
