//! The ground of a scenario: made, read, written, drawn.

mod picture;
mod survey;

use std::io::Cursor;
use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use vehicle_dyn::road::{Course, CourseDescription};
use vehicle_dyn::terrain::{GroundDescription, Terrain, TerrainError};

pub use survey::{Station, Survey, TerrainSummary};

use crate::campaign::default_folder;
use crate::cli::TerrainArgs;
use crate::interrupt::{Interrupt, Interrupted};
use crate::output::{create_folder, print_json, print_line, write_json, write_whole};
use crate::progress;
use crate::scenario::{self, Scenario};

/// Names of the files written.
const FILE: &str = "terrain.npz";
const PICTURE: &str = "terrain.svg";
const SUMMARY: &str = "terrain.json";

/// Makes the ground of a course.
///
/// # Errors
/// When it does not fit the course or into memory, and as [`Interrupted`] when the user stops it.
pub fn build(
    ground: &GroundDescription,
    course: &CourseDescription,
    interrupt: &Interrupt,
) -> Result<Terrain> {
    let course = Course::new(course)?;
    let bar = progress::bar(0, "terrain");
    let mut follow = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
        if interrupt.is_raised() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let made = Terrain::build_with(ground, &course, &mut follow);
    bar.finish_and_clear();
    match made {
        Err(TerrainError::Interrupted { done, total }) => Err(Interrupted {
            after: format!("after {done} of {total} tiles of the terrain"),
            kept: "no terrain was written".into(),
        }
        .into()),
        made => Ok(made?),
    }
}

/// Reads a terrain to run a scenario on, and checks that it lies under its course.
///
/// # Errors
/// When the file is no terrain, or smaller than the course.
pub fn read(file: &Path, scenario: &Scenario) -> Result<Terrain> {
    let terrain = Terrain::read(file, scenario.ground.friction)?;
    terrain
        .check_covers(&Course::new(&scenario.course)?)
        .with_context(|| {
            format!(
                "{} cannot be used for scenario {}",
                file.display(),
                scenario.name
            )
        })?;
    Ok(terrain)
}

/// `terrain`: the file, a picture and a summary of a scenario's ground.
///
/// # Errors
/// When the ground cannot be made or a result cannot be written.
pub fn command(args: &TerrainArgs, interrupt: &Interrupt) -> Result<()> {
    let scenario = scenario::load(&args.scenario)?;
    let (mut ground, mut course) = if args.recording {
        (
            scenario.recording_ground().clone(),
            scenario.recording.course.clone(),
        )
    } else {
        (scenario.ground.clone(), scenario.course.clone())
    };
    if args.mirror {
        (ground, course) = (ground.mirrored(), course.mirrored());
    }
    let terrain = build(&ground, &course, interrupt)?;
    let course = Course::new(&course)?;
    let survey = Survey::new(&terrain, &course);
    let summary = TerrainSummary::new(&scenario.name, &ground, &survey);
    let title = format!("Ground of {}: {}", scenario.name, survey::words(&ground));
    let picture = picture::draw(&title, &terrain, &course, &survey)?;
    let file = terrain.write(Cursor::new(Vec::new()))?.into_inner();

    let out = args
        .out
        .clone()
        .unwrap_or_else(|| default_folder(&scenario));
    create_folder(&out)?;
    interrupt.check("before the terrain was written", "nothing was written")?;
    write_whole(&out.join(FILE), file)?;
    write_whole(&out.join(PICTURE), picture)?;
    write_json(&out.join(SUMMARY), &summary)?;
    if args.json {
        print_json(&summary)
    } else {
        print_line(&format!("{}: {summary}", out.join(FILE).display()))?;
        print_line(&format!("picture: {}", out.join(PICTURE).display()))
    }
}
