//! `identification.md`: ours beside theirs.

use std::fmt::Write;
use std::path::Path;

use comfy_table::Table;
use comfy_table::presets::ASCII_MARKDOWN;

use crate::folder::Set;
use crate::measure::{METHODS, Row};
use crate::study::{Trial, summaries};

/// What target 2 of the design compares with.
const RIVALS: [&str; 2] = ["slicot_n4sid_Q", "slicot_n4sid+simBD_Q"];

/// How far below the better rival the automatic method may stay, points of fit.
const ALLOWANCE: f64 = 0.5;

type Results<'a> = [(&'a Set, Vec<Row>)];

fn fits(values: Option<&Vec<f64>>) -> String {
    values.map_or_else(
        || "–".into(),
        |values| {
            let values: Vec<_> = values.iter().map(|fit| format!("{fit:.2}")).collect();
            values.join(", ")
        },
    )
}

fn time(value: Option<f64>) -> String {
    value.map_or_else(
        || "–".into(),
        |ms| {
            if ms < 100.0 {
                format!("{ms:.1}")
            } else {
                format!("{ms:.0}")
            }
        },
    )
}

/// Of the outputs, the least lead of `ours` over the best rival.
fn lead(set: &Set, ours: &Row) -> Option<f64> {
    let ours = ours.fit_sim_val.as_ref()?;
    let rivals: Vec<_> = RIVALS.iter().filter_map(|r| set.others.get(*r)).collect();
    let best = |output: usize| {
        let fits = rivals.iter().map(|rival| rival.fit_sim_val[output]);
        fits.fold(f64::NEG_INFINITY, f64::max)
    };
    if rivals.is_empty() {
        return None;
    }
    let leads = ours
        .iter()
        .enumerate()
        .map(|(output, fit)| fit - best(output));
    Some(leads.fold(f64::INFINITY, f64::min))
}

/// The whole page.
pub fn page(results: &Results<'_>, folder: &Path, trials: &[Trial]) -> String {
    let mut page = String::from(INTRODUCTION);
    // Writing to a string cannot fail.
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let _ = writeln!(page, "Sets: folder `{name}`.\n\n## Against the target\n");
    let _ = writeln!(
        page,
        "Target: the automatic model fits the validation samples at least as well as the better of \
         `{}` and `{}`, less {ALLOWANCE} points, on every output.\n",
        RIVALS[0], RIVALS[1]
    );
    let _ = writeln!(page, "{}\n", summary(results));
    if !trials.is_empty() {
        let _ = writeln!(page, "{STUDY}\n{}\n", study_table(trials));
    }
    for (set, rows) in results {
        let _ = writeln!(page, "## {}\n", set.name);
        let data = &set.identification;
        let _ = writeln!(
            page,
            "{}. {} inputs, {} outputs; {} samples identify, {} validate. Other tools: order {}, {} block \
             rows.\n",
            set.description.trim_end_matches('.'),
            data.inputs(),
            data.outputs(),
            data.samples(),
            set.validation.samples(),
            set.order,
            set.block_rows
        );
        let _ = writeln!(page, "{}\n", set_table(set, rows));
        for row in rows {
            if let Some(error) = &row.error {
                let _ = writeln!(page, "`{}`: no model: {error}\n", row.method);
            }
        }
    }
    page.truncate(page.trim_end().len());
    page.push('\n');
    page
}

/// Medians and extremes of the synthetic study.
pub fn study_table(trials: &[Trial]) -> Table {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN);
    table.set_header([
        "noise",
        "fit, median",
        "fit, least",
        "order 4 found",
        "stable",
        "time, median ms",
    ]);
    for level in summaries(trials) {
        table.add_row([
            format!("{:.0} dB", level.snr_db),
            format!("{:.2}", level.median),
            format!("{:.2}", level.least),
            format!("{} of {}", level.right_order, level.seeds),
            format!("{} of {}", level.stable, level.seeds),
            format!("{:.0}", level.median_time_ms),
        ]);
    }
    table
}

/// The lead of the automatic model on every set.
pub fn summary(results: &Results<'_>) -> Table {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN);
    table.set_header(["set", "automatic", "order", "better rival", "lead", "met"]);
    for (set, rows) in results {
        let Some(row) = rows.iter().find(|row| row.method == METHODS[0].name()) else {
            continue;
        };
        let rivals = RIVALS.iter().filter_map(|rival| set.others.get(*rival));
        let best = rivals
            .map(|other| other.fit_sim_val.clone())
            .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a.max(*b)).collect());
        let lead = lead(set, row);
        table.add_row([
            set.name.clone(),
            fits(row.fit_sim_val.as_ref()),
            row.order.map_or_else(|| "–".into(), |n| n.to_string()),
            fits(best.as_ref()),
            lead.map_or_else(|| "–".into(), |lead| format!("{lead:+.2}")),
            match lead {
                None => "–",
                Some(lead) if lead >= -ALLOWANCE => "yes",
                Some(_) => "NO",
            }
            .into(),
        ]);
    }
    table
}

fn set_table(set: &Set, rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN);
    table.set_header([
        "method",
        "order",
        "horizon",
        "fit, simulated",
        "fit, 10 steps ahead",
        "stable",
        "time, ms",
    ]);
    for row in rows {
        let number = |n: Option<usize>| n.map_or_else(|| "–".into(), |n| n.to_string());
        table.add_row([
            format!("**{}**", row.method),
            number(row.order),
            number(row.horizon),
            fits(row.fit_sim_val.as_ref()),
            fits(row.fit_10step_val.as_ref()),
            row.stable
                .map_or("–", |stable| if stable { "yes" } else { "NO" })
                .into(),
            time(row.time_ms),
        ]);
    }
    for (tool, other) in &set.others {
        table.add_row([
            tool.clone(),
            set.order.to_string(),
            set.block_rows.to_string(),
            fits(Some(&other.fit_sim_val)),
            fits(other.fit_10step_val.as_ref()),
            String::new(),
            time(other.time_ms),
        ]);
    }
    table
}

const STUDY: &str = "## A known system

`sysid::identify` on 3000 samples of the fourth-order system of the sets `syn4` (modes at 0.9 and 1.9 Hz at
100 Hz, random levels on both inputs), white noise on the output, one recording per seed. The fit is that of
the simulated output to the output **without** noise.
";

const INTRODUCTION: &str = "# Identification: ours beside other tools

Written by `cargo run --release -p benches --bin identification`; do not edit. Bold rows are this
project's, measured in one run; the others are the reference data's, measured on another day on a machine
of the same class, given order and block rows.

- **automatic**: `sysid::identify`: horizon, order, feedthrough and focus chosen on held-out samples of the
  identification half; the validation half is never seen. Its time includes all of that.
- **moesp, n4sid, cva**: subspace estimates with the other tools' order and block rows; B, D and x(0) by
  least squares on the simulated output, every D free.
- **slicot parity**: the algorithm of SLICOT's combined method, with the other tools' offsets.
- Fits are 100·(1 − ‖y − ŷ‖/‖y − mean(y)‖) in % on the validation half, per output; simulated from the
  initial state that suits best, as for the other tools.

";
