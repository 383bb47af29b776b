//! The rays of a picture for engines that take single rays or packets: the same as umbel's, rounded once to f32.
//!
//! A grid film has d = F + X·R + Y·U. F + Y·U of each row and X·R of each column are kept in f64; tracers add the two.

use rayon::prelude::*;
use umbel::GridFilm;
use umbel::glam::DVec3;

use crate::answer::Answer;

/// Pixels along the side of a block in which neighbouring rays are traced one after the other.
const BLOCK: usize = 8;

/// The rays of one picture.
#[derive(Debug, Clone)]
pub(crate) struct ViewRays {
    /// The common origin. umbel's is the same: it is an f32 point.
    pub(crate) origin: [f32; 3],
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// X·R of each column, component by component.
    columns: [Vec<f64>; 3],
    /// F + Y·U of each row, component by component.
    rows: [Vec<f64>; 3],
}

/// Some whole rows of the answer, for one task.
#[derive(Debug)]
pub(crate) struct Strip<'a> {
    pub(crate) first_row: usize,
    pub(crate) rows: usize,
    /// Row by row.
    pub(crate) ids: &'a mut [u32],
    /// Row by row.
    pub(crate) ts: &'a mut [f32],
}

impl ViewRays {
    /// The rays of a film from an origin that has f32 coordinates.
    pub(crate) fn new(origin: DVec3, film: &GridFilm) -> Self {
        let [forward, right, up] = film.span();
        let columns = [0, 1, 2].map(|k| (0..film.width()).map(|i| right[k] * film.x(i)).collect());
        let rows = [0, 1, 2].map(|k| (0..film.height()).map(|j| forward[k] + up[k] * film.y(j)).collect());
        let (width, height) = (film.width() as usize, film.height() as usize);
        Self { origin: origin.as_vec3().to_array(), width, height, columns, rows }
    }

    /// The number of rays.
    pub(crate) fn len(&self) -> usize {
        self.width * self.height
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

    /// Lets all threads fill strips of rows.
    pub(crate) fn trace_strips(&self, answer: &mut Answer, rows: usize, trace: impl Fn(Strip<'_>) + Sync) {
        let ids = answer.ids.par_chunks_mut(rows * self.width);
        let ts = answer.ts.par_chunks_mut(rows * self.width);
        ids.zip(ts).enumerate().with_max_len(1).for_each(|(strip, (ids, ts))| {
            trace(Strip { first_row: strip * rows, rows: ids.len() / self.width, ids, ts });
        });
    }

    /// Lets all threads trace single rays, block by block. `hit` gives the id and the distance.
    pub(crate) fn trace_singly(&self, answer: &mut Answer, hit: impl Fn([f32; 3]) -> (u32, f32) + Sync) {
        self.trace_strips(answer, BLOCK, |strip| {
            for left in (0..self.width).step_by(BLOCK) {
                for row in 0..strip.rows {
                    for i in left..self.width.min(left + BLOCK) {
                        let (id, t) = hit(self.direction(i, strip.first_row + row));
                        strip.ids[row * self.width + i] = id;
                        strip.ts[row * self.width + i] = t;
                    }
                }
            }
        });
    }
}
