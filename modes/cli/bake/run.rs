//! Baking what was planned, piece by piece.

use umbel::bake::{Bake, BakeOccluders};
use umbel::{Error, Frame};

use crate::bake::source::{Results, Source};
use crate::common::Common;
use crate::report::{Times, timed};
use crate::run::progress;

/// Bakes piece by piece, as often as the options say.
pub(crate) fn run<'a>(
    bake: &Bake,
    (source, occluders): (&Source<'_>, impl Into<BakeOccluders<'a>>),
    (piece, with_bent): (usize, bool),
    common: &Common,
    times: &mut Times,
) -> Result<Results, Error> {
    let (options, occluders) = (common.options(), occluders.into());
    let count = source.units();
    let what = if matches!(source, Source::Texels(..)) { "rows" } else { source.name() };
    let progress = progress(u32::try_from(count).unwrap_or(u32::MAX), what, common);
    let (mut frame, mut found) = (Frame::keeping_order(), Results::new(source, with_bent));
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
            found.take(&receivers, &texels, baked);
            progress.set_position(end as u64);
        }
        if repeat == 0 {
            times.receivers += receivers_milliseconds;
        }
        times.engine.push(milliseconds);
    }
    progress.finish_and_clear();
    Ok(found)
}
