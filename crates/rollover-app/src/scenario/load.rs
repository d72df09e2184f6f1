//! Finding, reading and checking scenario files.

use std::path::{Path, PathBuf};

use sysid::SysidError;
use sysid::lmpc::OffsetHandling;
use thiserror::Error;
use vehicle_dyn::road::Course;
use vehicle_dyn::sensors::{Channel, Sensor, SensorError};
use vehicle_dyn::terrain::GroundError;

use super::place::malformed;
use super::recording_check::{GroundOf, ground_of};
use super::{
    CONTROLLER_CHANNEL, ControllerSettings, DRIVER_CHANNELS, ModelSettings, Prediction, Scenario,
};
use crate::record::INPUT_COLUMNS;
use crate::toml_place::{Place, suggested};

/// Scenarios that travel with the binary.
const EMBEDDED: [(&str, &str); 3] = [
    (
        "sedan-s1",
        include_str!("../../../../scenarios/sedan-s1.toml"),
    ),
    (
        "truck-s2",
        include_str!("../../../../scenarios/truck-s2.toml"),
    ),
    (
        "riverbed-s3",
        include_str!("../../../../scenarios/riverbed-s3.toml"),
    ),
];

/// What can be wrong with a scenario.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// Neither a file nor an embedded name.
    #[error(
        "there is no scenario `{name}`{suggestion}; give the path of a scenario file or one of: {known}"
    )]
    Unknown {
        /// What was asked for.
        name: String,
        /// " (did you mean `x`?)" or nothing.
        suggestion: String,
        /// Names of the embedded scenarios.
        known: String,
    },
    /// The file cannot be read.
    #[error("cannot read the scenario file {path}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not a scenario.
    #[error("{origin} is not a scenario: {message}")]
    Malformed {
        /// The file or the embedded name.
        origin: String,
        /// What, from the parser, and what may be meant.
        message: String,
    },
    /// A value is out of its range.
    #[error("{origin}: `{field}` = {value}: must be {allowed}")]
    OutOfRange {
        /// The file or the embedded name.
        origin: String,
        /// The field.
        field: String,
        /// What it holds.
        value: String,
        /// What it may hold.
        allowed: String,
    },
    /// A ground is not allowed or does not fit its course.
    #[error("{origin}: {}{source}", of.words)]
    Ground {
        /// The file or the embedded name.
        origin: String,
        /// Whose ground it is.
        of: GroundOf,
        /// What is wrong and what to do.
        source: Box<GroundError>,
    },
    /// A course cannot be built or does not fit.
    #[error("{origin}: {field}: {message}")]
    Course {
        /// The file or the embedded name.
        origin: String,
        /// The course's field.
        field: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// Nobody is there to drive.
    #[error(
        "neither scenario {scenario} nor vehicle `{vehicle}` has a [driver]: add the table to one of them"
    )]
    NoDriver {
        /// The scenario.
        scenario: String,
        /// The vehicle.
        vehicle: String,
    },
    /// What is wrong, with its place in the file.
    #[error("{error}\n{place}")]
    At {
        /// What is wrong.
        error: Box<ScenarioError>,
        /// Where.
        place: Place,
    },
    /// The scenario has no such controller.
    #[error(
        "scenario {scenario} has no controller `{controller}`{suggestion}: choose one of {known}"
    )]
    UnknownController {
        /// The scenario.
        scenario: String,
        /// What was asked for.
        controller: String,
        /// " (did you mean `x`?)" or nothing.
        suggestion: String,
        /// The controllers it has.
        known: String,
    },
}

/// Names of the scenarios that travel with the binary.
#[must_use]
pub fn embedded_names() -> Vec<&'static str> {
    EMBEDDED.iter().map(|(name, _)| *name).collect()
}

/// Loads a scenario: a file when `name_or_path` is one, else an embedded scenario.
///
/// # Errors
/// When there is no such scenario, or it does not hold what it must; see [`ScenarioError`].
pub fn load(name_or_path: &str) -> Result<Scenario, ScenarioError> {
    let path = Path::new(name_or_path);
    if path.is_file() || path.extension().is_some_and(|e| e == "toml") {
        let text = std::fs::read_to_string(path).map_err(|source| ScenarioError::Unreadable {
            path: path.to_path_buf(),
            source,
        })?;
        return parse(&text, name_or_path);
    }
    let found = EMBEDDED.iter().find(|(name, _)| *name == name_or_path);
    found.map_or_else(
        || Err(unknown(name_or_path)),
        |(name, text)| parse(text, &format!("the built-in scenario {name}")),
    )
}

impl Scenario {
    /// Checks that the road is long enough for a run at `speed_kmh`.
    ///
    /// # Errors
    /// With the lengths, when it is not.
    pub fn check_road_at(&self, speed_kmh: f64) -> Result<(), ScenarioError> {
        let origin = format!("scenario {}", self.name);
        let course = Course::new(&self.course);
        Check { origin: &origin }.course("course", course, self.duration_s, speed_kmh)
    }
}

fn unknown(name: &str) -> ScenarioError {
    let names = embedded_names();
    let suggestion = suggested(name, names.iter().copied());
    let suggestion = if vehicle_dyn::manoeuvre::names().contains(&name) {
        format!(" (it is a manoeuvre: `rollover-app manoeuvre {name}`)")
    } else {
        suggestion
    };
    ScenarioError::Unknown {
        name: name.to_owned(),
        suggestion,
        known: names.join(", "),
    }
}

/// Text of a scenario that travels with the binary.
#[must_use]
pub fn embedded_text(name: &str) -> Option<&'static str> {
    let found = EMBEDDED.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text)
}

fn parse(text: &str, origin: &str) -> Result<Scenario, ScenarioError> {
    let scenario: Scenario =
        toml::from_str(text).map_err(|error| malformed(&error, text, origin))?;
    let checked = Check { origin }.scenario(&scenario);
    checked.map_err(|error| {
        let place = error
            .field()
            .and_then(|field| Place::of_field(text, &field));
        error.at(place)
    })?;
    Ok(scenario)
}

/// Range checks; every message names the origin, the field, the number and what is allowed.
pub(super) struct Check<'a> {
    origin: &'a str,
}

impl Check<'_> {
    fn scenario(&self, s: &Scenario) -> Result<(), ScenarioError> {
        self.name("name", &s.name)?;
        self.within("sample_time_s", s.sample_time_s, 0.001, 0.1)?;
        self.within("duration_s", s.duration_s, s.sample_time_s, 3600.0)?;
        self.within("speed_reference_kmh", s.speed_reference_kmh, 10.0, 250.0)?;
        self.ground(GroundOf::table(""), s.ground.check())?;
        let further = s.recording.more.iter().map(|record| &record.ground);
        let own = std::iter::once(&s.recording.ground).chain(further);
        for (index, ground) in own.enumerate() {
            if let Some(ground) = ground {
                self.ground(ground_of(s, index), ground.check())?;
            }
        }
        let bounds = &s.bounds;
        self.range("bounds.steering_wheel_deg", bounds.steering_wheel_deg, 0.0)?;
        self.range(
            "bounds.target_speed_kmh",
            bounds.target_speed_kmh,
            s.speed_reference_kmh,
        )?;
        self.within(
            "bounds.target_speed_kmh[0]",
            bounds.target_speed_kmh[0],
            0.0,
            540.0,
        )?;
        self.within(
            "bounds.target_speed_kmh[1]",
            bounds.target_speed_kmh[1],
            0.0,
            540.0,
        )?;
        self.course(
            "course",
            Course::new(&s.course),
            s.duration_s,
            s.speed_reference_kmh,
        )?;
        self.recording(s)?;
        self.sensors(s)?;
        self.grounds_on_courses(s)?;
        if let Some(driver) = &s.driver {
            driver.check().map_err(|e| ScenarioError::Course {
                origin: self.origin.to_owned(),
                field: "driver".to_owned(),
                message: e.to_string(),
            })?;
        }
        s.controllers
            .iter()
            .try_for_each(|(name, c)| self.controller(s, name, c))
    }

    fn sensors(&self, s: &Scenario) -> Result<(), ScenarioError> {
        for (&channel, description) in &s.sensors {
            if channel != CONTROLLER_CHANNEL && !DRIVER_CHANNELS.contains(&channel) {
                let read = DRIVER_CHANNELS.map(Channel::name).join("`, `");
                return Err(self.out_of_range(
                    &format!("sensors.{channel}"),
                    "a sensor".into(),
                    &format!(
                        "on a channel that is read: controllers read `{CONTROLLER_CHANNEL}`, the driver `{read}`"
                    ),
                ));
            }
            // The seed changes no range.
            let built = Sensor::new(description, s.sample_time_s, 0, channel.name());
            built.map_err(|error| match error {
                SensorError::OutOfRange {
                    channel,
                    field,
                    value,
                    range,
                } => self.out_of_range(
                    &format!("sensors.{channel}.{field}"),
                    value.to_string(),
                    &range,
                ),
                other => self.out_of_range("sensors", other.to_string(), "as it says"),
            })?;
        }
        Ok(())
    }

    fn controller(
        &self,
        s: &Scenario,
        name: &str,
        c: &ControllerSettings,
    ) -> Result<(), ScenarioError> {
        let field = |key: &str| format!("controllers.{name}.{key}");
        if [super::DRIVER, super::FLOOR].contains(&name) {
            return Err(self.out_of_range(
                &format!("controllers.{name}"),
                "a controller".into(),
                "another name: every scenario has a `driver`, alone, and a `floor`, held at the lowest target speed",
            ));
        }
        self.name("controllers", name)?;
        self.within(&field("ltr_limit"), c.ltr_limit, 0.05, 2.0)?;
        let counts = [
            ("past_steps", c.past_steps),
            ("horizon_steps", c.horizon_steps),
            ("moves_per_solve", c.moves_per_solve),
        ];
        counts
            .iter()
            .try_for_each(|&(key, count)| self.count(&field(key), count))?;
        let recorded = s.recording.more.len() + 1;
        if c.records
            .is_some_and(|used| !(1..=recorded).contains(&used))
        {
            return Err(self.out_of_range(
                &field("records"),
                c.records.unwrap_or_default().to_string(),
                &format!("in [1, {recorded}], the number of records of the recording"),
            ));
        }
        if c.moves_per_solve > c.horizon_steps {
            return Err(self.out_of_range(
                &field("moves_per_solve"),
                c.moves_per_solve.to_string(),
                &format!("at most horizon_steps = {}", c.horizon_steps),
            ));
        }
        let weights = [
            (
                "input_weights.steering_wheel_per_deg2",
                c.input_weights.steering_wheel_per_deg2,
            ),
            (
                "input_weights.target_speed_per_kmh2",
                c.input_weights.target_speed_per_kmh2,
            ),
            ("ltr_penalty.linear", c.ltr_penalty.linear),
            ("ltr_penalty.quadratic", c.ltr_penalty.quadratic),
        ];
        weights
            .iter()
            .try_for_each(|&(key, w)| self.within(&field(key), w, 0.0, 1e15))?;
        match &c.prediction {
            Prediction::Data(data) => {
                self.count(&field("order_bound"), data.order_bound)?;
                let positive = [
                    ("regularisation.lambda_g", data.regularisation.lambda_g),
                    ("lambda_u", data.lambda_u),
                    ("lambda_y", data.lambda_y),
                ];
                positive
                    .iter()
                    .try_for_each(|&(key, w)| self.within(&field(key), w, 1e-12, 1e15))
            }
            Prediction::Model(model) => self.model(&field, model),
        }
    }

    fn model(
        &self,
        field: &impl Fn(&str) -> String,
        model: &ModelSettings,
    ) -> Result<(), ScenarioError> {
        if let OffsetHandling::OutputDisturbance { drift } = model.offset_handling {
            let key = "offset_handling.output_disturbance.drift";
            self.within(&field(key), drift, 1e-6, 1.0)?;
        }
        let inputs = INPUT_COLUMNS.map(str::to_owned);
        model.identification.check(&inputs).map_err(|error| {
            let identification = field("identification");
            match error {
                SysidError::Setting {
                    field,
                    found,
                    allowed,
                } => self.out_of_range(&format!("{identification}.{field}"), found, &allowed),
                other => self.out_of_range(&identification, other.to_string(), "as it says"),
            }
        })
    }

    fn ground(&self, of: GroundOf, checked: Result<(), GroundError>) -> Result<(), ScenarioError> {
        checked.map_err(|source| ScenarioError::Ground {
            origin: self.origin.to_owned(),
            of,
            source: Box::new(source),
        })
    }

    /// Whether all that the grounds hold lies on their courses, which are known to be good.
    fn grounds_on_courses(&self, s: &Scenario) -> Result<(), ScenarioError> {
        let own = std::iter::once((GroundOf::table(""), &s.ground, &s.course));
        let records = s.records().into_iter().enumerate();
        let records = records.map(|(i, r)| (ground_of(s, i), r.ground, r.course));
        for (of, ground, course) in own.chain(records) {
            if let Ok(course) = Course::new(course) {
                self.ground(of, ground.check_on(&course))?;
            }
        }
        Ok(())
    }

    fn count(&self, field: &str, count: usize) -> Result<(), ScenarioError> {
        if (1..=10_000).contains(&count) {
            return Ok(());
        }
        Err(self.out_of_range(field, count.to_string(), "in [1, 10000]"))
    }

    pub(super) fn course<E: std::fmt::Display>(
        &self,
        field: &str,
        course: Result<Course, E>,
        duration_s: f64,
        speed_kmh: f64,
    ) -> Result<(), ScenarioError> {
        let wrong = |message: String| ScenarioError::Course {
            origin: self.origin.to_owned(),
            field: field.to_owned(),
            message,
        };
        let length = course.map_err(|e| wrong(e.to_string()))?.total_length_m();
        let needed = duration_s * speed_kmh / 3.6;
        if length < needed {
            return Err(wrong(format!(
                "the road is {length:.0} m long, but {duration_s} s at {speed_kmh} km/h take {needed:.0} m: lengthen its last straight"
            )));
        }
        Ok(())
    }

    pub(super) fn within(
        &self,
        field: &str,
        value: f64,
        low: f64,
        high: f64,
    ) -> Result<(), ScenarioError> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(self.out_of_range(field, value.to_string(), &format!("in [{low}, {high}]")))
    }

    /// Names become names of folders.
    fn name(&self, field: &str, name: &str) -> Result<(), ScenarioError> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if !name.is_empty() && !name.starts_with('.') && name.chars().all(plain) {
            return Ok(());
        }
        let allowed = "made of letters, digits, `-`, `_` and `.`, not beginning with `.`";
        Err(self.out_of_range(field, format!("`{name}`"), allowed))
    }

    /// A range around `held`.
    fn range(&self, field: &str, [low, high]: [f64; 2], held: f64) -> Result<(), ScenarioError> {
        let proper = low < high && low.is_finite() && high.is_finite();
        if proper && (low..=high).contains(&held) {
            return Ok(());
        }
        let allowed = format!("[lowest, highest], both finite, around {held}");
        Err(self.out_of_range(field, format!("[{low}, {high}]"), &allowed))
    }

    fn out_of_range(&self, field: &str, value: String, allowed: &str) -> ScenarioError {
        ScenarioError::OutOfRange {
            origin: self.origin.to_owned(),
            field: field.to_owned(),
            value,
            allowed: allowed.to_owned(),
        }
    }
}
