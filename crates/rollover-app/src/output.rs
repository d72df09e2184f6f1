//! Files and standard output of the program.

use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// Makes a folder and those above it.
///
/// # Errors
/// Names the folder that cannot be made.
pub fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).with_context(|| {
        format!(
            "cannot create the output folder {}: choose another with --out",
            path.display()
        )
    })
}

/// Writes a whole file at once, so that an interruption never leaves half of it.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_whole(path: &Path, contents: impl AsRef<[u8]>) -> Result<()> {
    let partial = path.with_added_extension("partial");
    let written = std::fs::write(&partial, contents).and_then(|()| std::fs::rename(&partial, path));
    written.with_context(|| {
        // The disk refused the file already; a leftover is all that a failed removal can cost.
        let _ = std::fs::remove_file(&partial);
        format!(
            "cannot write {}: choose another folder with --out",
            path.display()
        )
    })
}

/// Writes a value as a JSON file.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    write_whole(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

/// Prints a value as JSON on standard output.
///
/// # Errors
/// As [`print_line`].
pub fn print_json<T: Serialize>(value: &T) -> Result<()> {
    print_line(&serde_json::to_string_pretty(value)?)
}

/// Prints a line on standard output. A reader that has seen enough (`| head -1`) is no error.
///
/// # Errors
/// When standard output cannot be written for another reason.
pub fn print_line(text: &str) -> Result<()> {
    print_text(&format!("{text}\n"))
}

/// Prints text with its own line ends on standard output.
///
/// # Errors
/// As [`print_line`].
pub fn print_text(text: &str) -> Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
