//! The checks that need no folder of trajectories, worked off by all cores.
//!
//! Every job stands alone, and results are put together in the order of the jobs: the report is the same
//! for any number of threads.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result, anyhow, bail};
use benches::validation::manoeuvres::{self, Driven, RolloverTest};
use benches::validation::step::{self, Drive};
use benches::validation::{Row, derived, mechanics, tyre, under};
use indicatif::ProgressBar;
use vehicle_dyn::manoeuvre::{self, ManoeuvreFile};
use vehicle_dyn::parameters::VehicleParameters;

use crate::figures::Figure;
use crate::theory_figures;

/// A piece of the work.
pub enum Job {
    /// Mechanics, derived figures and the tyre of a vehicle.
    Laws(Box<VehicleParameters>),
    /// What a vehicle does in the manoeuvres.
    Manoeuvres(Box<VehicleParameters>),
    /// A scenario with half the step.
    ScenarioStep(Box<Drive>),
    /// A manoeuvre with half the step.
    ManoeuvreStep(Box<VehicleParameters>, Box<ManoeuvreFile>),
    /// Figures of several vehicles.
    Figures(Vec<VehicleParameters>),
}

/// What a job came to.
enum Done {
    Rows(Vec<Row>),
    Driven(Box<Driven>, Vec<Row>),
    Figures(Vec<Figure>),
}

/// What all jobs came to.
#[derive(Default)]
pub struct Found {
    pub rows: Vec<Row>,
    pub tests: Vec<RolloverTest>,
    pub figures: Vec<Figure>,
}

/// All jobs: every embedded vehicle and manoeuvre, and the scenarios of a folder.
pub fn jobs(scenarios: &Path) -> Result<Vec<Job>> {
    let vehicles = vehicle_dyn::vehicles::names()
        .into_iter()
        .map(vehicle_dyn::vehicles::embedded)
        .collect::<Result<Vec<_>, _>>()?;
    let boxed = || vehicles.iter().cloned().map(Box::new);
    let mut jobs: Vec<Job> = boxed().map(Job::Laws).collect();
    jobs.extend(boxed().map(Job::Manoeuvres));
    jobs.extend(
        scenario_drives(scenarios)?
            .into_iter()
            .map(|drive| Job::ScenarioStep(Box::new(drive))),
    );
    for vehicle in boxed() {
        for name in manoeuvre::names() {
            let file = Box::new(manoeuvre::find(name)?);
            jobs.push(Job::ManoeuvreStep(vehicle.clone(), file));
        }
    }
    jobs.push(Job::Figures(vehicles));
    Ok(jobs)
}

fn scenario_drives(folder: &Path) -> Result<Vec<Drive>> {
    let context = || format!("cannot read the folder {}", folder.display());
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(context)? {
        let path = entry.with_context(context)?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            paths.push(path);
        }
    }
    paths.sort();
    let mut drives = Vec::new();
    for path in paths {
        let origin = path.display().to_string();
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {origin}"))?;
        drives.extend(step::scenario_drives(&text, &origin)?);
    }
    Ok(drives)
}

impl Job {
    fn name(&self) -> String {
        match self {
            Self::Laws(vehicle) => format!("{}: mechanics", vehicle.name),
            Self::Manoeuvres(vehicle) => format!("{}: manoeuvres", vehicle.name),
            Self::ScenarioStep(drive) => format!("{}: half the step", drive.name),
            Self::ManoeuvreStep(vehicle, file) => {
                format!("{}: {} with half the step", vehicle.name, file.name)
            }
            Self::Figures(_) => "figures".to_owned(),
        }
    }

    fn run(&self, go_on: &dyn Fn() -> bool) -> Result<Done> {
        if !go_on() {
            bail!("interrupted");
        }
        Ok(match self {
            Self::Laws(vehicle) => {
                let name = &vehicle.name;
                let mut rows = under("mechanics", name, mechanics::rows(vehicle)?);
                rows.extend(under("derived", name, derived::rows(vehicle)?));
                rows.extend(under("tyre", name, tyre::rows(vehicle)));
                Done::Rows(rows)
            }
            Self::Manoeuvres(vehicle) => {
                let driven = manoeuvres::drive(vehicle, go_on)?;
                let rows = under("manoeuvres", &vehicle.name, driven.rows.clone());
                Done::Driven(Box::new(driven), rows)
            }
            Self::ScenarioStep(drive) => {
                Done::Rows(under("step", drive.vehicle_name(), vec![drive.row()?]))
            }
            Self::ManoeuvreStep(vehicle, file) => {
                let row = step::manoeuvre_row(file, vehicle);
                Done::Rows(under("step", &vehicle.name, vec![row]))
            }
            Self::Figures(vehicles) => Done::Figures(theory_figures::of_laws(vehicles)?),
        })
    }
}

/// Works all jobs off; `go_on` is asked between runs.
pub fn work(jobs: &[Job], bar: &ProgressBar, go_on: &(dyn Fn() -> bool + Sync)) -> Result<Found> {
    let next = AtomicUsize::new(0);
    let slots: Vec<Mutex<Option<Result<Done>>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
    let worker = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let (Some(job), Some(slot)) = (jobs.get(index), slots.get(index)) else {
                return;
            };
            bar.set_message(job.name());
            let done = job.run(&|| go_on()).with_context(|| job.name());
            *slot.lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
            bar.inc(1);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(worker);
        }
    });
    let mut found = Found::default();
    let mut driven = Vec::new();
    for slot in slots {
        let done = slot.into_inner().unwrap_or_else(PoisonError::into_inner);
        match done.ok_or_else(|| anyhow!("a thread failed"))?? {
            Done::Rows(rows) => found.rows.extend(rows),
            Done::Driven(done, rows) => {
                found.rows.extend(rows);
                found.tests.extend(done.tests.iter().cloned());
                driven.push(*done);
            }
            Done::Figures(figures) => found.figures.extend(figures),
        }
    }
    found.figures.extend(theory_figures::of_runs(&driven)?);
    Ok(found)
}
