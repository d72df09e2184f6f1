//! Heights that a user has measured, on a regular grid.

use super::Ground;
use super::spline::{coefficients_through, evaluate};

/// Least nodes along each axis.
pub(super) const LEAST_NODES: usize = 4;
/// Most nodes of a map.
pub(super) const MOST_NODES: usize = 50_000_000;

/// Friction of a map: one number, or one per node.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum MapFriction {
    Uniform(f64),
    Nodes(Vec<f64>),
}

/// A map as it was read, checked.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeightNodes {
    pub x0_m: f64,
    pub y0_m: f64,
    pub spacing_m: f64,
    /// Nodes along x and along y.
    pub size: [usize; 2],
    /// Row by row along x, m.
    pub height_m: Vec<f64>,
    pub friction: MapFriction,
}

/// The spline through the nodes of a map. Beyond the map's edge the height of the edge goes on level.
#[derive(Clone, PartialEq)]
pub(super) struct HeightMap {
    x0_m: f64,
    y0_m: f64,
    spacing_m: f64,
    size: [usize; 2],
    stride: usize,
    /// Spline coefficients with one more node around, row by row along x, m.
    heights: Vec<f64>,
    /// Friction; as it is a weighted mean of nodes, it never leaves their range.
    frictions: Option<Vec<f64>>,
    uniform_friction: f64,
}

// A map is many numbers: a message shows how many instead.
impl std::fmt::Debug for HeightMap {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("HeightMap")
            .field("x0_m", &self.x0_m)
            .field("y0_m", &self.y0_m)
            .field("spacing_m", &self.spacing_m)
            .field("size", &self.size)
            .finish_non_exhaustive()
    }
}

impl HeightMap {
    pub fn new(nodes: HeightNodes) -> Self {
        let [nx, ny] = nodes.size;
        let (frictions, uniform_friction) = match nodes.friction {
            MapFriction::Uniform(friction) => (None, friction),
            MapFriction::Nodes(friction) => (Some(framed(&friction, nodes.size, false)), 0.0),
        };
        let mut heights = nodes.height_m;
        let mut work = vec![0.0; nx.max(ny)];
        for row in heights.chunks_exact_mut(nx) {
            coefficients_through(row, &mut work);
        }
        let mut column = vec![0.0; ny];
        for x in 0..nx {
            for (y, value) in column.iter_mut().enumerate() {
                *value = heights[y * nx + x];
            }
            coefficients_through(&mut column, &mut work);
            for (y, value) in column.iter().enumerate() {
                heights[y * nx + x] = *value;
            }
        }
        Self {
            x0_m: nodes.x0_m,
            y0_m: nodes.y0_m,
            spacing_m: nodes.spacing_m,
            size: nodes.size,
            stride: nx + 2,
            heights: framed(&heights, nodes.size, true),
            frictions,
            uniform_friction,
        }
    }

    #[inline]
    pub fn ground_at(&self, x_m: f64, y_m: f64) -> Ground {
        let (column, t, inside_x) = cell((x_m - self.x0_m) / self.spacing_m, self.size[0]);
        let (row, u, inside_y) = cell((y_m - self.y0_m) / self.spacing_m, self.size[1]);
        let start = row * self.stride + column;
        let [height, by_t, by_u] = evaluate(&self.heights[start..], self.stride, t, u);
        let friction = self
            .frictions
            .as_ref()
            .map_or(self.uniform_friction, |frictions| {
                evaluate(&frictions[start..], self.stride, t, u)[0]
            });
        Ground {
            height_m: height,
            gradient_x: if inside_x { by_t / self.spacing_m } else { 0.0 },
            gradient_y: if inside_y { by_u / self.spacing_m } else { 0.0 },
            friction,
        }
    }

    pub fn covers(&self, x_m: f64, y_m: f64) -> bool {
        let inside = |at: f64, origin: f64, count: usize| {
            (0.0..=(count - 1) as f64).contains(&((at - origin) / self.spacing_m))
        };
        inside(x_m, self.x0_m, self.size[0]) && inside(y_m, self.y0_m, self.size[1])
    }
}

/// Cell of a place along an axis, share of it, and whether the place lies on the map.
#[inline]
fn cell(nodes: f64, count: usize) -> (usize, f64, bool) {
    let last = (count - 1) as f64;
    let held = nodes.clamp(0.0, last);
    let whole = held.floor().min(last - 1.0);
    // In [0, count − 2]; NaN becomes 0 and stays in the share.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let first = whole as usize;
    (first, held - whole, (0.0..=last).contains(&nodes))
}

/// Puts a frame of one node around values: linear continuation for spline coefficients without
/// curvature at the edge, else repetition.
fn framed(values: &[f64], [nx, ny]: [usize; 2], linear: bool) -> Vec<f64> {
    let stride = nx + 2;
    let mut out = vec![0.0; stride * (ny + 2)];
    let beyond = |edge: f64, inner: f64| if linear { 2.0 * edge - inner } else { edge };
    for y in 0..ny {
        let row = &values[y * nx..(y + 1) * nx];
        let target = &mut out[(y + 1) * stride..(y + 2) * stride];
        target[1..=nx].copy_from_slice(row);
        target[0] = beyond(row[0], row[1]);
        target[nx + 1] = beyond(row[nx - 1], row[nx - 2]);
    }
    for x in 0..stride {
        out[x] = beyond(out[stride + x], out[2 * stride + x]);
        out[(ny + 1) * stride + x] = beyond(out[ny * stride + x], out[(ny - 1) * stride + x]);
    }
    out
}
