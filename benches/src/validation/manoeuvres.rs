//! What the embedded vehicles do in the standard manoeuvres, and who lifts two wheels.

use std::ops::ControlFlow;

use anyhow::{Context, Result};
use serde::Serialize;
use vehicle_dyn::manoeuvre::{
    self, Figure, Manoeuvre, ManoeuvreFile, ManoeuvreReport, Performed, RunSettings,
};
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::parameters::VehicleParameters;

use super::Row;
use super::derived::free_rolling;

/// NHTSA's rollover tests.
pub const ROLLOVER_TESTS: [&str; 3] = ["j-turn", "fishhook-1a", "fishhook-1b"];
/// The other manoeuvres whose figures are held against something.
const FIGURES: [&str; 2] = ["iso-7401-step", "tilt-table"];
const CIRCLE: &str = "iso-4138-constant-speed";
/// Whether an embedded vehicle should lift two wheels in a rollover test on a road of 0.85: laden
/// ones do, the negative controls do not.
const SHOULD_LIFT: [(&str, bool); 6] = [
    ("sedan", true),
    ("sedan-unladen", false),
    ("utility-truck", true),
    ("utility-truck-laden", true),
    ("suv", true),
    ("hmmwv", false),
];

/// What a vehicle did in one of NHTSA's rollover tests, over all speeds and both directions.
#[derive(Debug, Clone, Serialize)]
pub struct RolloverTest {
    /// The vehicle.
    pub vehicle: String,
    /// The test.
    pub manoeuvre: String,
    /// Handwheel amplitude, deg.
    pub amplitude_deg: Option<f64>,
    /// Whether a run lifts both wheels of a side by two inches.
    pub two_wheel_lift: bool,
    /// Lowest entrance speed with two-wheel lift, mph.
    pub lift_speed_mph: Option<f64>,
    /// Whether a run rolls over.
    pub rolled_over: bool,
    /// Largest height of both wheels of a side, mm.
    pub height_mm: f64,
    /// Largest |LTR| (no unit).
    pub ltr: f64,
    /// Largest |roll angle|, deg.
    pub roll_deg: f64,
    /// Largest |lateral acceleration|, g.
    pub lateral_acceleration_g: f64,
}

/// A vehicle's manoeuvres.
#[derive(Debug, Clone)]
pub struct Driven {
    /// Rows, not yet grouped.
    pub rows: Vec<Row>,
    /// What happened in the rollover tests.
    pub tests: Vec<RolloverTest>,
    /// The rollover tests with their traces.
    pub performed: Vec<Performed>,
    /// The tilt table with its traces.
    pub tilt_table: Performed,
}

/// Performs an embedded manoeuvre; `go_on` is asked after every run.
///
/// # Errors
/// When the manoeuvre is not there, cannot be driven, or is stopped.
pub fn perform(
    name: &str,
    vehicle: &VehicleParameters,
    go_on: &dyn Fn() -> bool,
) -> Result<Performed> {
    perform_file(&manoeuvre::find(name)?, vehicle, go_on)
}

fn perform_file(
    file: &ManoeuvreFile,
    vehicle: &VehicleParameters,
    go_on: &dyn Fn() -> bool,
) -> Result<Performed> {
    file.perform(vehicle, RunSettings::default(), &mut |_| {
        if go_on() {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    })
    .with_context(|| format!("{} with {}", file.name, vehicle.name))
}

/// Drives the rollover tests and the manoeuvres whose figures are known otherwise.
///
/// # Errors
/// As [`perform`].
pub fn drive(vehicle: &VehicleParameters, go_on: &dyn Fn() -> bool) -> Result<Driven> {
    let performed = ROLLOVER_TESTS
        .iter()
        .map(|name| perform(name, vehicle, go_on))
        .collect::<Result<Vec<_>>>()?;
    let tests: Vec<_> = performed
        .iter()
        .map(|done| rollover_test(&done.report))
        .collect();
    let mut rows = lift_rows(&vehicle.name, &tests);
    let [step, tilt] = FIGURES.map(|name| perform(name, vehicle, go_on));
    let tilt_table = tilt?;
    rows.push(understeer_row(vehicle, go_on)?);
    rows.extend(response_rows(&step?.report));
    rows.push(tilt_row(vehicle, &tilt_table.report));
    Ok(Driven {
        rows,
        tests,
        performed,
        tilt_table,
    })
}

/// The figure `name`; NaN, which passes nothing, where it is missing.
fn number(report: &ManoeuvreReport, name: &str) -> f64 {
    report
        .figure(name)
        .and_then(Figure::as_number)
        .unwrap_or(f64::NAN)
}

fn rollover_test(report: &ManoeuvreReport) -> RolloverTest {
    let heights = report.runs.iter().filter_map(|run| {
        run.figure("largest height of both wheels of one side")?
            .as_number()
    });
    RolloverTest {
        vehicle: report.vehicle.clone(),
        manoeuvre: report.manoeuvre.clone(),
        amplitude_deg: report
            .figure("handwheel amplitude")
            .and_then(Figure::as_number),
        two_wheel_lift: report.verdict.passed == Some(false),
        lift_speed_mph: report
            .figure("lowest entrance speed with two-wheel lift")
            .and_then(Figure::as_number),
        rolled_over: report
            .runs
            .iter()
            .any(|run| run.ended == Outcome::RolledOver),
        height_mm: heights.fold(0.0, f64::max),
        ltr: number(report, "largest LTR"),
        roll_deg: number(report, "largest roll angle"),
        lateral_acceleration_g: number(report, "largest lateral acceleration"),
    }
}

fn what_happened(test: &RolloverTest) -> String {
    let end = if test.rolled_over {
        ", and rolls over"
    } else {
        ""
    };
    match test.lift_speed_mph {
        Some(speed) => format!("{}: lifts from {speed} mph on{end}", test.manoeuvre),
        None => format!(
            "{}: both wheels of a side never over {:.1} mm, |LTR| up to {:.3}{end}",
            test.manoeuvre, test.height_mm, test.ltr
        ),
    }
}

/// A negative control lifts in no test, a laden vehicle in one at least.
fn lift_rows(vehicle: &str, tests: &[RolloverTest]) -> Vec<Row> {
    let answer = |lifts: bool| f64::from(u8::from(lifts));
    let known = SHOULD_LIFT.iter().find(|known| known.0 == vehicle);
    let Some((_, should_lift)) = known else {
        return Vec::new();
    };
    let all: Vec<String> = tests.iter().map(what_happened).collect();
    let any = tests.iter().any(|test| test.two_wheel_lift);
    let mut rows = vec![
        Row::absolute(
            "lifts two wheels by 2 in in a NHTSA rollover test (1 is yes)",
            "",
            answer(*should_lift),
            0.0,
            answer(any),
        )
        .remarked(all.join("; ")),
    ];
    if !should_lift {
        rows.extend(tests.iter().map(|test| {
            Row::absolute(
                format!("{}: lifts two wheels by 2 in (1 is yes)", test.manoeuvre),
                "",
                0.0,
                0.0,
                answer(test.two_wheel_lift),
            )
            .remarked(what_happened(test))
        }));
    }
    rows
}

/// Responses come after the steering, and the body rolls after the vehicle turns.
fn response_rows(report: &ManoeuvreReport) -> Vec<Row> {
    let [yaw, lateral, roll] = ["yaw rate", "lateral acceleration", "roll angle"]
        .map(|name| number(report, &format!("{name} response time")));
    let times =
        format!("yaw rate {yaw:.3} s, lateral acceleration {lateral:.3} s, roll {roll:.3} s");
    let holds = |truth: bool| f64::from(u8::from(truth));
    vec![
        Row::absolute(
            "ISO 7401 response times are positive (1 is yes)",
            "",
            1.0,
            0.0,
            holds(yaw > 0.0 && lateral > 0.0 && roll > 0.0),
        )
        .remarked(times.clone()),
        Row::absolute(
            "ISO 7401: the yaw rate responds before lateral acceleration and roll (1 is yes)",
            "",
            1.0,
            0.0,
            holds(yaw < lateral && yaw < roll),
        )
        .remarked(times),
    ]
}

/// The derived gradient is that at straight running without drive, so it is read below 0.1 g from the
/// free-rolling vehicle; what the vehicle as it is gives over the manoeuvre's own range is in the
/// remark.
fn understeer_row(vehicle: &VehicleParameters, go_on: &dyn Fn() -> bool) -> Result<Row> {
    const NAME: &str = "understeer gradient";
    let derived = vehicle.cornering_figures(manoeuvre::find(CIRCLE)?.friction);
    let as_it_is = perform(CIRCLE, vehicle, go_on)?;
    let mut file = manoeuvre::find(CIRCLE)?;
    let mut range = [f64::NAN; 2];
    if let Manoeuvre::Circular(circle) = &mut file.manoeuvre {
        range = [circle.gradient_from_g, circle.gradient_to_g];
        [circle.gradient_from_g, circle.gradient_to_g] = [0.02, 0.08];
        circle.end_lateral_acceleration_g = 0.1;
    }
    let straight = perform_file(&file, &free_rolling(vehicle), go_on)?;
    Ok(Row::relative(
        "ISO 4138 understeer gradient, free-rolling, 0.02 g to 0.08 g: the derived figure",
        "deg/g",
        derived.understeer_gradient_deg_per_g,
        5.0,
        number(&straight.report, NAME),
    )
    .remarked(format!(
        "the vehicle with its drag and differential, from {} g to {} g as in the manoeuvre's file: {:.3} deg/g",
        range[0],
        range[1],
        number(&as_it_is.report, NAME)
    )))
}

fn tilt_row(vehicle: &VehicleParameters, report: &ManoeuvreReport) -> Row {
    // Grip to spare, as on a table with a ledge.
    let quasi_static = vehicle.cornering_figures(2.0).lift_off_g;
    Row::relative(
        "tilt table: lift angle from the derived lift-off",
        "deg",
        quasi_static.atan().to_degrees(),
        5.0,
        number(report, "tilt angle at lift of both wheels"),
    )
    .remarked(format!(
        "linear theory in which both axles lift at once and no stop is met gives {:.1} deg",
        number(report, "lift angle of a vehicle that leans")
    ))
}
