//! Two vehicles at one moment, from behind and from above, as SVG text.

use std::fmt::Write as _;

use super::chart::FONT;
use super::data::{Point, Run, Scene, VehicleShape};
use super::log::TIME;
use super::paper_figures::Shown;
use crate::summary::LTR_LIFT_OFF;

const WIDTH: f64 = 560.0;
const BEHIND: f64 = 210.0;
const ABOVE: f64 = 290.0;
const WHEEL_RADIUS_M: f64 = 0.32;
const WHEEL_WIDTH_M: f64 = 0.2;
/// What the body is longer than the wheelbase at each end, m.
const OVERHANG_M: f64 = 0.85;
/// Height about which the body leans on its springs, m.
const ROLL_AXIS_M: f64 = 0.12;
/// A wheel that carries less is in the air, N.
const LIFTED_N: f64 = 1.0;
/// Seconds of the way behind a vehicle that are drawn.
const TRAIL_S: f64 = 3.0;
const INK: &str = "#2d3136";
const SOFT: &str = "#787d83";
const WARN: &str = "#b3400a";

/// The state of a vehicle.
struct State {
    x_m: f64,
    y_m: f64,
    yaw_deg: f64,
    roll_rad: f64,
    /// Of the axles.
    tilt_rad: f64,
    steering_wheel_deg: f64,
    ltr: f64,
    speed_kmh: f64,
    /// Front left, front right, rear left, rear right.
    lifted: [bool; 4],
}

/// Draws two vehicles when the second first violates the limit on LTR, or has its largest |LTR|.
/// `None` where the logs do not hold the motion.
pub(super) fn snapshot(scene: &Scene, deepc: &Shown<'_>, lmpc: &Shown<'_>) -> Option<String> {
    let shape = scene.vehicle.clone().unwrap_or_else(VehicleShape::typical);
    let (time_s, violates) = moment(lmpc.run)?;
    let both = [deepc, lmpc];
    let states = [
        State::at(deepc.run, time_s, &shape)?,
        State::at(lmpc.run, time_s, &shape)?,
    ];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{0}\" viewBox=\"0 0 {WIDTH} {0}\" font-family=\"{FONT}\" font-size=\"15\" fill=\"{INK}\">\n<rect width=\"{WIDTH}\" height=\"{0}\" fill=\"#fff\"/>\n",
        BEHIND + ABOVE + 34.0
    );
    let what = if violates {
        "first violates the limit on LTR"
    } else {
        "has its largest |LTR|"
    };
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"22\" text-anchor=\"middle\">t = {time_s:.2} s: {} {what}</text>",
        0.5 * WIDTH,
        lmpc.name
    );
    for (index, (one, state)) in both.iter().zip(&states).enumerate() {
        let middle = WIDTH * (0.25 + 0.5 * index as f64);
        behind(&mut svg, one, state, &shape, middle);
    }
    above(&mut svg, scene, both, &states, &shape, time_s);
    svg.push_str("</svg>\n");
    Some(svg)
}

/// The moment that the paper shows, and whether the limit is violated then.
fn moment(run: &Run) -> Option<(f64, bool)> {
    let (time, ltr) = (run.columns.get(TIME)?, run.columns.get("ltr")?);
    let samples = || time.iter().zip(ltr).filter(|(_, ltr)| ltr.is_finite());
    let first = samples().find(|(_, ltr)| ltr.abs() > LTR_LIFT_OFF);
    let largest = || samples().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (time, _) = first.or_else(largest)?;
    Some((*time, first.is_some()))
}

impl State {
    fn at(run: &Run, time_s: f64, shape: &VehicleShape) -> Option<Self> {
        let time = run.columns.get(TIME)?;
        // After its end a vehicle stays where it was.
        let row = time
            .partition_point(|t| *t < time_s - 1e-9)
            .min(time.len().checked_sub(1)?);
        let value = |name: &str| run.columns.get(name).map(|column| column[row]);
        let known = |name: &str| value(name).filter(|v| v.is_finite());
        let roll_rad = known("roll_deg")?.to_radians();
        let clearance = known("two_wheel_clearance_m").unwrap_or(0.0).max(0.0);
        let tilt = (clearance / shape.track_m).min(1.0).asin();
        Some(Self {
            x_m: known("x_m")?,
            y_m: known("y_m")?,
            yaw_deg: known("yaw_deg")?,
            roll_rad,
            // Springs at full droop lower the wheels: the axles never lean more than the body.
            tilt_rad: roll_rad.signum() * tilt.min(roll_rad.abs()),
            steering_wheel_deg: known("steering_wheel_deg").unwrap_or(0.0),
            ltr: known("ltr")?,
            speed_kmh: known("speed_kmh")?,
            lifted: super::plots::WHEEL_LOADS.map(|name| known(name).is_some_and(|n| n < LIFTED_N)),
        })
    }
}

fn css([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// One vehicle from behind over its name and numbers.
fn behind(svg: &mut String, one: &Shown<'_>, state: &State, shape: &VehicleShape, middle: f64) {
    let (colour, scale, ground) = (css(one.rgb()), 76.0, 168.0);
    let (half, track) = (0.5 * shape.width_m, 0.5 * shape.track_m);
    let outer = if state.roll_rad < 0.0 { -track } else { track };
    let deg = |rad: f64| -rad.to_degrees();
    let _ = writeln!(
        svg,
        "<path d=\"M{} {ground}h230\" stroke=\"{SOFT}\" stroke-width=\"1.5\"/>\n<g transform=\"translate({middle} {ground}) scale({scale} -{scale}) translate({outer} 0) rotate({}) translate({} 0)\">",
        middle - 115.0,
        deg(state.tilt_rad),
        -outer
    );
    for (side, rear) in [(-1.0, 2), (1.0, 3)] {
        let fill = if state.lifted[rear] { WARN } else { INK };
        let _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"0\" width=\"{WHEEL_WIDTH_M}\" height=\"{}\" rx=\"0.05\" fill=\"{fill}\"/>",
            side * track - 0.5 * WHEEL_WIDTH_M,
            2.0 * WHEEL_RADIUS_M
        );
    }
    let body = |k: f64| k * half;
    let _ = writeln!(
        svg,
        "<path d=\"M{} {WHEEL_RADIUS_M}H{track}\" stroke=\"{SOFT}\" stroke-width=\"0.06\"/>\n<g transform=\"rotate({} 0 {ROLL_AXIS_M})\">\n<rect x=\"{}\" y=\"0.24\" width=\"{}\" height=\"0.62\" rx=\"0.14\" fill=\"{colour}\"/>\n<path d=\"M{} 0.84L{} 1.36Q0 1.48 {} 1.36L{} 0.84Z\" fill=\"{colour}\"/>\n<path d=\"M{} 0.9L{} 1.28Q0 1.37 {} 1.28L{} 0.9Z\" fill=\"#dfe6ee\"/>",
        -track,
        deg(state.roll_rad - state.tilt_rad),
        -half,
        2.0 * half,
        body(-0.88),
        body(-0.66),
        body(0.66),
        body(0.88),
        body(-0.72),
        body(-0.57),
        body(0.57),
        body(0.72)
    );
    for side in [-1.0, 1.0] {
        let _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"0.6\" width=\"0.26\" height=\"0.12\" rx=\"0.03\" fill=\"#c62828\"/>",
            side * 0.82 * half - 0.13
        );
    }
    let _ = writeln!(
        svg,
        "<circle cy=\"{}\" r=\"0.06\" fill=\"#fff\" stroke=\"#111\" stroke-width=\"0.03\"/>\n</g>\n</g>\n<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\"><tspan font-weight=\"bold\" fill=\"{colour}\">{}</tspan>  LTR {:.2}, roll {:.1}°</text>\n<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{:.1} km/h</text>",
        shape.cg_height_m,
        ground + 22.0,
        one.name,
        state.ltr,
        state.roll_rad.to_degrees(),
        ground + 42.0,
        state.speed_kmh
    );
}

/// The road and both vehicles from above, at one scale.
fn above(
    svg: &mut String,
    scene: &Scene,
    both: [&Shown<'_>; 2],
    states: &[State; 2],
    shape: &VehicleShape,
    time_s: f64,
) {
    let top = BEHIND + 24.0;
    let centre = |f: fn(&State) -> f64| 0.5 * (f(&states[0]) + f(&states[1]));
    let (cx, cy) = (centre(|s| s.x_m), centre(|s| s.y_m));
    let apart = (states[0].x_m - states[1].x_m).hypot(states[0].y_m - states[1].y_m);
    let scale = ABOVE / (apart + 20.0).max(24.0);
    let place = |x: f64, y: f64| {
        let px = 0.5 * WIDTH + (x - cx) * scale;
        (px, top + 0.5 * ABOVE - (y - cy) * scale)
    };
    let path = |points: &mut dyn Iterator<Item = Point>| {
        let mut d = String::new();
        for [x, y] in points {
            let (px, py) = place(x, y);
            let _ = write!(d, "{}{px:.1} {py:.1}", if d.is_empty() { 'M' } else { 'L' });
        }
        d
    };
    // Far points would only make the file larger.
    let reach = 0.6 * WIDTH / scale + 20.0;
    let near = |p: &Point| (p[0] - cx).hypot(p[1] - cy) < reach;
    let _ = writeln!(
        svg,
        "<clipPath id=\"view\"><rect x=\"8\" y=\"{top}\" width=\"{}\" height=\"{ABOVE}\"/></clipPath>\n<g clip-path=\"url(#view)\">",
        WIDTH - 16.0
    );
    if let Some(road) = &scene.road {
        let left = road.left.iter().copied().filter(near);
        let right = road.right.iter().copied().filter(near).rev();
        let _ = writeln!(
            svg,
            "<path d=\"{}Z\" fill=\"#eceef1\"/>",
            path(&mut left.chain(right))
        );
        for edge in [&road.left, &road.right] {
            let d = path(&mut edge.iter().copied().filter(near));
            let _ = writeln!(svg, "<path d=\"{d}\" fill=\"none\" stroke=\"{SOFT}\"/>");
        }
    }
    for (one, state) in both.iter().zip(states).rev() {
        let colour = css(one.rgb());
        let trail = path(&mut trail(one.run, time_s).into_iter());
        let (px, py) = place(state.x_m, state.y_m);
        let front = shape.cg_to_front_axle_m;
        let rear = shape.wheelbase_m - front;
        let _ = writeln!(
            svg,
            "<path d=\"{trail}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>\n<g transform=\"translate({px:.1} {py:.1}) scale({scale:.3} -{scale:.3}) rotate({:.2})\">",
            state.yaw_deg
        );
        for (wheel, (along, side)) in [(front, 1.0), (front, -1.0), (-rear, 1.0), (-rear, -1.0)]
            .into_iter()
            .enumerate()
        {
            let fill = if state.lifted[wheel] { WARN } else { INK };
            let steered = if wheel < 2 {
                state.steering_wheel_deg / shape.steering_ratio
            } else {
                0.0
            };
            let _ = writeln!(
                svg,
                "<rect x=\"-{WHEEL_RADIUS_M}\" y=\"-0.1\" width=\"{}\" height=\"{WHEEL_WIDTH_M}\" fill=\"{fill}\" transform=\"translate({along} {}) rotate({steered:.2})\"/>",
                2.0 * WHEEL_RADIUS_M,
                side * 0.5 * shape.track_m
            );
        }
        let width = 0.88 * shape.width_m;
        let glass = 0.58 * shape.width_m;
        let _ = writeln!(
            svg,
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{width}\" rx=\"0.4\" fill=\"{colour}\" fill-opacity=\"0.9\"/>\n<rect x=\"{}\" y=\"{}\" width=\"0.55\" height=\"{glass}\" rx=\"0.1\" fill=\"#dfe6ee\"/>\n<rect x=\"{}\" y=\"{}\" width=\"0.32\" height=\"{glass}\" rx=\"0.1\" fill=\"#dfe6ee\"/>\n</g>",
            -(rear + OVERHANG_M),
            -0.5 * width,
            shape.wheelbase_m + 2.0 * OVERHANG_M,
            front - 1.0,
            -0.5 * glass,
            0.75 - rear - OVERHANG_M,
            -0.5 * glass
        );
    }
    // The outline of the second is on top: where both are at one place, both are seen.
    let [_, state] = states;
    let (px, py) = place(state.x_m, state.y_m);
    let (length, width) = (shape.wheelbase_m + 2.0 * OVERHANG_M, 0.88 * shape.width_m);
    let _ = writeln!(
        svg,
        "<rect x=\"{}\" y=\"{}\" width=\"{length}\" height=\"{width}\" rx=\"0.4\" fill=\"none\" stroke=\"{}\" stroke-width=\"0.2\" transform=\"translate({px:.1} {py:.1}) scale({scale:.3} -{scale:.3}) rotate({:.2})\"/>",
        shape.cg_to_front_axle_m - shape.wheelbase_m - OVERHANG_M,
        -0.5 * width,
        css(both[1].rgb()),
        state.yaw_deg
    );
    let _ = writeln!(
        svg,
        "</g>\n<rect x=\"8\" y=\"{top}\" width=\"{}\" height=\"{ABOVE}\" fill=\"none\" stroke=\"#c9ced4\"/>\n<path d=\"M{} {}v5h{}v-5\" fill=\"none\" stroke=\"{SOFT}\" stroke-width=\"1.5\"/>\n<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">5 m</text>",
        WIDTH - 16.0,
        WIDTH - 24.0 - 5.0 * scale,
        top + ABOVE - 18.0,
        5.0 * scale,
        WIDTH - 24.0 - 2.5 * scale,
        top + ABOVE - 22.0
    );
}

/// Where a vehicle came from.
fn trail(run: &Run, time_s: f64) -> Vec<Point> {
    let column = |name| run.columns.get(name).map_or(&[][..], Vec::as_slice);
    let places = column("x_m").iter().zip(column("y_m"));
    let recent = column(TIME).iter().zip(places).filter(|(t, (x, y))| {
        (time_s - TRAIL_S..=time_s).contains(*t) && x.is_finite() && y.is_finite()
    });
    recent.map(|(_, (x, y))| [*x, *y]).collect()
}
