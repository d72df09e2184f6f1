//! Lanes between cones, the path through them, and what a vehicle's outline does to them.

use serde::{Deserialize, Serialize};

use super::ManoeuvreError;
use super::range::{refused, within};
use crate::parameters::VehicleParameters;
use crate::road::{Course, CourseDescription, RoadError, Segment, TurnDirection};
use crate::simulation::Observation;

/// One lane between two rows of cones, along x.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LaneDescription {
    /// Distance of its begin from the begin of the first lane, m.
    pub begin_m: f64,
    /// Length, m.
    pub length_m: f64,
    /// Width per width of the vehicle (no unit).
    pub width_factor: f64,
    /// Width beyond that, m.
    pub width_extra_m: f64,
    /// The lane is at least so wide, m.
    pub least_width_m: f64,
    /// The edge that the track's drawing places.
    pub edge: LaneEdge,
    /// Cones on each side, the first at the begin and the last at the end (no unit).
    pub cones_per_side: u32,
}

/// The edge of a lane that is placed, measured from the same edge of the first lane to the left.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LaneEdge {
    /// The lane's right edge lies so far to the left of the first lane's right edge, m.
    RightFromFirstRightM(f64),
    /// The lane's right edge lies so far to the left of the first lane's left edge, m.
    RightFromFirstLeftM(f64),
    /// The lane's left edge lies so far to the left of the first lane's left edge, m.
    LeftFromFirstLeftM(f64),
}

/// Outline of the vehicle seen from above. The vehicle file knows no body, so these are estimates.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outline {
    /// Overall width beyond the wider track: one tyre's width and the wings, m.
    pub width_beyond_track_m: f64,
    /// Body ahead of the front axle, m.
    pub overhang_front_m: f64,
    /// Body behind the rear axle, m.
    pub overhang_rear_m: f64,
}

impl Outline {
    pub(super) fn check(&self) -> Result<(), ManoeuvreError> {
        for (field, value) in [
            ("outline.width_beyond_track_m", self.width_beyond_track_m),
            ("outline.overhang_front_m", self.overhang_front_m),
            ("outline.overhang_rear_m", self.overhang_rear_m),
        ] {
            within(field, value, [0.0, 5.0], "m")?;
        }
        Ok(())
    }

    /// Overall width of a vehicle, m.
    #[must_use]
    pub fn width_m(&self, vehicle: &VehicleParameters) -> f64 {
        let geometry = &vehicle.geometry;
        geometry.track_front_m.max(geometry.track_rear_m) + self.width_beyond_track_m
    }
}

impl LaneDescription {
    pub(super) fn check(&self, index: usize) -> Result<(), ManoeuvreError> {
        let field = |key: &str| format!("lanes[{index}].{key}");
        within(&field("begin_m"), self.begin_m, [0.0, 1000.0], "m")?;
        within(&field("length_m"), self.length_m, [1.0, 1000.0], "m")?;
        within(&field("width_factor"), self.width_factor, [0.0, 10.0], "")?;
        within(
            &field("width_extra_m"),
            self.width_extra_m,
            [0.0, 10.0],
            "m",
        )?;
        within(
            &field("least_width_m"),
            self.least_width_m,
            [0.0, 20.0],
            "m",
        )?;
        let (LaneEdge::RightFromFirstRightM(edge)
        | LaneEdge::RightFromFirstLeftM(edge)
        | LaneEdge::LeftFromFirstLeftM(edge)) = self.edge;
        within(&field("edge"), edge, [-20.0, 20.0], "m")?;
        if (2..=1000).contains(&self.cones_per_side) {
            return Ok(());
        }
        let found = self.cones_per_side.to_string();
        Err(refused(&field("cones_per_side"), &found, "in [2, 1000]"))
    }

    fn width_m(&self, vehicle_width_m: f64) -> f64 {
        (self.width_factor * vehicle_width_m + self.width_extra_m).max(self.least_width_m)
    }
}

/// A lane in world axes: the middle of the first lane is y = 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lane {
    /// Begin along x, m.
    pub begin_m: f64,
    /// End along x, m.
    pub end_m: f64,
    /// Right edge along y, m.
    pub right_m: f64,
    /// Left edge along y, m.
    pub left_m: f64,
}

impl Lane {
    fn middle_m(&self) -> f64 {
        0.5 * (self.right_m + self.left_m)
    }

    /// Where a path runs that leaves the middle towards `other_m` by `share` of the room that a vehicle
    /// of `vehicle_width_m` has there, m.
    fn aim_m(&self, other_m: f64, share: f64, vehicle_width_m: f64) -> f64 {
        let room = (0.5 * (self.left_m - self.right_m - vehicle_width_m)).max(0.0);
        let way = other_m - self.middle_m();
        self.middle_m() + way.clamp(-share * room, share * room)
    }
}

/// The lanes with their cones.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The lanes in driving order.
    pub lanes: Vec<Lane>,
    /// Middle of the foot of each cone, (x, y), m.
    pub cones: Vec<[f64; 2]>,
    /// Radius of a cone's foot, m. It touches its lane from outside.
    pub cone_radius_m: f64,
    /// Width of the vehicle that the lanes are for, m.
    pub vehicle_width_m: f64,
}

impl Track {
    /// Lays out the lanes for a vehicle's width; the first begins at `begin_m` along x. `sign` −1
    /// exchanges left and right.
    #[must_use]
    pub fn new(
        descriptions: &[LaneDescription],
        vehicle_width_m: f64,
        begin_m: f64,
        cone_radius_m: f64,
        sign: f64,
    ) -> Self {
        let first_half = descriptions
            .first()
            .map_or(0.0, |first| 0.5 * first.width_m(vehicle_width_m));
        let mut track = Self {
            lanes: Vec::new(),
            cones: Vec::new(),
            cone_radius_m,
            vehicle_width_m,
        };
        for description in descriptions {
            let width = description.width_m(vehicle_width_m);
            let right = match description.edge {
                LaneEdge::RightFromFirstRightM(offset) => offset - first_half,
                LaneEdge::RightFromFirstLeftM(offset) => offset + first_half,
                LaneEdge::LeftFromFirstLeftM(offset) => offset + first_half - width,
            };
            let edges = [sign * right, sign * (right + width)];
            let begin = begin_m + description.begin_m;
            let lane = Lane {
                begin_m: begin,
                end_m: begin + description.length_m,
                right_m: edges[0].min(edges[1]),
                left_m: edges[0].max(edges[1]),
            };
            let gaps = f64::from(description.cones_per_side - 1);
            for cone in 0..description.cones_per_side {
                let x = begin + description.length_m * f64::from(cone) / gaps;
                track.cones.push([x, lane.right_m - cone_radius_m]);
                track.cones.push([x, lane.left_m + cone_radius_m]);
            }
            track.lanes.push(lane);
        }
        track
    }

    /// End of the last lane along x, m.
    #[must_use]
    pub fn end_m(&self) -> f64 {
        self.lanes.last().map_or(0.0, |lane| lane.end_m)
    }

    /// A smooth path through the lanes, from the origin along x. It begins to change lanes `lead_m`
    /// before a lane ends and is done `lead_m` after the next has begun. It runs through the middle of
    /// the first lane; in the others it keeps to the side it comes from by `inside_share` of the room
    /// beside the vehicle, so that 0 is the middle and 1 touches the cones.
    ///
    /// # Errors
    /// [`RoadError`] when the lanes leave too little room.
    pub fn path(
        &self,
        lead_m: f64,
        inside_share: f64,
        run_out_m: f64,
    ) -> Result<Course, RoadError> {
        let width_m = 1.0;
        let mut segments = Vec::new();
        let (mut x, mut y) = (0.0, 0.0);
        for pair in self.lanes.windows(2) {
            let begin = (pair[0].end_m - lead_m).max(x);
            segments.push(Segment::Straight {
                straight_m: begin - x,
            });
            x = (pair[1].begin_m + lead_m).max(begin + 4.0);
            let aim = pair[1].aim_m(pair[0].middle_m(), inside_share, self.vehicle_width_m);
            segments.extend(lane_change(x - begin, aim - y, width_m)?);
            y = aim;
        }
        segments.push(Segment::Straight {
            straight_m: (self.end_m() - x).max(0.0) + run_out_m,
        });
        Course::new(&CourseDescription { width_m, segments })
    }
}

/// Two opposite turns of clothoids alone that lead `along_m` ahead and `across_m` to the left.
fn lane_change(along_m: f64, across_m: f64, width_m: f64) -> Result<Vec<Segment>, RoadError> {
    const STEPS: usize = 60;
    if across_m == 0.0 {
        return Ok(vec![Segment::Straight {
            straight_m: along_m,
        }]);
    }
    let turns = |clothoid_m: f64, angle_rad: f64| {
        let turn = |turn: TurnDirection| Segment::Turn {
            turn,
            radius_m: clothoid_m / angle_rad,
            arc_m: 0.0,
            clothoid_m,
        };
        let first = if across_m > 0.0 {
            TurnDirection::Left
        } else {
            TurnDirection::Right
        };
        vec![turn(first), turn(first.mirrored())]
    };
    // For small angles four clothoids lead 4c ahead and 2cθ across; the rest is iteration.
    let (mut clothoid, mut angle) = (0.25 * along_m, 2.0 * across_m.abs() / along_m);
    for _ in 0..STEPS {
        let segments = turns(clothoid, angle);
        let course = Course::new(&CourseDescription { width_m, segments })?;
        let end = course.point(course.total_length_m());
        let stretch = along_m / end.x_m;
        clothoid *= stretch;
        angle *= across_m / end.y_m / stretch;
    }
    Ok(turns(clothoid, angle))
}

/// What a vehicle has done to a track so far.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackMonitor {
    track: Track,
    /// Half the vehicle's width, and its ends ahead of and behind the centre of gravity, m.
    half_width_m: f64,
    ends_m: [f64; 2],
    hit: Vec<bool>,
    excursion_m: f64,
}

impl TrackMonitor {
    /// A monitor of `vehicle` with its outline.
    #[must_use]
    pub fn new(track: &Track, vehicle: &VehicleParameters, outline: &Outline) -> Self {
        let derived = vehicle.derived();
        let front = derived.cg_to_front_axle_m + outline.overhang_front_m;
        let rear = derived.wheelbase_m - derived.cg_to_front_axle_m + outline.overhang_rear_m;
        Self {
            track: track.clone(),
            half_width_m: 0.5 * outline.width_m(vehicle),
            ends_m: [front, -rear],
            hit: vec![false; track.cones.len()],
            excursion_m: 0.0,
        }
    }

    /// Takes note of an instant. The outline is taken level, as the body's roll moves it little at
    /// the height of a cone.
    pub fn observe(&mut self, seen: &Observation) {
        let (sin, cos) = seen.yaw_rad.sin_cos();
        for (cone, hit) in self.track.cones.iter().zip(&mut self.hit) {
            let (dx, dy) = (cone[0] - seen.x_m, cone[1] - seen.y_m);
            let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let out_along = (along - self.ends_m[0])
                .max(self.ends_m[1] - along)
                .max(0.0);
            let out_across = (across.abs() - self.half_width_m).max(0.0);
            *hit |= out_along.hypot(out_across) < self.track.cone_radius_m;
        }
        for end in self.ends_m {
            for side in [self.half_width_m, -self.half_width_m] {
                let x = seen.x_m + end * cos - side * sin;
                let y = seen.y_m + end * sin + side * cos;
                for lane in &self.track.lanes {
                    if x >= lane.begin_m && x <= lane.end_m {
                        let beyond = (y - lane.left_m).max(lane.right_m - y);
                        self.excursion_m = self.excursion_m.max(beyond);
                    }
                }
            }
        }
    }

    /// Cones hit so far.
    #[must_use]
    pub fn cones_hit(&self) -> usize {
        self.hit.iter().filter(|hit| **hit).count()
    }

    /// Largest distance of a corner of the outline beyond a lane's edge, m; zero within the lanes.
    #[must_use]
    pub fn excursion_m(&self) -> f64 {
        self.excursion_m
    }
}
