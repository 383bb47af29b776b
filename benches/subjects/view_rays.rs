//! The rays of a picture for engines that take single rays or packets: the same as umbel's, rounded once to f32.
//!
//! A grid film has d = F + X·R + Y·U. F + Y·U of each row and X·R of each column are kept in f64; tracers add the two.

use rayon::prelude::*;
use umbel::engine::GridFilm;
use umbel::glam::DVec3;

use crate::subjects::answer::Hits;

/// Pixels along the side of a block in which neighbouring rays are traced one after the other.
const BLOCK: usize = 8;

/// The rays from one point through some films.
#[derive(Debug, Clone)]
pub(crate) struct ViewRays {
    /// The common origin. umbel's is the same: it is an f32 point.
    pub(crate) origin: [f32; 3],
    /// In the order of the answer.
    pub(crate) films: Vec<FilmRays>,
}

/// The rays through one film.
#[derive(Debug, Clone)]
pub(crate) struct FilmRays {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// X·R of each column, component by component.
    columns: [Vec<f64>; 3],
    /// F + Y·U of each row, component by component.
    rows: [Vec<f64>; 3],
}

/// Some whole rows of one film, for one task.
#[derive(Debug)]
pub(crate) struct Strip<'a> {
    pub(crate) first_row: usize,
    pub(crate) rows: usize,
    /// Row by row.
    pub(crate) ids: &'a mut [u32],
    /// Row by row.
    pub(crate) ts: &'a mut [f32],
}

impl FilmRays {
    /// The rays of a film.
    fn new(film: &GridFilm) -> Self {
        let [forward, right, up] = film.span();
        let columns = [0, 1, 2].map(|k| (0..film.width()).map(|i| right[k] * film.x(i)).collect());
        let rows = [0, 1, 2].map(|k| (0..film.height()).map(|j| forward[k] + up[k] * film.y(j)).collect());
        Self { width: film.width() as usize, height: film.height() as usize, columns, rows }
    }

    /// The direction through pixel (i, j).
    #[inline]
    pub(crate) fn direction(&self, i: usize, j: usize) -> [f32; 3] {
        [0, 1, 2].map(|k| (self.rows[k][j] + self.columns[k][i]) as f32)
    }

    /// Component k of the directions of row j, from column i on.
    #[inline]
    pub(crate) fn row_component<const N: usize>(&self, k: usize, i: usize, j: usize) -> [f32; N] {
        let row = self.rows[k][j];
        let columns = &self.columns[k][i..i + N];
        std::array::from_fn(|n| (row + columns[n]) as f32)
    }
}

impl ViewRays {
    /// The rays of films from an origin that has f32 coordinates.
    pub(crate) fn new(origin: DVec3, films: &[GridFilm]) -> Self {
        Self { origin: origin.as_vec3().to_array(), films: films.iter().map(FilmRays::new).collect() }
    }

    /// The number of rays.
    pub(crate) fn len(&self) -> usize {
        self.films.iter().map(|film| film.width * film.height).sum()
    }

    /// Lets all threads fill strips of rows, those of all films together.
    pub(crate) fn trace_strips(
        &self,
        answer: &mut Hits,
        rows: usize,
        trace: impl Fn(&FilmRays, Strip<'_>) + Sync,
    ) {
        let (mut ids, mut ts) = (&mut answer.ids[..], &mut answer.ts[..]);
        let mut strips = Vec::new();
        for film in &self.films {
            for first_row in (0..film.height).step_by(rows) {
                let rows = rows.min(film.height - first_row);
                let of_strip = (
                    ids.split_off_mut(..rows * film.width).unwrap_or_default(),
                    ts.split_off_mut(..rows * film.width).unwrap_or_default(),
                );
                strips.push((film, Strip { first_row, rows, ids: of_strip.0, ts: of_strip.1 }));
            }
        }
        strips.into_par_iter().with_max_len(1).for_each(|(film, strip)| trace(film, strip));
    }

    /// Lets all threads trace single rays, block by block. `hit` gives the id and the distance.
    pub(crate) fn trace_singly(&self, answer: &mut Hits, hit: impl Fn([f32; 3]) -> (u32, f32) + Sync) {
        self.trace_strips(answer, BLOCK, |film, strip| {
            for left in (0..film.width).step_by(BLOCK) {
                for row in 0..strip.rows {
                    for i in left..film.width.min(left + BLOCK) {
                        let (id, t) = hit(film.direction(i, strip.first_row + row));
                        strip.ids[row * film.width + i] = id;
                        strip.ts[row * film.width + i] = t;
                    }
                }
            }
        });
    }
}
