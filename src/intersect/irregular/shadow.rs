//! Exact shadows: receivers in the order of a curve as their light sees them, tile by tile.
//!
//! Receivers are ordered, see [`crate::intersect::irregular::order`], and those that follow each other are a
//! [`LitTile`]: on each face that they are seen on, all triangles are tested with them.
//!
//! Based on: Gregory Johnson et al., "The Irregular Z-Buffer", 2005.

use std::mem::size_of;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use crate::intersect::context::Context;
use crate::intersect::irregular::face_points::TILE_POINTS;
use crate::intersect::irregular::order::LightGrid;
use crate::intersect::irregular::tile::{Lit, LitTile, block, note};
use crate::objects::morton::{along_curve, bytes_for};
use crate::objects::runs::Runs;
use crate::rays::origin::Origin;
use crate::rays::receiver::Receiver;
use crate::stats::Stats;

/// Finds which receivers a light does not see.
pub(crate) fn shadowed<'a>(
    context: Context<'a>,
    light: Origin,
    receivers: &'a [Receiver],
    runs: &'a Runs,
) -> (Vec<bool>, Stats) {
    let lit = Lit { light, receivers, level: context.level };
    let order = along_curve(&LightGrid::new(light, receivers), receivers.len(), context.level);
    let shadowed: Vec<AtomicBool> = (0..receivers.len()).map(|_| AtomicBool::new(false)).collect();
    let of_tile = |tile: &mut LitTile<'a>, ids: &[u32]| {
        tile.see(lit, ids).fold(Stats::default(), |stats, face| {
            let Some(film) = tile.turn_to(lit, ids, face) else {
                return stats.plus(lit.one_by_one(context.triangles, &tile.here(ids), &shadowed));
            };
            let stats = stats.plus(block(context, runs, &film, &mut tile.work));
            note(&tile.work, &shadowed);
            stats
        })
    };
    let mut stats =
        order.par_chunks(TILE_POINTS).map_init(LitTile::new, of_tile).reduce(Stats::default, Stats::plus);
    let threads = rayon::current_num_threads() * LitTile::BYTES;
    let bytes = runs.bytes() + threads + order.capacity() * size_of::<u32>() + stats.engine_bytes as usize;
    stats.engine_bytes =
        bytes.max(runs.ordering_bytes()).max(runs.bytes() + bytes_for(receivers.len())) as u64;
    (shadowed.into_iter().map(AtomicBool::into_inner).collect(), stats)
}
