//! Measures the table of costs and times.

use std::fmt;

use anyhow::Result;
use sysid::Progress;

use super::agreement::{compare, cost, gap, on_data, same_problem};
use super::moments::{self, Past};
use super::replay::{Replayed, replay};
use super::written::{AtMoments, Whose, as_written, condensed};
use super::{
    Follow, LoggedRun, TimedForm, TimedMethod, Timing, TimingError, TimingRow, TimingTable,
};
use crate::closed_loop::{self, Watch, deepc_problem};
use crate::output::table_text;
use crate::scenario::{DataMatrix, Prediction};

/// Times every form of every method, one after the other on this thread.
///
/// # Errors
/// [`TimingError`] when the runs cannot be timed; as [`Interrupted`](crate::interrupt::Interrupted)
/// when the user stops it.
pub fn measure(timing: &Timing<'_>, mut follow: Follow<'_>) -> Result<TimingTable> {
    same_problem(&timing.deepc, &timing.rd_deepc)?;
    let moments = moments::at_bounds(&timing.rd_deepc, timing.moments)?;
    let mut work = Work {
        done: 0,
        // What is solved as written, three set-ups and up to three replays.
        total: (1 + usize::from(timing.deepc_as_written)) * moments.len() + 6,
    };
    // The smaller one first: it is the yardstick.
    let rd_deepc = on_matrix(
        timing,
        TimedMethod::RdDeepc,
        &moments,
        &mut follow,
        &mut work,
    )?;
    let deepc = on_matrix(timing, TimedMethod::Deepc, &moments, &mut follow, &mut work)?;
    let model = timing
        .lmpc
        .as_ref()
        .map(|run| on_model(timing, run, &mut follow, &mut work));
    let yardstick_s = median(&rd_deepc.written.times_s);
    let references = &deepc.condensed.objectives;
    let mut rows = Vec::new();
    let written = [&deepc, &rd_deepc].into_iter();
    for measured in written.filter(|m| !m.written.times_s.is_empty()) {
        rows.push(measured.written_row(references));
    }
    for measured in [&deepc, &rd_deepc] {
        rows.push(measured.condensed_row(references));
    }
    if let Some(model) = model {
        rows.push(model?);
    }
    for row in &mut rows {
        row.time_to_rd_deepc = row.step_s_median / yardstick_s;
    }
    let written = timing
        .deepc_as_written
        .then_some((&deepc.written, &rd_deepc.written));
    Ok(TimingTable {
        rows,
        moments_s: moments.iter().map(|past| past.time_s).collect(),
        deepc_equals_rd_deepc: compare(&timing.deepc, &timing.rd_deepc, written),
    })
}

/// How far the work is.
struct Work {
    done: usize,
    total: usize,
}

impl Work {
    fn next(&mut self, follow: &mut Follow<'_>, what: &str) {
        (follow.progress)(self.done.min(self.total), self.total, what);
        self.done += 1;
    }
}

/// What one data matrix gave.
struct OnMatrix<'a> {
    method: TimedMethod,
    run: LoggedRun<'a>,
    rows: usize,
    columns: usize,
    written: AtMoments,
    condensed: AtMoments,
    replayed: Replayed,
    /// Name of the run it was replayed along.
    along: &'a str,
}

fn on_matrix<'a>(
    timing: &Timing<'a>,
    method: TimedMethod,
    moments: &[Past],
    follow: &mut Follow<'_>,
    work: &mut Work,
) -> Result<OnMatrix<'a>> {
    let (run, matrix) = match method {
        TimedMethod::Deepc => (timing.deepc, DataMatrix::Whole),
        _ => (timing.rd_deepc, DataMatrix::Reduced),
    };
    work.next(follow, &format!("{method}: set-up"));
    let by_data = on_data(&run, matrix)?;
    let problem = deepc_problem(timing.scenario, run.settings, by_data, timing.recorded)?;
    let whose = |form| Whose {
        controller: run.name,
        form,
    };
    let condensed = condensed(whose(TimedForm::Condensed), &problem, moments, follow)?;
    let form = TimedForm::AsWritten;
    let written = if method == TimedMethod::Deepc && !timing.deepc_as_written {
        AtMoments::default()
    } else {
        as_written(whose(form), &problem, moments, follow, &mut |follow| {
            work.next(follow, &format!("{method} {form}"));
        })?
    };
    work.next(follow, &format!("{method}: condensed"));
    let along = if run.log.is_empty() {
        timing.rd_deepc
    } else {
        run
    };
    let (rows, columns) = (problem.0.stacked().nrows(), problem.0.stacked().ncols());
    Ok(OnMatrix {
        method,
        run,
        rows,
        columns,
        written,
        condensed,
        replayed: replay_along(timing, &run, &along, follow)?,
        along: along.name,
    })
}

/// Builds the controller of `run` and asks it along the log of another one.
fn replay_along(
    timing: &Timing<'_>,
    run: &LoggedRun<'_>,
    along: &LoggedRun<'_>,
    follow: &mut Follow<'_>,
) -> Result<Replayed> {
    let watch = Watch {
        interrupt: follow.interrupt,
        progress: &|_: &Progress| {},
    };
    let built = closed_loop::controller(timing.scenario, run.settings, timing.recorded, watch)?;
    let mut controller = built.controller;
    replay(controller.as_mut(), along.log, follow.interrupt)
}

fn on_model(
    timing: &Timing<'_>,
    run: &LoggedRun<'_>,
    follow: &mut Follow<'_>,
    work: &mut Work,
) -> Result<TimingRow> {
    if !matches!(run.settings.prediction, Prediction::Model(_)) {
        return Err(TimingError::Method {
            controller: run.name.to_owned(),
            wanted: "LMPC",
            method: "lmpc",
        }
        .into());
    }
    work.next(follow, "LMPC: set-up");
    let along = if run.log.is_empty() {
        &timing.rd_deepc
    } else {
        run
    };
    work.next(follow, "LMPC");
    let replayed = replay_along(timing, run, along, follow)?;
    let (paper_cost, paper_time_s) = TimedMethod::Lmpc.paper();
    Ok(TimingRow {
        paper_cost: Some(paper_cost),
        paper_time_s: Some(paper_time_s),
        paper_time_to_rd_deepc: Some(paper_time_s / TimedMethod::RdDeepc.paper().1),
        ..replayed_row(
            TimedMethod::Lmpc,
            TimedForm::LinearMpc,
            run,
            (&replayed, along.name),
        )
    })
}

/// The row of a controller that was asked again.
fn replayed_row(
    method: TimedMethod,
    form: TimedForm,
    run: &LoggedRun<'_>,
    (replayed, along): (&Replayed, &str),
) -> TimingRow {
    let own = !run.log.is_empty();
    let note = if own {
        let difference = if replayed.difference > 0.0 {
            format!("differ from the log by at most {:.0e}", replayed.difference)
        } else {
            "are those of the log".into()
        };
        format!("the controller asked again at every step of its run; its decisions {difference}")
    } else {
        format!(
            "the controller asked at every step of the run of {along}; it was not driven itself"
        )
    };
    TimingRow {
        method,
        form,
        controller: run.name.to_owned(),
        rows: None,
        columns: None,
        paper_cost: None,
        paper_time_s: None,
        cost: own.then(|| cost(run)),
        step_s_median: median(&replayed.times_s),
        step_s_min: least(&replayed.times_s),
        steps_timed: replayed.times_s.len(),
        steps_at_bounds: replayed.at_bounds,
        bounds_active: None,
        objectives: Vec::new(),
        objective_gap: None,
        time_to_rd_deepc: f64::NAN,
        paper_time_to_rd_deepc: None,
        note,
    }
}

impl OnMatrix<'_> {
    fn written_row(&self, references: &[f64]) -> TimingRow {
        let (paper_cost, paper_time_s) = self.method.paper();
        let steps = self.written.times_s.len();
        TimingRow {
            form: TimedForm::AsWritten,
            paper_cost: Some(paper_cost),
            paper_time_s: Some(paper_time_s),
            paper_time_to_rd_deepc: Some(paper_time_s / TimedMethod::RdDeepc.paper().1),
            cost: None,
            step_s_median: median(&self.written.times_s),
            step_s_min: least(&self.written.times_s),
            steps_timed: steps,
            // The moments were chosen so; the condensed optimum knows for certain.
            steps_at_bounds: self.condensed.active.iter().filter(|&&n| n > 0).count(),
            objectives: self.written.objectives.clone(),
            objective_gap: Some(gap(&self.written.objectives, references)),
            note: format!("all variables, interior-point solver, {steps} moments of the run"),
            ..self.condensed_row(references)
        }
    }

    fn condensed_row(&self, references: &[f64]) -> TimingRow {
        let active = &self.condensed.active;
        let mean = active.iter().sum::<usize>() as f64 / active.len().max(1) as f64;
        let replayed = (&self.replayed, self.along);
        TimingRow {
            rows: Some(self.rows),
            columns: Some(self.columns),
            bounds_active: Some(mean),
            objectives: self.condensed.objectives.clone(),
            objective_gap: Some(gap(&self.condensed.objectives, references)),
            ..replayed_row(self.method, TimedForm::Condensed, &self.run, replayed)
        }
    }
}

/// The middle value, or the mean of the two in the middle; 0 without any.
fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = ((sorted.len().max(1) - 1) / 2, sorted.len() / 2);
    match (sorted.get(low), sorted.get(high)) {
        (Some(low), Some(high)) => 0.5 * (low + high),
        _ => 0.0,
    }
}

fn least(times: &[f64]) -> f64 {
    times.iter().copied().reduce(f64::min).unwrap_or(0.0)
}

impl fmt::Display for TimingTable {
    /// The table for a terminal, and a sentence on `DeePC` and RD-DeePC.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = [
            "method",
            "form",
            "matrix",
            "steps",
            "cost",
            "paper",
            "time of a step",
            "paper",
            "÷ RD-DeePC as written",
            "paper",
        ];
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "–".into());
        let cells = |row: &TimingRow| {
            let matrix = row.rows.zip(row.columns);
            vec![
                row.method.to_string(),
                row.form.to_string(),
                or_dash(matrix.map(|(rows, columns)| format!("{rows}×{columns}"))),
                row.steps_timed.to_string(),
                or_dash(row.cost.map(|cost| format!("{cost:.4e}"))),
                or_dash(row.paper_cost.map(|cost| cost.to_string())),
                seconds(row.step_s_median),
                or_dash(row.paper_time_s.map(seconds)),
                ratio(row.time_to_rd_deepc),
                or_dash(row.paper_time_to_rd_deepc.map(ratio)),
            ]
        };
        let rows: Vec<_> = self.rows.iter().map(cells).collect();
        let right: Vec<usize> = (2..header.len()).collect();
        writeln!(f, "{}", table_text(&header, &rows, &right))?;
        write!(f, "{}", self.deepc_equals_rd_deepc)
    }
}

/// A time with a unit that suits it.
fn seconds(time: f64) -> String {
    match time {
        long if long >= 1.0 => format!("{long:.2} s"),
        short if short >= 1e-3 => format!("{:.3} ms", short * 1e3),
        _ => format!("{:.1} µs", time * 1e6),
    }
}

fn ratio(ratio: f64) -> String {
    if ratio >= 0.01 {
        format!("{ratio:.3}")
    } else {
        format!("{ratio:.1e}")
    }
}
