//! One wheel on its local ground plane: contact point, load, slip and spin.
//!
//! The wheel is a torus of outer radius `R0` whose tread has the crown radius `r_c` across: a thin
//! disc for `r_c = 0`, which stands on its lower edge when it leans. The contact point is the torus's
//! lowest one, so a lean by `γ` moves it sideways by about `(R0 − r_c) sin γ`; the lateral force moves
//! it further by the tyre's compliance. Twin tyres are two such wheels that share spin and slip.

use nalgebra::Vector3;

use crate::terrain::Ground;
use crate::tyre::{MagicFormula, RadialSpring};

/// Cosine of the largest camber at which a disc still stands on its edge.
const LEAST_COS_CAMBER: f64 = 0.1;
/// 1/largest relaxed slip: sliding straight sideways counts as a slip of 10, not as an infinite one.
const SLIP_PER_LARGEST: f64 = 0.1;
/// Rate at which the slip of a wheel off the ground fades, 1/s. Relaxed slip is the bending of the
/// tyre's carcass by the force in its contact patch. Without a patch it springs back, as fast as a
/// carcass swings; a time constant of 10 ms is an estimate.
const UNLOADED_RELEASE_PER_S: f64 = 100.0;
/// 1/speed of the tread over which rolling resistance fades to zero at standstill, s/m.
const ROLLING_FADE_S_PER_M: f64 = 10.0;

/// Constants of one wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct Wheel {
    /// Tyre force law.
    pub formula: MagicFormula,
    /// Radial spring and damper of the tyre.
    pub radial: RadialSpring,
    /// Unloaded radius, m.
    pub radius_m: f64,
    /// Radius of the tread across the wheel, m; 0 is a thin disc.
    pub crown_radius_m: f64,
    /// Half the distance between the middles of twin tyres, m; 0 for a single tyre. Stiffness,
    /// damping and force law are those of both together.
    pub half_twin_spacing_m: f64,
    /// Sideways motion of the contact patch against the wheel per lateral force, m/N.
    pub lateral_compliance_m_per_n: f64,
    /// Side slip per rad of camber (no unit).
    pub camber_thrust_ratio: f64,
    /// 1/relaxation length, `[longitudinal, lateral]`, 1/m.
    pub inverse_relaxation: [f64; 2],
    /// Rolling resistance coefficient (no unit).
    pub rolling_resistance: f64,
    /// 1/inertia against spinning up, 1/(kg m²).
    pub inverse_spin_inertia: f64,
    /// Inertia of the bare wheel, kg m².
    pub gyroscopic_inertia: f64,
}

/// Motion of one wheel in body axes; the origin of positions is the sprung CG.
#[derive(Debug, Clone, Copy)]
pub struct WheelMotion {
    /// Unit spin axis, pointing left.
    pub axis: Vector3<f64>,
    /// Velocity of the wheel centre, m/s.
    pub velocity_m_s: Vector3<f64>,
    /// Angular rate of the body, rad/s.
    pub angular_rad_s: Vector3<f64>,
    /// Rate of the wheel's lean against the body, as a tangent, 1/s.
    pub lean_rate_per_s: f64,
    /// Turning of the wheel carrier against the body per lean (no unit).
    pub turn_per_lean: Vector3<f64>,
    /// Sideways speed of the contact point against the body by the links' guidance, positive to the
    /// left, m/s.
    pub scrub_m_s: f64,
    /// Height of the wheel centre above the ground plane along its normal, m.
    pub height_m: f64,
    /// Unit normal of the ground plane.
    pub normal: Vector3<f64>,
    /// Wheel spin about its axis, rad/s.
    pub spin_rad_s: f64,
    /// Relaxed slip `[s_x, s_y]` (no unit).
    pub slip: [f64; 2],
}

/// What the ground does to one wheel.
#[derive(Debug, Clone, Copy, Default)]
pub struct Contact {
    /// Load along the ground normal, N.
    pub load_n: f64,
    /// How many of the wheel's tyres carry load.
    pub tyres_down: u8,
    /// Radial compression of the tyre, m; negative is the gap under a lifted wheel. Of twin tyres
    /// the larger one.
    pub deflection_m: f64,
    /// Gap between the tyre's lowest point and the ground along the ground's normal, m; zero for a
    /// wheel on the ground.
    pub clearance_m: f64,
    /// Energy stored in the tyre's radial spring, J.
    pub elastic_j: f64,
    /// Force on the wheel in body axes, N.
    pub force_n: Vector3<f64>,
    /// The part of [`Contact::force_n`] in the ground plane, N.
    pub tangential_n: Vector3<f64>,
    /// Moment of the force about the wheel centre in body axes, N m.
    pub moment_nm: Vector3<f64>,
    /// Rate of the relaxed slip, 1/s. A wheel without load loses its slip.
    pub slip_rate: [f64; 2],
    /// Moment of the ground about the spin axis, N m.
    pub spin_moment_nm: f64,
    /// Work of the load per lean of the wheel, N m.
    pub lean_moment_nm: f64,
}

impl Wheel {
    /// Forces of the ground on a wheel that moves as `motion` over `ground`.
    #[must_use]
    #[inline]
    pub fn contact(&self, motion: &WheelMotion, ground: &Ground) -> Contact {
        if self.half_twin_spacing_m > 0.0 {
            self.twin_contact(motion, ground)
        } else {
            self.tyre_contact(motion, ground, 1.0)
        }
    }

    /// Two tyres on one wheel: they share spin and slip, each has its own load.
    fn twin_contact(&self, motion: &WheelMotion, ground: &Ground) -> Contact {
        let axis_rate = motion.turn_per_lean.cross(&motion.axis) * motion.lean_rate_per_s;
        let tyre = |offset_m: f64| {
            let beside = motion.axis * offset_m;
            let moved = WheelMotion {
                velocity_m_s: motion.velocity_m_s
                    + motion.angular_rad_s.cross(&beside)
                    + axis_rate * offset_m,
                height_m: motion.height_m + beside.dot(&motion.normal),
                ..*motion
            };
            let mut contact = self.tyre_contact(&moved, ground, 0.5);
            contact.moment_nm += beside.cross(&contact.force_n);
            // The tyre's centre rises with the lean by its distance from the wheel's centre.
            contact.lean_moment_nm +=
                contact.load_n * motion.turn_per_lean.cross(&beside).dot(&motion.normal);
            contact
        };
        let [one, other] = [
            tyre(self.half_twin_spacing_m),
            tyre(-self.half_twin_spacing_m),
        ];
        // By load, so that the wheel's slip follows the tyre that stays down without a jump.
        let load = one.load_n + other.load_n;
        let slip_rate = if load > 0.0 {
            [0, 1]
                .map(|i| (one.load_n * one.slip_rate[i] + other.load_n * other.slip_rate[i]) / load)
        } else {
            one.slip_rate
        };
        Contact {
            load_n: load,
            tyres_down: one.tyres_down + other.tyres_down,
            deflection_m: one.deflection_m.max(other.deflection_m),
            clearance_m: one.clearance_m.min(other.clearance_m),
            elastic_j: one.elastic_j + other.elastic_j,
            force_n: one.force_n + other.force_n,
            tangential_n: one.tangential_n + other.tangential_n,
            moment_nm: one.moment_nm + other.moment_nm,
            slip_rate,
            spin_moment_nm: one.spin_moment_nm + other.spin_moment_nm,
            lean_moment_nm: one.lean_moment_nm + other.lean_moment_nm,
        }
    }

    /// One tyre that has `share` of the wheel's stiffness and force: 1, or ½ of a twin.
    #[inline]
    fn tyre_contact(&self, motion: &WheelMotion, ground: &Ground, share: f64) -> Contact {
        let normal = motion.normal;
        let forward = motion.axis.cross(&normal);
        let cos_camber = forward.norm().max(LEAST_COS_CAMBER);
        let inverse_cos = 1.0 / cos_camber;
        let sin_camber = motion.axis.dot(&normal);
        let forward = forward * inverse_cos;
        let left = normal.cross(&forward);

        // A round tread is a thin disc, smaller by its radius, on a ground higher by its radius.
        let distance = (motion.height_m - self.crown_radius_m) * inverse_cos;
        let arm = (motion.axis * sin_camber - normal) * (inverse_cos * distance)
            - normal * self.crown_radius_m;
        let deflection = (self.radius_m - self.crown_radius_m) - distance;
        let contact_velocity = motion.velocity_m_s + motion.angular_rad_s.cross(&arm);
        // Rise of the contact point along the normal per lean of the wheel.
        let rise_per_lean = arm.cross(&normal).dot(&motion.turn_per_lean);
        let closing_speed = -contact_velocity.dot(&normal) - rise_per_lean * motion.lean_rate_per_s;
        let load = share * self.radial.load_n(deflection, closing_speed, inverse_cos);

        // The wheel turns under its carrier, so the carrier's pitch does not move the tread: the
        // longitudinal slip speed is that of the wheel centre, the lateral one of the contact.
        let rolling_radius = self.rolling_radius_m(deflection);
        let tread_speed = motion.spin_rad_s * rolling_radius;
        let speed = motion.velocity_m_s.dot(&forward);
        // Only across the wheel: the part along a steered wheel, `scrub * forward.y`, is left out.
        let lateral_speed = contact_velocity.dot(&left) + motion.scrub_m_s * left.y;
        let slip_speed = [tread_speed - speed, -lateral_speed];
        let slide_squared = slip_speed[0] * slip_speed[0] + slip_speed[1] * slip_speed[1];
        // Rolling is the rule, and needs no root.
        let transport = if speed * speed >= SLIP_PER_LARGEST * SLIP_PER_LARGEST * slide_squared {
            speed.abs()
        } else {
            slide_squared.sqrt() * SLIP_PER_LARGEST
        };
        let slip_rate = if load > 0.0 {
            [
                (slip_speed[0] - transport * motion.slip[0]) * self.inverse_relaxation[0],
                (slip_speed[1] - transport * motion.slip[1]) * self.inverse_relaxation[1],
            ]
        } else {
            motion.slip.map(|slip| -UNLOADED_RELEASE_PER_S * slip)
        };

        let slip = [
            motion.slip[0],
            motion.slip[1] - self.camber_thrust_ratio * sin_camber,
        ];
        // The force law is the wheel's: a twin tyre gives its share of what a wheel would give
        // whose tyres all stood as this one.
        let wheel_force = self.formula.force_n(load / share, ground.friction, slip);
        let [longitudinal, lateral] = [share * wheel_force[0], share * wheel_force[1]];
        let tangential = forward * longitudinal + left * lateral;
        let force = tangential + normal * load;
        let patch = arm + left * (self.lateral_compliance_m_per_n * wheel_force[1]);
        let rolling = self.rolling_resistance
            * load
            * rolling_radius
            * (tread_speed * ROLLING_FADE_S_PER_M).clamp(-1.0, 1.0);
        Contact {
            load_n: load,
            tyres_down: u8::from(load > 0.0),
            deflection_m: deflection,
            clearance_m: (-deflection).max(0.0) * cos_camber,
            elastic_j: share * self.radial.energy_j(deflection),
            force_n: force,
            tangential_n: tangential,
            moment_nm: patch.cross(&force),
            slip_rate,
            spin_moment_nm: -longitudinal * rolling_radius - rolling,
            // The load acts where the patch is, not where a rigid tyre would have it.
            lean_moment_nm: load * patch.cross(&normal).dot(&motion.turn_per_lean),
        }
    }

    /// Effective rolling radius, m: a radial tyre's tread keeps most of its length when pressed in,
    /// so it is `R0 − ρ/3` rather than the loaded radius.
    #[must_use]
    #[inline]
    pub fn rolling_radius_m(&self, deflection_m: f64) -> f64 {
        self.radius_m - deflection_m.max(0.0) * (1.0 / 3.0)
    }
}

/// Spin axis in body axes of a wheel steered by an angle, given as `[sin, cos]`, and leaning about
/// its own forward axis by an angle of tangent `lean`; then the derivatives of the axis by the
/// steering angle and by `lean`.
#[must_use]
#[inline]
pub fn spin_axis(steer: [f64; 2], lean: f64) -> [Vector3<f64>; 3] {
    let [sin, cos] = steer;
    // The tangent needs no trigonometry: leans are small, and this runs 16000 times a second.
    let cos_lean = 1.0 / (1.0 + lean * lean).sqrt();
    let sin_lean = lean * cos_lean;
    let cos_squared = cos_lean * cos_lean;
    [
        Vector3::new(-sin * cos_lean, cos * cos_lean, sin_lean),
        Vector3::new(-cos * cos_lean, -sin * cos_lean, 0.0),
        Vector3::new(sin * sin_lean, -cos * sin_lean, cos_lean) * cos_squared,
    ]
}
