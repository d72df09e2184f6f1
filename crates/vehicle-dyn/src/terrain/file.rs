//! Terrain files: `NumPy` archives (`.npz`) that hold the grid, its description and its course.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Seek, Write};
use std::path::Path;

use npyz::WriterBuilder;
use serde::{Deserialize, Serialize};
use zip::write::SimpleFileOptions;

use super::description::GroundDescription;
use super::error::TerrainFileError;
use super::grid::{GRID_SPACING_M, Grid, Lookup, STRIDE, TILE, TILE_COEFFICIENTS, TILE_M};
use super::height_map::HeightMap;
use super::{Ground, Shape, Surface, Terrain, build, map_file};
use crate::road::{Course, CourseDescription};

/// Version of the terrain files written and read here.
pub const TERRAIN_FILE_VERSION: u64 = 1;
/// What a terrain file calls itself.
const FORMAT: &str = "vehicle-dyn terrain";
/// Largest array that is read, bytes: larger ones are no terrain that could have been made.
const LARGEST_ARRAY_BYTES: u64 = (super::LARGEST_TERRAIN_MIB << 20) * 2;

/// What is in a file beside the arrays.
#[derive(Debug, Serialize, Deserialize)]
struct Header {
    format: String,
    version: u64,
    spacing_m: f64,
    tile_nodes: usize,
    mirrored: bool,
    /// A plane has neither description nor course.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    plane: Option<[f64; 4]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ground: Option<GroundDescription>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    course: Option<CourseDescription>,
}

/// What can be asked of a header of any version.
#[derive(Deserialize)]
struct AnyHeader {
    format: String,
    version: u64,
}

impl Terrain {
    /// Writes the terrain as an `.npz` archive of `NumPy` arrays:
    ///
    /// | array | shape | holds |
    /// |---|---|---|
    /// | `header_json` | (bytes) | format, version, description and course, as JSON in UTF-8 |
    /// | `tile` | (n, 2) | place of each tile along x and y, counted in tiles of 6.4 m |
    /// | `tile_whole` | (n) | 1, or 0 where a tile only leads over to the plane outside |
    /// | `height_m` | (n, 32, 32) | heights at the nodes; rows along x, `[tile, y, x]` |
    /// | `height_coefficient_m` | (n, 35, 35) | cubic B-spline coefficients of the heights without bumps, from one node before the tile |
    /// | `friction_coefficient` | (n, 35, 35) | the same of the friction above that of the description; absent when it is uniform |
    ///
    /// Read back, it gives the same bits. A mirrored terrain holds the arrays of its mirror image and
    /// says `mirrored` in the header.
    ///
    /// # Errors
    /// [`TerrainFileError::Unwritable`], and [`TerrainFileError::Measured`] for a measured height map.
    pub fn write<W: Write + Seek>(&self, target: W) -> Result<W, TerrainFileError> {
        let mut archive = Archive(zip::ZipWriter::new(target));
        let header = |plane, mirrored, grid: Option<&Grid>| Header {
            format: FORMAT.to_owned(),
            version: TERRAIN_FILE_VERSION,
            spacing_m: GRID_SPACING_M,
            tile_nodes: TILE,
            mirrored,
            plane,
            ground: grid.map(|g| g.ground.clone()),
            course: grid.map(|g| g.course.clone()),
        };
        let written = match self {
            Self::Plane(p) => {
                let plane = [p.height_m, p.gradient_x, p.gradient_y, p.friction];
                archive.header(&header(Some(plane), false, None))
            }
            Self::Surface(surface) => match &surface.shape {
                Shape::Grid(grid) => archive
                    .header(&header(None, surface.mirrored, Some(grid)))
                    .and_then(|()| archive.grid(grid)),
                Shape::Map(_) => return Err(TerrainFileError::Measured),
            },
        };
        written
            .and_then(|()| archive.0.finish().map_err(Into::into))
            .map_err(|source| TerrainFileError::Unwritable { source })
    }

    /// Reads a terrain: an archive that [`Terrain::write`] made, or a map of measured heights.
    ///
    /// A map is a regular grid with equal spacing along x and y, at least 4 nodes each way, either
    /// - an `.npz` archive with the numbers `x0_m`, `y0_m`, `spacing_m`, the array `height_m` of shape
    ///   (nodes along y, nodes along x), and, if wanted, `friction`, a number or an array of that shape; or
    /// - a `.csv` table with a header line and the columns `x_m`, `y_m`, `height_m` and, if wanted,
    ///   `friction`, a line per node in any order.
    ///
    /// The surface is the cubic spline through the nodes. `friction` is that of a map without its own.
    ///
    /// # Errors
    /// [`TerrainFileError`] when the file cannot be read, is damaged, foreign or of another version, or a
    /// map is not a complete regular grid of finite heights.
    pub fn read(path: &Path, friction: f64) -> Result<Self, TerrainFileError> {
        let unreadable = |source| TerrainFileError::Unreadable {
            path: path.to_path_buf(),
            source,
        };
        let bytes = std::fs::read(path).map_err(unreadable)?;
        let is_csv = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("csv"));
        if is_csv {
            let nodes = map_file::from_csv(&bytes, friction)
                .map_err(|reason| height_map_error(path, reason))?;
            return Ok(Self::Surface(Surface::map(HeightMap::new(nodes))));
        }
        let damaged = |reason: String| TerrainFileError::Damaged {
            path: path.to_path_buf(),
            reason,
        };
        let mut arrays = Arrays::open(bytes).map_err(damaged)?;
        if !arrays.has("header_json") {
            if !arrays.has("height_m") {
                return Err(damaged(
                    "it holds neither `header_json` nor `height_m`".to_owned(),
                ));
            }
            let nodes = map_file::from_arrays(&mut arrays, friction)
                .map_err(|reason| height_map_error(path, reason))?;
            return Ok(Self::Surface(Surface::map(HeightMap::new(nodes))));
        }
        let text = arrays.bytes("header_json").map_err(damaged)?;
        let any: AnyHeader =
            serde_json::from_slice(&text).map_err(|e| damaged(format!("header_json: {e}")))?;
        if any.format != FORMAT {
            return Err(damaged(format!("its format is `{}`", any.format)));
        }
        if any.version != TERRAIN_FILE_VERSION {
            return Err(TerrainFileError::Version {
                path: path.to_path_buf(),
                found: any.version,
                known: TERRAIN_FILE_VERSION,
            });
        }
        let header: Header =
            serde_json::from_slice(&text).map_err(|e| damaged(format!("header_json: {e}")))?;
        header.read(path, &mut arrays)
    }
}

fn height_map_error(path: &Path, reason: String) -> TerrainFileError {
    TerrainFileError::HeightMap {
        path: path.to_path_buf(),
        reason,
    }
}

impl Header {
    fn read(self, path: &Path, arrays: &mut Arrays) -> Result<Terrain, TerrainFileError> {
        let damaged = |reason: String| TerrainFileError::Damaged {
            path: path.to_path_buf(),
            reason,
        };
        #[allow(clippy::float_cmp)] // A constant as it was written.
        if self.spacing_m != GRID_SPACING_M || self.tile_nodes != TILE {
            return Err(damaged(format!(
                "its tiles have {} nodes {} m apart, not {TILE} nodes {GRID_SPACING_M} m apart",
                self.tile_nodes, self.spacing_m
            )));
        }
        if let Some(plane) = self.plane {
            if plane.iter().any(|value| !value.is_finite()) {
                return Err(damaged("the plane is not finite".to_owned()));
            }
            let [height_m, gradient_x, gradient_y, friction] = plane;
            return Ok(Terrain::Plane(Ground {
                height_m,
                gradient_x,
                gradient_y,
                friction,
            }));
        }
        let (Some(ground), Some(description)) = (self.ground, self.course) else {
            return Err(damaged(
                "the header lacks the ground or the course".to_owned(),
            ));
        };
        let course = Course::new(&description).map_err(|e| damaged(format!("course: {e}")))?;
        ground
            .check_on(&course)
            .map_err(|source| TerrainFileError::Ground {
                path: path.to_path_buf(),
                source,
            })?;
        let mut grid = arrays.grid(ground, description).map_err(damaged)?;
        grid.place_bumps(&build::placed_bumps(&grid.ground, &course));
        Ok(Terrain::Surface(Surface::grid(grid, self.mirrored)))
    }
}

/// An archive being written.
struct Archive<W: Write + Seek>(zip::ZipWriter<W>);

impl<W: Write + Seek> Archive<W> {
    fn header(&mut self, header: &Header) -> std::io::Result<()> {
        let text = serde_json::to_vec(header)?;
        self.array("header_json", &[text.len() as u64], text)
    }

    fn grid(&mut self, grid: &Grid) -> std::io::Result<()> {
        let n = grid.tiles.len() as u64;
        let edge = STRIDE as u64;
        let places: Vec<i32> = grid.tiles.iter().flatten().copied().collect();
        self.array("tile", &[n, 2], places)?;
        let whole: Vec<u8> = grid.whole.iter().map(|w| u8::from(*w)).collect();
        self.array("tile_whole", &[n], whole)?;
        let inner = TILE as u64;
        self.array("height_m", &[n, inner, inner], node_heights(grid))?;
        let shape = [n, edge, edge];
        self.array("height_coefficient_m", &shape, grid.heights.iter().copied())?;
        if !grid.frictions.is_empty() {
            self.array(
                "friction_coefficient",
                &shape,
                grid.frictions.iter().copied(),
            )?;
        }
        Ok(())
    }

    fn array<T: npyz::AutoSerialize>(
        &mut self,
        name: &str,
        shape: &[u64],
        values: impl IntoIterator<Item = T>,
    ) -> std::io::Result<()> {
        // Random heights do not shrink: compressing them would only take time.
        let options = SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored)
            .large_file(true);
        self.0
            .start_file(npyz::npz::file_name_from_array_name(name), options)?;
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .writer(&mut self.0)
            .begin_nd()?;
        writer.extend(values)?;
        writer.finish()
    }
}

/// Heights at the nodes of every tile, for whoever reads the file.
#[allow(clippy::cast_possible_truncation)] // Stored as all heights are.
fn node_heights(grid: &Grid) -> impl Iterator<Item = f32> + '_ {
    grid.tiles.iter().flat_map(move |tile| {
        let [x0, y0] = tile.map(|index| f64::from(index) * TILE_M);
        (0..TILE * TILE).map(move |node| {
            let x = x0 + (node % TILE) as f64 * GRID_SPACING_M;
            let y = y0 + (node / TILE) as f64 * GRID_SPACING_M;
            grid.ground_at(x, y).height_m as f32
        })
    })
}

/// The arrays of an archive by name.
pub(super) struct Arrays {
    archive: zip::ZipArchive<Cursor<Vec<u8>>>,
    names: BTreeMap<String, String>,
}

impl Arrays {
    fn open(bytes: Vec<u8>) -> Result<Self, String> {
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| e.to_string())?;
        // Reading to the end checks the sum of every array, also of those not asked for.
        for index in 0..archive.len() {
            let entry = archive.by_index(index).map_err(|e| e.to_string())?;
            std::io::copy(&mut entry.take(LARGEST_ARRAY_BYTES), &mut std::io::sink())
                .map_err(|e| e.to_string())?;
        }
        let names = archive
            .file_names()
            .filter_map(|file| {
                let file = file.ok()?;
                let name = npyz::npz::array_name_from_file_name(&file)?;
                Some((name.to_owned(), file.to_string()))
            })
            .collect();
        Ok(Self { archive, names })
    }

    pub fn has(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    /// Shape and values of an array of numbers of one type.
    fn array<T: npyz::Deserialize>(&mut self, name: &str) -> Result<(Vec<u64>, Vec<T>), String> {
        let file = self
            .names
            .get(name)
            .ok_or_else(|| format!("the array `{name}` is missing"))?;
        let wrong = |e: &dyn std::fmt::Display| format!("array `{name}`: {e}");
        let entry = self.archive.by_name(file).map_err(|e| wrong(&e))?;
        // The size in the archive's directory bounds what is read, whatever the array says.
        let size = entry.size();
        if size > LARGEST_ARRAY_BYTES {
            return Err(format!(
                "array `{name}` has {size} bytes, at most {LARGEST_ARRAY_BYTES} are read"
            ));
        }
        let array = npyz::NpyFile::new(entry.take(size)).map_err(|e| wrong(&e))?;
        let shape = array.shape().to_vec();
        let count = shape
            .iter()
            .try_fold(1_u64, |product, n| product.checked_mul(*n));
        if count.is_none_or(|count| count > size) {
            return Err(format!(
                "array `{name}` of shape {shape:?} does not fit into its {size} bytes"
            ));
        }
        if array.order() == npyz::Order::Fortran && shape.len() > 1 {
            return Err(format!(
                "array `{name}` is stored column by column: save it with order=\"C\""
            ));
        }
        let values = array.into_vec().map_err(|e| wrong(&e))?;
        Ok((shape, values))
    }

    fn bytes(&mut self, name: &str) -> Result<Vec<u8>, String> {
        Ok(self.array(name)?.1)
    }

    /// Shape and values of an array of numbers of any usual type.
    pub fn numbers(&mut self, name: &str) -> Result<(Vec<u64>, Vec<f64>), String> {
        if let Ok(found) = self.array::<f64>(name) {
            return Ok(found);
        }
        if let Ok((shape, values)) = self.array::<f32>(name) {
            return Ok((shape, values.into_iter().map(f64::from).collect()));
        }
        if let Ok((shape, values)) = self.array::<i64>(name) {
            return Ok((shape, values.into_iter().map(|v| v as f64).collect()));
        }
        self.array::<i32>(name)
            .map(|(shape, values)| (shape, values.into_iter().map(f64::from).collect()))
    }

    fn coefficients(&mut self, name: &str, tiles: usize) -> Result<Vec<f32>, String> {
        let (_, values) = self.array::<f32>(name)?;
        let expected = tiles * TILE_COEFFICIENTS;
        if values.len() != expected {
            return Err(format!(
                "array `{name}` has {} values, its {tiles} tiles need {expected}",
                values.len()
            ));
        }
        if values.iter().any(|value| !value.is_finite()) {
            return Err(format!("array `{name}` holds values that are not finite"));
        }
        Ok(values)
    }

    fn grid(
        &mut self,
        ground: GroundDescription,
        course: CourseDescription,
    ) -> Result<Grid, String> {
        let (_, places) = self.array::<i32>("tile")?;
        let tiles: Vec<[i32; 2]> = places.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
        let sorted = tiles
            .windows(2)
            .all(|w| [w[0][1], w[0][0]] < [w[1][1], w[1][0]]);
        if places.len() != 2 * tiles.len() || tiles.is_empty() || !sorted {
            return Err("array `tile` is not a sorted list of tiles".to_owned());
        }
        let entries = Lookup::entries(tiles.iter().copied());
        if entries > LARGEST_ARRAY_BYTES / 4 {
            return Err(format!("its tiles are spread over {entries} places"));
        }
        let (_, whole) = self.array::<u8>("tile_whole")?;
        if whole.len() != tiles.len() {
            return Err("array `tile_whole` has another length than `tile`".to_owned());
        }
        let heights = self.coefficients("height_coefficient_m", tiles.len())?;
        let frictions = if self.has("friction_coefficient") {
            self.coefficients("friction_coefficient", tiles.len())?
        } else {
            Vec::new()
        };
        Ok(Grid {
            lookup: Lookup::new(&tiles),
            ground,
            course,
            tiles,
            whole: whole.into_iter().map(|w| w != 0).collect(),
            heights,
            frictions,
            bumps: Vec::new(),
            bump_starts: Vec::new(),
        })
    }
}
