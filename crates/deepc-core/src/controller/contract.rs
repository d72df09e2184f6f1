//! The contracts of [`Plant`] and [`Controller`] as checks that every implementer runs.

use super::{Controller, Fault, Origin, Plant, Reference, Step};
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
        let disturbance = plant.measured_disturbances();
        let finite = disturbance.iter().all(|d| d.is_finite());
        demand(
            6,
            finite && disturbance.len() == plant.disturbances(),
            || format!("sample {k} measures the disturbances {disturbance:?}"),
        )?;
        demand(5, output == repeated, || {
            format!("sample {k} gives {output:?}, and {repeated:?} from a plant built alike")
        })?;
    }
    Ok(())
}

/// Checks a controller with these hard input bounds (m); `make` builds it anew, always alike, and
/// `respond` is any response to an input (it need not be a plant the controller knows).
///
/// # Errors
/// The first clause found broken.
pub fn check_controller(
    make: &mut dyn FnMut() -> Box<dyn Controller>,
    bounds: &[Bounds],
    respond: &mut dyn FnMut(usize, &[f64]) -> Vec<f64>,
) -> Result<(), ContractViolation> {
    let changes = vec![Bounds::none(); bounds.len()];
    check_rate_limited_controller(make, bounds, &changes, respond)
}

/// [`check_controller`] for a controller that also has hard bounds on the input changes (m).
///
/// # Errors
/// The first clause found broken.
pub fn check_rate_limited_controller(
    make: &mut dyn FnMut() -> Box<dyn Controller>,
    bounds: &[Bounds],
    changes: &[Bounds],
    respond: &mut dyn FnMut(usize, &[f64]) -> Vec<f64>,
) -> Result<(), ContractViolation> {
    let limits = Limits { bounds, changes };
    let mut probe = Probe::new(make(), limits);
    probe.check_sizes()?;
    let healthy = probe.run(60, respond, |_| Mishap::None)?;
    probe.controller.reset();
    let again = probe.run(60, respond, |_| Mishap::None)?;
    demand(5, healthy == again, || {
        "after reset it decides differently".into()
    })?;
    let mut twin = Probe::new(make(), limits);
    let repeated = twin.run(60, respond, |_| Mishap::None)?;
    demand(6, healthy == repeated, || {
        "a controller built alike decides differently".into()
    })?;
    probe.controller.reset();
    probe.run(120, respond, |k| match k % 10 {
        1 => Mishap::NanOutput,
        3 => Mishap::NanInput,
        5 => Mishap::WrongLength,
        6 => Mishap::Lost,
        8 => Mishap::NanReference,
        9 => Mishap::ForeignReference,
        _ => Mishap::None,
    })?;
    // Nothing is measured for longer than any plan lasts, then everything twice.
    let outage = 10..20 + 2 * probe.sizes.horizon;
    probe.run(outage.end + 60, respond, |k| match k {
        k if outage.contains(&k) && k % 2 == 0 => Mishap::NanOutput,
        k if outage.contains(&k) => Mishap::Lost,
        k if k % 7 == 0 => Mishap::ObservedTwice,
        k if k % 11 == 0 => Mishap::NanDisturbance,
        k if k % 13 == 0 => Mishap::NanPreview,
        _ => Mishap::None,
    })?;
    Ok(())
}

/// What goes wrong in a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mishap {
    None,
    NanOutput,
    NanInput,
    NanDisturbance,
    WrongLength,
    Lost,
    ObservedTwice,
    NanReference,
    NanPreview,
    ForeignReference,
}

impl Mishap {
    /// The reference to offer, and the fault the step must name for it.
    fn reference(self, sizes: &Sizes) -> Result<(Reference, Option<Fault>), ContractViolation> {
        let Sizes { q, horizon, .. } = *sizes;
        let (horizon, value, preview, fault) = match self {
            Self::NanReference => (horizon, f64::NAN, 0.1, Some(Fault::ReferenceNotFinite)),
            Self::ForeignReference => (horizon + 1, 0.0, 0.1, Some(Fault::ReferenceShape)),
            Self::NanPreview if q > 0 => (horizon, 0.3, f64::NAN, Some(Fault::ReferenceNotFinite)),
            _ => (horizon, 0.3, 0.1, None),
        };
        let mut reference = Reference::with_disturbances(horizon, sizes.m, q, sizes.p);
        reference
            .hold(&vec![value; sizes.m], &vec![value; sizes.p])
            .and_then(|()| match q {
                0 => Ok(()),
                _ => reference.hold_disturbances(&vec![preview; q]),
            })
            .map_err(|error| ContractViolation {
                clause: 1,
                what: error.to_string(),
            })?;
        Ok((reference, fault))
    }

    /// Observes the sample in its way; the fault the next step must name.
    fn observe(
        self,
        controller: &mut dyn Controller,
        sizes: &Sizes,
        input: &[f64],
        output: &[f64],
    ) -> Option<Fault> {
        let Sizes { m, p, q, .. } = *sizes;
        let measured = vec![0.1; q];
        let mut observe = |input: &[f64], disturbance: &[f64], output: &[f64]| {
            controller.observe_with_disturbances(input, disturbance, output);
        };
        match self {
            Self::NanOutput => {
                observe(input, &measured, &vec![f64::NAN; p]);
                Some(Fault::MeasurementNotFinite)
            }
            Self::NanInput => {
                observe(&vec![f64::INFINITY; m], &measured, output);
                Some(Fault::MeasurementNotFinite)
            }
            Self::NanDisturbance if q > 0 => {
                observe(input, &vec![f64::NAN; q], output);
                Some(Fault::DisturbanceNotFinite)
            }
            Self::WrongLength => {
                observe(input, &measured, &vec![0.0; p + 1]);
                Some(Fault::MeasurementShape)
            }
            Self::Lost => Some(Fault::MeasurementLost),
            Self::ObservedTwice => {
                observe(input, &measured, output);
                observe(input, &measured, output);
                None
            }
            _ => {
                observe(input, &measured, output);
                None
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Sizes {
    m: usize,
    p: usize,
    q: usize,
    horizon: usize,
}

impl Sizes {
    fn of(controller: &dyn Controller) -> Self {
        Self {
            m: controller.inputs(),
            p: controller.outputs(),
            q: controller.disturbances(),
            horizon: controller.horizon(),
        }
    }
}

/// Hard bounds of the inputs and of their changes.
#[derive(Clone, Copy)]
struct Limits<'a> {
    bounds: &'a [Bounds],
    changes: &'a [Bounds],
}

impl Limits<'_> {
    /// Whether `input` may follow `last`, if that is known.
    fn allow(&self, input: &[f64], last: Option<&[f64]>) -> bool {
        let within = |(u, bounds): (&f64, &Bounds)| u.is_finite() && bounds.violation(*u) == 0.0;
        let changes = |last: &[f64]| {
            let limits = self.bounds.iter().zip(self.changes);
            let mut moves = input.iter().zip(last).zip(limits);
            moves.all(|((u, last), (bounds, change))| {
                let rounding = 1e-12 * (u.abs() + last.abs());
                // Beyond its change only as far as its own bounds demand.
                (u - last <= change.upper_value() + rounding || *u <= bounds.lower_value())
                    && (u - last >= change.lower_value() - rounding || *u >= bounds.upper_value())
            })
        };
        input.len() == self.bounds.len()
            && input.iter().zip(self.bounds).all(within)
            && last.is_none_or(changes)
    }
}

struct Probe<'a> {
    controller: Box<dyn Controller>,
    limits: Limits<'a>,
    sizes: Sizes,
}

impl<'a> Probe<'a> {
    fn new(controller: Box<dyn Controller>, limits: Limits<'a>) -> Self {
        Self {
            sizes: Sizes::of(controller.as_ref()),
            controller,
            limits,
        }
    }

    fn check_sizes(&self) -> Result<(), ContractViolation> {
        let Sizes { m, p, horizon, .. } = self.sizes;
        demand(1, m > 0 && p > 0 && horizon > 0, || {
            format!("sizes {m}, {p}, {horizon}")
        })?;
        let Limits { bounds, changes } = self.limits;
        let fit = m == bounds.len() && m == changes.len();
        demand(1, fit, || {
            let (bounds, changes) = (bounds.len(), changes.len());
            format!("{m} inputs, checked with {bounds} bounds and {changes} of their changes")
        })
    }

    /// The inputs decided. A mishap of sample k is reported in step k (reference) or k + 1
    /// (sample).
    fn run(
        &mut self,
        steps: usize,
        respond: &mut dyn FnMut(usize, &[f64]) -> Vec<f64>,
        mishap_in: impl Fn(usize) -> Mishap,
    ) -> Result<Vec<Vec<f64>>, ContractViolation> {
        let mut inputs: Vec<Vec<f64>> = Vec::with_capacity(steps);
        let mut pending: Option<Fault> = None;
        let mut counts: Option<(Origin, usize, usize)> = None;
        for k in 0..steps {
            let mishap = mishap_in(k);
            let (reference, reference_fault) = mishap.reference(&self.sizes)?;
            // A fault that is only reported gives way to one that stops planning, also to one that
            // lies further back or comes later than those known here.
            let sample_fault = pending.take();
            let expected = sample_fault
                .filter(|fault| fault.stops_planning())
                .or(reference_fault)
                .or(sample_fault);
            let step = self.controller.decide(&reference);
            let reported = expected.is_none_or(|expected| {
                let graver = |found: Fault| !expected.stops_planning() && found.stops_planning();
                step.fault
                    .is_some_and(|found| found == expected || graver(found))
            });
            demand(3, reported, || {
                format!("step {k} reports {:?}, expected {expected:?}", step.fault)
            })?;
            counts = Some(check_counts(k, step, counts)?);
            let input = step.input.clone();
            // Whatever is reported of it, the input decided is the one applied.
            let last = inputs.last().map(Vec::as_slice);
            demand(2, self.limits.allow(&input, last), || {
                format!("step {k} decides {input:?} after {last:?}")
            })?;
            let output = respond(k, &input);
            pending = mishap.observe(self.controller.as_mut(), &self.sizes, &input, &output);
            inputs.push(input);
        }
        let now = Sizes::of(self.controller.as_ref());
        demand(1, now == self.sizes, || "sizes change".into())?;
        Ok(inputs)
    }
}

/// What falls back names a fault, and the steps in a row are counted right. `before` and the
/// result are origin, steps with it and steps that fell back; after a start any count may stand.
fn check_counts(
    k: usize,
    step: &Step,
    before: Option<(Origin, usize, usize)>,
) -> Result<(Origin, usize, usize), ContractViolation> {
    let needs_fault = step.origin.is_fallback() || step.origin == Origin::SecondSolver;
    demand(3, !needs_fault || step.fault.is_some(), || {
        format!("step {k} is a {:?} without a fault", step.origin)
    })?;
    let now = (step.origin, step.origin_steps, step.fallback_steps);
    let Some((origin, in_a_row, fallen_back)) = before else {
        return Ok(now);
    };
    let expected = (
        step.origin,
        if step.origin == origin {
            in_a_row + 1
        } else {
            1
        },
        if step.origin.is_fallback() {
            fallen_back + 1
        } else {
            0
        },
    );
    demand(3, now == expected, || {
        format!("step {k} counts {now:?}, expected {expected:?}")
    })?;
    Ok(now)
}
