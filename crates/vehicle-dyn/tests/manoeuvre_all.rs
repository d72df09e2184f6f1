//! Every manoeuvre on every embedded vehicle.

use std::ops::ControlFlow;
use vehicle_dyn::manoeuvre::{self, RunSettings};

#[test]
fn print_all() {
    let sedan = vehicle_dyn::vehicles::embedded("sedan").unwrap();
    for name in manoeuvre::names() {
        let file = manoeuvre::find(name).unwrap();
        let begin = std::time::Instant::now();
        match file.perform(&sedan, RunSettings::default(), &mut |_| ControlFlow::Continue(())) {
            Ok(done) => println!("{}", done.report),
            Err(e) => println!("{name}: {e}"),
        }
        println!("took {:?}\n", begin.elapsed());
    }
}
