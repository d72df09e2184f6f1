//! Control of a small plant with two inputs and two outputs, knowing only a recording of it.
//!
//! `cargo run --release -p deepc-core --example quick_start`

use deepc_core::controller::{DeepcController, Plant, PlantError};
use deepc_core::controller::{RecedingHorizonSettings, run_closed_loop};
use deepc_core::data::Dataset;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{Bounds, DeepcSettings, OutputBounds, Regularisation, Slack};
use deepc_core::solver::SolveBudget;

/// Two coupled tanks: pump rates in, levels out. The controller never sees these equations.
struct Tanks([f64; 2]);

impl Plant for Tanks {
    fn inputs(&self) -> usize {
        2
    }
    fn outputs(&self) -> usize {
        2
    }
    fn sample_time_s(&self) -> f64 {
        1.0
    }
    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        self.check_lengths(input, output)?;
        let [a, b] = self.0;
        self.0[0] = 0.9 * a + 0.08 * b + 0.1 * input[0];
        self.0[1] = 0.05 * a + 0.85 * b + 0.2 * input[1];
        output.copy_from_slice(&self.0);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 1. Record: shake both inputs, independently of each other.
    let (mut plant, mut inputs, mut outputs) = (Tanks([0.0; 2]), Vec::new(), Vec::new());
    for k in 0..200_u32 {
        let shake = |prime: u32| f64::from(k * k * prime % 101) / 50.0 - 1.0;
        let (input, mut output) = ([shake(7), shake(13)], [0.0; 2]);
        plant.step(&input, &mut output)?;
        inputs.extend(input);
        outputs.extend(output);
    }
    let mut data = Dataset::new(1.0, ["pump_1", "pump_2"], ["level_1", "level_2"])?;
    data.push_rows(&inputs, &outputs)?;

    // 2. Set up: Hankel matrix, proof of excitation, reduction, controller.
    let hankel = HankelMatrix::build(&data, Horizons::new(4, 20))?;
    let exciting = hankel.require_persistently_exciting(4)?;
    let predictor = Predictor::exact(&exciting)?;
    let (regularisation, slack) = (Regularisation::per_column(1e-6), Slack::Penalty(1e6));
    let settings = DeepcSettings {
        input_bounds: vec![Bounds::between(-0.5, 0.5); 2],
        output_bounds: vec![OutputBounds::soft(-0.1, 1.0, 100.0, 10.0); 2],
        ..DeepcSettings::new(&[0.01; 2], &[1.0; 2], regularisation, slack)
    };
    let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
    let mut controller = DeepcController::condensed(&predictor, &settings, horizon)?;

    // 3. Control: raise the levels to 0.9 and 0.6.
    let run = run_closed_loop(&mut Tanks([0.0; 2]), &mut controller, 60, |_, reference| {
        reference.hold(&[0.4, 0.2], &[0.9, 0.6])
    })?;
    for k in (0..60).step_by(6) {
        let (u, y) = (run.inputs.row(k), run.outputs.row(k));
        println!("{k:3} s  pumps {u:6.3?}  levels {y:6.3?}");
    }
    Ok(())
}
