//! Model files and scripts: what is written is read back bit by bit, and nothing else is.

use crate::common;
use common::{Noise, channel, plant};
use deepc_core::faer::Mat;
use proptest::prelude::*;
use serde_json::Value;
use sysid::{StateSpace, SysidError, SystemMatrices};

fn bits(model: &StateSpace) -> Vec<u64> {
    let m = model.matrices();
    let covariance = model.innovation_covariance().to_owned();
    let matrices = [&m.a, &m.b, &m.c, &m.d, &m.k, &covariance];
    let entries = matrices.into_iter().flat_map(|m| {
        (0..m.ncols()).flat_map(|j| m.col(j).iter().map(|v| v.to_bits()).collect::<Vec<_>>())
    });
    let channels = model
        .inputs()
        .iter()
        .chain(model.disturbances())
        .chain(model.outputs());
    let channels = channels.flat_map(|c| [c.offset.to_bits(), c.scale.to_bits()]);
    let time = std::iter::once(model.sample_time_s().to_bits());
    entries.chain(channels).chain(time).collect()
}

fn with_values(mut value: impl FnMut() -> f64) -> StateSpace {
    let mut matrix = |rows, columns| Mat::from_fn(rows, columns, |_, _| value());
    let system = SystemMatrices {
        a: matrix(3, 3),
        b: matrix(3, 2),
        c: matrix(2, 3),
        d: matrix(2, 2),
        k: matrix(3, 2),
    };
    let inputs = vec![channel("u \"1\"", 1e-300, 5e-324)];
    let disturbances = vec![channel("wind\nspeed", -0.0, 1.0)];
    let outputs = vec![
        channel("Ausgang ä", 0.1 + 0.2, 1e300),
        channel("y'2", -7.0, 1.0),
    ];
    StateSpace::new(1.0 / 3.0, inputs, disturbances, outputs, system).unwrap()
}

proptest! {
    #[test]
    fn every_number_survives(values in prop::collection::vec(
        prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::ZERO, 31)
    ) {
        let mut values = values.into_iter();
        let model = with_values(|| values.next().unwrap());
        let read = StateSpace::from_json(&model.to_json().unwrap()).unwrap();
        prop_assert_eq!(bits(&model), bits(&read));
        prop_assert_eq!(&model, &read);
    }
}

#[test]
fn awkward_numbers_survive() {
    let list = [
        -0.0,
        1e-300,
        -1e308,
        f64::MIN_POSITIVE,
        5e-324,
        0.1,
        1.0 / 3.0,
        1e22,
    ];
    let mut values = list.into_iter().cycle();
    let model = with_values(|| values.next().unwrap());
    let json = model.to_json().unwrap();
    assert_eq!(bits(&model), bits(&StateSpace::from_json(&json).unwrap()));
    // The derived form is the same document.
    let derived: Value = serde_json::to_value(&model).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&json).unwrap(), derived);
    let again: StateSpace = serde_json::from_value(derived).unwrap();
    assert_eq!(bits(&model), bits(&again));
}

#[test]
fn a_row_of_a_matrix_is_a_line() {
    let json = plant().to_json().unwrap();
    assert!(
        json.contains("  \"a\": [\n    [0.9,0.25,0.0,0.0],\n    [-0.25,0.9,0.1,0.0],\n"),
        "{json}"
    );
    assert!(json.starts_with("{\n  \"format_version\": 1,\n  \"sample_time_s\": 0.1,\n"));
}

fn broken(change: impl FnOnce(&mut Value)) -> String {
    let mut value = serde_json::to_value(plant()).unwrap();
    change(&mut value);
    StateSpace::from_json(&value.to_string())
        .unwrap_err()
        .to_string()
}

#[test]
fn corrupted_files_name_the_field() {
    let drop =
        |name: &'static str| move |v: &mut Value| drop(v.as_object_mut().unwrap().remove(name));
    for (found, parts) in [
        (
            broken(|v| v["format_version"] = 2.into()),
            vec!["version 2", "version 1"],
        ),
        (broken(drop("format_version")), vec!["format_version"]),
        (broken(drop("k")), vec!["`k`"]),
        (broken(|v| v["colour"] = 1.into()), vec!["colour"]),
        (
            broken(|v| v["inputs"][0]["unit"] = "V".into()),
            vec!["unit"],
        ),
        (
            broken(|v| drop_last(&mut v["a"][2])),
            vec!["row 2", "`a`", "3 value", "expected 4"],
        ),
        (
            broken(|v| drop_last(&mut v["a"])),
            vec!["row 0", "`a`", "4 value", "expected 3"],
        ),
        (
            broken(|v| drop_last(&mut v["c"])),
            vec!["matrix c is 1×4", "2×4"],
        ),
        (
            broken(|v| drop_last(&mut v["innovation_covariance"][1])),
            vec!["innovation_covariance"],
        ),
        (
            broken(|v| v["innovation_covariance"][1][1] = (-1.0).into()),
            vec!["variance", "flow", "-1"],
        ),
        (broken(|v| v["d"][0][1] = Value::Null), vec!["null"]),
        (
            broken(|v| v["sample_time_s"] = 0.0.into()),
            vec!["sample time", "0 s"],
        ),
        (
            broken(|v| v["outputs"][1]["scale"] = (-2.0).into()),
            vec!["scale", "flow", "-2"],
        ),
        (
            broken(|v| v["outputs"][1]["name"] = "level".into()),
            vec!["level", "twice"],
        ),
        (
            broken(|v| drop_last(&mut v["disturbances"])),
            vec!["`b`", "3 value", "expected 2"],
        ),
    ] {
        for part in parts {
            assert!(found.contains(part), "`{part}` is not in `{found}`");
        }
    }
}

fn drop_last(list: &mut Value) {
    list.as_array_mut().unwrap().pop();
}

#[test]
fn no_cut_of_a_file_is_a_model() {
    let json = plant().to_json().unwrap();
    let end = json.trim_end().len();
    for length in (0..end).filter(|&length| json.is_char_boundary(length)) {
        assert!(StateSpace::from_json(&json[..length]).is_err(), "{length}");
    }
    for huge in ["1e999", "NaN", "Infinity"] {
        assert!(StateSpace::from_json(&json.replace("0.25", huge)).is_err());
    }
}

#[test]
fn files_are_replaced_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.json");
    plant().save(&path).unwrap();
    let mut noise = Noise::new(1);
    let model = with_values(|| noise.normal());
    model.save(&path).unwrap();
    assert_eq!(StateSpace::load(&path).unwrap(), model);
    let files: Vec<_> = std::fs::read_dir(&folder).unwrap().collect();
    assert_eq!(files.len(), 1, "no draft is left: {files:?}");
    let missing = StateSpace::load(folder.path().join("none.json"));
    assert!(matches!(
        missing,
        Err(SysidError::ModelPath { action: "read", .. })
    ));
    let nowhere = folder.path().join("no folder").join("model.json");
    assert!(matches!(
        model.save(nowhere),
        Err(SysidError::ModelPath {
            action: "write",
            ..
        })
    ));
    // A folder cannot be replaced; the draft goes.
    let taken = folder.path().join("taken");
    std::fs::create_dir(&taken).unwrap();
    assert!(matches!(
        model.save(&taken),
        Err(SysidError::ModelPath {
            action: "replace",
            ..
        })
    ));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
}

#[test]
fn scripts_hold_every_digit_and_escape_names() {
    let list = [-0.0, 1e-300, 0.1, 1.0 / 3.0, 5e-324, 1e22];
    let mut values = list.into_iter().cycle();
    let script = with_values(|| values.next().unwrap())
        .to_matlab("plant_1")
        .unwrap();
    for part in [
        "plant_1.A = [\n  -0e0, 3.333333333333333e-1, -0e0;\n  1e-300, 5e-324, 1e-300;\n",
        "plant_1.InputName = {'u \"1\"'; ['wind', char(10), 'speed']};\n",
        "plant_1.OutputName = {'Ausgang ä'; 'y''2'};\n",
        "plant_1.OutputOffset = [3.0000000000000004e-1; -7e0];\n",
        "plant_1.Ts = 3.333333333333333e-1;\n",
        "plant_1.MeasuredDisturbances = 1;\n",
        "plant_1_idss = idss(",
    ] {
        assert!(script.contains(part), "`{part}` is not in\n{script}");
    }
    let long = "a".repeat(60);
    for wrong in ["", "1a", "a b", "a;system('x')", "end", "ä", long.as_str()] {
        let error = plant().to_matlab(wrong);
        assert!(
            matches!(error, Err(SysidError::Setting { field: "name", .. })),
            "{wrong}"
        );
    }
}

#[cfg(unix)]
#[test]
fn a_device_is_not_replaced_by_a_file() {
    use std::os::unix::fs::FileTypeExt as _;
    let folder = tempfile::tempdir().unwrap();
    // A socket, which anyone may make, in place of a device.
    let path = folder.path().join("socket");
    let _socket = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let message = plant().save(&path).unwrap_err().to_string();
    assert!(message.contains("no regular file"), "{message}");
    assert!(path.metadata().unwrap().file_type().is_socket());
}
