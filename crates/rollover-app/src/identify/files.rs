//! The files of the results.

use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::figures::Figure;
use super::results::Results;
use crate::output::{create_folder, write_json, write_whole};

/// The model, for programs.
pub(super) const MODEL: &str = "model.json";
/// The model, for MATLAB and Octave.
const MATLAB: &str = "model.m";
/// What there is to know, for programs.
const REPORT: &str = "report.json";
/// The same for people.
const TEXT: &str = "report.txt";
/// The same with figures.
pub(super) const PAGE: &str = "index.html";

/// Refuses a folder that cannot be one, and makes nothing.
pub(super) fn check_folder(folder: &Path) -> Result<()> {
    let existing = folder.ancestors().find(|path| path.exists());
    if let Some(path) = existing.filter(|path| !path.as_os_str().is_empty()) {
        ensure!(
            path.is_dir(),
            "cannot create the output folder {}: {} is a file; choose another with --out",
            folder.display(),
            path.display()
        );
    }
    Ok(())
}

/// Replaces the results of an earlier run. The page comes last: where it stands, all is there.
pub(super) fn write_all(
    folder: &Path,
    results: &Results,
    figures: &[Figure],
    page: &str,
) -> Result<()> {
    let matlab = results.identification.model.to_matlab("model")?;
    let model = results.identification.model.to_json()?;
    create_folder(folder)?;
    remove_old_results(folder)?;
    write_whole(&folder.join(MODEL), &model)?;
    write_whole(&folder.join(MATLAB), &matlab)?;
    write_json(&folder.join(REPORT), &results.report)?;
    write_whole(&folder.join(TEXT), super::words::report(results))?;
    for figure in figures {
        write_whole(&folder.join(format!("{}.svg", figure.file)), &figure.svg)?;
    }
    write_whole(&folder.join(PAGE), page)
}

/// Removes what an earlier run wrote, and nothing else.
fn remove_old_results(folder: &Path) -> Result<()> {
    let entries = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read the output folder {}", folder.display()))?;
    let mut old = Vec::new();
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if [PAGE, MODEL, MATLAB, REPORT, TEXT].contains(&name.as_str()) || is_figure(&name) {
            old.push(name);
        }
    }
    // The page first: it must not stand over files that are gone.
    old.sort_by_key(|name| name != PAGE);
    for name in old {
        let path = folder.join(name);
        match std::fs::remove_file(&path) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(e).with_context(|| format!("cannot replace {}", path.display()));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Whether a file has the name of a figure: a known stem, then numbers of channels.
fn is_figure(name: &str) -> bool {
    name.strip_suffix(".svg").is_some_and(|stem| {
        super::figures::STEMS.iter().any(|known| {
            let rest = stem.strip_prefix(known);
            rest.is_some_and(|r| r.chars().all(|c| c == '-' || c.is_ascii_digit()))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::is_figure;

    #[test]
    fn only_our_figures_are_removed() {
        for ours in ["poles.svg", "frequency-1-12.svg", "measured-3.svg"] {
            assert!(is_figure(ours), "{ours}");
        }
        for theirs in ["poles-of-mine.svg", "drawing.svg", "poles.png", "poles"] {
            assert!(!is_figure(theirs), "{theirs}");
        }
    }
}
