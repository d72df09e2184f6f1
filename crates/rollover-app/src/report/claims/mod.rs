//! The paper's claims, judged by the runs of a campaign.
//!
//! A claim is a rule on single runs, on pairs of runs of the same recording and course, or on what was
//! timed. The fraction of the judged cases in which it holds gives the verdict ([`Verdict`]); nobody
//! types it in. A case without a controller counts as one in which the claim does not hold. Claims
//! without any judged case are left out.

mod cases;
mod reasons;

use super::campaign::Campaign;
use super::data::{Claim, Settings, Verdict};
use super::measures::median;
use crate::summary::{SPEED_RECOVERED_KMH, Summary};
use crate::timing::{TimedForm, TimedMethod};
use cases::{Cases, Count, completed, rolled_over, rolled_over_in_the_last_turn, safe};

/// The scenarios of the paper.
pub const SCENARIOS: [&str; 3] = [SEDAN, TRUCK, RIVERBED];
pub(super) const SEDAN: &str = "sedan-s1";
pub(super) const TRUCK: &str = "truck-s2";
pub(super) const RIVERBED: &str = "riverbed-s3";

/// Heading of the claims that the paper's table makes.
const COSTS_AND_TIMES: &str = "Costs and times";

/// What the campaign asks.
pub const QUESTION: [&str; 3] = [
    "Does a controller that knows the vehicle only from a recorded drive keep it on its wheels where the driver alone rolls over, and does it keep its speed? How does a linear MPC on a model identified from the same recording do?",
    "The claims are those of “Model-free Vehicle Rollover Prevention: A Data-driven Predictive Control Approach”. Its vehicles, roads and driver are not published; ours are calibrated so that its situations arise.",
    "Every claim is judged twice: with the settings that we recommend (a limit on |LTR| with a margin and a larger weight λ_g, chosen on recording seeds 0 to 9) and with the paper's as far as it gives them (`-paper`: limit 1, λ_g = 100), on the course and on its mirror image. `floor` is the driver held at the lowest target speed: what a controller must beat in speed.",
];

/// How a verdict is found.
pub const RULE: &str = "A claim is `reproduced` where it holds in at least 80 % of the judged runs, `partly` in at least 20 %, else `not reproduced`. Completed means: neither rolled over nor spun out, and never farther from the path than half the road's width. Safe means: completed with |LTR| never above 1.";

/// A speed is near a bound within this distance, km/h.
const NEAR_KMH: f64 = 2.0;
/// Interventions are confined to the last turn if this part of the cost arises there.
const MAINLY: f64 = 0.8;
/// What counts as significantly faster. The paper has 16.
const FASTER: f64 = 5.0;

/// Judges every claim for which the campaign has runs.
#[must_use]
pub fn judge(campaign: &Campaign) -> Vec<Claim> {
    let judge = Judge { campaign };
    let mut claims = Vec::from(judge.drivers());
    for settings in [Settings::Recommended, Settings::Paper] {
        claims.extend(judge.sedan(settings));
    }
    for settings in [Settings::Recommended, Settings::Paper] {
        claims.extend(judge.truck(settings));
    }
    for settings in [Settings::Recommended, Settings::Paper] {
        claims.extend(judge.riverbed(settings));
    }
    claims.extend(judge.table());
    claims.into_iter().flatten().collect()
}

impl Settings {
    fn suffix(self) -> &'static str {
        match self {
            Self::Recommended => "",
            Self::Paper => "-paper",
        }
    }

    /// Picks a controller's name.
    fn of(self, recommended: &'static str, paper: &'static str) -> &'static str {
        match self {
            Self::Recommended => recommended,
            Self::Paper => paper,
        }
    }
}

struct Judge<'a> {
    campaign: &'a Campaign,
}

/// The words of a claim.
struct Words {
    id: String,
    group: &'static str,
    settings: Option<Settings>,
    claim: String,
    paper: &'static str,
}

impl Words {
    fn new(id: &str, settings: Settings, claim: &str, paper: &'static str) -> Self {
        Self {
            id: format!("{id}{}", settings.suffix()),
            group: group(id),
            settings: Some(settings),
            claim: claim.into(),
            paper,
        }
    }
}

/// The heading of a claim: its experiment.
fn group(id: &str) -> &'static str {
    match id.split_once('-') {
        _ if id == "s1-cost" => COSTS_AND_TIMES,
        Some(("s1", _)) => "Sedan",
        Some(("s2", _)) => "Truck",
        Some(("s3", _)) => "Riverbed",
        _ => COSTS_AND_TIMES,
    }
}

impl<'a> Judge<'a> {
    fn cases(&self, scenario: &'static str, controller: &'static str) -> Cases<'a> {
        Cases::new(self.campaign, scenario, controller)
    }

    /// A claim on single runs.
    fn single(
        &self,
        words: Words,
        cases: &Cases<'_>,
        holds: impl Fn(&Summary) -> bool,
    ) -> Option<Claim> {
        let count = cases.count(holds);
        self.claim(words, cases, count, &cases.words())
    }

    fn claim(&self, words: Words, cases: &Cases<'_>, count: Count, ours: &str) -> Option<Claim> {
        if cases.all.is_empty() {
            return None;
        }
        let verdict = Verdict::of_fraction(count.fraction().unwrap_or(0.0));
        let reason = reasons::reason(self.campaign, &words.id, cases, verdict);
        Some(Claim {
            ours: format!("holds in {count}. {ours}"),
            id: words.id,
            group: words.group.into(),
            settings: words.settings,
            claim: words.claim,
            paper: words.paper.into(),
            seeds: cases.seeds(),
            judged: count.of,
            fraction: count.fraction(),
            verdict,
            reason,
        })
    }

    fn drivers(&self) -> [Option<Claim>; 2] {
        [
            self.driver(
                "s1-driver",
                "The driver alone rolls over in the last turn.",
                "rolls over in the last turn",
                rolled_over_in_the_last_turn,
            ),
            self.driver(
                "s1-driver-before",
                "The driver alone exceeds the limit on LTR before the last turn as well.",
                "violates the limit on LTR several times",
                |run| {
                    let turn = run.course.violation_first_turn;
                    turn.is_some_and(|turn| turn < run.course.turns)
                },
            ),
        ]
    }

    fn driver(
        &self,
        id: &str,
        claim: &str,
        paper: &'static str,
        holds: fn(&Summary) -> bool,
    ) -> Option<Claim> {
        let words = Words {
            id: id.into(),
            group: group(id),
            settings: None,
            claim: claim.into(),
            paper,
        };
        let mut claim = self.single(words, &self.cases(SEDAN, "driver"), holds)?;
        claim.ours += "; nothing is random about it: a course is driven once, and its mirror image";
        Some(claim)
    }

    /// Table I.
    fn table(&self) -> [Option<Claim>; 2] {
        [self.same_decisions(), self.faster()]
    }

    fn same_decisions(&self) -> Option<Claim> {
        let agreement = &self.campaign.timing.as_ref()?.deepc_equals_rd_deepc;
        let cases = self.cases(SEDAN, "deepc-1");
        let words = Words {
            id: "table-same".into(),
            group: group("table-same"),
            settings: None,
            claim: "DeePC and RD-DeePC give the same inputs, outputs and cost.".into(),
            paper: "costs 9.94 and 9.95, close agreement of the trajectories",
        };
        let count = Count {
            holds: usize::from(agreement.agrees),
            of: 1,
        };
        self.claim(words, &cases, count, &agreement.to_string())
    }

    fn faster(&self) -> Option<Claim> {
        let rows = &self.campaign.timing.as_ref()?.rows;
        let written = |method| {
            let row = |row: &&crate::timing::TimingRow| {
                row.method == method && row.form == TimedForm::AsWritten
            };
            rows.iter().find(row).map(|row| row.step_s_median)
        };
        let (deepc, rd_deepc) = (written(TimedMethod::Deepc)?, written(TimedMethod::RdDeepc)?);
        let words = Words {
            id: "table-time".into(),
            group: group("table-time"),
            settings: None,
            claim: format!(
                "The reduction makes a step significantly faster (at least {FASTER} times, both programs as written)."
            ),
            paper: "1.446 s and 0.089 s per step: 16 times",
        };
        let count = Count {
            holds: usize::from(deepc >= FASTER * rd_deepc),
            of: 1,
        };
        let cases = self.cases(SEDAN, "deepc-1");
        let ours = format!(
            "{deepc:.1} s and {rd_deepc:.1} s per step: {:.1} times, beside other runs on the same machine",
            deepc / rd_deepc
        );
        self.claim(words, &cases, count, &ours)
    }

    fn sedan(&self, settings: Settings) -> Vec<Option<Claim>> {
        let rd_1 = self.cases(SEDAN, settings.of("rd-deepc-1", "rd-deepc-1-paper"));
        let rd_2 = self.cases(SEDAN, settings.of("rd-deepc-2", "rd-deepc-2-paper"));
        let lmpc_1 = self.cases(SEDAN, settings.of("lmpc-1", "lmpc-1-paper"));
        let lmpc_2 = self.cases(SEDAN, settings.of("lmpc-2", "lmpc-2-paper"));
        let words = |id, claim, paper| Words::new(id, settings, claim, paper);
        vec![
            self.single(
                words(
                    "s1-rd-deepc-1",
                    "RD-DeePC1 is safe.",
                    "all turns passed safely",
                ),
                &rd_1,
                safe,
            ),
            self.single(
                words(
                    "s1-rd-deepc-2",
                    "RD-DeePC2 is safe.",
                    "all turns passed safely",
                ),
                &rd_2,
                safe,
            ),
            self.single(
                words(
                    "s1-only-when-needed",
                    "RD-DeePC1 intervenes mainly in the last turn (at least 80 % of its cost).",
                    "corrections only when necessary, most of all near the final and sharpest turn",
                ),
                &rd_1,
                |run| {
                    completed(run)
                        && run.cost.zip(run.course.cost_before_last_turn).is_some_and(
                            |(cost, before)| before <= (1.0 - MAINLY) * cost,
                        )
                },
            ),
            self.recovery(
                words(
                    "s1-speed-recovery",
                    "After the last turn RD-DeePC1 is back at the reference speed sooner than RD-DeePC2.",
                    "RD-DeePC1 brings the vehicle back to the reference speed in a shorter time",
                ),
                &rd_1,
                &rd_2,
            ),
            self.single(
                words(
                    "s1-lmpc-1",
                    "LMPC1 rolls over in the last turn.",
                    "rolls over in the last turn at about 23 s",
                ),
                &lmpc_1,
                rolled_over_in_the_last_turn,
            ),
            self.single(
                words(
                    "s1-lmpc-2",
                    "LMPC2 violates the limit on LTR, but does not roll over.",
                    "violates the limit at about 21 s without rolling over",
                ),
                &lmpc_2,
                |run| completed(run) && run.ltr_violation_s > 0.0,
            ),
            self.single(
                words(
                    "s1-lmpc-2-slow",
                    "LMPC2 gets through near the lower speed limit (mean speed in the turns within 2 km/h of it).",
                    "operates near the lower speed limit in all turns",
                ),
                &lmpc_2,
                slow,
            ),
            self.cost(
                words(
                    "s1-cost",
                    "RD-DeePC1 costs less than LMPC1.",
                    "9.95 against 74.13",
                ),
                &rd_1,
                &lmpc_1,
            ),
        ]
    }

    fn truck(&self, settings: Settings) -> Vec<Option<Claim>> {
        let rd = self.cases(TRUCK, settings.of("rd-deepc-1", "rd-deepc-1-paper"));
        let lmpc = self.cases(TRUCK, settings.of("lmpc-1", "lmpc-1-paper"));
        let words = |id, claim, paper| Words::new(id, settings, claim, paper);
        vec![
            self.single(
                words(
                    "s2-rd-deepc",
                    "RD-DeePC is safe.",
                    "no rollover and no violation of the limit",
                ),
                &rd,
                safe,
            ),
            self.single(
                words("s2-lmpc", "LMPC completes.", "passes all turns"),
                &lmpc,
                completed,
            ),
            self.single(
                words(
                    "s2-lmpc-slow",
                    "LMPC gets through near the lowest speed allowed (mean speed in the turns within 2 km/h of it).",
                    "close to the minimum speed",
                ),
                &lmpc,
                slow,
            ),
            self.faster_truck(
                words(
                    "s2-faster",
                    "Both complete, and RD-DeePC's mean speed is higher than LMPC's.",
                    "faster than LMPC without compromising safety",
                ),
                &rd,
                &lmpc,
            ),
        ]
    }

    fn riverbed(&self, settings: Settings) -> Vec<Option<Claim>> {
        let rd = self.cases(RIVERBED, settings.of("rd-deepc-1", "rd-deepc-1-paper"));
        let lmpc = self.cases(RIVERBED, settings.of("lmpc-1", "lmpc-1-paper"));
        let words = |id, claim, paper| Words::new(id, settings, claim, paper);
        vec![
            self.single(
                words(
                    "s3-rd-deepc",
                    "RD-DeePC prevents the rollover.",
                    "avoids rollover on the altered road",
                ),
                &rd,
                completed,
            ),
            self.single(
                words("s3-lmpc", "LMPC rolls over.", "unable to prevent rollover"),
                &lmpc,
                rolled_over,
            ),
        ]
    }

    /// Judged on pairs in which both recover.
    fn recovery(&self, words: Words, first: &Cases<'a>, second: &Cases<'a>) -> Option<Claim> {
        let pairs = first.pairs(second).filter_map(|(a, b)| {
            let both = completed(a) && completed(b);
            both.then_some((a.course.speed_recovery_s?, b.course.speed_recovery_s?))
        });
        let times: Vec<(f64, f64)> = pairs.collect();
        let count = Count {
            holds: times.iter().filter(|(a, b)| a < b).count(),
            of: times.len(),
        };
        let difference: Vec<f64> = times.iter().map(|(a, b)| b - a).collect();
        let ours = match median(&difference) {
            Some(difference) => format!(
                "Pairs in which both complete and come back to within {SPEED_RECOVERED_KMH} km/h; RD-DeePC1 is {difference:.2} s sooner in the median"
            ),
            None => "In no pair do both complete and come back to the reference speed".into(),
        };
        self.claim(words, first, count, &ours)
    }

    /// Judged on pairs in which both complete: a rollover ends a run early and makes it cheap.
    fn cost(&self, words: Words, ours: &Cases<'a>, theirs: &Cases<'a>) -> Option<Claim> {
        let pairs = ours.pairs(theirs).filter_map(|(a, b)| {
            let both = completed(a) && completed(b);
            both.then_some((a.cost?, b.cost?))
        });
        let costs: Vec<(f64, f64)> = pairs.collect();
        let count = Count {
            holds: costs.iter().filter(|(a, b)| a < b).count(),
            of: costs.len(),
        };
        let middle = |f: fn(&(f64, f64)) -> f64| median(&costs.iter().map(f).collect::<Vec<_>>());
        let words_of = match (middle(|c| c.0), middle(|c| c.1)) {
            (Some(a), Some(b)) => format!(
                "Pairs in which both complete (a rollover ends a run early and makes it cheap); costs {a:.3e} and {b:.3e} in the median"
            ),
            _ => "In no pair do both complete, so that their costs cannot be compared".into(),
        };
        self.claim(words, ours, count, &words_of)
    }

    /// Judged on all pairs: it holds where both complete and RD-DeePC's mean speed is higher.
    fn faster_truck(&self, words: Words, ours: &Cases<'a>, theirs: &Cases<'a>) -> Option<Claim> {
        let all = ours.pairs(theirs).count();
        let pairs: Vec<_> = ours
            .pairs(theirs)
            .filter(|(a, b)| completed(a) && completed(b))
            .collect();
        let count = Count {
            holds: pairs
                .iter()
                .filter(|(a, b)| a.speed_mean_kmh > b.speed_mean_kmh)
                .count(),
            of: all,
        };
        let lead: Vec<f64> = pairs
            .iter()
            .map(|(a, b)| a.speed_mean_kmh - b.speed_mean_kmh)
            .collect();
        let words_of = match median(&lead) {
            Some(lead) => format!(
                "Both complete in {} of {all} pairs; there RD-DeePC's mean speed is {lead:+.2} km/h from LMPC's in the median",
                pairs.len()
            ),
            None => "In no pair do both complete".into(),
        };
        self.claim(words, ours, count, &words_of)
    }
}

/// Completed, and in the turns near the lowest target speed that was allowed.
fn slow(run: &Summary) -> bool {
    let bounds = run.target_speed_bounds_kmh;
    let near = bounds.zip(run.course.speed_in_turns_mean_kmh);
    completed(run) && near.is_some_and(|([lowest, _], mean)| mean <= lowest + NEAR_KMH)
}
