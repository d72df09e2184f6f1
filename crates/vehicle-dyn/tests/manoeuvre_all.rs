//! tmp
use std::ops::ControlFlow;
use vehicle_dyn::manoeuvre::{self, Manoeuvre, RunSettings};

#[test]
fn sweep() {
    let sedan = vehicle_dyn::vehicles::embedded("sedan").unwrap();
    let mut low = sedan.clone();
    low.mass.sprung_cg_height_m = 0.58;
    low.name = "low".into();
    let mut long = low.clone();
    long.name = "truckish".into();
    long.geometry.sprung_cg_to_front_axle_m = 1.9;
    long.geometry.sprung_cg_to_rear_axle_m = 1.9;
    long.mass.sprung_yaw_inertia_kg_m2 = 3400.0;
    long.mass.sprung_pitch_inertia_kg_m2 = 3500.0;
    for name in ["iso-3888-2", "iso-3888-1"] {
        for preview in if name == "iso-3888-1" {
            vec![0.5, 0.6, 0.7]
        } else {
            vec![0.5, 0.6, 0.7]
        } {
            for (pg, dg, ins) in [
                (1.4, 0.0, 0.25),
                (1.4, 0.0, 0.5),
                (1.4, 0.0, 0.75),
                (1.4, 0.5, 0.5),
                (1.8, 0.5, 0.25),
                (1.8, 0.5, 0.5),
            ] {
                for lead in if name == "iso-3888-1" {
                    vec![5.0, 8.0]
                } else {
                    vec![1.0, 2.0, 3.0]
                } {
                    let mut file = manoeuvre::find(name).unwrap();
                    if let Manoeuvre::LaneChange(l) = &mut file.manoeuvre {
                        l.driver.preview_time_s = preview;
                        l.driver.preview_gain_factor = pg;
                        l.driver.drift_gain_factor = dg;
                        l.driver.path_lead_m = lead;
                        l.driver.path_inside_share = ins;
                        l.search_resolution_kmh = 2.0;
                    }
                    let mut text =
                        format!("{name} T={preview} pg={pg} dg={dg} ins={ins} lead={lead}:");
                    for v in [&sedan, &low, &long] {
                        let r = file.perform(
                            v,
                            RunSettings {
                                substep_s: 1e-3,
                                ..Default::default()
                            },
                            &mut |_| ControlFlow::Continue(()),
                        );
                        match r {
                            Ok(d) => {
                                text += &format!(
                                    " {:?}",
                                    d.report
                                        .figure("highest speed passed, first to the left")
                                        .unwrap()
                                        .as_number()
                                )
                            }
                            Err(e) => text += &e.to_string(),
                        }
                    }
                    println!("{text}");
                }
            }
        }
    }
}
