//! Willems' fundamental lemma on random systems with several inputs and outputs, both ways.

use crate::common;
use common::Lti;
use deepc_core::hankel::{ExcitationReport, HankelMatrix, Horizons, block_hankel, stack};
use faer::prelude::SolveLstsq;
use faer::{Col, Mat};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn config() -> ProptestConfig {
    ProptestConfig {
        cases: 64,
        rng_seed: RngSeed::Fixed(2005),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

#[derive(Debug, Clone)]
struct Sizes {
    n: usize,
    m: usize,
    p: usize,
    window: usize,
    seed: u64,
}

impl Sizes {
    /// Shortest record that can excite: (m + 1)(L + n) − 1.
    fn samples(&self) -> usize {
        (self.m + 1) * (self.window + self.n) - 1
    }

    fn system(&self) -> Lti {
        Lti::random(self.n, self.m, self.p, 0.9, self.seed)
    }
}

/// Windows at least as long as the order, so that the state is determined.
fn sizes() -> impl Strategy<Value = Sizes> {
    (
        1..=4_usize,
        2..=3_usize,
        2..=3_usize,
        0..=4_usize,
        any::<u64>(),
    )
        .prop_map(|(n, m, p, extra, seed)| Sizes {
            n,
            m,
            p,
            window: n.max(2) + extra,
            seed,
        })
}

fn report(records: Vec<(Mat<f64>, Mat<f64>)>, sizes: &Sizes) -> ExcitationReport {
    let horizons = Horizons {
        past: 1,
        future: sizes.window - 1,
    };
    let hankel = HankelMatrix::build(&common::dataset(records), horizons).unwrap();
    hankel.excitation(sizes.n).unwrap()
}

/// [H(u); H(y)] in any row order.
fn stacked(records: &[(Mat<f64>, Mat<f64>)], window: usize) -> Mat<f64> {
    let inputs: Vec<_> = records.iter().map(|r| r.0.as_ref()).collect();
    let outputs: Vec<_> = records.iter().map(|r| r.1.as_ref()).collect();
    let (u, y) = (
        block_hankel(&inputs, window),
        block_hankel(&outputs, window),
    );
    Mat::from_fn(u.nrows() + y.nrows(), u.ncols(), |i, j| {
        match i.checked_sub(u.nrows()) {
            None => u[(i, j)],
            Some(i) => y[(i, j)],
        }
    })
}

/// Distance of `w` from the columns of `matrix`, relative to `w`.
fn distance_from_range(matrix: &Mat<f64>, w: &Col<f64>) -> f64 {
    let svd = matrix.thin_svd().unwrap();
    let s = svd.S().column_vector();
    let rank = s.iter().filter(|&&value| value > 1e-9 * s[0]).count();
    let basis = svd.U().subcols(0, rank);
    let rest = w - basis * (basis.transpose() * w);
    rest.norm_l2() / w.norm_l2()
}

fn trajectory(inputs: &Mat<f64>, outputs: &Mat<f64>) -> Col<f64> {
    let stacked = [stack(inputs.as_ref()), stack(outputs.as_ref())].concat();
    Col::from_fn(stacked.len(), |i| stacked[i])
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn exciting_inputs_give_rank_ml_plus_n(sizes in sizes()) {
        let system = sizes.system();
        let data = common::record(&system, sizes.samples(), 0.0, sizes.seed);
        let report = report(vec![data], &sizes);
        prop_assert!(report.is_persistently_exciting(), "{report}");
        prop_assert_eq!(report.stacked_rank, sizes.m * sizes.window + sizes.n, "{}", report);
    }

    #[test]
    fn one_sample_less_than_the_bound_cannot_excite(sizes in sizes()) {
        let data = common::record(&sizes.system(), sizes.samples() - 1, 0.0, sizes.seed);
        let report = report(vec![data], &sizes);
        prop_assert!(!report.is_persistently_exciting());
        prop_assert_eq!(report.samples_needed, sizes.samples());
    }

    #[test]
    fn short_records_excite_together(sizes in sizes()) {
        let system = sizes.system();
        let depth = sizes.window + sizes.n;
        // Each record alone has depth columns of order L + n, far fewer than m(L + n).
        let records: Vec<_> = (0..2 * sizes.m as u64)
            .map(|i| common::record(&system, 2 * depth - 1, 0.0, sizes.seed ^ (i + 1)))
            .collect();
        let alone = report(vec![records[0].clone()], &sizes);
        prop_assert!(!alone.is_persistently_exciting());
        let together = report(records, &sizes);
        prop_assert!(together.is_persistently_exciting(), "{together}");
        prop_assert_eq!(together.stacked_rank, sizes.m * sizes.window + sizes.n);
    }

    #[test]
    fn poor_inputs_give_a_smaller_rank(sizes in sizes(), kind in 0..3_u8) {
        let system = sizes.system();
        let (mut inputs, _) = common::record(&system, 3 * sizes.samples(), 0.0, sizes.seed);
        for k in 0..inputs.nrows() {
            inputs[(k, 0)] = match kind {
                // Constant; a copy of the other channel; one sine, which excites to order 2 only.
                0 => 3.0,
                1 => 2.0 * inputs[(k, 1)],
                _ => if sizes.window > 2 { (0.7 * k as f64).sin() } else { 0.0 },
            };
        }
        let mut x = Col::from_fn(sizes.n, |i| 1.0 + i as f64);
        let outputs = system.simulate(&mut x, &inputs);
        let report = report(vec![(inputs, outputs)], &sizes);
        prop_assert!(!report.is_persistently_exciting(), "{report}");
        prop_assert!(report.stacked_rank < sizes.m * sizes.window + sizes.n, "{report}");
    }

    #[test]
    fn an_uncontrollable_state_that_rests_is_missing_from_the_data(mut sizes in sizes()) {
        let controllable = sizes.system();
        let n = sizes.n;
        sizes.n += 1;
        sizes.window += 1;
        // One more state, which acts on the others and on the output, but nothing acts on it.
        let mut rng = common::rng(sizes.seed ^ 3);
        let (to_states, to_outputs) =
            (common::gaussian(n, 1, &mut rng), common::gaussian(sizes.p, 1, &mut rng));
        let system = Lti {
            a: Mat::from_fn(n + 1, n + 1, |i, j| match (i == n, j == n) {
                (true, true) => 0.8,
                (true, false) => 0.0,
                (false, true) => to_states[(i, 0)],
                (false, false) => controllable.a[(i, j)],
            }),
            b: Mat::from_fn(n + 1, sizes.m, |i, j| if i == n { 0.0 } else { controllable.b[(i, j)] }),
            c: Mat::from_fn(sizes.p, n + 1, |i, j| {
                if j == n { to_outputs[(i, 0)] } else { controllable.c[(i, j)] }
            }),
            d: controllable.d,
        };
        let inputs = common::gaussian(2 * sizes.samples(), sizes.m, &mut rng);
        let mut at_rest = Col::zeros(n + 1);
        let outputs = system.simulate(&mut at_rest, &inputs);
        let data = vec![(inputs, outputs)];
        let report = report(data.clone(), &sizes);
        prop_assert!(report.is_persistently_exciting());
        prop_assert_eq!(report.stacked_rank, sizes.m * sizes.window + n, "{}", report);

        let inputs = common::gaussian(sizes.window, sizes.m, &mut rng);
        let mut moved = Col::from_fn(n + 1, |i| if i == n { 5.0 } else { 0.0 });
        let outputs = system.simulate(&mut moved, &inputs);
        let distance =
            distance_from_range(&stacked(&data, sizes.window), &trajectory(&inputs, &outputs));
        prop_assert!(distance > 1e-6, "{distance:e}");
    }

    #[test]
    fn every_trajectory_is_a_combination_of_columns(sizes in sizes()) {
        let system = sizes.system();
        let data = vec![common::record(&system, 2 * sizes.samples(), 0.0, sizes.seed)];
        let (inputs, outputs) = common::record(&system, sizes.window, 0.0, sizes.seed ^ 0x63);
        let w = trajectory(&inputs, &outputs);
        let distance = distance_from_range(&stacked(&data, sizes.window), &w);
        prop_assert!(distance < 1e-8, "{distance:e}");
    }

    #[test]
    fn every_combination_of_columns_is_a_trajectory(sizes in sizes()) {
        let system = sizes.system();
        let data = vec![common::record(&system, 2 * sizes.samples(), 0.0, sizes.seed)];
        let h = stacked(&data, sizes.window);
        let mut rng = common::rng(sizes.seed ^ 5);
        let g = common::gaussian(h.ncols(), 1, &mut rng);
        let w = &h * g.col(0);
        let m = sizes.m;
        let inputs = Mat::from_fn(sizes.window, m, |k, i| w[k * m + i]);
        // Forced response, then the state that explains the rest best.
        let forced = system.simulate(&mut Col::zeros(sizes.n), &inputs);
        let rest = Col::from_fn(sizes.window * sizes.p, |i| {
            w[sizes.window * m + i] - forced[(i / sizes.p, i % sizes.p)]
        });
        let free = Mat::from_fn(rest.nrows(), sizes.n, |i, j| {
            let mut unit = Col::from_fn(sizes.n, |k| if k == j { 1.0 } else { 0.0 });
            system.simulate(&mut unit, &Mat::zeros(sizes.window, m))[(i / sizes.p, i % sizes.p)]
        });
        let x = free.qr().solve_lstsq(&rest);
        let error = (&free * &x - &rest).norm_l2() / w.norm_l2();
        prop_assert!(error < 1e-10, "{error:e}");
    }
}
