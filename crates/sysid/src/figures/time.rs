//! Figures over time and over the horizon.

use deepc_core::faer::Mat;

use super::axis::{Axis, extent};
use super::chart::{INK, Key, LIMIT, Layer, Panel, Shape, Sheet, WIDTH, colour};
use crate::error::SysidError;

/// Fit of one model over the horizon.
#[derive(Debug, Clone, PartialEq)]
pub struct HorizonFit {
    /// Name in the legend.
    pub name: String,
    /// Fit in percent of predictions 1, 2, … steps ahead; none where it is not defined.
    pub fit_percent: Vec<Option<f64>>,
    /// Fit in percent of the simulation, drawn as a level.
    pub simulation_percent: Option<f64>,
}

/// Fits below this say only that the prediction is useless; the axis ends there.
const LOWEST_FIT: f64 = -20.0;

/// Prediction fit over the steps of the horizon, several models over one another; dashed levels are
/// fits of the simulation. Fits below −20 % lie below the axis.
///
/// # Errors
/// There is no model, or a value is not finite.
pub fn fit_over_horizon(title: &str, models: &[HorizonFit]) -> Result<String, SysidError> {
    let steps = models
        .iter()
        .map(|m| m.fit_percent.len())
        .max()
        .unwrap_or(0);
    let points = |m: &HorizonFit| -> Vec<(f64, f64)> {
        let all = m.fit_percent.iter().enumerate();
        let known = all.filter_map(|(k, fit)| Some(((k + 1) as f64, (*fit)?)));
        known.collect()
    };
    let fits = models.iter().flat_map(|m| {
        let known = m.fit_percent.iter().flatten().copied();
        known.chain(m.simulation_percent).collect::<Vec<_>>()
    });
    let (lowest, highest) = extent(fits.map(|fit| fit.max(LOWEST_FIT)));
    let room = (0.08 * (highest - lowest)).max(0.5);
    let x = Axis::counting("steps ahead", 1.0, steps.max(1) as f64);
    let y = Axis::between("fit / %", lowest - room, (highest + room).min(101.0));
    let (first, last) = x.range;
    let (mut layers, mut legend) = (Vec::new(), Vec::new());
    for (index, model) in models.iter().enumerate() {
        let hue = colour(index);
        if let Some(fit) = model.simulation_percent {
            layers.push(Layer::Dashes {
                points: vec![(first, fit), (last, fit)],
                colour: hue,
            });
        }
        layers.push(Layer::Line {
            points: points(model),
            colour: hue,
            width: 2,
        });
        layers.push(Layer::Marks {
            points: points(model),
            shape: Shape::of(index),
            colour: hue,
        });
        legend.push((model.name.clone(), Key::MarkedLine(Shape::of(index), hue)));
    }
    if models.iter().any(|m| m.simulation_percent.is_some()) {
        legend.push((
            "simulation, in the model's colour".to_owned(),
            Key::Dashes(LIMIT),
        ));
    }
    single(title, legend, (WIDTH, 380), models.is_empty(), x, y, layers)
}

/// One panel that fills the sheet.
pub(super) fn single(
    title: &str,
    legend: Vec<(String, Key)>,
    panel_size: (u32, u32),
    is_empty: bool,
    x: Axis,
    y: Axis,
    layers: Vec<Layer>,
) -> Result<String, SysidError> {
    let panel = Panel {
        title: String::new(),
        x,
        y,
        layers,
    };
    let sheet = Sheet {
        title: title.to_owned(),
        equal_scales: false,
        legend,
        columns: 1,
        panel_size,
        panels: if is_empty { Vec::new() } else { vec![panel] },
    };
    sheet.draw()
}

/// What a model computed for an output.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputCurve {
    /// Name in the legend, with the fit if it is to be read there.
    pub name: String,
    /// One value per measured one.
    pub values: Vec<f64>,
}

/// A measured output and what models computed.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputFigure {
    /// Title.
    pub title: String,
    /// Name and unit of the output.
    pub output: String,
    /// Sample time in seconds.
    pub sample_time_s: f64,
    /// Measured values of one record.
    pub measured: Vec<f64>,
    /// Simulated or predicted values.
    pub computed: Vec<OutputCurve>,
}

/// Measured and computed output, and below the error of each.
///
/// # Errors
/// Lengths differ, or a value is not finite.
pub fn measured_and_computed(figure: &OutputFigure) -> Result<String, SysidError> {
    let samples = figure.measured.len();
    for curve in &figure.computed {
        if curve.values.len() != samples {
            return Err(SysidError::Figure {
                figure: figure.title.clone(),
                problem: format!(
                    "`{}` has {} values for {samples} measured ones",
                    curve.name,
                    curve.values.len()
                ),
            });
        }
    }
    let over_time = |values: &mut dyn Iterator<Item = f64>| -> Vec<(f64, f64)> {
        let timed = values.enumerate();
        timed
            .map(|(k, v)| (k as f64 * figure.sample_time_s, v))
            .collect()
    };
    let end = samples.saturating_sub(1).max(1) as f64 * figure.sample_time_s;
    let time = || Axis::between("time / s", 0.0, end).with_ticks(9);
    let mut curves = vec![Layer::Line {
        points: over_time(&mut figure.measured.iter().copied()),
        colour: INK,
        width: 3,
    }];
    let mut legend = vec![("measured".to_owned(), Key::Line(INK))];
    let mut errors = Vec::new();
    let mut extremes = Vec::new();
    for (index, curve) in figure.computed.iter().enumerate() {
        let hue = colour(index);
        legend.push((curve.name.clone(), Key::Line(hue)));
        curves.push(Layer::Line {
            points: over_time(&mut curve.values.iter().copied()),
            colour: hue,
            width: 1,
        });
        let pairs = figure.measured.iter().zip(&curve.values);
        let differences: Vec<f64> = pairs.map(|(y, computed)| y - computed).collect();
        extremes.extend_from_slice(&differences);
        errors.push(Layer::Line {
            points: over_time(&mut differences.into_iter()),
            colour: hue,
            width: 1,
        });
    }
    let all = figure.computed.iter().flat_map(|curve| &curve.values);
    let all = all.chain(&figure.measured).copied();
    let mut panels = vec![Panel {
        title: String::new(),
        x: time(),
        y: Axis::over(figure.output.clone(), all),
        layers: curves,
    }];
    if !errors.is_empty() {
        panels.push(Panel {
            title: String::new(),
            x: time(),
            y: Axis::over("measured − computed", extremes.into_iter()).with_ticks(4),
            layers: errors,
        });
    }
    if samples == 0 {
        panels.clear();
    }
    Sheet {
        title: figure.title.clone(),
        equal_scales: false,
        legend,
        columns: 1,
        panel_size: (WIDTH, 300),
        panels,
    }
    .draw()
}

/// Step responses of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct StepCurve {
    /// Name in the legend.
    pub name: String,
    /// For every sample, p×M: see `StateSpace::step_response`.
    pub responses: Vec<Mat<f64>>,
    /// Standard deviations of the same shapes; empty if they are not known.
    pub standard_deviations: Vec<Mat<f64>>,
}

/// Step responses of all channels, of one or several models.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFigure {
    /// Title.
    pub title: String,
    /// Sample time in seconds.
    pub sample_time_s: f64,
    /// Names of the M inputs and measured disturbances.
    pub inputs: Vec<String>,
    /// Names of the p outputs.
    pub outputs: Vec<String>,
    /// The models.
    pub models: Vec<StepCurve>,
}

/// A grid of step responses, one row per output and one column per input, with bands of two
/// standard deviations where they are known.
///
/// # Errors
/// A shape does not fit, or a value is not finite.
pub fn step_responses(figure: &StepFigure) -> Result<String, SysidError> {
    let (p, m) = (figure.outputs.len(), figure.inputs.len());
    for model in &figure.models {
        let shapes = model.responses.iter().chain(&model.standard_deviations);
        let wrong = shapes.map(Mat::shape).find(|shape| *shape != (p, m));
        let deviations = model.standard_deviations.len();
        let count_fits = deviations == 0 || deviations == model.responses.len();
        if wrong.is_some() || !count_fits {
            let (rows, columns) = wrong.unwrap_or((p, m));
            return Err(SysidError::Figure {
                figure: figure.title.clone(),
                problem: format!(
                    "`{}` has {} responses, {deviations} standard deviations, and a matrix of \
                     {rows}×{columns} for {p}×{m} channels",
                    model.name,
                    model.responses.len()
                ),
            });
        }
    }
    let samples = figure.models.iter().map(|m| m.responses.len()).max();
    let samples = samples.unwrap_or(0);
    let end = samples.saturating_sub(1).max(1) as f64 * figure.sample_time_s;
    let mut panels = Vec::new();
    for i in 0..p {
        for j in 0..m {
            panels.push(step_panel(figure, i, j, end, m));
        }
    }
    if samples == 0 {
        panels.clear();
    }
    let models = figure.models.iter().enumerate();
    let mut legend: Vec<_> = models
        .map(|(index, model)| (model.name.clone(), Key::Line(colour(index))))
        .collect();
    if figure
        .models
        .iter()
        .any(|m| !m.standard_deviations.is_empty())
    {
        legend.push(("± 2 standard deviations".to_owned(), Key::Band(LIMIT)));
    }
    let columns = m.max(1);
    let width = (WIDTH / u32::try_from(columns).unwrap_or(1)).max(280);
    Sheet {
        title: figure.title.clone(),
        equal_scales: false,
        legend,
        columns,
        panel_size: (width, if m <= 2 { 280 } else { 230 }),
        panels,
    }
    .draw()
}

fn step_panel(figure: &StepFigure, i: usize, j: usize, end: f64, columns: usize) -> Panel {
    let time = |k: usize| k as f64 * figure.sample_time_s;
    let mut layers = Vec::new();
    let mut extremes = vec![0.0];
    for (index, model) in figure.models.iter().enumerate() {
        let pairs = model.responses.iter().zip(&model.standard_deviations);
        let band = pairs.enumerate().map(|(k, (response, deviation))| {
            let (value, two) = (response[(i, j)], 2.0 * deviation[(i, j)]);
            (time(k), value - two, value + two)
        });
        let band: Vec<_> = band.collect();
        extremes.extend(band.iter().flat_map(|point| [point.1, point.2]));
        if !band.is_empty() {
            layers.push(Layer::Band {
                points: band,
                colour: colour(index),
            });
        }
    }
    for (index, model) in figure.models.iter().enumerate() {
        let values = model.responses.iter().map(|response| response[(i, j)]);
        extremes.extend(values.clone());
        layers.push(Layer::Line {
            points: values.enumerate().map(|(k, v)| (time(k), v)).collect(),
            colour: colour(index),
            width: 2,
        });
    }
    layers.push(Layer::Dashes {
        points: vec![(0.0, 0.0), (end, 0.0)],
        colour: LIMIT,
    });
    let ticks = if columns <= 2 { 6 } else { 4 };
    Panel {
        title: format!("{} → {}", figure.inputs[j], figure.outputs[i]),
        x: Axis::between("time / s", 0.0, end).with_ticks(ticks),
        y: Axis::over("", extremes.into_iter()).with_ticks(5),
        layers,
    }
}
