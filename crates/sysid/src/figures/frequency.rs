//! Frequency responses with their uncertainty.

use deepc_core::faer::c64;

use super::axis::{Axis, extent};
use super::chart::{Key, LIMIT, Layer, Panel, Sheet, WIDTH, colour};
use crate::error::SysidError;

/// Frequency response of one channel of one model, one value per frequency of the figure.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyCurve {
    /// Name in the legend.
    pub name: String,
    /// Magnitude.
    pub magnitude: Vec<f64>,
    /// Phase in degrees.
    pub phase_deg: Vec<f64>,
    /// Lower and upper end of the magnitude's band; empty if it is not known.
    pub magnitude_band: Vec<(f64, f64)>,
    /// Lower and upper end of the phase's band in degrees; empty if it is not known.
    pub phase_band_deg: Vec<(f64, f64)>,
}

impl FrequencyCurve {
    /// Of complex values, the phase without jumps. `standard_deviations` of the complex values
    /// (radius of a circle), empty if not known, become bands of ± 2 of them; where the circle
    /// holds the origin the phase can be anything and its band is ± 180°.
    #[must_use]
    pub fn new(name: impl Into<String>, values: &[c64], standard_deviations: &[f64]) -> Self {
        let mut phase_deg = Vec::with_capacity(values.len());
        for value in values {
            let phase = value.im.atan2(value.re).to_degrees();
            let turns = phase_deg
                .last()
                .map_or(0.0, |last: &f64| ((last - phase) / 360.0).round());
            phase_deg.push(phase + 360.0 * turns);
        }
        let magnitude: Vec<f64> = values.iter().map(|value| value.norm()).collect();
        let radii = || magnitude.iter().zip(standard_deviations);
        let magnitude_band =
            radii().map(|(size, sd)| ((size - 2.0 * sd).max(0.0), size + 2.0 * sd));
        let half = radii().map(|(size, sd)| {
            if 2.0 * sd < *size {
                (2.0 * sd / size).asin().to_degrees()
            } else {
                180.0
            }
        });
        let phase_band_deg = phase_deg
            .iter()
            .zip(half)
            .map(|(p, half)| (p - half, p + half));
        Self {
            name: name.into(),
            magnitude_band: magnitude_band.collect(),
            phase_band_deg: phase_band_deg.collect(),
            magnitude,
            phase_deg,
        }
    }
}

/// Values with their band.
type Part<'a> = (&'a [f64], &'a [(f64, f64)]);

/// Frequency responses of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct FrequencyFigure {
    /// Title, say `valve → level`.
    pub title: String,
    /// Label of the magnitude axis with its unit.
    pub magnitude_label: String,
    /// Frequencies in Hz, above 0, ascending.
    pub frequencies_hz: Vec<f64>,
    /// The curves.
    pub curves: Vec<FrequencyCurve>,
}

/// Magnitude and phase over frequency, with bands where they are known.
///
/// # Errors
/// Lengths differ, a frequency is not above 0, or a value is not finite.
pub fn frequency_response(figure: &FrequencyFigure) -> Result<String, SysidError> {
    check(figure)?;
    let curves = || figure.curves.iter().enumerate();
    let over = |values: &[f64]| -> Vec<(f64, f64)> {
        let frequencies = figure.frequencies_hz.iter().copied();
        frequencies.zip(values.iter().copied()).collect()
    };
    let band = |values: &[(f64, f64)]| -> Vec<(f64, f64, f64)> {
        let frequencies = figure.frequencies_hz.iter();
        let all = frequencies.zip(values);
        all.map(|(f, (low, high))| (*f, *low, *high)).collect()
    };
    let layers = |of: fn(&FrequencyCurve) -> Part<'_>| {
        let bands = curves().filter_map(|(index, curve)| {
            let points = band(of(curve).1);
            let hue = colour(index);
            (!points.is_empty()).then_some(Layer::Band {
                points,
                colour: hue,
            })
        });
        let lines = curves().map(|(index, curve)| Layer::Line {
            points: over(of(curve).0),
            colour: colour(index),
            width: 2,
        });
        bands.chain(lines).collect::<Vec<_>>()
    };
    let magnitudes = || {
        figure
            .curves
            .iter()
            .flat_map(|curve| curve.magnitude.clone())
    };
    // A band that reaches down to nothing must not push the curves together.
    let smallest = extent(magnitudes().filter(|value| *value > 0.0)).0;
    let bands = figure
        .curves
        .iter()
        .flat_map(|curve| curve.magnitude_band.clone());
    let ends = bands.flat_map(|(low, high)| [low.max(0.1 * smallest), high]);
    let phases = figure.curves.iter().flat_map(|curve| {
        let line = curve.phase_deg.clone();
        // Likewise a phase that could be anything.
        let band = curve
            .phase_band_deg
            .iter()
            .filter(|band| band.1 - band.0 < 180.0);
        line.into_iter()
            .chain(band.flat_map(|band| [band.0, band.1]))
            .collect::<Vec<_>>()
    });
    let frequency = || {
        let (low, high) = extent(figure.frequencies_hz.iter().copied());
        Axis {
            logarithmic: true,
            ..Axis::between("frequency / Hz", low, high.max(low * 1.01)).with_ticks(9)
        }
    };
    let magnitude = Axis::logarithmic(figure.magnitude_label.clone(), magnitudes().chain(ends));
    let panels = if figure.frequencies_hz.is_empty() || figure.curves.is_empty() {
        Vec::new()
    } else {
        vec![
            Panel {
                title: String::new(),
                x: frequency(),
                y: magnitude,
                layers: layers(|curve| (&curve.magnitude, &curve.magnitude_band)),
            },
            Panel {
                title: String::new(),
                x: frequency(),
                y: Axis::over("phase / °", phases),
                layers: layers(|curve| (&curve.phase_deg, &curve.phase_band_deg)),
            },
        ]
    };
    let mut legend: Vec<_> = curves()
        .map(|(index, curve)| (curve.name.clone(), Key::Line(colour(index))))
        .collect();
    if figure
        .curves
        .iter()
        .any(|curve| !curve.magnitude_band.is_empty())
    {
        legend.push(("± 2 standard deviations".to_owned(), Key::Band(LIMIT)));
    }
    Sheet {
        title: figure.title.clone(),
        equal_scales: false,
        legend,
        columns: 1,
        panel_size: (WIDTH, 290),
        panels,
    }
    .draw()
}

fn check(figure: &FrequencyFigure) -> Result<(), SysidError> {
    let wrong = |problem: String| {
        Err(SysidError::Figure {
            figure: figure.title.clone(),
            problem,
        })
    };
    if let Some(found) = figure
        .frequencies_hz
        .iter()
        .find(|f| f.is_nan() || **f <= 0.0)
    {
        return wrong(format!(
            "a frequency is {found} Hz; a logarithmic axis begins above 0"
        ));
    }
    let expected = figure.frequencies_hz.len();
    for curve in &figure.curves {
        let (magnitudes, phases) = (curve.magnitude.len(), curve.phase_deg.len());
        let bands = [curve.magnitude_band.len(), curve.phase_band_deg.len()];
        let fits = |length: &usize| *length == 0 || *length == expected;
        if magnitudes != expected || phases != expected || !bands.iter().all(fits) {
            return wrong(format!(
                "`{}` has {magnitudes} magnitudes, {phases} phases and bands of {} and {} for \
                 {expected} frequencies",
                curve.name, bands[0], bands[1]
            ));
        }
    }
    Ok(())
}
