//! Heat maps: how many pairs of a ray and a triangle were evaluated, and how many questions filters left open, ray by ray.

use umbel_core::{Film, Pencil, TileStats};

/// A number for each ray of a pencil: what was counted for it, if anything was, or the mean of its tile. NaN where nothing is known.
pub(crate) fn heat_of(
    pencil: &Pencil,
    (tiles, mean): (&[TileStats], fn(&TileStats) -> f64),
    counted: &[u32],
) -> Vec<f32> {
    let mut work: Vec<f32> = counted.iter().map(|&count| count as f32).collect();
    let counted = !work.is_empty();
    work.resize(pencil.len(), f32::NAN);
    let mut rest = &mut work[..];
    for (index, film) in pencil.films().iter().enumerate() {
        let (width, rays, is_counted) = match film {
            Film::Grid(grid) => {
                (grid.width() as usize, grid.width() as usize * grid.height() as usize, false)
            }
            Film::Scattered(samples) => (samples.len(), samples.len(), counted),
        };
        let of_film;
        (of_film, rest) = rest.split_at_mut(rays);
        for tile in tiles.iter().filter(|tile| tile.film == index && !is_counted) {
            let ([x0, x1], value) = (tile.columns.map(|x| x as usize), mean(tile) as f32);
            for y in tile.rows[0] as usize..tile.rows[1] as usize {
                of_film[y * width + x0..y * width + x1].fill(value);
            }
        }
    }
    work
}
