//! The sprung body with four unsprung masses on body-vertical joints, solved in closed form.
//!
//! # Derivation
//! Everything is in body axes at the centre of gravity (CG) of the sprung mass. `a` is the
//! inertial acceleration of that point, `ω` and `α` the angular rate and acceleration. An unsprung
//! point mass `m_i` at `r_i` slides along the body's z axis with speed `w_i`; its acceleration is
//!
//! ```text
//! A_i = a + α × r_i + c_i + ẇ_i e_z,      c_i = ω × (ω × r_i) + 2 w_i ω × e_z
//! ```
//!
//! The strut pushes the body up and the mass down by `P_i` along z. In x and y, and for all
//! moments, the joint is rigid. With contact force `F_i` of moment `N_i` about `r_i`, gravity `g`, and
//! `E = diag(1, 1, 0)`:
//!
//! ```text
//! wheel, z      m_i ẇ_i = F_iz + m_i g_z − P_i − m_i (a + α × r_i + c_i)_z
//! joint         Q_i     = E [F_i + m_i g − m_i (a + α × r_i + c_i)] + P_i e_z
//! body          m_s a   = m_s g + f_x + Σ Q_i
//!               I α     = −ω × I ω + n_x + Σ (r_i × Q_i + N_i)
//! ```
//!
//! (`f_x`, `n_x`: other forces and moments, such as drag and wheel spin.) Putting `Q_i` in gives a
//! symmetric 6×6 system in (a, α) whose z row is decoupled, because z forces reach the body only
//! through the struts. Eliminating `a_x, a_y` leaves a symmetric positive definite 3×3 system:
//!
//! ```text
//! m = m_s + Σ m_i,   s = Σ m_i r_i
//! [I − Σ m_i r̂_i E r̂_i + (1/m) ŝ E ŝ] α = n − (1/m) s × E f
//! ```
//!
//! with `f`, `n` the right-hand sides that remain when `a = α = 0`, and `r̂` the cross matrix.

use nalgebra::{Matrix3, Vector3};

/// What one unsprung mass brings into the solve, in body axes at the sprung CG.
#[derive(Debug, Clone, Copy)]
pub struct HubLoad {
    /// Unsprung mass, kg.
    pub mass_kg: f64,
    /// Position of the wheel centre, m.
    pub position_m: Vector3<f64>,
    /// Speed along body z relative to the body, m/s.
    pub rate_m_s: f64,
    /// Force of the ground, N.
    pub contact_force_n: Vector3<f64>,
    /// Moment of that force about the wheel centre, N m.
    pub contact_moment_nm: Vector3<f64>,
    /// Force of strut and links on the body, up, N.
    pub strut_n: f64,
}

/// Accelerations of the body and of the unsprung masses.
#[derive(Debug, Clone, Copy)]
pub struct Accelerations {
    /// Inertial acceleration of the sprung CG in body axes, m/s².
    pub linear_m_s2: Vector3<f64>,
    /// Angular acceleration in body axes, rad/s².
    pub angular_rad_s2: Vector3<f64>,
    /// Rate of [`HubLoad::rate_m_s`] of each wheel, m/s².
    pub hubs_m_s2: [f64; 4],
}

/// Mass and inertia of the sprung body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SprungBody {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Inertia tensor about the CG, kg m².
    pub inertia_kg_m2: Matrix3<f64>,
}

/// Adds the four corners, left with right first: a mirrored vehicle then gives mirrored bits.
#[inline]
#[must_use]
pub fn sum_corners(values: &[Vector3<f64>; 4]) -> Vector3<f64> {
    (values[0] + values[1]) + (values[2] + values[3])
}

impl SprungBody {
    /// Solves for the accelerations. `force_n` and `moment_nm` act on the body beside the hubs;
    /// `gravity_m_s2` is in body axes.
    #[must_use]
    #[inline]
    pub fn accelerate(
        &self,
        angular_rad_s: Vector3<f64>,
        gravity_m_s2: Vector3<f64>,
        hubs: &[HubLoad; 4],
        force_n: Vector3<f64>,
        moment_nm: Vector3<f64>,
    ) -> Accelerations {
        let omega = angular_rad_s;
        let apparent = |hub: &HubLoad| {
            let coriolis = Vector3::new(omega.y, -omega.x, 0.0) * (2.0 * hub.rate_m_s);
            omega.cross(&omega.cross(&hub.position_m)) + coriolis
        };
        let apparents = [
            apparent(&hubs[0]),
            apparent(&hubs[1]),
            apparent(&hubs[2]),
            apparent(&hubs[3]),
        ];

        let mut forces = [Vector3::zeros(); 4];
        let mut moments = [Vector3::zeros(); 4];
        for (i, hub) in hubs.iter().enumerate() {
            let rigid = hub.contact_force_n + (gravity_m_s2 - apparents[i]) * hub.mass_kg;
            forces[i] = Vector3::new(rigid.x, rigid.y, hub.strut_n);
            moments[i] = hub.position_m.cross(&forces[i]) + hub.contact_moment_nm;
        }
        let force = gravity_m_s2 * self.mass_kg + force_n + sum_corners(&forces);
        let gyroscopic = omega.cross(&(self.inertia_kg_m2 * omega));
        let moment = moment_nm + sum_corners(&moments) - gyroscopic;

        let pair = |i: usize, j: usize| {
            (
                hubs[i].mass_kg + hubs[j].mass_kg,
                hubs[i].position_m * hubs[i].mass_kg + hubs[j].position_m * hubs[j].mass_kg,
            )
        };
        let (front, rear) = (pair(0, 1), pair(2, 3));
        let total_mass = self.mass_kg + front.0 + rear.0;
        let first_moment = front.1 + rear.1;
        let corner = |i: usize| planar_inertia(&hubs[i].position_m, hubs[i].mass_kg);
        let inverse_total = 1.0 / total_mass;
        let inertia = self.inertia_kg_m2 + (corner(0) + corner(1)) + (corner(2) + corner(3))
            - planar_inertia(&first_moment, inverse_total);

        let planar = Vector3::new(force.x, force.y, 0.0) * inverse_total;
        let angular = solve_symmetric(&inertia, &(moment - first_moment.cross(&planar)));
        let shift = angular.cross(&first_moment) * inverse_total;
        let linear = Vector3::new(
            planar.x - shift.x,
            planar.y - shift.y,
            force.z / self.mass_kg,
        );

        let mut hub_accelerations = [0.0; 4];
        for (i, hub) in hubs.iter().enumerate() {
            let carried = linear.z + angular.cross(&hub.position_m).z + apparents[i].z;
            hub_accelerations[i] =
                (hub.contact_force_n.z - hub.strut_n) / hub.mass_kg + gravity_m_s2.z - carried;
        }
        Accelerations {
            linear_m_s2: linear,
            angular_rad_s2: angular,
            hubs_m_s2: hub_accelerations,
        }
    }
}

/// `−m r̂ E r̂` with `E = diag(1, 1, 0)`: inertia of a point that is free along z.
fn planar_inertia(r: &Vector3<f64>, mass: f64) -> Matrix3<f64> {
    let (x, y, z) = (r.x, r.y, r.z);
    Matrix3::new(
        mass * z * z,
        0.0,
        -mass * x * z,
        0.0,
        mass * z * z,
        -mass * y * z,
        -mass * x * z,
        -mass * y * z,
        mass * (x * x + y * y),
    )
}

/// Solves `A x = b` for a symmetric positive definite 3×3 `A` by L D Lᵀ.
fn solve_symmetric(a: &Matrix3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    let inverse_d0 = 1.0 / a[(0, 0)];
    let l10 = a[(1, 0)] * inverse_d0;
    let l20 = a[(2, 0)] * inverse_d0;
    let d1 = a[(1, 1)] - l10 * a[(1, 0)];
    let inverse_d1 = 1.0 / d1;
    let l21 = (a[(2, 1)] - l20 * a[(1, 0)]) * inverse_d1;
    let d2 = a[(2, 2)] - l20 * a[(2, 0)] - l21 * l21 * d1;
    let y1 = b.y - l10 * b.x;
    let y2 = b.z - l20 * b.x - l21 * y1;
    let x2 = y2 / d2;
    let x1 = y1 * inverse_d1 - l21 * x2;
    let x0 = b.x * inverse_d0 - l10 * x1 - l20 * x2;
    Vector3::new(x0, x1, x2)
}
