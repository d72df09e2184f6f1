//! Which runs of a scene are looked at together: the paper's comparisons among all that was driven.

use serde::Serialize;

use super::data::{Role, Run};

/// The controllers of the paper's figures, in the order of legends, with their names there.
pub(super) const CAST: [(&str, &str); 5] = [
    ("driver", "driver"),
    ("rd-deepc-1", "RD-DeePC1"),
    ("rd-deepc-2", "RD-DeePC2"),
    ("lmpc-1", "LMPC1"),
    ("lmpc-2", "LMPC2"),
];
/// The whole matrix and the reduced one, with their names in the paper's figure.
pub(super) const COMPARED: [(&str, &str); 2] = [("deepc-1", "DeePC"), ("rd-deepc-1", "RD-DeePC")];
/// What the name of a controller with the paper's settings ends in.
pub(super) const PAPER_SUFFIX: &str = "-paper";
/// Runs of which more would hide one another in a plot.
const MOST_RUNS: usize = 8;

/// Runs to be shown together.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Cast {
    /// What they are, for a button.
    name: &'static str,
    /// Their places in the scene.
    runs: Vec<usize>,
}

/// The first run of a controller: on the course as it is, if it was driven so.
pub(super) fn first_of(runs: &[Run], controller: &str) -> Option<usize> {
    let of_it = runs
        .iter()
        .enumerate()
        .filter(|(_, run)| run.controller == controller);
    of_it
        .min_by_key(|(_, run)| run.mirrored)
        .map(|(place, _)| place)
}

/// A controller's place in legends: the paper's cast first, what differs from it in settings later.
pub(super) fn rank(controller: &str) -> usize {
    let place = |name| CAST.iter().position(|(cast, _)| *cast == name);
    let with_its_settings = controller.strip_suffix(PAPER_SUFFIX);
    place(controller)
        .or_else(|| Some(CAST.len() + place(with_its_settings?)?))
        .unwrap_or(2 * CAST.len())
}

impl Role {
    /// Place in legends. The driver first: the others are drawn over him.
    pub(super) fn order(self) -> usize {
        match self {
            Self::Driver => 0,
            Self::Floor => 1,
            Self::Deepc => 2,
            Self::Lmpc => 3,
            Self::Other => 4,
        }
    }
}

/// The runs that are drawn at first: the paper's cast, else all, or of many one of each controller.
pub(super) fn drawn_first(runs: &[Run]) -> Vec<bool> {
    if let Some(cast) = casts(runs).first() {
        return (0..runs.len())
            .map(|place| cast.runs.contains(&place))
            .collect();
    }
    let first_of_its_kind = |(index, run): (usize, &Run)| {
        runs.len() <= MOST_RUNS || {
            let before = runs[..index].iter();
            let mut same = before.filter(|r| r.role == run.role && r.controller == run.controller);
            same.next().is_none()
        }
    };
    runs.iter().enumerate().map(first_of_its_kind).collect()
}

/// The comparisons for which a scene has the runs; none where it has nothing to choose from.
pub(super) fn casts(runs: &[Run]) -> Vec<Cast> {
    let cast = |name, controllers: &[(&str, &str)], suffix: &str| {
        let of_cast = controllers.iter().filter_map(|(controller, _)| {
            // The driver has no settings.
            first_of(runs, &format!("{controller}{suffix}")).or_else(|| {
                let place = first_of(runs, controller)?;
                (runs[place].role == Role::Driver).then_some(place)
            })
        });
        Cast {
            name,
            runs: of_cast.collect(),
        }
    };
    let controlled = |cast: &Cast| {
        let of_role = |role| {
            cast.runs
                .iter()
                .filter(|&&run| runs[run].role == role)
                .count()
        };
        of_role(Role::Deepc) > 0 && of_role(Role::Deepc) + of_role(Role::Lmpc) > 1
    };
    let all = [
        cast("Recommended settings", &CAST, ""),
        cast("The paper's settings", &CAST, PAPER_SUFFIX),
        cast("DeePC and RD-DeePC", &COMPARED, ""),
    ];
    let mut casts: Vec<Cast> = all.into_iter().filter(controlled).collect();
    // Where the cast is all there is, there is nothing to choose.
    casts.retain(|cast| cast.runs.len() < runs.len());
    if casts
        .first()
        .is_some_and(|cast| cast.name != "Recommended settings")
    {
        casts.clear();
    }
    casts
}
