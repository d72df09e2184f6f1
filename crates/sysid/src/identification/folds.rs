//! Which samples a model is made from and which judge it.

use super::candidate::{Basis, bases};
use super::settings::IdentificationSettings;
use crate::error::SysidError;
use crate::working::{WorkingData, WorkingRecord};

/// Samples in a row that are worth holding out.
const SHORTEST: usize = 20;

/// One part of the records held out, and what is made from the rest.
pub(super) struct Fold {
    /// With the constant channel.
    pub training: WorkingData,
    /// With the constant channel.
    pub held_out: WorkingData,
    /// Projections of the training records.
    pub bases: Vec<Basis>,
}

/// The records cut into parts, each held out once: (training, held out). Long records are cut into
/// contiguous parts, short ones are held out whole, in turn.
pub(super) fn split(
    data: &WorkingData,
    folds: usize,
) -> Result<Vec<(WorkingData, WorkingData)>, SysidError> {
    let mut parts = vec![(Vec::new(), Vec::new()); folds];
    let mut short = 0;
    for record in &data.records {
        let samples = record.samples();
        if samples >= folds * SHORTEST {
            for (fold, (training, held_out)) in parts.iter_mut().enumerate() {
                let (from, to) = (samples * fold / folds, samples * (fold + 1) / folds);
                held_out.push(rows(record, from, to - from));
                for (first, last) in [(0, from), (to, samples)] {
                    if last > first {
                        training.push(rows(record, first, last - first));
                    }
                }
            }
        } else {
            for (fold, (training, held_out)) in parts.iter_mut().enumerate() {
                if fold == short % folds {
                    held_out.push(record.clone());
                } else {
                    training.push(record.clone());
                }
            }
            short += 1;
        }
    }
    let empty = parts.iter().any(|(t, h)| t.is_empty() || h.is_empty());
    if empty {
        let longest = data.records.iter().map(WorkingRecord::samples).max();
        return Err(SysidError::NothingToHoldOut {
            longest: longest.unwrap_or(0),
            records: data.records.len(),
            folds,
            needed: folds * SHORTEST,
        });
    }
    let with = |records| data.with_records(records);
    let parts = parts.into_iter();
    Ok(parts.map(|(t, h)| (with(t), with(h))).collect())
}

/// What is too short is what is left of the records when one part is held out; a user knows the whole
/// records.
pub(super) fn of_whole_records(error: SysidError, data: &WorkingData, folds: usize) -> SysidError {
    match error {
        SysidError::TooShort {
            past,
            future,
            channels,
            needed,
            window,
            ..
        } => {
            let longest = data.records.iter().map(WorkingRecord::samples).max();
            SysidError::TooShort {
                longest: longest.unwrap_or(0),
                past,
                future,
                channels,
                needed: (needed * folds).div_ceil(folds - 1),
                window: (window * folds).div_ceil(folds - 1),
            }
        }
        other => other,
    }
}

/// Projects the training records of every split. One without excitation (the input was still most of
/// the time) is left out, unless nothing is left.
pub(super) fn project(
    splits: &[(WorkingData, WorkingData)],
    horizons: &[usize],
    settings: &IdentificationSettings,
) -> Result<Vec<Fold>, SysidError> {
    let (mut folds, mut failure) = (Vec::new(), None);
    for split in splits {
        match Fold::new(split, horizons, settings) {
            Ok(fold) => folds.push(fold),
            Err(error) => {
                failure.get_or_insert(error);
            }
        }
    }
    match failure {
        Some(error) if folds.is_empty() => Err(error),
        _ => Ok(folds),
    }
}

impl Fold {
    fn new(
        (training, held_out): &(WorkingData, WorkingData),
        horizons: &[usize],
        settings: &IdentificationSettings,
    ) -> Result<Self, SysidError> {
        Ok(Self {
            bases: bases(training, horizons, settings)?,
            training: training.with_constant(),
            held_out: held_out.with_constant(),
        })
    }
}

fn rows(record: &WorkingRecord, from: usize, count: usize) -> WorkingRecord {
    WorkingRecord {
        inputs: record.inputs.subrows(from, count).to_owned(),
        outputs: record.outputs.subrows(from, count).to_owned(),
    }
}
