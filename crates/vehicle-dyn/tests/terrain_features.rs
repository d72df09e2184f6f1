//! What a ground description means: bank, bumps, friction, fade-in, the world outside, the mirror.

mod common;

use common::{drive, pose, sedan, straight, three_turns, turn};
use proptest::prelude::*;
use vehicle_dyn::road::{Course, CourseDescription, Segment, TurnDirection};
use vehicle_dyn::simulation::Simulation;
use vehicle_dyn::terrain::{Ground, GroundDescription, Terrain, TerrainError};

fn ground(text: &str) -> GroundDescription {
    toml::from_str(text).expect("a valid ground")
}

fn course(segments: Vec<Segment>) -> Course {
    let width_m = 7.0;
    Course::new(&CourseDescription { width_m, segments }).expect("a valid course")
}

fn build(text: &str, course: &Course) -> Terrain {
    Terrain::build(&ground(text), course).expect("it fits")
}

/// The ground beside the course.
fn beside(terrain: &Terrain, course: &Course, station: f64, offset: f64) -> (Ground, f64) {
    let p = course.point(station);
    let (sin, cos) = p.heading_rad.sin_cos();
    let found = terrain.ground(p.x_m - offset * sin, p.y_m + offset * cos);
    (found, found.gradient_y * cos - found.gradient_x * sin)
}

const EVERYTHING: &str = r#"
    friction = 0.85
    fade_in_m = 50.0
    roughness = { class = "d", contact_length_m = 0.13, seed = 7 }
    undulation = { height_rms_m = 0.06, shortest_m = 25.0, longest_m = 80.0, seed = 7 }
    bank = [{ station_m = 20.0, percent = 0.0 }, { station_m = 60.0, percent = -6.0 }]
    bumps = [
        { station_m = 45.0, offset_m = 1.0, length_m = 0.6, width_m = 0.9, height_m = -0.06 },
        { station_m = 90.0, offset_m = 0.0, length_m = 3.0, width_m = 7.0, height_m = 0.1 },
    ]
    split = { left = 0.9, right = 0.4, edge_m = 0.5 }
    patches = [
        { from_m = 30.0, to_m = 40.0, right_m = -2.0, left_m = 1.0, friction = 0.1, edge_m = 0.5 },
    ]
"#;

#[test]
fn friction_alone_is_the_level_plane_to_the_bit() {
    let course = Course::new(&three_turns()).expect("valid");
    assert_eq!(build("friction = 0.85", &course), Terrain::flat(0.85));
    let mirrored = ground("friction = 0.85").mirrored();
    let found = Terrain::build(&mirrored, &course.mirrored()).expect("it fits");
    assert_eq!(found, Terrain::flat(0.85));
}

#[test]
fn a_banked_road_has_its_slope_and_changes_it_smoothly() {
    let course = course(vec![
        straight(60.0),
        turn(TurnDirection::Left, 80.0, 60.0, 30.0),
        straight(60.0),
    ]);
    let text = "friction = 0.85
        bank = [{ station_m = 40.0, percent = 0.0 }, { station_m = 80.0, percent = -6.0 },
                { station_m = 150.0, percent = -6.0 }, { station_m = 190.0, percent = 2.0 }]";
    let terrain = build(text, &course);
    for offset in [-3.5, -1.0, 0.0, 0.7, 3.5] {
        for (station, slope) in [
            (5.0, 0.0),
            (38.0, 0.0),
            (60.0, -0.03),
            (85.0, -0.06),
            (120.0, -0.06),
            (170.0, -0.02),
            (195.0, 0.02),
        ] {
            let (found, cross_slope) = beside(&terrain, &course, station, offset);
            assert!(
                (cross_slope - slope).abs() < 1e-4,
                "{cross_slope} at {station} m, {offset} m"
            );
            assert!((found.height_m - slope * offset).abs() < 1e-4);
        }
    }
    // A car on it leans to its lower side: right in a positive bank.
    let uniform = build(
        "friction = 0.85\nbank = [{ station_m = 0.0, percent = 5.0 }]",
        &course,
    );
    let seen = Simulation::new(&sedan(), uniform, pose(20.0))
        .expect("valid")
        .observation();
    assert!(
        (seen.roll_rad - 0.05_f64.atan()).abs() < 2e-3,
        "{}",
        seen.roll_rad
    );
}

#[test]
fn a_bump_has_its_shape_exactly() {
    let course = course(vec![straight(100.0)]);
    let text = "friction = 0.85
        bumps = [{ station_m = 50.0, offset_m = 1.0, length_m = 2.0, width_m = 4.0, height_m = 0.1 }]";
    let terrain = build(text, &course);
    let at = |x: f64, y: f64| terrain.ground(x, y).height_m;
    assert!((at(50.0, 1.0) - 0.1).abs() < 1e-12);
    assert!((at(50.5, 1.0) - 0.05).abs() < 1e-12 && (at(49.5, 1.9) - 0.05).abs() < 1e-12);
    assert!(
        (at(50.0, 2.5) - 0.05).abs() < 1e-12,
        "its edges run out over 1 m"
    );
    for (x, y) in [(48.99, 1.0), (51.01, 1.0), (50.0, 3.01), (50.0, -1.01)] {
        assert!(at(x, y).abs() < 1e-12, "({x}, {y})");
    }
}

#[test]
fn friction_is_split_and_patched_with_smooth_edges() {
    let course = course(vec![
        straight(50.0),
        turn(TurnDirection::Right, 60.0, 40.0, 20.0),
        straight(50.0),
    ]);
    let text = "friction = 0.6
        split = { left = 0.9, right = 0.3, edge_m = 1.0 }
        patches = [{ from_m = 60.0, to_m = 80.0, right_m = -3.0, left_m = 3.0, friction = 0.1, edge_m = 1.0 }]";
    let terrain = build(text, &course);
    let friction = |station, offset| beside(&terrain, &course, station, offset).0.friction;
    for (station, offset, expected) in [
        (30.0, 2.0, 0.9),
        (30.0, -2.0, 0.3),
        (30.0, 0.0, 0.6),
        (70.0, 2.0, 0.1),
        (70.0, -2.0, 0.1),
        (100.0, 2.0, 0.9),
        (30.0, 60.0, 0.6),
    ] {
        let found = friction(station, offset);
        assert!(
            (found - expected).abs() < 1e-3,
            "{found} at {station} m, {offset} m"
        );
    }
    let mut last = friction(55.0, 1.0);
    for step in 0..1500 {
        let now = friction(55.0 + 0.02 * f64::from(step), 1.0);
        assert!(
            (now - last).abs() < 0.05 && (0.0999..=0.9001).contains(&now),
            "{now}"
        );
        last = now;
    }
}

#[test]
fn the_start_is_level_and_the_ground_whole_after_the_fade_in() {
    let course = course(vec![straight(150.0)]);
    let text = |fade_in: f64| {
        format!(
            "friction = 0.85\nfade_in_m = {fade_in}\n\
             roughness = {{ class = \"e\", contact_length_m = 0.13, seed = 3 }}"
        )
    };
    let (long, short) = (build(&text(50.0), &course), build(&text(5.0), &course));
    for (x, y) in [(0.0, 0.0), (2.0, 0.7), (-2.0, -0.7)] {
        assert!(long.ground(x, y).height_m.abs() < 1e-4);
        assert!(long.ground(x, y).gradient_x.abs() < 1e-3);
    }
    for k in 0..500 {
        let x = 51.0 + 0.1 * f64::from(k);
        assert_eq!(long.ground(x, 1.0), short.ground(x, 1.0), "{x}");
    }
}

#[test]
fn outside_the_corridor_lies_the_level_plane() {
    let course = Course::new(&three_turns()).expect("valid");
    let terrain = build(EVERYTHING, &course);
    let plane = Terrain::flat(0.85);
    for (x, y) in [
        (-200.0, 0.0),
        (300.0, -200.0),
        (1e9, -1e12),
        (f64::MAX, f64::MIN),
    ] {
        assert_eq!(terrain.ground(x, y), plane.ground(x, y));
    }
    assert_eq!(terrain.ground(f64::INFINITY, 0.0), plane.ground(0.0, 0.0));
    // No answer is better than a wrong one.
    let lost = terrain.ground(f64::NAN, 0.0).height_m;
    assert!(lost.is_nan() || lost == 0.0);
}

/// Walks in a straight line and checks that neither height nor slope nor friction jumps.
fn assert_smooth(terrain: &Terrain, from: (f64, f64), direction: f64, steps: u32) {
    const STEP_M: f64 = 0.01;
    let (sin, cos) = direction.sin_cos();
    let at = |k: u32| {
        let s = STEP_M * f64::from(k);
        let ground = terrain.ground(from.0 + s * cos, from.1 + s * sin);
        (ground, ground.gradient_x * cos + ground.gradient_y * sin)
    };
    let (mut last, mut last_slope) = at(0);
    for k in 1..steps {
        let (now, slope) = at(k);
        let rise = now.height_m - last.height_m;
        let place = (from, direction, k);
        assert!(
            (rise - 0.5 * STEP_M * (slope + last_slope)).abs() < 2e-5,
            "{rise} at {place:?}"
        );
        assert!(
            (slope - last_slope).abs() < 0.12,
            "{slope} after {last_slope} at {place:?}"
        );
        assert!(slope.abs() < 0.8, "{slope} at {place:?}");
        assert!((now.friction - last.friction).abs() < 0.06, "{place:?}");
        (last, last_slope) = (now, slope);
    }
}

#[test]
fn nothing_jumps_at_tiles_at_the_border_or_between_the_legs_of_a_hairpin() {
    // Two legs 16 m apart whose banks contradict each other, and a wide turn around nothing.
    let hairpin = course(vec![
        straight(80.0),
        turn(
            TurnDirection::Left,
            8.0,
            8.0 * std::f64::consts::PI - 1.0,
            1.0,
        ),
        straight(80.0),
    ]);
    let terrain = build(EVERYTHING, &hairpin);
    for step in 0..12 {
        let x = 10.0 + 7.3 * f64::from(step);
        assert_smooth(&terrain, (x, -45.0), 1.5, 11_000);
        assert_smooth(
            &terrain,
            (x - 70.0, 7.9 + 0.2 * f64::from(step)),
            0.01,
            16_000,
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_ground_is_smooth_wherever_one_walks(
        station in 0.0..1105.0_f64, offset in -40.0..40.0_f64, direction in 0.0..6.3_f64,
    ) {
        static TERRAIN: std::sync::OnceLock<(Terrain, Course)> = std::sync::OnceLock::new();
        let (terrain, course) = TERRAIN.get_or_init(|| {
            let course = Course::new(&three_turns()).expect("valid");
            (build(EVERYTHING, &course), course)
        });
        let p = course.point(station);
        let (sin, cos) = p.heading_rad.sin_cos();
        let from = (p.x_m - offset * sin, p.y_m + offset * cos);
        assert_smooth(terrain, from, direction, 3000);
    }
}

#[test]
fn the_mirror_image_is_exact_and_so_is_a_run_on_it() {
    let course = Course::new(&three_turns()).expect("valid");
    let description = ground(EVERYTHING);
    let terrain = Terrain::build(&description, &course).expect("it fits");
    let mirror = Terrain::build(&description.mirrored(), &course.mirrored()).expect("it fits");
    assert_eq!(mirror, terrain.mirrored());
    assert_eq!(mirror.mirrored(), terrain);
    for k in 0..5000 {
        let (x, y) = (0.2 * f64::from(k), 20.0 * (0.3 * f64::from(k)).sin());
        let (plain, other) = (terrain.ground(x, y), mirror.ground(x, -y));
        assert_eq!(
            (
                plain.height_m,
                plain.gradient_x,
                plain.gradient_y,
                plain.friction
            ),
            (
                other.height_m,
                other.gradient_x,
                -other.gradient_y,
                other.friction
            )
        );
    }
    let simulation =
        |terrain: &Terrain| Simulation::new(&sedan(), terrain.clone(), pose(80.0)).expect("valid");
    let plain = drive(simulation(&terrain), &course, 80.0, 12.0);
    let other = drive(simulation(&mirror), &course.mirrored(), 80.0, 12.0);
    assert_eq!(plain.len(), other.len());
    for (p, m) in plain.iter().zip(&other) {
        assert!(
            (p.ltr + m.ltr).abs() <= 1e-9,
            "{} and {} at {} s",
            p.ltr,
            m.ltr,
            p.time_s
        );
    }
}

#[test]
fn building_can_be_followed_and_stopped() {
    let course = course(vec![straight(100.0)]);
    let mut seen = Vec::new();
    let stopped = Terrain::build_with(&ground(EVERYTHING), &course, &mut |done, total| {
        seen.push((done, total));
        if done == 3 {
            std::ops::ControlFlow::Break(())
        } else {
            std::ops::ControlFlow::Continue(())
        }
    });
    let total = seen[0].1;
    assert_eq!(seen, [(0, total), (1, total), (2, total), (3, total)]);
    assert_eq!(stopped, Err(TerrainError::Interrupted { done: 3, total }));
}

#[test]
fn a_terrain_that_would_not_fit_into_memory_is_refused_with_the_numbers() {
    let long = Course::new(&CourseDescription {
        width_m: 100.0,
        segments: vec![straight(100_000.0)],
    })
    .expect("valid");
    let message = Terrain::build(
        &ground("friction = 0.85\nsplit = { left = 0.9, right = 0.3, edge_m = 1.0 }"),
        &long,
    )
    .expect_err("too large")
    .to_string();
    for piece in ["100000 m long", "MiB", "2048 MiB"] {
        assert!(message.contains(piece), "{message}");
    }
}

#[test]
fn a_terrain_smaller_than_the_course_is_refused_with_the_numbers() {
    let (short, long) = (course(vec![straight(60.0)]), course(vec![straight(200.0)]));
    let terrain = build(
        "friction = 0.85\nbank = [{ station_m = 0.0, percent = 1.0 }]",
        &short,
    );
    assert!(terrain.check_covers(&short).is_ok());
    assert!(Terrain::flat(0.8).check_covers(&long).is_ok());
    let error = terrain.check_covers(&long).expect_err("too short");
    let TerrainError::SmallerThanCourse {
        station_m, total_m, ..
    } = error
    else {
        panic!("{error}");
    };
    assert!((75.0..95.0).contains(&station_m) && (total_m - 200.0).abs() < 1e-9);
    let bend = course(vec![
        straight(20.0),
        turn(TurnDirection::Right, 20.0, 30.0, 5.0),
    ]);
    let message = terrain.check_covers(&bend).expect_err("leaves").to_string();
    assert!(
        message.contains("to the") && message.contains("the road 3.5 m"),
        "{message}"
    );
    assert!(terrain.mirrored().check_covers(&short.mirrored()).is_ok());
}
