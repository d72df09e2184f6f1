//! The tyre law of a vehicle against what its constants say.

use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::tyre::MagicFormula;
use vehicle_dyn::units::GRAVITY_M_S2;

use super::Row;

/// Peak at m g/4, initial slope, nothing without load, the same in every direction.
#[must_use]
pub fn rows(vehicle: &VehicleParameters) -> Vec<Row> {
    const ROAD: f64 = 0.85;
    let tyre = &vehicle.tyre;
    let weight = vehicle.derived().total_mass_kg * GRAVITY_M_S2;
    let b1 = tyre.stiffness_factor_b1_front;
    let formula = MagicFormula::new(tyre, b1, weight);
    let (load, d1) = (0.25 * weight, tyre.mu_tyre * ROAD);
    // The largest force over the slip, and the slope at no slip.
    let peak = (1..4000)
        .map(|k| formula.force_n(load, ROAD, [0.0, 5e-4 * f64::from(k)])[1])
        .fold(0.0, f64::max);
    let small = 1e-6;
    let slope = formula.force_n(load, ROAD, [0.0, small])[1] / small;
    let mut anisotropy = 0.0_f64;
    for k in 0..72 {
        let (sin, cos) = (f64::from(k) * 5.0_f64.to_radians()).sin_cos();
        let [x, y] = formula.force_n(load, ROAD, [0.05 * cos, 0.05 * sin]);
        let along = formula.force_n(load, ROAD, [0.05, 0.0])[0];
        anisotropy = anisotropy.max((x.hypot(y) / along - 1.0).abs());
    }
    let unloaded = [0.0, -1000.0]
        .map(|load| formula.force_n(load, ROAD, [0.1, 0.1]))
        .iter()
        .flatten()
        .fold(0.0_f64, |largest, force| largest.max(force.abs()));
    vec![
        Row::relative(
            "largest force F_P at the load m g/4 is D1 m g/4",
            "N",
            d1 * load,
            0.01,
            formula.peak_force_n(load, ROAD),
        ),
        Row::relative(
            "largest force over all slips at the load m g/4",
            "N",
            d1 * load,
            0.1,
            peak,
        )
        .remarked(if peak < 0.999 * d1 * load {
            "C1 < 1 creeps to its peak beyond a slip of 2"
        } else {
            ""
        }),
        Row::relative(
            "initial slope is C_α = B1 C1 D1 m g/4",
            "N",
            b1 * tyre.shape_factor_c1 * d1 * load,
            0.01,
            slope,
        ),
        Row::absolute("force without load", "N", 0.0, 0.0, unloaded),
        Row::absolute(
            "difference of the force with direction",
            "",
            0.0,
            1e-12,
            anisotropy,
        ),
    ]
}
