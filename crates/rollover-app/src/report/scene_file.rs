//! `scene.json`: what a log does not hold of its run, written beside it.

use anyhow::Result;
use serde::{Deserialize, Serialize};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription};
use vehicle_dyn::terrain::Terrain;

use super::data::{HeightProfile, Limits, Road, Role, Run, Scene, TerrainMap, VehicleShape};
use crate::scenario::{ControllerSettings, DRIVER, FLOOR, Prediction, Scenario};
use crate::summary::{InputWeights, LTR_LIFT_OFF};

/// Its name.
pub const SCENE_FILE: &str = "scene.json";

/// Distance between the points of a road's lines, m.
const POINT_SPACING_M: f64 = 2.0;
/// What a body is wider than its track, m.
const BODY_BEYOND_TRACK_M: f64 = 0.25;

/// The road, the vehicle and the limits of a run, and who drove.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneFile {
    /// The scene, without runs.
    pub scene: Scene,
    /// The run, without what its log tells.
    pub run: Run,
    /// Weights of its cost, if it has one.
    pub weights: Option<InputWeights>,
}

impl SceneFile {
    /// Describes a run of a scenario, with its ground where that is at hand.
    ///
    /// # Errors
    /// When the scenario's course cannot be built.
    pub fn new(
        scenario: &Scenario,
        vehicle: &VehicleParameters,
        controller: &str,
        seed: u64,
        terrain: Option<&Terrain>,
    ) -> Result<Self> {
        let course = Course::new(&scenario.course)?;
        let shape = VehicleShape::of(vehicle);
        let settings = scenario.controllers.get(controller);
        let scene = Scene {
            name: scenario.name.clone(),
            title: format!("{}, vehicle {}", scenario.name, vehicle.name),
            description: scenario.description.clone(),
            road: Some(Road::new(&scenario.course)?),
            terrain: terrain.and_then(|t| TerrainMap::around(t, &course)),
            profile: terrain.and_then(|t| HeightProfile::along(t, &course, shape.track_m)),
            vehicle: Some(shape),
            limits: Limits {
                ltr: Some(LTR_LIFT_OFF),
                target_speed_kmh: Some(scenario.bounds.target_speed_kmh),
                steering_wheel_deg: Some(scenario.bounds.steering_wheel_deg),
            },
            ..Scene::default()
        };
        let run = Run {
            controller: controller.to_owned(),
            label: controller.to_owned(),
            description: settings.map_or_else(
                || of_driver(scenario, controller),
                |s| s.description.clone(),
            ),
            role: settings.map_or_else(|| Role::of_name(controller), Role::of_settings),
            seed: (controller != DRIVER).then_some(seed),
            ltr_limit: settings.map(|s| s.ltr_limit),
            ..Run::default()
        };
        Ok(Self {
            scene,
            run,
            weights: settings.map(|s| s.input_weights),
        })
    }
}

fn of_driver(scenario: &Scenario, controller: &str) -> String {
    if controller == FLOOR {
        let [lowest, _] = scenario.bounds.target_speed_kmh;
        return format!(
            "The driver alone, the target speed held at the lowest allowed, {lowest} km/h."
        );
    }
    "The driver alone.".into()
}

impl Road {
    /// The road of a course.
    ///
    /// # Errors
    /// When the course cannot be built.
    pub fn new(description: &CourseDescription) -> Result<Self> {
        let course = Course::new(description)?;
        let mut road = Self {
            width_m: course.width_m(),
            ..Self::default()
        };
        // Millimetres are enough for a picture.
        let round = |v: f64| (v * 1e3).round() / 1e3;
        let half = 0.5 * road.width_m;
        let mut station = 0.0;
        loop {
            let at = course.point(station);
            let (sin, cos) = at.heading_rad.sin_cos();
            for (line, offset) in [
                (&mut road.centre, 0.0),
                (&mut road.left, half),
                (&mut road.right, -half),
            ] {
                line.push([round(at.x_m - offset * sin), round(at.y_m + offset * cos)]);
            }
            if station >= course.total_length_m() {
                return Ok(road);
            }
            station = (station + POINT_SPACING_M).min(course.total_length_m());
        }
    }
}

impl VehicleShape {
    /// The shape of a vehicle.
    #[must_use]
    pub fn of(vehicle: &VehicleParameters) -> Self {
        let derived = vehicle.derived();
        let geometry = &vehicle.geometry;
        let track_m = 0.5 * (geometry.track_front_m + geometry.track_rear_m);
        Self {
            name: vehicle.name.clone(),
            track_m,
            wheelbase_m: derived.wheelbase_m,
            cg_to_front_axle_m: derived.cg_to_front_axle_m,
            cg_height_m: derived.cg_height_m,
            width_m: track_m + BODY_BEYOND_TRACK_M,
            steering_ratio: vehicle.steering.ratio,
            assumed: false,
        }
    }
}

impl Role {
    /// The role that settings give.
    #[must_use]
    pub fn of_settings(settings: &ControllerSettings) -> Self {
        match &settings.prediction {
            Prediction::Data(_) => Self::Deepc,
            Prediction::Model(_) => Self::Lmpc,
        }
    }

    /// The role that a controller's name suggests.
    #[must_use]
    pub fn of_name(name: &str) -> Self {
        let name = name.to_lowercase();
        let says = |word: &str| name.contains(word);
        if says("deepc") {
            Self::Deepc
        } else if says("mpc") {
            Self::Lmpc
        } else if says("floor") {
            Self::Floor
        } else if says(DRIVER) {
            Self::Driver
        } else {
            Self::Other
        }
    }
}
