//! The page and the text of a manoeuvre.

use anyhow::{Context, Result};
use askama::Template;
use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{CellAlignment, Table};
use vehicle_dyn::manoeuvre::{
    Figure as Merit, ManoeuvreFile, ManoeuvreReport, Performed, RunReport, Value,
};

use super::figures::Figure;
use super::files::{LOG, RUNS};

#[derive(Template)]
#[template(path = "manoeuvre.html")]
struct Page<'a> {
    title: String,
    description: &'a str,
    facts: String,
    verdict: String,
    verdict_class: &'static str,
    warnings: Vec<String>,
    figures: Vec<Row>,
    headings: Vec<String>,
    runs: Vec<RunRow>,
    pictures: &'a [Figure],
    details: Vec<Details<'a>>,
}

struct Row {
    name: String,
    value: String,
    asked: String,
    class: &'static str,
    source: String,
}

struct RunRow {
    name: String,
    cells: Vec<Cell>,
}

struct Cell {
    text: String,
    class: &'static str,
}

struct Details<'a> {
    name: &'a str,
    ended: String,
    log: String,
    figures: Vec<Row>,
}

/// Fills in the page.
pub(super) fn render(
    file: &ManoeuvreFile,
    done: &Performed,
    pictures: &[Figure],
) -> Result<String> {
    let report = &done.report;
    let columns = columns(report);
    let page = Page {
        title: format!("{} with {}", report.manoeuvre, report.vehicle),
        description: &file.description,
        facts: format!("{}. Friction {}.", report.standard, report.friction),
        verdict: report.verdict.to_string(),
        verdict_class: class(report.verdict.passed),
        warnings: report.warnings.iter().map(ToString::to_string).collect(),
        figures: report.figures.iter().map(row).collect(),
        headings: columns
            .iter()
            .map(|column| heading(report, column))
            .collect(),
        runs: report
            .runs
            .iter()
            .map(|run| run_row(run, &columns))
            .collect(),
        pictures,
        details: report
            .runs
            .iter()
            .map(|run| Details {
                name: &run.name,
                ended: run.ended.to_string(),
                log: format!("{RUNS}/{}/{LOG}", run.name),
                figures: run.figures.iter().map(row).collect(),
            })
            .collect(),
    };
    page.render().context("cannot fill in the page")
}

/// The report for a terminal.
pub(super) fn text(report: &ManoeuvreReport) -> String {
    let mut table = Table::new();
    table.load_style(UTF8_HORIZONTAL_ONLY);
    table.set_header(["figure", "value", "required"]);
    for figure in &report.figures {
        let row = row(figure);
        table.add_row([row.name, row.value, row.asked]);
    }
    if let Some(column) = table.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut lines = vec![
        format!(
            "{} with {} on friction {}: {} runs",
            report.manoeuvre,
            report.vehicle,
            report.friction,
            report.runs.len()
        ),
        table.to_string(),
        report.verdict.to_string(),
    ];
    lines.extend(
        report
            .warnings
            .iter()
            .map(|warning| format!("warning: {warning}")),
    );
    lines.join("\n")
}

/// Names of the figures that the table of runs shows: the judged ones, and the measures of rollover.
fn columns(report: &ManoeuvreReport) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for figure in report.runs.iter().rev().flat_map(|run| &run.figures) {
        let measure = ["largest LTR", "largest roll angle", "understeer gradient"];
        let wanted = figure.requirement.is_some() || measure.contains(&figure.name.as_str());
        if wanted && !names.contains(&figure.name) {
            names.push(figure.name.clone());
        }
    }
    names
}

fn heading(report: &ManoeuvreReport, column: &str) -> String {
    let unit = report
        .runs
        .iter()
        .find_map(|run| run.figure(column))
        .map_or("", |figure| &figure.unit);
    if unit.is_empty() {
        column.to_owned()
    } else {
        format!("{column} / {unit}")
    }
}

fn run_row(run: &RunReport, columns: &[String]) -> RunRow {
    let mut cells = vec![Cell {
        text: run.ended.to_string(),
        class: "",
    }];
    cells.extend(columns.iter().map(|column| match run.figure(column) {
        Some(figure) => Cell {
            text: figure.value.to_string(),
            class: class(figure.met),
        },
        None => Cell {
            text: String::new(),
            class: "",
        },
    }));
    RunRow {
        name: run.name.clone(),
        cells,
    }
}

fn row(figure: &Merit) -> Row {
    let unit = if figure.unit.is_empty() || figure.value == Value::Missing {
        String::new()
    } else {
        format!(" {}", figure.unit)
    };
    let note = figure.note.as_ref();
    Row {
        name: figure.name.clone(),
        value: format!("{}{unit}", figure.value),
        asked: figure
            .requirement
            .as_ref()
            .map_or_else(String::new, |asked| {
                let met = match figure.met {
                    Some(true) => "met",
                    Some(false) => "not met",
                    None => "not judged",
                };
                format!("{}: {met}", asked.bound)
            }),
        class: class(figure.met),
        source: match (&figure.requirement, note) {
            (Some(asked), Some(note)) => format!("{}; {note}", asked.source),
            (Some(asked), None) => asked.source.clone(),
            (None, Some(note)) => note.clone(),
            (None, None) => String::new(),
        },
    }
}

fn class(good: Option<bool>) -> &'static str {
    match good {
        Some(true) => "good",
        Some(false) => "bad",
        None => "",
    }
}
