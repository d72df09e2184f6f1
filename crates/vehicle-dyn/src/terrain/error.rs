//! What can be wrong with a ground, a terrain and a terrain file.

use std::path::PathBuf;

/// A ground description that cannot be used; the message says where and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GroundError {
    /// A number out of its range.
    #[error("ground.{field} = {value}: must be in {range}")]
    OutOfRange {
        /// Field of the description.
        field: String,
        /// Value found.
        value: f64,
        /// Allowed interval with its unit.
        range: String,
    },
    /// A field that others require.
    #[error("ground.{field} is missing: {advice}")]
    Missing {
        /// The absent field.
        field: String,
        /// What to give.
        advice: &'static str,
    },
    /// Values that are allowed one by one but contradict each other.
    #[error("ground.{fields}: {reason}")]
    Contradiction {
        /// The fields concerned, with their values.
        fields: String,
        /// What must hold.
        reason: String,
    },
    /// Something lies beyond the end of the course.
    #[error(
        "ground.{field} = {station_m} m lies beyond the end of the course at {total_m} m: move it or lengthen the course"
    )]
    BeyondCourse {
        /// Field of the description.
        field: String,
        /// Station given, m.
        station_m: f64,
        /// Length of the course, m.
        total_m: f64,
    },
    /// Something lies too far beside the course.
    #[error(
        "ground.{field} = {offset_m} m: the ground is made up to {reach_m} m to either side of the centre line"
    )]
    BesideCourse {
        /// Field of the description.
        field: String,
        /// Offset given, m.
        offset_m: f64,
        /// Largest offset, m.
        reach_m: f64,
    },
}

/// A terrain that cannot be built or does not fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TerrainError {
    /// The description is not allowed or does not fit the course.
    #[error(transparent)]
    Ground(#[from] GroundError),
    /// The grid would take too much memory.
    #[error(
        "the terrain of this course, {length_m:.0} m long, takes {needed_mib} MiB, allowed are {allowed_mib} MiB: shorten the course or narrow its road"
    )]
    TooLarge {
        /// Length of the course, m.
        length_m: f64,
        /// Memory needed, MiB.
        needed_mib: u64,
        /// Memory allowed, MiB.
        allowed_mib: u64,
    },
    /// Stopped by the caller.
    #[error("stopped after {done} of {total} tiles of the terrain")]
    Interrupted {
        /// Tiles made.
        done: usize,
        /// Tiles of the terrain.
        total: usize,
    },
    /// The terrain does not reach as far as the road.
    #[error(
        "the terrain ends before the road: at station {station_m:.0} m of {total_m:.0} m it reaches {covered_m:.1} m to the {side}, the road {needed_m:.1} m; use the terrain made for this course"
    )]
    SmallerThanCourse {
        /// First station that is not covered, m.
        station_m: f64,
        /// Length of the course, m.
        total_m: f64,
        /// Side that is not covered, left or right.
        side: &'static str,
        /// How far it is covered there, m; 0 when the centre line is not.
        covered_m: f64,
        /// Half the width of the road, m.
        needed_m: f64,
    },
}

/// A terrain file that cannot be written or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TerrainFileError {
    /// The file cannot be opened or read.
    #[error("cannot read the terrain file {path}: {source}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Writing failed.
    #[error("cannot write the terrain: {source}")]
    Unwritable {
        /// Why.
        source: std::io::Error,
    },
    /// The file is cut short, damaged, or of another kind.
    #[error(
        "{path} is no terrain file, or it is damaged: {reason}. Make it anew, or give a height map as vehicle_dyn::terrain::read describes it"
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found.
        reason: String,
    },
    /// The file was written by a version that this one does not know.
    #[error(
        "{path} is a terrain file of version {found}, this program reads version {known}: make it anew"
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Version of the file.
        found: u64,
        /// Version that is read.
        known: u64,
    },
    /// A height map that cannot be used.
    #[error("the height map {path}: {reason}")]
    HeightMap {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line or node, and what to do.
        reason: String,
    },
    /// A map of measured heights is its own file already.
    #[error("a measured height map is not written again: use the file it was read from")]
    Measured,
    /// The description inside is not allowed.
    #[error("{path}: {source}")]
    Ground {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: GroundError,
    },
}
