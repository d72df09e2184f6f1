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
    /// Spring rate at the wheel, or at the spring of a solid axle, N/m.
    pub spring_n_per_m: f64,
    /// Damping in bump, N s/m.
    pub bump_n_s_per_m: f64,
    /// Damping in rebound, N s/m.
    pub rebound_n_s_per_m: f64,
    /// Anti-roll stiffness over track squared: force at the wheels per difference in travel, N/m.
    pub anti_roll_n_per_m: f64,
    /// Travel to the stops, m.
    pub travel_m: f64,
    /// Linear rate of the stops, N/m.
    pub stop_n_per_m: f64,
    /// Progressive rate of the stops, N/m².
    pub stop_n_per_m2: f64,
    /// How the links guide the wheels.
    pub guidance: Guidance,
}

/// How the links of an axle guide its wheels: all of it linear in the travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Guidance {
    /// Each wheel moves by itself.
    Independent {
        /// Roll-centre height over half the track: slope of the links' force, and sideways motion
        /// of the contact point per travel (no unit).
        jacking_slope: f64,
        /// Lean of the wheel's top towards the vehicle per bump, rad/m.
        camber_gain_rad_per_m: f64,
    },
    /// Both wheels sit on one beam that turns about the roll centre and leans with it.
    Solid {
        /// Roll-centre height over the track (no unit).
        jacking_slope: f64,
        /// 1/track, 1/m.
        inverse_track_per_m: f64,
        /// Distance between the springs over the track (no unit).
        spring_share: f64,
        /// Distance between the dampers over the track (no unit).
        damper_share: f64,
    },
}

impl Guidance {
    /// Lean `[left, right]` of the wheels against the body for `travel` in m, as tangents, positive
    /// with the left end of the spin axis up; also lean rates (1/s) for travel rates (m/s).
    #[must_use]
    #[inline]
    pub fn lean(&self, travel: Pair) -> Pair {
        match *self {
            Self::Independent {
                camber_gain_rad_per_m,
                ..
            } => [
                camber_gain_rad_per_m * travel[0],
                -camber_gain_rad_per_m * travel[1],
            ],
            Self::Solid {
                inverse_track_per_m,
                ..
            } => {
                let lean = (travel[0] - travel[1]) * inverse_track_per_m;
                [lean, lean]
            }
        }
    }

    /// Forces `[left, right]` along the travels that do the work of moments about the leans: the
    /// transpose of [`Guidance::lean`].
    #[must_use]
    #[inline]
    pub fn lean_forces_n(&self, moment_nm: Pair) -> Pair {
        match *self {
            Self::Independent {
                camber_gain_rad_per_m,
                ..
            } => [
                camber_gain_rad_per_m * moment_nm[0],
                -camber_gain_rad_per_m * moment_nm[1],
            ],
            Self::Solid {
                inverse_track_per_m,
                ..
            } => {
                let force = (moment_nm[0] + moment_nm[1]) * inverse_track_per_m;
                [force, -force]
            }
        }
    }

    /// Sideways speed `[left, right]` of the contact points against the body, positive to the left,
    /// m/s, for travel rates in m/s.
    #[must_use]
    #[inline]
    pub fn scrub_m_s(&self, rate_m_s: Pair) -> Pair {
        match *self {
            Self::Independent { jacking_slope, .. } => {
                [jacking_slope * rate_m_s[0], -jacking_slope * rate_m_s[1]]
            }
            Self::Solid { jacking_slope, .. } => {
                let scrub = jacking_slope * (rate_m_s[0] - rate_m_s[1]);
                [scrub, scrub]
            }
        }
    }

    /// Forces `[left, right]` of the links along the travels, N, under lateral tyre forces (N,
    /// positive to the left): the transpose of [`Guidance::scrub_m_s`].
    #[must_use]
    #[inline]
    fn jacking_n(&self, lateral_n: Pair) -> Pair {
        match *self {
            Self::Independent { jacking_slope, .. } => {
                [jacking_slope * lateral_n[0], -jacking_slope * lateral_n[1]]
            }
            Self::Solid { jacking_slope, .. } => {
                let force = jacking_slope * (lateral_n[0] + lateral_n[1]);
                [force, -force]
            }
        }
    }
}

/// Motion or, by its transpose, forces of a pair that stands closer (or wider) than the wheels by
/// `share`: the mean stays, the difference is scaled.
#[inline]
fn at_spacing(share: f64, pair: Pair) -> Pair {
    let mean = 0.5 * (pair[0] + pair[1]);
    let half = 0.5 * share * (pair[0] - pair[1]);
    [mean + half, mean - half]
}

impl AxleSuspension {
    /// Forces `[left, right]` on the body, N, from travel (m), travel rate (m/s) and the lateral
    /// force of each tyre in the body frame, positive to the left (N).
    ///
    /// The links carry a lateral force `F_y` towards the roll centre, so they lift the outer side
    /// and pull down the inner side: by `F_y · h_rc/(T/2)` of each wheel's own force, or on a solid axle
    /// by `ΣF_y · h_rc/T` on both sides. The contact point moves sideways with the travel by the same slope
    /// ([`Guidance::scrub_m_s`]), so that the pair of a wheel that points straight ahead does no
    /// work of its own. A wheel steered by `δ` also scrubs along its own direction, which the longitudinal slip leaves out: there the pair takes or gives
    /// `F_x · sin δ · slope · rate`, with the wheel's longitudinal force `F_x`. On the sedan's
    /// courses this moves the load transfer ratio by 2e-6 before wheels lift.
    #[must_use]
    #[inline]
    pub fn forces_n(&self, travel_m: Pair, rate_m_s: Pair, lateral_n: Pair) -> Pair {
        let anti_roll = self.anti_roll_n_per_m * (travel_m[1] - travel_m[0]);
        let jacking = self.guidance.jacking_n(lateral_n);
        let [left, right] = self.springs_and_dampers_n(travel_m, rate_m_s);
        [
            left - anti_roll - jacking[0],
            right + anti_roll - jacking[1],
        ]
    }

    #[inline]
    fn springs_and_dampers_n(&self, travel_m: Pair, rate_m_s: Pair) -> Pair {
        let Guidance::Solid {
            spring_share,
            damper_share,
            ..
        } = self.guidance
        else {
            return [
                self.spring_n(travel_m[0]) + self.damper_n(rate_m_s[0]),
                self.spring_n(travel_m[1]) + self.damper_n(rate_m_s[1]),
            ];
        };
        let springs = at_spacing(spring_share, travel_m).map(|travel| self.spring_n(travel));
        let dampers = at_spacing(damper_share, rate_m_s).map(|rate| self.damper_n(rate));
        let springs = at_spacing(spring_share, springs);
        let dampers = at_spacing(damper_share, dampers);
        [springs[0] + dampers[0], springs[1] + dampers[1]]
    }

    #[inline]
    fn damper_n(&self, rate: f64) -> f64 {
        let damping = if rate > 0.0 {
            self.bump_n_s_per_m
        } else {
            self.rebound_n_s_per_m
        };
        damping * rate
    }

    #[inline]
    fn spring_n(&self, travel: f64) -> f64 {
        self.preload_n + self.spring_n_per_m * travel + self.stop_n(travel)
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
        let [left, right] = match self.guidance {
            Guidance::Independent { .. } => travel_m,
            Guidance::Solid { spring_share, .. } => at_spacing(spring_share, travel_m),
        };
        strut(left) + strut(right) + 0.5 * self.anti_roll_n_per_m * twist * twist
    }
}
