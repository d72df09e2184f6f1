//! Which outcome a run has, in all the cases in which one could ask.

mod common;

use common::{TICK_S, on_flat, pose, sedan};
use vehicle_dyn::metrics::{Outcome, OutcomeMonitor, OutcomeRules};
use vehicle_dyn::simulation::{Command, Observation, Simulation};
use vehicle_dyn::terrain::{Ground, Terrain};
use vehicle_dyn::units::DEGREE;

const WIDTH_M: f64 = 7.0;

fn calm() -> Observation {
    on_flat(&sedan(), 0.85, 50.0).observation()
}

fn at(time_s: f64, change: impl FnOnce(&mut Observation)) -> Observation {
    let mut seen = calm();
    seen.time_s = time_s;
    change(&mut seen);
    seen
}

#[test]
fn a_rollover_beside_the_road_is_a_rollover_and_both_times_are_kept() {
    let mut monitor = OutcomeMonitor::new(WIDTH_M);
    assert!(monitor.observe(&at(1.0, |_| ()), 3.6));
    assert_eq!(monitor.outcome(), Outcome::LeftRoad);
    assert!(!monitor.observe(&at(2.0, |o| o.roll_rad = -1.05), 9.0));
    assert_eq!(monitor.outcome(), Outcome::RolledOver);
    assert_eq!(monitor.time_of_s(Outcome::LeftRoad), Some(1.0));
    assert_eq!(monitor.time_of_s(Outcome::RolledOver), Some(2.0));
    assert_eq!(monitor.time_of_s(Outcome::Completed), None);
}

#[test]
fn a_vehicle_that_rolls_on_stays_rolled_over() {
    let mut monitor = OutcomeMonitor::new(WIDTH_M);
    // The angle jumps from 180° to −180° and comes back to 0 after a whole turn.
    for (tick, roll_deg) in [50.0, 61.0, 179.0, -179.0, -61.0, -10.0, 0.0]
        .into_iter()
        .enumerate()
    {
        monitor.observe(&at(tick as f64, |o| o.roll_rad = roll_deg * DEGREE), 0.0);
    }
    assert_eq!(monitor.outcome(), Outcome::RolledOver);
    assert_eq!(monitor.time_of_s(Outcome::RolledOver), Some(1.0));
    assert!(monitor.ended());
}

#[test]
fn a_vehicle_on_its_nose_counts_as_rolled_over_past_the_vertical() {
    let mut simulation = on_flat(&sedan(), 0.85, 50.0);
    let mut judged = |pitch_deg: f64| {
        let mut state = *simulation.state();
        state.set_angles(0.0, pitch_deg * DEGREE, 0.0);
        simulation.set_state(state).expect("finite");
        let mut monitor = OutcomeMonitor::new(WIDTH_M);
        let seen = simulation.observation();
        let upright = Observation {
            sideslip_rad: 0.0,
            ..seen
        };
        monitor.observe(&upright, 0.0);
        monitor.outcome()
    };
    assert_eq!(judged(80.0), Outcome::Completed);
    assert_eq!(judged(100.0), Outcome::RolledOver);
}

#[test]
fn sliding_backwards_is_a_spin_and_standing_still_is_none() {
    let mut monitor = OutcomeMonitor::new(WIDTH_M);
    let standing = at(1.0, |o| {
        (o.speed_m_s, o.lateral_speed_m_s, o.sideslip_rad) = (0.0, 0.0, 0.0);
    });
    assert!(monitor.observe(&standing, 0.0));
    let slow = at(2.0, |o| {
        (o.speed_m_s, o.sideslip_rad) = (-4.9, 180.0 * DEGREE);
    });
    assert!(monitor.observe(&slow, 0.0));
    assert_eq!(monitor.outcome(), Outcome::Completed);
    let backwards = at(3.0, |o| {
        (o.speed_m_s, o.sideslip_rad) = (-5.1, 180.0 * DEGREE);
    });
    assert!(!monitor.observe(&backwards, 0.0));
    assert_eq!(monitor.outcome(), Outcome::SpunOut);
}

#[test]
fn a_hard_landing_is_no_outcome() {
    let mut monitor = OutcomeMonitor::new(WIDTH_M);
    let landing = at(1.0, |o| {
        o.wheel_loads_n = [0.0, 15_000.0, 10.0, 12_000.0];
        o.ltr = 1.9;
    });
    assert!(monitor.observe(&landing, 0.0));
    assert_eq!(monitor.outcome(), Outcome::Completed);
    assert_eq!(monitor.two_wheel_lift_s(), None, "one left wheel carries");
}

#[test]
fn roll_is_judged_against_gravity_also_on_a_bank() {
    // A road of 20° bank, the left side higher: the standing vehicle rolls to the right by the bank.
    let bank = Terrain::Plane(Ground {
        height_m: 0.0,
        gradient_x: 0.0,
        gradient_y: (20.0 * DEGREE).tan(),
        friction: 1.0,
    });
    let mut simulation = Simulation::new(&sedan(), bank, pose(30.0)).expect("valid");
    let mut monitor = OutcomeMonitor::new(1000.0);
    for _ in 0..100 {
        let seen = simulation
            .step(Command::from_deg_kmh(0.0, 30.0), TICK_S)
            .expect("finite");
        assert!((15.0..30.0).contains(&(seen.roll_rad / DEGREE)), "{seen:?}");
        assert!(monitor.observe(&seen, 0.0));
    }
    assert_eq!(monitor.outcome(), Outcome::Completed);
}

#[test]
fn what_cannot_be_judged_ends_the_run_without_changing_its_outcome() {
    type Change = fn(&mut Observation);
    let changes: [Change; 4] = [
        |o| o.roll_rad = f64::NAN,
        |o| o.sideslip_rad = f64::INFINITY,
        |o| o.speed_m_s = f64::NAN,
        |o| o.lateral_speed_m_s = f64::NAN,
    ];
    for change in changes {
        let mut monitor = OutcomeMonitor::new(WIDTH_M);
        assert!(monitor.observe(&at(1.0, |_| ()), 3.6));
        assert!(!monitor.observe(&at(2.0, change), 0.0));
        assert!(monitor.ended());
        assert_eq!(monitor.not_finite_s(), Some(2.0));
        assert_eq!(monitor.outcome(), Outcome::LeftRoad);
    }
    let mut monitor = OutcomeMonitor::new(WIDTH_M);
    assert!(!monitor.observe(&at(2.0, |_| ()), f64::NAN));
    assert_eq!(monitor.not_finite_s(), Some(2.0));
}

#[test]
fn other_rules_have_other_outcomes() {
    let rules = OutcomeRules {
        rollover_roll_rad: 0.5,
        ends_at: Outcome::LeftRoad,
        ..OutcomeRules::STANDARD
    };
    let mut monitor = OutcomeMonitor::with_rules(WIDTH_M, rules).expect("allowed");
    assert!(
        !monitor.observe(&at(1.0, |_| ()), 3.6),
        "it ends beside the road"
    );
    assert!(!monitor.observe(&at(2.0, |o| o.roll_rad = 0.6), 0.0));
    assert_eq!(monitor.outcome(), Outcome::RolledOver);

    let only_rollovers = OutcomeRules {
        ends_at: Outcome::RolledOver,
        ..OutcomeRules::STANDARD
    };
    let mut monitor = OutcomeMonitor::with_rules(WIDTH_M, only_rollovers).expect("allowed");
    assert!(monitor.observe(&at(1.0, |o| o.sideslip_rad = 2.0), 0.0));
    assert_eq!(monitor.outcome(), Outcome::SpunOut);
}

#[test]
fn rules_out_of_range_are_refused_with_field_number_and_range() {
    let message = |rules: OutcomeRules| {
        OutcomeMonitor::with_rules(WIDTH_M, rules)
            .expect_err("refused")
            .to_string()
    };
    let standard = OutcomeRules::STANDARD;
    assert!(standard.check().is_ok());
    let wrong = OutcomeRules {
        rollover_roll_rad: 60.0,
        ..standard
    };
    assert_eq!(
        message(wrong),
        "outcome_rules.rollover_roll_rad = 60: must be in [0.1, 3.1] rad"
    );
    let wrong = OutcomeRules {
        spin_least_speed_m_s: f64::NAN,
        ..standard
    };
    assert!(message(wrong).starts_with("outcome_rules.spin_least_speed_m_s = NaN"));
    let wrong = OutcomeRules {
        ends_at: Outcome::Completed,
        ..standard
    };
    assert_eq!(
        message(wrong),
        "outcome_rules.ends_at = completed: must be left_road, spun_out or rolled_over"
    );
}
