//! The rules that judge the paper's claims, on made-up campaigns.

use rollover_app::report::claims::judge;
use rollover_app::report::data::{Claim, Verdict};
use rollover_app::report::{Campaign, CampaignFile, Failure};
use rollover_app::run_log;
use rollover_app::summary::{RunIdentity, Summary};
use vehicle_dyn::metrics::Outcome;

use super::{folder, write_log};

/// A run as the others are made from: completed, safe, at the reference speed.
fn plain() -> Summary {
    let folder = folder();
    let path = folder.path().join("log.csv");
    write_log(&path, 2);
    let rows = run_log::read(&path).expect("the log is whole");
    let mut run = Summary::of_log(
        RunIdentity::default(),
        Outcome::Completed,
        &rows,
        None,
        0.01,
    );
    run.ltr_abs_max = 0.9;
    run.ltr_violation_s = 0.0;
    run.speed_mean_kmh = 105.0;
    run.target_speed_bounds_kmh = Some([100.0, 120.0]);
    run.course.turns = 3;
    run.course.end_turn = 3;
    run.course.speed_in_turns_mean_kmh = Some(104.0);
    run
}

/// A campaign of ten seeds of every controller named, changed as the seed (0 to 9) says.
struct Made {
    plain: Summary,
    campaign: Campaign,
}

impl Made {
    fn new() -> Self {
        Self {
            plain: plain(),
            campaign: Campaign {
                file: CampaignFile {
                    version: String::new(),
                    command: String::new(),
                    seeds: (0..10).collect(),
                    runs: Vec::new(),
                },
                summaries: Vec::new(),
                failures: Vec::new(),
                timing: None,
            },
        }
    }

    fn with(
        mut self,
        scenario: &str,
        controller: &str,
        change: impl Fn(u64, &mut Summary),
    ) -> Self {
        for seed in 0..10 {
            let mut run = self.plain.clone();
            scenario.clone_into(&mut run.scenario);
            controller.clone_into(&mut run.controller);
            run.seed = seed;
            change(seed, &mut run);
            self.campaign.summaries.push(run);
        }
        self
    }

    fn claim(&self, id: &str) -> Claim {
        let mut claims = judge(&self.campaign).into_iter();
        claims
            .find(|claim| claim.id == id)
            .unwrap_or_else(|| panic!("{id} is judged"))
    }
}

#[test]
fn a_verdict_follows_from_the_number_of_runs() {
    use Verdict::{NotReproduced, Partly, Reproduced};
    for (safe, verdict) in [(10, Reproduced), (8, Reproduced), (7, Partly), (2, Partly)]
        .into_iter()
        .chain([(1, NotReproduced), (0, NotReproduced)])
    {
        let made = Made::new().with("sedan-s1", "rd-deepc-1", |seed, run| {
            if seed >= safe {
                run.outcome = Outcome::RolledOver;
            }
        });
        let claim = made.claim("s1-rd-deepc-1");
        assert_eq!((claim.judged, claim.verdict), (10, verdict), "{safe} safe");
    }
}

#[test]
fn a_moment_above_the_limit_is_not_safe_but_completed() {
    let above = |_: u64, run: &mut Summary| run.ltr_violation_s = 0.01;
    let made = Made::new()
        .with("truck-s2", "rd-deepc-1", above)
        .with("truck-s2", "lmpc-1", above);
    assert_eq!(made.claim("s2-rd-deepc").fraction, Some(0.0));
    assert_eq!(made.claim("s2-lmpc").fraction, Some(1.0));
}

#[test]
fn a_recording_without_a_controller_counts_against_a_claim() {
    let mut made = Made::new().with("truck-s2", "lmpc-1", |_, _| ());
    made.campaign.failures = (10..13)
        .map(|seed| Failure {
            scenario: "truck-s2".into(),
            controller: "lmpc-1".into(),
            seed,
            mirrored: false,
            reason: "no model".into(),
        })
        .collect();
    let claim = made.claim("s2-lmpc");
    assert_eq!(claim.judged, 13);
    assert_eq!(claim.verdict, Verdict::Partly);
    assert!(
        claim.ours.contains("3 without a controller"),
        "{}",
        claim.ours
    );
}

#[test]
fn nearness_to_the_lowest_speed_is_that_of_the_mean_in_the_turns() {
    let made = Made::new().with("sedan-s1", "lmpc-2", |seed, run| {
        // All dip for a moment; four are slow.
        run.speed_min_kmh = 100.0;
        run.course.speed_in_turns_mean_kmh = Some(if seed < 4 { 102.0 } else { 102.1 });
        if seed == 0 {
            run.outcome = Outcome::LeftRoad;
        }
    });
    assert_eq!(made.claim("s1-lmpc-2-slow").fraction, Some(0.3));
}

#[test]
fn costs_are_compared_where_both_complete_and_their_parts_are_told() {
    let priced = |cost: f64, speed: f64| {
        move |seed: u64, run: &mut Summary| {
            run.cost = Some(cost);
            run.cost_of_target_speed = Some(speed);
            if seed < 4 {
                // Ended early, and cheap.
                run.outcome = Outcome::RolledOver;
                run.cost = Some(0.0);
            }
        }
    };
    let made = Made::new()
        .with("sedan-s1", "rd-deepc-1", priced(1000.0, 1.0))
        .with("sedan-s1", "lmpc-1", priced(60.0, 20.0));
    let claim = made.claim("s1-cost");
    assert_eq!((claim.judged, claim.fraction), (6, Some(0.0)));
    let why = claim.reason.expect("there is one").text;
    for part in ["9.99e2", "4.00e1", "1.00e0", "2.00e1"] {
        assert!(why.contains(part), "{part} in: {why}");
    }
}

#[test]
fn without_a_pair_nothing_is_judged() {
    let over = |_: u64, run: &mut Summary| run.outcome = Outcome::RolledOver;
    let made =
        Made::new()
            .with("sedan-s1", "rd-deepc-1", over)
            .with("sedan-s1", "lmpc-1", |_, _| ());
    let claim = made.claim("s1-cost");
    assert_eq!((claim.judged, claim.fraction), (0, None));
    assert_eq!(claim.verdict, Verdict::NotReproduced);
}

#[test]
fn the_faster_truck_is_sought_in_all_pairs() {
    let made = Made::new()
        .with("truck-s2", "rd-deepc-1", |seed, run| {
            run.speed_mean_kmh = if seed == 9 { 90.0 } else { 99.0 };
        })
        .with("truck-s2", "lmpc-1", |seed, run| {
            run.speed_mean_kmh = 95.0;
            if seed < 5 {
                run.outcome = Outcome::RolledOver;
            }
        });
    let claim = made.claim("s2-faster");
    assert_eq!((claim.judged, claim.fraction), (10, Some(0.4)));
}

#[test]
fn the_driver_is_judged_by_the_turn() {
    let made = Made::new().with("sedan-s1", "driver", |seed, run| {
        run.outcome = Outcome::RolledOver;
        run.course.end_turn = if seed < 2 { 2 } else { 3 };
        run.course.violation_first_turn = Some(if seed < 5 { 1 } else { 3 });
    });
    assert_eq!(made.claim("s1-driver").fraction, Some(0.8));
    assert_eq!(made.claim("s1-driver-before").fraction, Some(0.5));
}

#[test]
fn outcomes_over_the_seeds_tell_completed_from_safe() {
    let made = Made::new().with("truck-s2", "rd-deepc-1", |seed, run| {
        if seed < 6 {
            run.ltr_abs_max = 1.01;
        }
        if seed < 1 {
            run.outcome = Outcome::RolledOver;
        }
    });
    let rows = made.campaign.seed_rows(&[]);
    let fractions: Vec<_> = rows
        .iter()
        .map(|row| (row.completed_fraction, row.safe_fraction))
        .collect();
    assert_eq!(fractions, [(Some(0.9), Some(0.4))]);
}
