//! Check 4 of the validation list: the tyre law by itself.

mod common;

use common::sedan;
use proptest::prelude::*;
use vehicle_dyn::parameters::TyreParameters;
use vehicle_dyn::tyre::{MagicFormula, RadialSpring};

const WEIGHT_N: f64 = 12_393.0;

fn tyre() -> TyreParameters {
    sedan().tyre
}

fn formula(tyre: &TyreParameters) -> MagicFormula {
    MagicFormula::new(tyre, tyre.stiffness_factor_b1_front, WEIGHT_N)
}

/// `P(s_c, C1, E1)` of the paper's eq. (magic), written out from the paper.
fn papers_shape(s_c: f64, c1: f64, e1: f64) -> f64 {
    (c1 * (s_c / c1 * (1.0 - e1) + e1 * (s_c / c1).atan()).atan()).sin()
}

#[test]
fn the_shape_has_the_values_of_the_papers_formula_worked_by_hand() {
    // C1 = 1.4 and s_c = 1.4, so s_c/C1 = 1 and its arc tangent is π/4. With E1 = 0.5 the argument
    // is 0.5 + 0.392699 = 0.892699, with E1 = −2 it is 3 − 1.570796 = 1.429204, with E1 = 0.8
    // (beyond the table) 0.2 + 0.628319 = 0.828319.
    for (e1, argument) in [
        (0.0, 1.0_f64),
        (0.5, 0.892_699_081_698_724),
        (-2.0, 1.429_203_673_205_103),
        (0.8, 0.828_318_530_717_959),
    ] {
        let tyre = TyreParameters {
            shape_factor_c1: 1.4,
            curvature_factor_e1: e1,
            ..tyre()
        };
        let formula = formula(&tyre);
        let load = 3000.0;
        let peak = formula.peak_force_n(load, 0.85);
        let slip = 1.4 * peak / formula.stiffness_n(load, 0.85);
        let found = formula.force_n(load, 0.85, [0.0, slip])[1] / peak;
        let expected = (1.4 * argument.atan()).sin();
        assert!((found - expected).abs() < 1e-9, "E1 = {e1}: {found}");
    }
}

#[test]
fn the_peak_at_a_quarter_of_the_weight_is_d1_times_the_load() {
    for mu_road in [0.3, 0.85, 1.0] {
        for q_load in [0.0, 0.8, 1.1, 1.5] {
            let formula = formula(&TyreParameters { q_load, ..tyre() });
            let d1 = tyre().mu_tyre * mu_road;
            let peak = formula.peak_force_n(0.25 * WEIGHT_N, mu_road);
            assert!((peak / (d1 * 0.25 * WEIGHT_N) - 1.0).abs() < 1e-14);
        }
    }
}

#[test]
fn with_the_load_sensitivity_of_the_paper_the_peak_is_its_formula() {
    let formula = formula(&TyreParameters {
        q_load: 1.5,
        ..tyre()
    });
    let d1 = tyre().mu_tyre * 0.85;
    for share in [0.05, 0.2, 0.4, 0.6] {
        let load = share * WEIGHT_N;
        // The paper prints 1.0527 for 1 + (1.5/4)³ = 1.052734…
        let paper = load * 1.0527 * d1 / (1.0 + (1.5 * share).powi(3));
        assert!((formula.peak_force_n(load, 0.85) / paper - 1.0).abs() < 5e-5);
    }
    // Full lateral transfer doubles the load: friction falls to 0.740 of D1.
    let falls = formula.peak_force_n(0.5 * WEIGHT_N, 0.85) / (0.5 * WEIGHT_N * d1);
    assert!((falls - 0.740).abs() < 5e-4, "{falls}");
}

#[test]
fn the_initial_slope_is_the_cornering_stiffness() {
    for (load, mu_road) in [(800.0, 0.85), (3098.25, 0.85), (6000.0, 0.4)] {
        let formula = formula(&tyre());
        let slope = formula.force_n(load, mu_road, [0.0, 1e-6])[1] / 1e-6;
        assert!((slope / formula.stiffness_n(load, mu_road) - 1.0).abs() < 1e-8);
    }
    // At a quarter of the weight it is B1 C1 D1 times the load.
    let t = tyre();
    let normalised = t.stiffness_factor_b1_front * t.shape_factor_c1 * t.mu_tyre * 0.85;
    let stiffness = formula(&t).stiffness_n(0.25 * WEIGHT_N, 0.85);
    assert!((stiffness / (0.25 * WEIGHT_N) / normalised - 1.0).abs() < 1e-12);
}

#[test]
fn a_stiffness_proportional_to_load_is_the_limit_of_small_saturation() {
    let limit = formula(&TyreParameters {
        stiffness_saturation_c2: 0.0,
        ..tyre()
    });
    let small = formula(&TyreParameters {
        stiffness_saturation_c2: 1e-7,
        ..tyre()
    });
    for load in [500.0, 3000.0, 9000.0] {
        assert!((limit.stiffness_n(load, 0.85) / small.stiffness_n(load, 0.85) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_wheel_without_load_has_no_force() {
    for load in [0.0, -1.0, -5000.0] {
        for slip in [[0.0, 0.0], [0.1, -0.2], [5.0, 5.0]] {
            let force = formula(&tyre()).force_n(load, 0.85, slip);
            assert!(force[0].abs() + force[1].abs() < f64::MIN_POSITIVE);
        }
    }
}

#[test]
fn the_radial_spring_pushes_and_never_pulls() {
    let spring = RadialSpring {
        stiffness_n_per_m: 2e5,
        damping_n_s_per_m: 300.0,
    };
    assert!((spring.load_n(0.01, 0.0, 1.0) - 2000.0).abs() < 1e-9);
    assert!((spring.load_n(0.01, 1.0, 1.0) - 2300.0).abs() < 1e-9);
    assert!(spring.load_n(0.001, -10.0, 1.0).abs() < f64::MIN_POSITIVE);
    assert!(spring.load_n(-0.01, 5.0, 1.0).abs() < f64::MIN_POSITIVE);
}

proptest! {
    #[test]
    fn the_force_is_isotropic_and_within_the_peak(
        load in 10.0..12_000.0_f64,
        magnitude in 1e-6..3.0_f64,
        direction in 0.0..std::f64::consts::TAU,
        e1 in -3.0..1.0_f64,
    ) {
        let formula = formula(&TyreParameters { curvature_factor_e1: e1, ..tyre() });
        let (sin, cos) = direction.sin_cos();
        let [fx, fy] = formula.force_n(load, 0.85, [magnitude * cos, magnitude * sin]);
        let along = formula.force_n(load, 0.85, [magnitude, 0.0])[0];
        let peak = formula.peak_force_n(load, 0.85);
        prop_assert!(along <= peak * (1.0 + 1e-12));
        // The same size in every direction, and along the slip.
        prop_assert!((fx.hypot(fy) - along).abs() <= 1e-9 * peak);
        prop_assert!((fx * sin - fy * cos).abs() <= 1e-9 * peak);
        prop_assert!(fx * cos + fy * sin > 0.0);
    }

    #[test]
    fn the_force_is_the_papers_formula(
        load in 10.0..12_000.0_f64,
        slip in 0.0..20.0_f64,
        c1 in 0.5..2.0_f64,
        e1 in -5.0..=1.0_f64,
    ) {
        let tyre = TyreParameters { shape_factor_c1: c1, curvature_factor_e1: e1, ..tyre() };
        let formula = formula(&tyre);
        let peak = formula.peak_force_n(load, 0.85);
        let reduced = formula.stiffness_n(load, 0.85) * slip / peak;
        // The simulation interpolates a table of the shape.
        let exact = peak * papers_shape(reduced, c1, e1);
        let found = formula.force_n(load, 0.85, [0.0, slip])[1];
        prop_assert!((found - exact).abs() <= 1e-9 * peak, "{found} N instead of {exact} N");
    }

    #[test]
    fn friction_scales_the_force(load in 10.0..9000.0_f64, sx in -1.0..1.0_f64, sy in -1.0..1.0_f64) {
        let formula = formula(&tyre());
        let full = formula.force_n(load, 1.0, [sx, sy]);
        let part = formula.force_n(load, 0.4, [sx, sy]);
        prop_assert!((part[0] - 0.4 * full[0]).abs() <= 1e-9 * load);
        prop_assert!((part[1] - 0.4 * full[1]).abs() <= 1e-9 * load);
    }
}
