//! Creases in an OBJ file: the tags of the shapes that OpenSubdiv tests itself with, and that its exporters write.
//!
//! `t crease I/F/0 v0 v1 .. s0 ..` has I vertices, counted from 0, and F numbers: the edges between each vertex and the next have the
//! sharpness of their place, or the last one. `t corner I/F/0 v0 .. s0 ..` is the same for vertices. All other tags are left to others.
//!
//! Based on: Pixar, "OpenSubdiv", 2013 (the tags of its regression shapes).

use crate::error::{CORRECT_LINE, Problem};
use crate::formats::obj::text::words;
use crate::scene::Creases;

/// Takes a tag, given what follows its `t`, its line, and how many vertices the file has.
pub(crate) fn take_tag(rest: &str, (line, count): (u64, u64), creases: &mut Creases) -> Result<(), Problem> {
    let mut words = words(rest);
    let Some(kind @ ("crease" | "corner")) = words.next() else {
        return Ok(());
    };
    let problem = |what: String| Problem { line: Some(line), what, remedy: CORRECT_LINE };
    let numbers: Vec<&str> = words.collect();
    let form = || {
        problem(format!(
            "\"t {kind}\" takes a form such as \"t crease 2/1/0 4 7 2.5\", vertices counted from 0"
        ))
    };
    let (counts, numbers) = numbers.split_first().ok_or_else(form)?;
    let counts: Vec<usize> =
        counts.split('/').map(str::parse).collect::<Result<_, _>>().map_err(|_| form())?;
    let least = if kind == "crease" { 2 } else { 1 };
    let &[vertices, values, 0] = &counts[..] else { return Err(form()) };
    if vertices < least || values == 0 || Some(numbers.len()) != vertices.checked_add(values) {
        return Err(form());
    }
    let (vertices, values) = numbers.split_at(vertices);
    let vertices: Vec<u32> =
        vertices.iter().map(|word| word.parse()).collect::<Result<_, _>>().map_err(|_| form())?;
    let values: Vec<f32> =
        values.iter().map(|word| word.parse()).collect::<Result<_, _>>().map_err(|_| form())?;
    if let Some(vertex) = vertices.iter().find(|&&vertex| u64::from(vertex) >= count) {
        return Err(problem(format!(
            "there is no vertex {vertex}: they are counted from 0 here, and there are {count}"
        )));
    }
    if let Some(sharpness) = values.iter().find(|sharpness| sharpness.is_nan() || **sharpness < 0.0) {
        return Err(problem(format!("the sharpness {sharpness} is not 0 or more")));
    }
    let value = |place: usize| values[place.min(values.len() - 1)];
    if kind == "crease" {
        let edges = vertices.windows(2).enumerate();
        creases.edges.extend(edges.map(|(place, ends)| ([ends[0], ends[1]], value(place))));
    } else {
        creases.corners.extend(vertices.iter().enumerate().map(|(place, &vertex)| (vertex, value(place))));
    }
    Ok(())
}
