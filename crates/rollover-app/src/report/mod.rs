//! The report: page, figures and tables from run logs. Nothing here simulates or controls.
//!
//! ```text
//! logs ─→ log (what can be read) ─→ collect ─→ data::Report ─→ html, figures, tables
//! ```
//!
//! A campaign adds claims and timing to the [`data::Report`] that [`collect()`] makes of its folder, and
//! calls [`write()`].

mod campaign;
mod cast;
pub(crate) mod chart;
pub mod claims;
mod collect;
mod command;
pub mod data;
mod figures;
mod html;
pub mod log;
pub mod mat;
mod measures;
mod output;
mod pack;
mod panels;
mod paper_figures;
mod plots;
mod scene_file;
mod scene_ground;
mod snapshot;
mod table;
mod tables;

pub use campaign::{CAMPAIGN_FILE, Campaign, CampaignFile, FAILURE_FILE, Failure, TIMING_FILE};
pub(crate) use chart::{FONT, GRID, INK, tick};
pub use collect::{LOG_FILE, SUMMARY_FILE, collect, has_runs};
pub use command::command;
pub use figures::{FIGURE_ENDS, Figure, figures};
pub use html::html;
pub use measures::{outcome, run_figures, seed_rows};
pub use output::{REPORT_FILE, Written, remove_old, write};
pub use paper_figures::PAPER_FIGURES;
pub use scene_file::{SCENE_FILE, SceneFile};
pub use table::summary_table;
pub use tables::{TABLE_NAMES, Table, tables};
