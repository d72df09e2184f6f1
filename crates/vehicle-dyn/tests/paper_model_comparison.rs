//! The paper's model beside the 14-degree-of-freedom plant.

mod common;
#[path = "paper_model/plants.rs"]
mod plants;

use common::sedan;
use plants::*;
use vehicle_dyn::paper_model::*;
use vehicle_dyn::parameters::VehicleParameters;

fn idealised() -> VehicleParameters {
    let mut v = sedan();
    v.suspension.camber_gain_front_rad_per_m = 0.0;
    v.suspension.camber_gain_rear_rad_per_m = 0.0;
    v.tyre.camber_thrust_ratio = 0.0;
    v.tyre.rolling_resistance_coefficient = 0.0;
    v.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    v.suspension.damping_bump_front_n_s_per_m = 2150.0;
    v.suspension.damping_rebound_front_n_s_per_m = 2150.0;
    v.suspension.damping_bump_rear_n_s_per_m = 2000.0;
    v.suspension.damping_rebound_rear_n_s_per_m = 2000.0;
    v
}


#[test]
fn explore() {

    let mut cam = sedan();
    cam.tyre.camber_thrust_ratio = 0.0;
    let mut dif = cam.clone();
    dif.powertrain.differential_coupling_nm_s_per_rad = 0.0;
    let mut rol = dif.clone();
    rol.tyre.rolling_resistance_coefficient = 0.0;
    let mut gain = rol.clone();
    gain.suspension.camber_gain_front_rad_per_m = 0.0;
    gain.suspension.camber_gain_rear_rad_per_m = 0.0;
    let cases=[("thrust", cam), ("+diff", dif), ("+roll", rol), ("+gain", gain), ("ideal", idealised())];
    for (name, vehicle) in cases {
        for speed in [15.0, 20.0, 25.0, 30.0] {
            let lin = match paper(&vehicle, speed, PaperModelSettings::MATCHED) {
                Plant::Paper(m) => m.linearise(speed).unwrap(),
                _ => unreachable!(),
            };
            let g = lin.dc_gain().unwrap();
            let d = 0.05 * GRAVITY / g[(1, 0)];
            let f=step_figures(full(&vehicle, speed), d, speed);
            println!("{name} v {speed} full    {f:.4?}");
            let m=step_figures(paper(&vehicle, speed, PaperModelSettings::MATCHED), d, speed);
            println!("   ratio yaw {:.4} roll {:.4} ltr {:.4} t90 {:.3} {:.3}", m.yaw_gain/f.yaw_gain, m.roll_per_g/f.roll_per_g, m.ltr_per_g/f.ltr_per_g, m.yaw_t90_s-f.yaw_t90_s, m.ltr_t90_s-f.ltr_t90_s);
        }
        for fr in [0.2] {
            let speed = 25.0;
            let f=response(full(&vehicle, speed), 0.05, fr, speed);
            let m=response(paper(&vehicle, speed, PaperModelSettings::MATCHED), 0.05, fr, speed);
            println!("{name} f {fr} full {f:.4?} yaw {:.3} {:.2} deg ltr {:.3} {:.2} deg", m.yaw[0]/f.yaw[0], (m.yaw[1]-f.yaw[1]).to_degrees(), m.ltr[0]/f.ltr[0], (m.ltr[1]-f.ltr[1]).to_degrees());
        }
    }
}
