//! Figures, tables and MAT files.

use rollover_app::report::data::{Report, Scene};
use rollover_app::report::{FIGURE_ENDS, REPORT_FILE, TABLE_NAMES, figures, mat, tables, write};

use super::{folder, full, scene, text};

#[test]
fn every_plot_has_a_figure() {
    let figures = figures(&full()).expect("they can be drawn");
    let names: Vec<&str> = figures.iter().map(|f| f.name.as_str()).collect();
    for end in FIGURE_ENDS {
        let there = names.iter().any(|name| name.ends_with(&format!("-{end}")));
        assert!(there, "no figure `{end}` in {names:?}");
    }
    let road = figures
        .iter()
        .find(|f| f.name == "turn-road")
        .expect("it is there");
    assert!(
        road.svg.matches("<rect").count() > 1000,
        "the ground is drawn"
    );
    for figure in &figures {
        let ours = FIGURE_ENDS.iter().any(|end| figure.name.ends_with(end));
        assert!(ours, "an old `{}` would not be removed", figure.name);
        assert!(figure.svg.starts_with("<svg") && !figure.svg.contains("NaN"));
    }
}

#[test]
fn gaps_and_missing_columns_leave_a_figure_out_or_broken_not_at_zero() {
    let mut scene = scene();
    for run in &mut scene.runs {
        run.columns.remove("roll_deg");
        run.columns.get_mut("ltr").expect("it is there")[100..300].fill(f64::NAN);
    }
    let report = Report {
        scenes: vec![scene],
        ..Report::default()
    };
    let figures = figures(&report).expect("they can be drawn");
    assert!(figures.iter().all(|f| f.name != "turn-roll"));
    assert!(figures.iter().all(|f| !f.svg.contains("NaN")));
    let bare = Report {
        scenes: vec![Scene::default()],
        ..Report::default()
    };
    assert!(
        rollover_app::report::figures(&bare)
            .expect("nothing to draw")
            .is_empty()
    );
}

#[test]
fn tables_have_a_row_for_everything() {
    let report = full();
    let tables = tables(&report).expect("they can be written");
    let names: Vec<&str> = tables.iter().map(|t| t.name).collect();
    assert_eq!(
        names,
        ["claims", "timing", "runs"],
        "empty tables are left out"
    );
    let runs = tables
        .iter()
        .find(|t| t.name == "runs")
        .expect("it is there");
    assert_eq!(runs.csv.lines().count(), 4);
    assert!(TABLE_NAMES.contains(&"seeds"));
}

#[test]
fn files_of_an_earlier_report_are_replaced_and_others_kept() {
    let folder = folder();
    let page = folder.path().join(REPORT_FILE);
    write(&full(), &page).expect("the folder can be written");
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("figures/mine.svg"), "mine").expect("writable");
    std::fs::write(at("figures/scenes/gone-ltr.svg"), "old").expect("writable");
    std::fs::write(at("figures/older-ltr.svg"), "older").expect("writable");
    let mut small = full();
    small.claims.clear();
    small.scenes[0].profile = None;
    let written = write(&small, &page).expect("the folder can be written");
    assert!(written.page_bytes < 5_000_000);
    for gone in ["gone-ltr", "turn-terrain"] {
        assert!(!at(&format!("figures/scenes/{gone}.svg")).exists());
    }
    assert!(!at("figures/older-ltr.svg").exists() && at("figures/scenes/turn-ltr.svg").exists());
    assert!(!at("tables/claims.csv").exists() && at("tables/runs.csv").exists());
    assert_eq!(text(&at("figures/mine.svg")), "mine");
}

#[test]
fn a_mat_file_reads_back_to_the_same_bits() {
    let folder = folder();
    let mut columns = super::columns(333, 1.1);
    columns.get_mut("ltr").expect("it is there")[7] = f64::NAN;
    columns.insert("solve_status".into(), vec![2.0; 333]);
    let path = folder.path().join("log.mat");
    mat::write(&path, &columns).expect("the folder can be written");
    let file = std::fs::File::open(&path).expect("it is there");
    let read = matfile::MatFile::parse(file).expect("it is a MAT file");
    for (name, values) in &columns {
        let array = read
            .find_by_name(name)
            .unwrap_or_else(|| panic!("no `{name}`"));
        assert_eq!(array.size(), &vec![333, 1]);
        let matfile::NumericData::Double { real, imag: None } = array.data() else {
            panic!("`{name}` is not real double");
        };
        let bits = |v: &[f64]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(real), bits(values), "{name}");
    }
}
