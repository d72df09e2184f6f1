//! A report like a campaign's: three scenes, many controllers, claims with both settings.

use rollover_app::report::data::{Claim, Report, Role, Scene, Settings, UnloggedRun, Verdict};
use rollover_app::report::{PAPER_FIGURES, REPORT_FILE, figures, html, tables, write};
use vehicle_dyn::metrics::Outcome;

use super::{folder, full, run, scene};

/// Controllers of the sedan, those of the paper's figures first.
const SEDAN: [&str; 12] = [
    "driver",
    "floor",
    "rd-deepc-1",
    "rd-deepc-2",
    "rd-deepc-1-paper",
    "rd-deepc-2-paper",
    "deepc-1",
    "lmpc-1",
    "lmpc-2",
    "lmpc-1-paper",
    "lmpc-2-paper",
    "lmpc-1-no-speed-effect",
];
const TRUCK: [&str; 6] = [
    "driver",
    "floor",
    "rd-deepc-1",
    "rd-deepc-1-paper",
    "lmpc-1",
    "lmpc-1-paper",
];
const RIVERBED: [&str; 7] = [
    "driver",
    "floor",
    "rd-deepc-1",
    "rd-deepc-1-paper",
    "rd-deepc-1-smooth-data",
    "lmpc-1",
    "lmpc-1-paper",
];

fn driven(name: &str, controllers: &[&str], rows: u32) -> Scene {
    let runs = controllers.iter().enumerate().map(|(k, controller)| {
        let lean = if controller.starts_with("lmpc") {
            1.05
        } else {
            0.9
        };
        let lean = lean + 0.005 * k as f64;
        run(
            controller,
            Role::of_name(controller),
            rows,
            lean,
            Outcome::Completed,
        )
    });
    Scene {
        name: name.into(),
        title: format!("{name}, a vehicle"),
        runs: runs.collect(),
        ..scene()
    }
}

/// The report, with runs of some number of rows.
pub(super) fn paper(rows: u32) -> Report {
    let mut report = full();
    report.scenes = vec![
        driven("sedan-s1", &SEDAN, rows),
        driven("truck-s2", &TRUCK, rows),
        driven("riverbed-s3", &RIVERBED, rows),
    ];
    for scene in &mut report.scenes[..2] {
        (scene.terrain, scene.profile) = (None, None);
    }
    let told = report.claims[0].clone();
    let claim = |id: &str, group: &str, settings, fraction| Claim {
        id: id.into(),
        group: group.into(),
        settings,
        claim: format!("What `{id}` claims."),
        fraction: Some(fraction),
        verdict: Verdict::of_fraction(fraction),
        reason: None,
        ..told.clone()
    };
    report.claims = vec![claim("s1-driver", "Sedan", None, 1.0)];
    for (id, group) in [
        ("s1-lmpc-1", "Sedan"),
        ("s2-lmpc", "Truck"),
        ("s3-lmpc", "Riverbed"),
    ] {
        for (suffix, settings) in [("", Settings::Recommended), ("-paper", Settings::Paper)] {
            report
                .claims
                .push(claim(&format!("{id}{suffix}"), group, Some(settings), 0.5));
        }
    }
    let mut link = told.reason.clone().expect("it has one");
    let to = link.run.as_mut().expect("it has one");
    (to.scene, to.label) = ("sedan-s1".into(), "lmpc-1-no-speed-effect".into());
    report.claims[1].reason = Some(link);
    let mut other = run("lmpc-1", Role::Lmpc, 10, 0.5, Outcome::LeftRoad);
    other.seed = Some(11);
    other.columns.clear();
    report.unlogged = vec![
        UnloggedRun {
            scene: "sedan-s1".into(),
            run: other.clone(),
            failure: None,
        },
        UnloggedRun {
            scene: "truck-s2".into(),
            run: other,
            failure: Some("its model is unstable".into()),
        },
    ];
    report
}

#[test]
fn three_scenes_stay_below_five_megabytes() {
    let page = html(&paper(3500)).expect("a page");
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
}

#[test]
fn the_papers_figures_have_its_controllers_alone() {
    let figures = figures(&paper(300)).expect("they can be drawn");
    let svg = |name: &str| {
        let figure = figures.iter().find(|f| f.name == name);
        &figure.unwrap_or_else(|| panic!("no `{name}`")).svg
    };
    for name in PAPER_FIGURES {
        assert!(
            svg(name).starts_with("<svg") && !svg(name).contains("NaN"),
            "{name}"
        );
    }
    for figure in figures.iter().filter(|f| f.of_the_paper) {
        let plain = figure.name.strip_suffix("-paper").unwrap_or(&figure.name);
        assert!(
            PAPER_FIGURES.contains(&plain),
            "`{}` would stay",
            figure.name
        );
    }
    let names = ["driver", "RD-DeePC1", "RD-DeePC2", "LMPC1", "LMPC2"];
    for name in ["fig-sedan-ltr", "fig-sedan-speed-paper"] {
        assert!(names.iter().all(|n| svg(name).contains(n)), "{name}");
        assert!(!svg(name).contains("floor") && !svg(name).contains("no-speed"));
    }
    assert!(svg("fig-comparison").contains("RD-DeePC") && !svg("fig-comparison").contains("LMPC"));
    assert!(svg("fig-truck").contains("LMPC") && !svg("fig-truck").contains("driver"));
    assert!(svg("fig-snapshot").contains("LMPC1 first violates the limit"));
}

#[test]
fn a_snapshot_of_a_run_without_violation_shows_its_largest_ltr() {
    let mut report = paper(300);
    for run in &mut report.scenes[0].runs {
        for ltr in run.columns.get_mut("ltr").expect("it is there") {
            *ltr = ltr.clamp(-0.99, 0.99);
        }
    }
    let figures = figures(&report).expect("they can be drawn");
    let snapshot = figures.iter().find(|f| f.name == "fig-snapshot");
    assert!(snapshot.is_some_and(|f| f.svg.contains("LMPC1 has its largest |LTR|")));
}

#[test]
fn the_papers_figures_lie_apart_and_are_removed() {
    let folder = folder();
    let page = folder.path().join(REPORT_FILE);
    write(&paper(100), &page).expect("the folder can be written");
    let at = |name: &str| folder.path().join("figures").join(name);
    assert!(at("fig-sedan-ltr-paper.svg").exists() && at("scenes/sedan-s1-ltr.svg").exists());
    std::fs::write(at("fig-mine.svg"), "mine").expect("writable");
    write(&full(), &page).expect("the folder can be written");
    assert!(!at("fig-sedan-ltr-paper.svg").exists() && !at("fig-road.svg").exists());
    assert!(!at("scenes/sedan-s1-ltr.svg").exists() && at("scenes/turn-ltr.svg").exists());
    assert!(at("fig-mine.svg").exists());
}

#[test]
fn the_table_of_runs_has_those_without_a_log() {
    let tables = tables(&paper(50)).expect("they can be written");
    let csv = |name: &str| {
        let table = tables.iter().find(|t| t.name == name);
        &table.unwrap_or_else(|| panic!("no `{name}`")).csv
    };
    assert_eq!(csv("runs").lines().count(), 1 + 12 + 6 + 7 + 2);
    let lost = csv("runs").lines().find(|line| line.contains("unstable"));
    let lost = lost.expect("it is there");
    assert!(
        lost.starts_with("truck-s2,lmpc-1,lmpc-1,11,false,"),
        "{lost}"
    );
    assert!(csv("claims").contains("s2-lmpc-paper,Truck,paper,"));
}
