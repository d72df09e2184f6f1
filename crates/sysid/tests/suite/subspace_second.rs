//! The projections written out with all columns of the Hankel matrices, against what is computed
//! from the triangular factor alone.

use crate::subspace_support;
use deepc_core::faer::linalg::solvers::SolveLstsq;
use deepc_core::faer::{Mat, MatRef, Side};
use deepc_core::hankel::{FactorMethod, block_hankel};
use subspace_support::{dataset, distance, generator, poles, random_system, record};
use sysid::{Offsets, SubspaceSettings, Weighting, subspace_model};

/// Rows of a over rows of b.
fn over(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    Mat::from_fn(a.nrows() + b.nrows(), a.ncols(), |i, j| {
        match i.checked_sub(a.nrows()) {
            None => a[(i, j)],
            Some(i) => b[(i, j)],
        }
    })
}

/// The coefficients of the regression of `rows` on `regressors`.
fn regression(rows: &Mat<f64>, regressors: &Mat<f64>) -> Mat<f64> {
    let solution = regressors.transpose().qr().solve_lstsq(rows.transpose());
    solution.transpose().to_owned()
}

/// What the regression leaves.
fn beside(rows: &Mat<f64>, regressors: &Mat<f64>) -> Mat<f64> {
    rows - regression(rows, regressors) * regressors
}

/// The symmetric root of a covariance and its inverse.
fn roots(covariance: &Mat<f64>) -> (Mat<f64>, Mat<f64>) {
    let eigen = covariance.self_adjoint_eigen(Side::Lower).unwrap();
    let u = eigen.U();
    let with = |power: f64| {
        let scaled = Mat::from_fn(u.nrows(), u.ncols(), |i, j| {
            u[(i, j)] * eigen.S()[j].powf(power)
        });
        scaled * u.transpose()
    };
    (with(0.5), with(-0.5))
}

#[test]
fn the_factor_gives_what_the_whole_matrices_give() {
    const ORDER: usize = 4;
    let mut rng = generator(21);
    let truth = random_system(&mut rng, ORDER, 2, 2);
    let parts: Vec<_> = [300, 250]
        .map(|samples| record(&mut rng, &truth, samples, 0.3))
        .to_vec();
    let data = dataset(0.1, 2, &[&parts[0], &parts[1]]);
    let series: Vec<_> = parts
        .iter()
        .map(|rows| Mat::from_fn(rows.len(), 4, |k, j| rows[k][j]))
        .collect();
    for (past, future) in [(7, 7), (5, 9)] {
        let window = past + future;
        let block = |first: usize, from: usize, depth: usize| {
            let part = |s: &Mat<f64>| {
                let samples = s.nrows() + 1 - window + depth - 1;
                s.submatrix(from, first, samples, 2).to_owned()
            };
            let parts: Vec<_> = series.iter().map(part).collect();
            let views: Vec<_> = parts.iter().map(Mat::as_ref).collect();
            block_hankel(&views, depth)
        };
        let past_rows = over(block(0, 0, past).as_ref(), block(2, 0, past).as_ref());
        let (inputs, outputs) = (block(0, past, future), block(2, past, future));
        let all = over(past_rows.as_ref(), inputs.as_ref());
        let oblique = regression(&outputs, &all).subcols(0, past_rows.nrows()) * &past_rows;
        let orthogonal = beside(&oblique, &inputs);
        let rest = beside(&outputs, &inputs);
        let (root, inverse) = roots(&(&rest * rest.transpose()));
        for (weighting, weighted) in [
            (Weighting::N4sid, oblique),
            (Weighting::Moesp, orthogonal.clone()),
            (Weighting::Cva, &inverse * &orthogonal),
        ] {
            let svd = weighted.thin_svd().unwrap();
            let left = svd.U().subcols(0, ORDER);
            let gamma = match weighting {
                Weighting::Cva => &root * left,
                Weighting::Moesp | Weighting::N4sid => left.to_owned(),
            };
            let shorter = gamma.nrows() - 2;
            let a = gamma
                .subrows(0, shorter)
                .qr()
                .solve_lstsq(gamma.subrows(2, shorter));
            let settings = SubspaceSettings {
                past,
                future,
                weighting,
                factor: FactorMethod::Gram,
                offsets: Offsets::Given {
                    inputs: vec![0.0; 2],
                    outputs: vec![0.0; 2],
                },
                ..SubspaceSettings::slicot(past, ORDER)
            };
            let found = subspace_model(&data, &settings).unwrap();
            let model = found.model.matrices();
            let apart = distance(&poles(model.a.as_ref()), &poles(a.as_ref()));
            assert!(apart < 1e-10, "{weighting:?} {past},{future}: {apart:e}");
            let sigma = svd.S().column_vector();
            for (i, value) in found.singular_values.iter().enumerate() {
                let (ours, theirs) = (value / found.singular_values[0], sigma[i] / sigma[0]);
                assert!(
                    (ours - theirs).abs() < 1e-11,
                    "{weighting:?} {i}: {ours} {theirs}"
                );
            }
            if weighting == Weighting::Cva {
                assert!(found.singular_values[0] <= 1.0 + 1e-12);
                assert!((found.singular_values[0] - sigma[0]).abs() < 1e-11);
            }
        }
    }
}
