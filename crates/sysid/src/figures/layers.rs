//! What is drawn within a panel.

use plotters::prelude::*;

use super::chart::{Chart, Drawn, FINE, Layer, Panel, Points, draw_mark, pixel, stroke};

/// Points of a line above which only each pixel's extremes are kept.
const MOST_POINTS: usize = 4000;
/// Pieces into which such a line is cut.
const PIECES: usize = 900;

pub(super) fn draw_layer(chart: &mut Chart<'_, '_>, panel: &Panel, layer: &Layer) -> Drawn {
    let place = |&(x, y): &(f64, f64)| (panel.x.place(x), panel.y.place(y));
    let (x, y) = (panel.x.ends(), panel.y.ends());
    let placed = |points: &Points| thinned(points).iter().map(place).collect::<Points>();
    match layer {
        Layer::Line {
            points,
            colour,
            width,
        } => {
            for piece in clipped(&placed(points), x, y) {
                chart.draw_series(LineSeries::new(piece, stroke(*colour, *width)))?;
            }
        }
        Layer::Dashes { points, colour } => {
            for piece in clipped(&placed(points), x, y) {
                let dashes = DashedLineSeries::new(piece, 6 * FINE, 4 * FINE, stroke(*colour, 1));
                chart.draw_series(dashes)?;
            }
        }
        Layer::Band { points, colour } => {
            let inside = points.iter().filter(|point| {
                let at = panel.x.place(point.0);
                at >= x.0 - 1e-9 && at <= x.1 + 1e-9
            });
            let edge = |value: f64| panel.y.place(value).clamp(y.0, y.1);
            let lower = inside.clone().map(|p| (panel.x.place(p.0), edge(p.1)));
            let upper = inside.rev().map(|p| (panel.x.place(p.0), edge(p.2)));
            let outline: Points = lower.chain(upper).collect();
            let band = Polygon::new(outline, colour.mix(0.2).filled());
            chart.draw_series(std::iter::once(band))?;
        }
        Layer::Stems { points, colour } => {
            for &(at, value) in points {
                let stem = PathElement::new([(at, 0.0), (at, value)], stroke(*colour, 2));
                chart.draw_series(std::iter::once(stem))?;
            }
            let dots = points
                .iter()
                .map(|&at| Circle::new(at, pixel(3), colour.filled()));
            chart.draw_series(dots)?;
        }
        Layer::Marks {
            points,
            shape,
            colour,
        } => {
            let inside = points
                .iter()
                .map(place)
                .filter(|point| (x.0..=x.1).contains(&point.0) && (y.0..=y.1).contains(&point.1));
            for at in inside {
                let pixels = chart.plotting_area().map_coordinate(&at);
                let root = chart.plotting_area().strip_coord_spec();
                let corner = root.get_base_pixel();
                draw_mark(
                    &root,
                    (pixels.0 - corner.0, pixels.1 - corner.1),
                    *shape,
                    *colour,
                )?;
            }
        }
    }
    Ok(())
}

/// A long line as first, lowest, highest and last point of every piece: it looks the same.
fn thinned(points: &Points) -> Points {
    if points.len() <= MOST_POINTS {
        return points.clone();
    }
    let piece = points.len().div_ceil(PIECES);
    let mut kept = Points::new();
    for piece in points.chunks(piece) {
        let by = |a: &usize, b: &usize| piece[*a].1.total_cmp(&piece[*b].1);
        let all = || 0..piece.len();
        let mut indices = vec![0, piece.len() - 1];
        indices.extend(all().min_by(by));
        indices.extend(all().max_by(by));
        indices.sort_unstable();
        indices.dedup();
        kept.extend(indices.into_iter().map(|index| piece[index]));
    }
    kept
}

/// The pieces of a line within the panel.
fn clipped(points: &Points, x: (f64, f64), y: (f64, f64)) -> Vec<Points> {
    let mut pieces: Vec<Points> = Vec::new();
    let mut end = None;
    for pair in points.windows(2) {
        let Some((from, to)) = segment(pair[0], pair[1], x, y) else {
            end = None;
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if end == Some(from) => piece.push(to),
            _ => pieces.push(vec![from, to]),
        }
        end = Some(to);
    }
    pieces
}

/// The part of a segment within a rectangle (Liang and Barsky's clipping).
fn segment(
    from: (f64, f64),
    to: (f64, f64),
    x: (f64, f64),
    y: (f64, f64),
) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (direction, distance) in [
        (-dx, from.0 - x.0),
        (dx, x.1 - from.0),
        (-dy, from.1 - y.0),
        (dy, y.1 - from.1),
    ] {
        if direction == 0.0 {
            if distance < 0.0 {
                return None;
            }
        } else if direction < 0.0 {
            enter = enter.max(distance / direction);
        } else {
            leave = leave.min(distance / direction);
        }
    }
    let at = |t: f64| match t {
        0.0 => from,
        1.0 => to,
        _ => (from.0 + t * dx, from.1 + t * dy),
    };
    (enter <= leave).then(|| (at(enter), at(leave)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_panel() {
        let unit = (0.0, 1.0);
        let line = vec![(-1.0, 0.5), (0.5, 0.5), (0.5, 3.0), (0.75, 0.5), (0.9, 0.5)];
        let pieces = clipped(&line, unit, unit);
        assert_eq!(pieces.len(), 2);
        assert_eq!(pieces[0], [(0.0, 0.5), (0.5, 0.5), (0.5, 1.0)]);
        assert_eq!(pieces[1][1..], [(0.75, 0.5), (0.9, 0.5)]);
        assert!((pieces[1][0].1 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn long_lines_keep_their_peaks() {
        let mut line: Points = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        line[54_321].1 = 7.0;
        line[54_322].1 = -7.0;
        let thin = thinned(&line);
        assert!(thin.len() < MOST_POINTS);
        assert!(thin.contains(&(54_321.0, 7.0)) && thin.contains(&(54_322.0, -7.0)));
        assert!(thin.is_sorted_by(|a, b| a.0 < b.0));
    }
}
