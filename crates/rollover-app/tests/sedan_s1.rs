//! What the built-in scenario `sedan-s1` must show on the plant.

use std::path::Path;

use rollover_app::closed_loop::{Finished, Recorded, Run, Watch, controller, run};
use rollover_app::interrupt::Interrupt;
use rollover_app::record::record;
use rollover_app::run_log::LogRow;
use rollover_app::scenario::{DRIVER, Scenario, load};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::road::{Course, Segment};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

/// Recording seeds that were not used to choose the settings (docs/decisions/0005-sedan-s1.md).
const JUDGED_SEEDS: std::ops::Range<u64> = 10..20;

fn scenario() -> (Scenario, ReadyVehicle) {
    let scenario = load("sedan-s1").expect("the built-in scenario is valid");
    let vehicle = vehicle_dyn::vehicles::find(&scenario.vehicle).expect("its vehicle is built in");
    let vehicle = ReadyVehicle::new(vehicle).expect("its parameters are allowed");
    (scenario, vehicle)
}

/// Drives with a controller made from the recording of a seed, or the driver alone.
fn drive(name: &str, seed: u64, speed_reference_kmh: f64) -> Finished {
    let (scenario, vehicle) = scenario();
    let settings = scenario
        .controller(name)
        .expect("the scenario has this controller");
    let controller = settings.map(|settings| {
        let (data, _) = record(&scenario, &vehicle, seed, &Interrupt::default())
            .expect("the recording is survived");
        let watch = Watch {
            interrupt: &Interrupt::default(),
            progress: &|_| (),
        };
        let built = controller(&scenario, settings, &Recorded::new(&data), watch);
        built.expect("the recording excites the plant").controller
    });
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log: &Path = &folder.path().join("log.csv");
    let order = Run {
        speed_reference_kmh,
        fixed_target_speed_kmh: speed_reference_kmh,
        seed,
        controller,
        ..Run::of_driver(&scenario, &vehicle, Terrain::flat(scenario.ground.friction))
    };
    run(order, Some(log), &Interrupt::default(), || ()).expect("the simulation runs")
}

/// Station at which the last turn begins, m.
fn third_turn_m(scenario: &Scenario) -> f64 {
    let segments = &scenario.course.segments;
    let is_turn = |segment: &Segment| matches!(segment, Segment::Turn { .. });
    assert_eq!(
        segments.iter().filter(|s| is_turn(s)).count(),
        3,
        "the course has three turns"
    );
    let last = segments.iter().rposition(is_turn).expect("there are turns");
    segments[..last].iter().map(Segment::length_m).sum()
}

fn largest_ltr(rows: &[LogRow]) -> f64 {
    rows.iter().map(|row| row.ltr.abs()).fold(0.0, f64::max)
}

#[test]
fn the_driver_alone_rolls_over_in_the_third_turn_at_105() {
    let (scenario, _) = scenario();
    let finished = drive(DRIVER, 0, 105.0);
    assert_eq!(finished.outcome, Outcome::RolledOver);
    let course = Course::new(&scenario.course).expect("the course is valid");
    let lift = finished
        .rows
        .iter()
        .find(|row| row.ltr.abs() > 1.0)
        .expect("wheels lift");
    let station = course.locate(lift.x_m, lift.y_m, None).station_m;
    let turn = third_turn_m(&scenario);
    assert!(
        station > turn,
        "lifted at {station:.0} m, the third turn begins at {turn:.0} m"
    );
}

#[test]
fn the_driver_alone_survives_at_100() {
    let finished = drive(DRIVER, 0, 100.0);
    assert_eq!(finished.outcome, Outcome::Completed);
    assert!(
        largest_ltr(&finished.rows) < 1.0,
        "no wheels lift on both axles of a side"
    );
}

#[test]
fn recordings_stay_below_lift_off() {
    let (scenario, vehicle) = scenario();
    for seed in 0..JUDGED_SEEDS.end {
        let (_, summary) = record(&scenario, &vehicle, seed, &Interrupt::default())
            .expect("the recording is survived");
        let ltr = summary.ltr_abs_max;
        assert!(
            (0.9..1.0).contains(&ltr),
            "seed {seed} reaches |LTR| {ltr:.3}"
        );
    }
}

#[test]
fn rd_deepc_1_completes_below_lift_off_on_nine_of_ten_judged_seeds() {
    let mut failures = Vec::new();
    for seed in JUDGED_SEEDS {
        let finished = drive("rd-deepc-1", seed, 105.0);
        let ltr = largest_ltr(&finished.rows);
        if finished.outcome != Outcome::Completed || ltr > 1.0 {
            failures.push(format!(
                "seed {seed}: {}, max |LTR| {ltr:.3}",
                finished.outcome
            ));
        }
        let fallbacks = finished
            .rows
            .iter()
            .filter(|row| row.solve_status.is_fallback())
            .count();
        assert_eq!(fallbacks, 0, "seed {seed}: no solve fails");
    }
    assert!(failures.len() <= 1, "{failures:?}");
}
