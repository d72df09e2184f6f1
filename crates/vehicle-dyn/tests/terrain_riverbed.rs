//! The sedan on a riverbed: drivable, and the integrator converges.

mod common;

use common::{drive, pose, sedan, three_turns};
use vehicle_dyn::road::Course;
use vehicle_dyn::simulation::{DEFAULT_SUBSTEP_S, Simulation};
use vehicle_dyn::terrain::{GroundDescription, Terrain};

#[test]
fn halving_the_step_changes_the_load_transfer_on_a_mild_riverbed_by_less_than_1e_3() {
    // Rougher ones lift wheels again and again, and each landing costs accuracy: there the change
    // exceeds 1e-3.
    let course = Course::new(&three_turns()).expect("valid");
    for seed in [1, 2] {
        let ground: GroundDescription = toml::from_str(&format!(
            "friction = 0.85
             fade_in_m = 50.0
             roughness = {{ class = \"a\", contact_length_m = 0.13, seed = {seed} }}
             undulation = {{ height_rms_m = 0.03, shortest_m = 25.0, longest_m = 80.0, seed = {seed} }}"
        ))
        .expect("valid");
        let terrain = Terrain::build(&ground, &course).expect("it fits");
        let runs = [1.0, 0.5].map(|factor| {
            let substep_s = factor * DEFAULT_SUBSTEP_S;
            let simulation =
                Simulation::with_substep(&sedan(), terrain.clone(), pose(100.0), substep_s);
            drive(simulation.expect("valid"), &course, 100.0, 35.0)
        });
        assert_eq!(runs[0].len(), 3501, "it gets through");
        let difference = runs[0]
            .iter()
            .zip(&runs[1])
            .map(|(a, b)| (a.ltr - b.ltr).abs())
            .fold(0.0, f64::max);
        assert!(difference < 1e-3, "{difference} with seed {seed}");
    }
}
