//! Statistical targets of identification on a known system, on a few seeds; the program
//! `identification` runs fifteen.

use benches::synthetic::{ORDER, record};
use sysid::{InitialStateFor, identify};

/// Fit of the simulated output to the one without noise, in %, and the order.
fn fit(seed: u64, snr_db: f64) -> (f64, usize) {
    let recording = record(seed, 3000, snr_db).unwrap();
    let model = identify(&recording.data).unwrap().model;
    assert!(model.is_stable().unwrap());
    let samples = &recording.data.records()[0];
    let (u, y) = (samples.inputs(), samples.outputs());
    let initial = model
        .initial_state(u, y, InitialStateFor::Simulation)
        .unwrap();
    let simulated = model.simulate(&initial, u).unwrap();
    let truth = &recording.noise_free;
    let mean = truth.sum() / truth.nrows() as f64;
    let spread = truth.col(0).iter().map(|y| (y - mean).powi(2)).sum::<f64>();
    let error = (truth - simulated).squared_norm_l2();
    (100.0 * (1.0 - (error / spread).sqrt()), model.order())
}

#[test]
fn order_and_output_of_a_known_system_are_found() {
    for (snr_db, least) in [(20.0, 98.0), (10.0, 96.0)] {
        for seed in [3, 9] {
            let (fit, order) = fit(seed, snr_db);
            assert_eq!(order, ORDER, "seed {seed} at {snr_db} dB");
            assert!(fit > least, "seed {seed} at {snr_db} dB: {fit:.2}");
        }
    }
}
