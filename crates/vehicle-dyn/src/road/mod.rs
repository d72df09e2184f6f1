//! Roads of continuous curvature: straights, clothoids and arcs.
//!
//! A [`CourseDescription`] is data, as in a scenario file; a [`Course`] is the road built from it.
//! The curvature is piecewise linear in the station (arc length) `s`: `κ(s) = κ0 + κ' s` on each
//! piece, so the heading is quadratic and the position a Fresnel integral.

mod course;
mod crossing;
mod segment;

pub use course::{Course, Location, RoadPoint};
pub use segment::{CourseDescription, RoadError, Segment, TurnDirection};
