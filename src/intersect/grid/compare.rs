//! Finds what two triangles are to each other along all rays of a tile, see [`crate::intersect::grid::relations`]:
//!
//! - the same corners, in whatever order, or one plane: the same t along every ray;
//! - planes across the same axis: the one with the nearer coordinate is nearer everywhere;
//! - keys are affine: where their difference exceeds its errors at the four corners of the tile, with one sign, it does so on
//!   all of it;
//! - else each ray asks; after some have, an affine function tells the order: see [`crate::exact::planes`]. To ask every ray took 19 times as
//!   long as where nothing coincides (two layers of other tessellations), with the function it is 2.5. To make it for every pair at once took
//!   1.4 to 1.7 times as long for a city of blocks, of whose neighbours few rays ask.

use glam::DVec3;

use crate::exact::distance::{across, same_corners};
use crate::exact::filter::Sign;
use crate::exact::planes::Order;
use crate::exact::predicates::coplanar;
use crate::geometry::triangles::Triangle;
use crate::intersect::grid::depth::{KEY_ERROR, Record, TileDepth};
use crate::intersect::grid::relations::Relation;
use crate::intersect::pencil::leaf::Tile;
use crate::intersect::pencil::rect::TILE_SIDE;
use crate::rays::origin::Origin;
use crate::simd::lanes::LANES;
use crate::stats::Stats;

/// Evaluating a key and taking a difference: a few roundings, as a part of the keys.
const DIFFERENCE_ERROR: f64 = 4.0 * f64::EPSILON;

/// Rays of a pair that are decided one by one: a function for all takes about as long as some of these.
const ORDER_PAYS: u32 = 4;

impl Tile<'_, TileDepth> {
    /// Where a triangle, set up in a lane, lies to that of a record, of which so many rays want to know it.
    #[inline]
    pub(crate) fn relation(
        &mut self,
        (id, lane): (u32, usize),
        (record, rays): (u32, u32),
        stats: &mut Stats,
    ) -> Relation {
        let pair = [id, self.work.depth.records[record as usize].id];
        let relation = match self.work.depth.relations.recall(pair) {
            Some(Relation::Asked(asked)) => self.find_order(pair, asked + rays),
            Some(relation) => relation,
            None => self.find_relation((id, lane), (record, rays), stats),
        };
        self.work.depth.relations.note(relation);
        relation
    }

    /// The order of two triangles as a function of the ray, if enough rays have asked; remembered.
    #[inline(never)]
    fn find_order(&mut self, pair: [u32; 2], asked: u32) -> Relation {
        let order = if asked < ORDER_PAYS { None } else { self.order(pair) };
        let relation = match order {
            Some(order) if order.is_zero() => Relation::Equal,
            Some(order) => self.work.depth.relations.remember_order(pair, order),
            None => Relation::Asked(asked),
        };
        self.work.depth.relations.remember(pair, relation);
        relation
    }

    fn order(&self, pair: [u32; 2]) -> Option<Order> {
        let [one, other] = pair.map(|id| self.query.context.triangles.triangle(id));
        match self.query.view.origin {
            Origin::Point(o) => Order::from_point(o, &one, &other),
            Origin::Infinity(d) => Order::along(d, self.first_ray(), &one, &other),
        }
    }

    /// The direction or start point of the tile's first ray.
    fn first_ray(&self) -> DVec3 {
        self.query.view.film.at(self.rect.x0, self.rect.y0)
    }

    /// The sign of an order, given its number, at a ray of the tile, or at the last one where there is none.
    #[inline]
    pub(crate) fn order_at(&self, number: u8, [x, y]: [u32; 2]) -> Option<Sign> {
        let [x, y] = [(self.rect.x0 + x).min(self.rect.x1 - 1), (self.rect.y0 + y).min(self.rect.y1 - 1)];
        self.work.depth.relations.order(number).at(self.query.view.film.at(x, y))
    }

    /// The same, not known yet.
    #[inline(never)]
    fn find_relation(
        &mut self,
        (id, lane): (u32, usize),
        (record, rays): (u32, u32),
        stats: &mut Stats,
    ) -> Relation {
        let record = self.work.depth.records[record as usize];
        let [c, x, y, error] = self.work.setups.key.each_ref().map(|part| part[lane % LANES]);
        let pair = [id, record.id].map(|id| self.query.context.triangles.triangle(id));
        let relation = if same_corners(&pair[0], &pair[1]) {
            self.work.depth.twins.see();
            Relation::Equal
        } else if let Some(relation) = compare_keys(([c, x, y], error), &record) {
            relation
        } else {
            stats.ambiguous_order += 1;
            match compare_planes(self.query.view.origin, &pair) {
                Relation::Asked(_) => return self.find_order([id, record.id], rays),
                relation => relation,
            }
        };
        self.work.depth.relations.remember([id, record.id], relation);
        relation
    }
}

/// By the keys at the corners of the tile, as far as f64 can tell.
fn compare_keys(([c, x, y], error): ([f64; 3], f64), record: &Record) -> Option<Relation> {
    let last = f64::from(TILE_SIDE - 1);
    let (mut nearer, mut farther) = (true, true);
    for [column, row] in [[0.0, 0.0], [last, 0.0], [0.0, last], [last, last]] {
        let [other_c, other_x, other_y] = record.key;
        let (key, other) = (c + x * column + y * row, other_c + other_x * column + other_y * row);
        let error =
            error + f64::from(record.least) * KEY_ERROR + (key.abs() + other.abs()) * DIFFERENCE_ERROR;
        nearer &= key - other > error;
        farther &= key - other < -error;
    }
    match (nearer, farther) {
        (true, _) => Some(Relation::Nearer),
        (_, true) => Some(Relation::Farther),
        _ => None,
    }
}

/// By the planes, exactly.
fn compare_planes(origin: Origin, [one, other]: &[Triangle; 2]) -> Relation {
    if let Some(k) = across(one)
        && across(other) == Some(k)
    {
        // Hits lie ahead, so rays go from the origin toward both planes.
        let up = match origin {
            Origin::Point(o) => one.a[k] > o[k],
            Origin::Infinity(d) => d[k] > 0.0,
        };
        return match Sign::of(one.a[k] - other.a[k]) {
            Sign::Zero => Relation::Equal,
            sign if (sign == Sign::Negative) == up => Relation::Nearer,
            _ => Relation::Farther,
        };
    }
    if coplanar(one, other) { Relation::Equal } else { Relation::Asked(0) }
}
