//! Files, whole or not at all.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// Creates a folder and those above it.
///
/// # Errors
/// It cannot be created.
pub fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path)
        .with_context(|| format!("cannot create the folder {}", path.display()))
}

/// Creates a folder and requires that files can be written into it, before long work.
///
/// # Errors
/// It cannot be created or written into.
pub fn create_writable_folder(path: &Path) -> Result<()> {
    create_folder(path)?;
    let probe = path.join(".writable.partial");
    std::fs::write(&probe, "")
        .and_then(|()| std::fs::remove_file(&probe))
        .with_context(|| format!("cannot write into the folder {}", path.display()))
}

/// Writes beside the target first and renames, so that nothing ever leaves half a file.
///
/// # Errors
/// The file cannot be written; what was there before is still there.
pub fn write_whole(path: &Path, contents: &str) -> Result<()> {
    let partial = path.with_added_extension("partial");
    let written = std::fs::write(&partial, contents).and_then(|()| std::fs::rename(&partial, path));
    written.with_context(|| {
        // A leftover is all that a failed removal can cost.
        let _ = std::fs::remove_file(&partial);
        format!("cannot write {}", path.display())
    })
}

/// Writes JSON with a line end.
///
/// # Errors
/// As [`write_whole`].
pub fn write_json<T: Serialize + ?Sized>(path: &Path, value: &T) -> Result<()> {
    write_whole(path, &(serde_json::to_string_pretty(value)? + "\n"))
}
