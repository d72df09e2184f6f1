//! A folder of sets: `reference.json` with the protocol, and the samples.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use deepc_core::data::Dataset;
use faer::Mat;
use serde::Deserialize;
use serde_json::Value;

/// `reference.json`, as far as it is used.
#[derive(Debug, Deserialize)]
struct Reference {
    datasets: BTreeMap<String, Protocol>,
    /// By set and tool.
    #[serde(default)]
    results: BTreeMap<String, BTreeMap<String, Value>>,
}

/// How a set is used: its first `n_id` samples identify, the next `n_val` validate.
#[derive(Debug, Clone, Deserialize)]
struct Protocol {
    #[serde(rename = "Ts")]
    sample_time_s: f64,
    n: usize,
    s: usize,
    #[serde(default)]
    desc: String,
    n_id: usize,
    n_val: usize,
    u_mean: Vec<f64>,
    y_mean: Vec<f64>,
}

/// One set, ready to use.
pub struct Set {
    pub name: String,
    pub description: String,
    /// Order and block rows that the other tools were given.
    pub order: usize,
    pub block_rows: usize,
    /// Offsets that the other tools were given.
    pub input_offsets: Vec<f64>,
    pub output_offsets: Vec<f64>,
    pub identification: Dataset,
    pub validation: Dataset,
    /// Fits of the other tools, by name.
    pub others: BTreeMap<String, Other>,
}

/// What another tool reached.
#[derive(Debug, Clone)]
pub struct Other {
    pub fit_sim_val: Vec<f64>,
    pub fit_10step_val: Option<Vec<f64>>,
    pub time_ms: Option<f64>,
}

/// Every set of the folder, in the order of their names.
pub fn read(folder: &Path, only: Option<&str>) -> Result<Vec<Set>> {
    let path = folder.join("reference.json");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let reference: Reference = serde_json::from_str(&text)
        .with_context(|| format!("{} does not have the layout expected", path.display()))?;
    let mut sets = Vec::new();
    for (name, protocol) in &reference.datasets {
        if only.is_some_and(|only| !name.contains(only)) {
            continue;
        }
        let table = Table::read(&folder.join("data").join(format!("{name}.csv")))?;
        let others = reference.results.get(name).map(others).unwrap_or_default();
        let set = split_in_two(name, protocol, &table, others)
            .with_context(|| format!("set `{name}` of {}", path.display()))?;
        sets.push(set);
    }
    // A set of several records is not in the protocol: the last record validates.
    for entry in std::fs::read_dir(folder.join("data"))? {
        let path = entry?.path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let known = reference.datasets.contains_key(stem.as_ref());
        let wanted = only.is_none_or(|only| stem.contains(only));
        if known || !wanted || path.extension().is_none_or(|e| e != "csv") {
            continue;
        }
        let table = Table::read(&path)?;
        if table.names.iter().any(|name| name == "record") {
            // Siblings share what a protocol would say.
            let sibling = reference.datasets.iter().find(|(name, _)| {
                let family = stem.split('_').next().unwrap_or_default();
                name.starts_with(family)
            });
            let Some((_, protocol)) = sibling else {
                continue;
            };
            let set = by_records(&stem, protocol, &table)
                .with_context(|| format!("{}", path.display()))?;
            sets.push(set);
        }
    }
    ensure!(!sets.is_empty(), "no set of {} was chosen", path.display());
    sets.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(sets)
}

fn others(results: &BTreeMap<String, Value>) -> BTreeMap<String, Other> {
    let list = |value: &Value| -> Option<Vec<f64>> {
        value.as_array()?.iter().map(Value::as_f64).collect()
    };
    let found = results.iter().filter_map(|(tool, result)| {
        let other = Other {
            fit_sim_val: list(&result["fit_sim_val"])?,
            fit_10step_val: list(&result["fit_kstep_val"]["10"]),
            time_ms: result["time_s_min"].as_f64().map(|s| 1e3 * s),
        };
        Some((tool.clone(), other))
    });
    found.collect()
}

/// Columns of a CSV file.
struct Table {
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Table {
    fn read(path: &Path) -> Result<Self> {
        let mut reader = csv::Reader::from_path(path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let names = reader.headers()?.iter().map(str::to_owned).collect();
        let mut rows = Vec::new();
        for (index, record) in reader.records().enumerate() {
            let record = record.with_context(|| format!("{}", path.display()))?;
            let row = record.iter().map(|field| {
                field
                    .trim()
                    .parse()
                    .with_context(|| format!("{}, line {}: `{field}`", path.display(), index + 2))
            });
            rows.push(row.collect::<Result<Vec<f64>>>()?);
        }
        Ok(Self { names, rows })
    }

    fn columns(&self, first: char) -> Vec<usize> {
        let numbered = |name: &str| {
            name.strip_prefix(first)
                .is_some_and(|rest| rest.parse::<usize>().is_ok())
        };
        let names = self.names.iter().enumerate();
        names
            .filter(|(_, name)| numbered(name))
            .map(|(i, _)| i)
            .collect()
    }

    fn series(&self, columns: &[usize], rows: std::ops::Range<usize>) -> Mat<f64> {
        Mat::from_fn(rows.len(), columns.len(), |i, j| {
            self.rows[rows.start + i][columns[j]]
        })
    }

    fn dataset(&self, sample_time_s: f64, records: &[std::ops::Range<usize>]) -> Result<Dataset> {
        let (u, y) = (self.columns('u'), self.columns('y'));
        let names = |columns: &[usize]| -> Vec<String> {
            columns.iter().map(|&i| self.names[i].clone()).collect()
        };
        let mut data = Dataset::new(sample_time_s, names(&u), names(&y))?;
        for rows in records {
            data.push_record(self.series(&u, rows.clone()), self.series(&y, rows.clone()))?;
        }
        Ok(data)
    }
}

fn split_in_two(
    name: &str,
    protocol: &Protocol,
    table: &Table,
    others: BTreeMap<String, Other>,
) -> Result<Set> {
    let (cut, end) = (protocol.n_id, protocol.n_id + protocol.n_val);
    ensure!(
        end <= table.rows.len(),
        "the protocol asks for {end} samples, the file has {}",
        table.rows.len()
    );
    let ts = protocol.sample_time_s;
    let set = Set {
        name: name.to_owned(),
        description: protocol.desc.clone(),
        order: protocol.n,
        block_rows: protocol.s,
        input_offsets: protocol.u_mean.clone(),
        output_offsets: protocol.y_mean.clone(),
        identification: table.dataset(ts, std::slice::from_ref(&(0..cut)))?,
        validation: table.dataset(ts, std::slice::from_ref(&(cut..end)))?,
        others,
    };
    let (m, p) = (set.identification.inputs(), set.identification.outputs());
    ensure!(
        (set.input_offsets.len(), set.output_offsets.len()) == (m, p),
        "u_mean and y_mean have {} and {} entries, the file has {m} and {p} channels",
        set.input_offsets.len(),
        set.output_offsets.len()
    );
    Ok(set)
}

fn by_records(name: &str, protocol: &Protocol, table: &Table) -> Result<Set> {
    let Some(column) = table.names.iter().position(|name| name == "record") else {
        bail!("no column `record`");
    };
    let mut records: Vec<std::ops::Range<usize>> = Vec::new();
    for (index, row) in table.rows.iter().enumerate() {
        match records.last_mut() {
            Some(last) if same(table.rows[last.start][column], row[column]) => {
                last.end = index + 1;
            }
            _ => records.push(index..index + 1),
        }
    }
    let Some((last, rest)) = records.split_last().filter(|(_, rest)| !rest.is_empty()) else {
        bail!("{} records; at least 2 are needed", records.len());
    };
    let identification = table.dataset(protocol.sample_time_s, rest)?;
    Ok(Set {
        name: name.to_owned(),
        description: format!("{} records; the last one validates", records.len()),
        order: protocol.n,
        block_rows: protocol.s,
        input_offsets: protocol.u_mean.clone(),
        output_offsets: protocol.y_mean.clone(),
        validation: table.dataset(protocol.sample_time_s, std::slice::from_ref(last))?,
        identification,
        others: BTreeMap::new(),
    })
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 0.5
}
