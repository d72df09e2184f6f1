//! The runs that judge a claim.

use std::fmt::Write;

use vehicle_dyn::metrics::Outcome;

use crate::report::campaign::Campaign;
use crate::report::measures::median;
use crate::summary::Summary;

/// One run that was to be made: its numbers, or nothing if there was no controller.
#[derive(Clone, Copy)]
pub(super) struct Case<'a> {
    pub(super) seed: u64,
    pub(super) mirrored: bool,
    pub(super) run: Option<&'a Summary>,
}

/// All runs of one controller on one scenario, on the course and its mirror image.
pub(super) struct Cases<'a> {
    pub(super) scenario: &'static str,
    pub(super) controller: &'static str,
    pub(super) all: Vec<Case<'a>>,
}

/// How many of how many.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Count {
    pub(super) holds: usize,
    pub(super) of: usize,
}

impl Count {
    pub(super) fn fraction(self) -> Option<f64> {
        (self.of > 0).then(|| self.holds as f64 / self.of as f64)
    }
}

impl std::fmt::Display for Count {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} of {}", self.holds, self.of)
    }
}

impl<'a> Cases<'a> {
    pub(super) fn new(
        campaign: &'a Campaign,
        scenario: &'static str,
        controller: &'static str,
    ) -> Self {
        let made = campaign.summaries.iter();
        let made = made
            .filter(|s| s.scenario == scenario && s.controller == controller)
            .map(|s| Case {
                seed: s.seed,
                mirrored: s.mirrored,
                run: Some(s),
            });
        let failed = campaign.failures.iter();
        let failed = failed
            .filter(|f| f.scenario == scenario && f.controller == controller)
            .map(|f| Case {
                seed: f.seed,
                mirrored: f.mirrored,
                run: None,
            });
        let mut all: Vec<Case<'_>> = made.chain(failed).collect();
        all.sort_by_key(|case| (case.mirrored, case.seed));
        Self {
            scenario,
            controller,
            all,
        }
    }

    pub(super) fn runs(&self) -> impl Iterator<Item = &'a Summary> {
        self.all.iter().filter_map(|case| case.run)
    }

    /// Median over the completed runs that have the number.
    pub(super) fn median_completed(&self, of: impl Fn(&Summary) -> Option<f64>) -> Option<f64> {
        let values = self.runs().filter(|run| completed(run)).filter_map(of);
        median(&values.collect::<Vec<_>>())
    }

    /// The seeds, each once.
    pub(super) fn seeds(&self) -> Vec<u64> {
        let mut seeds: Vec<u64> = self.all.iter().map(|case| case.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds
    }

    /// Cases in which something holds; without a controller nothing does.
    pub(super) fn count(&self, holds: impl Fn(&Summary) -> bool) -> Count {
        Count {
            holds: self.runs().filter(|run| holds(run)).count(),
            of: self.all.len(),
        }
    }

    /// Pairs of runs of the same seed and course.
    pub(super) fn pairs<'b>(
        &'b self,
        other: &'b Cases<'a>,
    ) -> impl Iterator<Item = (&'a Summary, &'a Summary)> + 'b {
        self.all.iter().filter_map(|case| {
            let same = |c: &&Case<'_>| c.seed == case.seed && c.mirrored == case.mirrored;
            Some((case.run?, other.all.iter().find(same)?.run?))
        })
    }

    /// How the runs ended, and their main numbers.
    pub(super) fn words(&self) -> String {
        let mut ends: Vec<String> = Vec::new();
        for (outcome, words) in [
            (Outcome::Completed, "completed"),
            (Outcome::LeftRoad, "left the road"),
            (Outcome::SpunOut, "spun out"),
            (Outcome::RolledOver, "rolled over"),
        ] {
            let number = self.runs().filter(|run| run.outcome == outcome).count();
            if number > 0 {
                ends.push(format!("{number} {words}"));
            }
        }
        let failed = self.all.len() - self.runs().count();
        if failed > 0 {
            ends.push(format!("{failed} without a controller"));
        }
        let mut words = format!("{} runs: {}", self.all.len(), ends.join(", "));
        let values = |f: fn(&Summary) -> f64| self.runs().map(f).collect::<Vec<_>>();
        let ltr = values(|run| run.ltr_abs_max);
        if let (Some(median), Some(worst)) = (median(&ltr), ltr.iter().copied().reduce(f64::max)) {
            let _ = write!(words, "; max |LTR| {median:.3} (worst {worst:.3})");
        }
        let lowest = values(|run| run.speed_min_kmh);
        if let (Some(mean), Some(lowest)) = (
            median(&values(|run| run.speed_mean_kmh)),
            lowest.into_iter().reduce(f64::min),
        ) {
            let _ = write!(words, "; mean speed {mean:.1} km/h (lowest {lowest:.1})");
        }
        let off = values(|run| run.path_deviation_max_m);
        if let Some(worst) = off.into_iter().reduce(f64::max) {
            let _ = write!(words, "; at most {worst:.1} m off the path");
        }
        let costs: Vec<f64> = self.runs().filter_map(|run| run.cost).collect();
        if let Some(cost) = median(&costs) {
            let _ = write!(words, "; cost {cost:.3e}");
        }
        words
    }
}

/// Completed, and never with |LTR| above the paper's limit.
pub(super) fn safe(run: &Summary) -> bool {
    completed(run) && run.ltr_violation_s <= 0.0
}

pub(super) fn completed(run: &Summary) -> bool {
    run.outcome == Outcome::Completed
}

pub(super) fn rolled_over(run: &Summary) -> bool {
    run.outcome == Outcome::RolledOver
}

pub(super) fn rolled_over_in_the_last_turn(run: &Summary) -> bool {
    rolled_over(run) && run.course.turns > 0 && run.course.end_turn == run.course.turns
}
