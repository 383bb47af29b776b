//! Ways of estimating openness with so many rays, each timed: Embree and umbel, with the sets of directions that they suit.
//!
//! Openness is the share of the hemisphere that is open, weighted by the cosine. Random rays are drawn in proportion to the
//! cosine and count alike; rays of sets that cover the sphere evenly are weighted by it.
//!
//! Based on: Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001; Roy Cranley and Thomas Patterson,
//! "Randomization of Number Theoretic Methods for Multiple Integration", 1976.

use umbel::glam::DVec3;
use umbel::{
    Frame, Grouping, Hemisphere, Occlusion, Options, RaySample, RaySamples, Scene, TriangleId, Triangles,
};

use crate::Result;
use crate::ambient::{Ambient, MaxDistance, interval};
use crate::directions::{self, Axes, GOLDEN, Random};
use crate::engine::{Engine, Times, timed};
use crate::engines::Engines;
use crate::reference::shares;
use crate::subject::{Model, Subject};
use crate::surface_points::{ReceiverSet, hemispheres};
use crate::umbel_engine::Umbel;

/// Sets that are interleaved.
const SETS: usize = 4;

/// A scene's receivers, whatever their rays are.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) model: Model,
    pub(crate) set: ReceiverSet,
    pub(crate) hemispheres: Vec<Hemisphere>,
    /// Of length 1, one for each receiver.
    pub(crate) normals: Vec<[f32; 3]>,
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
        let order = crate::morton::order(&points);
        let hemispheres: Vec<Hemisphere> = order.iter().map(|&k| unordered[k as usize]).collect();
        let normals = hemispheres.iter().map(|at| normal(&triangles, at.receiver.triangle)).collect();
        Ok(Self { model, set, hemispheres, normals, interval: interval(scene, max_distance) })
    }

    /// All ways that there are, with so many rays per receiver.
    #[cfg_attr(not(feature = "embree"), expect(unused_variables, reason = "umbel is alone"))]
    pub(crate) fn estimates<'a>(&'a self, engines: &Engines, rays: usize) -> Result<Vec<Estimate<'a>>> {
        let sphere = directions::sphere(2 * rays);
        let shared = vec![self.along((0..self.hemispheres.len()).collect(), sphere.clone())?];
        let mut all: Vec<Estimate<'a>> =
            vec![("umbel-shared", self.weighted(shared.clone(), vec![Box::new(Umbel::from_scratch())]))];
        let parts: Result<Vec<Part>> = (0..SETS).map(|set| self.interleaved(&sphere, set)).collect();
        let umbels = (0..SETS).map(|_| Box::new(Umbel::from_scratch()) as Box<dyn Engine<Ambient>>);
        all.push(("umbel-interleaved", self.weighted(parts?, umbels.collect())));
        all.push(("umbel-independent", self.independent(rays)));
        #[cfg(feature = "embree")]
        if let Some(device) = &engines.embree {
            let names = ["embree-medium-16-receivers", "embree-medium-16-directions"];
            let shown = ["embree-shared-receivers", "embree-shared-directions"];
            for (name, shown) in names.into_iter().zip(shown) {
                let engine =
                    crate::embree_ambient::variants(device, &shared[0].subject, |other| other == name)?;
                all.push((shown, self.weighted(shared.clone(), engine)));
            }
            all.push(("embree-random", self.random(device, rays)?));
        }
        Ok(all)
    }

    /// Some receivers, with the directions that they share.
    fn along(&self, receivers: Vec<usize>, directions: Vec<[f32; 3]>) -> Result<Part> {
        let hemispheres = receivers.iter().map(|&k| self.hemispheres[k]).collect();
        let normals = receivers.iter().map(|&k| self.normals[k]).collect();
        let subject = Ambient::along(self.model.clone(), self.set, hemispheres, directions, self.interval)?;
        Ok(Part { receivers, normals, subject })
    }

    /// Every so manieth receiver, with the directions turned at random.
    fn interleaved(&self, directions: &[[f32; 3]], set: usize) -> Result<Part> {
        let mut random = Random::new(set as u64);
        let up = Axes::around([0.0, 0.0, 1.0]).sphere(random.pair());
        let axes = Axes::around(up);
        let turned = directions.iter().map(|&direction| axes.vector(direction)).collect();
        self.along((set..self.hemispheres.len()).step_by(SETS).collect(), turned)
    }

    /// Sets that receivers share, all or some of them, each by its engine.
    fn weighted<'a>(&'a self, parts: Vec<Part>, mut engines: Vec<Box<dyn Engine<Ambient>>>) -> Run<'a> {
        Box::new(move || {
            let mut openness = vec![0.0; self.hemispheres.len()];
            let mut times = Times { build: 0.0, trace: 0.0 };
            for (part, engine) in parts.iter().zip(&mut engines) {
                let mut answer = part.subject.blank();
                let took = engine.run(&part.subject, &mut answer)?;
                times = Times { build: times.build + took.build, trace: times.trace + took.trace };
                let mut sums = vec![[0.0; 2]; part.receivers.len()];
                part.subject.rays.add_cosines(&answer, &part.normals, &mut sums);
                for (&receiver, share) in part.receivers.iter().zip(shares(&sums)) {
                    openness[receiver] = share;
                }
            }
            Ok((times, openness))
        })
    }

    /// umbel with rays of each receiver's own: a spiral around the normal, denser where the cosine is great, shifted at
    /// random.
    fn independent<'a>(&'a self, rays: usize) -> Run<'a> {
        let of = move |receiver: usize, ray: usize| {
            let [u, v] = Random::new(receiver as u64).pair().map(f64::from);
            let (u, v) = ((ray as f64 + u) / rays as f64, (v + ray as f64 * GOLDEN).fract());
            let direction = Axes::around(self.normals[receiver]).cosine([u as f32, v as f32]);
            let direction = DVec3::from_array(direction.map(f64::from));
            RaySample { direction, t_max: self.interval[1] }
        };
        let mut frame = Frame::new();
        Box::new(move || {
            let triangles = Triangles::new(&self.model.positions, &self.model.triangles)?;
            let occlusion = Occlusion {
                hemispheres: &self.hemispheres,
                samples: RaySamples::Own { count: rays, of: &of },
                back_faces: true,
                grouping: Grouping::Auto,
            };
            let (trace, found) = timed(|| frame.open_rays(&triangles, &occlusion, &Options::default()));
            let (open, _) = found?;
            let count = |k| open.words(k).iter().map(|word: &u32| word.count_ones()).sum::<u32>();
            let openness = (0..self.hemispheres.len()).map(|k| count(k) as f32 / rays as f32).collect();
            Ok((Times { build: 0.0, trace }, openness))
        })
    }

    /// Embree with random rays.
    #[cfg(feature = "embree")]
    fn random<'a>(&'a self, device: &std::sync::Arc<crate::embree::Device>, rays: usize) -> Result<Run<'a>> {
        let mut embree = crate::embree_ambient::RandomEmbree::new(device, &self.model)?;
        let points = self.hemispheres.iter().map(|hemisphere| hemisphere.receiver.point);
        let starts: Vec<_> = points.zip(self.normals.iter().copied()).collect();
        Ok(Box::new(move || {
            let mut openness = vec![0.0; starts.len()];
            let times = embree.run(&starts, self.interval, rays, &mut openness)?;
            Ok((times, openness))
        }))
    }
}

/// Some receivers that share their directions.
#[derive(Debug, Clone)]
struct Part {
    /// Places among all of them.
    receivers: Vec<usize>,
    normals: Vec<[f32; 3]>,
    subject: Ambient,
}

/// Of length 1, on the front.
fn normal(triangles: &Triangles<'_>, id: TriangleId) -> [f32; 3] {
    let [a, b, c] = triangles.corners(id).map(|corner| DVec3::from_array(corner.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
}
