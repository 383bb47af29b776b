//! The public names of both packages, as `docs/public-api.txt` lists them: a change of one shows in review.
//!
//! The lint `unreachable_pub` keeps `pub` for what is public, and rustfmt gives each declaration its place; so the lines that
//! begin with `pub`, and the variants of public enums, are the list. Nothing else is needed to read it.
//!
//! After a change that is meant: `UMBEL_BLESS=1 cargo test --release --test library public_api`.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The sources below a folder, in order, without the command.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<PathBuf> = entries.collect();
    paths.sort();
    for path in paths {
        if path.is_dir() && !path.ends_with("modes/cli") {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The sources below a folder, with their texts.
fn files_of(folder: &Path) -> impl Iterator<Item = (PathBuf, String)> {
    let mut files = Vec::new();
    sources(folder, &mut files);
    files.into_iter().map(|file| {
        let text = fs::read_to_string(&file).expect("a source");
        (file, text)
    })
}

/// The path of a module of `umbel`: that of its file.
fn module(file: &Path, folder: &Path) -> String {
    let inner = file.strip_prefix(folder).expect("inside").with_extension("");
    let parts = inner.iter().map(|part| part.to_str().expect("UTF-8"));
    ["umbel"]
        .into_iter()
        .chain(parts.filter(|part| !["lib", "mod"].contains(part)))
        .collect::<Vec<_>>()
        .join("::")
}

/// Whether a declaration that begins with some lines goes on.
fn goes_on(text: &str) -> bool {
    let depth = text.chars().fold(0, |depth, c| match c {
        '(' | '[' => depth + 1,
        ')' | ']' => depth - 1,
        _ => depth,
    });
    depth > 0 || !text.ends_with([';', '{', ',', '}'])
}

/// The public declarations of a file, each on a line, with the type that it belongs to.
fn declarations(text: &str) -> Vec<String> {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default();
    let (mut found, mut owner, mut in_enum) = (Vec::new(), String::new(), false);
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let (indent, line) = (line.len() - line.trim_start().len(), line.trim_start());
        let is_public = line.starts_with("pub ");
        if indent == 0 && !line.is_empty() && !line.starts_with(['#', '/', '}', ')']) {
            let head = line.trim_end_matches('{').trim();
            let is_type =
                ["pub struct", "pub enum", "pub trait", "impl"].iter().any(|kind| head.starts_with(kind));
            owner = if is_type { format!("{head} / ") } else { String::new() };
            in_enum = head.starts_with("pub enum") || head.starts_with("pub trait");
        }
        let is_member = in_enum && indent == 4 && line.starts_with(|c: char| c.is_alphabetic());
        if !(is_public && indent <= 4 || is_member) {
            continue;
        }
        let mut whole = line.to_owned();
        while goes_on(&whole) && !(is_member && whole.ends_with(')')) {
            let Some(next) = lines.next() else { break };
            whole = format!("{whole} {}", next.trim());
        }
        let whole = whole.trim_end_matches(['{', ',', ';']).trim().replace("( ", "(").replace(", )", ")");
        found.push(if indent == 0 { whole } else { format!("{owner}{whole}") });
    }
    found
}

#[test]
fn the_list_of_public_names_is_up_to_date() {
    let mut list = String::from("umbel_core: all at the root\n");
    let mut of_engine: Vec<String> =
        files_of(&root().join("src")).flat_map(|(_, text)| declarations(&text)).collect();
    of_engine.sort();
    list.extend(of_engine.into_iter().map(|line| format!("    {line}\n")));
    let modes = root().join("modes");
    for (file, text) in files_of(&modes) {
        let declarations = declarations(&text);
        if !declarations.is_empty() {
            list += &format!("\n{}\n", module(&file, &modes));
            list.extend(declarations.into_iter().map(|line| format!("    {line}\n")));
        }
    }
    let path = root().join("docs/public-api.txt");
    if std::env::var_os("UMBEL_BLESS").is_some() {
        fs::write(&path, &list).expect("written");
    }
    let known = fs::read_to_string(&path).expect("the list").replace("\r\n", "\n");
    let differs = list.lines().zip(known.lines()).find(|(now, then)| now != then);
    assert!(
        list == known,
        "the public names have changed, first here: {differs:?}; if that is meant, run this test with UMBEL_BLESS=1"
    );
}
