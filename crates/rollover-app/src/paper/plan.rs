//! Which runs a campaign consists of.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use vehicle_dyn::simulation::ReadyVehicle;
use vehicle_dyn::terrain::Terrain;

use crate::campaign::load_vehicle;
use crate::cli::PaperArgs;
use crate::interrupt::Interrupt;
use crate::report::claims;
use crate::scenario::{self, DataMatrix, Prediction, Scenario};
use crate::terrain;
use crate::toml_place::suggested;

/// Recording seeds that no setting was chosen on.
const JUDGED_SEEDS: std::ops::Range<u64> = 10..20;
/// Seeds of a quick look.
const QUICK_SEEDS: usize = 1;
/// Moments at which the programs as written are solved in a quick look.
const QUICK_MOMENTS: usize = 1;

/// All runs of a campaign.
pub(super) struct Plan {
    pub(super) scenes: Vec<Scene>,
    /// Recording seeds; the logs of the first are kept.
    pub(super) seeds: Vec<u64>,
    /// Names of the controllers; all if there are none.
    controllers: Vec<String>,
    /// Whether the mirror images are driven, too.
    mirror: bool,
    /// Moments at which the programs as written are timed.
    pub(super) moments: usize,
    /// Whether `DeePC` as written is timed, which takes most of the time.
    pub(super) deepc_as_written: bool,
}

/// A scenario on its course and on the mirror image, with the ground under both.
pub(super) struct Scene {
    pub(super) vehicle: ReadyVehicle,
    pub(super) as_it_is: Driven,
    pub(super) mirrored: Driven,
}

/// A scenario and the ground under its course.
pub(super) struct Driven {
    pub(super) scenario: Scenario,
    pub(super) terrain: Terrain,
}

/// One run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PlannedRun {
    /// Place of its scenario in [`Plan::scenes`].
    pub(super) scene: usize,
    pub(super) controller: String,
    pub(super) seed: u64,
    pub(super) mirrored: bool,
    /// Whether its log is kept.
    pub(super) logged: bool,
}

impl Plan {
    pub(super) fn new(args: &PaperArgs, interrupt: &Interrupt) -> Result<Self> {
        let wanted = |name: &&str| args.only.is_empty() || args.only.iter().any(|o| o == name);
        let names = claims::SCENARIOS.into_iter().filter(wanted);
        let scenes = names.map(|name| Scene::load(name, interrupt));
        let judged = || JUDGED_SEEDS.collect::<Vec<_>>();
        let seeds = match &args.seeds {
            Some(seeds) => seeds.0.clone().collect(),
            None if args.quick => judged()[..QUICK_SEEDS].to_vec(),
            None => judged(),
        };
        let scenes: Vec<Scene> = scenes.collect::<Result<_>>()?;
        check_controllers(&args.controllers, &scenes)?;
        Ok(Self {
            scenes,
            seeds,
            controllers: args.controllers.clone(),
            moments: if args.quick {
                QUICK_MOMENTS
            } else {
                crate::timing::MOMENTS
            },
            deepc_as_written: !args.quick,
            mirror: !args.quick,
        })
    }

    /// The runs of all groups, in the order of the results.
    pub(super) fn runs(&self) -> impl Iterator<Item = PlannedRun> + '_ {
        let scenes = 0..self.scenes.len();
        scenes.flat_map(move |scene| {
            let seeds = self.seeds.iter();
            seeds.flat_map(move |&seed| self.group(scene, seed))
        })
    }

    /// The runs of one scenario and seed, which share a recording.
    pub(super) fn group(&self, scene: usize, seed: u64) -> Vec<PlannedRun> {
        let scenario = &self.scenes[scene].as_it_is.scenario;
        let shown = self.seeds.first() == Some(&seed);
        let mut runs = Vec::new();
        let wanted =
            |name: &&str| self.controllers.is_empty() || self.controllers.iter().any(|c| c == name);
        for controller in scenario.controller_names().into_iter().filter(wanted) {
            for mirrored in [false, true] {
                let once = runs_once(scenario, controller);
                // The whole matrix decides as the reduced one does: one run shows it.
                let whole = whole_matrix(scenario, controller);
                if (once && !shown) || (mirrored && (whole || !self.mirror)) {
                    continue;
                }
                runs.push(PlannedRun {
                    scene,
                    controller: controller.to_owned(),
                    seed,
                    mirrored,
                    logged: shown && !mirrored,
                });
            }
        }
        runs
    }

    /// Folder of a run below the campaign's.
    pub(super) fn folder(&self, run: &PlannedRun) -> PathBuf {
        let scenario = &self.scenes[run.scene].as_it_is.scenario;
        let course = if run.mirrored { "-mirrored" } else { "" };
        let name = format!("seed-{}{course}", run.seed);
        Path::new(&scenario.name).join(&run.controller).join(name)
    }

    pub(super) fn driven(&self, run: &PlannedRun) -> &Driven {
        let scene = &self.scenes[run.scene];
        if run.mirrored {
            &scene.mirrored
        } else {
            &scene.as_it_is
        }
    }
}

/// Every name must be that of a controller of some scenario.
fn check_controllers(names: &[String], scenes: &[Scene]) -> Result<()> {
    let scenarios = scenes.iter().map(|scene| &scene.as_it_is.scenario);
    let mut known: Vec<&str> = scenarios.flat_map(Scenario::controller_names).collect();
    known.sort_unstable();
    known.dedup();
    for name in names {
        ensure!(
            known.contains(&name.as_str()),
            "--controllers {name}: no scenario of the campaign has it{}: choose from {}",
            suggested(name, known.iter().copied()),
            known.join(", ")
        );
    }
    Ok(())
}

/// Whether every seed would give the same run, or one shows enough.
fn runs_once(scenario: &Scenario, controller: &str) -> bool {
    let without_data =
        !scenario.controllers.contains_key(controller) && scenario.sensors.is_empty();
    without_data || whole_matrix(scenario, controller)
}

fn whole_matrix(scenario: &Scenario, controller: &str) -> bool {
    let settings = scenario.controllers.get(controller);
    settings.is_some_and(
        |s| matches!(&s.prediction, Prediction::Data(d) if d.matrix == DataMatrix::Whole),
    )
}

impl Scene {
    fn load(name: &str, interrupt: &Interrupt) -> Result<Self> {
        let scenario = scenario::load(name)?;
        let vehicle = load_vehicle(&scenario.vehicle)?;
        let mirrored = scenario.mirrored();
        Ok(Self {
            vehicle,
            as_it_is: Driven::new(scenario, interrupt)?,
            mirrored: Driven::new(mirrored, interrupt)?,
        })
    }
}

impl Driven {
    fn new(scenario: Scenario, interrupt: &Interrupt) -> Result<Self> {
        Ok(Self {
            terrain: terrain::build(&scenario.ground, &scenario.course, interrupt)?,
            scenario,
        })
    }
}
