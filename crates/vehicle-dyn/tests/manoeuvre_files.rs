//! Manoeuvre files, lanes and cones.

mod common;

use common::{on_flat, sedan};
use vehicle_dyn::manoeuvre::{self, Manoeuvre, ManoeuvreFile, Outline, Track, TrackMonitor};
use vehicle_dyn::simulation::Observation;

#[test]
fn every_embedded_manoeuvre_is_valid_and_has_the_name_of_its_file() {
    for name in manoeuvre::names() {
        let file = manoeuvre::find(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(file.name, name);
        let text = toml::to_string(&file).expect("can be written");
        assert_eq!(
            ManoeuvreFile::from_toml(&text, "again").expect("can be read"),
            file
        );
    }
}

#[test]
fn an_unknown_name_is_answered_with_the_nearest_and_all() {
    let message = manoeuvre::find("fishook-1b")
        .expect_err("unknown")
        .to_string();
    assert!(message.contains("did you mean `fishhook-1b`?"), "{message}");
    assert!(message.contains("iso-7401-step"), "{message}");
    let message = manoeuvre::find("nowhere.toml")
        .expect_err("no file")
        .to_string();
    assert!(
        message.contains("cannot read manoeuvre file nowhere.toml"),
        "{message}"
    );
}

/// Replaces one line of an embedded file and returns the message of the refusal.
#[track_caller]
fn refused(name: &str, from: &str, to: &str) -> String {
    let text = manoeuvre::embedded_text(name).expect("embedded");
    assert!(text.contains(from), "{name} has no `{from}`");
    let error = ManoeuvreFile::from_toml(&text.replacen(from, to, 1), "changed.toml");
    error.expect_err("refused").to_string()
}

#[test]
fn wrong_numbers_are_refused_with_field_number_and_range() {
    for (name, from, to, pieces) in [
        (
            "fishhook-1a",
            "friction = 0.85",
            "friction = -1.0",
            ["friction = -1", "[0.01, 5]"],
        ),
        (
            "fishhook-1a",
            "dwell_s = 0.25",
            "dwell_s = -0.1",
            ["dwell_s = -0.1", "[0, 10] s"],
        ),
        (
            "fishhook-1b",
            "[35.0, 40.0, 45.0, 47.5, 50.0]",
            "[35.0, 30.0]",
            ["entrance_speeds_mph = 35, 30", "in rising order"],
        ),
        (
            "j-turn",
            "[35.0, 40.0, 45.0, 50.0, 55.0, 60.0]",
            "[]",
            ["entrance_speeds_mph", "at least one"],
        ),
        (
            "sine-with-dwell",
            "frequency_hz = 0.7",
            "frequency_hz = nan",
            ["frequency_hz = NaN", "[0.1, 5] Hz"],
        ),
        (
            "iso-7401-step",
            "end_s = 5.0",
            "end_s = 3.1",
            ["end_s = 3.1", "0.5 s after steady_from_s"],
        ),
        (
            "iso-4138-constant-radius",
            "gradient_to_g = 0.3",
            "gradient_to_g = 0.05",
            ["gradient_from_g, gradient_to_g = 0.1, 0.05", "rising"],
        ),
        (
            "iso-3888-2",
            "begin_m = 25.5",
            "begin_m = 5.0",
            ["lanes[1].begin_m = 5", "at least 12 m"],
        ),
        (
            "iso-3888-2",
            "cones_per_side = 5",
            "cones_per_side = 1",
            ["cones_per_side = 1", "[2, 1000]"],
        ),
        (
            "tilt-table",
            "tilt_rate_deg_per_s = 0.25",
            "tilt_rate_deg_per_s = 0.0",
            ["= 0", "(0, 5] deg/s"],
        ),
        (
            "tilt-table",
            "name = \"tilt-table\"",
            "name = \"../up\"",
            ["`../up`", "letters"],
        ),
    ] {
        let message = refused(name, from, to);
        for piece in pieces {
            assert!(message.contains(piece), "`{piece}` in: {message}");
        }
    }
}

#[test]
fn unknown_and_missing_keys_and_kinds_are_refused_by_name() {
    let message = refused("j-turn", "hold_s = 4.0", "hold_time_s = 4.0");
    assert!(
        message.contains("hold_time_s") && message.contains("changed.toml"),
        "{message}"
    );
    let message = refused("j-turn", "hold_s = 4.0\n", "");
    assert!(message.contains("hold_s"), "{message}");
    let message = refused("j-turn", "kind = \"j_turn\"", "kind = \"k_turn\"");
    assert!(
        message.contains("k_turn") && message.contains("j_turn"),
        "{message}"
    );
}

fn track(name: &str, vehicle_width_m: f64, sign: f64) -> Track {
    let Manoeuvre::LaneChange(manoeuvre) = manoeuvre::find(name).expect("embedded").manoeuvre
    else {
        panic!("another kind")
    };
    Track::new(
        &manoeuvre.lanes,
        vehicle_width_m,
        0.0,
        manoeuvre.cone_radius_m,
        sign,
    )
}

#[track_caller]
fn assert_close(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-9,
        "{found} instead of {expected}"
    );
}

#[test]
fn lanes_have_the_widths_and_places_of_their_standards() {
    // A car 1.8 m wide.
    let double = track("iso-3888-1", 1.8, 1.0);
    let widths = [2.23, 2.41, 2.59];
    for (lane, width) in double.lanes.iter().zip(widths) {
        assert_close(lane.left_m - lane.right_m, width);
    }
    assert_close(double.lanes[1].right_m - double.lanes[0].right_m, 3.5);
    assert_close(double.lanes[2].right_m, double.lanes[0].right_m);
    assert_close(double.end_m(), 125.0);
    let avoidance = track("iso-3888-2", 1.8, 1.0);
    let widths = [2.23, 2.8, 3.0];
    for (lane, width) in avoidance.lanes.iter().zip(widths) {
        assert_close(lane.left_m - lane.right_m, width);
    }
    assert_close(avoidance.lanes[1].right_m - avoidance.lanes[0].left_m, 1.0);
    assert_close(avoidance.lanes[2].left_m, avoidance.lanes[0].left_m);
    assert_close(avoidance.end_m(), 61.0);
    // A wide vehicle gets more than the least width.
    assert_close(
        track("iso-3888-2", 2.4, 1.0).lanes[2].left_m
            - track("iso-3888-2", 2.4, 1.0).lanes[2].right_m,
        3.37,
    );
}

#[test]
fn the_path_runs_through_the_middles_of_the_lanes() {
    for name in ["iso-3888-1", "iso-3888-2"] {
        for sign in [1.0, -1.0] {
            let track = track(name, 1.7, sign);
            let path = track.path(1.0, 0.0, 50.0).expect("a path");
            for lane in &track.lanes {
                let middle = 0.5 * (lane.begin_m + lane.end_m);
                let there = path.locate(middle, 0.5 * (lane.left_m + lane.right_m), None);
                assert!(there.lateral_offset_m.abs() < 1e-6, "{name}: {there:?}");
                assert!(there.heading_rad.abs() < 1e-9, "{name}: {there:?}");
            }
        }
    }
}

#[test]
fn cones_are_hit_by_the_outline_and_not_beside_it() {
    let vehicle = sedan();
    let outline = Outline {
        width_beyond_track_m: 0.3,
        overhang_front_m: 0.8,
        overhang_rear_m: 0.9,
    };
    let width = outline.width_m(&vehicle);
    let track = track("iso-3888-2", width, 1.0);
    let base = on_flat(&vehicle, 0.85, 50.0).observation();
    let drive = |y_m: f64, yaw_rad: f64| {
        let mut monitor = TrackMonitor::new(&track, &vehicle, &outline);
        for step in 0..1300 {
            let x_m = -5.0 + 0.01 * f64::from(step);
            monitor.observe(&Observation {
                x_m,
                y_m,
                yaw_rad,
                ..base
            });
        }
        (monitor.cones_hit(), monitor.excursion_m())
    };
    assert_eq!(
        drive(0.0, 0.0),
        (0, 0.0),
        "down the middle of the first lane"
    );
    // The lane leaves (0.1·width + 0.25)/2 on each side.
    let room = 0.5 * (0.1 * width + 0.25);
    assert_eq!(drive(room - 0.01, 0.0), (0, 0.0));
    let (hit, excursion) = drive(room + 0.05, 0.0);
    assert!(hit >= 3, "{hit}: the left row, as far as the car has come");
    assert!((excursion - 0.05).abs() < 1e-9, "{excursion}");
    let (right, _) = drive(-room - 0.05, 0.0);
    assert_eq!(right, hit);
    assert!(drive(0.0, 0.3).0 > 0, "across");
}
