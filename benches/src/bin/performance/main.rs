//! Measures what a `DeePC` step costs as the papers write it and condensed, with every back end,
//! in one process, and writes `docs/performance.md`.

mod as_written;
mod bandwidth;
mod chart;
mod condensed;
mod figures;
mod lmpc;
mod machine;

mod page;
mod rows;
mod run;
mod sweeps;
mod with_osqp;

use std::path::{Path, PathBuf};

use anyhow::Result;
use benches::output;
use clap::Parser;

use run::{Extent, Run};

/// Measures what a `DeePC` step costs and writes docs/performance.md.
#[derive(Debug, Parser)]
#[command(name = "performance", version)]
struct Arguments {
    /// A short run: fewer steps and sizes, to try the program. Its numbers are rough.
    #[arg(long)]
    quick: bool,
    /// Folder for performance.json and sweeps.json.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Folder of performance.md and its images.
    #[arg(long, value_name = "DIR", default_value_os_t = repository_docs())]
    docs: PathBuf,
    /// Prints what set-up for a recording of T samples needs, as JSON. This program asks itself, in
    /// a process of its own, whose memory nothing else has used.
    #[arg(long, value_name = "T", hide = true)]
    set_up_of: Option<usize>,
    /// Leave OSQP out instead of building with it.
    #[arg(long)]
    without_osqp: bool,
}

fn repository_docs() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).join("docs")
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    if let Some(samples) = arguments.set_up_of {
        println!(
            "{}",
            serde_json::to_string(&sweeps::set_up_memory(samples)?)?
        );
        return Ok(());
    }
    if !arguments.without_osqp
        && let Some(status) = with_osqp::run_again()
    {
        std::process::exit(status);
    }
    // Folders first: an hour's work must not end at a folder that cannot be written.
    for folder in [Some(&arguments.docs), arguments.out.as_ref()]
        .into_iter()
        .flatten()
    {
        output::create_folder(folder)?;
    }
    let extent = if arguments.quick {
        Extent::quick()
    } else {
        Extent::whole()
    };
    let run = Run::start(extent)?;
    let measured = page::Measured {
        quick: arguments.quick,
        machine: machine::describe(),
        bandwidth: bandwidth::measure(&run)?,
        comparison: run::comparison(&run)?,
        sweeps: sweeps::measure(&run)?,
    };
    run.finish();
    page::write(&arguments.docs, &measured)?;
    if let Some(folder) = &arguments.out {
        output::write_json(
            &folder.join("performance.json"),
            &measured.comparison.rows(),
        )?;
        output::write_json(&folder.join("sweeps.json"), &measured.sweeps.points)?;
    }
    Ok(())
}
