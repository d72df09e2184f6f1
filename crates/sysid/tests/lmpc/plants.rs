//! The plant, its model and the settings that the tests share.

use deepc_core::controller::{Plant, PlantError, RecedingHorizonSettings};
use deepc_core::data::Dataset;
use deepc_core::faer::{Col, Mat, mat};
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{
    Bounds, DeepcSettings, OutputBounds, ProgramOptions, Regularisation, Slack,
};
use deepc_core::solver::SolveBudget;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use sysid::lmpc::LmpcSettings;
use sysid::{Channel, StateSpace, SystemMatrices};

pub const TS: f64 = 0.1;

/// Three states, two inputs, one measured disturbance, two outputs, D ≠ 0, a stable A − KC.
pub fn matrices() -> SystemMatrices {
    SystemMatrices {
        a: mat![[0.9, 0.2, 0.0], [-0.15, 0.85, 0.1], [0.0, 0.0, 0.7]],
        b: mat![[0.1, 0.0, 0.05], [0.0, 0.2, 0.1], [0.3, 0.1, 0.1]],
        c: mat![[1.0, 0.0, 0.2], [0.0, 1.0, 0.0]],
        d: mat![[0.05, 0.0, 0.1], [0.0, -0.1, 0.0]],
        k: mat![[0.3, 0.05], [0.0, 0.25], [0.1, 0.1]],
    }
}

/// The operating point: inputs, disturbance, outputs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offsets {
    pub inputs: [f64; 2],
    pub disturbance: f64,
    pub outputs: [f64; 2],
}

pub const SHIFTED: Offsets = Offsets {
    inputs: [80.0, -3.0],
    disturbance: 2.0,
    outputs: [5.0, -40.0],
};

pub fn channel(name: &str, offset: f64) -> Channel {
    Channel {
        offset,
        ..Channel::new(name)
    }
}

/// The plant's own equations about an operating point.
pub fn model_at(offsets: Offsets) -> StateSpace {
    let Offsets {
        inputs: [a, b],
        disturbance,
        outputs: [y, z],
    } = offsets;
    StateSpace::new(
        TS,
        vec![channel("u1", a), channel("u2", b)],
        vec![channel("d", disturbance)],
        vec![channel("y1", y), channel("y2", z)],
        matrices(),
    )
    .unwrap()
}

pub fn model() -> StateSpace {
    model_at(Offsets::default())
}

/// The model without its measured disturbance.
pub fn undisturbed_model() -> StateSpace {
    let SystemMatrices { a, b, c, d, k } = matrices();
    let (b, d) = (b.subcols(0, 2).to_owned(), d.subcols(0, 2).to_owned());
    let matrices = SystemMatrices { a, b, c, d, k };
    let channels = |names: [&str; 2]| names.map(Channel::new).to_vec();
    StateSpace::new(
        TS,
        channels(["u1", "u2"]),
        vec![],
        channels(["y1", "y2"]),
        matrices,
    )
    .unwrap()
}

/// What acts on the plant in sample k: the measured disturbance, and what nobody measures on the
/// inputs and outputs.
type Signal = Box<dyn Fn(usize) -> f64>;

/// The equations above, without noise.
pub struct LtiPlant {
    matrices: SystemMatrices,
    offsets: Offsets,
    x: Col<f64>,
    samples: usize,
    measured: [f64; 1],
    pub disturbance: Signal,
    /// Whether it tells the disturbance.
    pub measures: bool,
    pub input_error: [f64; 2],
    pub output_error: [f64; 2],
}

impl LtiPlant {
    pub fn at(offsets: Offsets) -> Self {
        Self {
            matrices: matrices(),
            offsets,
            x: Col::zeros(3),
            samples: 0,
            measured: [0.0],
            disturbance: Box::new(|k| 0.4 * (0.1 * k as f64).sin()),
            measures: true,
            input_error: [0.0; 2],
            output_error: [0.0; 2],
        }
    }

    pub fn undisturbed() -> Self {
        Self {
            disturbance: Box::new(|_| 0.0),
            measures: false,
            ..Self::at(Offsets::default())
        }
    }

    pub fn with_state(mut self, x: [f64; 3]) -> Self {
        self.x = Col::from_fn(3, |i| x[i]);
        self
    }
}

impl Plant for LtiPlant {
    fn inputs(&self) -> usize {
        2
    }

    fn outputs(&self) -> usize {
        2
    }

    fn disturbances(&self) -> usize {
        usize::from(self.measures)
    }

    fn sample_time_s(&self) -> f64 {
        TS
    }

    fn measured_disturbances(&self) -> &[f64] {
        &self.measured[..self.disturbances()]
    }

    fn step(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        self.check_lengths(input, output)?;
        let d = (self.disturbance)(self.samples);
        self.samples += 1;
        self.measured[0] = d + self.offsets.disturbance;
        let u = Col::from_fn(3, |j| match j {
            2 => d,
            _ => input[j] - self.offsets.inputs[j] + self.input_error[j],
        });
        let y = &self.matrices.c * &self.x + &self.matrices.d * &u;
        self.x = &self.matrices.a * &self.x + &self.matrices.b * &u;
        for (i, value) in output.iter_mut().enumerate() {
            *value = y[i] + self.offsets.outputs[i] + self.output_error[i];
        }
        Ok(())
    }
}

/// What 400 samples of white noise on inputs and disturbance teach `DeePC`.
pub fn predictor(horizons: Horizons) -> Predictor {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || -> f64 { rng.sample(StandardNormal) };
    let noise: Vec<f64> = (0..400).map(|_| normal()).collect();
    let shaken = noise.clone();
    let mut plant = LtiPlant::at(Offsets::default());
    plant.disturbance = Box::new(move |k| shaken[k]);
    let inputs = Mat::from_fn(400, 2, |_, _| normal());
    let (mut d, mut y) = (Mat::zeros(400, 1), Mat::zeros(400, 2));
    for k in 0..400 {
        let mut output = [0.0; 2];
        plant
            .step(&[inputs[(k, 0)], inputs[(k, 1)]], &mut output)
            .unwrap();
        d[(k, 0)] = noise[k];
        (y[(k, 0)], y[(k, 1)]) = (output[0], output[1]);
    }
    let mut data = Dataset::with_disturbances(TS, ["u1", "u2"], ["d"], ["y1", "y2"]).unwrap();
    data.push_record_with_disturbances(inputs, d, y).unwrap();
    let hankel = HankelMatrix::build(&data, horizons).unwrap();
    Predictor::exact(&hankel.require_persistently_exciting(3).unwrap()).unwrap()
}

/// Input boxes, a soft output bound, and a cost of changes, moved to an operating point.
pub fn settings_at(offsets: Offsets) -> LmpcSettings {
    let [a, b] = offsets.inputs;
    let [y, _] = offsets.outputs;
    LmpcSettings {
        input_bounds: vec![
            Bounds::between(a - 0.4, a + 0.8),
            Bounds::between(b - 0.5, b + 0.5),
        ],
        output_bounds: vec![
            OutputBounds::soft(y - 1.0, y + 0.9, 100.0, 10.0),
            OutputBounds::none(),
        ],
        options: ProgramOptions {
            input_change_weights: vec![0.1, 0.05],
            ..ProgramOptions::default()
        },
        past_steps: Some(4),
        ..LmpcSettings::new(&[0.01, 0.02], &[1.0, 0.5])
    }
}

pub fn settings() -> LmpcSettings {
    settings_at(Offsets::default())
}

/// The same problem for `DeePC`: nothing regularised, hard slack.
pub fn deepc_settings() -> DeepcSettings {
    let stage = settings().stage();
    DeepcSettings {
        input_bounds: stage.input_bounds,
        output_bounds: stage.output_bounds,
        options: stage.options,
        ..DeepcSettings::new(
            &stage.input_weights,
            &stage.output_weights,
            Regularisation::none(),
            Slack::Hard,
        )
    }
}

pub fn horizon() -> RecedingHorizonSettings {
    RecedingHorizonSettings::every_sample(SolveBudget::generous())
}
