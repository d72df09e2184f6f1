//! Suspension of one axle: springs, asymmetric dampers, stops, anti-roll bar, jacking forces.
//!
//! Wheel travel is positive in bump (wheel towards the body) and zero at the design height. The
//! forces push the body up and the wheels down, along the body's vertical axis.

/// A left and a right value of one axle.
pub type Pair = [f64; 2];

/// Constants of one axle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxleSuspension {
    /// Force at the design height: the sprung weight on one wheel, N.
    pub preload_n: f64,
    /// Wheel rate, N/m.
    pub spring_n_per_m: f64,
    /// Damping in bump, N s/m.
    pub bump_n_s_per_m: f64,
    /// Damping in rebound, N s/m.
    pub rebound_n_s_per_m: f64,
    /// Anti-roll stiffness over track squared: force per difference in travel, N/m.
    pub anti_roll_n_per_m: f64,
    /// Travel to the stops, m.
    pub travel_m: f64,
    /// Linear rate of the stops, N/m.
    pub stop_n_per_m: f64,
    /// Progressive rate of the stops, N/m².
    pub stop_n_per_m2: f64,
    /// Roll-centre height over half the track: slope of the links' force (no unit).
    pub jacking_slope: f64,
    /// Lean of the wheel's top towards the vehicle per bump, rad/m.
    pub camber_gain_rad_per_m: f64,
}

impl AxleSuspension {
    /// Forces `[left, right]` on the body, N, from travel (m), travel rate (m/s) and the lateral
    /// force of each tyre in the body frame, positive to the left (N).
    ///
    /// The links carry a lateral force `F_y` towards the roll centre, so they lift the outer side
    /// and pull down the inner side by `F_y · h_rc/(T/2)`: a pair of forces between body and wheel.
    /// The contact point moves sideways with the travel by the same slope
    /// ([`crate::wheels::WheelMotion::scrub_per_travel`]), so that the pair of a wheel that points
    /// straight ahead does no work of its own. A wheel steered by `δ` also scrubs along its own
    /// direction, which the longitudinal slip leaves out: there the pair takes or gives
    /// `F_x · sin δ · slope · rate`, with the wheel's longitudinal force `F_x`. On the sedan's
    /// courses this moves the load transfer ratio by 2e-6 before wheels lift.
    #[must_use]
    pub fn forces_n(&self, travel_m: Pair, rate_m_s: Pair, lateral_n: Pair) -> Pair {
        let anti_roll = self.anti_roll_n_per_m * (travel_m[1] - travel_m[0]);
        [
            self.strut_n(travel_m[0], rate_m_s[0]) - anti_roll - self.jacking_slope * lateral_n[0],
            self.strut_n(travel_m[1], rate_m_s[1]) + anti_roll + self.jacking_slope * lateral_n[1],
        ]
    }

    fn strut_n(&self, travel: f64, rate: f64) -> f64 {
        let damping = if rate > 0.0 {
            self.bump_n_s_per_m
        } else {
            self.rebound_n_s_per_m
        };
        self.preload_n + self.spring_n_per_m * travel + damping * rate + self.stop_n(travel)
    }

    fn stop_n(&self, travel: f64) -> f64 {
        let beyond = travel.abs() - self.travel_m;
        if beyond <= 0.0 {
            return 0.0;
        }
        let force = beyond * (self.stop_n_per_m + self.stop_n_per_m2 * beyond);
        force.copysign(travel)
    }

    /// Stored energy of springs, stops and anti-roll bar, J, with the preload's work counted.
    #[must_use]
    pub fn energy_j(&self, travel_m: Pair) -> f64 {
        let strut = |travel: f64| {
            let beyond = (travel.abs() - self.travel_m).max(0.0);
            self.preload_n * travel
                + 0.5 * self.spring_n_per_m * travel * travel
                + 0.5 * self.stop_n_per_m * beyond * beyond
                + self.stop_n_per_m2 * beyond * beyond * beyond / 3.0
        };
        let twist = travel_m[1] - travel_m[0];
        strut(travel_m[0]) + strut(travel_m[1]) + 0.5 * self.anti_roll_n_per_m * twist * twist
    }
}
