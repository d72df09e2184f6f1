//! What a simulated second costs.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use vehicle_dyn::simulation::{Command, InitialPose, Simulation};
use vehicle_dyn::terrain::Terrain;

/// One second of cornering at 29 m/s on the flat: 100 ticks of 10 RK4 steps of 1 ms.
fn flat(criterion: &mut Criterion) {
    let sedan = vehicle_dyn::vehicles::embedded("sedan").expect("the built-in sedan is valid");
    let pose = InitialPose {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
        speed_m_s: 29.0,
    };
    let start = Simulation::new(&sedan, Terrain::flat(0.85), pose).expect("the pose is valid");
    let command = Command::from_deg_kmh(40.0, 105.0);
    criterion.bench_function("vehicle/1 s on the flat", |bencher| {
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

criterion_group!(benches, flat);
criterion_main!(benches);
