//! The rays of a pencil, so that those that follow each other look at places near each other: tile by tile.
//!
//! Grid films are cut into tiles of 32 x 32 rays, within which the rays follow row by row. Scattered rays have no rows: they
//! stay in their own order.
//!
//! Based on: the tiles of any renderer of buckets; Robert Cook, Loren Carpenter, Edwin Catmull, "The Reyes Image Rendering
//! Architecture", 1987.

use umbel_core::{Film, Pencil};

/// Rays along one side of a tile.
const SIDE: u32 = 32;

/// Rays near each other: `rows` runs of `columns` rays, each run `stride` rays after the one before.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tile {
    first: u32,
    columns: u32,
    rows: u32,
    stride: u32,
}

impl Tile {
    /// The rays of the tile.
    pub(crate) fn rays(self) -> impl Iterator<Item = u32> {
        (0..self.rows).flat_map(move |row| {
            let start = self.first + row * self.stride;
            start..start + self.columns
        })
    }
}

/// The tiles of all films. Each ray lies in one of them.
pub(crate) fn tiles(pencil: &Pencil) -> Vec<Tile> {
    let (mut tiles, mut first) = (Vec::new(), 0);
    for film in pencil.films() {
        // In range: a pencil has fewer than 2³² rays.
        let (columns, rows, side) = match film {
            Film::Grid(grid) => (grid.width(), grid.height(), [SIDE, SIDE]),
            Film::Scattered(rays) => (rays.len() as u32, 1, [SIDE * SIDE, 1]),
        };
        for y in (0..rows).step_by(side[1] as usize) {
            for x in (0..columns).step_by(side[0] as usize) {
                tiles.push(Tile {
                    first: first + y * columns + x,
                    columns: side[0].min(columns - x),
                    rows: side[1].min(rows - y),
                    stride: columns,
                });
            }
        }
        first += columns * rows;
    }
    tiles
}

#[cfg(test)]
mod tests {
    use super::*;
    use umbel_core::glam::DVec3;
    use umbel_core::{GridFilm, Origin};

    /// Every ray once, whatever the size of the films; those of a tile are rows of 32 at most.
    #[test]
    fn every_ray_is_in_one_tile() {
        let grid = |width, height| {
            Film::Grid(
                GridFilm::new(width, height, DVec3::Z, DVec3::X * 1e-3, DVec3::Y * 1e-3).expect("a film"),
            )
        };
        let films = vec![grid(33, 65), Film::Scattered(vec![DVec3::Z; 1025]), grid(1, 1), grid(64, 31)];
        let pencil = Pencil::new(Origin::Point(DVec3::ZERO), films).expect("rays");
        let tiles = tiles(&pencil);
        let mut rays: Vec<u32> = tiles.iter().flat_map(|tile| tile.rays()).collect();
        assert_eq!(rays[..4], [0, 1, 2, 3]);
        assert_eq!(rays[31..34], [31, 33, 34]);
        rays.sort_unstable();
        assert!(rays.into_iter().eq(0..pencil.len() as u32));
        assert_eq!(tiles.len(), 2 * 3 + 2 + 1 + 2);
    }
}
