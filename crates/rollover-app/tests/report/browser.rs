//! The page in a headless browser: it tests itself when opened with `#selftest`. Without a browser
//! these tests say so and pass.

use std::path::{Path, PathBuf};
use std::process::Command;

use rollover_app::report::data::{Report, Run, Scene};
use rollover_app::report::{html, run_figures};

use super::paper::paper;
use super::{folder, full};

const BROWSERS: [&str; 5] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
];

const WIDE: &str = "--window-size=1300,900";
const DARK: &str = "--blink-settings=preferredColorScheme=0";

/// A window cannot be as narrow as a telephone; a frame can.
const NARROW: &str = r#"<!DOCTYPE html><iframe src="report.html#selftest" style="width:380px;height:760px"></iframe>
<script>addEventListener("message", (event) =>
  (document.documentElement.dataset.selftest = JSON.stringify(event.data.selftest)))</script>"#;

/// What `ROLLOVER_BROWSER` names, else one in the path.
fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("ROLLOVER_BROWSER").map(PathBuf::from);
    if named.is_some() {
        return named;
    }
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    let found = |name: &&str| {
        folders
            .iter()
            .map(|f| f.join(name))
            .find(|file| file.is_file())
    };
    BROWSERS.iter().find_map(found)
}

/// Opens the page and returns what its self-test found.
fn selftest(browser: &Path, folder: &Path, page: &Path, more: &[&str]) -> serde_json::Value {
    let output = Command::new(browser)
        .args([
            "--headless",
            // Containers run as root, where the sandbox cannot.
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-sync",
            "--no-first-run",
            "--hide-scrollbars",
            "--host-resolver-rules=MAP * ~NOTFOUND",
            "--virtual-time-budget=60000",
            "--dump-dom",
        ])
        .args(more)
        .arg(format!(
            "--user-data-dir={}",
            folder.join("profile").display()
        ))
        .arg(format!("file://{}#selftest", page.display()))
        .output()
        .expect("the browser starts");
    let dom = String::from_utf8_lossy(&output.stdout);
    let Some(start) = dom.find("data-selftest=\"") else {
        let errors = String::from_utf8_lossy(&output.stderr);
        panic!("the page did not finish its self-test: {errors}");
    };
    let rest = &dom[start + 15..];
    let found = &rest[..rest.find('"').expect("the attribute ends")];
    serde_json::from_str(&found.replace("&quot;", "\"").replace("&amp;", "&")).expect("JSON")
}

fn passes(report: &Report, narrow: bool, more: &[&str]) -> Option<serde_json::Value> {
    let Some(browser) = browser() else {
        eprintln!(
            "skipped: no Chromium is installed; install one, or name it in ROLLOVER_BROWSER, to test the page"
        );
        return None;
    };
    let folder = folder();
    let page = folder.path().join("report.html");
    std::fs::write(&page, html(report).expect("a page")).expect("writable");
    let frame = folder.path().join("frame.html");
    std::fs::write(&frame, NARROW).expect("writable");
    let opened = if narrow { &frame } else { &page };
    let found = selftest(&browser, folder.path(), opened, more);
    assert_eq!(found["ok"], true, "{found:#}");
    Some(found)
}

#[test]
fn plots_replay_cursor_and_keys_work() {
    if let Some(found) = passes(&full(), false, &[WIDE]) {
        // Nine over time, wheel loads, the ground.
        assert_eq!(found["plots"], 11);
        assert!(
            found["checks"].as_u64().is_some_and(|n| n > 15),
            "{found:#}"
        );
    }
}

#[test]
fn a_campaigns_page_begins_with_the_papers_cast_and_pair() {
    let cast = ["driver", "rd-deepc-1", "rd-deepc-2", "lmpc-1", "lmpc-2"];
    if let Some(found) = passes(&paper(400), false, &[WIDE]) {
        assert_eq!(found["drawn"][0], serde_json::json!(cast));
        assert_eq!(
            found["drawn"][1],
            serde_json::json!(["driver", "rd-deepc-1", "lmpc-1"])
        );
        let pair = serde_json::json!(["rd-deepc-1", "lmpc-1"]);
        assert_eq!(found["pairs"], serde_json::json!([pair, pair, pair]));
    }
    passes(&paper(400), true, &[WIDE]);
}

#[test]
fn a_narrow_screen_does_not_scroll_sideways() {
    passes(&full(), true, &[WIDE]);
}

#[test]
fn a_dark_screen_shows_the_same() {
    passes(&full(), false, &[WIDE, DARK]);
}

#[test]
fn a_log_that_says_little_is_shown() {
    // No road, no wheel loads, no position, no outcome, one column, gaps.
    let mut scene = Scene {
        name: "car".into(),
        title: "A car <b>".into(),
        ..Scene::default()
    };
    let mut columns = super::columns(900, 0.5);
    columns.retain(|name, _| name == "time_s" || name == "speed_kmh");
    columns.get_mut("speed_kmh").expect("it is there")[200..400].fill(f64::NAN);
    scene.runs = vec![Run {
        label: "car".into(),
        figures: run_figures(&columns, None),
        columns,
        ..Run::default()
    }];
    let report = Report {
        title: "Little".into(),
        scenes: vec![scene],
        ..Report::default()
    };
    if let Some(found) = passes(&report, false, &[WIDE]) {
        assert_eq!(found["plots"], 1);
    }
    passes(&Report::default(), false, &[WIDE]);
}
