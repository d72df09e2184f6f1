//! The report's figures of one vehicle against the reference.

use anyhow::Result;
use benches::validation::reference::Pair;
use benches::validation::response::frequency_response;

use crate::chart::{Line, Panel, panels};

/// A figure: the part of the report it belongs to, the stem of its file, its caption and the SVG.
pub struct Figure {
    pub group: &'static str,
    pub stem: String,
    pub caption: String,
    pub svg: String,
}

type Signal = (&'static str, fn(&Pair) -> (Vec<f64>, Vec<f64>));

const SIGNALS: [Signal; 4] = [
    ("steering, deg", |pair| {
        (
            pair.theirs(|s| s.delta_rad.to_degrees()),
            pair.ours(|o| o.road_wheel_rad.to_degrees()),
        )
    }),
    ("yaw rate, deg/s", |pair| {
        (
            pair.theirs(|s| s.yawrate_radps.to_degrees()),
            pair.ours(|o| o.yaw_rate_rad_s.to_degrees()),
        )
    }),
    ("LTR", |pair| (pair.theirs(|s| s.LTR), pair.ours(|o| o.ltr))),
    ("roll, deg", |pair| {
        (
            pair.theirs(|s| s.roll_rad.to_degrees()),
            pair.ours(|o| o.roll_rad.to_degrees()),
        )
    }),
];

fn over_time(title: &str, pairs: &[&Pair]) -> Result<String> {
    let panels_: Vec<Panel> = SIGNALS
        .iter()
        .map(|(axis, of)| Panel {
            axis: (*axis).to_owned(),
            lines: pairs
                .iter()
                .flat_map(|pair| {
                    let time = pair.time_s();
                    let (theirs, ours) = of(pair);
                    // Enough for the width of the figure.
                    let every = time.len().div_ceil(150);
                    let line = |values: Vec<f64>, reference: bool| Line {
                        name: if reference {
                            "reference".to_owned()
                        } else {
                            pair.run.summary.name.clone()
                        },
                        reference,
                        points: time.iter().copied().zip(values).step_by(every).collect(),
                    };
                    [line(ours, false), line(theirs, true)]
                })
                .collect(),
            marks: Vec::new(),
        })
        .collect();
    panels(title, "time, s", false, &panels_)
}

fn bode(pair: &Pair) -> Result<String> {
    let step = pair.run.samples[1].t_s - pair.run.samples[0].t_s;
    let (theirs_in, ours_in) = (
        pair.theirs(|s| s.delta_rad),
        pair.ours(|o| o.road_wheel_rad),
    );
    let frequencies: Vec<f64> = (0..40)
        .map(|k| 0.15 * 10_f64.powf(f64::from(k) / 32.0))
        .collect();
    let mut shown = Vec::new();
    for (name, of) in [
        ("yaw rate, 1/s", SIGNALS[1].1),
        ("LTR, 1/rad", SIGNALS[2].1),
    ] {
        let (theirs, ours) = of(pair);
        // The yaw rate of the figures is in degrees, and so must the steering be.
        let scale = if name.starts_with("yaw") {
            1_f64.to_degrees()
        } else {
            1.0
        };
        let response = |input: &[f64], output: &[f64]| -> Vec<[f64; 2]> {
            frequencies
                .iter()
                .map(|&frequency| {
                    let [gain, phase] = frequency_response(input, output, step, frequency);
                    [gain / scale, phase]
                })
                .collect()
        };
        let (reference, found) = (response(&theirs_in, &theirs), response(&ours_in, &ours));
        for (part, what) in [(0, "gain"), (1, "phase, deg")] {
            let line = |name: &str, reference: bool, values: &[[f64; 2]]| Line {
                name: name.to_owned(),
                reference,
                points: frequencies
                    .iter()
                    .zip(values)
                    .map(|(frequency, value)| (*frequency, value[part]))
                    .collect(),
            };
            shown.push(Panel {
                axis: if part == 0 {
                    name.to_owned()
                } else {
                    what.to_owned()
                },
                lines: vec![
                    line("ours", false, &found),
                    line("reference", true, &reference),
                ],
                marks: Vec::new(),
            });
        }
    }
    panels(
        "Frequency response from the front wheels' angle",
        "frequency, Hz",
        true,
        &shown,
    )
}

/// Figures of `vehicle`: steps, transients, braking as far as the runs are there.
pub fn figures(vehicle: &str, pairs: &[Pair]) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let named = |prefixes: &[&str], most: usize| -> Vec<&Pair> {
        let fits = |pair: &&Pair| {
            prefixes
                .iter()
                .any(|prefix| pair.run.summary.name.starts_with(prefix))
        };
        pairs.iter().filter(fits).take(most).collect()
    };
    for (stem, title, pairs) in [
        ("steps-20", "Step steer at 20 m/s", named(&["step_v20"], 4)),
        ("steps-30", "Step steer at 30 m/s", named(&["step_v30"], 4)),
        ("swd", "Sine with dwell", named(&["swd_"], 4)),
        (
            "limit",
            "Fishhooks and ramps up to lift-off",
            named(&["fishhook_", "ramp_"], 4),
        ),
    ] {
        if pairs.is_empty() {
            continue;
        }
        figures.push(Figure {
            group: "reference",
            stem: format!("vehicle-{vehicle}-{stem}"),
            caption: format!("{title}: {vehicle} (colours) and the reference (dashed)."),
            svg: over_time(title, &pairs)?,
        });
    }
    for pair in named(&["chirp_"], 1) {
        figures.push(Figure {
            group: "reference",
            stem: format!("vehicle-{vehicle}-frequency"),
            caption: "Frequency responses; the reference's LTR leads for the reason below.".into(),
            svg: bode(pair)?,
        });
    }
    Ok(figures)
}
