//! How sensitive the outcome of `sedan-s1` is to what the paper leaves open.
//!
//! One thing at a time is changed; the recordings are those of seeds 10 to 19, on which nothing was
//! chosen; the course is driven as it is. Writes a table in Markdown on standard output.
//!
//! ```sh
//! cargo run --release -p rollover-app --example sensitivity > docs/sensitivity.md
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, Result};
use deepc_core::program::Regularisation;
use rollover_app::closed_loop::{self, Recorded, Run, SteeringProfile, Watch};
use rollover_app::interrupt::Interrupt;
use rollover_app::record::record;
use rollover_app::scenario::{
    ControllerSettings, DataSettings, ModelSettings, Prediction, ReferenceAhead, Scenario, load,
};
use rollover_app::summary::{RunIdentity, Summary};
use rollover_app::terrain;
use sysid::OffsetChoice;
use sysid::lmpc::OffsetHandling;
use vehicle_dyn::metrics::Outcome;
use vehicle_dyn::simulation::ReadyVehicle;

const SEEDS: std::ops::Range<u64> = 10..20;
/// Steering-wheel weight of 1/rad², per deg².
const PER_RAD2: f64 = (std::f64::consts::PI / 180.0) * (std::f64::consts::PI / 180.0);
/// Speed weight of 1/(m/s)², per (km/h)².
const PER_M_S2: f64 = 1.0 / (3.6 * 3.6);

type Change = Box<dyn Fn(&mut Scenario, &mut ControllerSettings) + Sync + Send>;

/// What the runs came to, by variant and seed; nothing if the recording gives no controller.
type Found = BTreeMap<(usize, u64), Result<Option<Summary>>>;

/// One change to a scenario and to the controller in question.
struct Variant {
    /// Controller that is changed.
    of: &'static str,
    words: String,
    change: Change,
}

fn variant(
    of: &'static str,
    words: impl Into<String>,
    change: impl Fn(&mut Scenario, &mut ControllerSettings) + Sync + Send + 'static,
) -> Variant {
    Variant {
        of,
        words: words.into(),
        change: Box::new(change),
    }
}

fn data(settings: &mut ControllerSettings) -> &mut DataSettings {
    match &mut settings.prediction {
        Prediction::Data(data) => data,
        Prediction::Model(_) => unreachable!("only changes of RD-DeePC ask"),
    }
}

fn model(settings: &mut ControllerSettings) -> &mut ModelSettings {
    match &mut settings.prediction {
        Prediction::Model(model) => model,
        Prediction::Data(_) => unreachable!("only changes of the LMPC ask"),
    }
}

fn per_column(lambda_g: f64) -> Regularisation {
    Regularisation::per_column(lambda_g)
}

fn raw(lambda_g: f64) -> Regularisation {
    Regularisation::raw(lambda_g)
}

fn variants() -> Vec<Variant> {
    let mut all = Vec::new();
    for of in ["rd-deepc-1", "rd-deepc-1-paper"] {
        all.extend(shared(of));
        all.push(variant(of, "λ_u = 1e2", |_, c| data(c).lambda_u = 1e2));
        for lambda_y in [1e6, 1e10] {
            let words = format!("λ_y = {lambda_y:.0e}");
            all.push(variant(of, words, move |_, c| data(c).lambda_y = lambda_y));
        }
    }
    let of = "rd-deepc-1";
    for lambda_g in [6.0, 600.0] {
        let words = format!(
            "λ_g = {lambda_g} per column ({:.0e} raw)",
            lambda_g * 3001.0
        );
        all.push(variant(of, words, move |_, c| {
            data(c).regularisation = per_column(lambda_g);
        }));
    }
    let of = "rd-deepc-1-paper";
    for lambda_g in [1e4, 1e5, 1e6] {
        all.push(variant(
            of,
            format!("λ_g = {lambda_g:.0e} raw"),
            move |_, c| {
                data(c).regularisation = raw(lambda_g);
            },
        ));
    }
    all.push(variant(of, "λ_g = 100 per column", |_, c| {
        data(c).regularisation = per_column(100.0);
    }));
    let of = "lmpc-1";
    all.push(variant(of, "as it is", |_, _| {}));
    all.extend(limits(of));
    all.push(preview(of));
    all.push(variant(of, "order 4", |_, c| {
        model(c).identification.order = Some(4);
    }));
    all.push(variant(of, "means removed", |_, c| {
        model(c).identification.offsets = OffsetChoice::Means;
    }));
    all.push(variant(of, "raw data (through the origin)", |_, c| {
        model(c).identification.offsets = OffsetChoice::None;
    }));
    all.push(variant(of, "no disturbance model", |_, c| {
        model(c).offset_handling = OffsetHandling::None;
    }));
    all.push(variant(
        of,
        "order 4, raw data, no disturbance model",
        |_, c| {
            let model = model(c);
            model.identification.order = Some(4);
            model.identification.offsets = OffsetChoice::None;
            model.offset_handling = OffsetHandling::None;
        },
    ));
    all.push(variant(of, "speed gain held at zero", |_, c| {
        model(c).identification.without_effect = vec!["target_speed_kmh".into()];
    }));
    let sections = ["rd-deepc-1", "rd-deepc-1-paper", "lmpc-1"];
    all.sort_by_key(|v| sections.iter().position(|of| *of == v.of));
    all
}

fn limits(of: &'static str) -> impl Iterator<Item = Variant> {
    let limits = [0.8, 0.88, 0.92, 0.95, 1.0];
    limits.into_iter().map(move |limit| {
        variant(of, format!("limit {limit} on LTR"), move |_, c| {
            c.ltr_limit = limit;
        })
    })
}

fn preview(of: &'static str) -> Variant {
    variant(of, "u_r previewed, not held", |_, c| {
        c.reference = ReferenceAhead::Preview;
    })
}

/// What RD-DeePC is asked with either settings.
fn shared(of: &'static str) -> Vec<Variant> {
    let mut all = vec![variant(of, "as it is", |_, _| {})];
    all.extend(limits(of));
    all.push(preview(of));
    for past in [10, 50] {
        all.push(variant(of, format!("T_ini = {past}"), move |_, c| {
            c.past_steps = past;
        }));
    }
    all.push(variant(of, "N = 50", |_, c| c.horizon_steps = 50));
    for moves in [2, 5] {
        all.push(variant(
            of,
            format!("{moves} moves per solve"),
            move |_, c| {
                c.moves_per_solve = moves;
            },
        ));
    }
    all.push(variant(of, "R per rad², (km/h)²", |_, c| {
        c.input_weights.steering_wheel_per_deg2 *= PER_RAD2;
    }));
    all.push(variant(of, "R per rad², (m/s)²", |_, c| {
        c.input_weights.steering_wheel_per_deg2 *= PER_RAD2;
        c.input_weights.target_speed_per_kmh2 *= PER_M_S2;
    }));
    all.push(variant(of, "R per deg², (m/s)²", |_, c| {
        c.input_weights.target_speed_per_kmh2 *= PER_M_S2;
    }));
    all.push(variant(of, "T = 3000 (30 s)", |s, _| {
        s.recording.duration_s = 30.0;
    }));
    all.push(variant(of, "3° of noise on the wheel", |s, _| {
        s.recording.steering_wheel_noise_deg = 3.0;
    }));
    all.push(variant(of, "1 km/h of noise on the speed", |s, _| {
        s.recording.target_speed_noise_kmh = 1.0;
    }));
    all
}

/// Drives a variant. Its recording is the one given unless it changes the recipe.
fn drive(
    variant: &Variant,
    seed: u64,
    vehicle: &ReadyVehicle,
    usual: &Recorded<'_>,
) -> Result<Option<Summary>> {
    let mut scenario = load("sedan-s1")?;
    let recipe = format!("{:?}", scenario.recording);
    let mut settings = scenario.controllers[variant.of].clone();
    (variant.change)(&mut scenario, &mut settings);
    let interrupt = Interrupt::default();
    let own = if format!("{:?}", scenario.recording) == recipe {
        None
    } else {
        match record(&scenario, vehicle, seed, &interrupt) {
            Ok((recording, _)) => Some(recording),
            Err(_) => return Ok(None),
        }
    };
    let own = own.as_ref().map(Recorded::new);
    let recorded = own.as_ref().unwrap_or(usual);
    let watch = Watch {
        interrupt: &interrupt,
        progress: &|_| (),
    };
    let Ok(built) = closed_loop::controller(&scenario, &settings, recorded, watch) else {
        return Ok(None);
    };
    let terrain = terrain::build(&scenario.ground, &scenario.course, &interrupt)?;
    let preview = match settings.reference {
        ReferenceAhead::Held => None,
        ReferenceAhead::Preview => {
            Some(SteeringProfile::record(&scenario, vehicle, &terrain, seed)?)
        }
    };
    let run = Run {
        seed,
        preview,
        controller: Some(built.controller),
        ..Run::of_driver(&scenario, vehicle, terrain)
    };
    let finished = closed_loop::run(run, None, &interrupt, || ())?;
    let identity = RunIdentity {
        speed_reference_kmh: scenario.speed_reference_kmh,
        turns_m: scenario.course.turns_m(),
        ..RunIdentity::default()
    };
    // Costs are compared with the paper's units, whatever was optimised.
    let weights = load("sedan-s1")?.controllers[variant.of].input_weights;
    Ok(Some(Summary::of_log(
        identity,
        finished.outcome,
        &finished.rows,
        Some(&weights),
        scenario.sample_time_s,
    )))
}

fn row(words: &str, runs: &[Option<Summary>]) -> String {
    let made = || runs.iter().flatten();
    let count = |holds: &dyn Fn(&Summary) -> bool| made().filter(|run| holds(run)).count();
    let completed = count(&|run| run.outcome == Outcome::Completed);
    let safe = count(&|run| run.outcome == Outcome::Completed && run.ltr_violation_s <= 0.0);
    let rolled = count(&|run| run.outcome == Outcome::RolledOver);
    let values = |of: fn(&Summary) -> f64| made().map(of).collect::<Vec<_>>();
    let largest = |of| values(of).into_iter().fold(0.0_f64, f64::max);
    let median = |of| {
        let mut sorted = values(of);
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len().saturating_sub(1) / 2).copied()
    };
    let lowest = values(|run| run.speed_min_kmh)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let or_dash = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"))
    };
    format!(
        "| {words} | {completed}/{n} | {safe} | {rolled} | {} | {:.2} | {:.1} m | {}° | {lowest:.1} | {} |",
        or_dash(median(|run| run.ltr_abs_max), 3),
        largest(|run| run.ltr_abs_max),
        largest(|run| run.path_deviation_max_m),
        or_dash(median(|run| run.steering_correction_max_deg), 0),
        median(|run| run.cost.unwrap_or(f64::NAN))
            .map_or_else(|| "–".to_owned(), |cost| format!("{cost:.1e}")),
        n = runs.len(),
    )
}

fn main() -> Result<()> {
    let variants = variants();
    let seeds: Vec<u64> = SEEDS.collect();
    let jobs: Vec<(usize, u64)> = (0..variants.len())
        .flat_map(|v| seeds.iter().map(move |&seed| (v, seed)))
        .collect();
    let scenario = load("sedan-s1")?;
    let vehicle = ReadyVehicle::new(vehicle_dyn::vehicles::find(&scenario.vehicle)?)?;
    let data = seeds
        .iter()
        .map(|&seed| Ok(record(&scenario, &vehicle, seed, &Interrupt::default())?.0))
        .collect::<Result<Vec<_>>>()?;
    let recorded: Vec<Recorded<'_>> = data.iter().map(Recorded::new).collect();
    let next = AtomicUsize::new(0);
    let found: Mutex<Found> = Mutex::default();
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(&(v, seed)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let usual = &recorded[usize::try_from(seed - SEEDS.start).unwrap_or(0)];
                    let made = drive(&variants[v], seed, &vehicle, usual)
                        .with_context(|| format!("{}: {}", variants[v].of, variants[v].words));
                    let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
                    found.insert((v, seed), made);
                    eprint!("\r{} of {} runs", found.len(), jobs.len());
                }
            });
        }
    });
    eprintln!();
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut text = String::from(
        "# How sensitive `sedan-s1` is to what the paper leaves open\n\n\
         Written by `cargo run --release -p rollover-app --example sensitivity`. One thing is changed at a\n\
         time; recording seeds 10 to 19, on which nothing was chosen; the course as it is. Medians are over the\n\
         runs that were made; costs are in the paper's units whatever was optimised.\n",
    );
    let mut of = "";
    for (v, variant) in variants.iter().enumerate() {
        if variant.of != of {
            of = variant.of;
            write!(
                text,
                "\n## `{of}`\n\n| changed | completed | of these, \\|LTR\\| ≤ 1 | rolled over | max \\|LTR\\|, median | worst | off path, worst | correction, median | lowest km/h | cost, median |\n|---|---|---|---|---|---|---|---|---|---|\n"
            )?;
        }
        let runs: Vec<Option<Summary>> = seeds
            .iter()
            .map(|&seed| found.remove(&(v, seed)).context("a run was lost")?)
            .collect::<Result<_>>()?;
        writeln!(text, "{}", row(&variant.words, &runs))?;
    }
    print!("{text}");
    Ok(())
}
