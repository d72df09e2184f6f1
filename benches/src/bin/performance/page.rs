//! `performance.md` and its images.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;

use crate::bandwidth::{Rate, read_rate};
use crate::condensed::CaseResult;
use crate::figures;
use crate::machine::Machine;
use crate::output;
use crate::rows::{CONDENSED, FULL, LMPC, PRODUCT, REDUCED, Row};
use crate::run::Comparison;
use crate::sweeps::Sweeps;

/// Everything one run measured.
pub struct Measured {
    pub quick: bool,
    pub machine: Machine,
    pub bandwidth: Vec<Rate>,
    pub comparison: Comparison,
    pub sweeps: Sweeps,
}

/// A time in the unit that reads best.
pub fn duration(us: f64) -> String {
    let (value, unit) = match us {
        us if us < 1e3 => (us, "µs"),
        us if us < 1e6 => (us / 1e3, "ms"),
        us => (us / 1e6, "s"),
    };
    let decimals = match value {
        value if value < 10.0 => 2,
        value if value < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.decimals$} {unit}")
}

pub fn formulation_words(formulation: &str) -> &str {
    match formulation {
        FULL => "full as written",
        REDUCED => "RD as written",
        other => other,
    }
}

/// Draws and writes everything; nothing is written before all of it is made.
pub fn write(docs: &Path, measured: &Measured) -> Result<()> {
    let mut images = Vec::new();
    let mut page = introduction(measured);
    for (number, case) in measured.comparison.cases.iter().enumerate() {
        let image = format!("performance-steps-{}.svg", number + 1);
        case_section(&mut page, case, &measured.bandwidth, &image);
        images.push((image, figures::steps(case)?));
    }
    sweeps_section(&mut page, &measured.sweeps);
    let [horizons, channels] = figures::sizes(&measured.sweeps)?;
    images.push((
        "performance-set-up.svg".into(),
        figures::set_up(&measured.sweeps)?,
    ));
    images.push(("performance-horizons.svg".into(), horizons));
    images.push(("performance-channels.svg".into(), channels));
    output::create_folder(&docs.join("images"))?;
    for (name, svg) in images {
        output::write_whole(&docs.join("images").join(name), &svg)?;
    }
    output::write_whole(&docs.join("performance.md"), &page)
}

fn introduction(measured: &Measured) -> String {
    let mut page = String::from("# What a step costs\n\n");
    if measured.quick {
        page += "**A short run (`--quick`): these numbers are rough.**\n\n";
    }
    let Machine { processor, cores } = &measured.machine;
    page += "Written by `cargo run --release -p benches --bin performance`; do not edit. ";
    let _ = writeln!(
        page,
        "Measured in one process on one thread of: {processor}, {cores} cores."
    );
    page += METHOD;
    page += "\n## Memory\n\n| bytes | inner product (GB/s) | copy (GB/s) |\n|---:|---:|---:|\n";
    for rate in &measured.bandwidth {
        let Rate {
            bytes,
            read_gb_s,
            copy_gb_s,
        } = rate;
        let size = if *bytes < 1_000_000 {
            format!("{:.0} kB", *bytes as f64 / 1e3)
        } else {
            format!("{:.1} MB", *bytes as f64 / 1e6)
        };
        let _ = writeln!(page, "| {size} | {read_gb_s:.0} | {copy_gb_s:.0} |");
    }
    page
}

const METHOD: &str = "
The problem is that of the original study: two inputs, one output, T_ini = N = 100, T = 3200
samples, so that the Hankel matrix is 600×3001; R = diag(1, 5e-4), λ_g = 100 (in proportion to the columns for other lengths), λ_u = λ_y = 1e8, hard
input bounds, soft output bounds. It is posed on a damped oscillator with noise and a little that no
linear model explains. A closed loop is recorded once, and its consecutive moments are replayed to
every back end:

- **full as written**: all variables (g, u, y, σ), the whole Hankel matrix; **RD as written**: the
  same on its exact reduction by the SVD. A few consecutive steps, at the loosest tolerance of the
  back end whose objective is within 1e-6 of the reference (else the tightest, and the gap says
  what was reached).
- **condensed**: g and the slacks eliminated at set-up, thousands of consecutive steps, in blocks
  of 100 by turns (fewer where they take too long), every back end at a tolerance of 1e-9. The
  first, cold step is left out.
- **lmpc, condensed**: the linear MPC of `sysid` on the linear part of the plant, as an identification
  without errors would give it (order 2), asked at the same moments and with the same costs and
  bounds, the step of its observer included. It solves another problem: without a regularisation to
  draw its plan away from the bounds, more of them are active, and there is no gap to state. Its
  *columns* are those of its gain.
- **matrix-vector product**: the bare product of one gain matrix with past and references, which
  every condensed step takes at least once, in turn with the steps. Beside it the least time in
  which this machine reads that matrix, by the rates below.

*Set-up* is from the recording to a solver that is ready, without the excitation report. *Bounds* is
the mean number of active bounds. *Gap* is the largest relative distance of the objective from the
optimum of the full problem, which Clarabel solves as accurately as it can; a reference is itself
certain only to about the residual stated, the largest of those behind the table. *Violation* is
that of the hard input bounds, in their units.
";

fn case_section(page: &mut String, case: &CaseResult, rates: &[Rate], image: &str) {
    let _ = writeln!(
        page,
        "\n## {}\n\n![Median step times](images/{image})\n",
        case.name
    );
    *page += "| formulation | back end | columns | steps | bounds | set-up | median | p99 | max \
              | × product | RD ÷ this | gap | violation |\n";
    *page += "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n";
    let product = median(case, |row| row.formulation == PRODUCT);
    let written = fastest_written(case);
    for (row, steps) in case.rows.iter().zip(&case.steps) {
        let factor = product.map_or(DASH.into(), |product| {
            format!("{:.1}", row.median_us / product)
        });
        let ratio = written.map_or(DASH.into(), |written| {
            format!("{:.1}", written / row.median_us)
        });
        let (set_up, accuracy) = if row.formulation == PRODUCT {
            (DASH.into(), [DASH.into(), DASH.into()])
        } else {
            let small = |value: Option<f64>| value.map_or("none".into(), |v| format!("{v:.0e}"));
            let numbers = [small(row.objective_gap), small(row.bound_violation)];
            (duration(row.setup_ms * 1e3), numbers)
        };
        let _ = writeln!(
            page,
            "| {} | {} | {} | {steps} | {:.1} | {set_up} | {} | {} | {} | {factor} | {ratio} | {} | {} |",
            formulation_words(row.formulation),
            row.backend,
            row.columns,
            row.bounds_active,
            duration(row.median_us),
            duration(row.p99_us),
            duration(row.max_us),
            accuracy[0],
            accuracy[1],
        );
    }
    for row in case.rows.iter().filter(|row| row.formulation == LMPC) {
        let verdict = |found: f64, target: f64| if found <= target { "met" } else { "missed" };
        let _ = writeln!(
            page,
            "\nTargets of the linear MPC: a median of {}, {}; a p99 of {}, {}.",
            duration(LMPC_MEDIAN_US),
            verdict(row.median_us, LMPC_MEDIAN_US),
            duration(LMPC_P99_US),
            verdict(row.p99_us, LMPC_P99_US),
        );
    }
    let residual = case.reference_residual;
    let _ = writeln!(
        page,
        "\nReference optima: relative residual {residual:.0e}."
    );
    if let Some(rate) = read_rate(rates, case.product_bytes) {
        let limit = case.product_bytes as f64 / rate / 1e3;
        let _ = writeln!(
            page,
            "Reading the product's matrix ({:.1} MB) once at {rate:.0} GB/s takes {}.",
            case.product_bytes as f64 / 1e6,
            duration(limit),
        );
    }
}

/// What a step of the linear MPC should take at most.
const LMPC_MEDIAN_US: f64 = 10.0;
const LMPC_P99_US: f64 = 50.0;

const DASH: &str = "–";

fn median(case: &CaseResult, of: impl Fn(&Row) -> bool) -> Option<f64> {
    let medians = case
        .rows
        .iter()
        .filter(|row| of(row))
        .map(|row| row.median_us);
    medians.reduce(f64::min)
}

/// The faster back end on RD as written, among those that are accurate.
fn fastest_written(case: &CaseResult) -> Option<f64> {
    median(case, |row| {
        row.formulation == REDUCED && row.objective_gap.is_some_and(|gap| gap <= 1e-6)
    })
}

fn sweeps_section(page: &mut String, sweeps: &Sweeps) {
    let _ = writeln!(
        page,
        "\n## Sizes\n\nThe first problem, {CONDENSED}, active-set, with one size changed at a \
         time; the data matrix is streamed. \
         Memory is the peak of set-up beyond the recording.\n\n\
         ![Length of the recording](images/performance-set-up.svg)\n\n\
         ![Horizons](images/performance-horizons.svg)\n\n\
         ![Channels](images/performance-channels.svg)\n"
    );
    *page += "| size | columns | bounds | set-up | memory | median | p99 | max |\n";
    *page += "|---|---:|---:|---:|---:|---:|---:|---:|\n";
    for point in &sweeps.points {
        let memory = point
            .setup_peak_mb
            .map_or(DASH.into(), |mb| format!("{mb:.0} MB"));
        let _ = writeln!(
            page,
            "| {} = {} | {} | {:.1} | {} | {memory} | {} | {} | {} |",
            point.sweep,
            point.value,
            point.columns,
            point.bounds_active,
            duration(point.setup_ms * 1e3),
            duration(point.median_us),
            duration(point.p99_us),
            duration(point.max_us),
        );
    }
}
