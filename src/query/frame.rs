//! What survives from one frame to the next: memory, and on request the order of the triangles.
//!
//! A [`Frame`] that is used again writes into the hits of the frame before: no pages to fault in. One that keeps the
//! order also spares the next frame the sorting; everything else is done from scratch, so triangles may move as they
//! like. An order that has grown stale costs time, never a hit.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data
//! Structure", 2011 (a permutation is all that remains).

use crate::error::Error;
use crate::geometry::triangles::Triangles;
use crate::options::Options;
use crate::query::path;
use crate::query::path::Kept;
use crate::rays::hemisphere::{Occlusion, OpenRays};
use crate::rays::hits::Hits;
use crate::rays::origin::Origin;
use crate::rays::pencil::Rays;
use crate::rays::receiver::Receiver;
use crate::stats::{Stats, TileStats};

/// Hits, and what the next query may use again.
///
/// ```
/// # use umbel_core::{Film, Frame, GridFilm, Options, Origin, Pencil, Triangles, glam::DVec3};
/// # let film = GridFilm::new(4, 4, DVec3::NEG_Z, DVec3::X / 4.0, DVec3::Y / 4.0)?;
/// # let pencil = Pencil::new(Origin::Point(DVec3::ZERO), vec![Film::Grid(film)])?;
/// # let mut positions = [[-9.0, -9.0, -1.0], [9.0, -9.0, -1.0], [0.0, 9.0, -1.0]];
/// let mut frame = Frame::keeping_order();
/// for _ in 0..3 {
///     positions[2][1] += 0.5;
///     let triangles = Triangles::new(&positions, &[[0, 1, 2]])?;
///     frame.closest_hit(&triangles, &pencil, &Options::default())?;
///     assert!(frame.hits().get(5).is_some());
/// }
/// # Ok::<(), umbel_core::Error>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Frame {
    kept: Kept,
    keeps_order: bool,
}

impl Frame {
    /// An empty frame that keeps memory only.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty frame that keeps the order of the triangles as well.
    #[must_use]
    pub fn keeping_order() -> Self {
        Self { keeps_order: true, ..Self::default() }
    }

    /// Counts the pairs of each ray from now on: see [`Frame::pairs`]. Changes no hit. 4 bytes per ray, and a little
    /// time where rays go in bundles.
    #[must_use]
    pub fn counting_pairs(self) -> Self {
        Self { kept: Kept { counts_pairs: true, ..self.kept }, ..self }
    }

    /// Finds the nearest triangle along each ray, as [`crate::query::closest_hit`] does, into this frame.
    ///
    /// # Errors
    /// As [`crate::query::closest_hit`].
    pub fn closest_hit<'a>(
        &mut self,
        triangles: &Triangles<'_>,
        rays: impl Into<Rays<'a>>,
        options: &Options,
    ) -> Result<Stats, Error> {
        if !self.keeps_order {
            self.kept.order = None;
        }
        path::hits(triangles, rays.into(), options, false, &mut self.kept)
    }

    /// Finds which receivers a light does not see, as [`crate::query::shadowed`] does. The hits of this frame stay what
    /// they are.
    ///
    /// # Errors
    /// As [`crate::query::shadowed`].
    pub fn shadowed(
        &mut self,
        triangles: &Triangles<'_>,
        light: Origin,
        receivers: &[Receiver],
        options: &Options,
    ) -> Result<(Vec<bool>, Stats), Error> {
        if !self.keeps_order {
            self.kept.order = None;
        }
        path::shadowed(triangles, (light, receivers), options, &mut self.kept)
    }

    /// Finds which rays of receivers are open, as [`crate::query::open_rays`] does. The hits of this frame stay what
    /// they are.
    ///
    /// # Errors
    /// As [`crate::query::open_rays`].
    pub fn open_rays(
        &mut self,
        triangles: &Triangles<'_>,
        occlusion: &Occlusion<'_>,
        options: &Options,
    ) -> Result<(OpenRays, Stats), Error> {
        if !self.keeps_order {
            self.kept.order = None;
        }
        path::open_rays(triangles, occlusion, options)
    }

    /// The hits of the last query.
    #[must_use]
    pub fn hits(&self) -> &Hits {
        &self.kept.hits
    }

    /// What each tile of a pencil's film cost in the last query; nothing, where it was no pencil or took the general
    /// path.
    #[must_use]
    pub fn tiles(&self) -> &[TileStats] {
        &self.kept.tiles
    }

    /// The pairs of each ray with a triangle whose edge functions were evaluated in the last query: the sum is
    /// [`Stats::samples_tested`]. Empty unless this frame counts them.
    ///
    /// A pencil counts those of scattered rays. Rays of its grid films are evaluated together, tile by tile: they have
    /// 0 here, and their tiles have [`TileStats::samples_per_ray`]. Where all films are grids this is empty. What a ray
    /// is tested with depends on the rays around it and on the path.
    ///
    /// ```
    /// # use umbel_core::{Frame, Options, Ray, Triangles, glam::DVec3};
    /// # let positions = [[-9.0, -9.0, -1.0], [9.0, -9.0, -1.0], [0.0, 9.0, -1.0]];
    /// let triangles = Triangles::new(&positions, &[[0, 1, 2]])?;
    /// let rays = [DVec3::NEG_Z, DVec3::Z].map(|direction| Ray::new(DVec3::ZERO, direction));
    /// let mut frame = Frame::new().counting_pairs();
    /// frame.closest_hit(&triangles, &rays[..], &Options::default())?;
    /// assert!(frame.pairs()[0] > 0 && frame.pairs()[1] == 0);
    /// # Ok::<(), umbel_core::Error>(())
    /// ```
    #[must_use]
    pub fn pairs(&self) -> &[u32] {
        &self.kept.pairs
    }

    /// The pairs of each ray, to keep.
    pub(crate) fn into_pairs(self) -> Vec<u32> {
        self.kept.pairs
    }

    /// The hits of the last query, to keep.
    #[must_use]
    pub fn into_hits(self) -> Hits {
        self.kept.hits
    }
}
