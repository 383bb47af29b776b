//! The documentation names what exists: links and their anchors, and the paths of files in text, code spans and comments.
//!
//! Markdown files are those at the root, in `docs`, `benches` and `tests`. Of Rust files all comments are read.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Folders of the project whose paths are recognized in text.
const FOLDERS: [&str; 6] = ["src/", "modes/", "tests/", "docs/", "examples/", "benches/"];
/// Ends of file names that are recognized in text.
const FILES: [&str; 4] = [".rs", ".md", ".png", ".svg"];

/// The root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the repository").to_owned()
}

/// All files with an extension in a folder and the folders within it, in the order of their names.
fn files_in(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder of the project") {
        let path = entry.expect("an entry").path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(files_in(&path, extension));
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The pages of the documentation.
fn pages() -> Vec<PathBuf> {
    let root = root();
    let at_root = fs::read_dir(&root).expect("the root").map(|entry| entry.expect("an entry").path());
    let mut pages: Vec<PathBuf> =
        at_root.filter(|path| path.extension().is_some_and(|end| end == "md")).collect();
    ["docs", "benches", "tests"].iter().for_each(|folder| pages.extend(files_in(&root.join(folder), "md")));
    pages.sort();
    pages
}

/// The text of a page without its blocks of code.
fn prose(page: &Path) -> String {
    let text = fs::read_to_string(page).expect("a page");
    let mut in_code = false;
    let mut is_prose = |line: &&str| {
        let fence = line.trim_start().starts_with("```");
        in_code ^= fence;
        !in_code && !fence
    };
    text.lines().filter(|line| is_prose(line)).collect::<Vec<_>>().join("\n")
}

/// The targets of a page's links and pictures.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| rest.split(')').next())
}

/// The anchor that a heading gets on the pages of a repository: small letters, no punctuation, hyphens for blanks.
fn anchor(heading: &str) -> String {
    let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect::<String>().to_lowercase()
}

/// The anchors of a page.
fn anchors(page: &Path) -> BTreeSet<String> {
    let text = prose(page);
    let headings = text.lines().filter(|line| line.starts_with('#'));
    headings.map(|line| anchor(line.trim_start_matches('#'))).collect()
}

/// The words of a text that may be names of files.
fn words(text: &str) -> impl Iterator<Item = &str> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '/');
    text.split(move |c: char| !is_part(c)).map(|word| word.trim_end_matches('.'))
}

/// Whether a word is the path of a file from the root of the repository.
fn is_path(word: &str) -> bool {
    FOLDERS.iter().any(|folder| word.starts_with(folder)) && FILES.iter().any(|end| word.ends_with(end))
}

/// Whether a word is the name of a Rust file, without its folder.
fn is_name(word: &str) -> bool {
    word.len() > ".rs".len() && word.ends_with(".rs") && !word.contains('/')
}

#[test]
fn links_lead_somewhere() {
    let mut broken = Vec::new();
    for page in pages() {
        let text = prose(&page);
        for link in links(&text).filter(|link| !link.contains("://")) {
            let (file, fragment) =
                link.split_once('#').map_or((link, None), |(file, part)| (file, Some(part)));
            let folder = page.parent().expect("a page lies in a folder");
            let target = if file.is_empty() { page.clone() } else { folder.join(file) };
            let leads = target.exists() && fragment.is_none_or(|part| anchors(&target).contains(part));
            if !leads {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}

#[test]
fn named_files_exist() {
    let root = root();
    let sources: Vec<PathBuf> =
        FOLDERS.iter().flat_map(|folder| files_in(&root.join(folder), "rs")).collect();
    let names: BTreeSet<&str> =
        sources.iter().filter_map(|file| file.file_name().and_then(|name| name.to_str())).collect();
    let comments = |text: &str| {
        let lines = text.lines().filter(|line| line.trim_start().starts_with("//"));
        lines.collect::<Vec<_>>().join("\n")
    };
    let mut missing = Vec::new();
    for file in pages().iter().chain(&sources) {
        let text = fs::read_to_string(file).expect("a file of the project");
        let text = if file.extension().is_some_and(|end| end == "rs") { comments(&text) } else { text };
        let is_missing = |word: &&str| {
            (is_path(word) && !root.join(word).exists()) || (is_name(word) && !names.contains(word))
        };
        missing.extend(words(&text).filter(is_missing).map(|word| format!("{}: {word}", file.display())));
    }
    assert!(missing.is_empty(), "files that do not exist:\n{}", missing.join("\n"));
}

#[test]
fn the_index_has_all_pages() {
    let folder = root().join("docs");
    let index = prose(&folder.join("README.md"));
    let linked: BTreeSet<&str> = links(&index).collect();
    for page in files_in(&folder, "md") {
        let name = page.file_name().and_then(|name| name.to_str()).expect("a name");
        assert!(name == "README.md" || linked.contains(name), "docs/README.md does not link {name}");
    }
}

#[test]
fn the_readme_is_for_newcomers() {
    let text = fs::read_to_string(root().join("README.md")).expect("the README");
    assert!(text.lines().count() < 250, "what only few need belongs into docs/");
}
