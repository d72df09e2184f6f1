//! Plant and controller, sample by sample.

use faer::Mat;

use super::error::{ControllerError, PlantError};
use super::reference::Reference;
use super::step::Origin;
use super::{Controller, Plant};
use crate::data::same_sample_time;

/// A finished closed-loop run.
#[derive(Debug, Clone)]
pub struct ClosedLoopRun {
    /// Inputs applied, steps×m.
    pub inputs: Mat<f64>,
    /// Outputs measured, steps×p.
    pub outputs: Mat<f64>,
    /// Disturbances measured, steps×q of the plant.
    pub disturbances: Mat<f64>,
    /// Where every input came from.
    pub origins: Vec<Origin>,
}

/// Runs `steps` samples. `set_reference` gets the sample number and the reference to fill. What
/// the plant measures of its disturbances goes to a controller that takes them, and only into the
/// run otherwise.
///
/// # Errors
/// Plant and controller differ in sizes or sample time, the reference does not fit, or the plant
/// cannot go on.
pub fn run_closed_loop<E>(
    plant: &mut dyn Plant,
    controller: &mut dyn Controller,
    steps: usize,
    mut set_reference: impl FnMut(usize, &mut Reference) -> Result<(), E>,
) -> Result<ClosedLoopRun, PlantError>
where
    E: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    check_pair(plant, controller).map_err(PlantError::new)?;
    let mut reference = controller.new_reference();
    let mut run = ClosedLoopRun {
        inputs: Mat::zeros(steps, plant.inputs()),
        outputs: Mat::zeros(steps, plant.outputs()),
        disturbances: Mat::zeros(steps, plant.disturbances()),
        origins: Vec::with_capacity(steps),
    };
    let mut input = vec![0.0; plant.inputs()];
    let mut output = vec![0.0; plant.outputs()];
    for k in 0..steps {
        set_reference(k, &mut reference).map_err(PlantError::new)?;
        let step = controller.decide(&reference);
        input.copy_from_slice(&step.input);
        run.origins.push(step.origin);
        plant.step(&input, &mut output)?;
        let measured = plant.measured_disturbances();
        let taken = if controller.disturbances() > 0 {
            measured
        } else {
            &[]
        };
        controller.observe_with_disturbances(&input, taken, &output);
        for (series, sample) in [
            (&mut run.inputs, &input[..]),
            (&mut run.outputs, &output),
            (&mut run.disturbances, measured),
        ] {
            let entries = series.row_mut(k).iter_mut();
            entries
                .zip(sample)
                .for_each(|(entry, value)| *entry = *value);
        }
    }
    Ok(run)
}

fn check_pair(plant: &dyn Plant, controller: &dyn Controller) -> Result<(), ControllerError> {
    let (plant_s, controller_s) = (plant.sample_time_s(), controller.sample_time_s());
    if plant.inputs() == controller.inputs()
        && plant.outputs() == controller.outputs()
        && [0, plant.disturbances()].contains(&controller.disturbances())
        && same_sample_time(controller_s, plant_s)
    {
        return Ok(());
    }
    Err(ControllerError::PlantMismatch {
        plant_inputs: plant.inputs(),
        plant_disturbances: plant.disturbances(),
        disturbances: controller.disturbances(),
        plant_outputs: plant.outputs(),
        plant_s,
        inputs: controller.inputs(),
        outputs: controller.outputs(),
        controller_s,
    })
}
