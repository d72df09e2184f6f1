//! Runs a fixed set of simulations and prints one line for each, with a hash of every number logged.
//!
//! The same source gives the same lines on every run, in every build profile and for any number of
//! threads. `.ci/run` compares them:
//!
//! ```sh
//! cargo run -p vehicle-dyn --example reproducibility -- --threads 2
//! ```

use std::fmt::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::paper_model::{PaperModel, PaperModelSettings};
use vehicle_dyn::parameters::VehicleParameters;
use vehicle_dyn::road::{Course, CourseDescription, Segment, TurnDirection};
use vehicle_dyn::simulation::{Command, InitialPose, LongitudinalDemand, Simulation};
use vehicle_dyn::terrain::{Ground, GroundDescription, Terrain};
use vehicle_dyn::units::{DEGREE, KMH};

const TICK_S: f64 = 0.01;
const TICKS: u32 = 1200;
const FRICTION: f64 = 0.85;
const SEED: u64 = 20_240_607;
const RIVERBED: &str = "
    friction = 0.85
    fade_in_m = 20.0
    roughness = { class = \"c\", contact_length_m = 0.13, seed = 1 }
    undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }
";

/// How the handwheel and the speed go over time.
#[derive(Debug, Clone, Copy)]
enum Manoeuvre {
    /// The handwheel turned at once.
    Step,
    /// Turned ever further, until the vehicle slides or tips.
    Ramp,
    /// A sine of rising frequency.
    Sweep,
    /// Braking hard in a turn.
    BrakeInTurn,
    /// Throttle dropped in a turn, then a target speed again.
    LiftOff,
    /// Random angles and speeds from a fixed seed.
    Random,
    /// A driver on a road with three turns.
    Driver,
}

const MANOEUVRES: [Manoeuvre; 7] = [
    Manoeuvre::Step,
    Manoeuvre::Ramp,
    Manoeuvre::Sweep,
    Manoeuvre::BrakeInTurn,
    Manoeuvre::LiftOff,
    Manoeuvre::Random,
    Manoeuvre::Driver,
];

/// Which plant stands on which ground.
#[derive(Debug, Clone, Copy)]
enum World {
    /// 14 degrees of freedom on level ground.
    Flat,
    /// 14 degrees of freedom on a plane that falls to the side.
    Banked,
    /// 14 degrees of freedom on a rough and wavy riverbed.
    Riverbed,
    /// The paper's model with the paper's choices.
    Paper,
    /// The paper's model with the choices closest to the vehicle.
    PaperMatched,
}

const WORLDS: [World; 5] = [
    World::Flat,
    World::Banked,
    World::Riverbed,
    World::Paper,
    World::PaperMatched,
];

/// FNV-1a over text. Debug text of an `f64` is different for different bits, and a field that is added
/// to an observation is in it without further care.
struct Hash(u64);

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        Ok(())
    }
}

/// One run of the fixed set.
struct Run {
    vehicle: &'static str,
    parameters: VehicleParameters,
    /// The ground of [`World::Riverbed`].
    riverbed: Terrain,
    world: World,
    manoeuvre: Manoeuvre,
}

type Failure = Box<dyn std::error::Error + Send + Sync>;

impl Run {
    fn line(&self) -> Result<String, Failure> {
        let pose = InitialPose {
            x_m: 0.0,
            y_m: 0.0,
            yaw_rad: 0.0,
            speed_m_s: 90.0 * KMH,
        };
        let mut hash = Hash(0xcbf2_9ce4_8422_2325);
        let paper =
            |settings| PaperModel::with_settings(&self.parameters, FRICTION, pose, settings);
        let ticks = match self.world {
            World::Flat => self.drive(Terrain::flat(FRICTION), pose, &mut hash)?,
            World::Banked => {
                let plane = Ground {
                    height_m: 1.0,
                    gradient_x: 0.01,
                    gradient_y: 0.04,
                    friction: FRICTION,
                };
                self.drive(Terrain::Plane(plane), pose, &mut hash)?
            }
            World::Riverbed => self.drive(self.riverbed.clone(), pose, &mut hash)?,
            World::Paper => self.turn(paper(PaperModelSettings::PAPER)?, &mut hash)?,
            World::PaperMatched => self.turn(paper(PaperModelSettings::MATCHED)?, &mut hash)?,
        };
        Ok(format!(
            "{:<16} {:<13} {:<12} {ticks:>5} ticks  {:016x}",
            self.vehicle,
            format!("{:?}", self.world),
            format!("{:?}", self.manoeuvre),
            hash.0
        ))
    }

    fn drive(&self, terrain: Terrain, pose: InitialPose, hash: &mut Hash) -> Result<u32, Failure> {
        let mut simulation = Simulation::new(&self.parameters, terrain, pose)?;
        let mut driver = Driver::new(&driver())?;
        let road = Course::new(&road())?;
        let mut noise = ChaCha8Rng::seed_from_u64(SEED);
        let mut seen = simulation.observation();
        for tick in 0..TICKS {
            let command = if let Manoeuvre::Driver = self.manoeuvre {
                let action = driver.step(&road, &seen, TICK_S);
                Command::from_deg_kmh(action.handwheel_deg, 90.0)
            } else {
                self.command(tick, &mut noise)
            };
            seen = simulation.step(command, TICK_S)?;
            write!(hash, "{seen:?}{:?}", simulation.state())?;
            if seen.roll_rad.abs() > 60.0 * DEGREE {
                return Ok(tick + 1);
            }
        }
        Ok(TICKS)
    }

    fn turn(&self, mut model: PaperModel, hash: &mut Hash) -> Result<u32, Failure> {
        let mut noise = ChaCha8Rng::seed_from_u64(SEED);
        for tick in 0..TICKS {
            let seen = model.step(self.command(tick, &mut noise), TICK_S)?;
            write!(hash, "{seen:?}{:?}", model.state())?;
        }
        write!(hash, "{:?}", model.linearise(25.0)?)?;
        Ok(TICKS)
    }

    fn command(&self, tick: u32, noise: &mut ChaCha8Rng) -> Command {
        let time_s = f64::from(tick) * TICK_S;
        let released = |handwheel_deg: f64| Command {
            handwheel_rad: handwheel_deg * DEGREE,
            longitudinal: LongitudinalDemand::Released,
        };
        let mut uniform = |half_range: f64| {
            half_range * (2.0 * f64::from(noise.next_u32()) / f64::from(u32::MAX) - 1.0)
        };
        match self.manoeuvre {
            Manoeuvre::Step => Command::from_deg_kmh(if time_s < 0.5 { 0.0 } else { 45.0 }, 90.0),
            Manoeuvre::Ramp => Command::from_deg_kmh(13.5 * time_s, 90.0),
            Manoeuvre::Sweep => Command::from_deg_kmh(25.0 * (time_s * time_s).sin(), 90.0),
            Manoeuvre::BrakeInTurn => {
                Command::from_deg_kmh(30.0, if time_s < 2.0 { 90.0 } else { 0.0 })
            }
            Manoeuvre::LiftOff if (2.0..5.0).contains(&time_s) => released(30.0),
            Manoeuvre::LiftOff => Command::from_deg_kmh(30.0, 90.0),
            Manoeuvre::Random => Command::from_deg_kmh(uniform(60.0), 90.0 + uniform(10.0)),
            // The paper's model has no road: it takes a slalom in the driver's place.
            Manoeuvre::Driver => Command::from_deg_kmh(35.0 * (2.0 * time_s).sin(), 90.0),
        }
    }
}

fn driver() -> DriverParameters {
    DriverParameters {
        preview_time_s: 1.0,
        preview_gain_deg_per_m: 20.0,
        error_rate_gain_deg_s_per_m: 3.0,
        integral_gain_deg_per_m_s: 0.5,
        lag_s: 0.1,
        handwheel_limit_deg: 200.0,
        handwheel_rate_limit_deg_per_s: 500.0,
    }
}

fn road() -> CourseDescription {
    let turn = |turn| Segment::Turn {
        turn,
        radius_m: 150.0,
        arc_m: 60.0,
        clothoid_m: 40.0,
    };
    let straight = Segment::Straight { straight_m: 60.0 };
    CourseDescription {
        width_m: 7.0,
        segments: vec![
            straight,
            turn(TurnDirection::Left),
            straight,
            turn(TurnDirection::Right),
            straight,
            turn(TurnDirection::Left),
            straight,
        ],
    }
}

/// A riverbed along [`road`].
fn riverbed() -> Result<Terrain, Failure> {
    let ground: GroundDescription = toml::from_str(RIVERBED)?;
    Ok(Terrain::build(&ground, &Course::new(&road())?)?)
}

fn runs() -> Result<Vec<Run>, Failure> {
    let riverbed = riverbed()?;
    let mut runs = Vec::new();
    for vehicle in vehicle_dyn::vehicles::names() {
        let parameters = vehicle_dyn::vehicles::embedded(vehicle)?;
        for world in WORLDS {
            for manoeuvre in MANOEUVRES {
                runs.push(Run {
                    vehicle,
                    parameters: parameters.clone(),
                    riverbed: riverbed.clone(),
                    world,
                    manoeuvre,
                });
            }
        }
    }
    Ok(runs)
}

/// The lines of all runs in their order. Threads take the next run as they get free, so which thread
/// does what differs from time to time; what it computes must not.
fn lines(runs: &[Run], threads: usize) -> Result<Vec<String>, Failure> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(vec![None; runs.len()]);
    let work = || -> Result<(), Failure> {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(run) = runs.get(index) else {
                return Ok(());
            };
            let line = run.line()?;
            done.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(line);
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| {
            worker
                .join()
                .unwrap_or_else(|_| Err("a thread failed".into()))
        })
    })?;
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(done.into_iter().flatten().collect())
}

fn threads() -> Result<usize, Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.as_slice() {
        [] => Ok(1),
        [flag, count] if flag == "--threads" => match count.parse() {
            Ok(count @ 1..=64) => Ok(count),
            _ => Err(format!("--threads {count}: must be a whole number from 1 to 64").into()),
        },
        _ => Err("usage: reproducibility [--threads N]".into()),
    }
}

fn main() -> ExitCode {
    let lines = threads().and_then(|threads| lines(&runs()?, threads));
    match lines {
        Ok(lines) => {
            for line in lines {
                println!("{line}");
            }
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
