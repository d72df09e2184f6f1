//! Load transfer: from wheel loads, from lateral acceleration, from roll angle and roll rate.

use serde::Serialize;

use crate::parameters::{SolidAxleParameters, VehicleParameters};
use crate::units::GRAVITY_M_S2;

/// The paper's load transfer ratio `(Fz,R − Fz,L)/(m g)` (eq. 2) of loads front left, front right,
/// rear left, rear right in N. Positive in a left turn; beyond ±1 in dynamic lift and on landing.
#[must_use]
pub fn load_transfer_ratio(loads_n: &[f64; 4], total_mass_kg: f64) -> f64 {
    right_minus_left(loads_n) / (total_mass_kg * GRAVITY_M_S2)
}

/// `(Fz,R − Fz,L)/ΣFz`, in [−1, 1]; zero in flight.
#[must_use]
pub fn load_transfer_of_sum(loads_n: &[f64; 4]) -> f64 {
    let sum = (loads_n[0] + loads_n[1]) + (loads_n[2] + loads_n[3]);
    if sum > 0.0 {
        right_minus_left(loads_n) / sum
    } else {
        0.0
    }
}

fn right_minus_left(loads_n: &[f64; 4]) -> f64 {
    (loads_n[1] - loads_n[0]) + (loads_n[3] - loads_n[2])
}

/// The paper's quasi-static load transfer from lateral acceleration (its eq. 1 put into eq. 2):
/// `LTR = 2 h a_y/(g T)`.
///
/// It assumes a rigid vehicle in steady cornering on level ground: no roll, which would carry the
/// centre of gravity outwards, no roll inertia, one track for both axles (their mean), and wheels that
/// stay on the ground. Then `m a_y h + Fz,L T − m g T/2 = 0` about the right contact, positive
/// in a left turn. As printed, eq. 1 lacks the height `h` of the centre of gravity, without which
/// its terms do not have the same unit, and it names the lateral acceleration `v̇_y`, which is zero in steady
/// cornering; `a_y = v̇_y + v_x r` is meant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct QuasiStaticTransfer {
    /// `2 h/(g T)`: load transfer ratio per lateral acceleration, s²/m. 1 over it is the lateral
    /// acceleration at lift-off, `g` times the static stability factor.
    pub per_m_s2: f64,
}

impl QuasiStaticTransfer {
    /// Of a vehicle, from its static stability factor `T/(2 h)`.
    #[must_use]
    pub fn new(vehicle: &VehicleParameters) -> Self {
        Self {
            per_m_s2: 1.0 / (vehicle.derived().static_stability_factor * GRAVITY_M_S2),
        }
    }

    /// Load transfer ratio (no unit) at a lateral acceleration in m/s², positive to the left.
    #[must_use]
    pub fn ltr(&self, lateral_acceleration_m_s2: f64) -> f64 {
        self.per_m_s2 * lateral_acceleration_m_s2
    }
}

/// The load-transfer index from roll motion: what the suspension carries from one side to the other.
///
/// Per axle with track `T`, the loads right minus left are `2/T` times what springs, anti-roll bar,
/// dampers and links carry: `K φ_s + C φ̇_s + h_rc F_y`, with roll stiffness `K`, roll damping `C`, the
/// roll `φ_s` of the body against the axle, and roll-centre height `h_rc`. The roll angle `φ` of the
/// body also holds the tyres' part. They are a spring of `K_t = k_t T²/2` in series, so that
/// a share `s = K_t/(K + K_t)` remains:
///
/// ```text
/// index = (1 + φ a_y/g) Σ_axles 2 s ((K + K_γ) φ + C φ̇ + h_rc m_axle a_y)/(T m g)
/// K   = 2 k (b/2)² + K_antiroll,   C = (c_bump + c_rebound) (d/2)²
/// K_γ = (T/2) m_axle g R γ' (1 − s γ' T/2)
/// ```
///
/// `b` and `d` are the distances between springs and between dampers: the track for independent
/// wheels, less on a solid axle. `K_antiroll` may be negative. In roll one side is in bump and
/// the other in rebound, so both dampings add up. `F_y = m_axle a_y` with the mass that stands on
/// the axle. `K_γ` comes from wheels of loaded radius `R` that lean by `γ'` per travel: their
/// contacts move sideways, and the load turns them on. The factor in front is the part of the lateral
/// forces along the struts of a leaning body; the outer wheels have more of it.
///
/// This is the `LTR_d` of Solmaz, Corless, Shorten 2007, `2 (k φ + c φ̇)/(m g T)`, for two axles
/// with roll centres and tyres. It follows the load transfer ratio up to lift-off, as long as no
/// stop is in contact, and grows with the roll angle beyond, where the
/// loads cannot tell any more how far the vehicle has tipped. Left out: inertia of the unsprung
/// masses, stops, twin tyres on a wheel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LoadTransferIndex {
    /// Index per roll angle without the leading factor, 1/rad; so are the next two.
    pub per_roll_rad: f64,
    /// Index per roll rate, s/rad.
    pub per_roll_rate_rad_s: f64,
    /// Index per lateral acceleration, s²/m: what the links carry past the springs.
    pub per_lateral_acceleration_m_s2: f64,
    /// Roll angle per lateral acceleration in steady cornering, rad s²/m.
    pub roll_gradient_rad_per_m_s2: f64,
    /// Lateral acceleration at which a rigid vehicle lifts off, m/s²: `g` times the static stability
    /// factor.
    pub rigid_lift_off_m_s2: f64,
}

impl LoadTransferIndex {
    /// Of a checked vehicle.
    #[must_use]
    pub fn new(vehicle: &VehicleParameters) -> Self {
        let figures = vehicle.derived();
        let weight_n = figures.total_mass_kg * GRAVITY_M_S2;
        let axles = [Axle::front(vehicle), Axle::rear(vehicle)];
        let sum = |moment: fn(&Axle) -> f64| {
            let of = |axle: &Axle| 2.0 * moment(axle) / (axle.track_m * weight_n);
            of(&axles[0]) + of(&axles[1])
        };
        // Steady cornering, moments about the ground: what the axles carry is m a_y h and the weight
        // times the shift of the centre of gravity over the contacts.
        let carried = axles[0].roll_stiffness() + axles[1].roll_stiffness();
        let by_links = axles[0].link_moment() + axles[1].link_moment();
        let contact_shift_m = axles[0].contact_shift() + axles[1].contact_shift();
        let shift_m_per_rad = figures.cg_height_m - contact_shift_m / weight_n;
        let overturning = figures.total_mass_kg * figures.cg_height_m - by_links;
        Self {
            per_roll_rad: sum(Axle::roll_stiffness),
            per_roll_rate_rad_s: sum(Axle::roll_damping),
            per_lateral_acceleration_m_s2: sum(Axle::link_moment),
            roll_gradient_rad_per_m_s2: overturning / (carried - weight_n * shift_m_per_rad),
            rigid_lift_off_m_s2: figures.static_stability_factor * GRAVITY_M_S2,
        }
    }

    /// The index (no unit) from roll angle (rad, right side down positive), its rate (rad/s) and
    /// lateral acceleration (m/s², to the left).
    ///
    /// On a banked road take the roll against the road, and the acceleration an accelerometer reads
    /// along the road.
    #[must_use]
    pub fn index(
        &self,
        roll_rad: f64,
        roll_rate_rad_s: f64,
        lateral_acceleration_m_s2: f64,
    ) -> f64 {
        let carried = self.per_roll_rad * roll_rad
            + self.per_roll_rate_rad_s * roll_rate_rad_s
            + self.per_lateral_acceleration_m_s2 * lateral_acceleration_m_s2;
        carried * (1.0 + roll_rad * lateral_acceleration_m_s2 / GRAVITY_M_S2)
    }

    /// The index from roll angle and rate alone: the lateral acceleration is taken to be that of
    /// steady cornering at this roll angle, but no more than lifts a rigid vehicle off. For vehicles
    /// without an accelerometer; worse in fast manoeuvres, where the roll angle follows the
    /// acceleration late.
    #[must_use]
    pub fn index_of_roll(&self, roll_rad: f64, roll_rate_rad_s: f64) -> f64 {
        let steady = roll_rad / self.roll_gradient_rad_per_m_s2;
        let most = self.rigid_lift_off_m_s2;
        self.index(roll_rad, roll_rate_rad_s, steady.clamp(-most, most))
    }
}

/// What the index needs of one axle.
struct Axle {
    track_m: f64,
    /// Of springs and anti-roll bar, N m/rad.
    suspension_nm_per_rad: f64,
    /// Of the tyres, N m/rad.
    tyres_nm_per_rad: f64,
    damping_nm_s_per_rad: f64,
    roll_centre_m: f64,
    load_n: f64,
    loaded_radius_m: f64,
    /// Lean of the wheels per roll against the axle (no unit).
    lean_per_roll: f64,
}

impl Axle {
    fn front(vehicle: &VehicleParameters) -> Self {
        let (suspension, geometry) = (&vehicle.suspension, &vehicle.geometry);
        Self::new(
            vehicle,
            [geometry.track_front_m, geometry.roll_centre_height_front_m],
            suspension.spring_rate_front_n_per_m,
            suspension.anti_roll_front_nm_per_rad,
            suspension.damping_bump_front_n_s_per_m + suspension.damping_rebound_front_n_s_per_m,
            suspension.solid_axle_front.as_ref(),
            [
                vehicle.tyre.vertical_stiffness_front_n_per_m,
                vehicle.derived().static_load_front_n,
                suspension.camber_gain_front_rad_per_m,
            ],
        )
    }

    fn rear(vehicle: &VehicleParameters) -> Self {
        let (suspension, geometry) = (&vehicle.suspension, &vehicle.geometry);
        Self::new(
            vehicle,
            [geometry.track_rear_m, geometry.roll_centre_height_rear_m],
            suspension.spring_rate_rear_n_per_m,
            suspension.anti_roll_rear_nm_per_rad,
            suspension.damping_bump_rear_n_s_per_m + suspension.damping_rebound_rear_n_s_per_m,
            suspension.solid_axle_rear.as_ref(),
            [
                vehicle.tyre.vertical_stiffness_rear_n_per_m,
                vehicle.derived().static_load_rear_n,
                suspension.camber_gain_rear_rad_per_m,
            ],
        )
    }

    fn new(
        vehicle: &VehicleParameters,
        [track_m, roll_centre_m]: [f64; 2],
        spring_n_per_m: f64,
        anti_roll_nm_per_rad: f64,
        both_dampings_n_s_per_m: f64,
        solid: Option<&SolidAxleParameters>,
        [tyre_n_per_m, wheel_load_n, camber_gain_rad_per_m]: [f64; 3],
    ) -> Self {
        let springs_m = solid.map_or(track_m, |axle| axle.spring_spacing_m);
        let dampers_m = solid.map_or(track_m, |axle| axle.damper_spacing_m);
        let loaded_radius_m = vehicle.tyre.unloaded_radius_m - wheel_load_n / tyre_n_per_m;
        Self {
            track_m,
            suspension_nm_per_rad: 0.5 * spring_n_per_m * springs_m * springs_m
                + anti_roll_nm_per_rad,
            tyres_nm_per_rad: 0.5 * tyre_n_per_m * track_m * track_m,
            damping_nm_s_per_rad: 0.25 * both_dampings_n_s_per_m * dampers_m * dampers_m,
            roll_centre_m,
            load_n: 2.0 * wheel_load_n,
            loaded_radius_m,
            lean_per_roll: camber_gain_rad_per_m * 0.5 * track_m,
        }
    }

    /// Share of a roll of the body that is left to the suspension.
    fn share(&self) -> f64 {
        self.tyres_nm_per_rad / (self.tyres_nm_per_rad + self.suspension_nm_per_rad)
    }

    fn roll_stiffness(&self) -> f64 {
        self.share() * (self.suspension_nm_per_rad + self.camber_stiffness())
    }

    /// `K_γ`, N m/rad.
    fn camber_stiffness(&self) -> f64 {
        let against_ground = 1.0 - self.share() * self.lean_per_roll;
        self.load_n * self.loaded_radius_m * self.lean_per_roll * against_ground
    }

    fn roll_damping(&self) -> f64 {
        self.share() * self.damping_nm_s_per_rad
    }

    /// Moment of the links per lateral acceleration, kg m.
    fn link_moment(&self) -> f64 {
        self.share() * self.roll_centre_m * self.load_n / GRAVITY_M_S2
    }

    /// Load times the shift of its contacts under the hubs, N m/rad.
    fn contact_shift(&self) -> f64 {
        self.share() * self.load_n * self.loaded_radius_m * self.lean_per_roll
    }
}
