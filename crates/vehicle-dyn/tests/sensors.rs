//! Statistics, exactness and reproducibility of sensors.

mod common;

use std::collections::BTreeMap;

use common::{TICK_S, on_flat, sedan};
use vehicle_dyn::sensors::{
    Channel, DropOutMode, Measurement, Sensor, SensorDescription, Sensors, derived_seed,
};
use vehicle_dyn::simulation::{Command, Observation};

const SAMPLES: usize = 200_000;

fn sensor(description: SensorDescription, seed: u64, channel: &str) -> Sensor {
    Sensor::new(&description, TICK_S, seed, channel).expect("allowed")
}

fn noise(standard_deviation: f64) -> SensorDescription {
    SensorDescription {
        noise_standard_deviation: standard_deviation,
        ..SensorDescription::default()
    }
}

/// Readings of a quantity that stays at `value`.
fn readings(sensor: &mut Sensor, value: f64, count: usize) -> Vec<Measurement> {
    (0..count).map(|_| sensor.measure(value)).collect()
}

fn bits(readings: &[Measurement]) -> Vec<u64> {
    readings.iter().map(|m| m.value.to_bits()).collect()
}

fn wave(sample: usize) -> f64 {
    (0.1 * sample as f64).sin()
}

#[test]
fn a_sensor_without_effects_hands_on_the_same_bits() {
    let mut sensor = sensor(SensorDescription::default(), 1, "ltr");
    for value in [0.1, -0.0, 0.0, 1e-300, -3.7e12, f64::MIN_POSITIVE] {
        let read = sensor.measure(value);
        assert_eq!(read.value.to_bits(), value.to_bits());
        assert!(read.fresh);
    }
    let from_file: SensorDescription = toml::from_str("").expect("everything may be absent");
    assert_eq!(from_file, SensorDescription::default());
}

#[test]
fn noise_has_its_mean_its_deviation_and_no_memory() {
    let (deviation, truth) = (0.02, 0.5);
    let read = readings(&mut sensor(noise(deviation), 7, "ltr"), truth, SAMPLES);
    let errors: Vec<f64> = read.iter().map(|m| m.value - truth).collect();
    let count = SAMPLES as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let variance = errors.iter().map(|e| e * e).sum::<f64>() / count;
    // Five standard errors each.
    assert!(mean.abs() < 5.0 * deviation / count.sqrt(), "{mean}");
    assert!((variance.sqrt() / deviation - 1.0).abs() < 5.0 / (2.0 * count).sqrt());
    for lag in 1..=20 {
        let products = errors.iter().zip(&errors[lag..]).map(|(a, b)| a * b);
        let correlation = products.sum::<f64>() / (count * variance);
        assert!(
            correlation.abs() < 5.0 / count.sqrt(),
            "lag {lag}: {correlation}"
        );
    }
    // Gaussian: the fourth moment is three times the variance squared.
    let fourth = errors.iter().map(|e| e.powi(4)).sum::<f64>() / count;
    assert!((fourth / (variance * variance) - 3.0).abs() < 5.0 * (24.0 / count).sqrt());
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_or_channel_others() {
    let of = |seed, channel| bits(&readings(&mut sensor(noise(1.0), seed, channel), 0.0, 100));
    assert_eq!(of(3, "ltr"), of(3, "ltr"));
    assert_ne!(of(3, "ltr"), of(4, "ltr"));
    assert_ne!(of(3, "ltr"), of(3, "roll_rad"));
    // What every platform, profile and release must give.
    let first = sensor(noise(1.0), 3, "ltr").measure(0.0).value;
    assert!((first + 0.281_997_182_042_758_64).abs() < 1e-15, "{first}");
}

#[test]
fn streams_of_two_channels_are_independent() {
    let mut a = sensor(noise(1.0), 3, "ltr");
    let mut b = sensor(noise(1.0), 3, "speed_m_s");
    let products = (0..SAMPLES).map(|_| a.measure(0.0).value * b.measure(0.0).value);
    let correlation = products.sum::<f64>() / SAMPLES as f64;
    assert!(
        correlation.abs() < 5.0 / (SAMPLES as f64).sqrt(),
        "{correlation}"
    );
}

#[test]
fn neither_another_channel_nor_drop_outs_change_a_channels_noise() {
    let seen = on_flat(&sedan(), 0.85, 50.0).observation();
    let measured = |channels: &[(Channel, SensorDescription)]| -> Vec<u64> {
        let descriptions: BTreeMap<_, _> = channels.iter().copied().collect();
        let mut sensors = Sensors::new(&descriptions, TICK_S, 5).expect("allowed");
        let ltr = (0..200).map(|_| sensors.measure(&seen).ltr.to_bits());
        ltr.collect()
    };
    let alone = measured(&[(Channel::LoadTransferRatio, noise(0.1))]);
    let beside = measured(&[
        (Channel::LoadTransferRatio, noise(0.1)),
        (Channel::Speed, noise(0.3)),
        (Channel::YawRate, noise(0.01)),
    ]);
    assert_eq!(alone, beside);
    let dropping = SensorDescription {
        drop_out_probability: 0.3,
        ..noise(0.1)
    };
    let with_losses = measured(&[(Channel::LoadTransferRatio, dropping)]);
    let mut kept = 0;
    for (with, without) in with_losses.iter().zip(&alone) {
        if !f64::from_bits(*with).is_nan() {
            assert_eq!(with, without);
            kept += 1;
        }
    }
    assert!((100..200).contains(&kept), "{kept}");
}

#[test]
fn a_quantiser_rounds_to_its_steps() {
    let step = 0.25;
    let description = SensorDescription {
        quantisation: step,
        ..SensorDescription::default()
    };
    let mut sensor = sensor(description, 1, "ltr");
    for sample in 0..2000 {
        let value = 3.0 * wave(sample);
        let read = sensor.measure(value).value;
        assert!((read - value).abs() <= 0.5 * step + 1e-12);
        assert!((read / step).fract() == 0.0, "{read}");
        // Odd: a mirrored run is mirrored.
        let mirrored = sensor.measure(-value).value;
        assert_eq!(mirrored.to_bits(), (-read).to_bits());
    }
}

#[test]
fn a_delay_is_exact_and_begins_with_the_first_value() {
    for samples in [1_usize, 3, 7] {
        let description = SensorDescription {
            delay_s: samples as f64 * TICK_S,
            ..SensorDescription::default()
        };
        let mut sensor = sensor(description, 1, "ltr");
        for sample in 0..100 {
            let read = sensor.measure(1.0 + wave(sample)).value;
            let expected = 1.0 + wave(sample.saturating_sub(samples));
            assert_eq!(read.to_bits(), expected.to_bits(), "sample {sample}");
        }
    }
}

#[test]
fn a_lag_answers_a_step_as_a_first_order_system_does() {
    let corner_hz = 2.0;
    let description = SensorDescription {
        bandwidth_hz: Some(corner_hz),
        ..SensorDescription::default()
    };
    let mut sensor = sensor(description, 1, "ltr");
    assert_eq!(sensor.measure(0.0).value.to_bits(), 0.0_f64.to_bits());
    for sample in 1..100 {
        let read = sensor.measure(1.0).value;
        let time_s = f64::from(sample) * TICK_S;
        let expected = 1.0 - (-std::f64::consts::TAU * corner_hz * time_s).exp();
        assert!((read - expected).abs() < 1e-12, "{read} for {expected}");
    }
}

#[test]
fn effects_come_in_their_documented_order() {
    let description = SensorDescription {
        bandwidth_hz: Some(5.0),
        delay_s: 2.0 * TICK_S,
        scale_error: 0.1,
        bias: 0.03,
        noise_standard_deviation: 0.2,
        quantisation: 0.05,
        ..SensorDescription::default()
    };
    let mut whole = sensor(description, 9, "ltr");
    // One effect each, in a row.
    let none = SensorDescription::default();
    let mut parts = [
        SensorDescription {
            bandwidth_hz: Some(5.0),
            ..none
        },
        SensorDescription {
            delay_s: 2.0 * TICK_S,
            ..none
        },
        SensorDescription {
            scale_error: 0.1,
            ..none
        },
        SensorDescription { bias: 0.03, ..none },
        noise(0.2),
        SensorDescription {
            quantisation: 0.05,
            ..none
        },
    ]
    .map(|part| sensor(part, 9, "ltr"));
    for sample in 0..500 {
        let value = wave(sample);
        let expected = parts
            .iter_mut()
            .fold(value, |value, part| part.measure(value).value);
        assert_eq!(whole.measure(value).value.to_bits(), expected.to_bits());
    }
}

/// Share of lost samples, and mean length of a drop-out in samples.
fn losses(description: SensorDescription) -> (f64, f64) {
    let read = readings(&mut sensor(description, 11, "ltr"), 1.0, SAMPLES);
    let lost = read.iter().filter(|m| !m.fresh).count();
    let begun = read.windows(2).filter(|w| w[0].fresh && !w[1].fresh);
    (
        lost as f64 / SAMPLES as f64,
        lost as f64 / begun.count() as f64,
    )
}

#[test]
fn drop_outs_have_their_rate_and_their_length() {
    let single = SensorDescription {
        drop_out_probability: 0.1,
        ..SensorDescription::default()
    };
    let (rate, length) = losses(single);
    assert!((rate - 0.1).abs() < 0.004, "{rate}");
    // Independent losses follow each other by chance: 1/(1 − p).
    assert!((length - 1.0 / 0.9).abs() < 0.02, "{length}");

    let bursts = SensorDescription {
        drop_out_mean_length_s: Some(0.2),
        ..single
    };
    let (rate, length) = losses(bursts);
    assert!((rate - 0.1).abs() < 0.02, "{rate}");
    assert!((length - 20.0).abs() < 2.0, "{length}");

    let never_there = SensorDescription {
        drop_out_probability: 1.0,
        ..SensorDescription::default()
    };
    assert!((losses(never_there).0 - 1.0).abs() < f64::EPSILON);
}

#[test]
fn a_lost_sample_is_no_number_or_the_last_reading() {
    let lossy = |mode| SensorDescription {
        drop_out_probability: 0.4,
        drop_out_mode: mode,
        ..noise(0.1)
    };
    let mut holding = sensor(lossy(DropOutMode::HoldLast), 2, "ltr");
    let mut losing = sensor(lossy(DropOutMode::Nan), 2, "ltr");
    let mut last = f64::NAN;
    for sample in 0..1000 {
        let (held, lost) = (holding.measure(wave(sample)), losing.measure(wave(sample)));
        assert_eq!(held.fresh, lost.fresh);
        assert_eq!(lost.fresh, !lost.value.is_nan());
        if held.fresh {
            last = held.value;
            assert_eq!(held.value.to_bits(), lost.value.to_bits());
        } else {
            assert!(held.value.to_bits() == last.to_bits() || last.is_nan());
        }
    }
    let mut dead = sensor(
        SensorDescription {
            drop_out_probability: 1.0,
            drop_out_mode: DropOutMode::HoldLast,
            ..SensorDescription::default()
        },
        2,
        "ltr",
    );
    assert!(dead.measure(1.0).value.is_nan(), "nothing was ever read");
}

fn everything() -> SensorDescription {
    SensorDescription {
        bandwidth_hz: Some(10.0),
        delay_s: 0.05,
        scale_error: 0.02,
        bias: -0.1,
        noise_standard_deviation: 0.1,
        quantisation: 0.01,
        drop_out_probability: 0.2,
        drop_out_mean_length_s: Some(0.05),
        drop_out_mode: DropOutMode::HoldLast,
    }
}

#[test]
fn a_reset_sensor_is_as_new() {
    let mut sensor = sensor(everything(), 4, "ltr");
    let run = |sensor: &mut Sensor| -> Vec<u64> {
        (0..300)
            .map(|k| sensor.measure(2.0 + wave(k)).value.to_bits())
            .collect()
    };
    let first = run(&mut sensor);
    assert_ne!(first, run(&mut sensor));
    sensor.reset();
    assert_eq!(first, run(&mut sensor));
}

#[test]
fn measuring_allocates_nothing() {
    let seen = on_flat(&sedan(), 0.85, 50.0).observation();
    let descriptions = Channel::ALL.map(|channel| (channel, everything()));
    let mut sensors =
        Sensors::new(&descriptions.into_iter().collect(), TICK_S, 1).expect("allowed");
    let counted = allocation_counter::measure(|| {
        for _ in 0..1000 {
            sensors.measure(&seen);
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn every_channel_replaces_its_own_field_only() {
    let mut simulation = on_flat(&sedan(), 0.85, 50.0);
    let seen = simulation
        .step(Command::from_deg_kmh(30.0, 50.0), TICK_S)
        .expect("finite");
    let bias = SensorDescription {
        bias: 1.5,
        ..SensorDescription::default()
    };
    for channel in Channel::ALL {
        let descriptions = BTreeMap::from([(channel, bias)]);
        let mut sensors = Sensors::new(&descriptions, TICK_S, 1).expect("allowed");
        let mut measured: Observation = sensors.measure(&seen);
        assert!((channel.value(&measured) - channel.value(&seen) - 1.5).abs() < 1e-12);
        *channel.field(&mut measured) = channel.value(&seen);
        assert_eq!(measured, seen, "{channel}");
    }
    let mut none = Sensors::new(&BTreeMap::new(), TICK_S, 1).expect("allowed");
    assert_eq!(none.measure(&seen), seen);
}

#[test]
fn channels_in_files_go_by_the_names_of_their_fields() {
    for channel in Channel::ALL {
        let text = format!("[{channel}]\nbias = 1.0\n");
        let read: BTreeMap<Channel, SensorDescription> = toml::from_str(&text).expect("a channel");
        assert!(read.contains_key(&channel), "{channel}");
    }
    let wrong = toml::from_str::<BTreeMap<Channel, SensorDescription>>("[speed]\nbias = 1.0\n");
    let message = wrong.expect_err("refused").to_string();
    assert!(message.contains("speed_m_s"), "{message}");
    let wrong = toml::from_str::<SensorDescription>("noise = 1.0\n");
    let message = wrong.expect_err("refused").to_string();
    assert!(message.contains("noise_standard_deviation"), "{message}");
}

#[test]
fn seeds_for_two_purposes_differ() {
    assert_eq!(derived_seed(1, "run"), derived_seed(1, "run"));
    assert_ne!(derived_seed(1, "run"), derived_seed(1, "recording"));
    assert_ne!(derived_seed(1, "run"), derived_seed(2, "run"));
}

#[test]
fn descriptions_out_of_range_are_refused_with_field_number_and_range() {
    let none = SensorDescription::default();
    let message = |description: SensorDescription| {
        Sensor::new(&description, TICK_S, 1, "ltr")
            .expect_err("refused")
            .to_string()
    };
    for (description, expected) in [
        (
            noise(-0.1),
            "sensors.ltr.noise_standard_deviation = -0.1: must be in [0, 1e6]",
        ),
        (
            SensorDescription {
                bias: f64::NAN,
                ..none
            },
            "sensors.ltr.bias = NaN: must be in [-1e6, 1e6]",
        ),
        (
            SensorDescription {
                drop_out_probability: 1.5,
                ..none
            },
            "sensors.ltr.drop_out_probability = 1.5: must be in [0, 1]",
        ),
        (
            SensorDescription {
                delay_s: 0.025,
                ..none
            },
            "sensors.ltr.delay_s = 0.025: must be a whole number of samples of 0.01 s, such as \
             0.020000 or 0.030000 s",
        ),
        (
            SensorDescription {
                bandwidth_hz: Some(0.0),
                ..none
            },
            "sensors.ltr.bandwidth_hz = 0: must be in [1e-3, 1e6] Hz, or absent",
        ),
        (
            SensorDescription {
                drop_out_probability: 0.9,
                drop_out_mean_length_s: Some(0.02),
                ..none
            },
            "sensors.ltr.drop_out_mean_length_s = 0.02: must be at least 0.090000 s with samples \
             0.01 s apart of which 0.9 are lost",
        ),
        (
            SensorDescription {
                drop_out_probability: 0.1,
                drop_out_mean_length_s: Some(0.001),
                ..none
            },
            "sensors.ltr.drop_out_mean_length_s = 0.001: must be at least 0.010000 s with samples \
             0.01 s apart of which 0.1 are lost",
        ),
    ] {
        assert_eq!(message(description), expected);
    }
    let no_time = Sensor::new(&none, 0.0, 1, "ltr").expect_err("refused");
    assert_eq!(
        no_time.to_string(),
        "the sensors' sample time is 0 s: must be in (0, 10] s"
    );
}
