//! What a campaign's folder comes to: `paper.json`, the report, and the words in the terminal.

use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

use super::execute::Made;
use crate::output::{print_line, table_text, write_json};
use crate::report::data::{Claim, Report, Settings, Verdict};
use crate::report::{self, Campaign, Failure, REPORT_FILE, Written};
use crate::summary::Summary;
use crate::timing::{Agreement, TimingRow};

/// The results for programs.
pub(super) const RESULTS_FILE: &str = "paper.json";

/// `paper.json`. Times apart (`step_time_us` of the runs, all of `timing`), it is the same for the same
/// command.
#[derive(Serialize)]
pub(super) struct Json<'a> {
    version: &'a str,
    command: &'a str,
    seeds: &'a [u64],
    /// Every run's numbers.
    runs: &'a [Summary],
    /// Runs that could not be made.
    failures: &'a [Failure],
    claims: Vec<JsonClaim<'a>>,
    timing: &'a [TimingRow],
    /// Whether `DeePC` and RD-DeePC decide alike.
    deepc_equals_rd_deepc: Option<&'a Agreement>,
}

#[derive(Serialize)]
struct JsonClaim<'a> {
    id: &'a str,
    /// The experiment.
    group: &'a str,
    /// Whose settings were judged, where that makes a difference.
    settings: Option<Settings>,
    claim: &'a str,
    paper: &'a str,
    ours: &'a str,
    seeds: &'a [u64],
    /// Judged runs or pairs of runs.
    judged: usize,
    fraction: Option<f64>,
    verdict: Verdict,
    reason: Option<&'a str>,
}

/// The results of a campaign.
pub(super) struct Results {
    campaign: Campaign,
    report: Report,
}

impl Results {
    /// Reads the folder of a campaign.
    ///
    /// # Errors
    /// When it is none, or what was just written there cannot be read.
    pub(super) fn read(out: &Path) -> Result<Self> {
        let mut problems = Vec::new();
        let campaign = Campaign::read(out, &mut problems);
        if let Some(problem) = problems.first() {
            anyhow::bail!("{problem}");
        }
        let campaign = campaign.with_context(|| format!("{} holds no campaign", out.display()))?;
        let report = report::collect(&[out.to_path_buf()], &report::log::Renamed::new());
        Ok(Self { campaign, report })
    }

    pub(super) fn json(&self) -> Json<'_> {
        let timing = self.campaign.timing.as_ref();
        Json {
            version: &self.campaign.file.version,
            command: &self.campaign.file.command,
            seeds: &self.campaign.file.seeds,
            runs: &self.campaign.summaries,
            failures: &self.campaign.failures,
            claims: self.report.claims.iter().map(JsonClaim::of).collect(),
            timing: timing.map_or(&[], |table| &table.rows),
            deepc_equals_rd_deepc: timing.map(|table| &table.deepc_equals_rd_deepc),
        }
    }

    /// Writes `paper.json`, then the report.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub(super) fn write(&self, out: &Path) -> Result<Written> {
        write_json(&out.join(RESULTS_FILE), &self.json())?;
        report::write(&self.report, &out.join(REPORT_FILE))
    }

    /// Prints the verdicts and where everything is.
    ///
    /// # Errors
    /// When standard output cannot be written.
    pub(super) fn print(&self, out: &Path, made: Made) -> Result<()> {
        let row = |claim: &Claim| {
            let fraction = claim.fraction;
            vec![
                claim.id.clone(),
                claim.verdict.to_string(),
                fraction.map_or_else(|| "–".into(), |f| format!("{:.0} %", 100.0 * f)),
                claim.claim.clone(),
            ]
        };
        let rows: Vec<Vec<String>> = self.report.claims.iter().map(row).collect();
        print_line(&table_text(
            &["claim", "verdict", "holds in", ""],
            &rows,
            &[2],
        ))?;
        if let Some(table) = &self.campaign.timing {
            print_line(&format!("\n{table}"))?;
        }
        print_line(&format!(
            "\n{} runs made, {} were there already; of all, {} have no controller\nreport: {}\nresults for programs: {}",
            made.now,
            made.before,
            self.campaign.failures.len(),
            out.join(REPORT_FILE).display(),
            out.join(RESULTS_FILE).display()
        ))
    }
}

impl<'a> JsonClaim<'a> {
    fn of(claim: &'a Claim) -> Self {
        Self {
            id: &claim.id,
            group: &claim.group,
            settings: claim.settings,
            claim: &claim.claim,
            paper: &claim.paper,
            ours: &claim.ours,
            seeds: &claim.seeds,
            judged: claim.judged,
            fraction: claim.fraction,
            verdict: claim.verdict,
            reason: claim.reason.as_ref().map(|reason| reason.text.as_str()),
        }
    }
}
