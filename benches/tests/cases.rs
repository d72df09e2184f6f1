//! The benchmarks measure what their names say.

use benches::backend::{self, ACTIVE_SET};
use benches::case::{Activity, Case};
use benches::replay::Replay;
use deepc_core::program::{CondensedProgram, PredictiveProgram};

/// Bounds active at the moments of a closed loop.
fn active(activity: Activity, output_weight: f64) -> Vec<usize> {
    let case = Case::paper(activity, output_weight);
    assert_eq!(case.columns(), 3001);
    let predictor = case.full_predictor(&case.data());
    let mut program = CondensedProgram::new(&predictor, &case.settings()).unwrap();
    let mut solver = backend::solver(ACTIVE_SET, program.qp(), 1e-9).unwrap();
    // One period of the references.
    let replay = Replay::record(&case, &mut program, solver.as_mut(), 300);
    assert_eq!(replay.len(), 300);
    replay.active().to_vec()
}

fn mean(counts: &[usize]) -> usize {
    counts.iter().sum::<usize>() / counts.len()
}

#[test]
fn no_bound_is_active_where_none_should_be() {
    assert!(active(Activity::None, 0.0).iter().all(|count| *count == 0));
}

#[test]
fn about_25_bounds_are_active_in_most_steps_where_some_should_be() {
    for output_weight in [0.0, 10.0] {
        let counts = active(Activity::Some, output_weight);
        let busy = counts.iter().filter(|count| **count > 0).count();
        println!(
            "Q = {output_weight}: mean {}, busy {busy} of 300",
            mean(&counts)
        );
        assert!((15..=35).contains(&mean(&counts)), "{}", mean(&counts));
        assert!(busy > 240, "{busy}");
    }
}

#[test]
fn all_but_a_few_inputs_stand_at_bounds_where_nearly_all_should() {
    let counts = active(Activity::NearlyAll, 0.0);
    println!("mean {}", mean(&counts));
    assert!((196..=199).contains(&mean(&counts)), "{}", mean(&counts));
}

#[test]
fn an_unknown_back_end_is_answered_with_the_known_ones() {
    let case = Case::paper(Activity::None, 0.0);
    let predictor = case.full_predictor(&case.data());
    let program = CondensedProgram::new(&predictor, &case.settings()).unwrap();
    let Err(error) = backend::solver("simplex", program.qp(), 1e-9) else {
        panic!("`simplex` is no back end");
    };
    assert!(error.to_string().contains(ACTIVE_SET), "{error}");
}
