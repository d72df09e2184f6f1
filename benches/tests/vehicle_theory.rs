//! Every embedded vehicle against mechanics and the tyre law.

use benches::validation::{mechanics, tyre};

#[test]
fn every_embedded_vehicle_agrees_with_mechanics_and_its_tyre_law() {
    for name in vehicle_dyn::vehicles::names() {
        let vehicle = vehicle_dyn::vehicles::embedded(name).expect("embedded");
        let rows = mechanics::rows(&vehicle).expect("runs");
        for row in rows.iter().chain(&tyre::rows(&vehicle)) {
            assert!(row.pass, "{name}: {row:?}");
        }
    }
}
