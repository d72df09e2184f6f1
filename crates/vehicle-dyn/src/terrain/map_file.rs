//! Reading maps of measured heights. Errors are the reasons, for the message that names the file.

use super::file::Arrays;
use super::height_map::{HeightNodes, LEAST_NODES, MOST_NODES, MapFriction};

/// Largest deviation of a node from its place on the grid, in spacings.
const PLACE_TOLERANCE: f64 = 1e-3;
/// Heights allowed, m.
const HEIGHT_M: std::ops::RangeInclusive<f64> = -1e4..=1e4;
/// Friction allowed.
const FRICTION: std::ops::RangeInclusive<f64> = 0.01..=1.5;

/// Checks what both kinds of files must hold.
fn checked(nodes: HeightNodes) -> Result<HeightNodes, String> {
    let [nx, ny] = nodes.size;
    if nx < LEAST_NODES || ny < LEAST_NODES || nx.saturating_mul(ny) > MOST_NODES {
        return Err(format!(
            "it has {nx} nodes along x and {ny} along y: at least {LEAST_NODES} each way and at most {MOST_NODES} in all are read"
        ));
    }
    let finite = nodes.x0_m.is_finite() && nodes.y0_m.is_finite();
    if !(finite && nodes.spacing_m >= 1e-3 && nodes.spacing_m <= 1e4) {
        return Err(format!(
            "x0_m = {}, y0_m = {}, spacing_m = {}: the origin must be finite and the spacing in [0.001, 10000] m",
            nodes.x0_m, nodes.y0_m, nodes.spacing_m
        ));
    }
    let node = |index: usize| format!("node {} along x, {} along y", index % nx, index / nx);
    let high = |h: &f64| !HEIGHT_M.contains(h);
    if let Some(index) = nodes.height_m.iter().position(high) {
        return Err(format!(
            "height_m = {} at {} (from 0): must be a height in [-10000, 10000] m",
            nodes.height_m[index],
            node(index)
        ));
    }
    let slippery = |f: &f64| !FRICTION.contains(f);
    let wrong = match &nodes.friction {
        MapFriction::Uniform(f) => slippery(f).then(|| (*f, "the whole map".to_owned())),
        MapFriction::Nodes(all) => all
            .iter()
            .position(slippery)
            .map(|index| (all[index], node(index))),
    };
    match wrong {
        Some((friction, place)) => Err(format!(
            "friction = {friction} at {place}: must be in [0.01, 1.5]"
        )),
        None => Ok(nodes),
    }
}

/// A map from the arrays of an archive.
pub(super) fn from_arrays(arrays: &mut Arrays, friction: f64) -> Result<HeightNodes, String> {
    let mut number = |name: &str| {
        let (_, values) = arrays.numbers(name)?;
        match values[..] {
            [value] => Ok(value),
            _ => Err(format!(
                "`{name}` must be one number, it has {}",
                values.len()
            )),
        }
    };
    let (x0_m, y0_m, spacing_m) = (number("x0_m")?, number("y0_m")?, number("spacing_m")?);
    let (shape, height_m) = arrays.numbers("height_m")?;
    let size = match shape[..] {
        [ny, nx] => [nx, ny].map(|n| usize::try_from(n).unwrap_or(usize::MAX)),
        _ => {
            return Err(format!(
                "`height_m` has shape {shape:?}: it must be (nodes along y, nodes along x)"
            ));
        }
    };
    let friction = if arrays.has("friction") {
        let (friction_shape, values) = arrays.numbers("friction")?;
        match values[..] {
            [value] => MapFriction::Uniform(value),
            _ if friction_shape == shape => MapFriction::Nodes(values),
            _ => {
                return Err(format!(
                    "`friction` has shape {friction_shape:?}: it must be one number or have the shape of `height_m`, {shape:?}"
                ));
            }
        }
    } else {
        MapFriction::Uniform(friction)
    };
    checked(HeightNodes {
        x0_m,
        y0_m,
        spacing_m,
        size,
        height_m,
        friction,
    })
}

/// A line of a table.
#[derive(Debug, Clone, Copy)]
struct Line {
    number: u64,
    x_m: f64,
    y_m: f64,
    height_m: f64,
    friction: Option<f64>,
}

/// A map from a table with one line per node.
pub(super) fn from_csv(bytes: &[u8], friction: f64) -> Result<HeightNodes, String> {
    let lines = read_lines(bytes)?;
    let (x0_m, x1_m, step_x) = axis(&lines, "x_m", |line| line.x_m)?;
    let (y0_m, y1_m, step_y) = axis(&lines, "y_m", |line| line.y_m)?;
    if (step_x - step_y).abs() > PLACE_TOLERANCE * step_x {
        return Err(format!(
            "nodes are {step_x} m apart along x and {step_y} m along y: the spacing must be the same"
        ));
    }
    let spacing_m = step_x;
    // A grid that has more places than lines has gaps, and is found so below.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let size = [x1_m - x0_m, y1_m - y0_m].map(|extent| (extent / spacing_m).round() as usize + 1);
    let count = size[0].saturating_mul(size[1]);
    if count != lines.len() {
        return Err(format!(
            "{} lines do not fill a grid of {} by {} nodes {spacing_m} m apart: each node must have one line",
            lines.len(),
            size[0],
            size[1]
        ));
    }
    let mut height_m = vec![f64::NAN; count];
    let mut frictions = vec![friction; count];
    for line in &lines {
        let place = |at: f64, origin: f64| {
            let nodes = (at - origin) / spacing_m;
            let whole = nodes.round();
            // At most the size found above.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            ((nodes - whole).abs() <= PLACE_TOLERANCE).then_some(whole as usize)
        };
        let (Some(column), Some(row)) = (place(line.x_m, x0_m), place(line.y_m, y0_m)) else {
            return Err(format!(
                "line {}: ({}, {}) is no node of the grid from ({x0_m}, {y0_m}) with {spacing_m} m",
                line.number, line.x_m, line.y_m
            ));
        };
        let index = row * size[0] + column;
        if !height_m[index].is_nan() {
            return Err(format!(
                "line {}: the node ({}, {}) is there twice",
                line.number, line.x_m, line.y_m
            ));
        }
        height_m[index] = line.height_m;
        frictions[index] = line.friction.unwrap_or(friction);
    }
    let friction = if lines.iter().any(|line| line.friction.is_some()) {
        MapFriction::Nodes(frictions)
    } else {
        MapFriction::Uniform(friction)
    };
    checked(HeightNodes {
        x0_m,
        y0_m,
        spacing_m,
        size,
        height_m,
        friction,
    })
}

fn read_lines(bytes: &[u8]) -> Result<Vec<Line>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let header = reader.headers().map_err(|e| e.to_string())?.clone();
    let column = |name: &str| header.iter().position(|found| found == name);
    let needed = |name: &str| {
        column(name).ok_or_else(|| {
            let found: Vec<&str> = header.iter().collect();
            format!(
                "column `{name}` is missing; the header is `{}`",
                found.join(",")
            )
        })
    };
    let columns = [needed("x_m")?, needed("y_m")?, needed("height_m")?];
    let friction = column("friction");
    let mut lines = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| e.to_string())?;
        let number = record.position().map_or(0, csv::Position::line);
        let field = |column: usize| {
            let text = record.get(column).unwrap_or_default();
            match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(format!(
                    "line {number}: `{}` = `{text}` is no finite number",
                    &header[column]
                )),
            }
        };
        lines.push(Line {
            number,
            x_m: field(columns[0])?,
            y_m: field(columns[1])?,
            height_m: field(columns[2])?,
            friction: friction.map(field).transpose()?,
        });
        if lines.len() > MOST_NODES {
            return Err(format!("it has more than {MOST_NODES} lines"));
        }
    }
    Ok(lines)
}

/// First and last place along an axis, and the spacing of the places.
fn axis(lines: &[Line], name: &str, of: impl Fn(&Line) -> f64) -> Result<(f64, f64, f64), String> {
    let mut places: Vec<f64> = lines.iter().map(of).collect();
    places.sort_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (places.first(), places.last()) else {
        return Err("it has no line below its header".to_owned());
    };
    // Places that differ by rounding only are one place.
    let same = 1e-9 * (last - first) + 1e-9;
    let steps: Vec<f64> = places
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step > same)
        .collect();
    if steps.is_empty() {
        return Err(format!("all its lines have the same {name}"));
    }
    let spacing = (last - first) / steps.len() as f64;
    if steps
        .iter()
        .any(|step| (step - spacing).abs() > 2.0 * PLACE_TOLERANCE * spacing)
    {
        return Err(format!(
            "the places along {name} are not evenly spaced: from {first} to {last} in {} steps",
            steps.len()
        ));
    }
    Ok((first, last, spacing))
}
