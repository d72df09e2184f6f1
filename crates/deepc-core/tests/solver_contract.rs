//! Every back end runs the same contract.

use deepc_core::solver::{
    ActiveSet, ActiveSetSettings, Admm, AdmmSettings, ClarabelSettings, ClarabelSolver, contract,
};

#[test]
fn clarabel_keeps_the_solver_contract() {
    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(ClarabelSolver::new(
            problem,
            ClarabelSettings::default(),
        )?))
    })
    .unwrap();
}

#[test]
fn the_active_set_keeps_the_solver_contract() {
    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(ActiveSet::new(
            problem,
            ActiveSetSettings::default(),
        )?))
    })
    .unwrap();
}

#[test]
fn admm_keeps_the_solver_contract() {
    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(Admm::new(problem, AdmmSettings::default())?))
    })
    .unwrap();
}

#[cfg(feature = "osqp")]
#[test]
fn osqp_keeps_the_solver_contract() {
    use deepc_core::solver::{OsqpSettings, OsqpSolver};

    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(OsqpSolver::new(problem, OsqpSettings::default())?))
    })
    .unwrap();
}
