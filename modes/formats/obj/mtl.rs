//! Reads the colours and the optics of material libraries (MTL) through `tobj`. What is wrong with a library is a warning.
//!
//! | `illum` | what follows from it |
//! |---|---|
//! | 3, 5, 8 | a mirror of reflectance `Ks` |
//! | 6, 7 | a boundary to the refractive index `Ni`, which mirrors as Fresnel's equations say; with `Ni` 1 as 4 |
//! | 4, 9 | light passes straight on; what is mirrored is `Ks` |
//! | others | no mirror; light passes straight on where `d` (or 1 − `Tr`) is below 1 |
//!
//! Of 4, 6, 7 and 9 `Tf` passes, without it 1 − `d`, and without either everything.
//!
//! Based on: Wavefront Technologies, "MTL material format", 1995.

use std::collections::{HashMap, HashSet};
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::Problem;
use crate::formats::neighbours::{Missing, Neighbours};
use crate::formats::obj::text::{Statements, keyword, text_of, words};
use crate::scene::optics::Optics;

/// Refractive indices that a material may have.
const INDICES: RangeInclusive<f32> = 0.001..=10.0;

/// The diffuse reflectance of a material that states none.
const DEFAULT_DIFFUSE: [f32; 3] = [0.8; 3];

/// What a library says of a material.
pub(crate) type Look = ([f32; 3], Optics);

/// The diffuse reflectance and the optics of the materials in all libraries, by name; of equal names the last counts.
/// A library that is named again is read once, in the place where it was named last.
pub(crate) fn read_libraries(
    neighbours: &mut Neighbours<'_>,
    statements: &[String],
    warnings: &mut Vec<String>,
) -> Result<HashMap<String, Look>, Problem> {
    let mut libraries: Vec<(PathBuf, String, Arc<Vec<u8>>)> = Vec::new();
    let mut asked = HashSet::new();
    for statement in statements.iter().rev().filter(|statement| asked.insert(statement.as_str())) {
        for (name, found) in named_libraries(neighbours, statement) {
            let shown = neighbours.shown(&name);
            match found {
                Ok((key, bytes)) => libraries.push((key, shown, bytes)),
                Err(Missing::Outside) => warnings.push(format!(
                    "material library {name} lies outside of the file's folder and is not read; if you trust the \
                     file, allow it: ObjOptions::allow_outside"
                )),
                Err(Missing::Unreadable(error)) => {
                    warnings.push(format!("material library {shown} cannot be read: {error}"));
                }
                Err(Missing::TooLarge(problem)) => return Err(problem),
            }
        }
    }
    let mut seen = HashSet::new();
    libraries.retain(|(key, ..)| seen.insert(key.clone()));
    let mut looks = HashMap::new();
    for (_, shown, bytes) in libraries.iter().rev() {
        let library = tame_library(bytes, shown, warnings);
        match tobj::load_mtl_buf(&mut library.as_bytes()) {
            Ok((materials, _)) => looks.extend(materials.into_iter().map(|material| {
                let colour = material.diffuse.unwrap_or(DEFAULT_DIFFUSE);
                let look = (colour.map(|part| part.clamp(0.0, 1.0)), optics(&material));
                (material.name, look)
            })),
            Err(error) => warnings.push(format!("material library {shown} cannot be used: {error}")),
        }
    }
    Ok(looks)
}

/// A file or why there is none.
type Found = Result<(PathBuf, Arc<Vec<u8>>), Missing>;

/// The files of one `mtllib`, the last first: one name that may contain spaces, or several names.
fn named_libraries(neighbours: &mut Neighbours<'_>, statement: &str) -> Vec<(String, Found)> {
    let statement = statement.replace('\\', "/");
    let whole = neighbours.fetch(&statement);
    let words: Vec<&str> = statement.split_whitespace().rev().collect();
    if whole.is_err() && words.len() > 1 {
        let several: Vec<_> =
            words.into_iter().map(|name| (name.to_owned(), neighbours.fetch(name))).collect();
        if several.iter().any(|(_, found)| found.is_ok()) {
            return several;
        }
    }
    vec![(statement, whole)]
}

/// What a material mirrors and lets through.
fn optics(material: &tobj::Material) -> Optics {
    let share = |parts: [f32; 3]| parts.map(|part| part.clamp(0.0, 1.0));
    let filter = material.unknown_param.get("Tf").and_then(|text| {
        let parts: Vec<f32> = text.split_whitespace().filter_map(|part| part.parse().ok()).collect();
        <[f32; 3]>::try_from(parts).ok()
    });
    let mirror = share(material.specular.unwrap_or_default());
    let dissolved = material.dissolve.map(|d| [1.0 - d; 3]);
    let passes = share(filter.or(dissolved).unwrap_or([1.0; 3]));
    match material.illumination_model {
        Some(3 | 5 | 8) => Optics { mirror, ..Optics::OPAQUE },
        Some(4 | 9) => Optics { mirror, transmission: passes, ior: 1.0 },
        Some(6 | 7) => Optics { mirror, transmission: passes, ior: material.optical_density.unwrap_or(1.0) },
        _ => Optics { transmission: share(dissolved.unwrap_or_default()), ..Optics::OPAQUE },
    }
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
        let number = |word: &str| word.parse().ok().filter(|x: &f32| x.is_finite());
        let is_number = |word: &&str| number(word).is_some();
        let kept = match (keyword, &numbers[..]) {
            ("newmtl", [_, ..]) => rest.trim_end().to_owned(),
            // One number stands for all three.
            ("Kd" | "Ks" | "Tf", [grey]) if is_number(grey) => format!("{grey} {grey} {grey}"),
            ("Kd" | "Ks" | "Tf", [r, g, b, ..]) if [r, g, b].into_iter().all(is_number) => {
                format!("{r} {g} {b}")
            }
            ("d", [amount, ..]) if is_number(amount) => (*amount).to_owned(),
            ("illum", [model, ..]) if model.parse::<u8>().is_ok() => (*model).to_owned(),
            ("Ni", [index, ..]) if number(index).is_some_and(|n| INDICES.contains(&n)) => (*index).to_owned(),
            // The other way to say `d`.
            ("Tr", [amount, ..]) if is_number(amount) => {
                let dissolve = 1.0 - number(amount).unwrap_or(0.0);
                tame.push_str(&format!("d {dissolve}\n"));
                continue;
            }
            ("newmtl" | "Kd" | "Ks" | "Tf" | "d" | "Tr" | "Ni" | "illum", _) => {
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
