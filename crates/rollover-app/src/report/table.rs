//! The table at the end of a campaign.

use comfy_table::presets::UTF8_HORIZONTAL_ONLY;
use comfy_table::{CellAlignment, Table};

use crate::output::fitted;
use crate::summary::Summary;

/// Column headings shared by the terminal's table and the page.
pub(super) const HEADINGS: [&str; 10] = [
    "controller",
    "seed",
    "outcome",
    "end s",
    "max |LTR|",
    "|LTR| > 1 s",
    "min km/h",
    "mean km/h",
    "off path m",
    "cost",
];

/// The cells of one run, in the order of [`HEADINGS`].
pub(super) fn cells(run: &Summary) -> Vec<String> {
    vec![
        run.controller.clone(),
        run.seed.to_string(),
        run.outcome.to_string(),
        format!("{:.2}", run.end_time_s),
        format!("{:.3}", run.ltr_abs_max),
        format!("{:.2}", run.ltr_violation_s),
        format!("{:.1}", run.speed_min_kmh),
        format!("{:.1}", run.speed_mean_kmh),
        format!("{:.2}", run.path_deviation_max_m),
        run.cost
            .map_or_else(|| "–".into(), |cost| format!("{cost:.3e}")),
    ]
}

/// Headings and cells of the times of a step.
pub(super) const TIME_HEADINGS: [&str; 3] = ["step µs median", "p99", "max"];

pub(super) fn time_cells(run: &Summary) -> Vec<String> {
    let t = run.step_time_us;
    if t.max == 0.0 {
        // The driver alone decides nothing that could be timed.
        return ["–"; 3].map(str::to_owned).to_vec();
    }
    [t.median, t.p99, t.max]
        .map(|us| format!("{us:.0}"))
        .to_vec()
}

/// One line per run, for a terminal.
#[must_use]
pub fn summary_table(runs: &[Summary]) -> String {
    let mut table = Table::new();
    table.load_style(UTF8_HORIZONTAL_ONLY);
    let header: Vec<&str> = HEADINGS.into_iter().chain(TIME_HEADINGS).collect();
    let row = |run: &Summary| cells(run).into_iter().chain(time_cells(run)).collect();
    let rows: Vec<Vec<String>> = runs.iter().map(row).collect();
    table.set_header(&header);
    table.add_rows(&rows);
    for (index, column) in table.column_iter_mut().enumerate() {
        if index != 0 && index != 2 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    fitted(table.to_string(), &header, &rows)
}
