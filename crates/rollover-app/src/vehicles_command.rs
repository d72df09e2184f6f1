//! `vehicles`: lists the built-in vehicles, checks a file, shows a file to start from.

use anyhow::{Context, Result};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
use serde::Serialize;
use vehicle_dyn::parameters::{Figure, VehicleParameters, schema};
use vehicle_dyn::vehicles;

use crate::cli::{VehiclesAction, VehiclesArgs};
use crate::output::{print_json, print_line, print_text};

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
    let mut table = table(&[
        "vehicle",
        "mass, kg",
        "wheelbase, m",
        "SSF",
        "lift-off, g",
        "grip, g",
        "description",
    ]);
    for row in rows {
        table.add_row(vec![
            row.name.to_owned(),
            format!("{:.0}", row.total_mass_kg),
            format!("{:.2}", row.wheelbase_m),
            format!("{:.3}", row.static_stability_factor),
            format!("{:.2}", row.lift_off_g),
            format!("{:.2}", row.grip_on_two_wheels_g),
            row.description,
        ]);
    }
    align_right(&mut table, 1..6);
    print_line(&table.to_string())?;
    print_line(&format!(
        "SSF: static stability factor, half the track over the height of the centre of gravity.\n\
         lift-off: lateral acceleration at which the second inner wheel leaves the ground in a slowly \
         tightening turn, from the parameters; the body rolls, the tyres give way.\n\
         grip: what the outer wheels hold then on a road of friction {}. With less grip than lift-off \
         a vehicle slides in a steady turn, but a quick manoeuvre may still lift it.",
        args.friction
    ))
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
    let vehicle = vehicles::find(name_or_path)?;
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
    print_line(&format!(
        "{}: {}\nEvery value is allowed. What follows from them, on a level road of friction {}:",
        vehicle.name, vehicle.description, args.friction
    ))?;
    print_line(&figure_table(&figures))?;
    print_line(&verdict(&vehicle, &figures))
}

fn figure_table(figures: &[Figure]) -> String {
    let mut table = table(&["figure", "value", "unit", "usual", ""]);
    for figure in figures {
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
        table.add_row(vec![
            figure.name.to_owned(),
            short(figure.value),
            figure.unit.to_owned(),
            usual,
            flag,
        ]);
    }
    align_right(&mut table, 1..2);
    table.to_string()
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
            "there is no built-in vehicle `{name}`: choose one of {}",
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

fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(header.to_vec());
    table
}

fn align_right(table: &mut Table, columns: std::ops::Range<usize>) {
    for index in columns {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
}
