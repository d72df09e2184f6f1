//! The ground under the wheels: height, gradient and friction by position.
//!
//! ```
//! use vehicle_dyn::road::{Course, CourseDescription};
//! use vehicle_dyn::terrain::{GroundDescription, Terrain};
//!
//! let course: CourseDescription = toml::from_str(
//!     "width_m = 7.0
//!      segments = [{ straight_m = 100.0 }]",
//! )?;
//! let ground: GroundDescription = toml::from_str(
//!     "friction = 0.85
//!      fade_in_m = 50.0
//!      roughness = { class = \"c\", contact_length_m = 0.13, seed = 1 }
//!      undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }",
//! )?;
//! let riverbed = Terrain::build(&ground, &Course::new(&course)?)?;
//! let under_the_wheel = riverbed.ground(70.0, 0.7);
//! assert!(under_the_wheel.height_m.abs() < 0.3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How it is made
//! A [`GroundDescription`] is data. [`Terrain::build`] turns it into square tiles of spline coefficients
//! along the course, [`GRID_SPACING_M`] apart: the surface has continuous height, gradient and curvature,
//! and asking for it costs a few dozen multiplications, however many waves it was made of. Bumps alone
//! are evaluated exactly. Roughness acts on the tyre as on a point, averaged over the length of its
//! contact; a wheel does not bridge a hole that is shorter than it.
//!
//! The ground reaches [`CORRIDOR_MARGIN_M`] beyond the road's edges. Within two tiles (12.8 m) from there
//! it fades to the level plane `z = 0` of the description's friction. Bank keeps its slope over the road
//! and a shoulder of 3 m, then leads down (or up) to that plane as well.

mod build;
mod check;
mod description;
mod error;
mod file;
mod frame;
mod grid;
mod height_map;
mod map_file;
mod spline;
#[cfg(test)]
mod tests;
mod waves;

use std::ops::ControlFlow;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::road::Course;
use grid::Grid;
use height_map::HeightMap;

pub use build::LARGEST_TERRAIN_MIB;
pub use description::{
    BankPoint, Bump, FrictionPatch, GroundDescription, RoadClass, Roughness, SplitFriction,
    Undulation,
};
pub use error::{GroundError, TerrainError, TerrainFileError};
pub use file::TERRAIN_FILE_VERSION;
pub use grid::{CORRIDOR_MARGIN_M, GRID_SPACING_M};

/// The ground at one point: a plane in first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Height, m.
    pub height_m: f64,
    /// Slope along world x (no unit).
    pub gradient_x: f64,
    /// Slope along world y (no unit).
    pub gradient_y: f64,
    /// Friction of the road `mu_road` (no unit).
    pub friction: f64,
}

impl Ground {
    /// Unit normal of the ground plane, pointing up, in world axes.
    #[must_use]
    #[inline]
    pub fn normal(&self) -> Vector3<f64> {
        let (gx, gy) = (self.gradient_x, self.gradient_y);
        // Level ground is the rule, and needs no root.
        if gx == 0.0 && gy == 0.0 {
            return Vector3::z();
        }
        let scale = 1.0 / (1.0 + gx * gx + gy * gy).sqrt();
        Vector3::new(-gx * scale, -gy * scale, scale)
    }

    /// The same ground with left and right exchanged.
    fn mirrored(self) -> Self {
        Self {
            gradient_y: -self.gradient_y,
            ..self
        }
    }
}

/// A terrain that wheels can stand on. Cloning it is cheap: a grid is shared.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Terrain {
    /// A plane `z = height + gradient · (x, y)` of uniform friction; level ground has gradient 0.
    Plane(Ground),
    /// A precomputed surface.
    Surface(Surface),
}

/// A precomputed surface: a grid along a course, or a map of measured heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    shape: Shape,
    /// Whether the shape is to be seen with left and right exchanged.
    mirrored: bool,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Grid(Arc<Grid>),
    Map(Arc<HeightMap>),
}

impl Surface {
    fn grid(grid: Grid, mirrored: bool) -> Self {
        Self {
            shape: Shape::Grid(Arc::new(grid)),
            mirrored,
        }
    }

    fn map(map: HeightMap) -> Self {
        Self {
            shape: Shape::Map(Arc::new(map)),
            mirrored: false,
        }
    }

    #[inline]
    fn ground(&self, x_m: f64, y_m: f64) -> Ground {
        // Mirrored by asking for the other side, so that mirrored runs have mirrored bits.
        let y_m = if self.mirrored { -y_m } else { y_m };
        let ground = match &self.shape {
            Shape::Grid(grid) => grid.ground_at(x_m, y_m),
            Shape::Map(map) => map.ground_at(x_m, y_m),
        };
        if self.mirrored {
            ground.mirrored()
        } else {
            ground
        }
    }

    fn covers(&self, x_m: f64, y_m: f64) -> bool {
        let y_m = if self.mirrored { -y_m } else { y_m };
        match &self.shape {
            Shape::Grid(grid) => grid.covers(x_m, y_m),
            Shape::Map(map) => map.covers(x_m, y_m),
        }
    }
}

impl Terrain {
    /// Level ground at height 0 of uniform friction.
    #[must_use]
    pub fn flat(friction: f64) -> Self {
        Self::Plane(Ground {
            height_m: 0.0,
            gradient_x: 0.0,
            gradient_y: 0.0,
            friction,
        })
    }

    /// Makes the ground of a course: a plane when only its friction is given, else a grid. A course of
    /// 1 km takes about a second and 13 MB.
    ///
    /// # Errors
    /// [`TerrainError`] when the description is not allowed, lies beyond the course, or takes more than
    /// [`LARGEST_TERRAIN_MIB`].
    pub fn build(ground: &GroundDescription, course: &Course) -> Result<Self, TerrainError> {
        Self::build_with(ground, course, &mut |_, _| ControlFlow::Continue(()))
    }

    /// As [`Terrain::build`]; `follow` is told how many of how many tiles are made, and may stop the
    /// work.
    ///
    /// # Errors
    /// As [`Terrain::build`], and [`TerrainError::Interrupted`] when `follow` stopped it.
    pub fn build_with(
        ground: &GroundDescription,
        course: &Course,
        follow: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Self, TerrainError> {
        ground.check_on(course)?;
        if ground.is_flat() {
            return Ok(Self::flat(ground.friction));
        }
        let grid = if ground.mirrored {
            build::build(&ground.mirrored(), &course.mirrored(), follow)?
        } else {
            build::build(ground, course, follow)?
        };
        Ok(Self::Surface(Surface::grid(grid, ground.mirrored)))
    }

    /// The ground at world position (`x_m`, `y_m`). It is defined everywhere.
    #[must_use]
    #[inline]
    pub fn ground(&self, x_m: f64, y_m: f64) -> Ground {
        match self {
            Self::Plane(plane) => Ground {
                height_m: plane.height_m + plane.gradient_x * x_m + plane.gradient_y * y_m,
                ..*plane
            },
            Self::Surface(surface) => surface.ground(x_m, y_m),
        }
    }

    /// The terrain with left and right exchanged: `z(x, −y)`, to the last bit.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        match self {
            Self::Plane(plane) => Self::Plane(plane.mirrored()),
            Self::Surface(surface) => Self::Surface(Surface {
                mirrored: !surface.mirrored,
                ..surface.clone()
            }),
        }
    }

    /// Checks that the terrain lies under the whole width of a course's road.
    ///
    /// # Errors
    /// [`TerrainError::SmallerThanCourse`] with the station where it ends and the widths.
    pub fn check_covers(&self, course: &Course) -> Result<(), TerrainError> {
        const ALONG_M: f64 = 1.0;
        const ACROSS_M: f64 = 0.1;
        let Self::Surface(surface) = self else {
            return Ok(());
        };
        let (total_m, half_m) = (course.total_length_m(), 0.5 * course.width_m());
        let mut station_m = 0.0;
        loop {
            let point = course.point(station_m);
            let (sin, cos) = point.heading_rad.sin_cos();
            let covers = |offset_m: f64| {
                surface.covers(point.x_m - offset_m * sin, point.y_m + offset_m * cos)
            };
            for (side, sign) in [("left", 1.0), ("right", -1.0)] {
                if covers(0.0) && covers(sign * half_m) {
                    continue;
                }
                let mut covered_m = 0.0;
                while covered_m < half_m && covers(sign * (covered_m + ACROSS_M)) {
                    covered_m += ACROSS_M;
                }
                return Err(TerrainError::SmallerThanCourse {
                    station_m,
                    total_m,
                    side,
                    covered_m: if covers(0.0) { covered_m } else { 0.0 },
                    needed_m: half_m,
                });
            }
            if station_m >= total_m {
                return Ok(());
            }
            station_m = (station_m + ALONG_M).min(total_m);
        }
    }
}
