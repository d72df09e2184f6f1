//! Deciding and observing on a model allocate nothing, whatever goes wrong. The counting allocator
//! of `allocation-counter` serves this test binary alone.

#[path = "lmpc/plants.rs"]
#[allow(dead_code)]
mod plants;

use allocation_counter::measure;
use deepc_core::controller::Controller;
use deepc_core::program::Bounds;
use plants::{horizon, model, settings, undisturbed_model};
use sysid::lmpc::{self, LmpcController};

fn allocations(controller: &mut LmpcController) -> u64 {
    let mut reference = controller.new_reference();
    let q = controller.disturbances();
    let info = measure(|| {
        for k in 0..200_u32 {
            // References that stand still, and references that move.
            let target = if k < 100 {
                1.0
            } else {
                f64::from(k % 40) / 40.0
            };
            reference.hold(&[0.0; 2], &[target, 0.2]).unwrap();
            let step = controller.decide(&reference);
            let input = [step.input[0], step.input[1]];
            let mut output = [0.5 * input[0] + 0.1 * f64::from(k).sin(), input[1]];
            match k % 29 {
                3 => output[1] = f64::NAN,
                6 => continue,
                _ => {}
            }
            controller.observe_with_disturbances(&input, &[0.1][..q], &output);
            // An outage longer than any plan: the window fills and the observer starts anew.
            if (100..120).contains(&k) {
                controller.observe_with_disturbances(&[], &[], &[]);
            }
        }
        controller.reset();
    });
    info.count_total
}

#[test]
fn a_step_on_a_model_allocates_nothing() {
    let mut limited = settings();
    limited.options.input_change_bounds = vec![Bounds::between(-0.1, 0.1); 2];
    let controllers = [
        lmpc::controller(&model(), &settings(), 12, horizon()),
        lmpc::controller(&model(), &limited, 12, horizon()),
        lmpc::controller(&undisturbed_model(), &settings(), 40, horizon()),
    ];
    for (kind, controller) in controllers.into_iter().enumerate() {
        assert_eq!(
            allocations(&mut controller.unwrap()),
            0,
            "controller {kind}"
        );
    }
}
