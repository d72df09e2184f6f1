//! Check 6 of the validation list on every manoeuvre: halving the integration step.

use vehicle_dyn::manoeuvre::{self, RunSettings};

/// Largest change of LTR that half the step may bring.
const LTR_TOLERANCE: f64 = 1e-3;

#[test]
fn halving_the_step_changes_the_load_transfer_of_every_manoeuvre_by_less_than_1e_3() {
    for vehicle_name in vehicle_dyn::vehicles::names() {
        let vehicle = vehicle_dyn::vehicles::embedded(vehicle_name).expect("embedded");
        for name in manoeuvre::names() {
            let file = manoeuvre::find(name).expect("embedded");
            let runs = manoeuvre::converges(&file, &vehicle, RunSettings::default())
                .unwrap_or_else(|error| panic!("{name}: {error}"));
            for run in &runs {
                println!("{vehicle_name} {name} {run:?}");
            }
        }
    }
}
