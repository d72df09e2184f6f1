//! Which inputs act within their own interval.

use super::candidate::{Candidate, Care, Search};
use super::settings::{Feedthrough, IdentificationSettings, OffsetChoice};
use crate::error::SysidError;
use crate::input_fit::InputStructure;
use crate::working::WorkingData;

/// Where B and D are free at first: everywhere but where a setting says otherwise. The last channel
/// is the constant, which acts only where offsets are to be found.
pub(super) fn first_structure(
    names: &[String],
    settings: &IdentificationSettings,
) -> InputStructure {
    let acts = |name| !settings.without_effect.contains(name);
    let mut dynamics: Vec<bool> = names.iter().map(acts).collect();
    let mut feedthrough: Vec<bool> = (dynamics.iter().enumerate())
        .map(|(input, &acts)| {
            acts && match &settings.feedthrough {
                Feedthrough::Automatic => true,
                Feedthrough::None => false,
                Feedthrough::PerInput(flags) => flags[input],
            }
        })
        .collect();
    dynamics.push(false);
    feedthrough.push(settings.offsets == OffsetChoice::Found);
    InputStructure {
        dynamics,
        feedthrough,
    }
}

/// Free entries of D, the offsets of the outputs included where they are free.
pub(super) fn entries(structure: &InputStructure, outputs: usize) -> usize {
    structure.feedthrough.iter().filter(|&&free| free).count() * outputs
}

/// Takes D away input by input, as long as the information criterion does not object: the input whose
/// D is missed least first.
pub(super) fn eliminate(
    search: &mut Search<'_>,
    data: &WorkingData,
    mut best: Candidate,
) -> Result<Candidate, SysidError> {
    let p = data.outputs.len();
    let samples = data.samples() as f64;
    // One column of D has p entries; the loss is per sample and output.
    let price = (samples * p as f64).ln() / samples;
    loop {
        let inputs = search.structure.dynamics.len() - 1;
        let free: Vec<_> = (0..inputs)
            .filter(|&input| search.structure.feedthrough[input])
            .collect();
        let full = search.structure.clone();
        let mut cheapest: Option<(usize, Candidate)> = None;
        for input in free {
            search.structure = full.clone();
            search.structure.feedthrough[input] = false;
            let without = search.refitted(data, &best, Care::Rough)?;
            if cheapest
                .as_ref()
                .is_none_or(|(_, found)| without.loss < found.loss)
            {
                cheapest = Some((input, without));
            }
        }
        search.structure = full;
        match cheapest {
            Some((input, without)) if without.loss - best.loss <= price => {
                search.structure.feedthrough[input] = false;
                best = without;
            }
            _ => return Ok(best),
        }
    }
}
