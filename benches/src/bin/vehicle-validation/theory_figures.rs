//! The report's figures of the checks against theory, and of the manoeuvres.

use anyhow::Result;
use benches::validation::manoeuvres::Driven;
use benches::validation::mechanics::{change_of_ltr, roll_energy};
use vehicle_dyn::manoeuvre::{Manoeuvre, Trace, TraceRow, find};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::tyre::MagicFormula;
use vehicle_dyn::units::{DEGREE, GRAVITY_M_S2};

use crate::chart::{Line, Panel, panels};
use crate::figures::Figure;

/// Enough points for the width of a figure.
const POINTS: usize = 250;

fn line(name: &str, points: Vec<(f64, f64)>) -> Line {
    let every = points.len().div_ceil(POINTS).max(1);
    Line {
        name: name.to_owned(),
        reference: false,
        points: points.into_iter().step_by(every).collect(),
    }
}

fn panel(axis: &str, lines: Vec<Line>) -> Panel {
    Panel {
        axis: axis.to_owned(),
        lines,
        marks: Vec::new(),
    }
}

/// Figures of mechanics, tyre and step.
pub fn of_laws(vehicles: &[VehicleParameters]) -> Result<Vec<Figure>> {
    let mut figures = vec![energy(vehicles)?];
    if let Some(vehicle) = vehicles.first() {
        figures.push(force_over_slip(vehicle)?);
        figures.push(peak_over_load(vehicle)?);
    }
    figures.push(convergence(vehicles)?);
    Ok(figures)
}

fn energy(vehicles: &[VehicleParameters]) -> Result<Figure> {
    let lines = vehicles
        .iter()
        .map(|vehicle| {
            let energies = roll_energy(vehicle, 10.0)?;
            let lost = energies.into_iter().map(|(t, e)| (t, 1e6 * (1.0 - e)));
            Ok(line(&vehicle.name, lost.collect()))
        })
        .collect::<Result<_>>()?;
    Ok(Figure {
        group: "mechanics",
        stem: "vehicle-roll-energy".into(),
        caption:
            "Energy lost by a free roll without dampers, in millionths of what it had; the bound \
            is 1000 a second."
                .into(),
        svg: panels(
            "Free roll without dampers",
            "time, s",
            false,
            &[panel("energy lost, 1e-6", lines)],
        )?,
    })
}

const LOAD_SENSITIVITIES: [f64; 3] = [0.8, 1.1, 1.5];
const ROAD: f64 = 0.85;

/// The vehicle's tyre with each `q_load`: name, formula, weight (N).
fn tyres(vehicle: &VehicleParameters) -> [(String, MagicFormula, f64); 3] {
    let weight = vehicle.derived().total_mass_kg * GRAVITY_M_S2;
    LOAD_SENSITIVITIES.map(|q_load| {
        let mut tyre = vehicle.tyre.clone();
        tyre.q_load = q_load;
        let formula = MagicFormula::new(&tyre, tyre.stiffness_factor_b1_front, weight);
        (format!("q_load {q_load}"), formula, weight)
    })
}

fn force_over_slip(vehicle: &VehicleParameters) -> Result<Figure> {
    let over = |share: f64| {
        tyres(vehicle)
            .iter()
            .map(|(name, formula, weight)| {
                let load = share * weight;
                let points = (0_u32..=240).map(|k| {
                    let slip = 0.5 * f64::from(k) / 240.0;
                    (slip, formula.force_n(load, ROAD, [0.0, slip])[1] / load)
                });
                line(name, points.collect())
            })
            .collect()
    };
    Ok(Figure {
        group: "tyre",
        stem: "vehicle-tyre-slip".into(),
        caption: format!(
            "Side force over load of a tyre of the {} over its slip, at m g/4 and, all load on two \
             wheels, at m g/2.",
            vehicle.name
        ),
        svg: panels(
            "Tyre force over slip",
            "lateral slip",
            false,
            &[
                panel("F/Fz at m g/4", over(0.25)),
                panel("F/Fz at m g/2", over(0.5)),
            ],
        )?,
    })
}

fn peak_over_load(vehicle: &VehicleParameters) -> Result<Figure> {
    let lines = tyres(vehicle)
        .iter()
        .map(|(name, formula, weight)| {
            let points = (1_u32..=240).map(|k| {
                let share = 0.75 * f64::from(k) / 240.0;
                (share, formula.peak_force_n(share * weight, ROAD) / weight)
            });
            line(name, points.collect())
        })
        .collect();
    Ok(Figure {
        group: "tyre",
        stem: "vehicle-tyre-load".into(),
        caption:
            "Largest force of a tyre over its load; at a quarter of the weight it is the same for \
            every q_load."
                .into(),
        svg: panels(
            "Largest tyre force over load",
            "Fz/(m g)",
            false,
            &[panel("F_P/(m g)", lines)],
        )?,
    })
}

fn convergence(vehicles: &[VehicleParameters]) -> Result<Figure> {
    let lines = vehicles
        .iter()
        .map(|vehicle| {
            let points = [2.0, 1.0, 0.5, 0.25]
                .map(|step_ms: f64| -> Result<(f64, f64)> {
                    let step_s = 1e-3 * step_ms;
                    let change = change_of_ltr(vehicle, [step_s, 0.5 * step_s])?;
                    Ok((step_ms, change.max(1e-16).log10()))
                })
                .into_iter()
                .collect::<Result<_>>()?;
            Ok(line(&vehicle.name, points))
        })
        .collect::<Result<_>>()?;
    Ok(Figure {
        group: "step",
        stem: "vehicle-convergence".into(),
        caption:
            "Largest change of LTR with half the step, swinging to 0.5 g with all wheels on the \
            ground, for steps of 2, 1, 0.5 and 0.25 ms. The tolerance is at −3."
                .into(),
        svg: panels(
            "Convergence",
            "step, ms",
            true,
            &[panel("log10 of the change of LTR", lines)],
        )?,
    })
}

/// Figures of the tilt table and the rollover tests.
pub fn of_runs(driven: &[Driven]) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    if !driven.is_empty() {
        figures.push(tilt_table(driven)?);
    }
    for one in driven {
        figures.push(rollover_tests(one)?);
    }
    Ok(figures)
}

fn tilt_table(driven: &[Driven]) -> Result<Figure> {
    let Manoeuvre::TiltTable(table) = find("tilt-table")?.manoeuvre else {
        anyhow::bail!("the embedded tilt-table is another manoeuvre");
    };
    let mut all = panel("LTR", Vec::new());
    for one in driven {
        let report = &one.tilt_table.report;
        let trace = one.tilt_table.traces.first();
        let points: Vec<(f64, f64)> = trace.map_or_else(Vec::new, |trace| {
            let angle = |row: &TraceRow| table.tilt_rate_deg_per_s * row.seen.time_s;
            let rows = trace.rows.iter();
            rows.map(|row| (angle(row), row.seen.ltr_of_sum)).collect()
        });
        all.marks.extend(points.last());
        all.lines.push(line(&report.vehicle, points));
    }
    Ok(Figure {
        group: "mechanics",
        stem: "vehicle-tilt-table".into(),
        caption:
            "Load transfer over the angle of the tilt table, of the vehicles as they are; the \
            circle is where both upper wheels lift."
                .into(),
        svg: panels("Tilt table", "angle of the table, deg", false, &[all])?,
    })
}

/// The last run to the left of each test: the one that lifts, or the fastest.
fn rollover_tests(driven: &Driven) -> Result<Figure> {
    let runs: Vec<(&str, &Trace)> = driven
        .performed
        .iter()
        .filter_map(|done| {
            let left = |trace: &&Trace| trace.name.starts_with("left");
            let trace = done.traces.iter().rfind(left)?;
            Some((done.report.manoeuvre.as_str(), trace))
        })
        .collect();
    let signal = |axis: &str, value: fn(&TraceRow) -> f64| {
        let of = |(name, trace): &(&str, &Trace)| {
            let speed = trace.name.trim_start_matches("left-").replace('-', " ");
            line(&format!("{name}, {speed}"), trace.signal(value))
        };
        panel(axis, runs.iter().map(of).collect())
    };
    let vehicle = driven
        .tests
        .first()
        .map_or_else(String::new, |test| test.vehicle.clone());
    Ok(Figure {
        group: "manoeuvres",
        stem: format!("vehicle-{vehicle}-rollover-tests"),
        caption: format!(
            "{vehicle}: the run of each rollover test, first turn to the left, that lifts two wheels, or \
             else the fastest."
        ),
        svg: panels(
            &format!("NHTSA rollover tests: {vehicle}"),
            "time, s",
            false,
            &[
                signal("handwheel, deg", |row| row.handwheel_command_rad / DEGREE),
                signal("LTR", |row| row.seen.ltr),
                signal("roll, deg", |row| row.seen.roll_rad / DEGREE),
                signal("both wheels of a side up, mm", |row| {
                    1e3 * row.seen.pair_clearance_m()
                }),
            ],
        )?,
    })
}
