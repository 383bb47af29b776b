//! Ways of estimating openness with so many rays, each timed: Embree and umbel, with the sets of directions that they suit.
//!
//! Openness is the share of the hemisphere that is open, weighted by the cosine. Random rays are drawn in proportion to the
//! cosine and count alike; rays of sets that cover the sphere evenly are weighted by it. umbel's estimates are what `umbel
//! bake` computes.

use umbel::bake::{Bake, BakeOptions, BakeReceivers, Reach, SampleSet};
use umbel::engine::Grouping;
use umbel::glam::DVec3;
use umbel::{Frame, Options, Scene, TriangleId, Triangles};

use crate::Result;
use crate::commands::error::reference::shares;
use crate::engines::Engines;
use crate::engines::engine::{Times, timed};
use crate::subjects::Model;
use crate::subjects::Subject;
#[cfg(feature = "embree")]
use crate::subjects::ambient::Ambient;
use crate::subjects::ambient::{MaxDistance, interval};
use crate::subjects::surface_points::{ReceiverSet, hemispheres};

/// umbel's estimates.
const UMBEL: [(&str, SampleSet); 3] = [
    ("umbel-shared", SampleSet::Shared),
    ("umbel-interleaved", SampleSet::Interleaved),
    ("umbel-independent", SampleSet::Independent),
];

/// Embree's with directions that all receivers share, receiver by receiver and direction by direction.
#[cfg(feature = "embree")]
const EMBREE_SHARED: [&str; 2] = ["embree-shared-receivers", "embree-shared-directions"];

/// Embree's with random directions.
#[cfg(feature = "embree")]
const EMBREE_RANDOM: &str = "embree-random";

/// A scene's receivers, whatever their rays are.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) model: Model,
    pub(crate) set: ReceiverSet,
    /// With the normals of their triangles, and numbered as they were before they were put in order.
    pub(crate) receivers: BakeReceivers,
    /// Where rays begin, but umbel's, and where they end.
    pub(crate) interval: [f32; 2],
}

/// Computes the openness of all receivers and takes the time.
pub(crate) type Run<'a> = Box<dyn FnMut() -> Result<(Times, Vec<f32>)> + 'a>;

/// A way of estimating, and its name.
pub(crate) type Estimate<'a> = (&'static str, Run<'a>);

impl Surface {
    /// The receivers of a scene, along Morton's curve.
    pub(crate) fn new(
        name: &str,
        scene: &Scene,
        set: ReceiverSet,
        max_distance: Option<MaxDistance>,
    ) -> Result<Self> {
        let model = Model::new(name, scene);
        let triangles = Triangles::new(&model.positions, &model.triangles)?;
        let unordered = hemispheres(&model, &triangles, set);
        let points: Vec<[f32; 3]> = unordered.iter().map(|hemisphere| hemisphere.receiver.point).collect();
        let order = crate::subjects::morton::order(&points);
        let mut receivers = BakeReceivers::default();
        for &k in &order {
            let hemisphere = unordered[k as usize];
            receivers.push(hemisphere, normal(&triangles, hemisphere.receiver.triangle), k);
        }
        Ok(Self { model, set, receivers, interval: interval(scene, max_distance) })
    }

    /// All ways that are wanted by their names, with so many rays per receiver.
    #[cfg_attr(not(feature = "embree"), expect(unused_variables, reason = "umbel is alone"))]
    pub(crate) fn estimates<'a>(
        &'a self,
        engines: &Engines,
        (rays, grouping): (u32, Grouping),
        wanted: &dyn Fn(&str) -> bool,
    ) -> Result<Vec<Estimate<'a>>> {
        let mut all: Vec<Estimate<'a>> = Vec::new();
        for (name, set) in UMBEL.into_iter().filter(|(name, _)| wanted(name)) {
            all.push((name, self.baked((rays, grouping), set)?));
        }
        #[cfg(feature = "embree")]
        if let Some(device) = &engines.embree {
            let names = ["embree-medium-16-receivers", "embree-medium-16-directions"];
            for (name, shown) in names.into_iter().zip(EMBREE_SHARED).filter(|(_, shown)| wanted(shown)) {
                all.push((shown, self.shared(device, rays, name)?));
            }
            if wanted(EMBREE_RANDOM) {
                all.push((EMBREE_RANDOM, self.random(device, rays)?));
            }
        }
        Ok(all)
    }

    /// umbel with one of its sets, from bare triangles to openness.
    fn baked<'a>(&'a self, (rays, grouping): (u32, Grouping), set: SampleSet) -> Result<Run<'a>> {
        // Directions of a receiver's own can be grouped by origin only.
        let grouping = if set == SampleSet::Independent { Grouping::Auto } else { grouping };
        let end = f64::from(self.interval[1]);
        let reach = Reach { max_distance: if end.is_finite() { end } else { 0.0 }, ..Reach::default() };
        let bake = Bake::new(BakeOptions { rays, set, reach, grouping, ..BakeOptions::default() })?;
        let mut frame = Frame::new();
        Ok(Box::new(move || {
            let triangles = Triangles::new(&self.model.positions, &self.model.triangles)?;
            let run = || bake.run(&triangles, &self.receivers, &mut frame, &Options::default());
            let (trace, found) = timed(run);
            Ok((Times { build: 0.0, trace }, found?.values))
        }))
    }

    /// Embree with directions that all receivers share, by one of its orders.
    #[cfg(feature = "embree")]
    fn shared<'a>(
        &'a self,
        device: &std::sync::Arc<crate::engines::embree::device::Device>,
        rays: u32,
        order: &str,
    ) -> Result<Run<'a>> {
        let directions = crate::subjects::directions::sphere(2 * rays as usize);
        let (model, hemispheres) = (self.model.clone(), self.receivers.hemispheres.clone());
        let subject = Ambient::along(model, self.set, hemispheres, directions, self.interval)?;
        let mut engines = crate::engines::embree::ambient::variants(device, &subject, |name| name == order)?;
        Ok(Box::new(move || {
            let mut answer = subject.blank();
            let mut times = Times { build: 0.0, trace: 0.0 };
            for engine in &mut engines {
                times = engine.run(&subject, &mut answer)?;
            }
            let mut sums = vec![[0.0; 2]; self.receivers.len()];
            subject.rays.add_cosines(&answer, &self.receivers.normals, &mut sums);
            Ok((times, shares(&sums)))
        }))
    }

    /// Embree with random rays.
    #[cfg(feature = "embree")]
    fn random<'a>(
        &'a self,
        device: &std::sync::Arc<crate::engines::embree::device::Device>,
        rays: u32,
    ) -> Result<Run<'a>> {
        let mut embree = crate::engines::embree::ambient::RandomEmbree::new(device, &self.model)?;
        let points = self.receivers.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point);
        let starts: Vec<_> = points.zip(self.receivers.normals.iter().copied()).collect();
        Ok(Box::new(move || {
            let mut openness = vec![0.0; starts.len()];
            let times = embree.run(&starts, self.interval, rays as usize, &mut openness)?;
            Ok((times, openness))
        }))
    }
}

/// Of length 1, on the front.
fn normal(triangles: &Triangles<'_>, id: TriangleId) -> [f32; 3] {
    let [a, b, c] = triangles.corners(id).map(|corner| DVec3::from_array(corner.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
