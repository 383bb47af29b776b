//! What the report of `umbel shadow` has of lights, maps and their errors.

use glam::DVec3;
use serde_json::{Value, json};
use umbel::engine::Film;
use umbel::shadow::{MapErrors, face_matrices};
use umbel::{Origin, Pencil};

/// The names of the faces.
const FACES: [&str; 6] = ["+X", "-X", "+Y", "-Y", "+Z", "-Z"];

/// A line of the table, and the same for the report. Parts are those of all surfaces that are seen.
pub(crate) fn comparison(size: u32, surfaces: usize, found: &MapErrors) -> (String, Value) {
    let part = |count: usize| {
        let percent = 100.0 * count as f64 / surfaces.max(1) as f64;
        format!("{count} {:>9}", format!("{percent:.4} %"))
    };
    let line = format!(
        "{size:>10} {:>19} {:>19} {:>12.4} {:>12.4}\n",
        part(found.acne),
        part(found.leaks),
        found.median_bias,
        found.greatest_bias
    );
    let value = json!({
        "cube_size": size,
        "receivers": surfaces,
        "asked": found.receivers,
        "acne": found.acne,
        "leaks": found.leaks,
        "median_bias": found.median_bias,
        "greatest_bias": found.greatest_bias,
    });
    (line, value)
}

/// Whether a light is at infinity.
pub(crate) fn is_sun(light: Origin) -> bool {
    matches!(light, Origin::Infinity(_))
}

/// A light in the report, in the frame of the scene's file, from which `offset` was taken.
pub(crate) fn light_json(light: Origin, offset: DVec3) -> Value {
    match light {
        Origin::Point(point) => json!({ "point": (point + offset).to_array() }),
        Origin::Infinity(direction) => json!({ "toward": (-direction).to_array() }),
    }
}

/// How texels of the maps become rays.
pub(crate) fn map_json(size: u32, pencils: &[Pencil]) -> Value {
    let film = |pencil: &Pencil| match (pencil.origin(), pencil.films().first()) {
        (Origin::Infinity(direction), Some(Film::Grid(film))) => {
            let [forward, right, up] = film.span().map(|v| v.to_array());
            Some(json!({ "direction": direction.to_array(), "forward": forward, "right": right, "up": up }))
        }
        _ => None,
    };
    let films: Vec<Value> = pencils.iter().filter_map(film).collect();
    if !films.is_empty() {
        return json!({ "size": size, "films": films });
    }
    let faces = FACES.iter().zip(face_matrices());
    let faces: Vec<Value> = faces.map(|(name, matrix)| json!({ "name": name, "matrix": matrix })).collect();
    json!({ "size": size, "faces": faces })
}
