//! `scenarios`: lists the built-in scenarios and manoeuvres, shows a file to start from, checks a file.

use std::path::Path;

use anyhow::{Result, anyhow};
use serde::Serialize;
use vehicle_dyn::manoeuvre;

use crate::cli::{ScenariosAction, ScenariosArgs};
use crate::output::{fitted_words, print_json, print_text, table_text};
use crate::scenario::{self, Scenario};
use crate::toml_place::suggested;

/// `scenarios` and what stands behind it.
///
/// # Errors
/// When there is no such scenario or manoeuvre, or a file is refused; the message names line or field.
pub fn scenarios(args: &ScenariosArgs) -> Result<()> {
    match &args.action {
        None => list(args),
        Some(ScenariosAction::Show { name }) => show(name),
        Some(ScenariosAction::Check { file }) => check(args, file),
    }
}

/// What a file describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Scenario,
    Manoeuvre,
}

/// A line of the list, and what a check finds.
#[derive(Debug, Serialize)]
struct Listed {
    name: String,
    kind: Kind,
    description: String,
    /// Of a scenario.
    vehicle: Option<String>,
    /// Of a scenario, the driver alone first.
    controllers: Vec<String>,
    /// Of a manoeuvre.
    standard: Option<String>,
}

impl Listed {
    fn scenario(scenario: &Scenario) -> Self {
        let names = scenario.controller_names().into_iter().map(str::to_owned);
        Self {
            name: scenario.name.clone(),
            kind: Kind::Scenario,
            description: scenario.description.clone(),
            vehicle: Some(scenario.vehicle.clone()),
            controllers: names.collect(),
            standard: None,
        }
    }

    fn manoeuvre(file: manoeuvre::ManoeuvreFile) -> Self {
        Self {
            name: file.name,
            kind: Kind::Manoeuvre,
            description: file.description,
            vehicle: None,
            controllers: Vec::new(),
            standard: Some(file.standard),
        }
    }
}

fn list(args: &ScenariosArgs) -> Result<()> {
    let mut all = Vec::new();
    for name in scenario::embedded_names() {
        all.push(Listed::scenario(&scenario::load(name)?));
    }
    for name in manoeuvre::names() {
        all.push(Listed::manoeuvre(manoeuvre::find(name)?));
    }
    if args.json {
        return print_json(&all);
    }
    let rows = |kind| {
        let of_kind = all.iter().filter(|listed| listed.kind == kind);
        of_kind
            .map(|listed| vec![listed.name.clone(), first_sentence(&listed.description)])
            .collect::<Vec<_>>()
    };
    print_text(&format!(
        "{}\n\n{}\n\n{}\n",
        table_text(&["scenario", "description"], &rows(Kind::Scenario), &[]),
        table_text(&["manoeuvre", "description"], &rows(Kind::Manoeuvre), &[]),
        fitted_words(
            "Drive them with `run` and `manoeuvre`. `scenarios show NAME` prints a file to start one \
             of your own from."
        ),
    ))
}

/// A line's worth of a description.
fn first_sentence(description: &str) -> String {
    let end = description
        .find(". ")
        .map_or(description.len(), |at| at + 1);
    description[..end].to_owned()
}

fn show(name: &str) -> Result<()> {
    let text = scenario::embedded_text(name).or_else(|| manoeuvre::embedded_text(name));
    print_text(text.ok_or_else(|| unknown(name))?)
}

fn unknown(name: &str) -> anyhow::Error {
    let known: Vec<&str> = scenario::embedded_names()
        .into_iter()
        .chain(manoeuvre::names())
        .collect();
    anyhow!(
        "there is no built-in scenario or manoeuvre `{name}`{}: choose one of {}",
        suggested(name, known.iter().copied()),
        known.join(", ")
    )
}

fn check(args: &ScenariosArgs, name_or_path: &str) -> Result<()> {
    let path = Path::new(name_or_path);
    let is_file = path.is_file() || path.extension().is_some_and(|end| end == "toml");
    let listed = if is_manoeuvre(name_or_path, is_file) {
        Listed::manoeuvre(crate::manoeuvre::load(name_or_path)?)
    } else if is_file || scenario::embedded_text(name_or_path).is_some() {
        let scenario = scenario::load(name_or_path)?;
        // What a run would need beside the file.
        let vehicle = crate::vehicles_command::load(&scenario.vehicle)?;
        scenario.driver_of(&vehicle)?;
        Listed::scenario(&scenario)
    } else {
        return Err(unknown(name_or_path));
    };
    if args.json {
        return print_json(&listed);
    }
    let what = match listed.kind {
        Kind::Scenario => format!(
            "scenario {}: vehicle {}, controllers {}",
            listed.name,
            listed.vehicle.unwrap_or_default(),
            listed.controllers.join(", ")
        ),
        Kind::Manoeuvre => format!(
            "manoeuvre {}: {}",
            listed.name,
            listed.standard.unwrap_or_default()
        ),
    };
    let words = format!("{name_or_path}: every value is allowed\n{what}");
    print_text(&(fitted_words(&words) + "\n"))
}

/// Manoeuvre files have a table of that name.
fn is_manoeuvre(name_or_path: &str, is_file: bool) -> bool {
    if !is_file {
        return manoeuvre::embedded_text(name_or_path).is_some();
    }
    std::fs::read_to_string(name_or_path).is_ok_and(|text| {
        text.lines().any(|line| {
            let line = line.trim_start();
            line.starts_with("[manoeuvre]") || line.starts_with("manoeuvre ")
        })
    })
}
