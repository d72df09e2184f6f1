//! A road must not cross or touch itself; hairpins and closed loops are roads.

mod common;

use common::{straight, three_turns, turn};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use vehicle_dyn::road::{Course, CourseDescription, RoadError, Segment, TurnDirection};

const WIDTH_M: f64 = 7.0;

fn build(segments: Vec<Segment>) -> Result<Course, RoadError> {
    with_width(WIDTH_M, segments)
}

fn with_width(width_m: f64, segments: Vec<Segment>) -> Result<Course, RoadError> {
    Course::new(&CourseDescription { width_m, segments })
}

/// A turn by `angle` to the left.
fn left(radius_m: f64, angle: f64) -> Segment {
    turn(TurnDirection::Left, radius_m, angle * radius_m - 2.0, 2.0)
}

fn assert_crosses(found: Result<Course, RoadError>, stations: [f64; 2], segments: [usize; 2]) {
    match found {
        Err(RoadError::CrossesItself {
            first_m,
            second_m,
            first_segment,
            second_segment,
            distance_m,
            width_m,
        }) => {
            assert!(distance_m < width_m);
            let near = |found: f64, wanted: f64| (found - wanted).abs() < width_m + 1.0;
            assert!(
                near(first_m, stations[0]) && near(second_m, stations[1]),
                "{first_m} and {second_m} instead of {stations:?}"
            );
            assert_eq!([first_segment, second_segment], segments);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_crossing_is_refused_with_stations_and_segments() {
    // Three quarters of a circle to the left and straight on: it meets the first straight.
    let (first, radius) = (100.0, 40.0);
    let arc = radius * 1.5 * PI;
    let found = build(vec![
        straight(first),
        left(radius, 1.5 * PI),
        straight(200.0),
    ]);
    let message = found.as_ref().expect_err("crosses").to_string();
    for piece in ["segment 1", "segment 3", "7 m wide"] {
        assert!(message.contains(piece), "{message}");
    }
    // From 3/4 of the circle the road goes straight down to the first one.
    assert_crosses(found, [first - radius, first + arc + radius], [1, 3]);
}

#[test]
fn a_road_that_only_touches_itself_is_refused_where_it_does() {
    let offset = |gap: f64| {
        // Out, back at a distance of twice the radius, and no crossing.
        let radius = 0.5 * (WIDTH_M + gap);
        let wide = radius.max(WIDTH_M);
        // A hairpin narrower than twice the width must first swing out by a bulge.
        let bulge = ((wide + radius) / (2.0 * wide)).acos();
        let out = turn(TurnDirection::Right, wide, bulge * wide - 1.0, 1.0);
        let around = turn(
            TurnDirection::Left,
            wide,
            (PI + 2.0 * bulge) * wide - 1.0,
            1.0,
        );
        build(vec![straight(60.0), out, around, out, straight(60.0)])
    };
    assert!(offset(2.0).is_ok(), "{:?}", offset(2.0).err());
    assert!(matches!(offset(-2.0), Err(RoadError::CrossesItself { .. })));
}

#[test]
fn the_tightest_hairpin_is_a_road() {
    for width_m in [1.0, 1.7, 2.5, 3.5, 7.0, 30.0, 100.0] {
        for direction in [TurnDirection::Left, TurnDirection::Right] {
            let hairpin = turn(direction, width_m, PI * width_m - 1.0, 1.0);
            let back = turn(direction.mirrored(), width_m, PI * width_m - 1.0, 1.0);
            let segments = vec![
                straight(200.0),
                hairpin,
                straight(200.0),
                back,
                straight(200.0),
            ];
            let found = with_width(width_m, segments);
            assert!(found.is_ok(), "{width_m} m: {:?}", found.err());
        }
    }
}

#[test]
fn a_closed_loop_is_a_road_and_a_second_lap_is_not() {
    let corner = || left(60.0, FRAC_PI_2);
    let lap = || {
        let mut segments = Vec::new();
        for _ in 0..4 {
            segments.extend([straight(80.0), corner()]);
        }
        segments
    };
    assert!(build(lap()).is_ok(), "{:?}", build(lap()).err());
    let two_laps = [lap(), lap()].concat();
    assert!(matches!(
        build(two_laps),
        Err(RoadError::CrossesItself { .. })
    ));
    // A lap that goes on over its start is not closed.
    let mut longer = lap();
    longer.push(straight(30.0));
    assert!(matches!(
        build(longer),
        Err(RoadError::CrossesItself { .. })
    ));
}

#[test]
fn a_figure_of_eight_is_refused_although_it_is_closed() {
    let radius = 50.0;
    let circle = |direction| turn(direction, radius, TAU * radius - 2.0, 2.0);
    let found = build(vec![
        circle(TurnDirection::Left),
        circle(TurnDirection::Right),
    ]);
    assert!(matches!(found, Err(RoadError::CrossesItself { .. })));
}

#[test]
fn the_shipped_courses_do_not_cross_themselves() {
    for description in [three_turns(), common::five_turns()] {
        assert!(Course::new(&description).is_ok());
    }
}

#[test]
fn a_road_of_100_km_is_checked_as_well() {
    // Serpentines: 45 legs of 2 km, with the last one turned back over all the others.
    let mut segments = Vec::new();
    for leg in 0..45 {
        let direction = if leg % 2 == 0 {
            TurnDirection::Left
        } else {
            TurnDirection::Right
        };
        segments.push(straight(2000.0));
        segments.push(turn(direction, 30.0, 30.0 * PI - 2.0, 2.0));
    }
    let long = build(segments.clone()).expect("serpentines do not meet");
    assert!(long.total_length_m() > 90_000.0);
    segments.push(straight(1000.0));
    segments.push(left(30.0, FRAC_PI_2));
    segments.push(straight(500.0));
    // From the middle of the last leg down over the one before, which is segment 89.
    let before: f64 = segments[..88].iter().map(Segment::length_m).sum();
    let down: f64 = segments[..91].iter().map(Segment::length_m).sum();
    assert_crosses(build(segments), [before + 970.0, down + 77.0], [89, 93]);
}
