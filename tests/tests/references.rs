//! Every paper that a doc comment cites is listed in `docs/references.md`.
//!
//! A citation is a run of names that ends in a year ("Goldfarb and Idnani 1983", "Boyd et al.
//! 2011"), or a year after a comma ("…, SIAM J. Optim. 13, 2003"). Of the former the first author
//! is known; of the latter one is looked for in what was written before it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

const YEARS: std::ops::RangeInclusive<u32> = 1900..=2099;

/// Words of a name that are written small, and what joins names.
const JOINTS: [&str; 9] = [
    "and", "et", "al.", "van", "von", "de", "den", "der", "della",
];

/// How many words before a year that follows a comma may hold its author.
const REACH: usize = 30;

/// What looks like a citation and is none: the words as found, and why.
const EXCEPTIONS: [(&str, &str); 0] = [];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("a member has a parent")
        .to_path_buf()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The Rust files of all crates' sources and examples.
fn rust_files() -> Vec<PathBuf> {
    let mut folders: Vec<_> = fs::read_dir(root().join("crates"))
        .expect("crates/ is readable")
        .map(|entry| entry.expect("an entry is readable").path())
        .flat_map(|member| [member.join("src"), member.join("examples")])
        .filter(|folder| folder.is_dir())
        .collect();
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a source folder is readable") {
            let path = entry.expect("a source entry is readable").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    files
}

/// The words of each run of doc comments; citations may wrap.
fn doc_comments(source: &str) -> Vec<Vec<&str>> {
    let mut comments = vec![Vec::new()];
    for line in source.lines().map(str::trim_start) {
        let text = line
            .strip_prefix("///")
            .or_else(|| line.strip_prefix("//!"));
        match (text, comments.last_mut()) {
            (Some(text), Some(comment)) => comment.extend(text.split_whitespace()),
            _ => comments.push(Vec::new()),
        }
    }
    comments
}

/// The year a word is, brackets and punctuation aside.
fn year(word: &str) -> Option<u32> {
    let digits = word.trim_matches(|c: char| "([.,;:)]*|".contains(c));
    let digits = Some(digits).filter(|d| d.len() == 4)?;
    digits.parse().ok().filter(|year| YEARS.contains(year))
}

fn is_capitalised(word: &str) -> bool {
    word.starts_with(char::is_uppercase)
}

/// The last name of the first author of "Boyd, Parikh" or "P. J. Goulart and Y. Chen".
fn first_author(names: &str) -> Option<String> {
    let first = names.split([',', ':', ';']).next()?;
    let first = first.split(" and ").next()?.split(" et al").next()?;
    let last = first.split_whitespace().next_back()?;
    Some(last.to_lowercase())
}

/// Whether the run of names goes on before this word, which is part of it.
fn continues(word: &str) -> bool {
    let initial = word.ends_with('.') && word.chars().count() == 2;
    initial || word == "al." || !word.ends_with(['.', ':', ';', ')', '|'])
}

/// The names that end just before a year.
fn names_before<'a>(words: &[&'a str]) -> Vec<&'a str> {
    let mut names = Vec::new();
    for &word in words.iter().rev() {
        let name = word.trim_start_matches(['(', '[']);
        let is_name = is_capitalised(name) || JOINTS.contains(&name.trim_end_matches(','));
        if !is_name || !continues(word) {
            break;
        }
        names.insert(0, name);
        if name != word {
            break;
        }
    }
    names
}

/// First author (lower case) and year of every entry.
fn entries() -> BTreeSet<(String, u32)> {
    let text = read(&root().join("docs/references.md"));
    let mut entries = BTreeSet::new();
    for entry in text.split("\n- ").skip(1) {
        let author = first_author(entry).expect("an entry begins with its author");
        for year in entry.split_whitespace().filter_map(year) {
            entries.insert((author.clone(), year));
        }
    }
    assert!(entries.len() > 20, "references.md has entries");
    entries
}

/// What a citation says and whether an entry has it; `None` if it is no citation.
fn look_up(
    before: &[&str],
    year: u32,
    entries: &BTreeSet<(String, u32)>,
) -> Option<(String, bool)> {
    let last = before.last()?;
    if last.ends_with(',') && !is_capitalised(last) {
        let nearby = &before[before.len().saturating_sub(REACH)..];
        let listed = nearby.iter().any(|word| {
            let name = word.trim_matches(|c: char| !c.is_alphanumeric());
            entries.contains(&(name.to_lowercase(), year))
        });
        return Some((format!("{} {year}", nearby.join(" ")), listed));
    }
    let names = names_before(before).join(" ");
    let author = first_author(&names)?;
    Some((format!("{names} {year}"), entries.contains(&(author, year))))
}

#[test]
fn what_is_cited_is_listed() {
    let (entries, mut cited, mut absent) = (entries(), 0, BTreeSet::new());
    for file in rust_files() {
        for words in doc_comments(&read(&file)) {
            for (index, word) in words.iter().enumerate() {
                let Some(year) = year(word) else { continue };
                let Some((text, listed)) = look_up(&words[..index], year, &entries) else {
                    continue;
                };
                cited += 1;
                if !listed && EXCEPTIONS.iter().all(|(known, _)| !text.contains(known)) {
                    absent.insert(format!("{}: {text}", file.display()));
                }
            }
        }
    }
    assert!(cited > 30, "only {cited} citations were recognised");
    assert!(
        absent.is_empty(),
        "docs/references.md lacks:\n{}",
        absent.into_iter().collect::<Vec<_>>().join("\n")
    );
}

#[test]
fn citations_are_recognised_as_they_are_written() {
    let entries = BTreeSet::from([("boyd".to_owned(), 2011), ("waarde".to_owned(), 2020)]);
    let found = |text: &str| {
        let words: Vec<_> = text.split_whitespace().collect();
        let index = words.iter().position(|word| year(word).is_some());
        let index = index.expect("a year");
        let year = year(words[index]).expect("a year");
        look_up(&words[..index], year, &entries).map(|(_, listed)| listed)
    };
    for listed in [
        "an iteration is (Boyd et al. 2011, section 3)",
        "records: van Waarde, De Persis, Camlibel, Tesi 2020).",
        "S. Boyd, N. Parikh and E. Chu, Machine Learning 3, 2011.",
    ] {
        assert_eq!(found(listed), Some(true), "{listed}");
    }
    for absent in [
        "(Boyd et al. 2012)",
        "a rule of Parikh, Boyd 2011",
        "quadratic programs (Goldfarb and Idnani, Math. Programming 27, 1983)",
    ] {
        assert_eq!(found(absent), Some(false), "{absent}");
    }
    assert_eq!(found("all windows up to 2000."), None);
}
