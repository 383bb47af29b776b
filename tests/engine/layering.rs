//! The layers of the house: which folder may name which, read from the sources themselves.
//!
//! A folder names only folders below it; within `intersect` no path names another, except `general` as the way out; nothing
//! below `query` sees the caller's options; and no two files of one crate name each other, not even by way of others. Test
//! modules at the ends of files are exempt.
//!
//! Based on: David Parnas, "On the Criteria To Be Used in Decomposing Systems into Modules", 1972.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Folders and files at the root of the engine, from below. Those of one line do not name each other.
const ENGINE: [&[&str]; 11] = [
    &["error"],
    &["stats"],
    &["simd"],
    &["options"],
    &["geometry"],
    &["exact"],
    &["objects"],
    &["rays"],
    &["intersect"],
    &["query"],
    &["reyes"],
];
/// The same within `intersect`: what all paths share, then the paths.
const INTERSECT: [&[&str]; 4] =
    [&["context", "ray_set"], &["general"], &["pencil"], &["grid", "irregular", "bundle", "beam"]];
/// Parts of `intersect` that others of it may name.
const SHARED: [&str; 4] = ["context", "ray_set", "general", "pencil"];
/// The same at the root of the library.
const LIBRARY: [&[&str]; 8] = [
    &["error"],
    &["random"],
    &["files"],
    &["scene"],
    &["surfaces"],
    &["builtin"],
    &["formats", "shadow"],
    &["render", "bake", "measure"],
];

/// A source file of a crate.
struct Source {
    /// Its path as findings name it.
    file: String,
    /// The path of its module from the root of the crate.
    module: Vec<String>,
    text: String,
}

/// A module, or an item in it, that a line of a file names: its path from the root of the crate.
struct Reference {
    line: usize,
    path: Vec<String>,
}

impl Source {
    fn new(file: &str, root: &str, text: &str) -> Self {
        let inside = file.trim_start_matches(root).trim_start_matches('/').trim_end_matches(".rs");
        let mut module: Vec<String> = inside.split('/').map(String::from).collect();
        if module.last().is_some_and(|last| last == "mod") {
            module.pop();
        }
        Self { file: file.into(), module, text: text.into() }
    }

    /// What the file names by `crate::`, `super::` and `self::`, without comments and the test module at its end.
    fn references(&self) -> Vec<Reference> {
        let end =
            self.text.find("#[cfg(test)]\nmod ").or_else(|| self.text.find("#[cfg(test)]\npub(crate) mod "));
        // Comments become empty lines, so that lines keep their numbers.
        let lines = self.text[..end.unwrap_or(self.text.len())].lines();
        let code: String =
            lines.map(|line| line.split("//").next().unwrap_or("").to_owned() + "\n").collect();
        let mut found = Vec::new();
        for (word, up) in [("crate::", None), ("self::", Some(0)), ("super::", Some(1))] {
            for (place, _) in code.match_indices(word) {
                let before = code[..place].chars().next_back();
                if before.is_some_and(|c| c.is_alphanumeric() || "_:$".contains(c)) {
                    continue;
                }
                let line = code[..place].matches('\n').count() + 1;
                let base = up.map_or(0, |up| self.module.len().saturating_sub(up));
                let paths = tree(&code[place + word.len()..], &self.module[..base]).0;
                found.extend(paths.into_iter().map(|path| Reference { line, path }));
            }
        }
        found
    }
}

/// The paths of a tree such as `a::{b, c::d}`, all below `base`, and what follows the tree.
fn tree<'a>(text: &'a str, base: &[String]) -> (Vec<Vec<String>>, &'a str) {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        let mut paths = Vec::new();
        loop {
            rest = rest.trim_start().trim_start_matches(',').trim_start();
            if rest.is_empty() || rest.starts_with('}') {
                return (paths, rest.get(1..).unwrap_or(""));
            }
            let (more, after) = tree(rest, base);
            paths.extend(more);
            // What is renamed, and signs that are no part of a tree.
            rest = after.trim_start_matches(|c: char| c != ',' && c != '}');
        }
    }
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let path = [base, &[name.to_owned()]].concat();
    match rest.strip_prefix("::") {
        Some(rest) if !name.is_empty() => tree(rest, &path),
        _ => (vec![path], rest),
    }
}

/// The rank of a folder; `None` where the order does not know it.
fn rank(order: &[&[&str]], folder: &str) -> Option<usize> {
    order.iter().position(|names| names.contains(&folder))
}

/// What breaks the order of folders at one depth: folders below `depth` modules that all have the same names.
fn arrows(sources: &[Source], order: &[&[&str]], within: &[&str]) -> Vec<String> {
    let depth = within.len();
    let is_inside =
        |path: &[String]| path.len() > depth && path.iter().zip(within).all(|(one, other)| one == other);
    let mut broken = Vec::new();
    for source in sources.iter().filter(|source| is_inside(&source.module)) {
        for Reference { line, path } in source.references() {
            if !is_inside(&path) || path[depth] == source.module[depth] {
                continue;
            }
            let (from, to) = (&source.module[depth], &path[depth]);
            let is_below = match (rank(order, from), rank(order, to)) {
                (Some(from), Some(to)) => to < from,
                _ => false,
            };
            if !is_below {
                broken.push(format!("{}:{line}: {from} names {}", source.file, path.join("::")));
            }
        }
    }
    broken
}

/// Lines of one path of `intersect` that name another path.
fn paths_across(sources: &[Source]) -> Vec<String> {
    let of_path =
        |module: &[String]| (module.len() > 1 && module[0] == "intersect").then(|| module[1].clone());
    let mut broken = Vec::new();
    for source in sources {
        let Some(from) = of_path(&source.module) else { continue };
        for Reference { line, path } in source.references() {
            if let Some(to) = of_path(&path).filter(|to| *to != from && !SHARED.contains(&to.as_str())) {
                broken.push(format!("{}:{line}: the path {from} names the path {to}", source.file));
            }
        }
    }
    broken
}

/// Lines below `query` that name the options of the caller.
fn options_below(sources: &[Source]) -> Vec<String> {
    let query = rank(&ENGINE, "query");
    let below = sources.iter().filter(|source| {
        source.module[0] != "options"
            && rank(&ENGINE, &source.module[0]).is_some_and(|rank| Some(rank) < query)
    });
    let named = below.flat_map(|source| {
        let options =
            source.references().into_iter().filter(|found| found.path[..] == ["options", "Options"]);
        options.map(|found| format!("{}:{}: names the options of the caller", source.file, found.line))
    });
    named.collect()
}

/// Circles of files: each file that names itself by way of others, with the line that leads on within the circle.
fn circles(sources: &[Source]) -> Vec<String> {
    let modules: BTreeMap<&[String], usize> =
        sources.iter().enumerate().map(|(index, source)| (&source.module[..], index)).collect();
    let file_of = |path: &[String]| (1..=path.len()).rev().find_map(|end| modules.get(&path[..end]).copied());
    let names: Vec<Vec<(usize, usize)>> = sources
        .iter()
        .enumerate()
        .map(|(index, source)| {
            let found = source.references().into_iter();
            let files = found.filter_map(|found| Some((file_of(&found.path)?, found.line)));
            files.filter(|(file, _)| *file != index).collect()
        })
        .collect();
    let reached: Vec<BTreeSet<usize>> = (0..sources.len()).map(|start| reached_from(start, &names)).collect();
    let mut broken = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        let back = names[index].iter().find(|(file, _)| reached[*file].contains(&index));
        if let Some((file, line)) = back {
            broken.push(format!("{}:{line}: {} leads back here", source.file, sources[*file].file));
        }
    }
    broken
}

/// All files that a file names, by way of others as well.
fn reached_from(start: usize, names: &[Vec<(usize, usize)>]) -> BTreeSet<usize> {
    let (mut reached, mut waiting) = (BTreeSet::new(), vec![start]);
    while let Some(file) = waiting.pop() {
        waiting.extend(names[file].iter().map(|(next, _)| *next).filter(|next| reached.insert(*next)));
    }
    reached
}

/// What breaks the rules of the engine.
fn broken_in_engine(sources: &[Source]) -> Vec<String> {
    let rules = [
        arrows(sources, &ENGINE, &[]),
        arrows(sources, &INTERSECT, &["intersect"]),
        paths_across(sources),
        options_below(sources),
        circles(sources),
    ];
    rules.into_iter().flatten().collect()
}

/// The sources of a crate, but for its root and a crate in a folder of its own.
fn sources(root: &str, without: &str) -> Vec<Source> {
    let house =
        Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the package lies in the house").to_owned();
    let (mut found, mut folders) = (Vec::new(), vec![house.join(root)]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of the house") {
            let path = entry.expect("an entry of a folder").path();
            let name =
                path.strip_prefix(&house).expect("within the house").to_string_lossy().replace('\\', "/");
            if path.is_dir() && name != without {
                folders.push(path);
            } else if name.ends_with(".rs") && !name.ends_with("/lib.rs") && !name.ends_with("/main.rs") {
                found.push(Source::new(&name, root, &std::fs::read_to_string(&path).expect("a source")));
            }
        }
    }
    assert!(found.len() > 10, "only {} sources in {root}", found.len());
    found.sort_by(|one, other| one.file.cmp(&other.file));
    found
}

#[test]
fn the_engine_keeps_its_layers() {
    let broken = broken_in_engine(&sources("src", ""));
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_library_keeps_its_layers() {
    let library = sources("modes", "modes/cli");
    let broken = [arrows(&library, &LIBRARY, &[]), circles(&library)].concat();
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_command_has_no_circles() {
    let broken = circles(&sources("modes/cli", ""));
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Each rule, broken by a source made for it, is found on its line.
#[test]
fn broken_rules_are_found() {
    let check = |files: &[(&str, &str)]| {
        let sources: Vec<Source> = files.iter().map(|(file, text)| Source::new(file, "src", text)).collect();
        broken_in_engine(&sources)
    };
    let found = check(&[("src/rays/film.rs", "//! crate::query\n\nuse crate::query::frame::Frame;\n")]);
    assert_eq!(found, ["src/rays/film.rs:3: rays names query::frame::Frame"]);
    let found = check(&[("src/simd/isa.rs", "fn f() -> crate::geometry::Ray {}\n")]);
    assert_eq!(found, ["src/simd/isa.rs:1: simd names geometry::Ray"]);
    let found = check(&[(
        "src/intersect/pencil/mod.rs",
        "use crate::{\n    error::Error,\n    intersect::{ray_set, grid::rows},\n};\n",
    )]);
    assert_eq!(
        found,
        [
            "src/intersect/pencil/mod.rs:1: pencil names intersect::grid::rows",
            "src/intersect/pencil/mod.rs:1: the path pencil names the path grid"
        ]
    );
    let found = check(&[("src/intersect/bundle/mod.rs", "use crate::options::{Accuracy, Options};\n")]);
    assert_eq!(found, ["src/intersect/bundle/mod.rs:1: names the options of the caller"]);
    let found = check(&[
        ("src/exact/filter.rs", "use super::expansion::Expansion;\n"),
        ("src/exact/expansion.rs", "use crate::exact::predicates::{Sign as Other};\n"),
        ("src/exact/predicates.rs", "\nuse crate::exact::filter;\n"),
        ("src/exact/mod.rs", "mod filter;\n#[cfg(test)]\nmod tests {\n    use crate::query;\n}\n"),
    ]);
    assert_eq!(
        found,
        [
            "src/exact/filter.rs:1: src/exact/expansion.rs leads back here",
            "src/exact/expansion.rs:1: src/exact/predicates.rs leads back here",
            "src/exact/predicates.rs:2: src/exact/filter.rs leads back here"
        ]
    );
    // What the order does not know has no place; what lies below has.
    let found = check(&[("src/objects/runs.rs", "use crate::{exact, somewhere as s, simd};\n")]);
    assert_eq!(found, ["src/objects/runs.rs:1: objects names somewhere"]);
}
