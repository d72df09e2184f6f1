//! What a wheel meets along a course.

use serde::Serialize;
use vehicle_dyn::road::Course;
use vehicle_dyn::terrain::{GroundDescription, Terrain};

/// Spacing of the stations, m.
const STEP_M: f64 = 0.25;
/// Half the distance of the two wheel tracks that are looked at, m.
pub(super) const HALF_TRACK_M: f64 = 0.7;

/// The ground at a station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Distance along the course, m.
    pub station_m: f64,
    /// Height under a wheel 0.7 m left and one 0.7 m right of the centre line, m.
    pub height_m: [f64; 2],
    /// Cross slope between the two, positive when the left one is higher, %.
    pub cross_slope_percent: f64,
    /// Friction left and right.
    pub friction: [f64; 2],
}

/// The ground along the whole course.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// From the start to the end.
    pub stations: Vec<Station>,
}

impl Survey {
    /// Looks at a terrain along a course.
    #[must_use]
    pub fn new(terrain: &Terrain, course: &Course) -> Self {
        let total_m = course.total_length_m();
        // A course is at most 1e5 m long.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "small"
        )]
        let count = (total_m / STEP_M).ceil() as usize;
        let stations = (0..=count)
            .map(|i| {
                let point = course.point(total_m * i as f64 / count as f64);
                let (sin, cos) = point.heading_rad.sin_cos();
                let [left, right] = [HALF_TRACK_M, -HALF_TRACK_M].map(|offset| {
                    terrain.ground(point.x_m - offset * sin, point.y_m + offset * cos)
                });
                let rise = (left.height_m - right.height_m) / (2.0 * HALF_TRACK_M);
                Station {
                    station_m: point.station_m,
                    height_m: [left.height_m, right.height_m],
                    cross_slope_percent: 100.0 * rise,
                    friction: [left.friction, right.friction],
                }
            })
            .collect();
        Self { stations }
    }

    fn largest(&self, of: impl Fn(&Station) -> f64) -> f64 {
        self.stations
            .iter()
            .map(of)
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Least and largest of a value.
    pub(super) fn range(&self, of: impl Fn(&Station) -> [f64; 2]) -> [f64; 2] {
        let low = -self.largest(|s| -of(s)[0].min(of(s)[1]));
        [low, self.largest(|s| of(s)[0].max(of(s)[1]))]
    }
}

/// What a terrain came to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TerrainSummary {
    /// Name of the scenario.
    pub scenario: String,
    /// Length of the course, m.
    pub length_m: f64,
    /// Least and largest height under the wheel tracks, m.
    pub height_m: [f64; 2],
    /// Root mean square of that height, m.
    pub height_rms_m: f64,
    /// Largest cross slope either way, %.
    pub cross_slope_max_percent: f64,
    /// Least and largest friction under the wheel tracks.
    pub friction: [f64; 2],
    /// The description it was made from.
    pub ground: GroundDescription,
}

impl TerrainSummary {
    /// Sums up a survey.
    #[must_use]
    pub fn new(scenario: &str, ground: &GroundDescription, survey: &Survey) -> Self {
        let squares: f64 = survey
            .stations
            .iter()
            .map(|s| 0.5 * (s.height_m[0].powi(2) + s.height_m[1].powi(2)))
            .sum();
        Self {
            scenario: scenario.to_owned(),
            length_m: survey.largest(|s| s.station_m),
            height_m: survey.range(|s| s.height_m),
            height_rms_m: (squares / survey.stations.len() as f64).sqrt(),
            cross_slope_max_percent: survey.largest(|s| s.cross_slope_percent.abs()),
            friction: survey.range(|s| s.friction),
            ground: ground.clone(),
        }
    }
}

impl std::fmt::Display for TerrainSummary {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [lowest, highest] = self.height_m;
        write!(
            formatter,
            "{:.0} m, heights {lowest:.3} to {highest:.3} m ({:.3} m rms), cross slope up to {:.1} %, friction {:.2} to {:.2}",
            self.length_m,
            self.height_rms_m,
            self.cross_slope_max_percent,
            self.friction[0],
            self.friction[1]
        )
    }
}

/// What a description holds, in a few words.
pub(super) fn words(ground: &GroundDescription) -> String {
    let mut parts = Vec::new();
    if let Some(roughness) = &ground.roughness {
        parts.push(roughness.class.map_or_else(
            || format!("roughness Gd(n0) = {:.1e} m³", roughness.level_m3()),
            |class| format!("ISO 8608 class {class:?}"),
        ));
    }
    if let Some(undulation) = &ground.undulation {
        parts.push(format!("undulation of {} m rms", undulation.height_rms_m));
    }
    let count = |number: usize, one: &str, many: &str| match number {
        0 => None,
        1 => Some(format!("1 {one}")),
        n => Some(format!("{n} {many}")),
    };
    if !ground.bank.is_empty() {
        parts.push("banked".into());
    }
    parts.extend(count(ground.bumps.len(), "bump", "bumps"));
    if ground.split.is_some() {
        parts.push("split friction".into());
    }
    parts.extend(count(ground.patches.len(), "patch", "patches"));
    if parts.is_empty() {
        parts.push("flat".into());
    }
    parts.join(", ")
}
