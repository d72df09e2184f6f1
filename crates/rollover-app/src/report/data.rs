//! What a report shows, as plain data: the contract between those who make runs and the page.
//!
//! Everything that a source may not know is optional and simply absent from the page. A missing
//! sample is a gap: not a number here, `null` in JSON, never a zero.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use vehicle_dyn::metrics::Outcome;

/// A whole report.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// Heading.
    pub title: String,
    /// What was asked, a paragraph each.
    pub asked: Vec<String>,
    /// What a paper claims, and what came out.
    pub claims: Vec<Claim>,
    /// Costs and times beside the paper's.
    pub timing: Vec<TimingRow>,
    /// What was driven.
    pub scenes: Vec<Scene>,
    /// Runs of which the numbers are known, but no log was kept.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unlogged: Vec<UnloggedRun>,
    /// Outcomes over the recording seeds.
    pub seeds: Vec<SeedRow>,
    /// Files that could not be read, or not wholly.
    pub problems: Vec<Problem>,
    /// Remarks, a paragraph each.
    pub notes: Vec<String>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// A claim and its outcome.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// Short name, unique in the report; that of a claim with [`Settings::Paper`] ends in `-paper`, and
    /// is else the one it has with the recommended settings.
    pub id: String,
    /// The experiment that it belongs to; a heading in the table of claims.
    pub group: String,
    /// Whose settings were judged, where that makes a difference.
    pub settings: Option<Settings>,
    /// The claim in a sentence.
    pub claim: String,
    /// What the paper shows for it.
    pub paper: String,
    /// What came out here.
    pub ours: String,
    /// Recording seeds that judged it.
    pub seeds: Vec<u64>,
    /// Number of judged runs, or of pairs of runs.
    pub judged: usize,
    /// Fraction of the judged runs in which it holds, 0 to 1.
    pub fraction: Option<f64>,
    /// The verdict, computed by the rule that [`Verdict`] states.
    pub verdict: Verdict,
    /// Why it came out so.
    pub reason: Option<Reason>,
}

/// Whose settings the controllers have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Settings {
    /// Ours.
    Recommended,
    /// The paper's, as far as it gives them.
    Paper,
}

impl std::fmt::Display for Settings {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Recommended => "recommended",
            Self::Paper => "paper",
        })
    }
}

/// Why a claim came out as it did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reason {
    /// The reason in a sentence or two.
    pub text: String,
    /// The run that isolates it.
    pub run: Option<RunLink>,
}

/// A run of the report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunLink {
    /// [`Scene::name`].
    pub scene: String,
    /// [`Run::label`].
    pub label: String,
}

/// How far a claim is reproduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// It holds in at least 80 % of the judged runs.
    #[serde(rename = "reproduced")]
    Reproduced,
    /// It holds in at least 20 % and less than 80 %.
    #[serde(rename = "partly")]
    Partly,
    /// It holds in less than 20 %.
    #[serde(rename = "not reproduced")]
    NotReproduced,
}

impl Verdict {
    /// The verdict for a claim that holds in `fraction` of the judged runs.
    #[must_use]
    pub fn of_fraction(fraction: f64) -> Self {
        if fraction >= 0.8 {
            Self::Reproduced
        } else if fraction >= 0.2 {
            Self::Partly
        } else {
            Self::NotReproduced
        }
    }
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Reproduced => "reproduced",
            Self::Partly => "partly",
            Self::NotReproduced => "not reproduced",
        })
    }
}

/// Cost and time of one method.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TimingRow {
    /// The method.
    pub method: String,
    /// Size of what it solves, for example `600×3001`.
    pub size: String,
    /// The paper's cost.
    pub paper_cost: Option<f64>,
    /// The paper's time of a step, s.
    pub paper_time_s: Option<f64>,
    /// Cost here.
    pub cost: Option<f64>,
    /// Time of a step here, s.
    pub time_s: Option<f64>,
    /// Time over that of RD-DeePC as written, in the same run.
    pub ratio: Option<f64>,
    /// How it was measured.
    pub note: String,
}

/// Outcomes of one controller over the recording seeds.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SeedRow {
    /// [`Scene::title`].
    pub scene: String,
    /// The controller.
    pub controller: String,
    /// The course: `as it is` or `mirrored`.
    pub course: String,
    /// Runs counted.
    pub runs: usize,
    /// Fraction of the runs with a known outcome that were completed, 0 to 1.
    pub completed_fraction: Option<f64>,
    /// Fraction of them that were completed with |LTR| never above 1, 0 to 1.
    pub safe_fraction: Option<f64>,
    /// Median of the largest |LTR|.
    pub ltr_abs_median: Option<f64>,
    /// Worst of the largest |LTR|.
    pub ltr_abs_worst: Option<f64>,
    /// Median of the mean speed, km/h.
    pub speed_mean_median_kmh: Option<f64>,
    /// Lowest speed of any run, km/h.
    pub speed_min_worst_kmh: Option<f64>,
    /// Worst distance from the path, m.
    pub path_deviation_worst_m: Option<f64>,
    /// Median cost.
    pub cost_median: Option<f64>,
}

/// What is wrong with a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// The file.
    pub file: String,
    /// Its line, from 1 (the header).
    pub line: Option<u64>,
    /// What is wrong, and what became of the rest.
    pub reason: String,
}

impl std::fmt::Display for Problem {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(formatter, "{}, line {line}: {}", self.file, self.reason),
            None => write!(formatter, "{}: {}", self.file, self.reason),
        }
    }
}

/// Where the numbers of a report come from.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of this program.
    pub version: String,
    /// The command that made the report.
    pub command: String,
    /// Recording seeds of its runs.
    pub seeds: Vec<u64>,
    /// Where it ran, for example `linux x86_64, 2 cores`.
    pub machine: String,
}

/// One vehicle on one road, driven by one or several controllers.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Scene {
    /// Short name; figures begin with it.
    pub name: String,
    /// Heading.
    pub title: String,
    /// What it shows.
    pub description: String,
    /// The road, where it is known.
    pub road: Option<Road>,
    /// The ground from above, where it is not flat.
    pub terrain: Option<TerrainMap>,
    /// The ground along the road, where it is not flat.
    pub profile: Option<HeightProfile>,
    /// The vehicle, where it is known.
    pub vehicle: Option<VehicleShape>,
    /// Limits drawn into the plots.
    pub limits: Limits,
    /// The runs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub runs: Vec<Run>,
}

/// A point on the ground: x and y, m.
pub type Point = [f64; 2];

/// A road from above.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Road {
    /// Centre line.
    pub centre: Vec<Point>,
    /// Left edge.
    pub left: Vec<Point>,
    /// Right edge.
    pub right: Vec<Point>,
    /// Width, m.
    pub width_m: f64,
}

/// Heights of the ground on a square grid.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TerrainMap {
    /// x of the first column, m.
    pub x_min_m: f64,
    /// y of the first row, m.
    pub y_min_m: f64,
    /// Distance between rows and between columns, m.
    pub spacing_m: f64,
    /// Points along x.
    pub columns: usize,
    /// Points along y.
    pub rows: usize,
    /// Heights, m, row by row.
    #[serde(with = "gaps")]
    pub heights_m: Vec<f64>,
}

/// Heights of the ground along the road.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct HeightProfile {
    /// Distance along the centre line, m.
    pub station_m: Vec<f64>,
    /// Height under the left wheels, m.
    pub left_m: Vec<f64>,
    /// Height under the right wheels, m.
    pub right_m: Vec<f64>,
}

/// The vehicle as the replay draws it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct VehicleShape {
    /// Its name.
    pub name: String,
    /// Mean track, m.
    pub track_m: f64,
    /// Distance between the axles, m.
    pub wheelbase_m: f64,
    /// From the centre of gravity to the front axle, m.
    pub cg_to_front_axle_m: f64,
    /// Height of the centre of gravity, m.
    pub cg_height_m: f64,
    /// Width over all, m.
    pub width_m: f64,
    /// Steering-wheel angle over road-wheel angle.
    pub steering_ratio: f64,
    /// Whether these are typical values, because the source does not say.
    #[serde(default)]
    pub assumed: bool,
}

impl VehicleShape {
    /// A typical car, for logs that do not say what was driven.
    #[must_use]
    pub fn typical() -> Self {
        Self {
            name: "a typical car".into(),
            track_m: 1.55,
            wheelbase_m: 2.7,
            cg_to_front_axle_m: 1.25,
            cg_height_m: 0.55,
            width_m: 1.8,
            steering_ratio: 16.0,
            assumed: true,
        }
    }
}

/// Limits drawn into the plots.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Limits {
    /// Largest |LTR| allowed.
    pub ltr: Option<f64>,
    /// Lowest and highest target speed, km/h.
    pub target_speed_kmh: Option<[f64; 2]>,
    /// Lowest and highest steering-wheel angle, deg.
    pub steering_wheel_deg: Option<[f64; 2]>,
}

/// What kind of controller drove; it fixes the colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The driver alone.
    Driver,
    /// Predictive control from data.
    Deepc,
    /// Linear predictive control on a model.
    Lmpc,
    /// The driver held at the lowest target speed.
    Floor,
    /// Anything else, for example a real vehicle.
    #[default]
    Other,
}

/// One run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Run {
    /// Name of the controller.
    pub controller: String,
    /// Name in legends, unique in the scene.
    pub label: String,
    /// What is special about it.
    #[serde(default)]
    pub description: String,
    /// What kind of controller it is.
    #[serde(default)]
    pub role: Role,
    /// Recording seed, if it worked from a recording made from one.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Whether the course was mirrored.
    #[serde(default)]
    pub mirrored: bool,
    /// The controller's own limit on |LTR|.
    #[serde(default)]
    pub ltr_limit: Option<f64>,
    /// How it ended, where that can be told.
    #[serde(default)]
    pub outcome: Option<Outcome>,
    /// Its numbers.
    #[serde(default)]
    pub figures: RunFigures,
    /// Where its log is.
    #[serde(default)]
    pub source: String,
    /// Columns of the log by name; each as long as `time_s`, a gap is not a number.
    #[serde(
        default,
        with = "gap_columns",
        skip_serializing_if = "BTreeMap::is_empty"
    )]
    pub columns: Columns,
}

/// A run without a log.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct UnloggedRun {
    /// [`Scene::name`].
    pub scene: String,
    /// The run, without columns.
    pub run: Run,
    /// Why it could not be made, if so.
    pub failure: Option<String>,
}

/// Columns of a log by name.
pub type Columns = BTreeMap<String, Vec<f64>>;

/// The numbers of a run that its log tells.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct RunFigures {
    /// Rows of the log.
    pub steps: usize,
    /// Time of the last row, s.
    pub end_time_s: Option<f64>,
    /// Largest |LTR|.
    pub ltr_abs_max: Option<f64>,
    /// Time with |LTR| above 1, s.
    pub ltr_violation_s: Option<f64>,
    /// Largest |roll angle|, deg.
    pub roll_abs_max_deg: Option<f64>,
    /// Lowest speed, km/h.
    pub speed_min_kmh: Option<f64>,
    /// Mean speed, km/h.
    pub speed_mean_kmh: Option<f64>,
    /// Largest distance from the path, m.
    pub path_deviation_max_m: Option<f64>,
    /// Largest change of the driver's steering-wheel angle, deg.
    pub steering_correction_max_deg: Option<f64>,
    /// Stage costs of the inputs summed over the run (deg² and km²/h²), where the weights are known.
    pub cost: Option<f64>,
    /// Steps without a plan, in which the controller fell back.
    pub fallback_steps: Option<usize>,
    /// Median wall-clock time of a step, µs.
    pub step_time_median_us: Option<f64>,
    /// Longest wall-clock time of a step, µs.
    pub step_time_max_us: Option<f64>,
}

/// Numbers whose gaps are `null` in JSON.
mod gaps {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let known = |v: &f64| v.is_finite().then_some(*v);
        values.iter().map(known).collect::<Vec<_>>().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let values = Vec::<Option<f64>>::deserialize(from)?;
        Ok(values.into_iter().map(|v| v.unwrap_or(f64::NAN)).collect())
    }
}

/// Columns whose gaps are `null` in JSON.
mod gap_columns {
    use std::collections::BTreeMap;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::Columns;

    #[derive(Serialize, Deserialize)]
    struct Column(#[serde(with = "super::gaps")] Vec<f64>);

    pub(super) fn serialize<S: Serializer>(columns: &Columns, to: S) -> Result<S::Ok, S::Error> {
        let columns = columns.iter();
        let columns = columns.map(|(name, values)| (name, Column(values.clone())));
        columns.collect::<BTreeMap<_, _>>().serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Columns, D::Error> {
        let columns = BTreeMap::<String, Column>::deserialize(from)?;
        Ok(columns.into_iter().map(|(name, c)| (name, c.0)).collect())
    }
}
