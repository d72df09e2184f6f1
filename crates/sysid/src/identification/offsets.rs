//! What has to be said of a model whose offsets are not found.

use deepc_core::faer::ColRef;

use super::settings::OffsetChoice;
use crate::state_space::Channel;
use crate::working::{WorkingData, WorkingRecord};

/// Variances of the scaled outputs; 1, except of raw data, whose scales hold the mean, too.
pub(super) fn variances(scaled: &WorkingData, offsets: OffsetChoice) -> Vec<f64> {
    let outputs = 0..scaled.outputs.len();
    if offsets != OffsetChoice::None {
        return outputs.map(|_| 1.0).collect();
    }
    let variance = |i| moments(scaled, |record| record.outputs.col(i)).1;
    outputs.map(variance).collect()
}

/// A warning for every channel of raw data that keeps further from the origin than it varies.
pub(super) fn warnings(scaled: &WorkingData, offsets: OffsetChoice) -> Vec<String> {
    if offsets != OffsetChoice::None {
        return Vec::new();
    }
    let inputs = scaled.inputs.iter().enumerate().map(|(j, channel)| {
        let moments = moments(scaled, |record| record.inputs.col(j));
        (
            channel,
            moments,
            "its gains also explain what its mean seems to do",
        )
    });
    let outputs = scaled.outputs.iter().enumerate().map(|(i, channel)| {
        let moments = moments(scaled, |record| record.outputs.col(i));
        (
            channel,
            moments,
            "gains to it also explain where its mean comes from",
        )
    });
    let away = inputs
        .chain(outputs)
        .filter(|(_, (mean, variance), _)| mean.abs() > variance.sqrt());
    away.map(|(channel, moments, what)| warning(channel, moments, what))
        .collect()
}

fn warning(channel: &Channel, (mean, variance): (f64, f64), what: &str) -> String {
    format!(
        "the model goes through the origin, but `{}` has mean {:.4} and standard deviation {:.2e} in the \
         recording: {what}, which their standard errors do not allow for. Unless the plant goes through \
         the origin, let offsets be found (`offsets`)",
        channel.name,
        mean * channel.scale,
        variance.sqrt() * channel.scale
    )
}

/// Mean and variance of a scaled channel over all records.
fn moments<'a>(
    scaled: &'a WorkingData,
    of: impl Fn(&'a WorkingRecord) -> ColRef<'a, f64>,
) -> (f64, f64) {
    let values = || scaled.records.iter().flat_map(|record| of(record).iter());
    let samples = scaled.samples() as f64;
    let mean = values().sum::<f64>() / samples;
    let squares = values().map(|value| (value - mean).powi(2));
    (mean, squares.sum::<f64>() / samples)
}
