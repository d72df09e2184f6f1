//! Which plots a scene has, and how its runs look in all of them.

use serde::Serialize;

use super::cast::rank;
use super::data::{Limits, Role, Run, Scene};
use super::measures::CORRECTION;
use super::pack::Thinning;

/// A plot over time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Plot {
    /// File name of the figure after the scene's.
    pub(super) name: &'static str,
    /// Heading.
    pub(super) title: &'static str,
    /// Label of the axis.
    pub(super) axis: &'static str,
    /// The column it shows.
    pub(super) column: &'static str,
    /// A column drawn thinly beside it.
    pub(super) companion: Option<&'static str>,
    /// What thick and thin lines are, and what the limits mean.
    pub(super) caption: &'static str,
    /// The limits drawn.
    pub(super) limits: Limit,
    /// Values that are always in view.
    pub(super) at_least: Option<[f64; 2]>,
    /// Digits after the point of a value beside the cursor.
    pub(super) digits: usize,
}

/// Which of a scene's limits a plot shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Limit {
    None,
    Ltr,
    TargetSpeed,
    SteeringWheel,
    HalfRoad,
}

impl Limit {
    /// Its values in a scene.
    pub(super) fn values(self, scene: &Scene) -> Vec<f64> {
        let Limits {
            ltr,
            target_speed_kmh,
            steering_wheel_deg,
        } = &scene.limits;
        let both = |value: f64| vec![-value, value];
        match self {
            Self::None => Vec::new(),
            Self::Ltr => ltr.map_or_else(Vec::new, both),
            Self::TargetSpeed => target_speed_kmh.map_or_else(Vec::new, Vec::from),
            Self::SteeringWheel => steering_wheel_deg.map_or_else(Vec::new, Vec::from),
            Self::HalfRoad => {
                let road = scene.road.as_ref();
                road.map_or_else(Vec::new, |road| both(0.5 * road.width_m))
            }
        }
    }
}

const fn plot(
    name: &'static str,
    title: &'static str,
    axis: &'static str,
    column: &'static str,
    caption: &'static str,
) -> Plot {
    Plot {
        name,
        title,
        axis,
        column,
        companion: None,
        caption,
        limits: Limit::None,
        at_least: None,
        digits: 2,
    }
}

/// The plots of a scene; those whose column no run has are left out.
pub(super) const PLOTS: [Plot; 9] = [
    Plot {
        limits: Limit::Ltr,
        at_least: Some([-1.1, 1.1]),
        digits: 3,
        ..plot(
            "ltr",
            "Load transfer ratio",
            "LTR",
            "ltr",
            "Left turns positive. At ±1 the wheels of one side carry nothing; beyond, those of the other carry more than the weight, as when the vehicle comes down from two wheels. Dashed: that limit. A cross marks a run that ended in a rollover or a spin.",
        )
    },
    Plot {
        companion: Some("target_speed_kmh"),
        limits: Limit::TargetSpeed,
        ..plot(
            "speed",
            "Speed",
            "km/h",
            "speed_kmh",
            "Speed (thick) and the target speed commanded (thin). Grey lines: what may be commanded.",
        )
    },
    Plot {
        companion: Some("steering_wheel_reference_deg"),
        limits: Limit::SteeringWheel,
        digits: 1,
        ..plot(
            "steering-wheel",
            "Steering wheel",
            "deg",
            "steering_wheel_deg",
            "What was applied (thick) and what the driver asked for (thin).",
        )
    },
    Plot {
        digits: 1,
        ..plot(
            "steering-correction",
            "Steering correction",
            "deg",
            CORRECTION,
            "Applied less what the driver asked for: what the controller does.",
        )
    },
    plot(
        "roll",
        "Roll angle",
        "deg",
        "roll_deg",
        "Of the body, right side down positive.",
    ),
    Plot {
        limits: Limit::HalfRoad,
        ..plot(
            "path-deviation",
            "Distance from the path",
            "m",
            "path_deviation_m",
            "Left positive. Grey lines: the road's edges.",
        )
    },
    plot(
        "lateral-acceleration",
        "Lateral acceleration",
        "m/s²",
        "lateral_acceleration_m_s2",
        "At the centre of gravity, left positive.",
    ),
    Plot {
        digits: 1,
        ..plot(
            "yaw-rate",
            "Yaw rate",
            "deg/s",
            "yaw_rate_deg_s",
            "Counter-clockwise positive.",
        )
    },
    Plot {
        digits: 0,
        ..plot(
            "step-time",
            "Time of a step",
            "µs",
            "step_time_us",
            "Wall-clock time of the controller's decision.",
        )
    },
];

/// Columns of the wheel loads, in N: front left, front right, rear left, rear right.
pub(super) const WHEEL_LOADS: [&str; 4] = [
    "load_front_left_n",
    "load_front_right_n",
    "load_rear_left_n",
    "load_rear_right_n",
];

/// Columns that only the replay reads.
pub(super) const MOTION: [&str; 4] = ["x_m", "y_m", "yaw_deg", "two_wheel_clearance_m"];

/// Columns that the page carries, each with the way it is thinned out.
pub(super) fn page_columns() -> Vec<(&'static str, Thinning)> {
    let plotted = PLOTS.iter().flat_map(|p| [Some(p.column), p.companion]);
    let peaks = plotted.flatten().chain(WHEEL_LOADS);
    peaks
        .map(|name| (name, Thinning::Peaks))
        .chain(MOTION.map(|name| (name, Thinning::Smooth)))
        .collect()
}

/// How a run is drawn, on light and on dark ground. Hue tells the role, so that it is the same in
/// all scenes; runs of one role differ by shade and dash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Look {
    /// Red, green, blue on white.
    pub(super) light: [u8; 3],
    /// Red, green, blue on black.
    pub(super) dark: [u8; 3],
    /// Lengths of line and gap, 0 for a whole line.
    pub(super) dash: [u8; 2],
}

pub(super) const fn look(light: [u8; 3], dark: [u8; 3], dash: [u8; 2]) -> Look {
    Look { light, dark, dash }
}

/// Hues that people with any kind of colour vision tell apart (Okabe and Ito), darker shades on
/// white and lighter ones on black.
const DRIVER: [Look; 2] = [
    look([213, 94, 0], [255, 140, 66], [0, 0]),
    look([150, 62, 0], [255, 183, 133], [7, 4]),
];
const DEEPC: [Look; 6] = [
    look([0, 95, 173], [92, 173, 255], [0, 0]),
    look([53, 154, 217], [152, 214, 255], [8, 4]),
    look([48, 54, 148], [140, 149, 255], [3, 3]),
    look([0, 132, 160], [90, 220, 240], [12, 4]),
    look([92, 110, 190], [176, 186, 255], [5, 3]),
    look([0, 82, 110], [120, 190, 220], [16, 4]),
];
const LMPC: [Look; 6] = [
    look([0, 128, 94], [46, 204, 150], [0, 0]),
    look([98, 150, 16], [184, 224, 96], [8, 4]),
    look([0, 92, 60], [120, 224, 190], [3, 3]),
    look([74, 122, 78], [160, 205, 150], [12, 4]),
    look([60, 170, 130], [140, 236, 200], [5, 3]),
    look([110, 120, 30], [206, 214, 120], [16, 4]),
];
const FLOOR: [Look; 2] = [
    look([168, 118, 0], [240, 196, 60], [0, 0]),
    look([120, 88, 20], [250, 222, 140], [7, 4]),
];
const OTHER: [Look; 4] = [
    look([170, 68, 143], [236, 140, 205], [0, 0]),
    look([92, 98, 107], [190, 197, 206], [8, 4]),
    look([120, 40, 100], [214, 170, 255], [3, 3]),
    look([60, 64, 70], [220, 224, 230], [12, 4]),
];

/// The looks of a scene's runs, in their order. Runs of one controller look the same; the paper's
/// controllers come first, so that they look the same in all scenes.
pub(super) fn looks(runs: &[Run]) -> Vec<Look> {
    let mut seen: Vec<(Role, &str)> = Vec::new();
    for run in runs {
        let driven = (run.role, run.controller.as_str());
        if !seen.contains(&driven) {
            seen.push(driven);
        }
    }
    seen.sort_by_key(|(_, controller)| rank(controller));
    let look_of = |run: &Run| {
        let looks: &[Look] = match run.role {
            Role::Driver => &DRIVER,
            Role::Deepc => &DEEPC,
            Role::Lmpc => &LMPC,
            Role::Floor => &FLOOR,
            Role::Other => &OTHER,
        };
        let of_role = seen.iter().filter(|(role, _)| *role == run.role);
        let place = of_role
            .map(|(_, name)| *name)
            .position(|name| name == run.controller);
        looks[place.unwrap_or(0) % looks.len()]
    };
    runs.iter().map(look_of).collect()
}
