//! The openness that estimates are measured against: by umbel, along many directions that all receivers share. It is computed
//! once for each scene, and kept in a file.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

use crate::Result;
use crate::commands::error::estimates::Surface;
use crate::engines::engine::Engine;
use crate::engines::umbel::Umbel;
use crate::subjects::Subject;
use crate::subjects::ambient::Ambient;
use crate::subjects::directions;

/// Rays that are looked at together, in directions that all receivers share: so many that a few receivers have wide pencils.
const BATCH: usize = 1 << 26;
/// The most directions of them.
const MOST_DIRECTIONS: usize = 1 << 13;

/// The openness of each receiver by so many rays above its horizon.
pub(crate) fn reference(surface: &Surface, rays: usize) -> Result<Vec<f32>> {
    let path = path(surface, rays);
    if let Ok(bytes) = std::fs::read(&path)
        && bytes.len() == 4 * surface.receivers.hemispheres.len()
    {
        let (numbers, _) = bytes.as_chunks();
        return Ok(numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect());
    }
    let openness = compute(surface, rays)?;
    let bytes: Vec<u8> = openness.iter().flat_map(|openness| openness.to_le_bytes()).collect();
    let written = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    written
        .and_then(|()| std::fs::write(&path, bytes))
        .map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(openness)
}

/// Along some directions after the other.
fn compute(surface: &Surface, rays: usize) -> Result<Vec<f32>> {
    let mut sums = vec![[0.0; 2]; surface.receivers.hemispheres.len()];
    let mut umbel = Umbel::from_scratch();
    let directions = directions::sphere(2 * rays);
    let together = (BATCH / surface.receivers.len().max(1)).clamp(1, MOST_DIRECTIONS);
    for (batch, some) in directions.chunks(together).enumerate() {
        eprint!("\rreference of {}: {} of {rays} rays", surface.model.name, batch * together / 2);
        let hemispheres = surface.receivers.hemispheres.clone();
        let subject =
            Ambient::along(surface.model.clone(), surface.set, hemispheres, some.to_vec(), surface.interval)?;
        let mut answer = subject.blank();
        umbel.run(&subject, &mut answer)?;
        subject.rays.add_cosines(&answer, &surface.receivers.normals, &mut sums);
    }
    eprintln!();
    Ok(shares(&sums))
}

/// Of what is open and all there is, the share; all without anything.
pub(crate) fn shares(sums: &[[f64; 2]]) -> Vec<f32> {
    sums.iter().map(|&[open, all]| if all > 0.0 { (open / all) as f32 } else { 1.0 }).collect()
}

/// The file: named after everything that the openness depends on.
fn path(surface: &Surface, rays: usize) -> PathBuf {
    let mut hasher = DefaultHasher::new();
    surface.model.positions.as_flattened().iter().for_each(|x| x.to_bits().hash(&mut hasher));
    surface.model.triangles.hash(&mut hasher);
    surface.interval[1].to_bits().hash(&mut hasher);
    let points = surface.receivers.hemispheres.iter().flat_map(|hemisphere| hemisphere.receiver.point);
    points.for_each(|x| x.to_bits().hash(&mut hasher));
    let (key, count) = (hasher.finish(), surface.receivers.hemispheres.len());
    let folder: PathBuf = [env!("CARGO_MANIFEST_DIR"), "target", "openness"].iter().collect();
    folder.join(format!("{count}x{rays}-{key:016x}.f32"))
}
