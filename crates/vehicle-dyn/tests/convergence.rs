//! Check 6 of the validation list: halving the integration step.

mod common;

use common::{drive, five_turns, pose, sedan, step_steer, three_turns};
use vehicle_dyn::road::Course;
use vehicle_dyn::simulation::{DEFAULT_SUBSTEP_S, Observation, Simulation};
use vehicle_dyn::terrain::Terrain;

fn with_substep(speed_kmh: f64, substep_s: f64) -> Simulation {
    Simulation::with_substep(&sedan(), Terrain::flat(0.85), pose(speed_kmh), substep_s)
        .expect("valid set-up")
}

fn largest_difference(one: &[Observation], other: &[Observation]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter()
        .zip(other)
        .map(|(a, b)| (a.ltr - b.ltr).abs())
        .fold(0.0, f64::max)
}

#[test]
fn halving_the_step_changes_the_load_transfer_of_step_steers_by_less_than_1e_3() {
    for (handwheel_deg, speed_kmh) in [(10.0, 60.0), (30.0, 105.0), (50.0, 105.0)] {
        let runs = [1.0, 0.5].map(|factor| {
            step_steer(
                with_substep(speed_kmh, factor * DEFAULT_SUBSTEP_S),
                handwheel_deg,
                speed_kmh,
            )
        });
        let difference = largest_difference(&runs[0], &runs[1]);
        assert!(
            difference < 1e-3,
            "{difference} at {handwheel_deg} deg, {speed_kmh} km/h"
        );
    }
}

#[test]
fn halving_the_step_changes_the_load_transfer_on_the_shipped_courses_by_less_than_1e_3() {
    for (name, description) in [("course", three_turns()), ("recording", five_turns())] {
        let course = Course::new(&description).expect("valid course");
        for speed_kmh in [100.0, 105.0] {
            let runs = [1.0, 0.5].map(|factor| {
                drive(
                    with_substep(speed_kmh, factor * DEFAULT_SUBSTEP_S),
                    &course,
                    speed_kmh,
                    35.0,
                )
            });
            let difference = largest_difference(&runs[0], &runs[1]);
            println!("{name} at {speed_kmh} km/h: {difference:.1e}");
            assert!(
                difference < 1e-3,
                "{difference} on the {name} at {speed_kmh} km/h"
            );
        }
    }
}
