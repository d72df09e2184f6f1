//! The files of a manoeuvre.

use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, Result};
use vehicle_dyn::manoeuvre::ManoeuvreReport;

use super::figures::Figure;
use crate::output::{create_folder, write_json, write_whole};

/// The folder of the runs.
pub(super) const RUNS: &str = "runs";
/// The log of one run, in the run's folder.
pub(super) const LOG: &str = "log.csv";
/// The figures of merit, for programs.
const SUMMARY: &str = "summary.json";
/// The same for people, with pictures.
pub(super) const PAGE: &str = "index.html";
/// Pictures have names that begin so: only those are ours to remove.
pub(super) const PICTURE: &str = "figure-";

/// Makes the folder and removes what an earlier manoeuvre wrote there, and nothing else: beside fresh
/// logs it would lie if this one is interrupted.
pub(super) fn prepare(folder: &Path) -> Result<()> {
    create_folder(folder)?;
    // The page first: it must not stand over files that are gone.
    remove(&folder.join(PAGE))?;
    remove(&folder.join(SUMMARY))?;
    for name in names_in(folder)? {
        let stem = name.strip_suffix(".svg");
        if stem.is_some_and(|stem| stem.starts_with(PICTURE)) {
            remove(&folder.join(&name))?;
        }
    }
    let runs = folder.join(RUNS);
    if runs.is_dir() {
        for run in names_in(&runs)? {
            let folder = runs.join(run);
            if folder.join(LOG).is_file() {
                remove(&folder.join(LOG))?;
                // Whatever else is in it is the user's and keeps it.
                let _ = std::fs::remove_dir(&folder);
            }
        }
    }
    Ok(())
}

/// Writes what is known at the end. The page comes last: where it stands, all is there.
pub(super) fn write_all(
    folder: &Path,
    report: &ManoeuvreReport,
    figures: &[Figure],
    page: &str,
) -> Result<()> {
    for figure in figures {
        write_whole(&folder.join(&figure.file), &figure.svg)?;
    }
    write_json(&folder.join(SUMMARY), report)?;
    write_whole(&folder.join(PAGE), page)
}

fn names_in(folder: &Path) -> Result<Vec<String>> {
    let reading = || format!("cannot read the output folder {}", folder.display());
    let entries = std::fs::read_dir(folder).with_context(reading)?;
    entries
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<Result<_, std::io::Error>>()
        .with_context(reading)
}

fn remove(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(e).with_context(|| format!("cannot replace {}", path.display()))
        }
        _ => Ok(()),
    }
}
