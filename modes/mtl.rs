//! Reads the diffuse colours of material libraries (MTL) through `tobj`. What is wrong with a library is a warning.
//!
//! Based on: Wavefront Technologies, "MTL material format", 1995.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use crate::obj_text::{Statements, keyword, text_of, words};

/// The diffuse reflectance of a material that states none.
const DEFAULT_DIFFUSE: [f32; 3] = [0.8; 3];

/// The diffuse reflectance of the materials in all libraries, by name; of equal names the last counts.
pub(crate) fn read_libraries(
    folder: &Path,
    statements: &[String],
    warnings: &mut Vec<String>,
) -> HashMap<String, [f32; 3]> {
    let mut diffuse = HashMap::new();
    for path in statements.iter().flat_map(|statement| library_paths(folder, statement)) {
        let shown = path.display();
        // Devices and pipes may never end.
        let bytes = match fs::metadata(&path) {
            Ok(metadata) if !metadata.is_file() => Err(io::Error::other("not a file")),
            Ok(_) => fs::read(&path),
            Err(error) => Err(error),
        };
        let library = match bytes {
            Ok(bytes) => tame_library(&bytes, &shown.to_string(), warnings),
            Err(error) => {
                warnings.push(format!("material library {shown} cannot be read: {error}"));
                continue;
            }
        };
        match tobj::load_mtl_buf(&mut library.as_bytes()) {
            Ok((materials, _)) => diffuse.extend(materials.into_iter().map(|material| {
                let colour = material.diffuse.unwrap_or(DEFAULT_DIFFUSE);
                (material.name, colour.map(|part| part.clamp(0.0, 1.0)))
            })),
            Err(error) => warnings.push(format!("material library {shown} cannot be used: {error}")),
        }
    }
    diffuse
}

/// The files of one `mtllib`: one name that may contain spaces, or several names.
fn library_paths(folder: &Path, statement: &str) -> Vec<PathBuf> {
    let statement = statement.replace('\\', "/");
    let whole = folder.join(&statement);
    let several: Vec<_> = statement.split_whitespace().map(|name| folder.join(name)).collect();
    if whole.is_file() || !several.iter().any(|path| path.is_file()) { vec![whole] } else { several }
}

/// The part of a material library that is used and that tobj reads: it panics on a `Kd` with one or two numbers and gives
/// up the whole library at the first statement that it cannot read.
fn tame_library(bytes: &[u8], shown: &str, warnings: &mut Vec<String>) -> String {
    let text = match text_of(bytes) {
        Ok(text) => text,
        Err(problem) => {
            warnings.push(format!("material library {shown} cannot be used: {}", problem.what));
            return String::new();
        }
    };
    let mut tame = String::new();
    for (line, statement) in Statements::new(text) {
        let (keyword, rest) = keyword(&statement);
        let numbers: Vec<&str> = words(rest).collect();
        let is_number = |word: &&str| word.parse::<f32>().is_ok_and(f32::is_finite);
        let kept = match (keyword, &numbers[..]) {
            ("newmtl", [_, ..]) => rest.trim_end().to_owned(),
            // One number stands for all three.
            ("Kd", [grey]) if is_number(grey) => format!("{grey} {grey} {grey}"),
            ("Kd", [r, g, b, ..]) if [r, g, b].into_iter().all(is_number) => format!("{r} {g} {b}"),
            ("newmtl" | "Kd", _) => {
                warnings
                    .push(format!("{shown}:{line}: `{}` cannot be read and is ignored", statement.trim()));
                continue;
            }
            _ => continue,
        };
        tame.extend([keyword, " ", &kept, "\n"]);
    }
    tame
}
