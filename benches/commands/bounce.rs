//! `umbel-bench bounce`: what do diffuse-bounce rays hit, which share nothing? By all engines in turns, and for more and more
//! rays: from how many on does a stored tree pay?

use crate::Result;
use crate::commands::cli::{BounceArgs, Common};
use crate::commands::{comparison, crossover};
use crate::subjects::bounce::Bounce;

/// Measures every scene with every number of rays.
pub(crate) fn run(args: &BounceArgs, common: &Common) -> Result<()> {
    let mut counts = args.rays.clone();
    counts.sort_unstable();
    counts.dedup();
    let mut compared = comparison::measure("bounce", &args.compared, common, &counts, |view, rays| {
        Bounce::new(view, rays, args.seed, args.shuffled)
    })?;
    let growths = crossover::growths(&compared.rows);
    if counts.len() > 1 {
        crossover::print(&growths);
        compared.head["crossovers"] = crossover::report(&growths);
    }
    compared.write(args.compared.json.as_deref())?;
    args.compared.plot.as_deref().map_or(Ok(()), |path| crossover::plot(path, &growths))
}
