//! How an order was chosen.

use super::axis::Axis;
use super::chart::{Key, LIMIT, Layer, Shape, WIDTH, colour};
use super::time::single;
use crate::error::SysidError;

/// Singular values and the order that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct SingularValues {
    /// Title.
    pub title: String,
    /// Values, largest first; those that are 0 are left out.
    pub values: Vec<f64>,
    /// The first so many belong to the model.
    pub chosen: usize,
}

/// Singular values over their number, those of the model apart from the rest.
///
/// # Errors
/// There are no values, or one is not finite.
pub fn singular_values(figure: &SingularValues) -> Result<String, SysidError> {
    let all = || (1_usize..).zip(figure.values.iter().copied());
    let part = |kept: bool| -> Vec<(f64, f64)> {
        let values = all().filter(|(number, v)| (*number <= figure.chosen) == kept && *v > 0.0);
        values
            .map(|(number, value)| (number as f64, value))
            .collect()
    };
    let x = Axis::counting("number", 1.0, figure.values.len() as f64);
    let y = Axis::logarithmic("singular value", figure.values.iter().copied());
    let between = figure.chosen as f64 + 0.5;
    let layers = vec![
        Layer::Dashes {
            points: vec![(between, y.range.0), (between, y.range.1)],
            colour: LIMIT,
        },
        Layer::Marks {
            points: part(true),
            shape: Shape::Dot,
            colour: colour(0),
        },
        Layer::Marks {
            points: part(false),
            shape: Shape::Ring,
            colour: colour(1),
        },
    ];
    let legend = vec![
        (
            format!("of the model (order {})", figure.chosen),
            Key::Mark(Shape::Dot, colour(0)),
        ),
        ("left out".to_owned(), Key::Mark(Shape::Ring, colour(1))),
    ];
    let is_empty = part(true).is_empty() && part(false).is_empty();
    single(&figure.title, legend, (WIDTH, 380), is_empty, x, y, layers)
}

/// Error over the order of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderCurve {
    /// Title.
    pub title: String,
    /// Label of the error axis with its unit.
    pub error_label: String,
    /// Orders.
    pub orders: Vec<usize>,
    /// Error of each, above 0.
    pub errors: Vec<f64>,
    /// Standard error of each; empty if not known.
    pub standard_errors: Vec<f64>,
    /// The order chosen.
    pub chosen: usize,
}

/// Error over order with the choice marked, and a band of one standard error where it is known.
///
/// # Errors
/// Lengths differ, there is nothing to draw, or a value is not finite.
pub fn order_curve(figure: &OrderCurve) -> Result<String, SysidError> {
    let (orders, errors) = (figure.orders.len(), figure.errors.len());
    let known = figure.standard_errors.len();
    if orders != errors || (known != 0 && known != orders) {
        return Err(SysidError::Figure {
            figure: figure.title.clone(),
            problem: format!(
                "{orders} orders come with {errors} errors and {known} standard errors"
            ),
        });
    }
    let pairs = || figure.orders.iter().zip(&figure.errors);
    let point = |(order, error): (&usize, &f64)| (*order as f64, *error);
    let points: Vec<(f64, f64)> = pairs().map(point).collect();
    let band = points.iter().zip(&figure.standard_errors);
    let band: Vec<_> = band.map(|(&(x, y), se)| (x, y - se, y + se)).collect();
    let chosen = pairs().filter(|(order, _)| **order == figure.chosen);
    let chosen: Vec<_> = chosen.map(point).collect();
    let ends = band.iter().flat_map(|point| [point.1, point.2]);
    let y = Axis::logarithmic(
        figure.error_label.clone(),
        points.iter().map(|point| point.1).chain(ends),
    );
    let (low, high) = super::axis::extent(points.iter().map(|point| point.0));
    let x = Axis::counting("order", low, high);
    let mut legend = vec![
        ("error".to_owned(), Key::Line(colour(0))),
        (
            format!("chosen: order {}", figure.chosen),
            Key::Mark(Shape::Dot, colour(1)),
        ),
    ];
    let mut layers = Vec::new();
    if !band.is_empty() {
        legend.push(("± 1 standard error".to_owned(), Key::Band(LIMIT)));
        layers.push(Layer::Band {
            points: band,
            colour: colour(0),
        });
    }
    for (points, shape, hue) in [
        (points.clone(), Shape::Ring, colour(0)),
        (chosen, Shape::Dot, colour(1)),
    ] {
        layers.push(Layer::Line {
            points: points.clone(),
            colour: hue,
            width: 2,
        });
        layers.push(Layer::Marks {
            points,
            shape,
            colour: hue,
        });
    }
    let is_empty = points.is_empty();
    single(&figure.title, legend, (WIDTH, 380), is_empty, x, y, layers)
}
