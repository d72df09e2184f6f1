//! A step on a grid allocates nothing. The counting allocator of `allocation-counter` serves this
//! test binary alone.

mod common;

use allocation_counter::measure;
use common::{TICK_S, pose, sedan, three_turns};
use vehicle_dyn::road::Course;
use vehicle_dyn::simulation::{Command, Simulation};
use vehicle_dyn::terrain::{GroundDescription, Terrain};

#[test]
fn a_step_on_a_grid_allocates_nothing() {
    let ground: GroundDescription = toml::from_str(
        r#"
        friction = 0.85
        fade_in_m = 50.0
        roughness = { class = "c", contact_length_m = 0.13, seed = 1 }
        undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }
        bank = [{ station_m = 0.0, percent = 1.0 }, { station_m = 100.0, percent = -3.0 }]
        bumps = [{ station_m = 20.0, offset_m = 0.7, length_m = 1.0, width_m = 1.0, height_m = 0.05 }]
        split = { left = 0.9, right = 0.7, edge_m = 1.0 }
        "#,
    )
    .expect("valid");
    let course = Course::new(&three_turns()).expect("valid");
    let terrain = Terrain::build(&ground, &course).expect("it fits");
    let mut simulation = Simulation::new(&sedan(), terrain, pose(90.0)).expect("valid");
    let counted = measure(|| {
        for _ in 0..300 {
            simulation
                .step(Command::from_deg_kmh(5.0, 90.0), TICK_S)
                .expect("finite");
        }
    });
    assert_eq!(counted.count_total, 0);
}
