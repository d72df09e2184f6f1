//! Natural frequencies of body and wheels from the parameters.
//!
//! Small motions about rest of body and wheels, free to slide: `M q̈ + C q̇ + K q = 0`. Motions that are
//! the same left and right (heave, pitch, wheel hop) and motions that are opposite (roll, tramp) do
//! not couple. Frequencies are those without damping (`K v = ω² M v`), damping ratios those of the
//! single mode, `ζ = vᵀC v/(2 ω vᵀM v)`, with the mean of bump and rebound. The equations are those
//! of textbooks on vehicle dynamics (Gillespie 1992, chapter 5) with tyres, the wheels' lean and the
//! pull of gravity included.
//!
//! The vehicle rolls and pitches about its own centre of gravity here. Tyres that grip hold it at the
//! ground instead, which makes roll slower; at driving speed it lies between the two.

use nalgebra::{
    DMatrix, Matrix3, Matrix4, Matrix5, SMatrix, SVector, SymmetricEigen, Vector4, Vector5,
};
use serde::Serialize;

use super::axle::{Axle, Stand, add_square, axles, roll_stiffness};
use crate::parameters::VehicleParameters;
use crate::units::GRAVITY_M_S2;

/// One natural mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mode {
    /// Natural frequency without damping, Hz; 0 when gravity is stronger than the springs.
    pub frequency_hz: f64,
    /// Damping ratio (no unit).
    pub damping_ratio: f64,
}

/// Natural modes of body and wheels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct NaturalModes {
    /// Body up and down.
    pub heave: Mode,
    /// Body nose up and down.
    pub pitch: Mode,
    /// Body from side to side.
    pub roll: Mode,
    /// Both front wheels up and down.
    pub hop_front: Mode,
    /// Both rear wheels up and down.
    pub hop_rear: Mode,
}

impl VehicleParameters {
    /// Natural modes of the vehicle at rest, from a linear model with seven degrees of freedom.
    #[must_use]
    pub fn natural_modes(&self) -> NaturalModes {
        let axles = axles(self, &self.derived());
        let [first, second, third, fourth] = same_left_and_right(self, &axles);
        let by_share = |one: (Mode, Vector4<f64>), other: (Mode, Vector4<f64>), part: usize| {
            if one.1[part] >= other.1[part] {
                (one.0, other.0)
            } else {
                (other.0, one.0)
            }
        };
        let (heave, pitch) = by_share(first, second, 0);
        let (hop_front, hop_rear) = by_share(third, fourth, 2);
        NaturalModes {
            heave,
            pitch,
            roll: roll(self, &axles),
            hop_front,
            hop_rear,
        }
    }
}

/// Modes with the shares of heave, pitch, front and rear travel in their motion, slowest first.
fn same_left_and_right(
    vehicle: &VehicleParameters,
    axles: &[Axle; 2],
) -> [(Mode, Vector4<f64>); 4] {
    let mut inertia = Matrix5::<f64>::zeros();
    let mut stiffness = Matrix4::<f64>::zeros();
    let mut damping = Matrix4::<f64>::zeros();
    // Heave, pitch (nose down), front and rear travel, and the free motion forward.
    let mass = &vehicle.mass;
    inertia[(0, 0)] = mass.sprung_mass_kg;
    inertia[(1, 1)] = mass.sprung_pitch_inertia_kg_m2;
    inertia[(4, 4)] = mass.sprung_mass_kg;
    for (i, axle) in axles.iter().enumerate() {
        let mut up = Vector4::new(1.0, -axle.station_m, 0.0, 0.0);
        up[2 + i] = 1.0;
        let mut travel = Vector4::zeros();
        travel[2 + i] = 1.0;
        let tilt = Vector4::new(0.0, 1.0, 0.0, 0.0);
        let sprung_n = 2.0 * (axle.load_n - axle.unsprung_kg * GRAVITY_M_S2);
        stiffness += up * up.transpose() * (2.0 * axle.tyre_n_per_m)
            + travel * travel.transpose() * (2.0 * axle.spring_n_per_m[0])
            - tilt * tilt.transpose() * (sprung_n * axle.drop_m);
        damping += up * up.transpose() * (2.0 * axle.tyre_n_s_per_m)
            + travel * travel.transpose() * (2.0 * axle.damping_n_s_per_m[0]);
        let vertical = up.push(0.0);
        let forward = (tilt * -axle.drop_m).push(1.0);
        inertia += (vertical * vertical.transpose() + forward * forward.transpose())
            * (2.0 * axle.unsprung_kg);
    }
    let coupling = inertia.fixed_view::<4, 1>(0, 4);
    let free = inertia.fixed_view::<4, 4>(0, 0) - coupling * coupling.transpose() / inertia[(4, 4)];
    let modes = modes(&free, &stiffness, &damping);
    modes.map(|(mode, shape)| {
        let weights = Vector4::from_fn(|row, _| free[(row, row)] * shape[row] * shape[row]);
        (mode, weights / weights.sum())
    })
}

/// The slowest mode that is opposite left and right.
fn roll(vehicle: &VehicleParameters, axles: &[Axle; 2]) -> Mode {
    // Roll, travel front and rear, and the free motions sideways and in yaw.
    let mut inertia = Matrix5::<f64>::zeros();
    let mut damping = Matrix3::zeros();
    let mass = &vehicle.mass;
    inertia[(0, 0)] = mass.sprung_roll_inertia_kg_m2;
    inertia[(3, 3)] = mass.sprung_mass_kg;
    inertia[(4, 4)] = mass.sprung_yaw_inertia_kg_m2;
    inertia[(0, 4)] = -mass.sprung_roll_yaw_product_kg_m2;
    inertia[(4, 0)] = -mass.sprung_roll_yaw_product_kg_m2;
    for (i, axle) in axles.iter().enumerate() {
        let mut vertical = Vector5::zeros();
        vertical[0] = axle.half_track_m;
        vertical[1 + i] = 1.0;
        let sideways = Vector5::new(axle.drop_m, 0.0, 0.0, 1.0, axle.station_m);
        let mut forward = Vector5::zeros();
        forward[4] = axle.half_track_m;
        inertia += (vertical * vertical.transpose()
            + sideways * sideways.transpose()
            + forward * forward.transpose())
            * (2.0 * axle.unsprung_kg);
        let tyres = 2.0 * axle.tyre_n_s_per_m;
        let twins = tyres * axle.half_twin_spacing_m.powi(2);
        let dampers = 2.0 * axle.damping_n_s_per_m[1];
        add_square(&mut damping, tyres, i, [axle.half_track_m, 1.0]);
        add_square(&mut damping, twins, i, [1.0, axle.lean_per_m]);
        add_square(&mut damping, dampers, i, [0.0, 1.0]);
    }
    let coupling = inertia.fixed_view::<3, 2>(0, 3).into_owned();
    let sliding = inertia.fixed_view::<2, 2>(3, 3).into_owned();
    // The inertia matrix of a body is positive definite, so its block is.
    let given = sliding
        .try_inverse()
        .map_or_else(Matrix3::zeros, |inverse| {
            coupling * inverse * coupling.transpose()
        });
    let free = inertia.fixed_view::<3, 3>(0, 0) - given;
    let stiffness = roll_stiffness(axles, [Stand::AT_REST; 2]);
    let [(slowest, _), ..] = modes(&free, &stiffness, &damping);
    slowest
}

/// Natural modes and their shapes (of unit modal mass), slowest first.
fn modes<const N: usize>(
    inertia: &SMatrix<f64, N, N>,
    stiffness: &SMatrix<f64, N, N>,
    damping: &SMatrix<f64, N, N>,
) -> [(Mode, SVector<f64, N>); N] {
    let sized = |matrix: &SMatrix<f64, N, N>| DMatrix::from_fn(N, N, |row, col| matrix[(row, col)]);
    // Positive definite for every vehicle that passed the checks.
    let inverse = sized(inertia)
        .cholesky()
        .and_then(|cholesky| cholesky.l().try_inverse())
        .unwrap_or_else(|| DMatrix::identity(N, N));
    let reduced = &inverse * sized(stiffness) * inverse.transpose();
    let eigen = SymmetricEigen::new((&reduced + reduced.transpose()) * 0.5);
    let shapes = inverse.transpose() * &eigen.eigenvectors;
    let mut found = std::array::from_fn::<_, N, _>(|i| {
        let shape = SVector::<f64, N>::from_fn(|row, _| shapes[(row, i)]);
        let natural = eigen.eigenvalues[i].max(0.0).sqrt();
        let mode = Mode {
            frequency_hz: natural / std::f64::consts::TAU,
            damping_ratio: shape.dot(&(damping * shape)) / (2.0 * natural),
        };
        (mode, shape)
    });
    found.sort_by(|a, b| a.0.frequency_hz.total_cmp(&b.0.frequency_hz));
    found
}
