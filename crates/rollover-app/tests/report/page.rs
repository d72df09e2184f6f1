//! The page as text: nothing of it is loaded, nothing that data bring along can run.

use rollover_app::report::data::{Columns, Report, Role, Run, Scene, Verdict};
use rollover_app::report::html;

use super::{assert_says, full, run, scene};

const EVIL: &str = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\u{2028}";

fn data(page: &str) -> serde_json::Value {
    let start = page
        .find("id=\"report-data\">")
        .expect("the data are there")
        + 17;
    let rest = &page[start..];
    let json = &rest[..rest.find("</script>").expect("the data end")];
    serde_json::from_str(json).expect("the data are JSON")
}

#[test]
fn texts_from_files_cannot_run() {
    let mut report = full();
    report.title = EVIL.into();
    report.asked = vec![EVIL.into()];
    report.claims[0].claim = EVIL.into();
    report.scenes[0].title = EVIL.into();
    report.scenes[0].runs[0].label = EVIL.into();
    report.notes = vec![EVIL.into()];
    let page = html(&report).expect("a page");
    assert!(!page.contains("<script>alert") && !page.contains("<img"));
    assert_eq!(page.matches("</script>").count(), 3);
    assert_eq!(data(&page)["title"], EVIL, "the text itself arrives");
    // Text is never parsed as markup by the page's own code.
    for assets in [
        "innerHTML",
        "outerHTML",
        "insertAdjacentHTML",
        "document.write",
        "eval(",
    ] {
        assert!(!page.contains(assets), "{assets}");
    }
}

#[test]
fn nothing_is_loaded() {
    let page = html(&full()).expect("a page");
    let head = &page[..page.find("</head>").expect("a head")];
    assert_says(
        head,
        &[
            "Content-Security-Policy",
            "default-src 'none'",
            "script-src 'sha256-",
        ],
    );
    assert!(!head.contains("unsafe"));
    for loads in [
        "<link",
        "@import",
        "url(",
        " src=",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!page.contains(loads), "the page must not have `{loads}`");
    }
}

#[test]
fn an_empty_report_is_a_page() {
    let page = html(&Report::default()).expect("a page");
    assert_eq!(data(&page)["scenes"], serde_json::json!([]));
    let mut scenes = vec![Scene::default()];
    scenes[0].runs = vec![Run::default()];
    scenes[0].runs[0].columns = Columns::from([("time_s".into(), vec![1.0])]);
    let odd = Report {
        scenes,
        ..Report::default()
    };
    html(&odd).expect("a page");
}

#[test]
fn many_long_runs_stay_below_five_megabytes() {
    let mut scene = scene();
    let long = run(
        "rd-deepc-1",
        Role::default(),
        6000,
        0.9,
        vehicle_dyn::metrics::Outcome::Completed,
    );
    scene.runs = vec![long; 60];
    let report = Report {
        scenes: vec![scene],
        ..Report::default()
    };
    let page = html(&report).expect("a page");
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
}

#[test]
fn the_page_states_its_display_rate_and_keeps_peaks() {
    let mut report = full();
    let ltr = report.scenes[0].runs[1]
        .columns
        .get_mut("ltr")
        .expect("it is there");
    ltr[333] = 2.5;
    let data = data(&html(&report).expect("a page"));
    let scene = &data["scenes"][0];
    assert_eq!(scene["grid"]["step_s"], 0.04);
    assert_eq!(scene["runs"][1]["log_interval_s"], 0.01);
    assert_eq!(scene["runs"][1]["columns"]["ltr"]["high"], 2.5);
}

#[test]
fn a_report_survives_json() {
    let mut report = full();
    report.scenes[0].runs[0]
        .columns
        .get_mut("ltr")
        .expect("it is there")[3] = f64::NAN;
    let json = serde_json::to_string(&report).expect("JSON");
    assert!(json.contains("null"), "a gap is null");
    let again: Report = serde_json::from_str(&json).expect("it reads back");
    assert!(again.scenes[0].runs[0].columns["ltr"][3].is_nan());
    assert_eq!(serde_json::to_string(&again).expect("JSON"), json);
}

#[test]
fn verdicts_follow_the_rule() {
    for (fraction, verdict) in [
        (1.0, "reproduced"),
        (0.8, "reproduced"),
        (0.79, "partly"),
        (0.2, "partly"),
        (0.19, "not reproduced"),
        (0.0, "not reproduced"),
    ] {
        assert_eq!(Verdict::of_fraction(fraction).to_string(), verdict);
    }
}

#[test]
fn of_many_runs_one_of_each_controller_is_drawn_at_first() {
    let mut scene = scene();
    let seeds = scene.runs.clone();
    for seed in 11..14 {
        scene.runs.extend(seeds.iter().cloned().map(|mut run| {
            run.label = format!("{}, seed {seed}", run.controller);
            run.seed = Some(seed);
            run
        }));
    }
    let report = Report {
        scenes: vec![scene],
        ..Report::default()
    };
    let data = data(&html(&report).expect("a page"));
    let runs = data["scenes"][0]["runs"].as_array().expect("runs");
    let shown = |n: usize| runs[n]["shown"].as_bool().expect("it is said");
    assert!((0..3).all(shown) && !(3..12).any(shown));
    assert_eq!(runs[1]["look"], runs[4]["look"], "one controller, one look");
    assert_ne!(runs[1]["look"], runs[2]["look"]);
}
