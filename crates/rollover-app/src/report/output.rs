//! The files of a report.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::cast::PAPER_SUFFIX;
use super::data::Report;
use super::{FIGURE_ENDS, PAPER_FIGURES, TABLE_NAMES, figures, html, tables};
use crate::output::{create_folder, remove_old_file, write_whole};

/// The page's usual name.
pub const REPORT_FILE: &str = "report.html";
const FIGURES: &str = "figures";
/// Within [`FIGURES`]: one for every plot of the page.
const SCENES: &str = "scenes";
const TABLES: &str = "tables";

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The page.
    pub page: PathBuf,
    /// Its size, bytes.
    pub page_bytes: usize,
    /// Number of figures, beside the page in `figures/` and `figures/scenes/`.
    pub figures: usize,
    /// Number of tables, beside the page in `tables/`.
    pub tables: usize,
}

/// Writes the page to a file, and figures and tables into folders beside it.
///
/// # Errors
/// When a figure cannot be drawn or the folder cannot be written.
pub fn write(report: &Report, page: &Path) -> Result<Written> {
    let folder = folder_of(page);
    let text = html(report)?;
    let (figures, tables) = (figures(report)?, tables(report)?);
    create_folder(folder)?;
    remove_old(page)?;
    for figure in &figures {
        let mut place = folder.join(FIGURES);
        if !figure.of_the_paper {
            place.push(SCENES);
        }
        create_folder(&place)?;
        write_whole(&place.join(format!("{}.svg", figure.name)), &figure.svg)?;
    }
    if !tables.is_empty() {
        create_folder(&folder.join(TABLES))?;
    }
    for table in &tables {
        let file = folder.join(TABLES).join(format!("{}.csv", table.name));
        write_whole(&file, &table.csv)?;
    }
    // The page last: while it is there, what belongs to it is there.
    write_whole(page, &text)?;
    Ok(Written {
        page: page.to_path_buf(),
        page_bytes: text.len(),
        figures: figures.len(),
        tables: tables.len(),
    })
}

/// Removes an earlier report, its figures and tables: beside fresh logs they would lie. Other files
/// stay.
///
/// # Errors
/// When a file cannot be removed.
pub fn remove_old(page: &Path) -> Result<()> {
    let folder = folder_of(page);
    remove_old_file(page)?;
    for table in TABLE_NAMES {
        remove_old_file(&folder.join(TABLES).join(format!("{table}.csv")))?;
    }
    let figures = folder.join(FIGURES);
    remove_figures(&figures.join(SCENES), is_of_a_scene)?;
    // Earlier versions had all in one folder.
    remove_figures(&figures, |name| {
        is_of_the_paper(name) || is_of_a_scene(name)
    })
}

fn remove_figures(folder: &Path, ours: impl Fn(&str) -> bool) -> Result<()> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Ok(());
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_str().and_then(|name| name.strip_suffix(".svg"));
        if name.is_some_and(&ours) {
            remove_old_file(&entry.path())?;
        }
    }
    Ok(())
}

fn is_of_a_scene(name: &str) -> bool {
    let mut ends = FIGURE_ENDS.iter();
    ends.any(|end| name.ends_with(&format!("-{end}")))
}

fn is_of_the_paper(name: &str) -> bool {
    let plain = name.strip_suffix(PAPER_SUFFIX).unwrap_or(name);
    PAPER_FIGURES.contains(&plain)
}

fn folder_of(page: &Path) -> &Path {
    match page.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
