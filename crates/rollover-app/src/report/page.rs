//! The page that shows a campaign's table and figures, in one file that needs no network.

use std::path::Path;

use anyhow::{Context, Result};
use askama::Template;
use vehicle_dyn::metrics::Outcome;

use super::Figure;
use super::table::{HEADINGS, TIME_HEADINGS, cells, time_cells};
use crate::output::write_whole;
use crate::summary::Summary;

/// What the page shows.
pub struct Page<'a> {
    /// Heading.
    pub title: String,
    /// A paragraph under it.
    pub description: &'a str,
    /// Seed of the recording.
    pub seed: u64,
    /// Figures of all runs over one another.
    pub comparison: &'a [Figure],
    /// The runs.
    pub runs: &'a [PageRun],
}

/// One run on the page.
pub struct PageRun {
    /// What is special about its controller.
    pub description: String,
    /// The run's folder, relative to the page.
    pub folder: String,
    /// Its summary.
    pub summary: Summary,
    /// Its figures.
    pub figures: Vec<Figure>,
}

#[derive(Template)]
#[template(path = "index.html")]
struct Index<'a> {
    title: &'a str,
    description: &'a str,
    seed: u64,
    headings: Vec<&'static str>,
    rows: Vec<Row>,
    comparison: &'a [Figure],
    runs: Vec<RunView<'a>>,
}

struct Row {
    cells: Vec<String>,
    safe: bool,
}

struct RunView<'a> {
    name: &'a str,
    outcome: String,
    description: &'a str,
    model: Option<String>,
    folder: &'a str,
    figures: &'a [Figure],
}

/// Writes the page.
///
/// # Errors
/// When the file cannot be written.
pub fn write_index(path: &Path, page: &Page<'_>) -> Result<()> {
    let rows = page.runs.iter().map(|run| Row {
        cells: cells(&run.summary)
            .into_iter()
            .chain(time_cells(&run.summary))
            .collect(),
        safe: run.summary.outcome == Outcome::Completed,
    });
    let runs = page.runs.iter().map(|run| RunView {
        name: &run.summary.controller,
        outcome: run.summary.outcome.to_string(),
        description: &run.description,
        model: run.summary.model.as_ref().map(ToString::to_string),
        folder: &run.folder,
        figures: &run.figures,
    });
    let index = Index {
        title: &page.title,
        description: page.description,
        seed: page.seed,
        headings: HEADINGS.iter().chain(&TIME_HEADINGS).copied().collect(),
        rows: rows.collect(),
        comparison: page.comparison,
        runs: runs.collect(),
    };
    let html = index.render().context("cannot fill in the page")?;
    write_whole(path, &html)
}
