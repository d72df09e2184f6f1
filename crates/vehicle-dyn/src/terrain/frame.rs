//! What lies along the course: bank, friction and bumps, in station and offset.
//!
//! A place beside a bend, or between two legs of a hairpin, can be near to several stretches of the
//! course. Each such stretch is a pass. What the passes say is blended by their distance, and each fades
//! out before the middle of its bend, so that no line remains along which the ground would jump.

use super::description::{Bump, GroundDescription};
use super::grid::CORRIDOR_MARGIN_M;
use super::spline::smooth_step;
use crate::road::Course;

/// Spacing of the points from which passes are searched, m.
const SAMPLE_SPACING_M: f64 = 1.0;
/// Level shoulder beside the road that keeps its bank and friction, m.
const SHOULDER_M: f64 = 3.0;
/// Share of a bend's radius at which its inner side ends.
const INNER_SHARE: f64 = 0.9;
/// Share of what is left there that keeps bank and friction.
const FULL_SHARE: f64 = 0.8;
/// Distance below which a pass no longer gains weight over others, m.
const NEAR_M: f64 = 0.05;

/// A range of samples, first and last.
pub(super) type SampleRange = (u32, u32);

#[derive(Debug, Clone, Copy)]
struct Sample {
    station_m: f64,
    x_m: f64,
    y_m: f64,
    sin: f64,
    cos: f64,
    curvature_per_m: f64,
}

/// The course with everything that lies along it.
pub(super) struct CourseFrame<'a> {
    ground: &'a GroundDescription,
    samples: Vec<Sample>,
    full_m: f64,
    reach_m: f64,
}

/// Height by the bank, and friction above that of the description.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Along {
    pub height_m: f64,
    pub friction: f64,
}

/// Where a place lies relative to one stretch of the course.
struct Pass {
    station_m: f64,
    offset_m: f64,
    presence: f64,
}

impl<'a> CourseFrame<'a> {
    pub fn new(ground: &'a GroundDescription, course: &Course) -> Self {
        let total = course.total_length_m();
        // At most 1e5.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let count = (total / SAMPLE_SPACING_M).ceil() as usize;
        let samples = (0..=count)
            .map(|i| {
                let point = course.point(total * i as f64 / count as f64);
                let (sin, cos) = point.heading_rad.sin_cos();
                Sample {
                    station_m: point.station_m,
                    x_m: point.x_m,
                    y_m: point.y_m,
                    sin,
                    cos,
                    curvature_per_m: point.curvature_per_m,
                }
            })
            .collect();
        let half = 0.5 * course.width_m();
        Self {
            ground,
            samples,
            full_m: half + SHOULDER_M,
            reach_m: half + CORRIDOR_MARGIN_M,
        }
    }

    /// Largest distance from the course at which anything lies, m.
    pub fn reach_m(&self) -> f64 {
        self.reach_m
    }

    /// Positions of the samples, m.
    pub fn positions_m(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.samples.iter().map(|s| (s.x_m, s.y_m))
    }

    /// Whether anything lies along the course that must be asked for node by node.
    pub fn has_bank(&self) -> bool {
        !self.ground.bank.is_empty()
    }

    /// Whether friction differs from place to place.
    pub fn has_friction(&self) -> bool {
        self.ground.split.is_some() || !self.ground.patches.is_empty()
    }

    /// Bank and friction at a position. `ranges` hold every sample within reach of it.
    pub fn along(&self, x: f64, y: f64, ranges: &[SampleRange]) -> Along {
        let mut sum = Along::default();
        let (mut weights, mut absence) = (0.0, 1.0);
        for &(first, last) in ranges {
            self.passes(x, y, first as usize, last as usize, |pass| {
                let weight = pass.presence / (pass.offset_m * pass.offset_m + NEAR_M * NEAR_M);
                weights += weight;
                absence *= 1.0 - pass.presence;
                sum.height_m += weight * self.bank(pass.station_m) * pass.offset_m;
                sum.friction += weight * self.friction_excess(pass.station_m, pass.offset_m);
            });
        }
        if weights > 0.0 {
            let scale = (1.0 - absence) / weights;
            Along {
                height_m: sum.height_m * scale,
                friction: sum.friction * scale,
            }
        } else {
            Along::default()
        }
    }

    /// Calls `found` with every stretch of the samples to which a position is nearest.
    fn passes(&self, x: f64, y: f64, first: usize, last: usize, mut found: impl FnMut(&Pass)) {
        let squared = |i: usize| {
            let sample = &self.samples[i];
            (sample.x_m - x).powi(2) + (sample.y_m - y).powi(2)
        };
        let end = self.samples.len() - 1;
        let (mut before, mut now) = (f64::INFINITY, squared(first));
        for i in first..=last {
            let after = if i < last {
                squared(i + 1)
            } else {
                f64::INFINITY
            };
            // The ends of a range are out of reach, unless the course itself ends there.
            let inside = (i > first || i == 0) && (i < last || i == end);
            if inside && now <= before && now < after {
                let pass = self.pass(x, y, i);
                if pass.presence > 0.0 {
                    found(&pass);
                }
            }
            (before, now) = (now, after);
        }
    }

    /// The pass at the nearest sample. Within half a sample's spacing the course is its circle.
    fn pass(&self, x: f64, y: f64, nearest: usize) -> Pass {
        let sample = &self.samples[nearest];
        let (dx, dy) = (x - sample.x_m, y - sample.y_m);
        let along = dx * sample.cos + dy * sample.sin;
        let across = dy * sample.cos - dx * sample.sin;
        let end = self.samples.len() - 1;
        let beyond = (nearest == 0 && along < 0.0) || (nearest == end && along > 0.0);
        let curvature = if beyond { 0.0 } else { sample.curvature_per_m };
        let (mut s, mut offset) = (along, across);
        if curvature != 0.0 {
            s = 0.0;
            for _ in 0..3 {
                let turn = curvature * s;
                // Sine and cosine of an angle below 0.5 m times a curvature of at most 1/m.
                let (sin, cos) = turn.sin_cos();
                let (u, v) = (along - sin / curvature, across - (1.0 - cos) / curvature);
                offset = v * cos - u * sin;
                let step = (u * cos + v * sin) / (1.0 - curvature * offset).max(0.1);
                s += step.clamp(-SAMPLE_SPACING_M, SAMPLE_SPACING_M);
            }
        }
        let mut reach = self.reach_m;
        if curvature * offset > 0.0 {
            reach = reach.min(INNER_SHARE / curvature.abs());
        }
        let full = self.full_m.min(FULL_SHARE * reach);
        let beside = 1.0 - smooth_step((offset.abs() - full) / (reach - full));
        let ahead = if beyond {
            1.0 - smooth_step(along.abs() / self.reach_m)
        } else {
            1.0
        };
        Pass {
            station_m: sample.station_m + s,
            offset_m: offset,
            presence: beside * ahead,
        }
    }

    /// Rise to the left at a station (no unit).
    fn bank(&self, station_m: f64) -> f64 {
        let points = &self.ground.bank;
        let after = points.partition_point(|p| p.station_m <= station_m);
        let percent = match (after.checked_sub(1).map(|i| &points[i]), points.get(after)) {
            (Some(a), Some(b)) => {
                let u = (station_m - a.station_m) / (b.station_m - a.station_m);
                a.percent + (b.percent - a.percent) * smooth_step(u)
            }
            (Some(only), None) | (None, Some(only)) => only.percent,
            (None, None) => 0.0,
        };
        0.01 * percent
    }

    /// Friction beyond that of the description.
    fn friction_excess(&self, station_m: f64, offset_m: f64) -> f64 {
        let base = self.ground.friction;
        let mut friction = base;
        if let Some(split) = &self.ground.split {
            let left = smooth_step(0.5 + offset_m / split.edge_m);
            friction = split.right + (split.left - split.right) * left;
        }
        for patch in &self.ground.patches {
            let inside = |from: f64, to: f64, at: f64| {
                smooth_step(0.5 + (at - from) / patch.edge_m)
                    * smooth_step(0.5 + (to - at) / patch.edge_m)
            };
            let share = inside(patch.from_m, patch.to_m, station_m)
                * inside(patch.right_m, patch.left_m, offset_m);
            friction += (patch.friction - friction) * share;
        }
        friction - base
    }
}

/// A bump at its place, evaluated exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlacedBump {
    x_m: f64,
    y_m: f64,
    sin: f64,
    cos: f64,
    half_length_m: f64,
    half_width_m: f64,
    runout_m: f64,
    height_m: f64,
}

impl PlacedBump {
    pub fn new(bump: &Bump, course: &Course) -> Self {
        let point = course.point(bump.station_m);
        let (sin, cos) = point.heading_rad.sin_cos();
        let (half_length_m, half_width_m) = (0.5 * bump.length_m, 0.5 * bump.width_m);
        Self {
            x_m: point.x_m - bump.offset_m * sin,
            y_m: point.y_m + bump.offset_m * cos,
            sin,
            cos,
            half_length_m,
            half_width_m,
            runout_m: half_length_m.min(half_width_m),
            height_m: bump.height_m,
        }
    }

    /// Middle and largest distance from it at which the bump is felt, m.
    pub fn circle_m(&self) -> (f64, f64, f64) {
        let radius = self.half_length_m.hypot(self.half_width_m);
        (self.x_m, self.y_m, radius)
    }

    /// Height, and its derivatives by x and y.
    #[inline]
    pub fn height(&self, x: f64, y: f64) -> [f64; 3] {
        let (dx, dy) = (x - self.x_m, y - self.y_m);
        let along = dx * self.cos + dy * self.sin;
        let across = dy * self.cos - dx * self.sin;
        if along.abs() >= self.half_length_m || across.abs() >= self.half_width_m {
            return [0.0; 3];
        }
        let (length, length_rate) = raised_cosine(along, self.half_length_m, self.half_length_m);
        let (width, width_rate) = raised_cosine(across, self.half_width_m, self.runout_m);
        let by_along = self.height_m * length_rate * width;
        let by_across = self.height_m * length * width_rate;
        [
            self.height_m * length * width,
            by_along * self.cos - by_across * self.sin,
            by_along * self.sin + by_across * self.cos,
        ]
    }
}

/// 1 in the middle, run out by half a period of a cosine over the last `runout` before `half`; and
/// its derivative.
fn raised_cosine(at: f64, half: f64, runout: f64) -> (f64, f64) {
    let into = at.abs() - (half - runout);
    if into <= 0.0 {
        return (1.0, 0.0);
    }
    let factor = std::f64::consts::PI / runout;
    let (sin, cos) = (factor * into).sin_cos();
    (0.5 * (1.0 + cos), -0.5 * factor * sin * at.signum())
}
