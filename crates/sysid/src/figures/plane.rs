//! Poles and zeros in the complex plane.

use std::f64::consts::TAU;

use super::axis::{Axis, extent};
use super::chart::{Key, LIMIT, Layer, Panel, Shape, Sheet, WIDTH, colour};
use crate::error::SysidError;

/// Poles and zeros of one model as (real, imaginary).
#[derive(Debug, Clone, PartialEq)]
pub struct PoleZeroMap {
    /// Name in the legend.
    pub name: String,
    /// Poles.
    pub poles: Vec<(f64, f64)>,
    /// Zeros; those far outside of the unit circle lie beyond the figure and are counted below it.
    pub zeros: Vec<(f64, f64)>,
}

/// Zeros farther out than this are not drawn.
const FARTHEST: f64 = 3.0;
/// Poles that fill less than this share of the circle's width are drawn again, enlarged.
const CROWDED: f64 = 0.35;

/// Poles (crosses) and zeros (rings) with the unit circle, to one scale in both directions; if the
/// poles crowd, as fast sampling makes them do near 1, a second panel enlarges them.
///
/// # Errors
/// There is no model, or a value is not finite.
pub fn pole_zero_map(title: &str, models: &[PoleZeroMap]) -> Result<String, SysidError> {
    // NaN stays in, for the sheet to refuse.
    let beyond = |z: &(f64, f64)| z.0.hypot(z.1) > FARTHEST;
    let shown = || {
        models.iter().flat_map(move |model| {
            let all = model.poles.iter().chain(&model.zeros);
            all.filter(|z| !beyond(z)).copied().collect::<Vec<_>>()
        })
    };
    let reach = shown()
        .map(|z| z.0.abs().max(z.1.abs()))
        .fold(1.0, f64::max)
        * 1.12;
    let poles = || models.iter().flat_map(|model| model.poles.iter().copied());
    let real = extent(poles().map(|z| z.0));
    let imaginary = extent(poles().map(|z| z.1));
    let spread = (real.1 - real.0).max(imaginary.1 - imaginary.0);
    let crowded = poles().count() > 1 && spread < 2.0 * CROWDED;
    let size = if crowded { WIDTH / 2 } else { WIDTH * 2 / 3 };
    let panel = |title: &str, x: (f64, f64), y: (f64, f64)| Panel {
        title: title.to_owned(),
        x: Axis::between("real part", x.0, x.1).with_ticks(5),
        y: Axis::between("imaginary part", y.0, y.1).with_ticks(5),
        layers: layers(models),
    };
    let mut panels = Vec::new();
    if !models.is_empty() {
        let circle = (-reach, reach);
        panels.push(panel(
            if crowded { "unit circle" } else { "" },
            circle,
            circle,
        ));
    }
    if crowded {
        let half = (0.65 * spread).max(1e-3);
        let around = |(low, high): (f64, f64)| {
            let middle = 0.5 * (low + high);
            (middle - half, middle + half)
        };
        panels.push(panel("enlarged", around(real), around(imaginary)));
    }
    let mut legend = Vec::new();
    for (index, model) in models.iter().enumerate() {
        let far = model.zeros.iter().filter(|z| beyond(z)).count();
        let hue = colour(index);
        legend.push((
            format!("{} poles", model.name),
            Key::Mark(Shape::Cross, hue),
        ));
        let mut name = format!("{} zeros", model.name);
        if far > 0 {
            name = format!("{name} ({far} beyond {FARTHEST})");
        }
        if !model.zeros.is_empty() {
            legend.push((name, Key::Mark(Shape::Ring, hue)));
        }
    }
    Sheet {
        title: title.to_owned(),
        equal_scales: true,
        legend,
        columns: panels.len().max(1),
        panel_size: (size, size),
        panels,
    }
    .draw()
}

fn layers(models: &[PoleZeroMap]) -> Vec<Layer> {
    let circle = (0..=720).map(|k| {
        let angle = f64::from(k) / 720.0 * TAU;
        (angle.cos(), angle.sin())
    });
    let axis = |points: [(f64, f64); 2]| Layer::Dashes {
        points: points.to_vec(),
        colour: LIMIT,
    };
    let mut layers = vec![
        axis([(-FARTHEST, 0.0), (FARTHEST, 0.0)]),
        axis([(0.0, -FARTHEST), (0.0, FARTHEST)]),
        Layer::Line {
            points: circle.collect(),
            colour: LIMIT,
            width: 1,
        },
    ];
    for (index, model) in models.iter().enumerate() {
        for (points, shape) in [(&model.zeros, Shape::Ring), (&model.poles, Shape::Cross)] {
            layers.push(Layer::Marks {
                points: points.clone(),
                shape,
                colour: colour(index),
            });
        }
    }
    layers
}
