//! The ground as data: what the table `[ground]` of a scenario holds.

use serde::{Deserialize, Serialize};

/// A ground along a course. Only the friction is required: with nothing else it is a level plane.
///
/// Stations are distances along the course and offsets are distances from its centre line, positive
/// to the left. Heights add up; friction patches cover each other in the order given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundDescription {
    /// Friction coefficient of the road wherever no patch or split says otherwise (no unit; the
    /// tyre's own factor is in the vehicle file).
    pub friction: f64,
    /// Distance from the start of the course over which roughness and undulation grow from nothing
    /// to their full size, m. Required with either; it lets a vehicle start on level ground.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fade_in_m: Option<f64>,
    /// Cross slope along the course. One point is a uniform bank.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bank: Vec<BankPoint>,
    /// Random unevenness by ISO 8608.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Roughness>,
    /// Long random waves, whose cross slope banks the vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub undulation: Option<Undulation>,
    /// Single bumps, humps and potholes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bumps: Vec<Bump>,
    /// Friction that differs left and right of the centre line, over the whole course.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split: Option<SplitFriction>,
    /// Patches of another friction, such as ice; they lie upon the split.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub patches: Vec<FrictionPatch>,
    /// Whether the course is the mirror image of the one that all other fields describe: then this is
    /// the mirror image of their ground.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mirrored: bool,
}

/// Cross slope at a station. Between two points it changes smoothly (with continuous curvature);
/// before the first and after the last it stays.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BankPoint {
    /// Station, m.
    pub station_m: f64,
    /// Rise to the left, % (m per 100 m). As the roll angle, it is positive when the right side is
    /// the lower one: a left turn that is banked to help the vehicle has a negative one.
    pub percent: f64,
}

/// Road classes of ISO 8608, each by the geometric mean of its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RoadClass {
    /// Very good: 16e-6 m³.
    A,
    /// Good: 64e-6 m³.
    B,
    /// Average: 256e-6 m³.
    C,
    /// Poor: 1024e-6 m³.
    D,
    /// Very poor: 4096e-6 m³.
    E,
    /// 16384e-6 m³.
    F,
    /// 65536e-6 m³.
    G,
    /// 262144e-6 m³.
    H,
}

impl RoadClass {
    /// Displacement spectral density at 0.1 cycles/m, m³.
    #[must_use]
    pub fn gd_n0_m3(self) -> f64 {
        let exponent = match self {
            Self::A => 0,
            Self::B => 1,
            Self::C => 2,
            Self::D => 3,
            Self::E => 4,
            Self::F => 5,
            Self::G => 6,
            Self::H => 7,
        };
        16e-6 * f64::from(1_u32 << (2 * exponent))
    }
}

/// Isotropic random roughness: along any straight line its displacement spectral density is
/// `Gd(n0) (n/n0)^-2` (ISO 8608 with waviness 2) for spatial frequencies `n` of 0.02 to 1 cycles/m,
/// times the square of the average over the tyre's contact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Roughness {
    /// Road class; give this or [`Roughness::gd_n0_m3`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<RoadClass>,
    /// Displacement spectral density at n0 = 0.1 cycles/m, m³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gd_n0_m3: Option<f64>,
    /// Length of the tyre's contact over which heights are averaged, m; usual are 0.12 to 0.15.
    pub contact_length_m: f64,
    /// Seed.
    pub seed: u64,
}

impl Roughness {
    /// Displacement spectral density at 0.1 cycles/m, m³, from whichever field is given; 0 without.
    #[must_use]
    pub fn level_m3(&self) -> f64 {
        self.gd_n0_m3
            .or(self.class.map(RoadClass::gd_n0_m3))
            .unwrap_or_default()
    }
}

/// Long random waves in all directions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Undulation {
    /// Height, root mean square over the ground (not the peak), m.
    pub height_rms_m: f64,
    /// Shortest wavelength, m.
    pub shortest_m: f64,
    /// Longest wavelength, m.
    pub longest_m: f64,
    /// Seed.
    pub seed: u64,
}

/// A single bump: half a period of a raised cosine along the course, from 0 over its height to 0. Across
/// it is flat and runs out by the same curve: over half its length at either side, or over half its
/// width where that is less.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// Station of its middle, m.
    pub station_m: f64,
    /// Offset of its middle, m.
    pub offset_m: f64,
    /// Length along the course, m.
    pub length_m: f64,
    /// Width across the course, m.
    pub width_m: f64,
    /// Height, m; negative is a pothole.
    pub height_m: f64,
}

/// Friction that differs left and right of the centre line.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SplitFriction {
    /// Friction left of the centre line.
    pub left: f64,
    /// Friction right of the centre line.
    pub right: f64,
    /// Width over which the one becomes the other, m.
    pub edge_m: f64,
}

/// A rectangle along the course of another friction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionPatch {
    /// Station where it begins, m.
    pub from_m: f64,
    /// Station where it ends, m.
    pub to_m: f64,
    /// Offset of its right edge, m.
    pub right_m: f64,
    /// Offset of its left edge, m.
    pub left_m: f64,
    /// Friction on it.
    pub friction: f64,
    /// Width over which friction changes at its edges, half of it inside, m.
    pub edge_m: f64,
}

impl GroundDescription {
    /// Level ground of uniform friction.
    #[must_use]
    pub fn flat(friction: f64) -> Self {
        Self {
            friction,
            fade_in_m: None,
            bank: Vec::new(),
            roughness: None,
            undulation: None,
            bumps: Vec::new(),
            split: None,
            patches: Vec::new(),
            mirrored: false,
        }
    }

    /// The ground with left and right exchanged, for the mirrored course.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self {
            mirrored: !self.mirrored,
            ..self.clone()
        }
    }

    /// Whether it is a level plane of uniform friction.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.bank.is_empty()
            && self.roughness.is_none()
            && self.undulation.is_none()
            && self.bumps.is_empty()
            && self.split.is_none()
            && self.patches.is_empty()
    }
}
