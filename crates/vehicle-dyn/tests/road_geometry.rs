//! The road: continuity, closure, and finding a position on it again.

mod common;

use common::{straight, three_turns, turn};
use proptest::prelude::*;
use vehicle_dyn::road::{Course, CourseDescription, RoadError, Segment, TurnDirection};

fn course(description: &CourseDescription) -> Course {
    Course::new(description).expect("valid course")
}

fn with_segments(segments: Vec<Segment>) -> CourseDescription {
    CourseDescription {
        width_m: 7.0,
        segments,
    }
}

#[test]
fn the_length_and_the_final_heading_are_those_of_the_segments() {
    let description = three_turns();
    let course = course(&description);
    let length: f64 = description.segments.iter().map(Segment::length_m).sum();
    let angle: f64 = description.segments.iter().map(Segment::angle_rad).sum();
    assert!((course.total_length_m() - length).abs() < 1e-9);
    assert!((course.point(length).heading_rad - angle).abs() < 1e-12);
    assert!((length - 1105.0).abs() < 1e-9);
}

#[test]
fn four_equal_corners_close_a_loop() {
    let (radius, clothoid) = (60.0, 35.0);
    let arc = radius * std::f64::consts::FRAC_PI_2 - clothoid;
    for direction in [TurnDirection::Left, TurnDirection::Right] {
        let mut segments = Vec::new();
        for _ in 0..4 {
            segments.push(straight(80.0));
            segments.push(turn(direction, radius, arc, clothoid));
        }
        let course = course(&with_segments(segments));
        let end = course.point(course.total_length_m());
        assert!(end.x_m.hypot(end.y_m) < 1e-9, "{end:?}");
        assert!((end.heading_rad.abs() - std::f64::consts::TAU).abs() < 1e-12);
    }
}

#[test]
fn an_arc_lies_on_its_circle() {
    let course = course(&with_segments(vec![turn(
        TurnDirection::Left,
        50.0,
        120.0,
        20.0,
    )]));
    let centre = |station: f64| {
        let p = course.point(station);
        (
            p.x_m - 50.0 * p.heading_rad.sin(),
            p.y_m + 50.0 * p.heading_rad.cos(),
        )
    };
    let (x, y) = centre(20.0);
    for step in 0..=120 {
        let (x_now, y_now) = centre(20.0 + f64::from(step));
        assert!((x_now - x).hypot(y_now - y) < 1e-9);
    }
}

#[test]
fn a_clothoid_is_the_fresnel_integral() {
    // κ(s) = s/(R L): x = ∫ cos(s²/(2RL)), by its power series at s = L.
    let (radius, length) = (100.0, 60.0);
    let course = course(&with_segments(vec![turn(
        TurnDirection::Left,
        radius,
        10.0,
        length,
    )]));
    let angle: f64 = length / (2.0 * radius);
    let a2 = angle * angle;
    let x =
        length * (1.0 - a2 / 10.0 + a2 * a2 / 216.0 - a2.powi(3) / 9360.0 + a2.powi(4) / 685_440.0);
    let y = length * angle * (1.0 / 3.0 - a2 / 42.0 + a2 * a2 / 1320.0 - a2.powi(3) / 75_600.0);
    let end = course.point(length);
    assert!(
        (end.x_m - x).abs() < 1e-8 && (end.y_m - y).abs() < 1e-8,
        "{end:?} {x} {y}"
    );
}

#[test]
fn position_heading_and_curvature_are_continuous() {
    let course = course(&three_turns());
    let step = 0.01;
    let steepest = 1.0 / (108.0 * 30.0);
    let mut last = course.point(-1.0);
    let mut station = -1.0;
    while station < course.total_length_m() + 1.0 {
        station += step;
        let point = course.point(station);
        let distance = (point.x_m - last.x_m).hypot(point.y_m - last.y_m);
        assert!((distance - step).abs() < 1e-9, "{distance} at {station}");
        let turned = point.heading_rad - last.heading_rad;
        assert!(
            (turned - 0.5 * step * (point.curvature_per_m + last.curvature_per_m)).abs() < 1e-9
        );
        let curved = (point.curvature_per_m - last.curvature_per_m).abs();
        assert!(
            curved <= steepest * step * (1.0 + 1e-6) + 1e-12,
            "{curved} at {station}"
        );
        last = point;
    }
}

#[test]
fn the_mirrored_course_has_left_and_right_exchanged() {
    let course = course(&three_turns());
    let mirrored = course.mirrored();
    assert_eq!(mirrored.mirrored(), course);
    assert_eq!(
        Course::new(&three_turns().mirrored()).expect("valid"),
        mirrored
    );
    for step in 0..1105 {
        let (p, m) = (
            course.point(f64::from(step)),
            mirrored.point(f64::from(step)),
        );
        assert!((p.x_m - m.x_m).abs() < 1e-12 && (p.y_m + m.y_m).abs() < 1e-12);
    }
}

proptest! {
    #[test]
    fn a_position_beside_the_course_is_found_again(
        station in -50.0..1150.0_f64,
        offset in -20.0..20.0_f64,
        hint_error in -15.0..15.0_f64,
    ) {
        let course = course(&three_turns());
        let point = course.point(station);
        let (sin, cos) = point.heading_rad.sin_cos();
        let (x, y) = (point.x_m - offset * sin, point.y_m + offset * cos);
        for hint in [None, Some(station + hint_error)] {
            let found = course.locate(x, y, hint);
            prop_assert!((found.station_m - station).abs() < 1e-7, "{found:?} for {station}");
            prop_assert!((found.lateral_offset_m - offset).abs() < 1e-7);
            prop_assert!((found.heading_rad - point.heading_rad).abs() < 1e-8);
            prop_assert!((found.curvature_per_m - point.curvature_per_m).abs() < 1e-8);
        }
    }
}

#[test]
fn segments_are_read_from_data_and_written_back() {
    let text = r#"
        width_m = 7.0
        segments = [
            { straight_m = 145.0 },
            { turn = "left", radius_m = 144.0, arc_m = 60.0, clothoid_m = 40.0 },
        ]
    "#;
    let description: CourseDescription = toml::from_str(text).expect("valid");
    assert_eq!(description.segments[0], straight(145.0));
    assert_eq!(
        description.segments[1],
        turn(TurnDirection::Left, 144.0, 60.0, 40.0)
    );
    let written = toml::to_string(&description).expect("writable");
    assert_eq!(
        toml::from_str::<CourseDescription>(&written).expect("valid"),
        description
    );
}

#[test]
fn segments_that_are_neither_straight_nor_turn_are_refused() {
    for segment in [
        "{ straight_m = 10.0, radius_m = 20.0 }",
        "{ turn = \"left\", radius_m = 20.0 }",
        "{}",
    ] {
        let text = format!("width_m = 7.0\nsegments = [{segment}]");
        let error = toml::from_str::<CourseDescription>(&text)
            .expect_err("refused")
            .to_string();
        assert!(
            error.contains("either { straight_m } or { turn, radius_m, arc_m, clothoid_m }"),
            "{error}"
        );
    }
    let text = "width_m = 7.0\nsegments = [{ straight = 10.0 }]";
    let error = toml::from_str::<CourseDescription>(text)
        .expect_err("refused")
        .to_string();
    assert!(error.contains("unknown field `straight`"), "{error}");
}

#[test]
fn numbers_out_of_range_are_refused_with_their_segment() {
    let refuse = |segments| {
        Course::new(&with_segments(segments))
            .expect_err("refused")
            .to_string()
    };
    assert_eq!(
        refuse(vec![
            straight(10.0),
            turn(TurnDirection::Left, 3.0, 10.0, 10.0)
        ]),
        "road segment 2: radius_m = 3: must be in [7, 100000] m"
    );
    assert!(refuse(vec![straight(-1.0)]).starts_with("road segment 1: straight_m = -1"));
    assert!(refuse(vec![turn(TurnDirection::Left, 50.0, 10.0, 0.0)]).contains("clothoid_m = 0"));
    assert!(refuse(vec![straight(f64::NAN)]).contains("straight_m = NaN"));
    assert!(refuse(vec![]).contains("no segments"));
    let narrow = CourseDescription {
        width_m: 0.0,
        segments: vec![straight(10.0)],
    };
    assert_eq!(Course::new(&narrow), Err(RoadError::Width { width_m: 0.0 }));
}
