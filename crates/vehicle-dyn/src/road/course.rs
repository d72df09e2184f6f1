//! The road built from its description.

use super::crossing;
use super::segment::{CourseDescription, RoadError, Segment};

/// Spacing of the stored points, m. With five-point Gauss quadrature in between, the position is
/// exact to rounding for any radius a road may have.
const KNOT_SPACING_M: f64 = 1.0;
/// Newton steps allowed to find the nearest point; two or three are usual.
const LOCATE_STEPS: usize = 30;
/// Station accuracy of [`Course::locate`], m.
const LOCATE_TOLERANCE_M: f64 = 1e-10;

/// Gauss–Legendre nodes on [0, 1] and weights, five points.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// A point of the course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoadPoint {
    /// Distance along the course, m.
    pub station_m: f64,
    /// World x, m.
    pub x_m: f64,
    /// World y, m.
    pub y_m: f64,
    /// Heading, continuous, rad.
    pub heading_rad: f64,
    /// Curvature, positive to the left, 1/m.
    pub curvature_per_m: f64,
}

/// Where a position lies relative to the course.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Station of the nearest point, m.
    pub station_m: f64,
    /// Distance from the course, positive to its left, m.
    pub lateral_offset_m: f64,
    /// Heading of the course there, continuous, rad.
    pub heading_rad: f64,
    /// Curvature of the course there, 1/m.
    pub curvature_per_m: f64,
}

/// A road of continuous curvature. Before its start and after its end it goes on straight.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    description: CourseDescription,
    knots: Vec<Knot>,
    total_m: f64,
}

/// A stored point and how the curvature goes on from it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Knot {
    point: RoadPoint,
    curvature_rate_per_m2: f64,
}

impl Knot {
    fn after(&self, distance: f64) -> RoadPoint {
        let start = &self.point;
        let heading = |u: f64| {
            start.heading_rad + u * (start.curvature_per_m + 0.5 * u * self.curvature_rate_per_m2)
        };
        let (mut x, mut y) = (0.0, 0.0);
        if start.curvature_per_m == 0.0 && self.curvature_rate_per_m2 == 0.0 {
            (x, y) = (start.heading_rad.cos(), start.heading_rad.sin());
        } else {
            for (node, weight) in GAUSS {
                let (sin, cos) = heading(node * distance).sin_cos();
                x += weight * cos;
                y += weight * sin;
            }
        }
        RoadPoint {
            station_m: start.station_m + distance,
            x_m: start.x_m + distance * x,
            y_m: start.y_m + distance * y,
            heading_rad: heading(distance),
            curvature_per_m: start.curvature_per_m + distance * self.curvature_rate_per_m2,
        }
    }
}

impl Course {
    /// Builds the course from the origin along +x.
    ///
    /// # Errors
    /// [`RoadError`] when a number of the description is out of range, or the road crosses itself or
    /// touches itself within its width. A closed course may end where it starts.
    pub fn new(description: &CourseDescription) -> Result<Self, RoadError> {
        description.check()?;
        let mut builder = Builder {
            knots: Vec::new(),
            end: RoadPoint {
                station_m: 0.0,
                x_m: 0.0,
                y_m: 0.0,
                heading_rad: 0.0,
                curvature_per_m: 0.0,
            },
        };
        for segment in &description.segments {
            match *segment {
                Segment::Straight { straight_m } => builder.piece(straight_m, 0.0, 0.0),
                Segment::Turn {
                    turn,
                    radius_m,
                    arc_m,
                    clothoid_m,
                } => {
                    let curvature = turn.sign() / radius_m;
                    builder.piece(clothoid_m, 0.0, curvature);
                    builder.piece(arc_m, curvature, curvature);
                    builder.piece(clothoid_m, curvature, 0.0);
                }
            }
        }
        let total_m = builder.end.station_m;
        let end = RoadPoint {
            curvature_per_m: 0.0,
            ..builder.end
        };
        builder.knots.push(Knot {
            point: end,
            curvature_rate_per_m2: 0.0,
        });
        let course = Self {
            description: description.clone(),
            knots: builder.knots,
            total_m,
        };
        course.check_crossings()?;
        Ok(course)
    }

    fn check_crossings(&self) -> Result<(), RoadError> {
        let places: Vec<(f64, f64, f64)> = self
            .knots
            .iter()
            .map(|knot| (knot.point.station_m, knot.point.x_m, knot.point.y_m))
            .collect();
        crossing::check(self, &places)
    }

    /// The description the course was built from.
    #[must_use]
    pub fn description(&self) -> &CourseDescription {
        &self.description
    }

    /// Length, m.
    #[must_use]
    pub fn total_length_m(&self) -> f64 {
        self.total_m
    }

    /// Width of the road, m.
    #[must_use]
    pub fn width_m(&self) -> f64 {
        self.description.width_m
    }

    /// The course with left and right exchanged.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let knots = self
            .knots
            .iter()
            .map(|knot| Knot {
                point: RoadPoint {
                    y_m: -knot.point.y_m,
                    heading_rad: -knot.point.heading_rad,
                    curvature_per_m: -knot.point.curvature_per_m,
                    ..knot.point
                },
                curvature_rate_per_m2: -knot.curvature_rate_per_m2,
            })
            .collect();
        Self {
            description: self.description.mirrored(),
            knots,
            total_m: self.total_m,
        }
    }

    /// The point at `station_m`; beyond the ends on their tangents.
    #[must_use]
    pub fn point(&self, station_m: f64) -> RoadPoint {
        if station_m <= 0.0 {
            let start = Knot {
                curvature_rate_per_m2: 0.0,
                ..self.knots[0]
            };
            return start.after(station_m);
        }
        let after = self
            .knots
            .partition_point(|knot| knot.point.station_m <= station_m);
        let knot = &self.knots[after - 1];
        knot.after(station_m - knot.point.station_m)
    }

    /// The point of the course nearest to (`x_m`, `y_m`).
    ///
    /// `hint_m` is a station nearby, such as the last one found: the search goes downhill from it,
    /// so a course that comes near itself causes no jump. Without a hint the whole course is
    /// searched.
    #[must_use]
    pub fn locate(&self, x_m: f64, y_m: f64, hint_m: Option<f64>) -> Location {
        let squared = |index: usize| {
            let point = &self.knots[index].point;
            (point.x_m - x_m).powi(2) + (point.y_m - y_m).powi(2)
        };
        let last = self.knots.len() - 1;
        let nearest = match hint_m {
            Some(hint) => {
                let after = self
                    .knots
                    .partition_point(|knot| knot.point.station_m <= hint);
                let mut index = after.saturating_sub(1);
                while index < last && squared(index + 1) < squared(index) {
                    index += 1;
                }
                while index > 0 && squared(index - 1) < squared(index) {
                    index -= 1;
                }
                index
            }
            None => (0..=last)
                .min_by(|&a, &b| squared(a).total_cmp(&squared(b)))
                .unwrap_or_default(),
        };
        self.refine(x_m, y_m, self.knots[nearest].point.station_m)
    }

    /// Newton's method on `(p − c(s)) · c'(s) = 0` from a station close to the solution.
    fn refine(&self, x_m: f64, y_m: f64, station_m: f64) -> Location {
        // Beyond the centre of curvature there is no nearest point to find; keep the step finite.
        const LEAST_SLOPE: f64 = 0.1;
        let mut station = station_m;
        let mut location = Location {
            station_m: station,
            lateral_offset_m: 0.0,
            heading_rad: 0.0,
            curvature_per_m: 0.0,
        };
        for _ in 0..LOCATE_STEPS {
            let point = self.point(station);
            let (sin, cos) = point.heading_rad.sin_cos();
            let (dx, dy) = (x_m - point.x_m, y_m - point.y_m);
            let along = dx * cos + dy * sin;
            let across = dy * cos - dx * sin;
            location = Location {
                station_m: station,
                lateral_offset_m: across,
                heading_rad: point.heading_rad,
                curvature_per_m: point.curvature_per_m,
            };
            let step = along / (1.0 - point.curvature_per_m * across).max(LEAST_SLOPE);
            if step.abs() < LOCATE_TOLERANCE_M {
                break;
            }
            station += step;
        }
        location
    }
}

struct Builder {
    knots: Vec<Knot>,
    end: RoadPoint,
}

impl Builder {
    /// Appends a piece of linear curvature.
    fn piece(&mut self, length_m: f64, curvature_from: f64, curvature_to: f64) {
        if length_m <= 0.0 {
            return;
        }
        let rate = (curvature_to - curvature_from) / length_m;
        // A length of at most 1e5 m over 1 m fits.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let count = (length_m / KNOT_SPACING_M).ceil() as usize;
        let start = RoadPoint {
            curvature_per_m: curvature_from,
            ..self.end
        };
        let mut knot = Knot {
            point: start,
            curvature_rate_per_m2: rate,
        };
        for index in 0..count {
            self.knots.push(knot);
            // Stations and curvatures from the piece's start, so that rounding does not add up.
            let travelled = length_m * (index + 1) as f64 / count as f64;
            let next = knot.after(start.station_m + travelled - knot.point.station_m);
            knot.point = RoadPoint {
                station_m: start.station_m + travelled,
                curvature_per_m: curvature_from + rate * travelled,
                heading_rad: start.heading_rad
                    + travelled * (curvature_from + 0.5 * rate * travelled),
                ..next
            };
        }
        self.end = knot.point;
    }
}
