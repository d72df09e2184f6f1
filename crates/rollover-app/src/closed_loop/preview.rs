//! What the driver will do, for controllers that are told in advance.

use anyhow::Result;
use deepc_core::controller::{Plant, Reference};
use faer::Mat;
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

use super::{DrivenVehicle, INPUTS, OUTPUTS};
use crate::scenario::{FLOOR, Scenario};

/// The steering wheel along the course, as the driver holds it alone at the lowest target speed, at
/// which he gets through. It stands for what is known of a road from earlier drives.
pub struct SteeringProfile {
    /// Increasing, m.
    stations_m: Vec<f64>,
    /// Steering-wheel angle at each, deg.
    steering_deg: Vec<f64>,
}

impl SteeringProfile {
    /// Drives the course once.
    ///
    /// # Errors
    /// When the vehicle cannot be simulated.
    pub fn record(
        scenario: &Scenario,
        vehicle: &ReadyVehicle,
        terrain: &Terrain,
        seed: u64,
    ) -> Result<Self> {
        let speed_kmh = scenario.fixed_target_speed_kmh(FLOOR, scenario.speed_reference_kmh);
        let mut plant = DrivenVehicle::new(
            scenario,
            vehicle,
            &scenario.course,
            terrain.clone(),
            speed_kmh,
            (seed, "preview"),
        )?;
        let mut profile = Self {
            stations_m: Vec::new(),
            steering_deg: Vec::new(),
        };
        for _ in 0..scenario.steps() {
            if plant.ended() {
                break;
            }
            let station_m = plant.location().station_m;
            let steering_deg = plant.driver_steering_deg();
            if profile
                .stations_m
                .last()
                .is_none_or(|last| *last < station_m)
            {
                profile.stations_m.push(station_m);
                profile.steering_deg.push(steering_deg);
            }
            plant.step(&[steering_deg, speed_kmh], &mut [0.0])?;
        }
        Ok(profile)
    }

    /// Steering-wheel angle at a station, deg; before the first and after the last it stays.
    fn at(&self, station_m: f64) -> f64 {
        let after = self.stations_m.partition_point(|s| *s <= station_m);
        match (after.checked_sub(1), self.stations_m.get(after)) {
            (Some(before), Some(next)) => {
                let from = self.stations_m[before];
                let share = (station_m - from) / (next - from);
                let [a, b] = [before, after].map(|k| self.steering_deg[k]);
                a + share * (b - a)
            }
            (Some(last), None) => self.steering_deg[last],
            (None, _) => self.steering_deg.first().copied().unwrap_or(0.0),
        }
    }

    /// Fills the reference: what the driver wants now, changed as the profile changes on the way
    /// ahead at the present speed.
    pub(super) fn fill(
        &self,
        reference: &mut Reference,
        wanted: &[f64; INPUTS],
        (station_m, speed_m_s): (f64, f64),
        sample_time_s: f64,
    ) -> Result<()> {
        let here = self.at(station_m);
        let steps = reference.inputs().nrows();
        let inputs = Mat::from_fn(steps, INPUTS, |k, j| {
            let ahead_m = speed_m_s * sample_time_s * k as f64;
            match j {
                0 => wanted[0] + self.at(station_m + ahead_m) - here,
                _ => wanted[j],
            }
        });
        reference.preview(inputs.as_ref(), Mat::zeros(1, OUTPUTS).as_ref())?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::SteeringProfile;

    #[test]
    fn a_profile_is_interpolated_and_held_at_its_ends() {
        let profile = SteeringProfile {
            stations_m: vec![1.0, 2.0, 4.0],
            steering_deg: vec![10.0, 20.0, -20.0],
        };
        for (station, expected) in [
            (0.0, 10.0),
            (1.0, 10.0),
            (1.5, 15.0),
            (3.0, 0.0),
            (9.0, -20.0),
        ] {
            assert!((profile.at(station) - expected).abs() < 1e-12);
        }
    }
}
