//! What the statistics count.

use deepc_core::controller::{Controller, Fault, Origin, StepStatistics, run_closed_loop};
use deepc_core::solver::QpStatus;

use crate::plants::{LtiPlant, Mischief, controller, faulty_controller, horizon, to_the_target};

#[test]
fn every_step_is_counted_once_under_what_it_was() {
    let (mut controller, switch) = faulty_controller(horizon(1));
    let mut plant = LtiPlant::at_rest();
    let (mut iterations, mut violation, mut residual) = (0, 0.0_f64, 0.0_f64);
    let mut origins = Vec::new();
    for k in 0..30 {
        *switch.lock().unwrap() = if (12..15).contains(&k) {
            Mischief::Ends(QpStatus::IterationLimit)
        } else {
            Mischief::None
        };
        let run = run_closed_loop(&mut plant, &mut controller, 1, to_the_target).unwrap();
        origins.push(run.origins[0]);
        let step = controller.step();
        iterations += u64::from(step.iterations);
        violation = violation.max(step.predicted_violation);
        residual = residual.max(step.residual);
    }
    let statistics = controller.statistics();
    for origin in [
        Origin::Passthrough,
        Origin::Solver,
        Origin::Fallback,
        Origin::User,
    ] {
        let expected = origins.iter().filter(|&&o| o == origin).count() as u64;
        assert_eq!(statistics.origins.of(origin), expected, "{origin:?}");
    }
    assert_eq!(statistics.steps, 30);
    assert_eq!(statistics.origins.fallback, 3);
    assert_eq!(statistics.faults.of(Fault::SolveFailed), 3);
    assert_eq!(statistics.statuses.of(QpStatus::IterationLimit), 3);
    assert_eq!(statistics.statuses.of(QpStatus::NotRun), 4);
    assert_eq!(statistics.statuses.solved, 23);
    assert_eq!(statistics.solve_times.count(), 26);
    assert_eq!(statistics.iterations, iterations);
    assert_eq!(statistics.longest_fallback, 3);
    assert_eq!(
        statistics.largest_predicted_violation.to_bits(),
        violation.to_bits()
    );
    assert_eq!(statistics.largest_residual.to_bits(), residual.to_bits());
    assert!(statistics.max_iterations > 0 && residual > 0.0);

    let text = statistics.to_string();
    for part in [
        "30 steps: 4 passthrough, 23 solver, 3 fallback",
        "faults: 3 solve failed",
        "solves: 4 not run, 23 solved, 3 iteration limit",
        "solve time: min ",
        "longest fallback 3 steps",
    ] {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }

    let json = serde_json::to_string(statistics).unwrap();
    assert!(json.contains("\"median_ns\""), "{json}");
    let mut back: StepStatistics = serde_json::from_str(&json).unwrap();
    // Numbers in JSON may be off by a rounding.
    assert!((back.largest_residual / residual - 1.0).abs() < 1e-15);
    back.largest_residual = residual;
    back.largest_predicted_violation = violation;
    assert_eq!(&back, statistics);
    let torn = json.replacen("\"buckets\":[[", "\"buckets\":[[99999,1],[", 1);
    assert!(serde_json::from_str::<StepStatistics>(&torn).is_err());

    controller.reset_statistics();
    assert_eq!(controller.statistics(), &StepStatistics::default());
    assert!(controller.statistics().to_string().contains("faults: none"));
}

#[test]
fn a_reset_starts_the_statistics_anew() {
    let mut controller = controller(1);
    run_closed_loop(&mut LtiPlant::at_rest(), &mut controller, 10, to_the_target).unwrap();
    assert_eq!(controller.statistics().steps, 10);
    controller.reset();
    assert_eq!(controller.statistics(), &StepStatistics::default());
}
