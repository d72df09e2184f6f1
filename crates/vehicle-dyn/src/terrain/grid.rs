//! The precomputed grid: square tiles of spline coefficients along the course.

use super::Ground;
use super::description::GroundDescription;
use super::frame::PlacedBump;
use super::spline::evaluate;
use crate::road::CourseDescription;

/// How far beside the road the ground is made, m. Beyond it the ground fades to the level plane
/// `z = 0` within two tiles.
pub const CORRIDOR_MARGIN_M: f64 = 15.0;
/// Distance of neighbouring nodes, m: 5 to the shortest wave. The error is in the tests.
pub const GRID_SPACING_M: f64 = 0.2;
/// Nodes to the metre.
const NODES_PER_M: f64 = 5.0;
/// Cells along an edge of a tile.
pub(super) const TILE: usize = 32;
/// Coefficients along an edge of a tile: one before its nodes and two after.
pub(super) const STRIDE: usize = TILE + 3;
/// Coefficients of a tile.
pub(super) const TILE_COEFFICIENTS: usize = STRIDE * STRIDE;
/// Edge of a tile, m.
pub(super) const TILE_M: f64 = TILE as f64 / NODES_PER_M;

/// Place of a tile in the world, counted in tiles.
pub(super) type TileIndex = [i32; 2];

/// A ground made for a course.
#[derive(Clone, PartialEq)]
pub(super) struct Grid {
    /// What it was made from; never mirrored.
    pub ground: GroundDescription,
    /// The course it was made for.
    pub course: CourseDescription,
    /// Tiles in order of y, then of x.
    pub tiles: Vec<TileIndex>,
    /// Whether a tile is whole; the others only lead over to the plane outside.
    pub whole: Vec<bool>,
    /// Heights, tile by tile, rows along x; m.
    pub heights: Vec<f32>,
    /// Friction above that of the description, likewise; empty where it is the same everywhere.
    pub frictions: Vec<f32>,
    /// Where to find a tile.
    pub lookup: Lookup,
    /// Bumps, tile by tile.
    pub bumps: Vec<PlacedBump>,
    /// First bump of each tile, and one past the last; empty without bumps.
    pub bump_starts: Vec<u32>,
}

/// Numbers of the tiles within the rectangle around them.
#[derive(Clone, PartialEq)]
pub(super) struct Lookup {
    first: TileIndex,
    size: [usize; 2],
    numbers: Vec<u32>,
}

/// No tile here.
const NONE: u32 = u32::MAX;

impl Lookup {
    /// Entries that the rectangle around some tiles needs.
    pub fn entries(tiles: impl Iterator<Item = TileIndex> + Clone) -> u64 {
        let [width, height] = extent(tiles).1;
        width.saturating_mul(height)
    }

    /// For fewer than `u32::MAX` tiles, whose entries fit into memory.
    #[allow(clippy::cast_possible_truncation)]
    pub fn new(tiles: &[TileIndex]) -> Self {
        let (first, size) = extent(tiles.iter().copied());
        let size = size.map(|n| n as usize);
        let mut lookup = Self {
            first,
            size,
            numbers: vec![NONE; size[0] * size[1]],
        };
        for (number, tile) in tiles.iter().enumerate() {
            if let Some(place) = lookup.place(tile.map(i64::from)) {
                lookup.numbers[place] = number as u32;
            }
        }
        lookup
    }

    #[inline]
    fn place(&self, tile: [i64; 2]) -> Option<usize> {
        let column = usize::try_from(tile[0] - i64::from(self.first[0])).ok()?;
        let row = usize::try_from(tile[1] - i64::from(self.first[1])).ok()?;
        (column < self.size[0] && row < self.size[1]).then(|| row * self.size[0] + column)
    }

    #[inline]
    pub fn find(&self, tile: [i64; 2]) -> Option<usize> {
        let number = self.numbers[self.place(tile)?];
        (number != NONE).then_some(number as usize)
    }
}

/// First tile and size of the rectangle around tiles, in tiles.
fn extent(tiles: impl Iterator<Item = TileIndex>) -> (TileIndex, [u64; 2]) {
    let (mut low, mut high) = ([i32::MAX; 2], [i32::MIN; 2]);
    for tile in tiles {
        for axis in 0..2 {
            low[axis] = low[axis].min(tile[axis]);
            high[axis] = high[axis].max(tile[axis]);
        }
    }
    if low[0] > high[0] {
        return ([0; 2], [0; 2]);
    }
    (
        low,
        [0, 1].map(|axis| u64::from(high[axis].abs_diff(low[axis])) + 1),
    )
}

/// Place of a number of cells along one axis: whole tile, cell in it, and share of that cell.
#[inline]
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_possible_wrap
)]
fn split(cells: f64) -> (i64, usize, f64) {
    const CELLS: i64 = TILE as i64;
    let whole = cells.floor();
    // A position too large for an integer ends at the largest one, where no tile is.
    let node = whole as i64;
    let tile = node.div_euclid(CELLS);
    (tile, node.rem_euclid(CELLS) as usize, cells - whole)
}

// A grid is millions of numbers: a message shows how many instead.
impl std::fmt::Debug for Grid {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Grid")
            .field("ground", &self.ground)
            .field("tiles", &self.tiles.len())
            .finish_non_exhaustive()
    }
}

impl Grid {
    /// The ground at a position of the course as described (not mirrored).
    #[inline]
    pub fn ground_at(&self, x_m: f64, y_m: f64) -> Ground {
        let (tile_x, column, t) = split(x_m * NODES_PER_M);
        let (tile_y, row, u) = split(y_m * NODES_PER_M);
        let Some(tile) = self.lookup.find([tile_x, tile_y]) else {
            return Ground {
                height_m: 0.0,
                gradient_x: 0.0,
                gradient_y: 0.0,
                friction: self.ground.friction,
            };
        };
        let start = tile * TILE_COEFFICIENTS + row * STRIDE + column;
        let [height, by_t, by_u] = evaluate(&self.heights[start..], STRIDE, t, u);
        let mut ground = Ground {
            height_m: height,
            gradient_x: by_t * NODES_PER_M,
            gradient_y: by_u * NODES_PER_M,
            friction: self.ground.friction,
        };
        if !self.frictions.is_empty() {
            ground.friction += evaluate(&self.frictions[start..], STRIDE, t, u)[0];
        }
        if !self.bump_starts.is_empty() {
            let range = self.bump_starts[tile] as usize..self.bump_starts[tile + 1] as usize;
            for bump in &self.bumps[range] {
                let [height, by_x, by_y] = bump.height(x_m, y_m);
                ground.height_m += height;
                ground.gradient_x += by_x;
                ground.gradient_y += by_y;
            }
        }
        ground
    }

    /// Whether a position lies on a whole tile.
    pub fn covers(&self, x_m: f64, y_m: f64) -> bool {
        let tile = [split(x_m * NODES_PER_M).0, split(y_m * NODES_PER_M).0];
        self.lookup.find(tile).is_some_and(|tile| self.whole[tile])
    }

    /// Places the bumps of the description on the tiles.
    pub fn place_bumps(&mut self, placed: &[PlacedBump]) {
        if placed.is_empty() {
            return;
        }
        self.bump_starts = Vec::with_capacity(self.tiles.len() + 1);
        self.bump_starts.push(0);
        for tile in &self.tiles {
            let [low_x, low_y] = tile.map(|index| f64::from(index) * TILE_M);
            for bump in placed {
                let (x, y, radius) = bump.circle_m();
                let beside_x = x - x.clamp(low_x, low_x + TILE_M);
                let beside_y = y - y.clamp(low_y, low_y + TILE_M);
                if beside_x.hypot(beside_y) <= radius {
                    self.bumps.push(*bump);
                }
            }
            // Far below 2^32: a terrain of so many would not fit into memory.
            #[allow(clippy::cast_possible_truncation)]
            self.bump_starts.push(self.bumps.len() as u32);
        }
    }
}
