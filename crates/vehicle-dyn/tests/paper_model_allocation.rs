//! A step of the paper's model allocates nothing. The counting allocator of `allocation-counter` serves
//! this test binary alone.

mod common;
#[path = "paper_model/plants.rs"]
mod plants;

use allocation_counter::measure;
use common::sedan;
use plants::{FRICTION, TICK_S, pose};
use vehicle_dyn::paper_model::{PaperModel, PaperModelSettings};
use vehicle_dyn::simulation::Command;

#[test]
fn a_step_allocates_nothing() {
    for settings in [PaperModelSettings::PAPER, PaperModelSettings::MATCHED] {
        let model = PaperModel::with_settings(&sedan(), FRICTION, pose(25.0), settings);
        let mut model = model.expect("valid");
        let mut turned = false;
        let info = measure(|| {
            for tick in 0..500 {
                let command = Command::from_deg_kmh(0.4 * f64::from(tick), 90.0);
                let seen = model.step(command, TICK_S);
                turned |= seen.is_ok_and(|seen| seen.ltr > 0.5);
            }
        });
        assert!(turned, "it did turn");
        assert_eq!(info.count_total, 0, "{settings:?}");
    }
}
