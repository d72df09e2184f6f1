//! From a recording to a model and a controller: two coupled tanks, known only by noisy samples.
//! `cargo run --release -p sysid --example identify_and_control`

use deepc_core::controller::{Plant, PlantError, RecedingHorizonSettings, run_closed_loop};
use deepc_core::data::Dataset;
use deepc_core::program::{Bounds, OutputBounds};
use deepc_core::solver::SolveBudget;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sysid::lmpc::{self, LmpcSettings};
use sysid::{Validation, ValidationSettings, identify};

/// Two tanks at levels of 40 and 60 cm, their pumps at 5 V.
struct Tanks {
    levels: [f64; 2],
    noise: ChaCha8Rng,
}

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
        let ([a, b], [u, v]) = (self.levels, [input[0] - 5.0, input[1] - 5.0]);
        self.levels = [0.92 * a + 0.06 * b + 0.4 * u, 0.04 * a + 0.9 * b + 0.5 * v];
        for ((output, level), offset) in output.iter_mut().zip(self.levels).zip([40.0, 60.0]) {
            *output = offset + level + 0.1 * self.noise.random_range(-1.0..1.0);
        }
        Ok(())
    }
}

fn tanks(seed: u64) -> Tanks {
    let noise = ChaCha8Rng::seed_from_u64(seed);
    let levels = [0.0; 2];
    Tanks { levels, noise }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let record = |seed| -> Result<Dataset, Box<dyn std::error::Error>> {
        let (mut plant, mut shake) = (tanks(seed), ChaCha8Rng::seed_from_u64(seed + 100));
        let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
        for _ in 0..600 {
            let input = [0, 1].map(|_| shake.random_range(3.0..7.0));
            let mut output = [0.0; 2];
            plant.step(&input, &mut output)?;
            inputs.extend(input);
            outputs.extend(output);
        }
        let mut data = Dataset::new(1.0, ["pump_1", "pump_2"], ["level_1", "level_2"])?;
        data.push_rows(&inputs, &outputs)?;
        Ok(data)
    };
    let found = identify(&record(1)?)?;
    println!("{}", found.report);
    let settings = ValidationSettings::for_horizon(10);
    println!("{}", Validation::of(&found.model, &record(2)?, &settings)?);

    // Raise the levels to 45 and 58 cm with pumps between 4 and 8 V, the first level below 45.5.
    let settings = LmpcSettings {
        input_bounds: vec![Bounds::between(4.0, 8.0); 2],
        output_bounds: vec![
            OutputBounds::soft(0.0, 45.5, 1e3, 1e3),
            OutputBounds::none(),
        ],
        ..LmpcSettings::new(&[0.0; 2], &[1.0; 2])
    };
    let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
    let mut controller = lmpc::controller(&found.model, &settings, 20, horizon)?;
    let run = run_closed_loop(&mut tanks(3), &mut controller, 120, |_, reference| {
        reference.hold(&[5.0; 2], &[45.0, 58.0])
    })?;
    let mean = |channel| run.outputs.subrows(80, 40).col(channel).sum() / 40.0;
    let (first, second) = (mean(0), mean(1));
    println!("levels {first:.2} and {second:.2} cm (goals 45 and 58)");
    if (first - 45.0).abs() > 0.1 || (second - 58.0).abs() > 0.1 {
        return Err("a goal was missed".into());
    }
    Ok(())
}
