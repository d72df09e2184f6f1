//! What is this recording worth? A data report and a choice of weights, before any control.
//! `cargo run --release -p deepc-core --example data_report`

use deepc_core::assessment::{
    DataReport, HoldOut, HoldOutErrors, PredictionSettings, ReportOptions, TuningSettings,
    logarithmic_grid, tune,
};
use deepc_core::data::Dataset;
use deepc_core::hankel::Horizons;
use deepc_core::program::{Regularisation, Slack};

/// Random numbers from −1 to 1, the same in every run.
struct Noise(u64);
impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        f64::from(u32::try_from(self.0 >> 32).unwrap_or(0)) / f64::from(u32::MAX / 2) - 1.0
    }
}

/// Two coupled tanks, recorded with measurement noise.
fn recording() -> Result<Dataset, Box<dyn std::error::Error>> {
    let (mut noise, mut levels) = (Noise(1), [0.0, 0.0]);
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    for _ in 0..600 {
        let pumps = [noise.next(), noise.next()];
        let [a, b] = levels;
        levels[0] = 0.9 * a + 0.08 * b + 0.1 * pumps[0];
        levels[1] = 0.05 * a + 0.85 * b + 0.2 * pumps[1];
        inputs.extend(pumps);
        // The second sensor reads whole hundredths and stops at 0.3.
        let second = (levels[1] + 0.01 * noise.next()).min(0.3);
        outputs.extend([
            levels[0] + 0.01 * noise.next(),
            (100.0 * second).round() / 100.0,
        ]);
    }
    let mut data = Dataset::new(1.0, ["pump_1", "pump_2"], ["level_1", "level_2"])?;
    data.push_rows(&inputs, &outputs)?;
    Ok(data)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (data, horizons) = (recording()?, Horizons::new(4, 10));
    let report = DataReport::measure(&data, horizons, &ReportOptions::up_to_order(4))?;
    let json = serde_json::to_string(&report)?;
    println!("{report}\n\nAs JSON: {json:.120} ...\n");

    let settings = TuningSettings {
        lambda_g: logarithmic_grid(1e-4, 1e2, 7),
        lambda_y: vec![1.0],
        input_slack: Slack::Hard,
        hold_out: HoldOut::LastQuarter,
        windows: 500,
        seed: 0,
    };
    let curve = tune(&data, horizons, &settings)?;
    println!("{curve}");

    let best = curve.best();
    let weights = PredictionSettings::weighted(
        Regularisation::per_column(best.lambda_g),
        Slack::Hard,
        Slack::Penalty(best.lambda_y),
    );
    let margin = HoldOutErrors::measure(&data, horizons, &weights)?.margin(0.95)?;
    for output in &margin.outputs {
        println!(
            "{}: 95 % of the predictions are within ±{:.3}",
            output.name, output.flat
        );
    }
    Ok(())
}
