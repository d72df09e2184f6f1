//! `vehicles`: lists the built-in vehicles, checks a file, shows a file to start from.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde::Serialize;
use vehicle_dyn::parameters::{Figure, VehicleParameters, schema};
use vehicle_dyn::vehicles;

use crate::cli::{VehiclesAction, VehiclesArgs};
use crate::output::{fitted_words, print_json, print_text, table_text};
use crate::toml_place::suggested;

/// `vehicles` and what stands behind it.
///
/// # Errors
/// When a vehicle cannot be read or is refused; the message names line or field.
pub fn vehicles(args: &VehiclesArgs) -> Result<()> {
    match &args.action {
        None => list(args),
        Some(VehiclesAction::Check { vehicle }) => check(args, vehicle),
        Some(VehiclesAction::Show { name }) => show(name),
        Some(VehiclesAction::Schema) => print_text(&schema::schema_text()),
    }
}

/// A vehicle by name or file.
///
/// # Errors
/// When it cannot be read or is refused; a misspelt name is answered with the one that is meant.
pub fn load(name_or_path: &str) -> Result<VehicleParameters> {
    let path = Path::new(name_or_path);
    let is_name = path.extension().is_none() && !path.exists();
    if is_name && vehicles::embedded_text(name_or_path).is_none() {
        bail!(
            "there is no vehicle `{name_or_path}`{}; give the path of a vehicle file or one of: {}",
            suggested(name_or_path, vehicles::names()),
            vehicles::names().join(", ")
        );
    }
    Ok(vehicles::find(name_or_path)?)
}

/// A line of the list.
#[derive(Debug, Serialize)]
struct Listed {
    name: &'static str,
    description: String,
    total_mass_kg: f64,
    wheelbase_m: f64,
    static_stability_factor: f64,
    /// Quasi-static, second inner wheel, g.
    lift_off_g: f64,
    /// What the outer wheels hold when they carry all load, g.
    grip_on_two_wheels_g: f64,
    road_friction: f64,
}

fn list(args: &VehiclesArgs) -> Result<()> {
    let mut rows = Vec::new();
    for name in vehicles::names() {
        let vehicle = vehicles::embedded(name)?;
        let figures = vehicle.derived();
        let cornering = vehicle.cornering_figures(args.friction);
        rows.push(Listed {
            name,
            total_mass_kg: figures.total_mass_kg,
            wheelbase_m: figures.wheelbase_m,
            static_stability_factor: figures.static_stability_factor,
            lift_off_g: cornering.lift_off_g,
            grip_on_two_wheels_g: cornering.grip_on_two_wheels_g,
            road_friction: args.friction,
            description: vehicle.description,
        });
    }
    if args.json {
        return print_json(&rows);
    }
    let header = [
        "vehicle",
        "mass, kg",
        "wheelbase, m",
        "SSF",
        "lift-off, g",
        "grip, g",
        "description",
    ];
    let cells = |row: Listed| {
        vec![
            row.name.to_owned(),
            format!("{:.0}", row.total_mass_kg),
            format!("{:.2}", row.wheelbase_m),
            format!("{:.3}", row.static_stability_factor),
            format!("{:.2}", row.lift_off_g),
            format!("{:.2}", row.grip_on_two_wheels_g),
            row.description,
        ]
    };
    let rows: Vec<_> = rows.into_iter().map(cells).collect();
    let words = format!(
        "SSF: static stability factor, half the track over the height of the centre of gravity.\n\
         lift-off: lateral acceleration at which the second inner wheel leaves the ground in a slowly \
         tightening turn, from the parameters; the body rolls, the tyres give way.\n\
         grip: what the outer wheels hold then on a road of friction {}. With less grip than lift-off \
         a vehicle slides in a steady turn, but a quick manoeuvre may still lift it.",
        args.friction
    );
    let table = table_text(&header, &rows, &[1, 2, 3, 4, 5]);
    print_text(&format!("{table}\n{}\n", fitted_words(&words)))
}

/// The report on one vehicle.
#[derive(Debug, Serialize)]
struct Checked<'a> {
    name: &'a str,
    description: &'a str,
    road_friction: f64,
    figures: Vec<CheckedFigure>,
}

#[derive(Debug, Serialize)]
struct CheckedFigure {
    #[serde(flatten)]
    figure: Figure,
    is_usual: bool,
}

fn check(args: &VehiclesArgs, name_or_path: &str) -> Result<()> {
    let vehicle = load(name_or_path)?;
    let figures = vehicle.figures(args.friction);
    if args.json {
        return print_json(&Checked {
            name: &vehicle.name,
            description: &vehicle.description,
            road_friction: args.friction,
            figures: figures
                .into_iter()
                .map(|figure| CheckedFigure {
                    is_usual: figure.is_usual(),
                    figure,
                })
                .collect(),
        });
    }
    print_text(&format!(
        "{}: {}\nEvery value is allowed. What follows from them, on a level road of friction {}:\n{}\n{}\n",
        vehicle.name,
        vehicle.description,
        args.friction,
        figure_table(&figures),
        verdict(&vehicle, &figures)
    ))
}

fn figure_table(figures: &[Figure]) -> String {
    let cells = |figure: &Figure| {
        let usual = figure.usual.map_or_else(String::new, |[low, high]| {
            if high.is_finite() {
                format!("{low} to {high}")
            } else {
                format!("above {low}")
            }
        });
        let flag = if figure.is_usual() {
            String::new()
        } else {
            format!("looks like a wrong unit? See {}", figure.from)
        };
        vec![
            figure.name.to_owned(),
            short(figure.value),
            figure.unit.to_owned(),
            usual,
            flag,
        ]
    };
    let rows: Vec<_> = figures.iter().map(cells).collect();
    table_text(&["figure", "value", "unit", "usual", ""], &rows, &[1])
}

fn verdict(vehicle: &VehicleParameters, figures: &[Figure]) -> String {
    let unusual = figures.iter().filter(|figure| !figure.is_usual()).count();
    match unusual {
        0 => format!(
            "{} looks like a road vehicle in every figure.",
            vehicle.name
        ),
        1 => "1 figure is outside what road vehicles usually have. That is allowed, but look at \
              its units."
            .to_owned(),
        _ => format!(
            "{unusual} figures are outside what road vehicles usually have. That is allowed, but \
             look at their units."
        ),
    }
}

fn show(name: &str) -> Result<()> {
    let text = vehicles::embedded_text(name).with_context(|| {
        format!(
            "there is no built-in vehicle `{name}`{}: choose one of {}",
            suggested(name, vehicles::names()),
            vehicles::names().join(", ")
        )
    })?;
    print_text(text)
}

/// Three or four digits that matter.
fn short(value: f64) -> String {
    let decimals = match value.abs() {
        large if large >= 1000.0 => 0,
        large if large >= 100.0 => 1,
        large if large >= 10.0 => 2,
        _ => 3,
    };
    format!("{value:.decimals$}")
}
