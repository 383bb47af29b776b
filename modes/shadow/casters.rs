//! What casts shadows: triangles, and surfaces on demand.
//!
//! Surfaces are diced as the view asks that receivers were seen by, so what is seen and what casts the shadow are the same
//! micropolygons, see [`umbel_core::shadowed_on_demand`].

use umbel_core::{Dicing, Frame, Options, Origin, Pencil, Receiver, Stats, Triangles, shadowed_on_demand};

use crate::error::Error;
use crate::surfaces::Surfaces;

/// What stands between lights and receivers.
#[derive(Debug, Clone, Copy)]
pub struct Casters<'a> {
    /// Triangles, by which receivers name the ones that they lie on.
    pub triangles: &'a Triangles<'a>,
    /// Surfaces on demand, and how finely they are diced.
    pub surfaces: &'a [&'a Surfaces],
    /// How finely.
    pub dicing: Dicing,
}

impl Casters<'_> {
    /// Which receivers a light does not see. `view` has the rays that have found them.
    ///
    /// # Errors
    /// When the engine refuses a light or a receiver, or the view's rays lie on no grid and there are surfaces on demand.
    pub fn shadowed(
        &self,
        view: &Pencil,
        (light, receivers): (Origin, &[Receiver]),
        frame: &mut Frame,
        options: &Options,
    ) -> Result<(Vec<bool>, Stats), Error> {
        let (mut shadowed, mut stats) = frame.shadowed(self.triangles, light, receivers, options)?;
        for surfaces in self.surfaces {
            let open: Vec<usize> = (0..receivers.len()).filter(|&place| !shadowed[place]).collect();
            let left: Vec<Receiver> = open.iter().map(|&place| receivers[place]).collect();
            let (found, more) = shadowed_on_demand(*surfaces, (view, &self.dicing), light, &left, options)?;
            open.into_iter().zip(found).for_each(|(place, found)| shadowed[place] = found);
            stats = stats.then(more);
        }
        Ok((shadowed, stats))
    }
}
