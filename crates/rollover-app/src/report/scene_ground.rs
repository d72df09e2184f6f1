//! The ground of a scene: coarse heights around the road, and those under the wheels along it.

use vehicle_dyn::road::Course;
use vehicle_dyn::terrain::Terrain;

use super::data::{HeightProfile, TerrainMap};

/// How far beyond the road's edges the map reaches, m.
const BEYOND_ROAD_M: f64 = 15.0;
/// Spacings of the map, m; the first that keeps to [`MOST_HEIGHTS`] is taken, else the last is
/// doubled.
const MAP_SPACINGS_M: [f64; 5] = [2.0, 3.0, 4.0, 5.0, 6.0];
/// Most heights of a map, gaps included: about 80 kB in a file.
const MOST_HEIGHTS: f64 = 16_000.0;
/// Spacings of the profile, m, from the finest.
const PROFILE_SPACINGS_M: [f64; 3] = [0.5, 1.0, 2.0];
/// Most stations of a profile: about 40 kB in a file.
const MOST_STATIONS: f64 = 2_500.0;

/// Millimetres are enough for a picture.
fn rounded(value_m: f64) -> f64 {
    (value_m * 1e3).round() / 1e3
}

/// The first of `spacings_m` by which no more than `most` points are needed, or a multiple of the
/// last.
fn spacing_m(spacings_m: &[f64], most: f64, points: impl Fn(f64) -> f64) -> f64 {
    let fitting = spacings_m.iter().copied().find(|&s| points(s) <= most);
    fitting.unwrap_or_else(|| {
        let mut spacing_m = spacings_m.last().copied().unwrap_or(1.0);
        while points(spacing_m) > most {
            spacing_m *= 2.0;
        }
        spacing_m
    })
}

/// Positions at every `step_m` along the course and across it up to `half_m` either side.
fn across(course: &Course, step_m: f64, half_m: f64) -> impl Iterator<Item = [f64; 2]> + '_ {
    steps(0.0, course.total_length_m(), step_m).flat_map(move |station_m| {
        let at = course.point(station_m);
        let (sin, cos) = at.heading_rad.sin_cos();
        let offsets = steps(-half_m, half_m, step_m);
        offsets.map(move |offset| [at.x_m - offset * sin, at.y_m + offset * cos])
    })
}

/// From `from` to `to` inclusive, in equal steps of at most `step`.
fn steps(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let count = index((to - from) / step).max(1);
    (0..=count).map(move |i| from + (to - from) * i as f64 / count as f64)
}

/// Rounded up; negative is 0.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a course is at most 1e5 m long"
)]
fn index(value: f64) -> usize {
    value.ceil().max(0.0) as usize
}

impl TerrainMap {
    /// The ground around the road of a course, or `None` if it is flat. Beyond 15 m from the road's
    /// edges there are gaps.
    #[must_use]
    pub fn around(terrain: &Terrain, course: &Course) -> Option<Self> {
        let half_m = 0.5 * course.width_m() + BEYOND_ROAD_M;
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for position in across(course, 2.0, half_m) {
            for (axis, value) in position.into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let size = [high[0] - low[0], high[1] - low[1]];
        let points = |s: f64| ((size[0] / s).ceil() + 1.0) * ((size[1] / s).ceil() + 1.0);
        let spacing_m = spacing_m(&MAP_SPACINGS_M, MOST_HEIGHTS, points);
        let [columns, rows] = size.map(|length| index(length / spacing_m) + 1);
        // The nearest grid point is at most this far from one of the positions looked at.
        let nearest = |value: f64| index(value / spacing_m - 0.5);
        let mut heights_m = vec![f64::NAN; columns * rows];
        for [x, y] in across(course, 0.5 * spacing_m, half_m) {
            let column = nearest(x - low[0]).min(columns - 1);
            let row = nearest(y - low[1]).min(rows - 1);
            let height = &mut heights_m[row * columns + column];
            if height.is_nan() {
                let x_m = low[0] + column as f64 * spacing_m;
                let y_m = low[1] + row as f64 * spacing_m;
                *height = rounded(terrain.ground(x_m, y_m).height_m);
            }
        }
        let flat = heights_m.iter().all(|h| h.is_nan() || *h == 0.0);
        (!flat).then_some(Self {
            x_min_m: low[0],
            y_min_m: low[1],
            spacing_m,
            columns,
            rows,
            heights_m,
        })
    }
}

impl HeightProfile {
    /// The ground under wheels `track_m` apart along a course, or `None` if it is flat.
    #[must_use]
    pub fn along(terrain: &Terrain, course: &Course, track_m: f64) -> Option<Self> {
        let total_m = course.total_length_m();
        let spacing_m = spacing_m(&PROFILE_SPACINGS_M, MOST_STATIONS, |s| total_m / s);
        let mut profile = Self::default();
        for station_m in steps(0.0, total_m, spacing_m) {
            let at = course.point(station_m);
            let (sin, cos) = at.heading_rad.sin_cos();
            let height = |offset: f64| {
                let ground = terrain.ground(at.x_m - offset * sin, at.y_m + offset * cos);
                rounded(ground.height_m)
            };
            profile.station_m.push(rounded(station_m));
            profile.left_m.push(height(0.5 * track_m));
            profile.right_m.push(height(-0.5 * track_m));
        }
        let mut heights = profile.left_m.iter().chain(&profile.right_m);
        let flat = heights.all(|h| *h == 0.0);
        (!flat).then_some(profile)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COURSE: &str = "width_m = 7.0
        segments = [
            { straight_m = 150.0 },
            { turn = \"left\", radius_m = 120.0, arc_m = 60.0, clothoid_m = 40.0 },
            { straight_m = 300.0 },
        ]";

    fn course() -> Course {
        Course::new(&toml::from_str(COURSE).expect("it is a course")).expect("it is valid")
    }

    fn ground(text: &str) -> Terrain {
        let ground = toml::from_str(text).expect("it is a ground");
        Terrain::build(&ground, &course()).expect("it fits the course")
    }

    #[test]
    fn level_ground_has_neither_map_nor_profile() {
        for text in [
            "friction = 0.85",
            "friction = 0.85\nsplit = { left = 0.8, right = 0.4, edge_m = 1.0 }",
        ] {
            let terrain = ground(text);
            assert_eq!(TerrainMap::around(&terrain, &course()), None);
            assert_eq!(HeightProfile::along(&terrain, &course(), 1.5), None);
        }
    }

    #[test]
    fn heights_are_those_under_the_road() {
        let terrain = ground(
            "friction = 0.85
             fade_in_m = 50.0
             undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }",
        );
        let map = TerrainMap::around(&terrain, &course()).expect("it is not flat");
        assert_eq!(map.heights_m.len(), map.rows * map.columns);
        let at = |x: f64, y: f64| {
            let column = index((x - map.x_min_m) / map.spacing_m - 0.5);
            let row = index((y - map.y_min_m) / map.spacing_m - 0.5);
            map.heights_m[row * map.columns + column]
        };
        for station in 0..590_u32 {
            let point = course().point(f64::from(station));
            let (found, under) = (
                at(point.x_m, point.y_m),
                terrain.ground(point.x_m, point.y_m).height_m,
            );
            assert!(
                (found - under).abs() < 0.05,
                "{station} m: {found}, {under}"
            );
        }
        let profile = HeightProfile::along(&terrain, &course(), 1.5).expect("it is not flat");
        let point = course().point(profile.station_m[400]);
        let (sin, cos) = point.heading_rad.sin_cos();
        let left = terrain.ground(point.x_m - 0.75 * sin, point.y_m + 0.75 * cos);
        assert!((profile.left_m[400] - left.height_m).abs() <= 0.5e-3 + 1e-6);
        let size = serde_json::to_string(&(map, profile)).expect("JSON").len();
        assert!(size < 150_000, "{size} bytes");
    }
}
