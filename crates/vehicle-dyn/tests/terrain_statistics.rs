//! The roughness against ISO 8608: spectral density along lines in several directions, coherence of
//! left and right tracks.

mod common;

use std::f64::consts::{PI, TAU};

use common::{straight, turn};
use vehicle_dyn::road::{Course, CourseDescription, TurnDirection};
use vehicle_dyn::terrain::{GroundDescription, RoadClass, Roughness, Terrain};

const CONTACT_M: f64 = 0.13;
const STEP_M: f64 = 0.25;
const LENGTH_M: f64 = 1000.0;
/// Bands of a third of an octave, from 0.02 to 1 cycles/m.
const BANDS: usize = 17;

fn ground(class: RoadClass, seed: u64) -> GroundDescription {
    GroundDescription {
        fade_in_m: Some(10.0),
        roughness: Some(Roughness {
            class: Some(class),
            gd_n0_m3: None,
            contact_length_m: CONTACT_M,
            seed,
        }),
        ..GroundDescription::flat(0.85)
    }
}

/// A long straight that points away from the x axis by `angle`, and where it begins.
fn long_straight(angle: f64) -> (Course, f64) {
    let radius = 40.0;
    let around = turn(TurnDirection::Left, radius, angle * radius - 5.0, 5.0);
    let first = around.length_m() + 5.0;
    let segments = vec![straight(5.0), around, straight(LENGTH_M)];
    let course = CourseDescription {
        width_m: 7.0,
        segments,
    };
    (Course::new(&course).expect("a bend and a straight"), first)
}

/// Heights along the straight, `offset` beside its middle, where it is rough in full.
fn track(terrain: &Terrain, course: &Course, first: f64, offset: f64) -> Vec<f64> {
    let mut heights = Vec::new();
    let mut station = first;
    while station < course.total_length_m() {
        let p = course.point(station);
        let (sin, cos) = p.heading_rad.sin_cos();
        heights.push(
            terrain
                .ground(p.x_m - offset * sin, p.y_m + offset * cos)
                .height_m,
        );
        station += STEP_M;
    }
    heights
}

/// Fourier coefficients of a track under a Hann window at every multiple of 1/length, as
/// (frequency, real, imaginary), scaled so that the squares are a one-sided density.
fn spectrum(heights: &[f64]) -> Vec<(f64, f64, f64)> {
    let n = heights.len();
    let length = n as f64 * STEP_M;
    let window: Vec<f64> = (0..n)
        .map(|k| 0.5 - 0.5 * (TAU * k as f64 / n as f64).cos())
        .collect();
    let power: f64 = window.iter().map(|w| w * w).sum::<f64>() / n as f64;
    let scale = (2.0 * STEP_M / (n as f64 * power)).sqrt();
    let mut out = Vec::new();
    let mut index = (0.02 * length).ceil();
    while index / length < 1.0 {
        let angle = TAU * index / n as f64;
        let (mut real, mut imaginary) = (0.0, 0.0);
        let (turn_sin, turn_cos) = angle.sin_cos();
        let (mut sin, mut cos) = (0.0, 1.0);
        for (height, weight) in heights.iter().zip(&window) {
            real += height * weight * cos;
            imaginary -= height * weight * sin;
            (cos, sin) = (
                cos * turn_cos - sin * turn_sin,
                sin * turn_cos + cos * turn_sin,
            );
        }
        out.push((index / length, scale * real, scale * imaginary));
        index += 1.0;
    }
    out
}

fn band(frequency: f64) -> Option<usize> {
    // Not negative and below 17.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let band = (3.0 * (frequency / 0.02).log2()).floor() as usize;
    (band < BANDS).then_some(band)
}

/// Mean of measured over wanted density in each band.
fn level_in_bands(tracks: &[Vec<f64>], gd_n0: f64) -> [f64; BANDS] {
    let (mut sum, mut count) = ([0.0; BANDS], [0.0; BANDS]);
    for heights in tracks {
        for (n, real, imaginary) in spectrum(heights) {
            let angle = PI * n * CONTACT_M;
            let wanted = gd_n0 * (n / 0.1).powi(-2) * (angle.sin() / angle).powi(2);
            if let Some(band) = band(n) {
                sum[band] += (real * real + imaginary * imaginary) / wanted;
                count[band] += 1.0;
            }
        }
    }
    std::array::from_fn(|b| sum[b] / count[b])
}

fn decibels(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

#[test]
fn the_spectral_density_is_that_of_iso_8608_in_every_direction() {
    // One line of 1 km per seed scatters by some dB in a band; the mean of 18 does not.
    const BAND_DB: f64 = 1.5;
    const MEAN_DB: f64 = 0.4;
    let gd_n0 = RoadClass::C.gd_n0_m3();
    let mut over_all = Vec::new();
    for angle in [0.2, 1.7, 2.8] {
        let (course, first) = long_straight(angle);
        let tracks: Vec<Vec<f64>> = (1..=6)
            .map(|seed| {
                let terrain =
                    Terrain::build(&ground(RoadClass::C, seed), &course).expect("it fits");
                track(&terrain, &course, first, 0.0)
            })
            .collect();
        let levels = level_in_bands(&tracks, gd_n0);
        let in_db = levels.map(decibels);
        println!("{angle} rad: {in_db:.1?} dB");
        let mean = decibels(levels.iter().sum::<f64>() / BANDS as f64);
        assert!(mean.abs() < 2.0 * MEAN_DB, "{mean} dB at {angle} rad");
        over_all.push(levels);
    }
    let mean: [f64; BANDS] =
        std::array::from_fn(|b| over_all.iter().map(|l| l[b]).sum::<f64>() / over_all.len() as f64);
    let in_db = mean.map(decibels);
    println!("mean: {in_db:.2?} dB");
    assert!(in_db.iter().all(|db| db.abs() < BAND_DB), "{in_db:?}");
    let level = in_db.iter().sum::<f64>() / BANDS as f64;
    assert!(level.abs() < MEAN_DB, "{level} dB");
    // Slope of the fit beside −2: dB per decade over 10.
    let centre = 0.5 * (BANDS - 1) as f64;
    let (mut rise, mut run) = (0.0, 0.0);
    for (band, db) in in_db.iter().enumerate() {
        let decades = (band as f64 - centre) * 2.0_f64.log10() / 3.0;
        rise += decades * db;
        run += decades * decades;
    }
    let slope = -2.0 + 0.1 * rise / run;
    println!("slope {slope:.3}");
    assert!((slope + 2.0).abs() < 0.07, "{slope}");
}

#[test]
fn a_class_is_four_times_the_one_before() {
    let classes = [
        RoadClass::A,
        RoadClass::B,
        RoadClass::C,
        RoadClass::D,
        RoadClass::E,
        RoadClass::F,
        RoadClass::G,
        RoadClass::H,
    ];
    let mut level = 16e-6;
    let course = CourseDescription {
        width_m: 7.0,
        segments: vec![straight(150.0)],
    };
    let (course, first) = (Course::new(&course).expect("a straight"), 10.0);
    let smooth = Terrain::build(&ground(RoadClass::A, 4), &course).expect("it fits");
    let smooth = track(&smooth, &course, first, 0.5);
    for (index, class) in classes.into_iter().enumerate() {
        assert!((class.gd_n0_m3() / level - 1.0).abs() < 1e-12, "{class:?}");
        let terrain = Terrain::build(&ground(class, 4), &course).expect("it fits");
        let factor = 2.0_f64.powi(i32::try_from(index).expect("small"));
        for (rough, smooth) in track(&terrain, &course, first, 0.5).iter().zip(&smooth) {
            assert!((rough - factor * smooth).abs() < 1e-6 * factor, "{class:?}");
        }
        level *= 4.0;
    }
}

/// Modified Bessel function K1 by its integral `∫ exp(−z cosh t) cosh t dt`.
fn bessel_k1(z: f64) -> f64 {
    let step = 0.01;
    let term = |t: f64| (-z * t.cosh()).exp() * t.cosh();
    let inner: f64 = (1..1200).map(|k| term(step * f64::from(k))).sum();
    step * (inner + 0.5 * term(0.0))
}

#[test]
fn left_and_right_are_coherent_for_long_waves_only() {
    // An isotropic surface whose density falls with the square has the coherence z K1(z) between
    // tracks b apart, z = 2π b n (Kamash and Robson 1978). Our band ends at 1 cycle/m, so it is
    // compared well below.
    let (course, first) = long_straight(1.2);
    let terrains: Vec<Terrain> = (1..=8)
        .map(|seed| Terrain::build(&ground(RoadClass::C, seed), &course).expect("it fits"))
        .collect();
    for apart in [0.8, 1.5, 3.0] {
        let (mut cross, mut power) = ([[0.0; 2]; BANDS], [[0.0; 2]; BANDS]);
        let (mut wanted, mut count) = ([0.0; BANDS], [0.0; BANDS]);
        for terrain in &terrains {
            let [left, right] =
                [0.5, -0.5].map(|side| spectrum(&track(terrain, &course, first, side * apart)));
            for ((n, a, b), (_, c, d)) in left.iter().zip(&right) {
                let Some(band) = band(*n) else { continue };
                // Each product relative to its frequency's level, so that a band is level.
                let scale = n * n;
                cross[band][0] += scale * (a * c + b * d);
                cross[band][1] += scale * (b * c - a * d);
                power[band][0] += scale * (a * a + b * b);
                power[band][1] += scale * (c * c + d * d);
                let z = TAU * apart * n;
                wanted[band] += z * bessel_k1(z);
                count[band] += 1.0;
            }
        }
        let mut last = 1.0;
        for band in 0..12 {
            let [real, imaginary] = cross[band];
            let [left, right] = power[band];
            let found = real.hypot(imaginary) / (left * right).sqrt();
            let expected = wanted[band] / count[band];
            let frequency = 0.02 * 2.0_f64.powf((band as f64 + 0.5) / 3.0);
            println!("{apart} m, {frequency:.3}/m: {found:.2}, expected {expected:.2}");
            assert!((found - expected).abs() < 0.15, "{found} at {frequency}");
            assert!(expected < last);
            last = expected;
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let (course, _) = long_straight(0.4);
    let build = |seed| Terrain::build(&ground(RoadClass::D, seed), &course).expect("it fits");
    assert_eq!(build(5), build(5));
    assert_ne!(build(5), build(6));
}
