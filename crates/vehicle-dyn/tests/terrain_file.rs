//! Terrain files: the same bits back, clear words for broken ones, and maps of measured heights.

mod common;

use std::io::Cursor;
use std::path::Path;

use common::three_turns;
use npyz::WriterBuilder;
use vehicle_dyn::road::Course;
use vehicle_dyn::terrain::{GroundDescription, Terrain, TerrainFileError};

const RIVERBED: &str = r#"
    friction = 0.85
    fade_in_m = 50.0
    roughness = { class = "c", contact_length_m = 0.13, seed = 1 }
    undulation = { height_rms_m = 0.05, shortest_m = 25.0, longest_m = 80.0, seed = 2 }
    bank = [{ station_m = 0.0, percent = 1.0 }, { station_m = 300.0, percent = -3.0 }]
    bumps = [{ station_m = 70.0, offset_m = 0.7, length_m = 1.0, width_m = 1.0, height_m = 0.05 }]
    split = { left = 0.9, right = 0.7, edge_m = 1.0 }
"#;

fn riverbed() -> Terrain {
    let ground: GroundDescription = toml::from_str(RIVERBED).expect("valid");
    let course = Course::new(&three_turns()).expect("valid");
    Terrain::build(&ground, &course).expect("it fits")
}

fn bytes(terrain: &Terrain) -> Vec<u8> {
    let target = Cursor::new(Vec::new());
    terrain.write(target).expect("memory takes it").into_inner()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder can be made")
}

/// Reads what a file of this name with these bytes holds.
fn read(name: &str, bytes: &[u8]) -> Result<Terrain, TerrainFileError> {
    let folder = folder();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("the folder is writable");
    Terrain::read(&path, 0.85)
}

fn message(name: &str, bytes: &[u8]) -> String {
    read(name, bytes).expect_err("refused").to_string()
}

/// An archive of arrays of numbers.
fn archive(arrays: &[(&str, &[u64], &[f64])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    for (name, shape, values) in arrays {
        let options = zip::write::SimpleFileOptions::default();
        zip.start_file(format!("{name}.npy"), options)
            .expect("memory takes it");
        let mut writer = npyz::WriteOptions::new()
            .default_dtype()
            .shape(shape)
            .writer(&mut zip)
            .begin_nd()
            .expect("memory takes it");
        writer.extend(values.iter()).expect("as many as the shape");
        writer.finish().expect("as many as the shape");
    }
    zip.finish().expect("memory takes it").into_inner()
}

#[test]
fn a_terrain_comes_back_with_the_same_bits() {
    let terrain = riverbed();
    let written = bytes(&terrain);
    let back = read("terrain.npz", &written).expect("as written");
    assert_eq!(back, terrain);
    for k in 0..3000 {
        let (x, y) = (0.35 * f64::from(k), 12.0 * (0.2 * f64::from(k)).sin());
        assert_eq!(back.ground(x, y), terrain.ground(x, y));
    }
    assert_eq!(bytes(&back), written);
    let course = Course::new(&three_turns()).expect("valid");
    assert!(back.check_covers(&course).is_ok());
    let mirror = terrain.mirrored();
    assert_eq!(
        read("mirror.npz", &bytes(&mirror)).expect("as written"),
        mirror
    );
    let flat = Terrain::flat(0.3);
    assert_eq!(read("flat.npz", &bytes(&flat)).expect("as written"), flat);
}

#[test]
fn a_file_cut_short_anywhere_is_refused() {
    let written = bytes(&riverbed());
    for share in [0.0, 0.001, 0.3, 0.7, 0.999_999] {
        // In [0, length].
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let length = (share * written.len() as f64) as usize;
        let text = message("cut.npz", &written[..length]);
        assert!(
            text.contains("cut.npz") && text.contains("damaged"),
            "{text}"
        );
    }
}

#[test]
fn a_file_with_a_changed_byte_is_refused() {
    let written = bytes(&riverbed());
    for share in [2, 3, 5] {
        let mut changed = written.clone();
        let place = changed.len() / share;
        changed[place] ^= 0x40;
        let text = message("changed.npz", &changed);
        assert!(text.contains("damaged"), "{text}");
    }
}

#[test]
fn foreign_files_are_refused() {
    let text = message("picture.npz", b"\x89PNG\r\n\x1a\n not an archive at all");
    assert!(text.contains("picture.npz is no terrain file"), "{text}");
    let other = archive(&[("a", &[2], &[1.0, 2.0])]);
    let text = message("other.npz", &other);
    assert!(
        text.contains("neither `header_json` nor `height_m`"),
        "{text}"
    );
    let missing = Terrain::read(Path::new("no/such/file.npz"), 0.85).expect_err("absent");
    assert!(
        missing.to_string().contains("cannot read the terrain file"),
        "{missing}"
    );
    let folder = folder();
    assert!(Terrain::read(folder.path(), 0.85).is_err(), "a folder");
}

/// A terrain file whose header has been changed.
fn with_header(from: &str, to: &str) -> Vec<u8> {
    let written = bytes(&Terrain::flat(0.5));
    let mut zip = zip::ZipArchive::new(Cursor::new(written)).expect("an archive");
    let entry = zip.by_name("header_json.npy").expect("it is there");
    let header: Vec<u8> = npyz::NpyFile::new(entry)
        .and_then(npyz::NpyFile::into_vec)
        .expect("bytes");
    let header = String::from_utf8(header).expect("JSON");
    assert!(header.contains(from), "{header}");
    let header = header.replace(from, to).into_bytes();
    let mut out = zip::ZipWriter::new(Cursor::new(Vec::new()));
    out.start_file("header_json.npy", zip::write::SimpleFileOptions::default())
        .expect("memory takes it");
    let mut writer = npyz::WriteOptions::new()
        .default_dtype()
        .shape(&[header.len() as u64])
        .writer(&mut out)
        .begin_nd()
        .expect("memory takes it");
    writer.extend(header).expect("as many as the shape");
    writer.finish().expect("as many as the shape");
    out.finish().expect("memory takes it").into_inner()
}

#[test]
fn other_versions_and_formats_are_refused_by_name() {
    let text = message("new.npz", &with_header("\"version\":1", "\"version\":7"));
    assert!(
        text.contains("version 7") && text.contains("reads version 1"),
        "{text}"
    );
    let text = message(
        "foreign.npz",
        &with_header("vehicle-dyn terrain", "sea bed"),
    );
    assert!(text.contains("`sea bed`"), "{text}");
    let text = message("other.npz", &with_header("\"mirrored\"", "\"sideways\""));
    assert!(text.contains("header_json"), "{text}");
}

/// Heights of a tilted plane with a wave, as a user's table.
fn table(friction: bool) -> String {
    use std::fmt::Write;
    let mut text = String::from("x_m,y_m,height_m");
    text += if friction { ",friction\n" } else { "\n" };
    for row in 0..21 {
        for column in 0..41 {
            let (x, y) = (-5.0 + 0.5 * f64::from(column), -5.0 + 0.5 * f64::from(row));
            write!(text, "{x},{y},{}", 100.0 + height(x, y)).expect("a string grows");
            if friction {
                write!(text, ",{}", if y > 0.0 { 0.9 } else { 0.3 }).expect("a string grows");
            }
            text.push('\n');
        }
    }
    text
}

fn height(x: f64, y: f64) -> f64 {
    0.02 * x - 0.05 * y + 0.1 * (0.5 * x).sin() * (0.4 * y).cos()
}

#[test]
fn a_measured_map_is_the_spline_through_its_nodes() {
    let map = read("map.csv", table(false).as_bytes()).expect("a map");
    let node = map.ground(1.5, -2.0);
    assert!((node.height_m - 100.0 - height(1.5, -2.0)).abs() < 1e-9);
    assert!((node.friction - 0.85).abs() < 1e-15);
    for (x, y) in [(1.23, 0.77), (6.1, -3.2), (11.9, 3.9)] {
        let found = map.ground(x, y);
        assert!(
            (found.height_m - 100.0 - height(x, y)).abs() < 2e-4,
            "{found:?}"
        );
        let slope = (height(x + 1e-5, y) - height(x - 1e-5, y)) / 2e-5;
        assert!(
            (found.gradient_x - slope).abs() < 2e-3,
            "{found:?}, {slope}"
        );
    }
    // Beyond the edge the edge goes on level.
    let (edge, beyond) = (map.ground(15.0, 1.0), map.ground(40.0, 1.0));
    assert!((edge.height_m - beyond.height_m).abs() < 1e-12 && beyond.gradient_x == 0.0);
    assert!((edge.gradient_y - beyond.gradient_y).abs() < 1e-12);
    let split = read("map.csv", table(true).as_bytes()).expect("a map");
    assert!((split.ground(0.0, 3.0).friction - 0.9).abs() < 1e-12);
    assert!((split.ground(0.0, -3.0).friction - 0.3).abs() < 1e-12);
    let course = Course::new(&three_turns()).expect("valid");
    let small = map
        .check_covers(&course)
        .expect_err("it is small")
        .to_string();
    assert!(small.contains("at station 16 m of 1105 m"), "{small}");
    assert!(matches!(
        map.write(Cursor::new(Vec::new())),
        Err(TerrainFileError::Measured)
    ));
}

#[test]
fn a_map_from_arrays_is_that_of_the_table() {
    let heights: Vec<f64> = table(false)
        .lines()
        .skip(1)
        .map(|line| {
            line.rsplit(',')
                .next()
                .expect("a field")
                .parse()
                .expect("a number")
        })
        .collect();
    let arrays: [(&str, &[u64], &[f64]); 5] = [
        ("x0_m", &[], &[-5.0]),
        ("y0_m", &[1], &[-5.0]),
        ("spacing_m", &[], &[0.5]),
        ("height_m", &[21, 41], &heights),
        ("friction", &[], &[0.4]),
    ];
    let map = read("map.npz", &archive(&arrays)).expect("a map");
    let other = read("map.csv", table(false).as_bytes()).expect("a map");
    for (x, y) in [(0.3, 0.2), (7.7, -4.1), (-5.0, 5.0)] {
        assert!((map.ground(x, y).height_m - other.ground(x, y).height_m).abs() < 1e-9);
        assert!((map.ground(x, y).friction - 0.4).abs() < 1e-15);
    }
    let refuse = |index: usize, array: (&str, &[u64], &[f64]), piece: &str| {
        let mut changed = arrays.to_vec();
        changed[index] = array;
        let text = message("map.npz", &archive(&changed));
        assert!(text.contains("map.npz") && text.contains(piece), "{text}");
    };
    refuse(0, ("x_m", &[], &[0.0]), "`x0_m` is missing");
    refuse(2, ("spacing_m", &[], &[0.0]), "spacing_m = 0");
    refuse(2, ("spacing_m", &[2], &[0.1, 0.2]), "must be one number");
    refuse(
        3,
        ("height_m", &[861], &heights),
        "(nodes along y, nodes along x)",
    );
    refuse(
        4,
        ("friction", &[3], &[0.1, 0.2, 0.3]),
        "`friction` has shape [3]",
    );
    refuse(4, ("friction", &[], &[-0.4]), "friction = -0.4");
}

#[test]
fn tables_that_are_no_grid_are_refused_with_the_line() {
    let text = table(true);
    let lines: Vec<&str> = text.lines().collect();
    let refuse = |lines: &[&str], piece: &str| {
        let found = message("map.csv", lines.join("\n").as_bytes());
        assert!(
            found.contains("map.csv") && found.contains(piece),
            "{found}"
        );
    };
    refuse(&lines[..1], "no line below its header");
    refuse(&lines[1..], "column `x_m` is missing");
    refuse(
        &lines[..lines.len() - 1],
        "860 lines do not fill a grid of 41 by 21",
    );
    let changed = |number: usize, line: &'static str| {
        let mut changed = lines.clone();
        changed[number] = line;
        changed
    };
    refuse(&changed(9, "-1,-5,NaN,0.3"), "line 10: `height_m` = `NaN`");
    refuse(&changed(9, "-1,-5,1e6,0.3"), "height_m = 1000000");
    refuse(&changed(9, "-1,-5,100,7"), "friction = 7");
    refuse(&changed(9, "-1.5,-5,100,0.3"), "is there twice");
    refuse(&changed(9, "-1.2,-5,100,0.3"), "not evenly spaced");
    refuse(&changed(9, "-1,-5,100"), "");
    let few: Vec<&str> = lines.iter().take(4).copied().collect();
    refuse(&few, "the same y_m");
}
