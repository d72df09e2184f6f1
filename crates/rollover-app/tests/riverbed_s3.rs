//! What the built-in scenario `riverbed-s3` must show on the plant.

use rollover_app::closed_loop::{Finished, Run, run};
use rollover_app::interrupt::Interrupt;
use rollover_app::record::{record, record_seed};
use rollover_app::scenario::{FurtherRecord, Scenario, load};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::road::Course;
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

fn scenario() -> (Scenario, ReadyVehicle) {
    let scenario = load("riverbed-s3").expect("the built-in scenario is valid");
    let vehicle = vehicle_dyn::vehicles::find(&scenario.vehicle).expect("its vehicle is built in");
    let vehicle = ReadyVehicle::new(vehicle).expect("its parameters are allowed");
    (scenario, vehicle)
}

/// The driver alone, on the course or on its mirror image.
fn drive(speed_reference_kmh: f64, mirror: bool) -> Finished {
    let (mut scenario, vehicle) = scenario();
    if mirror {
        scenario.course = scenario.course.mirrored();
        scenario.ground = scenario.ground.mirrored();
    }
    let course = Course::new(&scenario.course).expect("the course is valid");
    let terrain = Terrain::build(&scenario.ground, &course).expect("the ground fits the course");
    let order = Run {
        speed_reference_kmh,
        fixed_target_speed_kmh: speed_reference_kmh,
        ..Run::of_driver(&scenario, &vehicle, terrain)
    };
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log = folder.path().join("log.csv");
    run(order, Some(&log), &Interrupt::default(), || ()).expect("the simulation runs")
}

#[test]
fn the_path_the_driver_and_the_bounds_are_those_of_the_sedan_scenario() {
    let (riverbed, _) = scenario();
    let sedan = load("sedan-s1").expect("the built-in scenario is valid");
    assert_eq!(riverbed.course, sedan.course);
    assert_eq!(riverbed.driver, sedan.driver);
    assert_eq!(riverbed.bounds, sedan.bounds);
    assert_eq!(riverbed.vehicle, sedan.vehicle);
    assert_eq!(riverbed.records()[0], sedan.records()[0]);
}

#[test]
fn the_driver_alone_rolls_over_at_105_and_survives_at_100() {
    let fast = drive(105.0, false);
    assert_eq!(fast.outcome, Outcome::RolledOver);
    assert_eq!(fast.rows, drive(105.0, false).rows, "it is the same again");
    assert_eq!(drive(100.0, false).outcome, Outcome::Completed);
}

#[test]
fn so_it_is_on_the_mirror_image() {
    assert_eq!(drive(105.0, true).outcome, Outcome::RolledOver);
    assert_eq!(drive(100.0, true).outcome, Outcome::Completed);
}

#[test]
fn records_stay_below_lift_off() {
    let (scenario, vehicle) = scenario();
    for seed in 0..20 {
        let (_, summary) = record(&scenario, &vehicle, seed, &Interrupt::default())
            .expect("the recording is survived");
        assert_eq!(summary.records.len(), 2);
        assert!(
            summary.ltr_abs_max < 1.0,
            "seed {seed} reaches |LTR| {:.3}",
            summary.ltr_abs_max
        );
    }
}

#[test]
fn the_first_record_is_the_same_without_the_others() {
    let (scenario, vehicle) = scenario();
    let made = |scenario: &Scenario| {
        let made = record(scenario, &vehicle, 7, &Interrupt::default());
        made.expect("the recording is survived")
    };
    let (both, _) = made(&scenario);
    let sedan = load("sedan-s1").expect("the built-in scenario is valid");
    let (alone, summary) = made(&sedan);
    assert!(summary.records.is_empty(), "one record needs no list");
    assert_eq!(both.records().len(), 2);
    assert_eq!(alone.records().len(), 1);
    let [first, alone] = [&both.records()[0], &alone.records()[0]];
    assert_eq!(first.inputs(), alone.inputs());
    assert_eq!(first.outputs(), alone.outputs());
}

#[test]
fn a_further_record_has_a_seed_of_its_own_and_the_rest_of_the_first() {
    let (mut scenario, vehicle) = scenario();
    scenario.recording.duration_s = 5.0;
    scenario.recording.more = vec![FurtherRecord::default(); 2];
    let made = |scenario: &Scenario, seed: u64| {
        let made = record(scenario, &vehicle, seed, &Interrupt::default());
        made.expect("the recording is survived").0
    };
    let data = made(&scenario, 7);
    scenario.recording.more.clear();
    for (number, found) in (1..).zip(data.records()) {
        let alone = made(&scenario, record_seed(7, number));
        assert_eq!(found.inputs(), alone.records()[0].inputs(), "{number}");
        assert_eq!(found.outputs(), alone.records()[0].outputs(), "{number}");
    }
    let mut seeds: Vec<u64> = (1..=3).map(|number| record_seed(7, number)).collect();
    assert_eq!(seeds[0], 7);
    seeds.sort_unstable();
    seeds.dedup();
    assert_eq!(seeds.len(), 3);
}
