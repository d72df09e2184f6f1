//! The contracts of [`Plant`] and [`Controller`] as checks that every implementer runs.

use super::{Controller, Fault, Plant, Reference};
use crate::program::Bounds;
use crate::solver::contract::{ContractViolation, demand};

/// Checks a plant; `make` builds it anew, always alike.
///
/// # Errors
/// The first clause found broken.
pub fn check_plant(
    make: &mut dyn FnMut() -> Box<dyn Plant>,
    inputs: &[Vec<f64>],
) -> Result<(), ContractViolation> {
    let (mut plant, mut twin) = (make(), make());
    let sizes = (
        plant.inputs(),
        plant.outputs(),
        plant.sample_time_s().to_bits(),
    );
    demand(1, sizes.0 > 0 && sizes.1 > 0, || {
        format!("{} inputs, {} outputs", sizes.0, sizes.1)
    })?;
    let sample_time_s = plant.sample_time_s();
    demand(1, sample_time_s.is_finite() && sample_time_s > 0.0, || {
        format!("sample time {sample_time_s} s")
    })?;
    for (k, input) in inputs.iter().enumerate() {
        let mut output = vec![f64::NAN; sizes.1];
        let result = plant.step(input, &mut output);
        // Refused slices must not advance the twin, so they are offered to it before each step.
        let mut long = vec![0.0; sizes.1 + 1];
        let short_input = twin.step(&input[1..], &mut long[1..]).is_err();
        let long_output = twin.step(input, &mut long).is_err();
        demand(4, short_input && long_output, || {
            "slices of wrong lengths are accepted".into()
        })?;
        let mut repeated = vec![f64::NAN; sizes.1];
        let again = twin.step(input, &mut repeated);
        let now = (
            plant.inputs(),
            plant.outputs(),
            plant.sample_time_s().to_bits(),
        );
        demand(1, now == sizes, || format!("sizes change in sample {k}"))?;
        demand(5, result.is_ok() == again.is_ok(), || {
            format!("sample {k} fails once of twice")
        })?;
        if result.is_err() {
            return Ok(());
        }
        demand(3, output.iter().all(|y| y.is_finite()), || {
            format!("sample {k} gives {output:?}")
        })?;
        demand(5, output == repeated, || {
            format!("sample {k} gives {output:?}, and {repeated:?} from a plant built alike")
        })?;
    }
    Ok(())
}

/// Checks a controller with these hard input bounds; `make` builds it anew, always alike, and
/// `respond` is any response to an input (it need not be a plant the controller knows).
///
/// # Errors
/// The first clause found broken.
pub fn check_controller(
    make: &mut dyn FnMut() -> Box<dyn Controller>,
    bounds: &[Bounds],
    respond: &mut dyn FnMut(usize, &[f64]) -> Vec<f64>,
) -> Result<(), ContractViolation> {
    let mut probe = Probe::new(make(), bounds);
    probe.check_sizes()?;
    let healthy = probe.run(60, respond, |_| Disturbance::None)?;
    probe.controller.reset();
    let again = probe.run(60, respond, |_| Disturbance::None)?;
    demand(5, healthy == again, || {
        "after reset it decides differently".into()
    })?;
    let mut twin = Probe::new(make(), bounds);
    let repeated = twin.run(60, respond, |_| Disturbance::None)?;
    demand(6, healthy == repeated, || {
        "a controller built alike decides differently".into()
    })?;
    probe.controller.reset();
    probe.run(120, respond, |k| match k % 10 {
        1 => Disturbance::NanOutput,
        3 => Disturbance::NanInput,
        5 => Disturbance::WrongLength,
        6 => Disturbance::Lost,
        8 => Disturbance::NanReference,
        9 => Disturbance::ForeignReference,
        _ => Disturbance::None,
    })?;
    Ok(())
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Disturbance {
    None,
    NanOutput,
    NanInput,
    WrongLength,
    Lost,
    NanReference,
    ForeignReference,
}

struct Probe<'a> {
    controller: Box<dyn Controller>,
    bounds: &'a [Bounds],
    sizes: (usize, usize, usize),
}

impl<'a> Probe<'a> {
    fn new(controller: Box<dyn Controller>, bounds: &'a [Bounds]) -> Self {
        let sizes = (
            controller.inputs(),
            controller.outputs(),
            controller.horizon(),
        );
        Self {
            controller,
            bounds,
            sizes,
        }
    }

    fn check_sizes(&self) -> Result<(), ContractViolation> {
        let (m, p, horizon) = self.sizes;
        demand(1, m > 0 && p > 0 && horizon > 0, || {
            format!("sizes {m}, {p}, {horizon}")
        })?;
        demand(1, m == self.bounds.len(), || {
            format!("{m} inputs, checked with {} bounds", self.bounds.len())
        })
    }

    /// The inputs decided. A disturbance of sample k is reported in step k (reference) or k + 1
    /// (sample).
    fn run(
        &mut self,
        steps: usize,
        respond: &mut dyn FnMut(usize, &[f64]) -> Vec<f64>,
        disturb: impl Fn(usize) -> Disturbance,
    ) -> Result<Vec<Vec<f64>>, ContractViolation> {
        let (m, p, horizon) = self.sizes;
        let mut inputs = Vec::with_capacity(steps);
        let mut pending = None;
        for k in 0..steps {
            let disturbance = disturb(k);
            let reference = match disturbance {
                Disturbance::NanReference => filled(horizon, m, p, f64::NAN)?,
                Disturbance::ForeignReference => filled(horizon + 1, m, p, 0.0)?,
                _ => filled(horizon, m, p, 0.3)?,
            };
            let expected = pending.take().or(match disturbance {
                Disturbance::NanReference => Some(Fault::ReferenceNotFinite),
                Disturbance::ForeignReference => Some(Fault::ReferenceShape),
                _ => None,
            });
            let step = self.controller.decide(&reference);
            demand(3, expected.is_none() || step.fault == expected, || {
                format!("step {k} reports {:?}, expected {expected:?}", step.fault)
            })?;
            let input = step.input.clone();
            let allowed = input.len() == m
                && input
                    .iter()
                    .zip(self.bounds)
                    .all(|(u, b)| u.is_finite() && *u >= b.lower_value() && *u <= b.upper_value());
            demand(2, allowed, || format!("step {k} decides {input:?}"))?;
            let output = respond(k, &input);
            pending = match disturbance {
                Disturbance::NanOutput => {
                    self.controller.observe(&input, &vec![f64::NAN; p]);
                    Some(Fault::MeasurementNotFinite)
                }
                Disturbance::NanInput => {
                    self.controller.observe(&vec![f64::INFINITY; m], &output);
                    Some(Fault::MeasurementNotFinite)
                }
                Disturbance::WrongLength => {
                    self.controller.observe(&input, &vec![0.0; p + 1]);
                    Some(Fault::MeasurementShape)
                }
                Disturbance::Lost => Some(Fault::MeasurementLost),
                _ => {
                    self.controller.observe(&input, &output);
                    None
                }
            };
            inputs.push(input);
        }
        let now = (
            self.controller.inputs(),
            self.controller.outputs(),
            self.controller.horizon(),
        );
        demand(1, now == self.sizes, || "sizes change".into())?;
        Ok(inputs)
    }
}

fn filled(horizon: usize, m: usize, p: usize, value: f64) -> Result<Reference, ContractViolation> {
    let mut reference = Reference::zeros(horizon, m, p);
    reference
        .hold(&vec![value; m], &vec![value; p])
        .map_err(|error| ContractViolation {
            clause: 1,
            what: error.to_string(),
        })?;
    Ok(reference)
}
