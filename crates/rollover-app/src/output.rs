//! Files and standard output of the program.

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};
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

/// Removes an earlier result, if there is one: beside fresh ones it would lie.
///
/// # Errors
/// Names the file that cannot be removed.
pub fn remove_old_file(file: &Path) -> Result<()> {
    match std::fs::remove_file(file) {
        Err(e) if e.kind() != ErrorKind::NotFound => {
            Err(e).with_context(|| format!("cannot replace {}", file.display()))
        }
        _ => Ok(()),
    }
}

/// Writes a value as a JSON file.
///
/// # Errors
/// When the folder cannot be written.
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<()> {
    write_whole(path, &(serde_json::to_string_pretty(value)? + "\n"))
}

/// Whether `--quiet` was given. Standard output belongs to the whole process, and so does this.
static QUIET: AtomicBool = AtomicBool::new(false);

/// Keeps progress and words about the work to itself from now on, or not. What was asked for (JSON,
/// lists, files shown) is still printed.
pub fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// Whether only errors and what was asked for are to be shown.
#[must_use]
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a value as JSON on standard output.
///
/// # Errors
/// As [`print_text`].
pub fn print_json<T: Serialize>(value: &T) -> Result<()> {
    print_text(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Prints a line about the work done on standard output, unless the user wants quiet.
///
/// # Errors
/// As [`print_text`].
pub fn print_line(text: &str) -> Result<()> {
    if is_quiet() {
        return Ok(());
    }
    print_text(&format!("{text}\n"))
}

/// Prints text that was asked for, with its own line ends, on standard output. A reader that has seen
/// enough (`| head -1`) is no error.
///
/// # Errors
/// When standard output cannot be written for another reason, such as a full disk.
pub fn print_text(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}

/// Prints an error on standard error. If that is closed there is nobody left to tell.
pub fn print_error(error: &anyhow::Error) {
    let style = anstyle::AnsiColor::Red.on_default().bold();
    // Takes the colour away where it is not wanted: no terminal, NO_COLOR, CLICOLOR=0.
    let _ = writeln!(anstream::stderr(), "{style}error:{style:#} {error:#}");
}

/// Rows under a header as text for standard output. Where a terminal is too narrow for them, each row
/// becomes a paragraph of its own.
#[must_use]
pub fn table_text(header: &[&str], rows: &[Vec<String>], right: &[usize]) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(header.to_vec())
        .add_rows(rows);
    for &index in right {
        if let Some(column) = table.column_mut(index) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    fitted(table.to_string(), header, rows)
}

/// A table that was drawn already, or its rows as paragraphs where the terminal is too narrow.
#[must_use]
pub fn fitted(text: String, header: &[&str], rows: &[Vec<String>]) -> String {
    match terminal_width() {
        Some(width) if text.lines().any(|line| line.chars().count() > width) => {
            paragraphs(header, rows, width)
        }
        _ => text,
    }
}

/// Lines of words, broken where a terminal is too narrow for them.
#[must_use]
pub fn fitted_words(text: &str) -> String {
    let Some(width) = terminal_width() else {
        return text.to_owned();
    };
    let lines: String = text.lines().map(|line| wrapped(line, width, "")).collect();
    lines.trim_end().to_owned()
}

/// Width of the terminal that standard output is, if it is one.
fn terminal_width() -> Option<usize> {
    terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0))
}

fn paragraphs(header: &[&str], rows: &[Vec<String>], width: usize) -> String {
    let mut text = String::new();
    for row in rows {
        let mut cells = header.iter().zip(row);
        if let Some((_, name)) = cells.next() {
            text += &wrapped(name, width, "");
        }
        let labelled = |(title, cell): (&&str, &String)| match *title {
            "" => cell.clone(),
            title => format!("{title}: {cell}"),
        };
        let rest: Vec<String> = cells
            .filter(|(_, cell)| !cell.is_empty())
            .map(labelled)
            .collect();
        text += &wrapped(&rest.join("; "), width, "  ");
    }
    text.truncate(text.trim_end().len());
    text
}

/// Words in lines of at most `width` characters where that can be, every line indented.
fn wrapped(words: &str, width: usize, indent: &str) -> String {
    let mut lines = String::new();
    let mut line = String::new();
    for word in words.split_whitespace() {
        let long = line.chars().count() + 1 + word.chars().count() > width;
        if !line.is_empty() && long {
            lines += &(std::mem::take(&mut line) + "\n");
        }
        line += if line.is_empty() { indent } else { " " };
        line += word;
    }
    lines + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::paragraphs;

    #[test]
    fn narrow_tables_become_paragraphs() {
        let rows = [vec![
            "one".to_owned(),
            "1500".to_owned(),
            "a b c d e f g h".to_owned(),
        ]];
        let text = paragraphs(&["name", "mass, kg", ""], &rows, 14);
        assert_eq!(text, "one\n  mass, kg:\n  1500; a b c\n  d e f g h");
        assert!(text.lines().all(|line| line.len() <= 14));
    }
}
