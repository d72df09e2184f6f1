//! Every back end runs the same contract.

use deepc_core::solver::{ActiveRows, ClarabelDirect, ClarabelSettings, contract};

#[test]
fn clarabel_on_the_whole_program_keeps_the_solver_contract() {
    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(ClarabelDirect::new(
            problem,
            ClarabelSettings::default(),
        )?))
    })
    .unwrap();
}

#[test]
fn clarabel_on_the_active_rows_keeps_the_solver_contract() {
    contract::check_qp_solver(&mut |problem| {
        Ok(Box::new(ActiveRows::new(
            problem,
            ClarabelSettings::default(),
        )?))
    })
    .unwrap();
}
