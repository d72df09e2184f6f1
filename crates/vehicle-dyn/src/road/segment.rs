//! Segments as data.

use serde::{Deserialize, Serialize};

/// A road as data: its width and its segments in driving order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CourseDescription {
    /// Width of the road, m; the course is its middle.
    pub width_m: f64,
    /// Segments from the origin, starting along +x.
    pub segments: Vec<Segment>,
}

/// Which way a turn goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TurnDirection {
    /// Positive curvature.
    Left,
    /// Negative curvature.
    Right,
}

impl TurnDirection {
    /// The other way.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// Sign of the curvature.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// One segment: `{ straight_m = 145.0 }` or
/// `{ turn = "left", radius_m = 144.0, arc_m = 60.0, clothoid_m = 40.0 }`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SegmentKeys", into = "SegmentKeys")]
pub enum Segment {
    /// A straight of this length, m.
    Straight {
        /// Length, m.
        straight_m: f64,
    },
    /// A clothoid in, an arc, and a clothoid out.
    Turn {
        /// Left or right.
        turn: TurnDirection,
        /// Radius of the arc, m.
        radius_m: f64,
        /// Length of the arc, m.
        arc_m: f64,
        /// Length of each of the two clothoids, m.
        clothoid_m: f64,
    },
}

impl Segment {
    /// Length along the course, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        match self {
            Self::Straight { straight_m } => *straight_m,
            Self::Turn {
                arc_m, clothoid_m, ..
            } => arc_m + 2.0 * clothoid_m,
        }
    }

    /// Angle by which the heading changes, positive to the left, rad.
    #[must_use]
    pub fn angle_rad(&self) -> f64 {
        match self {
            Self::Straight { .. } => 0.0,
            Self::Turn {
                turn,
                radius_m,
                arc_m,
                clothoid_m,
            } => turn.sign() * (arc_m + clothoid_m) / radius_m,
        }
    }

    /// The segment with left and right exchanged.
    #[must_use]
    pub fn mirrored(self) -> Self {
        match self {
            Self::Straight { .. } => self,
            Self::Turn {
                turn,
                radius_m,
                arc_m,
                clothoid_m,
            } => Self::Turn {
                turn: turn.mirrored(),
                radius_m,
                arc_m,
                clothoid_m,
            },
        }
    }
}

/// The keys of a segment in a file, before it is known which kind it is.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentKeys {
    #[serde(skip_serializing_if = "Option::is_none")]
    straight_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turn: Option<TurnDirection>,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    arc_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clothoid_m: Option<f64>,
}

impl TryFrom<SegmentKeys> for Segment {
    type Error = RoadError;

    fn try_from(keys: SegmentKeys) -> Result<Self, RoadError> {
        match keys {
            SegmentKeys {
                straight_m: Some(straight_m),
                turn: None,
                radius_m: None,
                arc_m: None,
                clothoid_m: None,
            } => Ok(Self::Straight { straight_m }),
            SegmentKeys {
                straight_m: None,
                turn: Some(turn),
                radius_m: Some(radius_m),
                arc_m: Some(arc_m),
                clothoid_m: Some(clothoid_m),
            } => Ok(Self::Turn {
                turn,
                radius_m,
                arc_m,
                clothoid_m,
            }),
            _ => Err(RoadError::SegmentKind),
        }
    }
}

impl From<Segment> for SegmentKeys {
    fn from(segment: Segment) -> Self {
        match segment {
            Segment::Straight { straight_m } => Self {
                straight_m: Some(straight_m),
                ..Self::default()
            },
            Segment::Turn {
                turn,
                radius_m,
                arc_m,
                clothoid_m,
            } => Self {
                straight_m: None,
                turn: Some(turn),
                radius_m: Some(radius_m),
                arc_m: Some(arc_m),
                clothoid_m: Some(clothoid_m),
            },
        }
    }
}

impl CourseDescription {
    /// The description with left and right exchanged.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            width_m: self.width_m,
            segments: self
                .segments
                .iter()
                .map(|segment| segment.mirrored())
                .collect(),
        }
    }

    /// Stations at which each turn begins and ends, its clothoids included, m, in driving order.
    #[must_use]
    pub fn turns_m(&self) -> Vec<[f64; 2]> {
        let mut station_m = 0.0;
        let mut turns = Vec::new();
        for segment in &self.segments {
            let begin_m = station_m;
            station_m += segment.length_m();
            if matches!(segment, Segment::Turn { .. }) {
                turns.push([begin_m, station_m]);
            }
        }
        turns
    }

    /// Checks every number against its range.
    ///
    /// # Errors
    /// [`RoadError`] naming the segment (from 1), the key, the number and the range.
    pub fn check(&self) -> Result<(), RoadError> {
        const LONGEST_M: f64 = 1e5;
        let within = |segment: usize, key: &'static str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                return Ok(());
            }
            Err(RoadError::OutOfRange {
                segment,
                key,
                value,
                low,
                high,
            })
        };
        if !(self.width_m >= 1.0 && self.width_m <= 100.0) {
            return Err(RoadError::Width {
                width_m: self.width_m,
            });
        }
        if self.segments.is_empty() {
            return Err(RoadError::Empty);
        }
        for (index, segment) in self.segments.iter().enumerate() {
            let number = index + 1;
            match *segment {
                Segment::Straight { straight_m } => {
                    within(number, "straight_m", straight_m, 0.0, LONGEST_M)?;
                }
                Segment::Turn {
                    radius_m,
                    arc_m,
                    clothoid_m,
                    ..
                } => {
                    // Tighter than the road is wide, its inner edge would fold over.
                    within(number, "radius_m", radius_m, self.width_m, LONGEST_M)?;
                    within(number, "arc_m", arc_m, 0.0, LONGEST_M)?;
                    within(number, "clothoid_m", clothoid_m, 1.0, LONGEST_M)?;
                }
            }
        }
        let total: f64 = self.segments.iter().map(Segment::length_m).sum();
        if !(total > 0.0 && total <= LONGEST_M) {
            return Err(RoadError::Length { total_m: total });
        }
        Ok(())
    }
}

/// A road that cannot be built; the message says which segment and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RoadError {
    /// No segments.
    #[error("the course has no segments: give at least one, such as {{ straight_m = 100.0 }}")]
    Empty,
    /// Keys of a straight and a turn mixed, or some missing.
    #[error(
        "a road segment is either {{ straight_m }} or {{ turn, radius_m, arc_m, clothoid_m }} with all four keys"
    )]
    SegmentKind,
    /// Road width out of range.
    #[error("width_m = {width_m}: must be in [1, 100] m")]
    Width {
        /// Value found, m.
        width_m: f64,
    },
    /// A number of a segment out of range.
    #[error("road segment {segment}: {key} = {value}: must be in [{low}, {high}] m")]
    OutOfRange {
        /// Number of the segment, from 1.
        segment: usize,
        /// Key of the segment.
        key: &'static str,
        /// Value found, m.
        value: f64,
        /// Least value allowed, m.
        low: f64,
        /// Largest value allowed, m.
        high: f64,
    },
    /// Two stretches of road overlap.
    #[error(
        "the road crosses or touches itself: at stations {first_m:.1} m (segment {first_segment}) and {second_m:.1} m (segment {second_segment}) its centre lines are {distance_m:.2} m apart, but it is {width_m} m wide; change a turn or a straight between them (a closed course must end within 0.5 m and 0.02 rad of its start)"
    )]
    CrossesItself {
        /// Station on the earlier stretch, m.
        first_m: f64,
        /// Station on the later stretch, m.
        second_m: f64,
        /// Number of the segment at the first station, from 1.
        first_segment: usize,
        /// Number of the segment at the second station, from 1.
        second_segment: usize,
        /// Distance of the centre lines there, m.
        distance_m: f64,
        /// Width of the road, m.
        width_m: f64,
    },
    /// Total length out of range.
    #[error("the course is {total_m} m long: must be in (0, 1e5] m")]
    Length {
        /// Total length, m.
        total_m: f64,
    },
}
