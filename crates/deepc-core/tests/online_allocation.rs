//! Taking in a sample allocates nothing. The counting allocator of `allocation-counter` serves
//! this test binary alone.

mod common;

use allocation_counter::measure;
use common::Lti;
use deepc_core::predictor::{Memory, OnlineFactor, OnlineUpdate};

#[test]
fn a_sample_allocates_nothing() {
    let samples = 200;
    for noise in [0.1, 0.0] {
        let system = Lti::random(3, 2, 2, 0.9, 4);
        let (inputs, outputs) = common::record(&system, samples + 100, noise, 9);
        let first = (
            inputs.subrows(0, samples).to_owned(),
            outputs.subrows(0, samples).to_owned(),
        );
        let data = common::exciting(&common::dataset(vec![first]), 3, 4, 3);
        for memory in [
            Memory::Growing,
            Memory::Forgetting { factor: 0.99 },
            Memory::Sliding { samples: 100 },
        ] {
            let mut online = OnlineFactor::new(&data, memory).unwrap();
            let (mut added, mut rebuilt) = (0, 0);
            let info = measure(|| {
                for k in samples..samples + 100 {
                    let (u, y) = (inputs.row(k), outputs.row(k));
                    match online.push(&[u[0], u[1]], &[], &[y[0], y[1]]) {
                        OnlineUpdate::Added => added += 1,
                        OnlineUpdate::Rebuilt => rebuilt += 1,
                        OnlineUpdate::Waiting { .. } | OnlineUpdate::Refused => {}
                    }
                    if k == samples + 50 {
                        online.lose_sample();
                    }
                }
            });
            assert_eq!(info.count_total, 0, "{memory:?}, noise {noise}");
            // Without noise the sliding window is factored afresh, without allocating either.
            let afresh = noise == 0.0 && matches!(memory, Memory::Sliding { .. });
            if afresh {
                assert!(rebuilt > 80);
            } else {
                assert_eq!((added, rebuilt), (88, 0));
            }
        }
    }
}
