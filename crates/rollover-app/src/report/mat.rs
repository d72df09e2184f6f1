//! Logs as MAT files, level 5: what MATLAB, Octave and `scipy` read without an import script.
//!
//! One variable per column, a double column vector with the column's name; gaps are NaN. Words become
//! numbers, and `solve_status_names` says which. Layout: `MathWorks`, "MAT-File Format", level 5,
//! little endian, not compressed.

use std::path::Path;

use anyhow::{Context, Result};

use super::data::Columns;
use super::log::{STATUS, STATUS_NAMES};

const HEADER_TEXT: &str = "MATLAB 5.0 MAT-file, run log of rollover-app";
const HEADER_TEXT_BYTES: usize = 116;
/// Data types of elements.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;
/// Classes of arrays.
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;

/// The bytes of a MAT file with these columns.
///
/// # Errors
/// When a column is longer than the format can hold (2 GiB).
pub fn bytes(columns: &Columns) -> Result<Vec<u8>> {
    let mut file = Vec::with_capacity(HEADER_TEXT_BYTES);
    file.extend_from_slice(HEADER_TEXT.as_bytes());
    file.resize(HEADER_TEXT_BYTES, b' ');
    // No subsystem data, version 1.0, written little endian.
    file.extend_from_slice(&[0; 8]);
    file.extend_from_slice(&0x0100_u16.to_le_bytes());
    file.extend_from_slice(b"IM");
    for (name, values) in columns {
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let shape = [values.len(), 1];
        matrix(&mut file, name, DOUBLE_CLASS, shape, (DOUBLE, &data))?;
    }
    if columns.contains_key(STATUS) {
        let names = STATUS_NAMES.iter().enumerate();
        let names: Vec<String> = names
            .map(|(code, (name, _))| format!("{code} {name}"))
            .collect();
        let text = names.join(", ");
        let data: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let shape = [1, data.len() / 2];
        matrix(
            &mut file,
            "solve_status_names",
            CHAR_CLASS,
            shape,
            (UINT16, &data),
        )?;
    }
    Ok(file)
}

/// Writes a MAT file with these columns.
///
/// # Errors
/// As [`bytes`], or when the folder cannot be written.
pub fn write(path: &Path, columns: &Columns) -> Result<()> {
    std::fs::write(path, bytes(columns)?).with_context(|| {
        format!(
            "cannot write {}: choose another folder with --out",
            path.display()
        )
    })
}

fn matrix(
    file: &mut Vec<u8>,
    name: &str,
    class: u32,
    shape: [usize; 2],
    (kind, data): (u32, &[u8]),
) -> Result<()> {
    let mut body = Vec::with_capacity(data.len() + 64);
    element(&mut body, UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
    let mut sizes = Vec::new();
    for size in shape {
        sizes.extend_from_slice(&i32::try_from(size).context(TOO_LONG)?.to_le_bytes());
    }
    element(&mut body, INT32, &sizes)?;
    element(&mut body, INT8, name.as_bytes())?;
    element(&mut body, kind, data)?;
    element(file, MATRIX, &body)
}

const TOO_LONG: &str = "the log is too long for a MAT file of level 5";

/// Tag, data, and zeros up to a multiple of 8 bytes.
fn element(file: &mut Vec<u8>, kind: u32, data: &[u8]) -> Result<()> {
    file.extend_from_slice(&kind.to_le_bytes());
    file.extend_from_slice(&u32::try_from(data.len()).context(TOO_LONG)?.to_le_bytes());
    file.extend_from_slice(data);
    file.resize(file.len().next_multiple_of(8), 0);
    Ok(())
}
