//! A plant of your own: implement `Plant`, record it, and let it follow a way known in advance
//! against a measured load, with a force that may change by 2 N per sample and whose changes cost.
//! `cargo run --release -p deepc-core --example own_plant`
use deepc_core::controller::RecedingHorizonSettings;
use deepc_core::controller::{Controller, DeepcController, Plant, PlantError};
use deepc_core::data::Dataset;
use deepc_core::faer::Mat;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{Bounds, DeepcSettings, Regularisation, Slack};
use deepc_core::solver::SolveBudget;

/// A slide of 2 kg with friction: position in m and speed in m/s, and the load on it in N.
struct Slide([f64; 2], [f64; 1]);
impl Plant for Slide {
    fn inputs(&self) -> usize {
        1
    }
    fn outputs(&self) -> usize {
        1
    }
    fn disturbances(&self) -> usize {
        1
    }
    fn measured_disturbances(&self) -> &[f64] {
        &self.1
    }
    fn sample_time_s(&self) -> f64 {
        0.05
    }
    fn step(&mut self, force: &[f64], output: &mut [f64]) -> Result<(), PlantError> {
        self.check_lengths(force, output)?;
        let ([position, speed], push) = (self.0, force[0] - self.1[0]);
        self.0 = [position + 0.05 * speed, 0.9 * speed + 0.025 * push];
        output[0] = self.0[0]; // at the end of the sample
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut slide, mut y, mut position) = (Slide([0.0; 2], [0.0]), [0.0], Mat::zeros(200, 1));
    let shake = |k: usize, prime: usize| (k * k * prime % 101) as f64 / 50.0 - 1.0;
    let force = Mat::from_fn(200, 1, |k, _| 10.0 * shake(k, 7));
    let load = Mat::from_fn(200, 1, |k, _| shake(k, 13));
    for k in 0..200 {
        slide.1[0] = load[(k, 0)];
        slide.step(&[force[(k, 0)]], &mut y)?;
        position[(k, 0)] = y[0];
    }
    let mut data = Dataset::with_disturbances(0.05, ["force_n"], ["load_n"], ["position_m"])?;
    data.push_record_with_disturbances(force, load, position)?;
    let hankel = HankelMatrix::build(&data, Horizons::new(4, 20))?;
    let predictor = Predictor::exact(&hankel.require_persistently_exciting(2)?)?;
    let (regularisation, slack) = (Regularisation::projection(1.0), Slack::Penalty(1e6));
    let mut settings = DeepcSettings {
        input_bounds: vec![Bounds::between(-10.0, 10.0)],
        ..DeepcSettings::new(&[0.0], &[1000.0], regularisation, slack) // 3 cm cost as much as ...
    };
    settings.options.input_change_weights = vec![1e-3]; // ... a change of the force by 30 N
    settings.options.input_change_bounds = vec![Bounds::between(-2.0, 2.0)];
    let horizon = RecedingHorizonSettings::every_sample(SolveBudget::generous());
    let mut controller = DeepcController::condensed(&predictor, &settings, horizon)?;
    let way = Mat::from_fn(80, 1, |k, _| (0.04 * (k as f64 - 20.0)).clamp(0.0, 0.5));
    let load = Mat::from_fn(80, 1, |k, _| if k < 40 { 0.0 } else { 3.0 });
    let mut reference = controller.new_reference();
    for k in 0..60 {
        reference.preview(Mat::zeros(1, 1).as_ref(), way.subrows(k, 20))?;
        reference.preview_disturbances(load.subrows(k, 20))?; // untold, the last one is held
        let u = controller.decide(&reference).input.clone();
        slide.1[0] = load[(k, 0)];
        slide.step(&u, &mut y)?;
        controller.observe_with_disturbances(&u, slide.measured_disturbances(), &y);
        let (from, want) = (controller.step().origin, way[(k, 0)]);
        println!("{k:2} {u:5.2?} N {y:6.3?} of {want:.3} m, {from:?}");
    }
    let off_m = (y[0] - 0.5).abs();
    println!("goal: at most 1 mm from 0.5 m in the end; reached {off_m:.1e} m");
    (off_m < 1e-3).then_some(()).ok_or("goal missed".into())
}
