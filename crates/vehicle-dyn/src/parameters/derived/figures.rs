//! The derived figures as a list, each beside what is usual: a wrong unit shows.

use std::fmt;

use serde::Serialize;

use super::{CorneringFigures, Mode, NaturalModes};
use crate::parameters::{DerivedFigures, VehicleParameters};
use crate::units::{DEGREE, GRAVITY_M_S2, KMH};

/// A derived figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit, empty for none.
    pub unit: &'static str,
    /// From where to where road vehicles usually lie, from small cars to trucks; `None` where that
    /// says nothing.
    pub usual: Option<[f64; 2]>,
    /// The parameters to look at first when it is unusual.
    pub from: &'static str,
}

impl Figure {
    /// Whether the value is what road vehicles usually have.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        self.usual
            .is_none_or(|[low, high]| self.value >= low && self.value <= high)
    }
}

impl fmt::Display for Figure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let space = if self.unit.is_empty() { "" } else { " " };
        write!(
            formatter,
            "{}: {:.3}{space}{}",
            self.name, self.value, self.unit
        )
    }
}

const fn figure(
    name: &'static str,
    value: f64,
    unit: &'static str,
    low: f64,
    high: f64,
    from: &'static str,
) -> Figure {
    Figure {
        name,
        value,
        unit,
        usual: Some([low, high]),
        from,
    }
}

impl VehicleParameters {
    /// Every derived figure on a level road of friction `road_friction`, beside the range usual for
    /// road vehicles. The ranges are wide estimates that hold for cars and trucks: a value outside
    /// is no error, but worth a look at its units.
    #[must_use]
    pub fn figures(&self, road_friction: f64) -> Vec<Figure> {
        let figures = self.derived();
        let cornering = self.cornering_figures(road_friction);
        let mut list = self.masses(&figures);
        list.extend(self.inertias(&figures));
        list.extend(stand(&figures, &cornering));
        list.extend(frequencies(&self.natural_modes()));
        list.extend(self.drive(&figures, road_friction));
        list
    }

    fn masses(&self, figures: &DerivedFigures) -> Vec<Figure> {
        let mass = &self.mass;
        let weight = figures.total_mass_kg * GRAVITY_M_S2;
        let pressed_mm = |load: f64, stiffness: f64| load / stiffness * 1e3;
        let tyre = &self.tyre;
        vec![
            figure(
                "total mass",
                figures.total_mass_kg,
                "kg",
                700.0,
                20_000.0,
                "mass",
            ),
            figure(
                "sprung share of the mass",
                mass.sprung_mass_kg / figures.total_mass_kg,
                "",
                0.7,
                0.96,
                "mass.unsprung_mass_*",
            ),
            figure("wheelbase", figures.wheelbase_m, "m", 1.8, 7.5, "geometry"),
            figure(
                "front share of the weight",
                2.0 * figures.static_load_front_n / weight,
                "",
                0.3,
                0.72,
                "geometry.sprung_cg_to_*",
            ),
            figure(
                "load of a front wheel",
                figures.static_load_front_n,
                "N",
                1.5e3,
                4.5e4,
                "mass",
            ),
            figure(
                "load of a rear wheel",
                figures.static_load_rear_n,
                "N",
                1.5e3,
                6.5e4,
                "mass",
            ),
            figure(
                "front tyres pressed in at rest",
                pressed_mm(
                    figures.static_load_front_n,
                    tyre.vertical_stiffness_front_n_per_m,
                ),
                "mm",
                5.0,
                60.0,
                "tyre.vertical_stiffness_front_n_per_m",
            ),
            figure(
                "rear tyres pressed in at rest",
                pressed_mm(
                    figures.static_load_rear_n,
                    tyre.vertical_stiffness_rear_n_per_m,
                ),
                "mm",
                3.0,
                60.0,
                "tyre.vertical_stiffness_rear_n_per_m",
            ),
        ]
    }

    fn inertias(&self, figures: &DerivedFigures) -> Vec<Figure> {
        let mass = &self.mass;
        let front = figures.cg_to_front_axle_m;
        let gyration = |inertia: f64| (inertia / mass.sprung_mass_kg).sqrt();
        let track = 0.5 * (self.geometry.track_front_m + self.geometry.track_rear_m);
        vec![
            figure(
                "height of the centre of gravity",
                figures.cg_height_m,
                "m",
                0.35,
                2.2,
                "mass.sprung_cg_height_m",
            ),
            figure(
                "roll radius of gyration over track",
                gyration(mass.sprung_roll_inertia_kg_m2) / track,
                "",
                0.28,
                0.6,
                "mass.sprung_roll_inertia_kg_m2",
            ),
            figure(
                "pitch radius of gyration over wheelbase",
                gyration(mass.sprung_pitch_inertia_kg_m2) / figures.wheelbase_m,
                "",
                0.35,
                0.65,
                "mass.sprung_pitch_inertia_kg_m2",
            ),
            figure(
                "yaw inertia over mass and axle distances (dynamic index)",
                figures.total_yaw_inertia_kg_m2
                    / (figures.total_mass_kg * front * (figures.wheelbase_m - front)),
                "",
                0.7,
                1.6,
                "mass.sprung_yaw_inertia_kg_m2 (the whole vehicle's?)",
            ),
        ]
    }

    fn drive(&self, figures: &DerivedFigures, road_friction: f64) -> Vec<Figure> {
        let weight = figures.total_mass_kg * GRAVITY_M_S2;
        let powertrain = &self.powertrain;
        let formula = crate::tyre::MagicFormula::new(&self.tyre, 1.0, weight);
        let grip = [figures.static_load_front_n, figures.static_load_rear_n]
            .map(|load| 2.0 * formula.peak_force_n(load, road_friction));
        vec![
            figure(
                "deceleration that the brakes can give",
                powertrain.max_brake_force_n / weight,
                "g",
                0.4,
                1.8,
                "powertrain.max_brake_force_n",
            ),
            figure(
                "deceleration that the tyres can give",
                (grip[0] + grip[1]) / weight,
                "g",
                0.5,
                1.3,
                "tyre.mu_tyre (it is multiplied by the road's friction)",
            ),
            figure(
                "power over mass",
                powertrain.max_power_w / figures.total_mass_kg,
                "W/kg",
                8.0,
                400.0,
                "powertrain.max_power_w",
            ),
            figure(
                "top speed by power",
                self.top_speed_m_s(figures) / KMH,
                "km/h",
                80.0,
                350.0,
                "powertrain.max_power_w, aerodynamics.drag_area_m2",
            ),
            figure(
                "largest angle of the front wheels",
                self.steering.handwheel_limit_deg / self.steering.ratio,
                "deg",
                12.0,
                55.0,
                "steering",
            ),
            figure(
                "radius of the smallest circle",
                figures.wheelbase_m
                    / (self.steering.handwheel_limit_deg / self.steering.ratio * DEGREE).tan(),
                "m",
                2.5,
                16.0,
                "steering",
            ),
        ]
    }

    /// Speed at which power and drive force meet drag and rolling resistance, m/s.
    fn top_speed_m_s(&self, figures: &DerivedFigures) -> f64 {
        let drag = 0.5 * self.aerodynamics.air_density_kg_per_m3 * self.aerodynamics.drag_area_m2;
        let rolling =
            self.tyre.rolling_resistance_coefficient * figures.total_mass_kg * GRAVITY_M_S2;
        let powertrain = &self.powertrain;
        let surplus = |speed: f64| {
            powertrain
                .max_drive_force_n
                .min(powertrain.max_power_w / speed)
                - rolling
                - drag * speed * speed
        };
        let (mut low, mut high) = (0.0, 1e4);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if surplus(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

fn stand(figures: &DerivedFigures, cornering: &CorneringFigures) -> Vec<Figure> {
    let (front, rear) = (
        figures.roll_stiffness_front_nm_per_rad,
        figures.roll_stiffness_rear_nm_per_rad,
    );
    let mut list = vec![
        figure(
            "static stability factor",
            figures.static_stability_factor,
            "",
            0.7,
            1.8,
            "geometry.track_*, mass.sprung_cg_height_m",
        ),
        figure(
            "lift-off at a lateral acceleration of",
            cornering.lift_off_g,
            "g",
            0.4,
            1.6,
            "geometry.track_*, mass.sprung_cg_height_m",
        ),
        figure(
            "grip when all load is on the outer wheels",
            cornering.grip_on_two_wheels_g,
            "g",
            0.35,
            1.2,
            "tyre.mu_tyre, tyre.q_load",
        ),
        figure(
            "load transfer ratio",
            cornering.ltr_per_g,
            "1/g",
            0.55,
            1.7,
            "geometry.track_*, mass.sprung_cg_height_m",
        ),
        figure(
            "roll gradient",
            cornering.roll_gradient_deg_per_g,
            "deg/g",
            1.0,
            12.0,
            "suspension.spring_rate_*, suspension.anti_roll_*",
        ),
        figure(
            "front share of the suspension's roll stiffness",
            front / (front + rear),
            "",
            0.15,
            0.85,
            "suspension.anti_roll_*",
        ),
        figure(
            "front share of the load transfer",
            cornering.load_transfer_share_front,
            "",
            0.3,
            0.8,
            "suspension.anti_roll_*, geometry.roll_centre_height_*",
        ),
        figure(
            "understeer gradient",
            cornering.understeer_gradient_deg_per_g,
            "deg/g",
            -0.5,
            6.0,
            "tyre.stiffness_factor_b1_*",
        ),
    ];
    let speeds = [
        (
            "characteristic speed",
            cornering.characteristic_speed_m_s,
            60.0,
        ),
        ("critical speed", cornering.critical_speed_m_s, 150.0),
    ];
    for (name, speed, least) in speeds {
        if let Some(speed) = speed {
            let value = speed / KMH;
            list.push(figure(
                name,
                value,
                "km/h",
                least,
                f64::INFINITY,
                "tyre.stiffness_factor_b1_*",
            ));
        }
    }
    list
}

fn frequencies(modes: &NaturalModes) -> Vec<Figure> {
    let pair = |names: [&'static str; 2], mode: Mode, hertz: [f64; 2], ratio: [f64; 2], from| {
        let [frequency, damping] = names;
        let [springs, dampers] = from;
        [
            figure(
                frequency,
                mode.frequency_hz,
                "Hz",
                hertz[0],
                hertz[1],
                springs,
            ),
            figure(damping, mode.damping_ratio, "", ratio[0], ratio[1], dampers),
        ]
    };
    let body = [
        "suspension.spring_rate_*, mass.sprung_*",
        "suspension.damping_*",
    ];
    let wheel = [
        "tyre.vertical_stiffness_*, mass.unsprung_*",
        "suspension.damping_*",
    ];
    let (swing, hop) = ([0.1, 0.9], [0.05, 0.9]);
    [
        pair(
            ["heave frequency", "heave damping ratio"],
            modes.heave,
            [0.8, 4.0],
            swing,
            body,
        ),
        pair(
            ["pitch frequency", "pitch damping ratio"],
            modes.pitch,
            [0.8, 5.0],
            swing,
            body,
        ),
        pair(
            ["roll frequency", "roll damping ratio"],
            modes.roll,
            [0.8, 5.0],
            swing,
            body,
        ),
        pair(
            ["front wheel hop frequency", "front wheel hop damping ratio"],
            modes.hop_front,
            [6.0, 20.0],
            hop,
            wheel,
        ),
        pair(
            ["rear wheel hop frequency", "rear wheel hop damping ratio"],
            modes.hop_rear,
            [6.0, 20.0],
            hop,
            wheel,
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}
