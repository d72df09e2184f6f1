//! The paper's model linearised about straight running.

use nalgebra::{Complex, Matrix4, SMatrix};

use super::constants::Constants;
use super::equations::LEAST_SLIP_SPEED_M_S;
use crate::simulation::{LARGEST_SPEED_M_S, SimulationError};
use crate::units::GRAVITY_M_S2;

/// `ẋ = A x + B u`, `y = C x + D u` about straight running at constant speed: the structure of the
/// paper's model (eq. `lin_model`) in continuous time, with its state `[v, p, r, φ]`.
///
/// Rows and columns are named by [`LinearModel::STATES`], [`LinearModel::INPUTS`] and
/// [`LinearModel::OUTPUTS`]. The speed input has no effect of first order about straight running: its
/// columns are zero, as a turn and its mirror image must answer alike. A controller that is to slow
/// down for a turn cannot learn that from this model.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// Speed about which the model was linearised, m/s.
    pub speed_m_s: f64,
    /// `A`, 4×4, 1/s in units of the states.
    pub a: Matrix4<f64>,
    /// `B`, 4×2.
    pub b: SMatrix<f64, 4, 2>,
    /// `C`, 4×4.
    pub c: Matrix4<f64>,
    /// `D`, 4×2.
    pub d: SMatrix<f64, 4, 2>,
}

impl LinearModel {
    /// Names of the states with their units.
    pub const STATES: [&str; 4] = [
        "lateral_speed_m_s",
        "roll_rate_rad_s",
        "yaw_rate_rad_s",
        "roll_rad",
    ];
    /// Names of the inputs with their units: the handwheel behind the steering actuator, and the
    /// forward speed.
    pub const INPUTS: [&str; 2] = ["handwheel_actual_rad", "forward_speed_m_s"];
    /// Names of the outputs with their units.
    pub const OUTPUTS: [&str; 4] = [
        "yaw_rate_rad_s",
        "lateral_acceleration_m_s2",
        "roll_rad",
        "ltr",
    ];

    /// The four eigenvalues of `A`, 1/s, by falling real part.
    #[must_use]
    pub fn poles(&self) -> [Complex<f64>; 4] {
        let values = self.a.complex_eigenvalues();
        let mut poles = [values[0], values[1], values[2], values[3]];
        poles.sort_by(|x, y| y.re.total_cmp(&x.re).then(y.im.total_cmp(&x.im)));
        poles
    }

    /// Steady outputs per input, 4×2; `None` when `A` is singular. Means something for a stable model
    /// only.
    #[must_use]
    pub fn dc_gain(&self) -> Option<SMatrix<f64, 4, 2>> {
        let states = self.a.lu().solve(&self.b)?;
        Some(self.d - self.c * states)
    }

    /// Complex outputs per input at `frequency_hz`, 4×2: `C (jωI − A)⁻¹ B + D`; `None` at a pole.
    #[must_use]
    pub fn frequency_response(&self, frequency_hz: f64) -> Option<SMatrix<Complex<f64>, 4, 2>> {
        let complex = |value: f64| Complex::new(value, 0.0);
        let omega = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
        let shifted = Matrix4::from_diagonal_element(omega) - self.a.map(complex);
        let states = shifted.lu().solve(&self.b.map(complex))?;
        Some(self.c.map(complex) * states + self.d.map(complex))
    }
}

/// A force as a linear function of the four states and the angle of the front wheels.
type Row = SMatrix<f64, 1, 5>;

/// Linearises about straight running, in closed form.
pub(super) fn linearise(
    constants: &Constants,
    speed_m_s: f64,
) -> Result<LinearModel, SimulationError> {
    if !(LEAST_SLIP_SPEED_M_S..=LARGEST_SPEED_M_S).contains(&speed_m_s) {
        return Err(SimulationError::Initial {
            what: "speed_m_s",
            value: speed_m_s,
            range: "[1, 150] m/s",
        });
    }
    let (m, sprung, arm) = (
        constants.total_kg,
        constants.sprung_kg,
        constants.roll_arm_m,
    );
    let first = sprung * arm;
    let state = |index: usize| {
        let mut row = Row::zeros();
        row[index] = 1.0;
        row
    };
    let (roll_rate, yaw_rate, roll, steer) = (state(1), state(2), state(3), state(4));
    let lateral_n = [0, 1].map(|axle| axle_force(constants, axle, speed_m_s));
    let total_n = lateral_n[0] + lateral_n[1];

    // Fifth equation, then the second and the fourth.
    let inertia =
        constants.sprung_inertia[0] + first * arm * constants.undercarriage_kg / constants.total_kg;
    let roll_acceleration = (total_n * (first / m)
        + roll * (first * GRAVITY_M_S2 - constants.roll_stiffness)
        - roll_rate * constants.roll_damping)
        / inertia;
    let lateral = total_n / m + roll_acceleration * (first / m);
    let yaw_acceleration = (lateral_n[0] * constants.axles[0].ahead_m
        + lateral_n[1] * constants.axles[1].ahead_m
        - roll * (constants.drag_n(speed_m_s) * arm))
        / constants.yaw_inertia;
    let rates = [
        lateral - yaw_rate * speed_m_s,
        roll_acceleration,
        yaw_acceleration,
        roll_rate,
    ];

    let mut ltr = Row::zeros();
    for (axle, force) in constants.axles.iter().zip(lateral_n) {
        let undercarriage = lateral + yaw_acceleration * axle.ahead_m;
        let moment = roll * axle.roll_stiffness
            + roll_rate * axle.roll_damping
            + force * axle.axis_height_m
            + undercarriage * ((axle.unsprung_height_m - axle.axis_height_m) * axle.unsprung_kg);
        ltr += moment * (2.0 / (axle.track_m * m * GRAVITY_M_S2));
    }
    let outputs = [yaw_rate, total_n / m, roll, ltr];

    let per_handwheel = constants.steering.road_wheel_rad(1.0);
    let steer_column = steer.transpose();
    let split = |rows: [Row; 4]| {
        let (mut square, mut input) = (Matrix4::zeros(), SMatrix::<f64, 4, 2>::zeros());
        for (i, row) in rows.iter().enumerate() {
            square.set_row(i, &row.fixed_columns::<4>(0));
            input[(i, 0)] = (row * steer_column)[0] * per_handwheel;
        }
        (square, input)
    };
    let ((a, b), (c, d)) = (split(rates), split(outputs));
    Ok(LinearModel {
        speed_m_s,
        a,
        b,
        c,
        d,
    })
}

/// Lateral force of an axle whose tyres give the force that holds the speed.
fn axle_force(constants: &Constants, index: usize, speed_m_s: f64) -> Row {
    let axle = &constants.axles[index];
    let drag = constants.drag_n(speed_m_s);
    let shift = 0.5 * drag * constants.sprung_cg_height_m / constants.wheelbase_m;
    let load = axle.static_load_n + if index == 0 { -shift } else { shift };
    let wheel_n = constants.drive_share(index) * drag;
    let ratio = constants.slip_ratio(index, load, wheel_n);
    let along_n = axle.tyre.force_n(load, constants.friction, [ratio, 0.0])[0];
    // Force and slip point the same way, so the lateral stiffness is the secant of the total one.
    let stiffness = if ratio == 0.0 {
        axle.tyre.stiffness_n(load, constants.friction)
    } else {
        along_n / ratio
    };
    let stiffness = 2.0 * stiffness;
    let steered = if index == 0 {
        stiffness + 2.0 * along_n
    } else {
        0.0
    };
    Row::new(
        -stiffness / speed_m_s,
        0.0,
        -stiffness * axle.ahead_m / speed_m_s,
        0.0,
        steered,
    )
}
