//! The grid against the exact sum of waves.

use super::description::{GroundDescription, Roughness, Undulation};
use super::waves::{self, Wave};
use super::{RoadClass, Terrain};
use crate::road::{Course, CourseDescription, Segment};

fn straight(straight_m: f64) -> Course {
    Course::new(&CourseDescription {
        width_m: 7.0,
        segments: vec![Segment::Straight { straight_m }],
    })
    .expect("a straight is a course")
}

fn rough(class: RoadClass, seed: u64) -> (GroundDescription, Vec<Wave>) {
    let roughness = Roughness {
        class: Some(class),
        gd_n0_m3: None,
        contact_length_m: 0.13,
        seed,
    };
    let ground = GroundDescription {
        fade_in_m: Some(20.0),
        roughness: Some(roughness),
        ..GroundDescription::flat(0.85)
    };
    (ground, waves::roughness(&roughness))
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Errors of height and slope relative to their own root mean squares.
fn errors(terrain: &Terrain, waves: &[Wave]) -> ([f64; 2], f64) {
    let (mut height, mut slope) = ((Vec::new(), Vec::new()), (Vec::new(), Vec::new()));
    let mut largest = 0.0_f64;
    for k in 0..4000_u32 {
        // Off the nodes, all over the road, beyond the fade-in.
        let (x, y) = (
            30.0 + 0.0371 * f64::from(k),
            3.0 * (0.61 * f64::from(k)).sin(),
        );
        let found = terrain.ground(x, y);
        let mut exact = [0.0; 3];
        for wave in waves {
            for (sum, part) in exact.iter_mut().zip(wave.height(x, y)) {
                *sum += part;
            }
        }
        height.0.push(exact[0]);
        height.1.push(found.height_m - exact[0]);
        slope.0.extend([exact[1], exact[2]]);
        slope
            .1
            .extend([found.gradient_x - exact[1], found.gradient_y - exact[2]]);
        largest = largest.max((found.height_m - exact[0]).abs());
    }
    let relative =
        |(exact, error): &(Vec<f64>, Vec<f64>)| root_mean_square(error) / root_mean_square(exact);
    ([relative(&height), relative(&slope)], largest)
}

#[test]
fn the_grid_is_the_sum_of_waves_to_a_thousandth_of_its_height() {
    for (class, seed) in [(RoadClass::B, 1), (RoadClass::C, 2), (RoadClass::E, 3)] {
        let (ground, waves) = rough(class, seed);
        let terrain = Terrain::build(&ground, &straight(200.0)).expect("it fits");
        let ([height, slope], largest) = errors(&terrain, &waves);
        println!("{class:?}: height {height:.1e}, slope {slope:.1e}, largest {largest:.1e} m");
        assert!(height < 1e-3, "{height} of the height");
        assert!(slope < 1e-2, "{slope} of the slope");
    }
}

#[test]
fn an_undulation_has_the_height_it_is_given() {
    let undulation = Undulation {
        height_rms_m: 0.05,
        shortest_m: 25.0,
        longest_m: 80.0,
        seed: 3,
    };
    let ground = GroundDescription {
        fade_in_m: Some(20.0),
        undulation: Some(undulation),
        ..GroundDescription::flat(0.85)
    };
    let terrain = Terrain::build(&ground, &straight(5000.0)).expect("it fits");
    let heights: Vec<f64> = (0..9900)
        .map(|k| terrain.ground(20.0 + 0.5 * f64::from(k), 0.0).height_m)
        .collect();
    let rms = root_mean_square(&heights);
    assert!((rms / 0.05 - 1.0).abs() < 0.15, "{rms} m");
    let waves = waves::undulation(&undulation);
    let variance: f64 = waves
        .iter()
        .map(|w| 0.5 * w.amplitude_m * w.amplitude_m)
        .sum();
    assert!((variance.sqrt() / 0.05 - 1.0).abs() < 1e-12);
}
