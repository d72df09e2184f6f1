//! Holds the rules of `docs/architecture.md` that a compiler does not.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// A file above this holds more than one thing.
const MAX_LINES: usize = 500;

/// Which of our crates each crate may use.
const ARROWS: [(&str, &[&str]); 4] = [
    ("deepc-core", &[]),
    ("sysid", &["deepc-core"]),
    ("vehicle-dyn", &[]),
    ("rollover-app", &["deepc-core", "sysid", "vehicle-dyn"]),
];

/// The stages of a crate in the order of the data flow: a stage imports only earlier ones.
const DEEPC_STAGES: [&str; 7] = [
    "data",
    "hankel",
    "predictor",
    "solver",
    "program",
    "assessment",
    "controller",
];

/// Words of a single application have no place in the library for any plant.
const FOREIGN_WORDS: [&str; 6] = ["steer", "vehicle", "wheel", "ltr", "rollover", "driver"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a member has a parent")
        .to_path_buf()
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a source folder is readable") {
            let path = entry.expect("a source entry is readable").path();
            if path.is_dir() {
                if path.file_name().is_some_and(|n| n != "target") {
                    folders.push(path);
                }
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    assert!(!files.is_empty(), "{} holds Rust files", folder.display());
    files
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn crates_depend_only_along_the_arrows() {
    for (name, allowed) in ARROWS {
        let manifest = read(&root().join("crates").join(name).join("Cargo.toml"));
        let manifest: toml::Table = manifest.parse().expect("a manifest is TOML");
        // Tests and examples of a crate are held to the same arrows.
        let used: BTreeSet<&str> = ["dependencies", "dev-dependencies", "build-dependencies"]
            .iter()
            .filter_map(|table| manifest.get(*table)?.as_table())
            .flat_map(|table| table.keys().map(String::as_str))
            .filter(|d| ARROWS.iter().any(|(ours, _)| ours == d))
            .collect();
        let allowed: BTreeSet<&str> = allowed.iter().copied().collect();
        let foreign: Vec<_> = used.difference(&allowed).collect();
        assert!(foreign.is_empty(), "{name} must not depend on {foreign:?}");
    }
}

#[test]
fn every_crate_is_in_the_arrows() {
    for entry in fs::read_dir(root().join("crates")).expect("crates/ is readable") {
        let name = entry.expect("an entry is readable").file_name();
        let known = ARROWS.iter().any(|(ours, _)| name == *ours);
        assert!(
            known,
            "{} needs a place among the arrows",
            name.to_string_lossy()
        );
    }
}

#[test]
fn stages_of_deepc_core_import_only_earlier_stages() {
    let source = root().join("crates/deepc-core/src");
    for (index, stage) in DEEPC_STAGES.iter().enumerate() {
        for file in rust_files(&source.join(stage)) {
            let text = read(&file);
            for later in &DEEPC_STAGES[index + 1..] {
                let import = format!("crate::{later}");
                // A link in a doc comment points forward freely.
                let code = text.lines().filter(|l| !l.trim_start().starts_with("//"));
                let found = code.into_iter().any(|l| l.contains(&import));
                assert!(!found, "{} imports the later stage {later}", file.display());
            }
        }
    }
}

#[test]
fn deepc_core_knows_no_application() {
    for file in rust_files(&root().join("crates/deepc-core")) {
        let text = read(&file).to_lowercase();
        for word in text.split(|c: char| !c.is_alphanumeric()) {
            let foreign = FOREIGN_WORDS.iter().find(|f| word.starts_with(**f));
            assert!(foreign.is_none(), "{} speaks of `{word}`", file.display());
        }
    }
}

#[test]
fn the_report_reads_logs_only() {
    for file in rust_files(&root().join("crates/rollover-app/src/report")) {
        let text = read(&file);
        for absent in ["closed_loop", "deepc_core", "record::"] {
            assert!(
                !text.contains(absent),
                "{} must not use {absent}",
                file.display()
            );
        }
    }
}

#[test]
fn vehicles_are_files_never_types() {
    for file in rust_files(&root().join("crates")) {
        let text = read(&file);
        assert!(
            !text.contains("match vehicle.name"),
            "{} asks for a name",
            file.display()
        );
    }
}

#[test]
fn source_files_stay_small() {
    for member in ["crates", "benches", "tests"] {
        for file in rust_files(&root().join(member)) {
            let lines = read(&file).lines().count();
            assert!(
                lines <= MAX_LINES,
                "{} has {lines} lines, more than {MAX_LINES}",
                file.display()
            );
        }
    }
}
