//! The walk that opens surfaces on demand until they are ready: the same for all who look for something among them.
//!
//! ```text
//! while there are items, the nearest:
//!     hidden by now: drop it
//!     ready: it is taken, to be diced
//!     else open it: its parts come next, from near to far, but for those that do not enter
//! ```
//!
//! What enters, what is hidden and what becomes of a part that is ready is up to the [`Search`]. An item is opened in
//! one place only, see [`Opener::open`].
//!
//! Based on: Robert Cook, Loren Carpenter and Edwin Catmull, "The Reyes Image Rendering Architecture", 1987.

use std::mem::size_of;

use crate::error::Error;
use crate::geometry::aabb::Aabb;
use crate::rays::frustum::Frustum;
use crate::reyes::dice::detail::Detail;
use crate::reyes::dice::dicer::{Dicer, Piece};
use crate::reyes::dice::grid::GridOrigin;
use crate::reyes::dice::patch::SubPatch;
use crate::reyes::dice::rule::OnDemand;
use crate::stats::Stats;

/// A piece that may matter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item<O> {
    pub(crate) piece: Piece<O>,
    pub(crate) bounds: Aabb,
    /// A lower bound of t on the rays within the box; 0 where there is no film.
    pub(crate) t: f64,
    /// About how large the box looks.
    pub(crate) size: f64,
}

impl<O: Copy> Item<O> {
    /// A piece that nobody has looked at yet.
    pub(crate) fn new<S: OnDemand<Object = O>>(piece: Piece<O>, surfaces: &S, detail: &Detail) -> Self {
        Self { piece, bounds: piece.bounds(surfaces, detail), t: 0.0, size: 0.0 }
    }

    /// The roots of surfaces.
    pub(crate) fn roots<S: OnDemand<Object = O>>(
        surfaces: &S,
        detail: &Detail,
    ) -> impl Iterator<Item = Self> {
        surfaces.roots().into_iter().map(|root| Self::new(Piece::of(root), surfaces, detail))
    }

    /// The item, with its t and its size, unless it lies outside the frustum.
    pub(crate) fn enter(&self, frustum: &Frustum, stats: &mut Stats) -> Option<Self> {
        stats.frustum_tests += 1;
        let Some(t) = frustum.enter(&self.bounds) else {
            stats.surfaces_culled_by_frustum += 1;
            return None;
        };
        let [x, y, z] = self.bounds.extent();
        Some(Self { t, size: if t > 0.0 { (x + y + z) / t } else { f64::INFINITY }, ..*self })
    }
}

/// A part of a patch that is to be diced.
pub(crate) struct Ready<'w, 'a, S: OnDemand> {
    /// Its points are there, once it is diced.
    pub(crate) dicer: &'w mut Dicer<'a, S>,
    pub(crate) item: Item<S::Object>,
    part: SubPatch,
}

impl<S: OnDemand> Ready<'_, '_, S> {
    /// Dices it, and tells where its grid comes from.
    pub(crate) fn dice(&mut self, stats: &mut Stats) -> Result<GridOrigin, Error> {
        let Self { dicer, item, part } = self;
        let bits = dicer.dice(&item.piece.object, part)?;
        stats.surfaces_diced += 1;
        stats.micropolygons += 1_u64 << (bits[0] + bits[1]);
        Ok(GridOrigin { surface: dicer.surfaces.id(&item.piece.object), part: *part, bits })
    }

    /// Refuses a grid with a point that is not finite.
    pub(crate) fn check_points(&self) -> Result<(), Error> {
        self.dicer.check_points(&self.item.piece.object)
    }
}

/// What somebody looks for among surfaces.
pub(crate) trait Search<S: OnDemand> {
    /// The item as it is kept; none if it cannot matter.
    fn enter(&mut self, item: Item<S::Object>, stats: &mut Stats) -> Option<Item<S::Object>>;

    /// Whether an item that has entered does not matter any more.
    fn hides(&mut self, _item: &Item<S::Object>) -> bool {
        false
    }

    /// Dices what is ready, and does with the grid what is to be done.
    fn take(&mut self, ready: Ready<'_, '_, S>, stats: &mut Stats) -> Result<(), Error>;

    /// Whether the walk has to pause.
    fn is_full(&self) -> bool {
        false
    }
}

/// Opens items, with room to work in.
pub(crate) struct Opener<'a, S: OnDemand> {
    pub(crate) dicer: Dicer<'a, S>,
    opened: Vec<Piece<S::Object>>,
}

impl<S: OnDemand> Opener<'_, S> {
    /// Opens an item that is not ready: `each` gets its parts. One that turns out to be ready has none: its piece is
    /// returned.
    #[inline(always)]
    pub(crate) fn open(
        &mut self,
        item: &Item<S::Object>,
        stats: &mut Stats,
        mut each: impl FnMut(Item<S::Object>, &mut Stats),
    ) -> Option<Piece<S::Object>> {
        self.opened.clear();
        let ready = self.dicer.open(&item.piece, &item.bounds, &mut self.opened, stats);
        for piece in &self.opened {
            each(Item::new(*piece, self.dicer.surfaces, &self.dicer.detail), stats);
        }
        ready
    }
}

/// Items that wait to be looked at, the next one last.
pub(crate) struct Walk<'a, S: OnDemand> {
    pub(crate) opener: Opener<'a, S>,
    pub(crate) items: Vec<Item<S::Object>>,
}

impl<'a, S: OnDemand> Walk<'a, S> {
    pub(crate) fn new(dicer: Dicer<'a, S>) -> Self {
        Self { opener: Opener { dicer, opened: Vec::new() }, items: Vec::new() }
    }

    /// Bytes of the buffers.
    pub(crate) fn bytes(&self) -> usize {
        self.opener.dicer.bytes()
            + self.opener.opened.capacity() * size_of::<Piece<S::Object>>()
            + self.items.capacity() * size_of::<Item<S::Object>>()
    }

    /// Begins with items that have entered.
    pub(crate) fn begin_with(&mut self, items: impl IntoIterator<Item = Item<S::Object>>) {
        self.items.clear();
        self.items.extend(items);
        sort_far_first(&mut self.items);
    }

    /// Begins with the roots of the surfaces.
    pub(crate) fn begin(&mut self, search: &mut impl Search<S>, stats: &mut Stats) {
        let Dicer { surfaces, detail, .. } = self.opener.dicer;
        self.begin_with(Item::roots(surfaces, &detail).filter_map(|root| search.enter(root, stats)));
    }

    /// Goes on until nothing is left, or the search is full.
    pub(crate) fn go(&mut self, search: &mut impl Search<S>, stats: &mut Stats) -> Result<(), Error> {
        while !search.is_full()
            && let Some(item) = self.items.pop()
        {
            if search.hides(&item) {
                stats.surfaces_culled_by_depth += 1;
                continue;
            }
            if let Some(part) = item.piece.ready().or_else(|| self.open(&item, search, stats)) {
                search.take(Ready { dicer: &mut self.opener.dicer, item, part }, stats)?;
            }
        }
        Ok(())
    }

    /// Opens everything, one level after the other, until there are some items, or all are ready.
    pub(crate) fn spread(&mut self, count: usize, search: &mut impl Search<S>, stats: &mut Stats) {
        while self.items.len() < count && self.items.iter().any(|item| item.piece.ready().is_none()) {
            for item in std::mem::take(&mut self.items) {
                if item.piece.ready().is_some() {
                    self.items.push(item);
                } else if let Some(part) = self.open(&item, search, stats) {
                    self.items.push(Item { piece: Piece { part: Some(part), ..item.piece }, ..item });
                }
            }
        }
    }

    /// Opens an item: its parts come next. One that is ready as it is has none: its part is returned.
    fn open(
        &mut self,
        item: &Item<S::Object>,
        search: &mut impl Search<S>,
        stats: &mut Stats,
    ) -> Option<SubPatch> {
        let Self { opener, items } = self;
        let first = items.len();
        let ready = opener.open(item, stats, |part, stats| items.extend(search.enter(part, stats)));
        sort_far_first(&mut items[first..]);
        ready.and_then(|piece| piece.ready())
    }
}

/// Sorts so that the nearest is the last.
fn sort_far_first<O>(items: &mut [Item<O>]) {
    items.sort_unstable_by(|one, other| other.t.total_cmp(&one.t));
}
