//! Making the grid of a ground along a course.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;

use nalgebra::DMatrix;

use super::description::GroundDescription;
use super::error::TerrainError;
use super::frame::{CourseFrame, PlacedBump, SampleRange};
use super::grid::{
    GRID_SPACING_M, Grid, Lookup, STRIDE, TILE, TILE_COEFFICIENTS, TILE_M, TileIndex,
};
use super::spline::{gain_of_wave, smooth_step};
use super::waves::{self, Wave};
use crate::road::Course;

/// Largest memory of a terrain, MiB.
pub const LARGEST_TERRAIN_MIB: u64 = 2048;
/// Nodes at either end of a fading tile that belong to its level end or to its whole end.
const FLAT_NODES: f64 = 2.0;

/// The tiles near the course, whole ones with the samples of the course within reach.
type Tiles = BTreeMap<[i32; 2], Vec<SampleRange>>;

/// Makes a ground for a course. `follow` is told how many of how many tiles are made and may stop.
pub(super) fn build(
    ground: &GroundDescription,
    course: &Course,
    follow: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Grid, TerrainError> {
    ground.check_on(course)?;
    let frame = CourseFrame::new(ground, course);
    let whole = tiles_within_reach(&frame);
    let tiles = with_border(&whole);
    check_memory(&tiles, frame.has_friction(), course)?;
    let waves = WaveTiles::new(ground);
    let coefficients = tiles.len() * TILE_COEFFICIENTS;
    let mut heights = vec![0.0_f32; coefficients];
    let mut frictions = vec![
        0.0_f32;
        if frame.has_friction() {
            coefficients
        } else {
            0
        }
    ];
    let fade = Fade {
        whole: &whole,
        start_m: ground.fade_in_m,
    };
    let mut summed = DMatrix::zeros(STRIDE, STRIDE);
    for (number, tile) in tiles.iter().enumerate() {
        if follow(number, tiles.len()).is_break() {
            return Err(TerrainError::Interrupted {
                done: number,
                total: tiles.len(),
            });
        }
        let range = number * TILE_COEFFICIENTS..(number + 1) * TILE_COEFFICIENTS;
        if let Some(waves) = &waves {
            waves.sum(*tile, &mut summed);
            fade.scale(*tile, &mut summed);
            store(&mut heights[range.clone()], summed.as_slice());
        }
        if let Some(ranges) = whole.get(&key(*tile)).filter(|_| frame.has_bank()) {
            for_each_node(*tile, |place, x, y| {
                let height = frame.along(x, y, ranges).height_m;
                let coefficient = &mut heights[range.start + place];
                add(coefficient, height);
            });
        }
        if let Some(ranges) = whole.get(&key(*tile)).filter(|_| frame.has_friction()) {
            for_each_node(*tile, |place, x, y| {
                let friction = frame.along(x, y, ranges).friction;
                add(&mut frictions[range.start + place], friction);
            });
        }
    }
    let lookup = Lookup::new(&tiles);
    for field in [&mut heights, &mut frictions] {
        if !field.is_empty() {
            share_borders(field, &tiles, &lookup);
        }
    }
    let mut grid = Grid {
        ground: ground.clone(),
        course: course.description().clone(),
        whole: tiles.iter().map(|t| whole.contains_key(&key(*t))).collect(),
        tiles,
        heights,
        frictions,
        lookup,
        bumps: Vec::new(),
        bump_starts: Vec::new(),
    };
    grid.place_bumps(&placed_bumps(ground, course));
    Ok(grid)
}

/// The bumps of a description at their places.
pub(super) fn placed_bumps(ground: &GroundDescription, course: &Course) -> Vec<PlacedBump> {
    let place = |bump| PlacedBump::new(bump, course);
    ground.bumps.iter().map(place).collect()
}

/// Tiles sort by y, then by x.
fn key([x, y]: TileIndex) -> [i32; 2] {
    [y, x]
}

fn tiles_within_reach(frame: &CourseFrame<'_>) -> Tiles {
    // Half a sample's spacing further, and the coefficients around a tile belong to it as well.
    let reach = frame.reach_m() + 0.5 + 2.0 * GRID_SPACING_M;
    let mut tiles = Tiles::new();
    for (number, (x, y)) in frame.positions_m().enumerate() {
        let (low_x, high_x) = (tile_of(x - reach), tile_of(x + reach));
        let (low_y, high_y) = (tile_of(y - reach), tile_of(y + reach));
        for tile_y in low_y..=high_y {
            for tile_x in low_x..=high_x {
                let [left, bottom] = [tile_x, tile_y].map(|i| f64::from(i) * TILE_M);
                let beside_x = x - x.clamp(left, left + TILE_M);
                let beside_y = y - y.clamp(bottom, bottom + TILE_M);
                if beside_x * beside_x + beside_y * beside_y > reach * reach {
                    continue;
                }
                // At most 1e5 samples.
                #[allow(clippy::cast_possible_truncation)]
                let number = number as u32;
                let ranges = tiles.entry([tile_y, tile_x]).or_default();
                match ranges.last_mut() {
                    Some((_, last)) if *last + 1 == number => *last = number,
                    _ => ranges.push((number, number)),
                }
            }
        }
    }
    tiles
}

/// A course is at most 1e5 m long.
#[allow(clippy::cast_possible_truncation)]
fn tile_of(position_m: f64) -> i32 {
    (position_m / TILE_M).floor() as i32
}

/// The tiles and all their neighbours, sorted.
fn with_border(whole: &Tiles) -> Vec<TileIndex> {
    let mut all = BTreeSet::new();
    for &[y, x] in whole.keys() {
        for dy in -1..=1 {
            all.extend((-1..=1).map(|dx| [y + dy, x + dx]));
        }
    }
    all.into_iter().map(|[y, x]| [x, y]).collect()
}

fn check_memory(tiles: &[TileIndex], friction: bool, course: &Course) -> Result<(), TerrainError> {
    const COEFFICIENT_BYTES: u64 = 4;
    const MIB: u64 = 1 << 20;
    let fields = if friction { 2 } else { 1 };
    let tile_bytes = fields * COEFFICIENT_BYTES * TILE_COEFFICIENTS as u64;
    let lookup_bytes = Lookup::entries(tiles.iter().copied()) * COEFFICIENT_BYTES;
    let needed_mib = (tiles.len() as u64 * tile_bytes + lookup_bytes).div_ceil(MIB);
    if needed_mib > LARGEST_TERRAIN_MIB {
        return Err(TerrainError::TooLarge {
            length_m: course.total_length_m(),
            needed_mib,
            allowed_mib: LARGEST_TERRAIN_MIB,
        });
    }
    Ok(())
}

/// Calls with the place in the tile and the position of each of its coefficients.
fn for_each_node(tile: TileIndex, mut call: impl FnMut(usize, f64, f64)) {
    let [x0, y0] = tile.map(first_node);
    for row in 0..STRIDE {
        for column in 0..STRIDE {
            let x = (x0 + column as f64) * GRID_SPACING_M;
            let y = (y0 + row as f64) * GRID_SPACING_M;
            call(row * STRIDE + column, x, y);
        }
    }
}

/// Number of a tile's first coefficient along an axis.
fn first_node(tile: i32) -> f64 {
    f64::from(tile) * TILE as f64 - 1.0
}

#[allow(clippy::cast_possible_truncation)]
fn store(coefficients: &mut [f32], values: &[f64]) {
    for (coefficient, value) in coefficients.iter_mut().zip(values) {
        *coefficient = *value as f32;
    }
}

#[allow(clippy::cast_possible_truncation)]
fn add(coefficient: &mut f32, value: f64) {
    *coefficient = (f64::from(*coefficient) + value) as f32;
}

/// Copies what tiles store of their neighbours from them, so that a border has one height only, to
/// the last bit.
fn share_borders(field: &mut [f32], tiles: &[TileIndex], lookup: &Lookup) {
    let owner = |cell: usize| match cell {
        0 => (-1, TILE),
        c if c <= TILE => (0, c),
        c => (1, c - TILE),
    };
    for (number, tile) in tiles.iter().enumerate() {
        for row in 0..STRIDE {
            for column in 0..STRIDE {
                let ((dx, from_column), (dy, from_row)) = (owner(column), owner(row));
                if (dx, dy) == (0, 0) {
                    continue;
                }
                let neighbour = [i64::from(tile[0]) + dx, i64::from(tile[1]) + dy];
                let value = lookup.find(neighbour).map_or(0.0, |other| {
                    field[other * TILE_COEFFICIENTS + from_row * STRIDE + from_column]
                });
                field[number * TILE_COEFFICIENTS + row * STRIDE + column] = value;
            }
        }
    }
}

/// Where the random surface is less than whole: near the start, and towards the border.
struct Fade<'a> {
    whole: &'a Tiles,
    start_m: Option<f64>,
}

impl Fade<'_> {
    fn scale(&self, tile: TileIndex, values: &mut DMatrix<f64>) {
        if let Some(start_m) = self.start_m {
            let values = values.as_mut_slice();
            for_each_node(tile, |place, x, y| {
                values[place] *= smooth_step(x.hypot(y) / start_m);
            });
        }
        let corners = self.corners(tile);
        if corners.iter().flatten().all(|corner| *corner > 0.5) {
            return;
        }
        let flat = FLAT_NODES / TILE as f64;
        let share = |cell: usize| {
            let t = (cell as f64 - 1.0) / TILE as f64;
            smooth_step((t - flat) / (1.0 - 2.0 * flat))
        };
        for row in 0..STRIDE {
            let up = share(row);
            let edge = [0, 1].map(|i| corners[0][i] + (corners[1][i] - corners[0][i]) * up);
            for column in 0..STRIDE {
                // Rows of the matrix run along x.
                values[(column, row)] *= edge[0] + (edge[1] - edge[0]) * share(column);
            }
        }
    }

    /// 1 for a corner that touches a whole tile, else 0; by y, then by x.
    fn corners(&self, [x, y]: TileIndex) -> [[f64; 2]; 2] {
        let touches = |dx: i32, dy: i32| {
            let near = |i, j| self.whole.contains_key(&[y + dy + j, x + dx + i]);
            let touches = near(-1, -1) || near(0, -1) || near(-1, 0) || near(0, 0);
            f64::from(u8::from(touches))
        };
        [
            [touches(0, 0), touches(1, 0)],
            [touches(0, 1), touches(1, 1)],
        ]
    }
}

/// Sums waves over a tile as one matrix product: on a grid `cos(a(x) + b(y))` is
/// `cos a cos b − sin a sin b`, and but for the phase of its corner every tile is the same.
struct WaveTiles {
    waves: Vec<Wave>,
    /// Cosine and sine along x from a tile's first coefficient, wave by wave.
    along: Vec<[f64; 2]>,
    /// The same along y, two rows per wave.
    across: DMatrix<f64>,
}

impl WaveTiles {
    fn new(ground: &GroundDescription) -> Option<Self> {
        let mut waves = Vec::new();
        if let Some(roughness) = &ground.roughness {
            waves.extend(waves::roughness(roughness));
        }
        if let Some(undulation) = &ground.undulation {
            waves.extend(waves::undulation(undulation));
        }
        if waves.is_empty() {
            return None;
        }
        let mut along = Vec::with_capacity(waves.len() * STRIDE);
        let mut across = DMatrix::zeros(2 * waves.len(), STRIDE);
        for (w, wave) in waves.iter_mut().enumerate() {
            let [kx, ky] = wave.rad_per_m.map(|k| k * GRID_SPACING_M);
            wave.amplitude_m /= gain_of_wave(kx) * gain_of_wave(ky);
            for node in 0..STRIDE {
                let (sin, cos) = (kx * node as f64).sin_cos();
                along.push([cos, sin]);
                let (sin, cos) = (ky * node as f64).sin_cos();
                across[(2 * w, node)] = cos;
                across[(2 * w + 1, node)] = sin;
            }
        }
        Some(Self {
            waves,
            along,
            across,
        })
    }

    /// Coefficients of a tile, rows of the matrix along x.
    fn sum(&self, tile: TileIndex, out: &mut DMatrix<f64>) {
        let [x0, y0] = tile.map(|index| first_node(index) * GRID_SPACING_M);
        let mut left = DMatrix::zeros(STRIDE, 2 * self.waves.len());
        for (w, wave) in self.waves.iter().enumerate() {
            let [kx, ky] = wave.rad_per_m;
            let (sin, cos) = (wave.phase_rad + kx * x0 + ky * y0).sin_cos();
            let (sin, cos) = (wave.amplitude_m * sin, wave.amplitude_m * cos);
            let nodes = &self.along[w * STRIDE..(w + 1) * STRIDE];
            for (node, [node_cos, node_sin]) in nodes.iter().enumerate() {
                left[(node, 2 * w)] = cos * node_cos - sin * node_sin;
                left[(node, 2 * w + 1)] = -(sin * node_cos + cos * node_sin);
            }
        }
        out.gemm(1.0, &left, &self.across, 0.0);
    }
}
