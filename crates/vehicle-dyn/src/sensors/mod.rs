//! What a sensor makes of a measured quantity: lag, delay, scale error, bias, noise, quantisation,
//! drop-outs.
//!
//! The effects come in the order in which the signal meets them:
//!
//! ```text
//! value → lag → delay → (1 + scale error) · + bias → + noise → quantisation → drop-out → measurement
//! ```
//!
//! What is not asked for is not there: a sensor with [`SensorDescription::default`] hands on the very
//! bits it was given. [`Sensor`] measures one quantity, [`Sensors`] the channels of a vehicle.
//!
//! Every channel has random numbers of its own, made from the seed and the channel's name. They do not change
//! when another channel is added, nor noise when drop-outs are turned on.

mod channel;
mod description;
mod sensor;

pub use channel::{Channel, Sensors, derived_seed};
pub use description::{DropOutMode, SensorDescription, SensorError};
pub use sensor::{Measurement, Sensor};
