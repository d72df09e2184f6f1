//! Two pumps fill four coupled tanks, nonlinear and measured with noise; `DeePC` moves the levels
//! of the lower two. Model and minimum-phase setting: K. H. Johansson, "The quadruple-tank
//! process", IEEE Trans. Control Systems Technology 8(3), 2000.
//!
//! `cargo run --release -p deepc-core --example four_tank`

use deepc_core::controller::{Controller, DeepcController, RecedingHorizonSettings};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::DeepcSettings;
use deepc_core::program::{Bounds, OutputBounds, ProgramOptions, Regularisation, Slack};
use deepc_core::solver::SolveBudget;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};

/// Levels at rest, cm. What is recorded and controlled are deviations from them and from 3 V.
const REST_CM: [f64; 4] = [12.263, 12.783, 1.634, 1.409];
const HOLES_CM2: [f64; 4] = [0.071, 0.057, 0.071, 0.057];

/// Holds the pump voltages for 5 s; returns the lower levels. `DeePC` never sees this.
fn step(h: &mut [f64; 4], volts: &[f64], mut noise_cm: impl FnMut() -> f64) -> [f64; 2] {
    let [q1, q2] = [3.33 * (3.0 + volts[0]), 3.35 * (3.0 + volts[1])]; // cm³/s
    for _ in 0..50 {
        let out = [0, 1, 2, 3].map(|i| HOLES_CM2[i] * (2.0 * 981.0 * h[i].max(0.0)).sqrt());
        h[0] += 0.1 * (0.7 * q1 + out[2] - out[0]) / 28.0;
        h[1] += 0.1 * (0.6 * q2 + out[3] - out[1]) / 32.0;
        h[2] += 0.1 * (0.4 * q2 - out[2]) / 28.0;
        h[3] += 0.1 * (0.3 * q1 - out[3]) / 32.0;
    }
    [0, 1].map(|i| h[i] - REST_CM[i] + noise_cm())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (shake, noise_cm) = (Uniform::new(-2.0, 2.0)?, Normal::new(0.0, 0.02)?);
    let (mut h, mut inputs, mut outputs) = (REST_CM, Vec::new(), Vec::new());
    for _ in 0..600 {
        let volts = [(); 2].map(|()| shake.sample(&mut rng));
        outputs.extend(step(&mut h, &volts, || noise_cm.sample(&mut rng)));
        inputs.extend(volts);
    }
    let mut data = Dataset::new(5.0, ["pump_1", "pump_2"], ["level_1", "level_2"])?;
    data.push_rows(&inputs, &outputs)?;
    let hankel = HankelMatrix::build(&data, Horizons::new(8, 30))?;
    print!("{}", hankel.excitation(4)?);
    let predictor = Predictor::compact(&hankel.require_persistently_exciting(4)?);
    let settings = DeepcSettings {
        input_weights: vec![0.01; 2],
        output_weights: vec![1.0; 2],
        regularisation: Regularisation::projection(1.0), // charges what noise explains only
        input_slack: Slack::Hard,                        // the pumps do what they are told
        output_slack: Slack::Penalty(1e3),
        input_bounds: vec![Bounds::between(-1.0, 1.0); 2],
        output_bounds: vec![OutputBounds::soft(-1.2, 2.2, 10.0, 10.0); 2],
        options: ProgramOptions::default(),
    };
    let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
    let mut controller = DeepcController::condensed(&predictor, &settings, horizon)?;
    let mut reference = controller.new_reference();
    reference.hold(&[0.0; 2], &[2.0, -1.0])?;
    for k in 0..40 {
        let volts = controller.decide(&reference).input.clone();
        let levels = step(&mut h, &volts, || noise_cm.sample(&mut rng));
        controller.observe(&volts, &levels);
        let origin = controller.step().origin;
        println!(
            "{:3} s  pumps {volts:5.2?} V  levels {levels:5.2?} cm  {origin:?}",
            5 * k
        );
    }
    let off_cm = (h[0] - REST_CM[0] - 2.0).hypot(h[1] - REST_CM[1] + 1.0);
    println!("goal: at most 0.1 cm from levels [2, -1] in the end; reached {off_cm:.3} cm");
    let met = off_cm < 0.1;
    met.then_some(()).ok_or("goal missed".into())
}
