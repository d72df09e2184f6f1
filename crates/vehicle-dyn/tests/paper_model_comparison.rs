//! The paper's model beside the 14-degree-of-freedom plant: where they agree, by how much they differ
//! and why, and where the paper's model stops being right.

mod common;
#[path = "paper_model/plants.rs"]
mod plants;

use common::sedan;
use plants::{
    GRAVITY, Plant, StepFigures, TICK_S, bare, full, paper, response, step_figures, without_extras,
};
use vehicle_dyn::paper_model::PaperModelSettings;
use vehicle_dyn::parameters::VehicleParameters;

const SPEEDS_M_S: [f64; 4] = [15.0, 20.0, 25.0, 30.0];
const PAPER: PaperModelSettings = PaperModelSettings::PAPER;
const MATCHED: PaperModelSettings = PaperModelSettings::MATCHED;

/// Handwheel angle for a steady lateral acceleration by the linear model.
fn handwheel_rad(vehicle: &VehicleParameters, speed: f64, lateral_g: f64) -> f64 {
    let Plant::Paper(model) = paper(vehicle, speed, MATCHED) else {
        unreachable!("it was asked for")
    };
    let linear = model.linearise(speed).expect("an allowed speed");
    lateral_g * GRAVITY / linear.dc_gain().expect("stable")[(1, 0)]
}

/// Step figures of the full plant and of the paper's model.
fn both(
    vehicle: &VehicleParameters,
    settings: PaperModelSettings,
    speed: f64,
    lateral_g: f64,
) -> [StepFigures; 2] {
    let handwheel = handwheel_rad(vehicle, speed, lateral_g);
    [
        step_figures(full(vehicle, speed), handwheel, speed),
        step_figures(paper(vehicle, speed, settings), handwheel, speed),
    ]
}

#[test]
fn without_extras_both_plants_turn_alike() {
    // Steady turning then needs nothing but tyres, loads and drag, which both have.
    let vehicle = without_extras(sedan());
    for speed in SPEEDS_M_S {
        for (lateral_g, tolerance) in [(0.05, 2e-3), (0.1, 3e-3), (0.2, 6e-3)] {
            // The part of the yaw gain lost with load transfer grows with its square.
            let [full, model] = both(&vehicle, MATCHED, speed, lateral_g);
            let ratio = model.yaw_gain / full.yaw_gain;
            assert!(
                (ratio - 1.0).abs() < tolerance,
                "{ratio}: {speed} m/s, {lateral_g} g"
            );
        }
    }
}

#[test]
fn without_extras_any_embedded_vehicle_turns_alike_in_both_plants() {
    for name in vehicle_dyn::vehicles::names() {
        let vehicle = vehicle_dyn::vehicles::embedded(name).expect("embedded");
        let [full, model] = both(&without_extras(vehicle), MATCHED, 20.0, 0.05);
        let ratio = model.yaw_gain / full.yaw_gain;
        assert!((ratio - 1.0).abs() < 3e-3, "{name}: {ratio}");
    }
}

#[test]
fn the_full_plants_roll_is_explained_by_what_the_paper_leaves_out() {
    // With roll centres on the ground and no camber gain the full plant is simple enough for a closed
    // form: wheels lean with the body, so the whole mass tips about the ground on springs and tyres in
    // series, and the spinning wheels add their gyroscopic moment.
    let mut vehicle = without_extras(sedan());
    vehicle.geometry.roll_centre_height_front_m = 0.0;
    vehicle.geometry.roll_centre_height_rear_m = 0.0;
    let figures = vehicle.derived();
    let series = |suspension: f64, tyre: f64, track: f64| {
        let tyre = 0.5 * tyre * track * track;
        suspension * tyre / (suspension + tyre)
    };
    let (tyre, geometry) = (&vehicle.tyre, &vehicle.geometry);
    let stiffness = series(
        figures.roll_stiffness_front_nm_per_rad,
        tyre.vertical_stiffness_front_n_per_m,
        geometry.track_front_m,
    ) + series(
        figures.roll_stiffness_rear_nm_per_rad,
        tyre.vertical_stiffness_rear_n_per_m,
        geometry.track_rear_m,
    );
    let weight_m = figures.total_mass_kg * GRAVITY * figures.cg_height_m;
    let inertia = 2.0
        * (vehicle.wheel.gyroscopic_inertia_front_kg_m2
            + vehicle.wheel.gyroscopic_inertia_rear_kg_m2);
    let radius_m = tyre.unloaded_radius_m
        - figures.static_load_front_n / tyre.vertical_stiffness_front_n_per_m / 3.0;
    // In a steady turn spin times yaw rate is lateral acceleration over wheel radius.
    let per_g = weight_m + inertia * GRAVITY / radius_m;
    let roll_per_g = per_g / (stiffness - weight_m);
    let half_track = 0.25 * (geometry.track_front_m + geometry.track_rear_m);
    let ltr_per_g =
        (per_g + weight_m * roll_per_g) / (figures.total_mass_kg * GRAVITY * half_track);
    for speed in SPEEDS_M_S {
        let handwheel = handwheel_rad(&vehicle, speed, 0.05);
        let found = step_figures(full(&vehicle, speed), handwheel, speed);
        let roll = found.roll_per_g / roll_per_g;
        let ltr = found.ltr_per_g / ltr_per_g;
        assert!((roll - 1.0).abs() < 0.01, "roll {roll} at {speed} m/s");
        assert!((ltr - 1.0).abs() < 0.005, "LTR {ltr} at {speed} m/s");
    }
}

#[test]
fn the_matched_model_answers_steps_as_the_sedan_does() {
    for speed in SPEEDS_M_S {
        for lateral_g in [0.05, 0.1, 0.2] {
            let [full, model] = both(&sedan(), MATCHED, speed, lateral_g);
            let context = format!("{speed} m/s, {lateral_g} g: {full:?} and {model:?}");
            // Camber thrust (4 % at 25 m/s), the limited-slip coupling (3 %) and rolling resistance
            // (1.5 %) make the sedan turn less; each found by taking it away. They grow with speed.
            let yaw = model.yaw_gain / full.yaw_gain;
            assert!((1.0..1.13).contains(&yaw), "yaw gain {yaw}: {context}");
            // The paper's undercarriage stays level: the wheels' mass (3.8 % of the roll moment) and
            // their gyroscopic moment (1.2 %) do not roll the body; 1 % for geometry.
            let roll = model.roll_per_g / full.roll_per_g;
            assert!((0.94..1.0).contains(&roll), "roll {roll}: {context}");
            // Of the same moments only the gyroscopic one and the weight that leans less are missing.
            let ltr = model.ltr_per_g / full.ltr_per_g;
            assert!((0.975..1.0).contains(&ltr), "LTR {ltr}: {context}");
            // Relaxed slip: at most 27 ms at 15 m/s, of which the lead of the sedan's lower gain
            // takes a part back.
            let yaw_time = model.yaw_t90_s - full.yaw_t90_s;
            assert!(yaw_time.abs() < 0.027, "t90 of yaw {yaw_time} s: {context}");
            let ltr_time = model.ltr_t90_s - full.ltr_t90_s;
            assert!(ltr_time.abs() < 0.027, "t90 of LTR {ltr_time} s: {context}");
        }
    }
}

#[test]
fn the_papers_roll_axis_halves_the_roll_and_loses_a_tenth_of_the_ltr() {
    // h_SM is 0.45 m from the undercarriage's centre of mass but 0.68 m from the roll centres, and
    // tyres are rigid. The roll angle follows h_SM/(K_s − m_SM g h_SM); of the load transfer only the
    // weight's part is lost.
    for speed in SPEEDS_M_S {
        let [full, model] = both(&sedan(), PAPER, speed, 0.1);
        let roll = model.roll_per_g / full.roll_per_g;
        assert!((0.45..0.52).contains(&roll), "roll {roll} at {speed} m/s");
        let ltr = model.ltr_per_g / full.ltr_per_g;
        assert!((0.89..0.93).contains(&ltr), "LTR {ltr} at {speed} m/s");
    }
}

/// Largest complex difference of yaw rate and of LTR at some frequencies, each over the full plant's
/// gain at 0.2 Hz: a relative error would ask for precision where hardly anything is left to measure.
fn response_errors(vehicle: &VehicleParameters, speed: f64) -> [f64; 2] {
    let handwheel = handwheel_rad(vehicle, speed, 0.05);
    let complex = |[size, angle]: [f64; 2]| [size * angle.cos(), size * angle.sin()];
    let distance = |x: [f64; 2], y: [f64; 2]| {
        let (x, y) = (complex(x), complex(y));
        (x[0] - y[0]).hypot(x[1] - y[1])
    };
    let mut worst = [0.0_f64; 2];
    let mut scale = [0.0; 2];
    for (index, frequency) in [0.2, 0.5, 1.0, 1.5, 2.0].into_iter().enumerate() {
        let found = response(full(vehicle, speed), handwheel, frequency, speed);
        let model = response(paper(vehicle, speed, MATCHED), handwheel, frequency, speed);
        if index == 0 {
            scale = [found.yaw[0], found.ltr[0]];
        }
        worst[0] = worst[0].max(distance(found.yaw, model.yaw) / scale[0]);
        worst[1] = worst[1].max(distance(found.ltr, model.ltr) / scale[1]);
    }
    worst
}

#[test]
fn frequency_responses_agree_up_to_two_hertz() {
    for speed in [20.0, 25.0, 30.0] {
        // A bare vehicle keeps lags of slip of 2 ms: 1.5 % of the gain at 2 Hz, where it has halved.
        let [yaw, ltr] = response_errors(&bare(sedan()), speed);
        assert!(
            yaw < 0.025 && ltr < 0.025,
            "bare, {speed} m/s: {yaw} and {ltr}"
        );
        // The sedan's yaw gain is 6 to 11 % lower than the model's; its slip follows 13 to 20 ms late,
        // 0.16 to 0.25 rad at 2 Hz of the gain that is left there, turned against the former.
        let [yaw, ltr] = response_errors(&sedan(), speed);
        assert!(
            yaw < 0.2 && ltr < 0.2,
            "sedan, {speed} m/s: {yaw} and {ltr}"
        );
    }
}

/// LTR at a lateral acceleration on the way up.
fn ltr_at(run: &[[f64; 2]], lateral_g: f64) -> f64 {
    let after = run
        .iter()
        .position(|[lateral, _]| *lateral >= lateral_g)
        .expect("the ramp goes that far");
    let ([x0, y0], [x1, y1]) = (run[after - 1], run[after]);
    y0 + (y1 - y0) * (lateral_g - x0) / (x1 - x0)
}

#[test]
fn load_transfer_is_right_until_a_wheel_lifts_and_tipping_is_not_seen() {
    // A slow ramp at 25 m/s: 8° of handwheel a second.
    const SPEED: f64 = 25.0;
    let rate = 8.0_f64.to_radians();
    let mut truth = full(&sedan(), SPEED);
    let mut paper_plant = paper(&sedan(), SPEED, PAPER);
    let mut matched = paper(&sedan(), SPEED, MATCHED);
    let mut runs = [Vec::new(), Vec::new(), Vec::new()];
    let mut lift_g = None;
    let mut last = None;
    for tick in 0..1400 {
        let handwheel = rate * TICK_S * f64::from(tick);
        let seen =
            [&mut truth, &mut paper_plant, &mut matched].map(|plant| plant.step(handwheel, SPEED));
        for (run, seen) in runs.iter_mut().zip(seen) {
            run.push([seen.lateral_g, seen.ltr]);
        }
        if seen[0].least_load_n <= 0.0 && lift_g.is_none() {
            lift_g = Some(seen[0].lateral_g);
        }
        last = Some(seen);
        if seen[0].roll_rad > 0.7 {
            break;
        }
    }
    let lift_g = lift_g.expect("the sedan lifts a wheel");
    assert!((0.75..0.85).contains(&lift_g), "{lift_g} g");
    for level in [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75] {
        let [truth, paper, matched] = [0, 1, 2].map(|i| ltr_at(&runs[i], level));
        // As in small steps, and up to 1.5 % less as the sedan's links lift the body (jacking).
        let paper = paper / truth;
        assert!((0.88..0.92).contains(&paper), "{paper} at {level} g");
        let matched = matched / truth;
        assert!((0.96..0.99).contains(&matched), "{matched} at {level} g");
    }
    // The sedan tips over. The models turn on with a lean of less than 10° and an LTR below 1.
    let [truth, models @ ..] = last.expect("the ramp was driven");
    assert!(truth.roll_rad > 0.7, "{truth:?}");
    for model in models {
        assert!(model.roll_rad < 0.17 && model.ltr < 1.0, "{model:?}");
    }
}
