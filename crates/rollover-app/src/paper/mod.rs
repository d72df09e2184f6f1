//! `paper`: every experiment of the paper, over recording seeds, on each course and its mirror image.
//!
//! ```text
//! plan ─→ execute (groups of runs that share a recording, several at a time) ─→ folder of runs
//!                                                                                  │ read back
//!                                              report.html, paper.json, terminal ←─┘
//! ```
//!
//! The folder is all that the results are made from, so that `report` makes the same page of it, and an
//! interrupted campaign goes on where it stopped.

mod execute;
mod fingerprint;
mod plan;
mod results;

use std::path::PathBuf;

use anyhow::Result;

use crate::campaign::job::cores;
use crate::cli::PaperArgs;
use crate::interrupt::Interrupt;
use crate::output::{create_folder, print_json, remove_old_file, write_json};
use crate::report::{self, CAMPAIGN_FILE, CampaignFile, REPORT_FILE};
use execute::Execution;
use plan::Plan;

/// Makes all runs that are not there yet, then the report.
///
/// # Errors
/// When a result cannot be written, or as [`Interrupted`](crate::interrupt::Interrupted).
pub fn paper(args: &PaperArgs, interrupt: &Interrupt) -> Result<()> {
    let plan = Plan::new(args, interrupt)?;
    let out = &args.out;
    create_folder(out)?;
    report::remove_old(&out.join(REPORT_FILE))?;
    remove_old_file(&out.join(results::RESULTS_FILE))?;
    let folders = plan.runs().map(|run| plan.folder(&run));
    write_json(
        &out.join(CAMPAIGN_FILE),
        &CampaignFile {
            version: env!("CARGO_PKG_VERSION").into(),
            command: command(args),
            seeds: plan.seeds.clone(),
            runs: folders.collect::<Vec<PathBuf>>(),
        },
    )?;
    let workers = args.jobs.map_or_else(cores, std::num::NonZero::get);
    let made = Execution::new(&plan, out, interrupt).all(workers)?;
    let results = results::Results::read(out)?;
    results.write(out)?;
    if args.json {
        print_json(&results.json())
    } else {
        results.print(out, made)
    }
}

/// What to type for the same results.
fn command(args: &PaperArgs) -> String {
    let mut words = vec!["rollover-app paper".to_owned()];
    if args.quick {
        words.push("--quick".into());
    }
    if let Some(seeds) = &args.seeds {
        words.push(format!("--seeds {seeds}"));
    }
    if !args.only.is_empty() {
        words.push(format!("--only {}", args.only.join(",")));
    }
    if !args.controllers.is_empty() {
        words.push(format!("--controllers {}", args.controllers.join(",")));
    }
    words.join(" ")
}
