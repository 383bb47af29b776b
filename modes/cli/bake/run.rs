//! Baking what was planned, piece by piece.

use umbel::bake::{Bake, BakeOccluders};
use umbel::{Error, Frame};

use crate::bake::source::{Results, Source};
use crate::common::Common;
use crate::report::{Times, timed};
use crate::run::progress;

/// Receivers of a piece that are looked at for other surfaces near them.
const MOST_LOOKED_AT: usize = 1 << 14;

/// How a bake is cut, and what is kept of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pieces {
    /// Units of a piece.
    pub(crate) piece: usize,
    /// Whether bent normals are kept.
    pub(crate) with_bent: bool,
    /// Receivers nearer than this to another surface are counted or, where there are very many, estimated.
    pub(crate) near: Option<f64>,
}

/// Bakes piece by piece, as often as the options say.
pub(crate) fn run<'a>(
    bake: &Bake,
    (source, occluders): (&Source<'_>, impl Into<BakeOccluders<'a>>),
    &Pieces { piece, with_bent, near }: &Pieces,
    common: &Common,
    times: &mut Times,
) -> Result<Results, Error> {
    let (options, occluders) = (common.options(), occluders.into());
    let count = source.units();
    let what = if matches!(source, Source::Texels(..)) { "rows" } else { source.name() };
    let progress = progress(u32::try_from(count).unwrap_or(u32::MAX), what, common);
    let (mut frame, mut found) = (Frame::keeping_order(), Results::new(source, with_bent));
    let mut near_count = 0;
    for repeat in 0..common.repeat {
        if !common.keep_order {
            frame = Frame::keeping_order();
        }
        if repeat > 0 {
            found = Results::new(source, with_bent);
        }
        let (mut milliseconds, mut receivers_milliseconds) = (0.0, 0.0);
        for first in (0..count).step_by(piece) {
            let end = count.min(first + piece);
            let (receivers, texels) = timed(&mut receivers_milliseconds, || source.piece(first, end));
            let baked = timed(&mut milliseconds, || bake.run(occluders, &receivers, &mut frame, &options))?;
            if let (0, Some(distance)) = (repeat, near) {
                near_count += timed(&mut times.check, || {
                    // Of many receivers some stand for all.
                    let step = receivers.len().div_ceil(MOST_LOOKED_AT).max(1);
                    let some = receivers.picked(&(0..receivers.len()).step_by(step).collect::<Vec<_>>());
                    let near =
                        occluders.receivers_near_triangles(&some, distance, &mut Frame::new(), &options);
                    near.map(|near| near * step as u64)
                })?;
            }
            found.take(&receivers, &texels, baked);
            progress.set_position(end as u64);
        }
        if repeat == 0 {
            times.receivers += receivers_milliseconds;
        }
        times.engine.push(milliseconds);
    }
    progress.finish_and_clear();
    found.near = near_count;
    Ok(found)
}
