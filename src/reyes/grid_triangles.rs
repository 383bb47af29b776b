//! Micropolygons that wait until there are enough of them to be tested as triangles.
//!
//! Quadrilaterals of a grid come block by block, so that the triangles of each are a run, see [`crate::objects::runs`].

use crate::error::Error;
use crate::reyes::dice::grid::GridOrigin;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::walk::Ready;
use crate::stats::Stats;

/// Quadrilaterals of a block.
const BLOCK: [usize; 2] = [4, 2];

/// Triangles of some grids.
#[derive(Debug, Default)]
pub(crate) struct GridTriangles {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) indices: Vec<[u32; 3]>,
}

impl GridTriangles {
    /// Bytes of the buffers.
    pub(crate) fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<[f32; 3]>() + self.indices.capacity() * size_of::<[u32; 3]>()
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.positions.clear();
        self.indices.clear();
    }

    /// Dices a part of a patch, and takes its triangles.
    pub(crate) fn dice<S: OnDemand>(
        &mut self,
        mut ready: Ready<'_, '_, S>,
        stats: &mut Stats,
    ) -> Result<(), Error> {
        let grid = ready.dice(stats)?;
        ready.check_points()?;
        self.push(&ready.dicer.points, &grid);
        Ok(())
    }

    /// Adds the triangles of a grid, but for those without area, block by block.
    fn push(&mut self, points: &[[f32; 3]], grid: &GridOrigin) {
        // In range: few grids wait.
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(points);
        let [across, along] = grid.bits.map(|bits| 1_usize << bits);
        let blocks =
            (0..along).step_by(BLOCK[1]).flat_map(|v| (0..across).step_by(BLOCK[0]).map(move |u| (u, v)));
        for (u0, v0) in blocks {
            for v in v0..along.min(v0 + BLOCK[1]) {
                for u in u0..across.min(u0 + BLOCK[0]) {
                    let first = v * (across + 1) + u;
                    for corners in [false, true].map(|second| grid.corners((first, second))) {
                        let [a, b, c] = corners.map(|corner| points[corner]);
                        if a != b && b != c && c != a {
                            self.indices.push(corners.map(|corner| base + corner as u32));
                        }
                    }
                }
            }
        }
    }
}
