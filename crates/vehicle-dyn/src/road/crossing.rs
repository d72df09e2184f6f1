//! Finding where a road crosses or touches itself.

use std::collections::HashMap;

use super::course::Course;
use super::segment::RoadError;

/// Stretches of the course that are nearer to each other along it than this many road widths are
/// one stretch. A road that turns with a radius of at least its width is never nearer to itself than
/// its width after 1.05 widths, and not before it has gone 3.14 widths (Schur's comparison theorem).
const SAME_STRETCH_WIDTHS: f64 = 1.5;
/// How near the end of a closed course must come to its start, m and rad.
const CLOSED_M: f64 = 0.5;
const CLOSED_RAD: f64 = 0.02;
/// Share of the width that rounding may take.
const ROUNDING: f64 = 1e-9;

/// A place on the course: station, x and y, m.
type Place = (f64, f64, f64);

/// Refuses a course on which two stretches of road overlap: their centre lines come nearer than the
/// road is wide. A closed course, whose end lies on its start and points the same way, is allowed.
pub(super) fn check(course: &Course, places: &[Place]) -> Result<(), RoadError> {
    let width_m = course.width_m();
    let loop_m = loop_length_m(course);
    // Between places 1 m apart two centre lines may come nearer than at the places.
    let search_m = width_m + 1.0;
    // A course is at most 1e5 m long.
    #[allow(clippy::cast_possible_truncation)]
    let cell = |at: f64| (at / search_m).floor() as i32;
    let along = |a: f64, b: f64| {
        let along = (b - a).abs();
        loop_m.map_or(along, |total| along.min(total - along))
    };
    let same_stretch_m = SAME_STRETCH_WIDTHS * width_m;
    let mut cells: HashMap<[i32; 2], Vec<Place>> = HashMap::new();
    for &place in places {
        let (station, x, y) = place;
        let [column, row] = [cell(x), cell(y)];
        for near in (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [column + dx, row + dy])) {
            for &(earlier, other_x, other_y) in cells.get(&near).into_iter().flatten() {
                let apart = (x - other_x).hypot(y - other_y);
                if along(earlier, station) <= same_stretch_m || apart >= search_m {
                    continue;
                }
                let (first_m, second_m, distance_m) = nearest(course, earlier, station);
                // On a narrow road the search may have come back to its own stretch.
                let same = along(first_m, second_m) <= same_stretch_m;
                if !same && distance_m < width_m * (1.0 - ROUNDING) {
                    return Err(RoadError::CrossesItself {
                        first_m,
                        second_m,
                        first_segment: segment_at(course, first_m),
                        second_segment: segment_at(course, second_m),
                        distance_m,
                        width_m,
                    });
                }
            }
        }
        cells.entry([column, row]).or_default().push(place);
    }
    Ok(())
}

/// Length of a closed course, m.
fn loop_length_m(course: &Course) -> Option<f64> {
    let total_m = course.total_length_m();
    let (start, end) = (course.point(0.0), course.point(total_m));
    let apart = (end.x_m - start.x_m).hypot(end.y_m - start.y_m);
    let turned = crate::units::wrap_angle(end.heading_rad - start.heading_rad);
    (apart <= CLOSED_M && turned.abs() <= CLOSED_RAD).then_some(total_m)
}

/// Stations where two stretches are nearest to each other, from stations near by, and their distance
/// there, m.
fn nearest(course: &Course, mut a: f64, mut b: f64) -> (f64, f64, f64) {
    let total_m = course.total_length_m();
    let mut apart = f64::INFINITY;
    // Each round moves both to the other's nearest point; crossings are met in two or three.
    for _ in 0..20 {
        let from = course.point(a);
        b = course.locate(from.x_m, from.y_m, Some(b)).station_m;
        b = b.clamp(0.0, total_m);
        let to = course.point(b);
        a = course.locate(to.x_m, to.y_m, Some(a)).station_m;
        a = a.clamp(0.0, total_m);
        let from = course.point(a);
        let now = (from.x_m - to.x_m).hypot(from.y_m - to.y_m);
        if now >= apart - 1e-9 {
            break;
        }
        apart = now;
    }
    (a, b, apart)
}

/// Number of the segment at a station, from 1.
fn segment_at(course: &Course, station_m: f64) -> usize {
    let mut end_m = 0.0;
    let segments = &course.description().segments;
    segments
        .iter()
        .position(|segment| {
            end_m += segment.length_m();
            station_m < end_m
        })
        .unwrap_or(segments.len().saturating_sub(1))
        + 1
}
