//! Surfaces on demand as triangles: all that a pencil's density asks for, nothing culled.
//!
//! For tests, and as input of other engines. The recursion makes the same triangles where they matter only, see
//! [`crate::reyes::closest`].

use fearless_simd::{Level, dispatch, prelude::*};
use rayon::prelude::*;

use crate::error::Error;
use crate::geometry::triangles::Triangles;
use crate::options::Options;
use crate::query::call::{check_call, in_pool};
use crate::query::frame::Frame;
use crate::rays::hits::Hits;
use crate::rays::hits::NO_TRIANGLE;
use crate::rays::pencil::Pencil;
use crate::reyes::dice::density::Density;
use crate::reyes::dice::dicer::Dicer;
use crate::reyes::dice::dicing::Dicing;
use crate::reyes::dice::grid::GridOrigin;
use crate::reyes::dice::rule::OnDemand;
use crate::reyes::sample::hits::{SurfaceHits, SurfaceRow};
use crate::reyes::sample::micropolygon::Micropolygon;
use crate::reyes::sample::resolve::Seen;
use crate::reyes::walk::{Item, Ready, Search, Walk};
use crate::simd::lanes::{LANES, Lanes, Points};
use crate::stats::Stats;

/// Pieces that are diced side by side, if there are as many.
const PIECES: usize = 256;

/// The triangles that a pencil's density asks for: those without area are left out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DicedTriangles {
    positions: Vec<[f32; 3]>,
    parameters: Vec<[f64; 2]>,
    indices: Vec<[u32; 3]>,
    surfaces: Vec<u32>,
}

impl DicedTriangles {
    /// Positions, grid by grid.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// (u, v) of each position.
    #[must_use]
    pub fn parameters(&self) -> &[[f64; 2]] {
        &self.parameters
    }

    /// The corners of each triangle. They come in the order of their surfaces' ids, then of their corners' coordinates:
    /// of triangles at the same distance the first is the one that is seen.
    #[must_use]
    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    /// The id of each triangle's surface.
    #[must_use]
    pub fn surfaces(&self) -> &[u32] {
        &self.surfaces
    }

    /// The triangle at an index.
    fn micropolygon(&self, index: usize) -> Micropolygon {
        let corners = self.indices[index].map(|v| v as usize);
        Micropolygon {
            surface: self.surfaces[index],
            corners: corners.map(|v| self.positions[v]),
            parameters: corners.map(|v| self.parameters[v]),
        }
    }

    /// Appends a grid that was diced.
    fn push<S: OnDemand>(&mut self, dicer: &Dicer<'_, S>, grid: GridOrigin) -> Result<(), Error> {
        let too_many = |_| Error::TooManyTriangles { triangles: self.positions.len() + dicer.points.len() };
        let base = u32::try_from(self.positions.len() + dicer.points.len()).map_err(too_many)?;
        let base = base - dicer.points.len() as u32;
        let [across, along] = grid.bits.map(|bits| 1_usize << bits);
        for quad in 0..across * along {
            let first = quad / across * (across + 1) + quad % across;
            for second in [false, true] {
                let corners = grid.corners((first, second));
                let [a, b, c] = corners.map(|corner| dicer.points[corner]);
                if a != b && b != c && c != a {
                    self.indices.push(corners.map(|corner| base + corner as u32));
                    self.surfaces.push(grid.surface);
                }
            }
        }
        self.positions.extend_from_slice(&dicer.points);
        self.parameters.extend_from_slice(&dicer.parameters);
        Ok(())
    }

    /// Appends other triangles.
    fn append(&mut self, other: &Self) -> Result<(), Error> {
        let total = self.positions.len() + other.positions.len();
        let too_many = |_| Error::TooManyTriangles { triangles: total };
        let base = u32::try_from(total).map_err(too_many)? - other.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.parameters.extend_from_slice(&other.parameters);
        self.indices.extend(other.indices.iter().map(|corners| corners.map(|v| base + v)));
        self.surfaces.extend_from_slice(&other.surfaces);
        Ok(())
    }

    /// Brings the triangles into their order.
    fn sort(&mut self) {
        // In range: there are fewer positions than 2³², and at most two triangles for each; more were refused.
        let mut order: Vec<u32> = (0..self.indices.len() as u32).collect();
        order.par_sort_unstable_by(|&one, &other| {
            self.micropolygon(one as usize).order(&self.micropolygon(other as usize))
        });
        self.indices = order.iter().map(|&triangle| self.indices[triangle as usize]).collect();
        self.surfaces = order.iter().map(|&triangle| self.surfaces[triangle as usize]).collect();
    }
}

/// Dices surfaces as a pencil's density asks, all of them: hidden ones, and those that no ray comes near. Memory grows
/// with the number of micropolygons: about 70 bytes each.
///
/// # Errors
/// When a film is scattered, the shading rate is out of range, a surface gives points that are not finite, or there are
/// more than 2³² − 2 points or triangles.
pub fn dice_all<S: OnDemand>(
    surfaces: &S,
    pencil: &Pencil,
    dicing: &Dicing,
) -> Result<DicedTriangles, Error> {
    dicing.check()?;
    let density = Density::new(pencil, Level::new())?;
    if pencil.is_empty() {
        return Ok(DicedTriangles::default());
    }
    in_pool(|| {
        let mut diced = dice_pieces(surfaces, &density, dicing)?;
        if diced.indices.len() >= NO_TRIANGLE as usize {
            return Err(Error::TooManyTriangles { triangles: diced.indices.len() });
        }
        diced.sort();
        Ok(diced)
    })?
}

/// Dices everything, in parallel.
fn dice_pieces<S: OnDemand>(
    surfaces: &S,
    density: &Density,
    dicing: &Dicing,
) -> Result<DicedTriangles, Error> {
    let mut walk = Walk::new(Dicer::new(surfaces, density, dicing));
    let (mut all, mut stats) = (DicedTriangles::default(), Stats::default());
    walk.begin(&mut all, &mut stats);
    // Until there is enough to do side by side.
    walk.spread(PIECES, &mut all, &mut stats);
    for some in walk.items.chunks(PIECES) {
        let parts: Vec<DicedTriangles> = some
            .par_iter()
            .map(|item| {
                let mut walk = Walk::new(Dicer::new(surfaces, density, dicing));
                let mut part = DicedTriangles::default();
                walk.begin_with([*item]);
                walk.go(&mut part, &mut Stats::default())?;
                Ok(part)
            })
            .collect::<Result<_, _>>()?;
        parts.iter().try_for_each(|part| all.append(part))?;
    }
    Ok(all)
}

/// Everything is looked for, wherever it is.
impl<S: OnDemand> Search<S> for DicedTriangles {
    fn enter(&mut self, item: Item<S::Object>, _stats: &mut Stats) -> Option<Item<S::Object>> {
        Some(item)
    }

    fn take(&mut self, mut ready: Ready<'_, '_, S>, stats: &mut Stats) -> Result<(), Error> {
        let grid = ready.dice(stats)?;
        ready.check_points()?;
        self.push(ready.dicer, grid)
    }
}

/// What the rays see of all triangles, made beforehand: the reference for the recursion.
pub(crate) fn see_all<S: OnDemand>(
    surfaces: &S,
    pencil: &Pencil,
    dicing: &Dicing,
    options: &Options,
    seen: &mut SurfaceHits,
) -> Result<Stats, Error> {
    let diced = dice_all(surfaces, pencil, dicing)?;
    let triangles = Triangles::new(&diced.positions, &diced.indices)?;
    let mut frame = Frame::new().counting_pairs();
    let mut stats = frame.closest_hit(&triangles, pencil, options)?;
    let level = check_call(pencil.len(), options)?;
    let mut row = seen.row();
    for first in (0..pencil.len()).step_by(LANES) {
        dispatch!(level, simd => {
            see_eight(simd, (&diced, frame.hits()), pencil, first, &mut row, &mut stats)
        });
    }
    seen.pairs = frame.into_pairs();
    Ok(stats)
}

/// Writes what eight rays from one on see, or as many as there are.
#[inline(always)]
fn see_eight<S: Simd>(
    simd: S,
    (diced, hits): (&DicedTriangles, &Hits),
    pencil: &Pencil,
    first: usize,
    row: &mut SurfaceRow<'_>,
    stats: &mut Stats,
) {
    let (mut seen, mut ids, mut hit) = (Seen::NOTHING, [0; LANES], 0);
    let (mut origins, mut directions) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    let lanes = LANES.min(pencil.len() - first);
    for lane in 0..lanes {
        let Some(found) = hits.get(first + lane) else { continue };
        let Micropolygon { surface, corners, parameters } = diced.micropolygon(found.id.0 as usize);
        let ray = pencil.ray(first + lane);
        for k in 0..3 {
            (origins[k][lane], directions[k][lane]) = (ray.origin[k], ray.direction[k]);
        }
        seen.set(lane, corners, parameters);
        (ids[lane], hit) = (surface, hit | 1 << lane);
    }
    row.miss_some(first, !hit & (u64::MAX >> (u64::BITS as usize - lanes)));
    let rays = [origins, directions].map(|[x, y, z]| Points {
        x: Lanes::load_array(simd, x),
        y: Lanes::load_array(simd, y),
        z: Lanes::load_array(simd, z),
    });
    let resolved = seen.along(simd, rays, hit, |lane| pencil.ray(first + lane), stats);
    row.put(first, hit, (&ids, &seen), &resolved);
}
