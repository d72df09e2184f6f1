//! Ranges of a ground description.

use super::description::{
    Bump, FrictionPatch, GroundDescription, Roughness, SplitFriction, Undulation,
};
use super::error::GroundError;
use super::grid::CORRIDOR_MARGIN_M;
use crate::road::Course;

/// Friction coefficients allowed.
const FRICTION: (f64, f64) = (0.01, 1.5);
/// Least width of a friction edge, m: narrower ones the grid cannot show.
const LEAST_EDGE_M: f64 = 0.5;
/// Least distance between bank points, m.
const LEAST_BANK_STEP_M: f64 = 5.0;
/// Steepest flank of a bump (no unit).
const STEEPEST_BUMP: f64 = 1.0;

impl GroundDescription {
    /// Checks every number against its range, and fields against each other.
    ///
    /// # Errors
    /// [`GroundError`] naming the field, the number and the range.
    pub fn check(&self) -> Result<(), GroundError> {
        friction("friction", self.friction)?;
        if let Some(fade_in) = self.fade_in_m {
            within("fade_in_m", fade_in, 1.0, 1e4, "m")?;
        }
        match (
            self.fade_in_m.is_some(),
            self.roughness.is_some() || self.undulation.is_some(),
        ) {
            (false, true) => {
                return Err(GroundError::Missing {
                    field: "fade_in_m".into(),
                    advice: "roughness and undulation need the distance over which they grow from nothing, such as 50.0",
                });
            }
            (true, false) => {
                return Err(GroundError::Contradiction {
                    fields: "fade_in_m".into(),
                    reason: "there is neither roughness nor undulation to fade in: remove it"
                        .into(),
                });
            }
            _ => {}
        }
        self.check_bank()?;
        self.roughness.as_ref().map_or(Ok(()), Roughness::check)?;
        self.undulation.as_ref().map_or(Ok(()), Undulation::check)?;
        for (index, bump) in self.bumps.iter().enumerate() {
            bump.check(index)?;
        }
        self.split.as_ref().map_or(Ok(()), SplitFriction::check)?;
        for (index, patch) in self.patches.iter().enumerate() {
            patch.check(index)?;
        }
        Ok(())
    }

    fn check_bank(&self) -> Result<(), GroundError> {
        for (index, point) in self.bank.iter().enumerate() {
            let field = |key: &str| format!("bank[{index}].{key}");
            within(&field("station_m"), point.station_m, 0.0, 1e5, "m")?;
            within(&field("percent"), point.percent, -50.0, 50.0, "%")?;
        }
        for (index, pair) in self.bank.windows(2).enumerate() {
            let (before, after) = (pair[0].station_m, pair[1].station_m);
            if after - before < LEAST_BANK_STEP_M {
                return Err(GroundError::Contradiction {
                    fields: format!(
                        "bank[{}].station_m = {after} after bank[{index}].station_m = {before}",
                        index + 1
                    ),
                    reason: format!(
                        "stations must grow by at least {LEAST_BANK_STEP_M} m from point to point"
                    ),
                });
            }
        }
        Ok(())
    }

    /// Checks that everything lies on the course.
    ///
    /// # Errors
    /// [`GroundError::BeyondCourse`] with the station and the course's length, or
    /// [`GroundError::BesideCourse`] with the offset and the width.
    pub fn check_on(&self, course: &Course) -> Result<(), GroundError> {
        self.check()?;
        let total_m = course.total_length_m();
        let on = |field: String, station_m: f64| {
            if station_m <= total_m {
                return Ok(());
            }
            Err(GroundError::BeyondCourse {
                field,
                station_m,
                total_m,
            })
        };
        if let Some(fade_in) = self.fade_in_m {
            on("fade_in_m".into(), fade_in)?;
        }
        for (index, point) in self.bank.iter().enumerate() {
            on(format!("bank[{index}].station_m"), point.station_m)?;
        }
        let reach_m = 0.5 * course.width_m() + CORRIDOR_MARGIN_M;
        let beside = |field: String, offset_m: f64| {
            if offset_m.abs() <= reach_m {
                return Ok(());
            }
            Err(GroundError::BesideCourse {
                field,
                offset_m,
                reach_m,
            })
        };
        for (index, bump) in self.bumps.iter().enumerate() {
            on(format!("bumps[{index}].station_m"), bump.station_m)?;
            beside(format!("bumps[{index}].offset_m"), bump.offset_m)?;
        }
        for (index, patch) in self.patches.iter().enumerate() {
            on(format!("patches[{index}].from_m"), patch.from_m)?;
            on(format!("patches[{index}].to_m"), patch.to_m)?;
        }
        Ok(())
    }
}

impl Roughness {
    fn check(&self) -> Result<(), GroundError> {
        match (self.class, self.gd_n0_m3) {
            (Some(_), None) => {}
            (None, Some(level)) => within("roughness.gd_n0_m3", level, 1e-8, 1.0, "m³")?,
            (None, None) => {
                return Err(GroundError::Missing {
                    field: "roughness.class".into(),
                    advice: "give a road class from \"a\" to \"h\", or gd_n0_m3",
                });
            }
            (Some(_), Some(level)) => {
                return Err(GroundError::Contradiction {
                    fields: format!("roughness.class and roughness.gd_n0_m3 = {level}"),
                    reason: "they say the same thing: give one of them".into(),
                });
            }
        }
        within(
            "roughness.contact_length_m",
            self.contact_length_m,
            0.0,
            0.5,
            "m",
        )
    }
}

impl Undulation {
    fn check(&self) -> Result<(), GroundError> {
        within("undulation.height_rms_m", self.height_rms_m, 0.0, 50.0, "m")?;
        within("undulation.shortest_m", self.shortest_m, 5.0, 1e4, "m")?;
        within("undulation.longest_m", self.longest_m, 5.0, 1e4, "m")?;
        if self.longest_m < self.shortest_m {
            return Err(GroundError::Contradiction {
                fields: format!(
                    "undulation.longest_m = {} and undulation.shortest_m = {}",
                    self.longest_m, self.shortest_m
                ),
                reason: "the longest wave must not be the shorter one".into(),
            });
        }
        // Beyond it, wheels would stand on walls here and there.
        let steepness = self.height_rms_m / self.shortest_m;
        if steepness > 0.02 {
            return Err(GroundError::Contradiction {
                fields: format!(
                    "undulation.height_rms_m = {} and undulation.shortest_m = {}",
                    self.height_rms_m, self.shortest_m
                ),
                reason: format!("the height is {steepness:.3} of the shortest wave: at most 0.02"),
            });
        }
        Ok(())
    }
}

impl Bump {
    fn check(&self, index: usize) -> Result<(), GroundError> {
        let field = |key: &str| format!("bumps[{index}].{key}");
        within(&field("station_m"), self.station_m, 0.0, 1e5, "m")?;
        within(&field("offset_m"), self.offset_m, -100.0, 100.0, "m")?;
        within(&field("length_m"), self.length_m, 0.05, 100.0, "m")?;
        within(&field("width_m"), self.width_m, 0.05, 100.0, "m")?;
        within(&field("height_m"), self.height_m, -1.0, 1.0, "m")?;
        let slope = std::f64::consts::PI * self.height_m.abs() / self.length_m.min(self.width_m);
        if slope > STEEPEST_BUMP {
            return Err(GroundError::Contradiction {
                fields: format!(
                    "bumps[{index}] of length_m = {}, width_m = {} and height_m = {}",
                    self.length_m, self.width_m, self.height_m
                ),
                reason: format!(
                    "its flank rises {slope:.2} m per m; at most {STEEPEST_BUMP}, as a wheel touches the ground in one point only"
                ),
            });
        }
        Ok(())
    }
}

impl SplitFriction {
    fn check(&self) -> Result<(), GroundError> {
        friction("split.left", self.left)?;
        friction("split.right", self.right)?;
        within("split.edge_m", self.edge_m, LEAST_EDGE_M, 20.0, "m")
    }
}

impl FrictionPatch {
    fn check(&self, index: usize) -> Result<(), GroundError> {
        let field = |key: &str| format!("patches[{index}].{key}");
        within(&field("from_m"), self.from_m, 0.0, 1e5, "m")?;
        within(&field("to_m"), self.to_m, 0.0, 1e5, "m")?;
        within(&field("right_m"), self.right_m, -100.0, 100.0, "m")?;
        within(&field("left_m"), self.left_m, -100.0, 100.0, "m")?;
        friction(&field("friction"), self.friction)?;
        within(&field("edge_m"), self.edge_m, LEAST_EDGE_M, 20.0, "m")?;
        for (low_key, low, high_key, high) in [
            ("from_m", self.from_m, "to_m", self.to_m),
            ("right_m", self.right_m, "left_m", self.left_m),
        ] {
            if high - low < self.edge_m {
                return Err(GroundError::Contradiction {
                    fields: format!("patches[{index}].{low_key} = {low} and {high_key} = {high}"),
                    reason: format!(
                        "{high_key} must exceed {low_key} by at least edge_m = {}",
                        self.edge_m
                    ),
                });
            }
        }
        Ok(())
    }
}

fn friction(field: &str, value: f64) -> Result<(), GroundError> {
    within(field, value, FRICTION.0, FRICTION.1, "")
}

fn within(
    field: &str,
    value: f64,
    low: f64,
    high: f64,
    unit: &'static str,
) -> Result<(), GroundError> {
    if value >= low && value <= high {
        return Ok(());
    }
    let space = if unit.is_empty() { "" } else { " " };
    Err(GroundError::OutOfRange {
        field: field.to_owned(),
        value,
        range: format!("[{low}, {high}]{space}{unit}"),
    })
}
