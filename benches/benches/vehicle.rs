//! What a simulated second costs, on the flat and on a riverbed, and what a whole run costs.
//!
//! Real time over the time shown is the speed: 1 s in 2 ms is 500 times real time.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use vehicle_dyn::driver::{Driver, DriverParameters};
use vehicle_dyn::road::{Course, CourseDescription};
use vehicle_dyn::simulation::{Command, InitialPose, Simulation};
use vehicle_dyn::terrain::{GroundDescription, Terrain};

const SCENARIO: &str = include_str!("../../scenarios/sedan-s1.toml");
/// The hard but drivable riverbed.
const RIVERBED: &str = "
    friction = 0.85
    fade_in_m = 50.0
    roughness = { class = \"c\", contact_length_m = 0.13, seed = 1 }
    undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 1 }
";

fn part<T: serde::de::DeserializeOwned>(key: &str) -> T {
    let scenario: toml::Table = SCENARIO.parse().expect("the shipped scenario is TOML");
    scenario[key].clone().try_into().expect("a valid part")
}

fn course() -> Course {
    Course::new(&part::<CourseDescription>("course")).expect("the shipped course is valid")
}

fn riverbed() -> GroundDescription {
    toml::from_str(RIVERBED).expect("the riverbed is valid")
}

fn terrains() -> [(&'static str, Terrain); 2] {
    let riverbed = Terrain::build(&riverbed(), &course()).expect("the riverbed fits the course");
    [
        ("the flat", Terrain::flat(0.85)),
        ("the riverbed", riverbed),
    ]
}

fn start(terrain: &Terrain, x_m: f64, speed_m_s: f64) -> Simulation {
    let sedan = vehicle_dyn::vehicles::embedded("sedan").expect("the built-in sedan is valid");
    let pose = InitialPose {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s,
    };
    Simulation::new(&sedan, terrain.clone(), pose).expect("the pose is valid")
}

/// One second of cornering at 29 m/s: 100 ticks of 10 RK4 steps of 1 ms.
fn second(criterion: &mut Criterion) {
    for (name, terrain) in terrains() {
        // Where the riverbed is at its full height.
        let start = start(&terrain, 90.0, 29.0);
        let command = Command::from_deg_kmh(40.0, 105.0);
        criterion.bench_function(&format!("vehicle/1 s on {name}"), |bencher| {
            bencher.iter(|| {
                let mut simulation = start.clone();
                for _ in 0..100 {
                    simulation
                        .step(black_box(command), 0.01)
                        .expect("the command is finite");
                }
                simulation
            });
        });
    }
}

/// 35 s with the driver on the course of the paper's scenario at 90 km/h, without the 8 s of settling
/// before.
fn whole_run(criterion: &mut Criterion) {
    let course = course();
    let driver: DriverParameters = part("driver");
    for (name, terrain) in terrains() {
        let start = start(&terrain, 0.0, 25.0);
        criterion.bench_function(&format!("vehicle/35 s run on {name}"), |bencher| {
            bencher.iter(|| {
                let mut simulation = start.clone();
                let mut driver = Driver::new(&driver).expect("the shipped driver is valid");
                let mut seen = simulation.observation();
                for _ in 0..3500 {
                    let action = driver.step(&course, &seen, 0.01);
                    let command = Command::from_deg_kmh(action.handwheel_deg, 90.0);
                    seen = simulation.step(command, 0.01).expect("finite");
                }
                seen
            });
        });
    }
}

/// A riverbed for the 1105 m of the paper's course.
fn build(criterion: &mut Criterion) {
    let (course, ground) = (course(), riverbed());
    criterion.bench_function("vehicle/build a riverbed of 1.1 km", |bencher| {
        bencher.iter(|| Terrain::build(black_box(&ground), &course).expect("it fits"));
    });
}

/// One question for the ground.
fn ground(criterion: &mut Criterion) {
    for (name, terrain) in terrains() {
        let mut x = 0.0;
        criterion.bench_function(
            &format!("vehicle/the ground at a point of {name}"),
            |bencher| {
                bencher.iter(|| {
                    x = if x > 140.0 { 0.0 } else { x + 0.015 };
                    terrain.ground(black_box(x), black_box(0.7))
                });
            },
        );
    }
}

criterion_group!(
    name = benches;
    config = Criterion::default().sample_size(20);
    targets = second, whole_run, build, ground
);
criterion_main!(benches);
