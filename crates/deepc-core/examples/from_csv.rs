//! No plant and no model, only a recording: a room with a heater (kW), a fan for fresh air (0 to 1)
//! and the outdoor temperature. How well do the first 380 rows predict the others, and what would
//! `DeePC` have done there? `cargo run --release -p deepc-core --example from_csv`

use deepc_core::data::{CsvLayout, Dataset, OutputTiming};
use deepc_core::faer::Mat;
use deepc_core::hankel::{HankelMatrix, Horizons};
use deepc_core::predictor::Predictor;
use deepc_core::program::{Bounds, Moment, OutputPredictor, Regularisation, Slack};
use deepc_core::program::{
    CondensedProgram, DeepcSettings, MeasuredDisturbances, PredictiveProgram,
};
use deepc_core::solver::{ActiveSet, ActiveSetSettings, SolveBudget};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let layout = CsvLayout {
        time: Some("time_s".into()),
        inputs: vec!["heater_kw".into(), "fan".into()],
        disturbances: vec!["outdoor_c".into()],
        outputs: vec!["room_c".into()],
        outputs_measured: OutputTiming::StartOfInterval, // a row is what was known at one instant
        sample_time_s: 300.0,
    };
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/data/heater.csv");
    let all = Dataset::read_csv(&layout, &[file])?;
    let (u, d) = (all.records()[0].inputs(), all.records()[0].disturbances());
    let y = all.records()[0].outputs();
    let mut data = Dataset::with_disturbances(300.0, ["heater", "fan"], ["outdoor"], ["room"])?;
    let [u_d, d_d, y_d] = [u, d, y].map(|series| series.subrows(0, 380).to_owned());
    data.push_record_with_disturbances(u_d, d_d, y_d)?;
    let hankel = HankelMatrix::build(&data, Horizons::new(12, 24))?;
    print!("{}", hankel.excitation(3)?);
    let predictor = Predictor::compact(&hankel.require_persistently_exciting(3)?);
    let outdoors = |k: usize| {
        let (past, preview) = (d.subrows(k - 12, 12), d.subrows(k, 24));
        Some(MeasuredDisturbances { past, preview })
    };

    // Least squares: with both slacks hard the size of the weight does not matter.
    let norm = Regularisation::per_column(1.0);
    let mut room = OutputPredictor::new(&predictor, norm, Slack::Hard, Slack::Hard)?;
    let (mut off, mut still) = (0.0, 0.0);
    for k in 400..450 {
        let (before, ini) = (u.subrows(k - 12, 12), y.subrows(k - 12, 12));
        let predicted = room.predict(before, ini, u.subrows(k, 24), outdoors(k))?;
        off += (predicted[(23, 0)] - y[(k + 23, 0)]).powi(2) / 50.0;
        still += (y[(k - 1, 0)] - y[(k + 23, 0)]).powi(2) / 50.0;
    }
    let (off, still) = (off.sqrt(), still.sqrt());
    println!("2 h ahead: off by {off:.2} °C (goal: 0.25 °C), without a forecast by {still:.2} °C");

    let projection = Regularisation::projection(1.0);
    let mut settings = DeepcSettings {
        input_slack: Slack::Hard,
        input_bounds: vec![Bounds::between(0.0, 3.0), Bounds::between(0.0, 1.0)],
        ..DeepcSettings::new(&[0.01, 1.0], &[1.0], projection, Slack::Penalty(100.0))
    };
    settings.options.input_change_weights = vec![0.1; 2];
    let mut program = CondensedProgram::new(&predictor, &settings)?;
    let mut solver = ActiveSet::new(program.qp(), ActiveSetSettings::default())?;
    let fan = Mat::from_fn(24, 2, |_, i| 0.5 * i as f64);
    let warm = Mat::full(24, 1, 21.0);
    let moment = Moment {
        past_inputs: u.subrows(410 - 12, 12),
        past_outputs: y.subrows(410 - 12, 12),
        input_reference: fan.as_ref(),
        output_reference: warm.as_ref(),
        disturbances: outdoors(410),
    };
    let plan = program.solve(&moment, &mut solver, &SolveBudget::generous())?;
    println!("From row 410 on, heater and fan and room: as recorded | as planned for 21 °C");
    for i in (0..24).step_by(3) {
        let (did, was) = (u.row(410 + i), y[(410 + i, 0)]);
        let (would, room) = (plan.inputs.row(i), plan.outputs[(i, 0)]);
        println!("  {did:4.2?} {was:.1} °C | {would:4.2?} {room:.1} °C");
    }
    (off < 0.25).then_some(()).ok_or("goal missed".into())
}
