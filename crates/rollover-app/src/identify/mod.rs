//! `identify`: from a recording to a model file, a report and figures.
//!
//! Everything is computed before the first file is written: whatever goes wrong until then, and whenever
//! the user stops the program, the folder is as it was. Each file is then written whole, the page last.

mod figures;
mod files;
mod page;
mod recording;
mod results;
mod words;

use std::ops::ControlFlow;

use anyhow::Result;
use deepc_core::data::{Dataset, Record};
use sysid::{
    Identification, IdentificationSettings, Progress, SysidError, Validation, ValidationSettings,
    identify_with,
};

use crate::cli::IdentifyArgs;
use crate::interrupt::Interrupt;
use crate::output::{print_json, print_line};
use crate::progress;
use results::{JudgedOn, Results};

/// What an interruption leaves.
const UNTOUCHED: &str = "nothing was written";

/// Identifies a model and writes what there is to know about it.
///
/// # Errors
/// The recording cannot be used, a result cannot be written, or the user stopped the program.
pub fn identify(args: &IdentifyArgs, interrupt: &Interrupt) -> Result<()> {
    let layout = recording::layout(args)?;
    let data = recording::read(&layout, &args.recordings, "the recording")?;
    let (judge, judged_on) = if args.validate.is_empty() {
        (None, JudgedOn::SameRecording)
    } else {
        let judge = recording::read(&layout, &args.validate, "the recording for validation")?;
        (Some(judge), JudgedOn::Others(names(&args.validate)))
    };
    let judge = judge.as_ref().unwrap_or(&data);
    // A minute of work is no way to learn of a typing error.
    files::check_folder(&args.out)?;

    let settings = IdentificationSettings {
        order: args.order,
        max_order: args.max_order,
        without_effect: args.without_effect.clone(),
        offsets: args.offsets.into(),
        ..IdentificationSettings::default()
    };
    let identification = with_progress(&data, &settings, interrupt)?;
    let validation = Validation::of(
        &identification.model,
        judge,
        &validation_settings(judge, args.steps, identification.model.order()),
    )?;
    interrupt.check("after the validation", UNTOUCHED)?;
    let results = Results::new(
        names(&args.recordings),
        judged_on,
        identification,
        validation,
    )?;
    let figures = figures::draw_all(&results, &data, judge)?;
    let page = page::render(&results, &figures)?;
    interrupt.check("before the results were written", UNTOUCHED)?;
    files::write_all(&args.out, &results, &figures, &page)?;
    if args.json {
        print_json(&results.report)
    } else {
        print_line(&words::summary(&results))?;
        print_line(&format!(
            "model: {}, page: {}",
            args.out.join(files::MODEL).display(),
            args.out.join(files::PAGE).display()
        ))
    }
}

fn names(files: &[std::path::PathBuf]) -> Vec<String> {
    files.iter().map(|f| f.display().to_string()).collect()
}

fn with_progress(
    data: &Dataset,
    settings: &IdentificationSettings,
    interrupt: &Interrupt,
) -> Result<Identification> {
    let bar = progress::bar(0, "identification");
    let mut show = |progress: &Progress| {
        if interrupt.is_raised() {
            return ControlFlow::Break(());
        }
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
        bar.set_message(progress.stage);
        ControlFlow::Continue(())
    };
    let found = identify_with(data, settings, &mut show);
    bar.finish_and_clear();
    if let Err(SysidError::Interrupted { done, total }) = found {
        let after = format!("after {done} of {total} steps of the identification");
        interrupt.check(&after, UNTOUCHED)?;
    }
    interrupt.check("after the identification", UNTOUCHED)?;
    Ok(found?)
}

/// The defaults, with fewer steps and lags if all records are short.
fn validation_settings(data: &Dataset, steps: usize, order: usize) -> ValidationSettings {
    let longest = data.records().iter().map(Record::samples).max();
    let free = longest.unwrap_or(0).saturating_sub(order + 2);
    let defaults = ValidationSettings::default();
    ValidationSettings {
        // 0 is for the library to refuse.
        steps: steps.min(free.max(1)),
        lags: defaults.lags.min(free / 2).max(1),
        ..defaults
    }
}
