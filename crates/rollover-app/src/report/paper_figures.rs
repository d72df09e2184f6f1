//! The paper's figures, each with the controllers that it has there: once with the recommended
//! settings, once (`-paper`) with the paper's.

use anyhow::Result;
use plotters::prelude::{Color, RGBColor};

use super::cast::{CAST, COMPARED, PAPER_SUFFIX, first_of};
use super::chart::{Series, limit_style};
use super::claims::{RIVERBED, SEDAN, TRUCK};
use super::data::{Report, Role, Run, Scene};
use super::figures::{Figure, WHEELS, colour, ended_early, extent, heights, line, series, trace};
use super::panels::{FRAME, Panel, WIDTH, panels};
use super::plots::{Limit, Look, look, looks};
use super::snapshot::snapshot;

/// File names, without extension, of all figures of the paper; `-paper` may follow.
pub const PAPER_FIGURES: [&str; 10] = [
    "fig-comparison",
    "fig-sedan-ltr",
    "fig-sedan-speed",
    "fig-sedan-steering-wheel",
    "fig-truck",
    "fig-riverbed",
    "fig-road",
    "fig-terrain",
    "fig-terrain-profile",
    "fig-snapshot",
];

/// The controllers of the truck's and the riverbed's figures, with their names there.
const PAIR: [(&str, &str); 2] = [("rd-deepc-1", "RD-DeePC"), ("lmpc-1", "LMPC")];
/// Height of a panel that is a figure of its own, and of one of several, px.
const ALONE: u32 = 240;
const AMONG: u32 = 150;

/// Looks and widths of two lines that coincide: the second is seen on the first.
const COINCIDENT: [(Look, u32); 2] = [
    (look([122, 178, 224], [0, 0, 0], [0, 0]), 5),
    (look([20, 40, 90], [0, 0, 0], [6, 5]), 2),
];

/// A quantity over time.
struct Quantity {
    axis: &'static str,
    column: &'static str,
    limit: Limit,
}

const LTR: Quantity = Quantity {
    axis: "LTR",
    column: "ltr",
    limit: Limit::Ltr,
};
const SPEED: Quantity = Quantity {
    axis: "speed / (km/h)",
    column: "speed_kmh",
    limit: Limit::TargetSpeed,
};
const TARGET_SPEED: Quantity = Quantity {
    axis: "target / (km/h)",
    column: "target_speed_kmh",
    limit: Limit::TargetSpeed,
};
const STEERING: Quantity = Quantity {
    axis: "steering wheel / °",
    column: "steering_wheel_deg",
    limit: Limit::SteeringWheel,
};

/// A run with the name and the look it has in a figure.
pub(super) struct Shown<'a> {
    pub(super) run: &'a Run,
    pub(super) name: &'static str,
    look: Look,
    /// Of its line, px.
    width: u32,
}

/// Draws the figures for which the report has the runs.
///
/// # Errors
/// When a figure cannot be drawn.
pub(super) fn paper_figures(report: &Report) -> Result<Vec<Figure>> {
    let scene = |name: &str| report.scenes.iter().find(|scene| scene.name == name);
    let mut all = Vec::new();
    if let Some(scene) = scene(SEDAN) {
        let mut compared = cast(scene, &COMPARED, "");
        for (one, (look, width)) in compared.iter_mut().zip(COINCIDENT) {
            (one.look, one.width) = (look, width);
        }
        if compared.len() == COMPARED.len() {
            all.extend(over_time(
                "fig-comparison",
                scene,
                &compared,
                &[STEERING, TARGET_SPEED, LTR],
            )?);
        }
        for suffix in ["", PAPER_SUFFIX] {
            let shown = cast(scene, &CAST, suffix);
            if !is_judged(&shown) {
                continue;
            }
            for (name, quantity) in [
                ("fig-sedan-ltr", LTR),
                ("fig-sedan-speed", SPEED),
                ("fig-sedan-steering-wheel", STEERING),
            ] {
                all.extend(over_time(
                    &format!("{name}{suffix}"),
                    scene,
                    &shown,
                    &[quantity],
                )?);
            }
            let pair: [Option<&Shown<'_>>; 2] =
                PAIR.map(|(name, _)| shown.iter().find(|s| is(s.run, name, suffix)));
            if let [Some(deepc), Some(lmpc)] = pair {
                all.extend(snapshot(scene, deepc, lmpc).map(|svg| Figure {
                    name: format!("fig-snapshot{suffix}"),
                    caption: "From behind and above at the moment when LMPC1 (green) first violates the limit on LTR, or has its largest |LTR|; blue: RD-DeePC1.".into(),
                    svg,
                    of_the_paper: true,
                }));
            }
        }
        // A single run is no reproduction of the paper.
        if !all.is_empty() {
            all.extend(road(scene)?);
        }
    }
    for (name, figure) in [(TRUCK, "fig-truck"), (RIVERBED, "fig-riverbed")] {
        let Some(scene) = scene(name) else {
            continue;
        };
        for suffix in ["", PAPER_SUFFIX] {
            let shown = cast(scene, &PAIR, suffix);
            if is_judged(&shown) {
                let name = format!("{figure}{suffix}");
                all.extend(over_time(&name, scene, &shown, &[LTR, SPEED, STEERING])?);
            }
        }
    }
    if let Some(scene) = scene(RIVERBED) {
        all.extend(terrain(scene)?);
    }
    Ok(all)
}

fn is(run: &Run, controller: &str, suffix: &str) -> bool {
    run.controller.strip_suffix(suffix) == Some(controller)
}

/// Whether there is something to compare.
fn is_judged(shown: &[Shown<'_>]) -> bool {
    shown.len() > 1 && shown.iter().any(|one| one.run.role == Role::Deepc)
}

/// The runs of some controllers with the settings that a suffix tells. The driver has none.
fn cast<'a>(
    scene: &'a Scene,
    controllers: &[(&'static str, &'static str)],
    suffix: &str,
) -> Vec<Shown<'a>> {
    let looks = looks(&scene.runs);
    let find = |(controller, name): &(&'static str, &'static str)| {
        let driver = first_of(&scene.runs, controller)
            .filter(|&place| scene.runs[place].role == Role::Driver);
        let place = driver.or_else(|| first_of(&scene.runs, &format!("{controller}{suffix}")))?;
        Some((place, *name))
    };
    let found: Vec<(usize, &'static str)> = controllers.iter().filter_map(find).collect();
    // The same colours with both settings.
    let plain = |controller: &str| first_of(&scene.runs, controller.strip_suffix(suffix)?);
    let shown = found.into_iter().map(|(place, name)| {
        let run = &scene.runs[place];
        Shown {
            run,
            name,
            look: looks[plain(&run.controller).unwrap_or(place)],
            width: 2,
        }
    });
    shown.collect()
}

fn over_time(
    name: &str,
    scene: &Scene,
    shown: &[Shown<'_>],
    quantities: &[Quantity],
) -> Result<Option<Figure>> {
    let mut drawn = Vec::new();
    for quantity in quantities {
        let lines: Vec<Series<'_>> = shown
            .iter()
            .filter_map(|one| one.series(quantity))
            .collect();
        if !lines.is_empty() {
            drawn.push((quantity, lines));
        }
    }
    let x = drawn.iter().map(|(_, lines)| extent(lines, |p| p.0));
    let Some(x) = x.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else {
        return Ok(None);
    };
    let alone = drawn.len() == 1;
    let height = if alone { ALONE } else { AMONG };
    let panel = |(quantity, mut lines): (&Quantity, Vec<Series<'static>>)| {
        let (mut low, mut high) = extent(&lines, |p| p.1);
        let reach = 0.6 * (high - low).max(1e-3);
        let limits = quantity.limit.values(scene).into_iter();
        // Limits far outside would flatten what there is to see.
        let near = |v: &f64| (low - reach..=high + reach).contains(v);
        let limits: Vec<f64> = limits.filter(near).collect();
        for value in limits {
            (low, high) = (low.min(value), high.max(value));
            lines.insert(
                0,
                series("", limit_style(), vec![(x.0, value), (x.1, value)]),
            );
        }
        let margin = 0.06 * (high - low).max(1e-3);
        Panel {
            y_label: quantity.axis.into(),
            y: (low - margin, high + margin),
            series: lines,
            fields: Vec::new(),
            height,
        }
    };
    let all: Vec<Panel<'_>> = drawn.into_iter().map(panel).collect();
    Ok(Some(Figure {
        name: name.into(),
        caption: "Grey lines: limits. A cross marks a run that ended in a rollover or a spin."
            .into(),
        svg: panels((x.0, x.1.max(x.0 + 1e-3)), "time / s", &all)?,
        of_the_paper: true,
    }))
}

impl Shown<'_> {
    fn series(&self, quantity: &Quantity) -> Option<Series<'static>> {
        Some(Series {
            cross: ended_early(self.run),
            dash: self.look.dash,
            ..series(
                self.name,
                colour(self.look).stroke_width(self.width),
                trace(self.run, quantity.column)?,
            )
        })
    }

    /// Red, green, blue on white.
    pub(super) fn rgb(&self) -> [u8; 3] {
        self.look.light
    }
}

/// Edges of the road at one scale in both directions, over fields of the ground's height.
fn from_above<'a>(scene: &Scene) -> Option<((f64, f64), Panel<'a>)> {
    let road = scene.road.as_ref()?;
    let lines: Vec<Series<'a>> = [&road.left, &road.right]
        .map(|edge| series("", limit_style(), line(edge)))
        .into();
    if lines.iter().all(|l| l.points.is_empty()) {
        return None;
    }
    let margin = 15.0;
    let (x, y) = (extent(&lines, |p| p.0), extent(&lines, |p| p.1));
    let (x, y) = ((x.0 - margin, x.1 + margin), (y.0 - margin, y.1 + margin));
    let pixels_per_m = f64::from(WIDTH - FRAME.0) / (x.1 - x.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped"
    )]
    let height = (pixels_per_m * (y.1 - y.0)).clamp(80.0, 900.0) as u32;
    let panel = Panel {
        y_label: "y / m".into(),
        y,
        series: lines,
        fields: scene
            .terrain
            .as_ref()
            .map_or_else(Vec::new, |map| heights(map, x, y)),
        height,
    };
    Some((x, panel))
}

fn road(scene: &Scene) -> Result<Option<Figure>> {
    let Some((x, panel)) = from_above(scene) else {
        return Ok(None);
    };
    Ok(Some(Figure {
        name: "fig-road".into(),
        caption: "The road's edges from above; the drive begins at the origin.".into(),
        svg: panels(x, "x / m", &[panel])?,
        of_the_paper: true,
    }))
}

/// The ground from above, and along the road.
fn terrain(scene: &Scene) -> Result<Vec<Figure>> {
    let mut all = Vec::new();
    let map = scene.terrain.as_ref().and_then(|_| from_above(scene));
    if let Some((x, panel)) = map {
        all.push(Figure {
            name: "fig-terrain".into(),
            caption: "Heights of the ground around the road, dark where low.".into(),
            svg: panels(x, "x / m", &[panel])?,
            of_the_paper: true,
        });
    }
    if let Some(profile) = &scene.profile {
        let side = |name: &'static str, colour: RGBColor, heights: &[f64]| {
            let heights = heights.iter().map(|h| h * 1e3);
            let points = profile.station_m.iter().copied().zip(heights).collect();
            series(name, colour.stroke_width(1), points)
        };
        let lines = vec![
            side("left wheels", WHEELS[0].1, &profile.left_m),
            side("right wheels", WHEELS[1].1, &profile.right_m),
        ];
        let (x, y) = (extent(&lines, |p| p.0), extent(&lines, |p| p.1));
        let margin = 0.06 * (y.1 - y.0).max(1.0);
        let panel = Panel {
            y_label: "height / mm".into(),
            y: (y.0 - margin, y.1 + margin),
            series: lines,
            fields: Vec::new(),
            height: AMONG,
        };
        all.push(Figure {
            name: "fig-terrain-profile".into(),
            caption: "Heights of the ground under the wheels along the road's centre line.".into(),
            svg: panels(x, "distance along the road / m", &[panel])?,
            of_the_paper: true,
        });
    }
    Ok(all)
}
