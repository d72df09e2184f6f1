//! Figures and pages drawn from run logs. Nothing here simulates or controls.

pub(crate) mod chart;
mod figures;
mod page;
mod table;

pub(crate) use chart::{FONT, GRID, INK, tick};
pub use figures::{FIGURE_NAMES, Figure, Polyline, RunTrace, draw_all};
pub use page::{Page, PageRun, write_index};
pub use table::summary_table;
