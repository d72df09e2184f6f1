//! One sensor at work.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{DropOutMode, SensorDescription, SensorError};

/// What a sensor reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// The reading; not a number where a sample is lost and not replaced.
    pub value: f64,
    /// Whether this sample was measured: `false` at a drop-out.
    pub fresh: bool,
}

/// A sensor of one quantity, sampled at a fixed rate. Nothing is allocated while measuring.
#[derive(Debug, Clone)]
pub struct Sensor {
    description: SensorDescription,
    /// Share of the way the lag goes in a sample; `None` without lag.
    lag_share: Option<f64>,
    /// Chances of a drop-out's begin and end per sample.
    drop_out: [f64; 2],
    key: [u8; 32],
    state: State,
}

#[derive(Debug, Clone)]
struct State {
    noise: ChaCha8Rng,
    losses: ChaCha8Rng,
    lagged: Option<f64>,
    /// What was seen in the last samples, the oldest at `oldest`; as long as the delay.
    past: Vec<f64>,
    oldest: usize,
    started: bool,
    losing: bool,
    last_reading: f64,
}

/// Numbers of the two random streams of a sensor, so that neither moves the other.
const NOISE_STREAM: u64 = 0;
const LOSS_STREAM: u64 = 1;

impl Sensor {
    /// A sensor of `channel` (a name: of the seed's streams, and in messages) for samples
    /// `sample_time_s` apart.
    ///
    /// A delay that is no whole number of samples is refused: a reading between two samples would have to be
    /// made up.
    ///
    /// # Errors
    /// [`SensorError`] with channel, field, number and range.
    pub fn new(
        description: &SensorDescription,
        sample_time_s: f64,
        seed: u64,
        channel: &str,
    ) -> Result<Self, SensorError> {
        if !(sample_time_s > 0.0 && sample_time_s <= 10.0) {
            return Err(SensorError::SampleTime {
                value: sample_time_s,
            });
        }
        description.check(channel)?;
        let delay = description.delay_samples(sample_time_s, channel)?;
        let drop_out = description.drop_out_chances(sample_time_s, channel)?;
        // Exact for a quantity that stands still between samples.
        let lag_share = description
            .bandwidth_hz
            .map(|corner_hz| -(-std::f64::consts::TAU * corner_hz * sample_time_s).exp_m1());
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&name_hash(channel).to_le_bytes());
        let state = State::new(key, vec![0.0; delay]);
        Ok(Self {
            description: *description,
            lag_share,
            drop_out,
            key,
            state,
        })
    }

    /// Measures `value`: one call per sample.
    ///
    /// Before the first sample the quantity is taken to have stood still at its first value, for lag
    /// and delay.
    pub fn measure(&mut self, value: f64) -> Measurement {
        let (description, state) = (&self.description, &mut self.state);
        let mut reading = value;
        if let Some(share) = self.lag_share {
            // What is not a number passes through and is not remembered.
            if reading.is_finite() {
                let lagged = state.lagged.get_or_insert(reading);
                *lagged += share * (reading - *lagged);
                reading = *lagged;
            }
        }
        if !state.started {
            state.past.fill(reading);
            state.started = true;
        }
        if !state.past.is_empty() {
            reading = std::mem::replace(&mut state.past[state.oldest], reading);
            state.oldest = (state.oldest + 1) % state.past.len();
        }
        // What is off is skipped: even adding 0 changes a bit of −0.
        if is_on(description.scale_error) {
            reading *= 1.0 + description.scale_error;
        }
        if is_on(description.bias) {
            reading += description.bias;
        }
        if is_on(description.noise_standard_deviation) {
            let normal: f64 = StandardNormal.sample(&mut state.noise);
            reading += description.noise_standard_deviation * normal;
        }
        if is_on(description.quantisation) {
            reading = (reading / description.quantisation).round() * description.quantisation;
        }
        if is_on(description.drop_out_probability) {
            let [begin, end] = self.drop_out;
            // One number per sample, whatever happened before.
            let drawn: f64 = state.losses.random();
            state.losing = if state.losing {
                drawn >= end
            } else {
                drawn < begin
            };
        }
        if state.losing {
            return Measurement {
                value: match description.drop_out_mode {
                    DropOutMode::Nan => f64::NAN,
                    DropOutMode::HoldLast => state.last_reading,
                },
                fresh: false,
            };
        }
        state.last_reading = reading;
        Measurement {
            value: reading,
            fresh: true,
        }
    }

    /// Back to before the first sample: the same values then give the same readings.
    pub fn reset(&mut self) {
        let past = std::mem::take(&mut self.state.past);
        self.state = State::new(self.key, past);
    }
}

impl State {
    fn new(key: [u8; 32], past: Vec<f64>) -> Self {
        let stream = |number| {
            let mut random = ChaCha8Rng::from_seed(key);
            random.set_stream(number);
            random
        };
        Self {
            noise: stream(NOISE_STREAM),
            losses: stream(LOSS_STREAM),
            lagged: None,
            past,
            oldest: 0,
            started: false,
            losing: false,
            last_reading: f64::NAN,
        }
    }
}

fn is_on(setting: f64) -> bool {
    setting != 0.0
}

/// FNV-1a of a name: the same on every platform and release.
pub(super) fn name_hash(name: &str) -> u64 {
    name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}
