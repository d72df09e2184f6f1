//! Check 6 of the validation list on every manoeuvre: halving the integration step.

use vehicle_dyn::manoeuvre::{self, RunConvergence, RunSettings};

/// Largest change of LTR that half the step may bring.
const LTR_TOLERANCE: f64 = 1e-3;

/// Holds every run of every manoeuvre against the tolerance. The two directions mirror each other,
/// so both are compared and one is printed.
fn hold(what: &str, vehicles: &[&str], difference: impl Fn(&RunConvergence) -> f64) {
    let mut exceeded = Vec::new();
    for &vehicle_name in vehicles {
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
    // One of each kind: independent wheels; solid axles and twin tyres.
    let vehicles = ["sedan", "utility-truck"];
    hold("before a whole side is off the ground", &vehicles, |run| {
        run.ltr_difference_before_lift
    });
}

/// Where the sedan falls back on its wheels, LTR has spikes of up to 4, and a vehicle near tipping
/// doubles a small difference every quarter of a second. With steps taken in parts at contact it holds for
/// the sedan in all manoeuvres but the largest waves of the sine with dwell (up to 0.06).
#[test]
#[ignore = "does not hold after a side that lifted has touched down again: up to 0.06"]
fn halving_the_step_changes_the_load_transfer_by_less_than_1e_3_also_after_touchdown() {
    let vehicles = vehicle_dyn::vehicles::names();
    hold("over the whole of each run", &vehicles, |run| {
        run.ltr_difference
    });
}
