//! Every value against its allowed range, so that a wrong unit or sign stops at the door.

mod contradictions;
mod interval;
mod ranges;
mod stiffness;

pub use interval::Interval;
pub use ranges::{Field, fields};

use super::{ParameterError, VehicleParameters};

impl VehicleParameters {
    /// Checks every value against its range, and that the values fit together.
    ///
    /// # Errors
    /// [`ParameterError::NoName`], [`ParameterError::BadName`], [`ParameterError::OutOfRange`] or
    /// [`ParameterError::Contradiction`], naming the vehicle.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.check_as(&format!("vehicle `{}`", self.name))
    }

    /// As [`VehicleParameters::check`], with messages that name `origin`.
    pub(super) fn check_as(&self, origin: &str) -> Result<(), ParameterError> {
        if self.name.trim().is_empty() {
            return Err(ParameterError::NoName {
                origin: origin.to_owned(),
            });
        }
        let out_of_place = |c: char| c == '/' || c == '\\' || c.is_control();
        if self.name.starts_with('.') || self.name.contains(out_of_place) {
            return Err(ParameterError::BadName {
                name: self.name.clone(),
                origin: origin.to_owned(),
            });
        }
        ranges::check(self, origin)?;
        contradictions::check(self, origin)?;
        stiffness::check(self, origin)
    }
}
