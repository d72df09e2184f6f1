//! `vehicle-validation.md`: what was checked, what came out, and what is not validated.

use std::fmt::Write;

use benches::validation::Row;
use benches::validation::manoeuvres::RolloverTest;
use comfy_table::Table;
use comfy_table::presets::ASCII_MARKDOWN;

use crate::figures::Figure;

/// A part of the report.
struct Part {
    group: &'static str,
    title: &'static str,
    text: &'static str,
}

const PARTS: [Part; 7] = [
    Part {
        group: "reference",
        title: "Against an independent model",
        text: "The CommonRoad multi-body model (M. Althoff, M. Koschi, S. Manzinger 2017) is \
            another group's code with its own tyre. A parameter set of it becomes a vehicle of ours \
            by fixed rules (`benches/src/reference/parameters.rs`); nothing is fitted. Both get the \
            same angle of the front wheels and the same commanded acceleration. The reference is \
            used up to its first wheel load of zero, and where |ay| > 0.05 g.",
    },
    Part {
        group: "corrected",
        title: "Why the reference's roll leads",
        text: "The reference takes the slip of its tyres from the sideways speed of the body's centre of \
            gravity. While the body rolls outwards that is not the speed of the wheels, so the tyres \
            push against the roll as if it were held at its centre, and LTR comes too soon: phase \
            rows at 1 Hz fail above. Here the reference was run again with the slip taken from the \
            axles' own speed, and with the sideways joint between body and axles stiff, as ours is \
            (`benches/reference/vehicle-corrected`). Nothing of ours was changed.",
    },
    Part {
        group: "mechanics",
        title: "Against mechanics",
        text: "Every embedded vehicle. The tilt table holds geometry: springs and tyres are made hard \
            so that the effective height is that of the centre of gravity.",
    },
    Part {
        group: "derived",
        title: "Derived figures against the simulation",
        text: "`rollover-app vehicles check` prints figures that follow from the parameters alone. Steady \
            turns near 0.04 g and free swings of the simulation must have them.",
    },
    Part {
        group: "tyre",
        title: "The tyre law",
        text: "The paper's combined-slip Magic Formula, at a road friction of 0.85.",
    },
    Part {
        group: "manoeuvres",
        title: "Standard manoeuvres, and who lifts two wheels",
        text: "Every embedded vehicle on a road of friction 0.85. NHTSA's rollover tests \
            (`scenarios/manoeuvres`): the negative controls must keep their wheels below two inches in \
            each, the laden vehicles must lift in one at least. The derived \
            understeer gradient holds at straight running without drive, so ISO 4138 is read for it below \
            0.1 g, of a vehicle without drag, rolling resistance and differential.",
    },
    Part {
        group: "step",
        title: "Half the step",
        text: "Every scenario by the driver alone, on its course and on that of its recording, and every \
            manoeuvre with every embedded vehicle, with the step of 1 ms and with half of it. LTR is \
            compared at every tick of the whole run, after wheels have lifted and landed too.",
    },
];

/// Measured by hand: a report that times itself would differ on every run.
const SPEED: &str = "\
## Speed

One thread of a shared virtual machine with two cores, RK4 of 1 ms, `cargo bench -p benches --bench vehicle`: \
one second of cornering takes 1.81 ms on the flat (553 times real time) and 3.23 ms on a riverbed (310); a whole \
run of 35 s with its driver 65 ms (535) and 92 ms (380); building 1.1 km of riverbed 0.21 s. The truck, whose \
rear wheels have two tyres each, runs at about 400 times real time. Nothing is allocated in a step.

";

const NOT_VALIDATED: &str = "\
## What is not validated

- The motion after wheels have lifted: no reference for it is at hand, and the independent model lets \
its tyres pull instead. Up to lift-off it is held against that model; the tilt table holds lift-off \
itself; energy and momentum hold the free motion.
- No measurement of a real vehicle was at hand. The reference shows that two codes agree on the same \
parameters, not that the parameters are those of a car.
- Solid axles, twin tyres, asymmetric dampers, stops, relaxation lengths other than the least, \
rolling resistance, aerodynamic drag and friction that falls with the load: the reference has none of \
them. They are held by mechanics and by tests of their laws only.
- Rough ground: the terrain's statistics are tested, the tyre on it is a point contact on the local \
plane, without enveloping beyond the averaged contact length.
";

fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&size) {
        // Four digits.
        let digits = (3.0 - size.log10().floor()).max(0.0);
        // Between 0 and 6.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let digits = digits as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.2e}")
    }
}

/// Parts whose rows tell what happened beside the number.
const REMARKED: [&str; 2] = ["manoeuvres", "step"];

fn table(rows: &[&Row]) -> Table {
    let remarked = rows.iter().any(|row| REMARKED.contains(&row.group));
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN);
    let header = ["vehicle", "check", "target", "tolerance", "result", "pass"];
    table.set_header(
        header
            .into_iter()
            .chain(remarked.then_some("what happened")),
    );
    for row in rows {
        let unit = |value: f64| {
            format!("{} {}", number(value), row.unit)
                .trim_end()
                .to_owned()
        };
        let cells = [
            row.vehicle.clone(),
            row.check.clone(),
            unit(row.target),
            row.tolerance_as.clone(),
            unit(row.result),
            if row.pass { "yes" } else { "**NO**" }.to_owned(),
        ];
        let remark = remarked.then(|| row.remark.clone());
        // A bar would end the cell.
        let cells = cells.into_iter().chain(remark);
        table.add_row(cells.map(|cell| cell.replace('|', "\\|")));
    }
    table
}

/// What every vehicle did in the rollover tests.
fn tests_table(tests: &[RolloverTest]) -> Table {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN);
    table.set_header([
        "vehicle",
        "test",
        "handwheel",
        "two-wheel lift",
        "from",
        "rolls over",
        "height of both wheels",
        "largest LTR",
        "largest roll",
        "largest ay",
    ]);
    let answer = |yes: bool| if yes { "yes" } else { "no" }.to_owned();
    let none = || "–".to_owned();
    for test in tests {
        table.add_row([
            test.vehicle.clone(),
            test.manoeuvre.clone(),
            test.amplitude_deg
                .map_or_else(none, |angle| format!("{angle:.0} deg")),
            answer(test.two_wheel_lift),
            test.lift_speed_mph
                .map_or_else(none, |speed| format!("{speed} mph")),
            answer(test.rolled_over),
            format!("{:.1} mm", test.height_mm),
            format!("{:.3}", test.ltr),
            format!("{:.1} deg", test.roll_deg),
            format!("{:.3} g", test.lateral_acceleration_g),
        ]);
    }
    table
}

fn of<'a>(rows: &'a [Row], group: &str) -> Vec<&'a Row> {
    rows.iter().filter(|row| row.group == group).collect()
}

/// How many rows pass, by part, and those that do not.
pub fn summary(rows: &[Row]) -> String {
    let mut text = String::new();
    for part in &PARTS {
        let rows = of(rows, part.group);
        let passed = rows.iter().filter(|row| row.pass).count();
        if !rows.is_empty() {
            let _ = writeln!(text, "{}: {passed} of {} pass", part.title, rows.len());
        }
    }
    for row in rows.iter().filter(|row| !row.pass) {
        let _ = writeln!(
            text,
            "  not met ({}): {}: {}; {} instead of {} {} ± {}",
            row.group,
            row.vehicle,
            row.check,
            number(row.result),
            number(row.target),
            row.unit,
            row.tolerance_as
        );
    }
    text
}

/// The whole page.
pub fn page(rows: &[Row], tests: &[RolloverTest], figures: &[Figure]) -> String {
    let mut page = String::from(
        "# How the vehicle model was validated\n\n\
         Written by `cargo run --release -p benches --bin vehicle-validation`; do not edit. \
         `--data DIR` takes another folder of trajectories of the same reference model.\n\n",
    );
    for line in summary(rows).lines() {
        let _ = writeln!(page, "- {}", line.trim_start());
    }
    for part in &PARTS {
        let of_part = of(rows, part.group);
        if of_part.is_empty() {
            continue;
        }
        let _ = write!(
            page,
            "\n## {}\n\n{}\n\n{}\n",
            part.title,
            part.text,
            table(&of_part)
        );
        if part.group == "manoeuvres" {
            let _ = write!(page, "\n{}\n", tests_table(tests));
        }
        let mut remarks: Vec<&str> = of_part
            .iter()
            .filter(|row| !row.pass && !row.remark.is_empty())
            .filter(|row| !REMARKED.contains(&row.group))
            .map(|row| row.remark.as_str())
            .collect();
        remarks.dedup();
        for remark in remarks {
            let _ = write!(page, "\nNot met: {remark}\n");
        }
        for figure in figures.iter().filter(|figure| figure.group == part.group) {
            let _ = write!(
                page,
                "\n![{}](images/{}.svg)\n\n{}\n",
                figure.caption, figure.stem, figure.caption
            );
        }
    }
    let _ = write!(page, "\n{SPEED}{NOT_VALIDATED}");
    page
}
