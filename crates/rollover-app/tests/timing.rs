//! The table of costs and times, on a scenario small enough for a test.

use std::path::Path;

use deepc_core::data::Dataset;
use rollover_app::closed_loop::{self, Recorded, Run, Watch};
use rollover_app::interrupt::{Interrupt, Interrupted};
use rollover_app::record::record;
use rollover_app::run_log::LogRow;
use rollover_app::scenario::{self, Scenario};
use rollover_app::terrain;
use rollover_app::timing::{
    Follow, LoggedRun, TimedForm, TimedMethod, Timing, TimingTable, deepc_equals_rd_deepc, measure,
};
use vehicle_dyn::simulation::ReadyVehicle;

const SCENARIO: &str = include_str!("../../../scenarios/sedan-s1.toml");
const SEED: u64 = 10;

/// The scenario with `DeePC` beside RD-DeePC, its horizons changed.
fn scenario(folder: &Path, steps: usize) -> Scenario {
    let text = SCENARIO
        .replace("past_steps = 100", &format!("past_steps = {steps}"))
        .replace("horizon_steps = 100", &format!("horizon_steps = {steps}"))
        + "\n[controllers.deepc-test]\nlike = \"rd-deepc-1\"\nmethod = \"deepc\"\n";
    let path = folder.join("small.toml");
    std::fs::write(&path, text).expect("the file can be written");
    scenario::load(path.to_str().expect("UTF-8")).expect("the scenario is good")
}

/// Runs a controller and returns its log.
fn drive(scenario: &Scenario, recorded: &Recorded<'_>, name: &str, folder: &Path) -> Vec<LogRow> {
    let interrupt = Interrupt::default();
    let watch = Watch {
        interrupt: &interrupt,
        progress: &|_| {},
    };
    let vehicle = vehicle_dyn::vehicles::embedded(&scenario.vehicle).expect("it is built in");
    let vehicle = ReadyVehicle::new(vehicle).expect("its parameters are allowed");
    let settings = scenario.controller(name).expect("it is there");
    let built = closed_loop::controller(
        scenario,
        settings.expect("it is not the driver"),
        recorded,
        watch,
    );
    let terrain = terrain::build(&scenario.ground, &scenario.course, &interrupt);
    let run = Run {
        seed: SEED,
        controller: Some(built.expect("the recording is good").controller),
        ..Run::of_driver(scenario, &vehicle, terrain.expect("the ground is good"))
    };
    let log = folder.join(format!("{name}.csv"));
    let finished = closed_loop::run(run, Some(&log), &interrupt, || {}).expect("it runs");
    finished.rows
}

fn recording(scenario: &Scenario) -> Dataset {
    let vehicle = vehicle_dyn::vehicles::embedded(&scenario.vehicle).expect("it is built in");
    let vehicle = ReadyVehicle::new(vehicle).expect("its parameters are allowed");
    let recorded = record(scenario, &vehicle, SEED, &Interrupt::default());
    recorded.expect("it records").0
}

struct Case {
    scenario: Scenario,
    data: Dataset,
    folder: tempfile::TempDir,
}

/// Logs of the three runs.
type Logs = [Vec<LogRow>; 3];

const NAMES: [&str; 3] = ["deepc-test", "rd-deepc-1", "lmpc-1-no-speed-effect"];

impl Case {
    fn new(steps: usize) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let scenario = scenario(folder.path(), steps);
        Self {
            data: recording(&scenario),
            scenario,
            folder,
        }
    }

    fn logs(&self, recorded: &Recorded<'_>) -> Logs {
        NAMES.map(|name| drive(&self.scenario, recorded, name, self.folder.path()))
    }

    fn run<'a>(&'a self, name: &'a str, log: &'a [LogRow]) -> LoggedRun<'a> {
        LoggedRun {
            name,
            settings: &self.scenario.controllers[name],
            log,
        }
    }

    fn timing<'a>(
        &'a self,
        recorded: &'a Recorded<'a>,
        logs: &'a Logs,
        moments: usize,
    ) -> Timing<'a> {
        let [deepc, rd_deepc, lmpc] = [0, 1, 2].map(|i| self.run(NAMES[i], &logs[i]));
        Timing {
            scenario: &self.scenario,
            recorded,
            deepc,
            rd_deepc,
            lmpc: Some(lmpc),
            moments,
            deepc_as_written: true,
        }
    }
}

/// Measures, and counts what was told of the progress.
fn measured(timing: &Timing<'_>) -> (TimingTable, usize) {
    let interrupt = Interrupt::default();
    let mut told = 0;
    let mut progress = |done: usize, total: usize, what: &str| {
        assert!(
            done < total && !what.is_empty(),
            "{done} of {total}: {what}"
        );
        assert_eq!(done, told, "every piece is told");
        told += 1;
    };
    let follow = Follow {
        interrupt: &interrupt,
        progress: &mut progress,
    };
    let table = measure(timing, follow).expect("it can be timed");
    (table, told)
}

fn check(table: &TimingTable, rows: usize, columns: [usize; 2], moments: usize) {
    use TimedForm::{AsWritten, Condensed, LinearMpc};
    use TimedMethod::{Deepc, Lmpc, RdDeepc};
    let found: Vec<_> = table
        .rows
        .iter()
        .map(|row| (row.method, row.form))
        .collect();
    let expected = [
        (Deepc, AsWritten),
        (RdDeepc, AsWritten),
        (Deepc, Condensed),
        (RdDeepc, Condensed),
        (Lmpc, LinearMpc),
    ];
    assert_eq!(found, expected);
    for row in &table.rows {
        assert!(
            0.0 < row.step_s_min && row.step_s_min <= row.step_s_median,
            "{row:?}"
        );
        assert!(
            row.steps_at_bounds <= row.steps_timed && row.steps_at_bounds > 0,
            "{row:?}"
        );
        assert_eq!(row.cost.is_some(), row.form != AsWritten);
        if row.method != Lmpc {
            let width = columns[usize::from(row.method == RdDeepc)];
            assert_eq!((row.rows, row.columns), (Some(rows), Some(width)));
            assert_eq!(row.objectives.len(), moments);
            assert!(row.objective_gap.is_some_and(|gap| gap < 1e-6), "{row:?}");
            assert!(
                row.bounds_active.is_some_and(|active| active >= 1.0),
                "{row:?}"
            );
        }
        if row.form == AsWritten {
            assert_eq!((row.steps_timed, row.steps_at_bounds), (moments, moments));
        } else {
            assert!(
                row.note.ends_with("are those of the log"),
                "decisions are the log's: {}",
                row.note
            );
        }
    }
    let ratio = table.rows[1].time_to_rd_deepc;
    assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
    assert_eq!(table.rows[0].paper_time_s, Some(1.446));
    assert_eq!(table.rows[4].paper_cost, Some(74.13));
    let agreement = &table.deepc_equals_rd_deepc;
    assert!(agreement.agrees && agreement.steps > 1000, "{agreement:?}");
    let written = agreement.as_written.as_ref().expect("both were solved");
    assert_eq!(written.moments, moments);
    assert!(written.objective_relative < 1e-6, "{written:?}");
    assert!(written.steering_wheel_max_deg < 1e-6, "{written:?}");
    assert!(written.target_speed_max_kmh < 1e-6, "{written:?}");
    assert_eq!(table.moments_s.len(), moments);
}

#[test]
fn every_form_is_timed_and_deepc_equals_rd_deepc() {
    let case = Case::new(10);
    let recorded = Recorded::new(&case.data);
    let logs = case.logs(&recorded);
    let timing = case.timing(&recorded, &logs, 3);
    let (table, told) = measured(&timing);
    println!("{table}");
    assert!(told >= 2 * 3 + 3, "{told}");
    check(&table, 60, [case.data.records()[0].samples() - 19, 60], 3);

    let apart = deepc_equals_rd_deepc(&timing.deepc, &timing.rd_deepc).expect("both were driven");
    assert!(apart.as_written.is_none() && apart.agrees);

    // As programs read it: nothing is not a number.
    let json = serde_json::to_value(&table).expect("it can be written");
    assert_eq!(json["rows"][0]["method"], "deepc");
    assert_eq!(json["rows"][0]["form"], "as_written");
    assert!(json["rows"][0]["cost"].is_null());
    assert!(json["rows"][4]["rows"].is_null());
    assert!(json["rows"][0]["time_to_rd_deepc"].is_number());

    refused(&case, &timing);
}

/// What cannot be timed is told with what to give instead.
fn refused(case: &Case, timing: &Timing<'_>) {
    let interrupt = Interrupt::default();
    let attempt = |timing: &Timing<'_>, interrupt: &Interrupt| {
        let follow = Follow {
            interrupt,
            progress: &mut |_, _, _| {},
        };
        measure(timing, follow).expect_err("it must be refused")
    };
    let says = |error: &anyhow::Error, pieces: &[&str]| {
        let message = format!("{error:#}");
        for piece in pieces {
            assert!(message.contains(piece), "`{piece}` in {message}");
        }
    };

    let straight = Timing {
        rd_deepc: case.run("rd-deepc-1", &timing.rd_deepc.log[..100]),
        ..*timing
    };
    says(
        &attempt(&straight, &interrupt),
        &[
            "rd-deepc-1 has 0 steps with active bounds",
            "3 are to be timed",
        ],
    );
    let swapped = Timing {
        deepc: timing.rd_deepc,
        ..*timing
    };
    says(
        &attempt(&swapped, &interrupt),
        &["rd-deepc-1 cannot be timed as DeePC", "method = \"deepc\""],
    );
    let unlike = Timing {
        rd_deepc: case.run("rd-deepc-2", timing.rd_deepc.log),
        ..*timing
    };
    says(
        &attempt(&unlike, &interrupt),
        &["differ in `input_weights`", "like"],
    );
    let undriven = case.run("deepc-test", &[]);
    let error = deepc_equals_rd_deepc(&undriven, &timing.rd_deepc).expect_err("no run");
    says(&error.into(), &["deepc-test has no run", "drive it first"]);
    interrupt.raise();
    let error = attempt(timing, &interrupt);
    assert!(error.downcast_ref::<Interrupted>().is_some(), "{error:#}");
}

/// The paper's size. A minute, and on a loaded machine two: run it with `--ignored`.
#[test]
#[ignore = "a minute of solving at the paper's size"]
fn the_papers_size() {
    let case = Case::new(100);
    let recorded = Recorded::new(&case.data);
    let logs = case.logs(&recorded);
    let started = std::time::Instant::now();
    let (table, _) = measured(&case.timing(&recorded, &logs, 3));
    println!("{table}\nin {:.1} s", started.elapsed().as_secs_f64());
    println!(
        "{}",
        serde_json::to_string_pretty(&table).expect("it can be written")
    );
    check(&table, 600, [3001, 600], 3);
}
