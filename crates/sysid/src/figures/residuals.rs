//! Auto- and cross-correlations of a residual.

use super::axis::Axis;
use super::chart::{Key, LIMIT, Layer, Panel, Sheet, WIDTH, colour};
use crate::error::SysidError;
use crate::validation::{Correlation, ResidualTests};

/// Autocorrelation of the one-step residual of an output, and its cross-correlation with every
/// input, with the bands that the correlations of the true model keep to at `confidence`. Lags
/// outside are red.
///
/// # Errors
/// The residual was rounding, so that there is nothing to draw.
pub fn residual_correlations(
    output: &str,
    tests: &ResidualTests,
    confidence: f64,
) -> Result<String, SysidError> {
    let mut panels = Vec::new();
    if let Some(whiteness) = &tests.whiteness {
        let title = format!(
            "residual with itself, {} of {} lags outside",
            whiteness.outside,
            whiteness.correlation.lags.len()
        );
        panels.push(panel(title, &whiteness.correlation));
    }
    for test in &tests.inputs {
        let title = format!(
            "residual with {}, {} of {} lags outside",
            test.input,
            test.outside,
            test.correlation.lags.len()
        );
        panels.push(panel(title, &test.correlation));
    }
    let columns = panels.len().clamp(1, 2);
    let percent = (confidence * 1e6).round() / 1e4;
    Sheet {
        title: format!("Residual of {output}"),
        equal_scales: false,
        legend: vec![
            ("within the band".to_owned(), Key::Line(colour(0))),
            ("outside".to_owned(), Key::Line(colour(1))),
            (format!("{percent} % band"), Key::Band(LIMIT)),
        ],
        columns,
        panel_size: (WIDTH / u32::try_from(columns).unwrap_or(1), 280),
        panels,
    }
    .draw()
}

fn panel(title: String, correlation: &Correlation) -> Panel {
    let (mut within, mut outside, mut band) = (Vec::new(), Vec::new(), Vec::new());
    let values = correlation.values.iter().zip(&correlation.bands);
    for (&lag, (&value, &half)) in correlation.lags.iter().zip(values) {
        let lag = lag as f64;
        band.push((lag, -half, half));
        if value.abs() > half {
            outside.push((lag, value));
        } else {
            within.push((lag, value));
        }
    }
    let lags = || correlation.lags.iter().map(|&lag| lag as f64);
    let (first, last) = super::axis::extent(lags());
    let extremes = band.iter().flat_map(|point| [1.3 * point.1, 1.3 * point.2]);
    let extremes = extremes.chain(correlation.values.iter().copied());
    let y = Axis::over("correlation", extremes.collect::<Vec<_>>().into_iter());
    Panel {
        title,
        x: Axis::counting("lag / samples", first, last).with_ticks(7),
        y,
        layers: vec![
            Layer::Band {
                points: band,
                colour: LIMIT,
            },
            Layer::Line {
                points: vec![(first - 0.6, 0.0), (last + 0.6, 0.0)],
                colour: LIMIT,
                width: 1,
            },
            Layer::Stems {
                points: within,
                colour: colour(0),
            },
            Layer::Stems {
                points: outside,
                colour: colour(1),
            },
        ],
    }
}
