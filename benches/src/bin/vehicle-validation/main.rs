//! Holds the vehicle model against theory, and against the trajectories of an independent model;
//! writes `docs/vehicle-validation.md` and `vehicle-validation.json`.

mod chart;
mod figures;
mod page;
mod theory;
mod theory_figures;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, bail, ensure};
use benches::output;
use benches::reference::parameters::ReferenceParameters;
use benches::reference::trajectory::Trajectory;
use benches::validation::reference::{pairs, rows};
use benches::validation::{Row, under};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use vehicle_dyn::parameters::VehicleParameters;

use figures::Figure;

/// Validates the vehicle model and writes docs/vehicle-validation.md.
#[derive(Debug, Parser)]
#[command(name = "vehicle-validation", version)]
struct Arguments {
    /// Folder of trajectories: `NAME/RUN.csv`, `NAME.parameters.json` and `summary.json`.
    #[arg(long, value_name = "DIR", default_value_os_t = repository().join("benches/reference/vehicle"))]
    data: PathBuf,
    /// Vehicle file to hold against the trajectories of the folder's only vehicle, instead of its
    /// converted parameter set.
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Leave out the checks against theory, which do not depend on the folder.
    #[arg(long)]
    reference_only: bool,
    /// Folder for vehicle-validation.json and the converted vehicle files.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Folder of vehicle-validation.md; its figures go to `images` below it.
    #[arg(long, value_name = "DIR", default_value_os_t = repository().join("docs"))]
    docs: PathBuf,
}

fn repository() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_path_buf()
}

/// Names of the vehicles whose parameter sets `folder` holds.
fn vehicle_names(folder: &Path) -> Result<Vec<String>> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let mut names = Vec::new();
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if let Some(stem) = name.strip_suffix(".parameters.json") {
            names.push(stem.to_owned());
        }
    }
    names.sort();
    Ok(names)
}

/// The vehicles of a folder: given or converted.
fn vehicles(arguments: &Arguments) -> Result<Vec<(String, VehicleParameters)>> {
    let folder = &arguments.data;
    let names = vehicle_names(folder)?;
    if let Some(file) = &arguments.vehicle {
        let vehicle = VehicleParameters::read(file)?;
        let name = match names.as_slice() {
            [only] => only.clone(),
            [] => vehicle.name.clone(),
            several => bail!(
                "{} holds {} vehicles ({}), and --vehicle stands for one: give a folder with one",
                folder.display(),
                several.len(),
                several.join(", ")
            ),
        };
        return Ok(vec![(name, vehicle)]);
    }
    ensure!(
        !names.is_empty(),
        "{} holds no NAME.parameters.json: give one, or a vehicle file by --vehicle",
        folder.display()
    );
    names
        .into_iter()
        .map(|name| {
            let path = folder.join(format!("{name}.parameters.json"));
            let vehicle = ReferenceParameters::read_vehicle(&path, &name)?;
            Ok((name, vehicle))
        })
        .collect()
}

fn against_reference(arguments: &Arguments, bar: &ProgressBar) -> Result<(Vec<Row>, Vec<Figure>)> {
    let mut all = Vec::new();
    let mut figures = Vec::new();
    for (name, vehicle) in vehicles(arguments)? {
        if arguments.vehicle.is_none() {
            let text = format!(
                "# Converted from {name}.parameters.json by `vehicle-validation`; every value follows\n\
                 # from that set by the rules in benches/src/reference/parameters.rs.\n{}",
                toml::to_string(&vehicle)?
            );
            output::write_whole(&arguments.out.join(format!("{name}.toml")), &text)?;
        }
        bar.set_message(format!("{name}: the reference's runs"));
        let runs = Trajectory::read_all(&arguments.data, &name)?;
        let pairs = pairs(&vehicle, runs, || bar.tick())?;
        all.extend(under("reference", &name, rows(&pairs)));
        figures.extend(figures::figures(&name, &pairs)?);
        bar.inc(1);
    }
    Ok((all, figures))
}

/// The experiment that isolates where the reference's own defect makes the difference.
fn against_corrected(bar: &ProgressBar) -> Result<Vec<Row>> {
    bar.set_message("the corrected reference");
    let folder = repository().join("benches/reference/vehicle-corrected");
    let name = "bmw_320i";
    let path = folder.join(format!("{name}.parameters.json"));
    let vehicle = ReferenceParameters::read_vehicle(&path, name)?;
    let pairs = pairs(&vehicle, Trajectory::read_all(&folder, name)?, || {
        bar.tick();
    })?;
    bar.inc(1);
    Ok(under("corrected", name, rows(&pairs)))
}

/// Exit status of a program stopped by Ctrl-C, as shells report it.
const INTERRUPTED_STATUS: i32 = 130;

/// Ctrl-C ends the work at the next run, and a second one at once: files are whole in any case.
fn on_interrupt() -> Result<Arc<AtomicBool>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        if raised.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED_STATUS);
        }
    })?;
    Ok(interrupted)
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let interrupted = on_interrupt()?;
    // Folders first: the work must not end at a folder that cannot be written.
    let images = arguments.docs.join("images");
    for folder in [&arguments.docs, &images, &arguments.out] {
        output::create_writable_folder(folder)?;
    }
    let jobs = if arguments.reference_only {
        Vec::new()
    } else {
        theory::jobs(&repository().join("scenarios"))?
    };
    let bar = ProgressBar::new(jobs.len() as u64 + 2);
    bar.set_style(ProgressStyle::with_template(
        "{elapsed_precise} {bar:30} {pos}/{len} {msg}",
    )?);
    let (mut all, mut figures) = against_reference(&arguments, &bar)?;
    all.extend(against_corrected(&bar)?);
    let found = theory::work(&jobs, &bar, &|| !interrupted.load(Ordering::Relaxed));
    if interrupted.load(Ordering::Relaxed) {
        bar.abandon();
        eprintln!("interrupted: no report was written, and an earlier one is still there");
        std::process::exit(INTERRUPTED_STATUS);
    }
    let found = found?;
    all.extend(found.rows);
    figures.extend(found.figures);
    bar.finish_and_clear();
    for figure in &figures {
        output::write_whole(&images.join(format!("{}.svg", figure.stem)), &figure.svg)?;
    }
    let page = page::page(&all, &found.tests, &figures);
    output::write_whole(&arguments.docs.join("vehicle-validation.md"), &page)?;
    output::write_json(&arguments.out.join("vehicle-validation.json"), &all)?;
    if !found.tests.is_empty() {
        let path = arguments.out.join("vehicle-rollover-tests.json");
        output::write_json(&path, &found.tests)?;
    }
    println!("{}", page::summary(&all));
    Ok(())
}
