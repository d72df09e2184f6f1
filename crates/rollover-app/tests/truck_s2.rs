//! What the driver of the built-in scenario `truck-s2` does on the plant.

use rollover_app::closed_loop::{Finished, Run, run};
use rollover_app::interrupt::Interrupt;
use rollover_app::record::record;
use rollover_app::scenario::{Scenario, load};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::road::{Course, Segment};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

fn scenario() -> (Scenario, ReadyVehicle) {
    let scenario = load("truck-s2").expect("the built-in scenario is valid");
    let vehicle = vehicle_dyn::vehicles::find(&scenario.vehicle).expect("its vehicle is built in");
    let vehicle = ReadyVehicle::new(vehicle).expect("its parameters are allowed");
    (scenario, vehicle)
}

/// The driver alone.
fn drive(speed_reference_kmh: f64) -> Finished {
    let (scenario, vehicle) = scenario();
    let terrain = Terrain::flat(scenario.ground.friction);
    let order = Run {
        speed_reference_kmh,
        fixed_target_speed_kmh: speed_reference_kmh,
        ..Run::of_driver(&scenario, &vehicle, terrain)
    };
    run(order, None, &Interrupt::default(), || ()).expect("the simulation runs")
}

#[test]
fn the_driver_alone_rolls_over_in_the_last_turn_at_100() {
    let (scenario, _) = scenario();
    let finished = drive(100.0);
    assert_eq!(finished.outcome, Outcome::RolledOver);
    let lift = finished
        .rows
        .iter()
        .find(|row| row.ltr.abs() > 1.0)
        .expect("wheels lift");
    let course = Course::new(&scenario.course).expect("the course is valid");
    let station = course.locate(lift.x_m, lift.y_m, None).station_m;
    let segments = &scenario.course.segments;
    let last = segments
        .iter()
        .rposition(|segment| matches!(segment, Segment::Turn { .. }))
        .expect("there are turns");
    let begins: f64 = segments[..last].iter().map(Segment::length_m).sum();
    let ends = begins + segments[last].length_m();
    assert!(
        (begins..ends).contains(&station),
        "lifted at {station:.0} m, the last turn reaches from {begins:.0} m to {ends:.0} m"
    );
}

#[test]
fn the_driver_alone_survives_at_90() {
    let finished = drive(90.0);
    assert_eq!(finished.outcome, Outcome::Completed);
    assert!(finished.rows.iter().all(|row| row.ltr.abs() < 1.0));
}

#[test]
fn recordings_stay_below_lift_off() {
    let (scenario, vehicle) = scenario();
    for seed in 0..20 {
        let (_, summary) = record(&scenario, &vehicle, seed, &Interrupt::default())
            .expect("the recording is survived");
        let ltr = summary.ltr_abs_max;
        assert!(
            (0.9..1.0).contains(&ltr),
            "seed {seed} reaches |LTR| {ltr:.3}"
        );
    }
}
