//! Identifies every set of a folder with every method, writes the fits beside those of other tools to
//! `docs/identification.md` and the rows to `identification.json`.

mod folder;
mod measure;

mod page;
mod study;

use std::path::{Path, PathBuf};

use anyhow::Result;
use benches::output;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};

/// Identifies every set of a folder and writes docs/identification.md.
#[derive(Debug, Parser)]
#[command(name = "identification", version)]
struct Arguments {
    /// Folder with `reference.json` (protocol, sets, results of other tools where present) and
    /// `data/*.csv`.
    #[arg(long, value_name = "DIR", default_value_os_t = reference_sets())]
    data: PathBuf,
    /// Only the sets whose names contain this.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Seeds of the synthetic study; 0 leaves it out.
    #[arg(long, value_name = "N", default_value_t = 15)]
    seeds: u64,
    /// Folder for identification.json and study.json.
    #[arg(long, value_name = "DIR", default_value = ".")]
    out: PathBuf,
    /// Folder of identification.md.
    #[arg(long, value_name = "DIR", default_value_os_t = repository().join("docs"))]
    docs: PathBuf,
}

fn repository() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_path_buf()
}

fn reference_sets() -> PathBuf {
    repository().join("crates/sysid/tests/reference")
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    // Folders first: the work must not end at a folder that cannot be written.
    for folder in [&arguments.docs, &arguments.out] {
        output::create_folder(folder)?;
    }
    let sets = folder::read(&arguments.data, arguments.only.as_deref())?;
    let methods = measure::METHODS.len();
    let studied = arguments.seeds * study::LEVELS_DB.len() as u64;
    let bar = ProgressBar::new((sets.len() * methods) as u64 + studied);
    bar.set_style(ProgressStyle::with_template(
        "{elapsed_precise} {bar:30} {pos}/{len} {msg}",
    )?);
    let mut results = Vec::new();
    for set in &sets {
        let mut rows = Vec::new();
        for method in measure::METHODS {
            bar.set_message(format!("{}: {}", set.name, method.name()));
            rows.push(measure::measure(set, method));
            bar.inc(1);
        }
        results.push((set, rows));
    }
    let trials = study::run(arguments.seeds, &bar)?;
    bar.finish_and_clear();
    let page = page::page(&results, &arguments.data, &trials);
    output::write_whole(&arguments.docs.join("identification.md"), &page)?;
    let rows: Vec<_> = results.iter().flat_map(|(_, rows)| rows).collect();
    output::write_json(&arguments.out.join("identification.json"), &rows)?;
    println!("{}", page::summary(&results));
    if !trials.is_empty() {
        output::write_json(&arguments.out.join("study.json"), &trials)?;
        println!("\n{}", page::study_table(&trials));
    }
    Ok(())
}
