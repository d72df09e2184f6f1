//! The model as a file: JSON that people can read and every value of which survives.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use deepc_core::faer::{Mat, MatRef};
use serde::{Deserialize, Serialize};

use super::{Channel, StateSpace, SystemMatrices};
use crate::error::SysidError;

/// Version of the format. It grows when an old file can no longer be read as it stands.
const FORMAT_VERSION: u64 = 1;

type Rows = Vec<Vec<f64>>;

/// The fields of the file. Matrices are lists of rows.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModelFile {
    format_version: u64,
    sample_time_s: f64,
    inputs: Vec<Channel>,
    disturbances: Vec<Channel>,
    outputs: Vec<Channel>,
    a: Rows,
    b: Rows,
    c: Rows,
    d: Rows,
    k: Rows,
    innovation_covariance: Rows,
}

/// Read before the rest, so that a file of another version says so and not what is unknown in it.
#[derive(Deserialize)]
struct Version {
    format_version: u64,
}

impl From<StateSpace> for ModelFile {
    fn from(model: StateSpace) -> Self {
        let matrices = &model.matrices;
        Self {
            format_version: FORMAT_VERSION,
            sample_time_s: model.sample_time_s,
            a: rows(matrices.a.as_ref()),
            b: rows(matrices.b.as_ref()),
            c: rows(matrices.c.as_ref()),
            d: rows(matrices.d.as_ref()),
            k: rows(matrices.k.as_ref()),
            innovation_covariance: rows(model.innovation_covariance.as_ref()),
            inputs: model.inputs,
            disturbances: model.disturbances,
            outputs: model.outputs,
        }
    }
}

impl TryFrom<ModelFile> for StateSpace {
    type Error = SysidError;

    fn try_from(file: ModelFile) -> Result<Self, SysidError> {
        check_version(file.format_version)?;
        let all = file.inputs.len() + file.disturbances.len();
        let (n, p) = (file.a.len(), file.outputs.len());
        let matrices = SystemMatrices {
            a: matrix("a", &file.a, n, n)?,
            b: matrix("b", &file.b, n, all)?,
            c: matrix("c", &file.c, p, n)?,
            d: matrix("d", &file.d, p, all)?,
            k: matrix("k", &file.k, n, p)?,
        };
        let covariance = matrix("innovation_covariance", &file.innovation_covariance, p, p)?;
        let (inputs, disturbances) = (file.inputs, file.disturbances);
        Self::new(
            file.sample_time_s,
            inputs,
            disturbances,
            file.outputs,
            matrices,
        )?
        .with_innovation_covariance(covariance)
    }
}

impl StateSpace {
    /// The model as JSON: `format_version`, `sample_time_s`, the channels, and the matrices as
    /// lists of rows, one row a line. Every number is written with the digits that give it back bit
    /// by bit.
    ///
    /// # Errors
    /// None that a checked model could cause.
    pub fn to_json(&self) -> Result<String, SysidError> {
        let value = serde_json::to_value(self)?;
        let mut text = String::from("{\n");
        let field = |name: &str| value.get(name).map(serde_json::to_string).transpose();
        for name in ["format_version", "sample_time_s"] {
            let value = field(name)?.unwrap_or_default();
            text = format!("{text}  \"{name}\": {value},\n");
        }
        let lists = [
            "inputs",
            "disturbances",
            "outputs",
            "a",
            "b",
            "c",
            "d",
            "k",
            "innovation_covariance",
        ];
        for (index, name) in lists.iter().enumerate() {
            let entries = value.get(name).and_then(serde_json::Value::as_array);
            let lines = entries.into_iter().flatten().map(serde_json::to_string);
            let lines = lines.collect::<Result<Vec<_>, _>>()?;
            let list = match lines.len() {
                0 => "[]".to_owned(),
                _ => format!("[\n    {}\n  ]", lines.join(",\n    ")),
            };
            let end = if index + 1 < lists.len() { "," } else { "" };
            text = format!("{text}  \"{name}\": {list}{end}\n");
        }
        text.push_str("}\n");
        Ok(text)
    }

    /// Reads what [`to_json`](Self::to_json) wrote.
    ///
    /// # Errors
    /// Not JSON, another format version, a field is missing, unknown or of the wrong type, or what
    /// [`new`](Self::new) refuses; the message names the field.
    pub fn from_json(text: &str) -> Result<Self, SysidError> {
        let version: Version = serde_json::from_str(text)?;
        check_version(version.format_version)?;
        let file: ModelFile = serde_json::from_str(text)?;
        file.try_into()
    }

    /// Writes the model file. An existing one is replaced in one go, so that a reader finds the old
    /// model or the new one and never half of it.
    ///
    /// # Errors
    /// The file cannot be written; an existing one is unchanged then.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), SysidError> {
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let path = path.as_ref();
        // Renaming over a device would put a file in its place, for everyone on the machine.
        if path
            .metadata()
            .is_ok_and(|at| !at.is_file() && !at.is_dir())
        {
            return Err(SysidError::ModelPath {
                action: "write",
                path: path.display().to_string(),
                source: std::io::Error::other("it is there and is no regular file"),
            });
        }
        let text = self.to_json()?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let process = std::process::id();
        let draft = path.with_file_name(format!(".{name}.{process}-{number}.tmp"));
        let written = fs::File::create_new(&draft).and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            // Else a crash could leave the new name with none of the text.
            file.sync_all()
        });
        let failed = |action| {
            move |source| SysidError::ModelPath {
                action,
                path: path.display().to_string(),
                source,
            }
        };
        let renamed = written
            .map_err(failed("write"))
            .and_then(|()| fs::rename(&draft, path).map_err(failed("replace")));
        if renamed.is_err() {
            // It may not even exist; the error to report is the first one.
            fs::remove_file(&draft).ok();
        }
        renamed
    }

    /// Reads a model file.
    ///
    /// # Errors
    /// The file cannot be read, or as [`from_json`](Self::from_json).
    pub fn load(path: impl AsRef<Path>) -> Result<Self, SysidError> {
        let path = path.as_ref();
        let text = fs::read_to_string(path).map_err(|source| SysidError::ModelPath {
            action: "read",
            path: path.display().to_string(),
            source,
        })?;
        Self::from_json(&text)
    }
}

fn check_version(found: u64) -> Result<(), SysidError> {
    if found == FORMAT_VERSION {
        return Ok(());
    }
    Err(SysidError::FormatVersion {
        found,
        known: FORMAT_VERSION,
    })
}

fn rows(matrix: MatRef<'_, f64>) -> Rows {
    let row = |i: usize| matrix.row(i).iter().copied().collect();
    (0..matrix.nrows()).map(row).collect()
}

fn matrix(
    name: &'static str,
    rows: &[Vec<f64>],
    expected_rows: usize,
    expected: usize,
) -> Result<Mat<f64>, SysidError> {
    if rows.len() != expected_rows {
        return Err(SysidError::MatrixShape {
            matrix: name,
            rows: rows.len(),
            columns: rows.first().map_or(expected, Vec::len),
            expected_rows,
            expected_columns: expected,
        });
    }
    for (row, values) in rows.iter().enumerate() {
        if values.len() != expected {
            return Err(SysidError::RaggedMatrix {
                matrix: name,
                row,
                found: values.len(),
                expected,
            });
        }
    }
    Ok(Mat::from_fn(expected_rows, expected, |i, j| rows[i][j]))
}
