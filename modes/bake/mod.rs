//! Baking: from receivers to openness values, on the engine's open rays.
//!
//! A [`Bake`] makes its sample sets once; after that it takes any list of receivers, in pieces of any size, and gives one value
//! for each. Shared directions are one call of the engine, interleaved ones 16, each with its part of the receivers;
//! independent ones are one call that asks for each receiver's own. A value depends on its receiver and its number alone:
//! neither on the others, nor on how they are cut into pieces, nor on threads. (Several receivers of one texel stay together.)
//!
//! ```
//! use umbel::{Frame, Options, Scene};
//! use umbel::bake::{Bake, BakeOptions};
//!
//! let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let scene = Scene { positions, triangles: vec![[0, 1, 2]], ..Scene::default() };
//! let triangles = scene.geometry()?;
//! let receivers = scene.vertex_receivers()?.range(0..3);
//! let found = Bake::new(BakeOptions::default())?.run(&triangles, &receivers, &mut Frame::new(), &Options::default())?;
//! assert_eq!(found.values, [1.0; 3]);
//! # Ok::<(), umbel::Error>(())
//! ```
//!
//! Based on: Alexander Keller and Wolfgang Heidrich, "Interleaved Sampling", 2001.

pub mod atlas;
pub(crate) mod corner_rays;
pub mod depth_maps;
pub(crate) mod map_places;
pub(crate) mod near;
pub mod occluder_scenes;
pub mod occluders;
pub(crate) mod openness;
pub mod options;
pub mod receivers;
pub mod sample_sets;

pub use atlas::image::TexelImage;
pub use atlas::layout::AtlasOptions;
pub use atlas::uv_check::{UvCheck, check_uvs};
pub use atlas::{Atlas, TexelReceiver};
pub use depth_maps::DepthMaps;
pub use near::rounding_distance;
pub use occluder_scenes::Occluders;
pub use occluders::{BakeOccluders, rays_around};
pub use options::{BakeOptions, Polarity};
pub use receivers::BakeReceivers;
pub use receivers::fans::Fans;
pub use receivers::points::read_points;
pub use receivers::vertices::VertexReceivers;
pub use sample_sets::{Falloff, Reach, SampleSet, Weighting};

use std::collections::HashMap;

use umbel_core::{Frame, Hemisphere, Occlusion, OpenRays, Options, RaySample, RaySamples, Stats};

use crate::bake::corner_rays::{CornerRay, CornerRays};
use crate::bake::map_places::Places;
use crate::bake::openness::{Sums, dot, weigh_own, weigh_shared};
use crate::bake::sample_sets::{INTERLEAVED, OwnSets, set_of, sphere_sets};
use crate::error::Error;
use crate::scene::Scene;

/// Rays of one call of the engine that are worth their fixed cost, and that a user does not wait long for.
const RAYS_PER_CALL: u64 = 1 << 26;
/// The fewest receivers of a piece.
const LEAST_RECEIVERS: u64 = 1 << 12;
/// Bytes that the engine takes for each receiver.
const ENGINE_BYTES: u64 = 4;
/// Bytes that receivers of one piece may take, where the caller does not say.
const PIECE_BYTES: u64 = 1 << 30;

/// The openness of each vertex of a scene that occludes itself: a value for each of [`Scene::positions`], 0 to 1 unless
/// [`BakeOptions::polarity`] says otherwise; NaN for vertices that no triangle with an area uses.
///
/// [`Bake::run`] takes vertices, texels or points in pieces, and other occluders.
///
/// ```
/// use umbel::bake::{BakeOptions, bake_vertices};
/// use umbel::builtin;
///
/// let scene = builtin("cornell")?;
/// let openness = bake_vertices(&scene, BakeOptions { rays: 16, ..BakeOptions::default() })?;
/// assert_eq!(openness.len(), scene.positions.len());
/// # Ok::<(), umbel::Error>(())
/// ```
///
/// # Errors
/// When options are out of range or contradict each other, or the scene is refused.
pub fn bake_vertices(scene: &Scene, options: BakeOptions) -> Result<Vec<f32>, Error> {
    let triangles = scene.geometry()?;
    let (bake, vertices) = (Bake::new(options)?, scene.vertex_receivers()?);
    let (mut frame, mut values) = (Frame::new(), vec![f32::NAN; scene.positions.len()]);
    let piece = bake.piece(PIECE_BYTES);
    for first in (0..values.len()).step_by(piece) {
        let receivers = vertices.range(first..values.len().min(first + piece));
        let found = bake.run(&triangles, &receivers, &mut frame, &Options::default())?;
        for (&vertex, value) in receivers.indices.iter().zip(found.values) {
            values[vertex as usize] = value;
        }
    }
    Ok(values)
}

/// A ray above the surface: its start, its direction, t_max in units of the direction's length, and 1 for a hit or else 0.
pub type TracedRay = [f32; 8];

/// What is found for a list of receivers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Baked {
    /// A value for each.
    pub values: Vec<f32>,
    /// The mean open direction of each, of unit length, or its normal where nothing is open; empty unless asked for.
    pub bent: Vec<[f32; 3]>,
    /// Their rays above the surface, receiver by receiver; empty unless asked for.
    pub traced: Vec<TracedRay>,
    /// How many rays point above the horizon of their receiver's normal.
    pub rays: u64,
    /// What the engine did.
    pub stats: Stats,
}

/// Sample sets, ready for receivers.
#[derive(Debug, Clone, PartialEq)]
pub struct Bake {
    options: BakeOptions,
    /// The directions on the sphere; none where each receiver has its own.
    sets: Vec<Vec<RaySample>>,
}

impl Bake {
    /// Makes the sample sets.
    ///
    /// # Errors
    /// [`Error::Usage`] when options are out of range or contradict each other.
    pub fn new(options: BakeOptions) -> Result<Self, Error> {
        options.check()?;
        let BakeOptions { rays, reach, seed, .. } = options;
        let sets = match options.set {
            SampleSet::Shared => sphere_sets(rays, 1, reach, seed),
            SampleSet::Interleaved => sphere_sets(rays, INTERLEAVED, reach, seed),
            SampleSet::Independent => Vec::new(),
        };
        Ok(Self { options, sets })
    }

    /// Rays of a receiver that the engine is asked for, those below the surface too.
    #[must_use]
    pub fn directions(&self) -> u64 {
        self.sets.first().map_or(u64::from(self.options.rays), |set| set.len() as u64)
    }

    /// Bytes that [`Bake::run`] and its answer take for each receiver, with the receiver itself; without traced rays, which are
    /// as many as point above its horizon.
    #[must_use]
    pub fn receiver_bytes(&self) -> u64 {
        let receiver = (size_of::<Hemisphere>() + size_of::<[f32; 3]>() + size_of::<u32>()) as u64;
        let bits = 4 * self.directions().div_ceil(32);
        // The openness in f64 and as a value.
        let values = 12 + if self.options.bent { 12 } else { 0 };
        let asked = receiver + bits + values + ENGINE_BYTES;
        // One set after the other, beside the receivers, their places and all values.
        let asked = match self.sets.len() as u64 {
            sets @ 2.. => receiver + 8 + values + asked.div_ceil(sets),
            _ => asked,
        };
        let own = if self.sets.is_empty() { OwnSets::RECEIVER_BYTES } else { 0 };
        let maps = self.options.depth_maps.map_or(0, |_| bits + Places::RECEIVER_BYTES);
        asked + own + maps
    }

    /// Bytes that depth maps take beside that.
    #[must_use]
    pub fn map_bytes(&self) -> u64 {
        self.options.depth_maps.map_or(0, DepthMaps::bytes)
    }

    /// How many receivers to take at once: so many that the engine is busy, at most what `bytes` hold; but a few in any case.
    #[must_use]
    pub fn piece(&self, bytes: u64) -> usize {
        let calls = self.sets.len().max(1) as u64;
        // All receivers share the maps: the more, the better.
        let most = self.options.depth_maps.map(|_| u64::MAX);
        let busy = most.unwrap_or_else(|| RAYS_PER_CALL * calls / self.directions());
        busy.min(bytes / self.receiver_bytes()).max(LEAST_RECEIVERS) as usize
    }

    /// Finds the values of receivers.
    ///
    /// # Errors
    /// When the engine refuses a receiver, or the scene or the options.
    pub fn run<'a>(
        &self,
        occluders: impl Into<BakeOccluders<'a>>,
        receivers: &BakeReceivers,
        frame: &mut Frame,
        options: &Options,
    ) -> Result<Baked, Error> {
        let (mut query, mut found) =
            (Query { bake: self, occluders: occluders.into(), frame, options }, Found::default());
        match self.sets.as_slice() {
            [] => found = query.own(receivers)?,
            [samples] => found = query.shared(receivers, samples)?,
            _ => {
                found.make_room(receivers.len(), self.options.bent);
                let mut places = vec![Vec::new(); self.sets.len()];
                for (place, &index) in receivers.indices.iter().enumerate() {
                    places[set_of(index, self.options.columns)].push(place);
                }
                for (samples, places) in
                    self.sets.iter().zip(&places).filter(|(_, places)| !places.is_empty())
                {
                    let part = query.shared(&receivers.picked(places), samples)?;
                    found.put(places, part);
                }
                found.traced.sort_by_key(|(place, _)| *place);
            }
        }
        let Found { sums, traced, stats } = found;
        Ok(Baked {
            values: sums.openness.into_iter().map(|openness| self.options.polarity.value(openness)).collect(),
            bent: sums.bent,
            traced: traced.into_iter().map(|(_, ray)| ray).collect(),
            rays: sums.rays,
            stats,
        })
    }
}

/// One run.
struct Query<'a> {
    bake: &'a Bake,
    occluders: BakeOccluders<'a>,
    frame: &'a mut Frame,
    options: &'a Options,
}

/// What is found, and the rays with the places of their receivers.
#[derive(Default)]
struct Found {
    sums: Sums,
    traced: Vec<(usize, TracedRay)>,
    stats: Stats,
}

impl Found {
    fn make_room(&mut self, receivers: usize, bent: bool) {
        self.sums.openness = vec![0.0; receivers];
        self.sums.bent = vec![[0.0; 3]; if bent { receivers } else { 0 }];
    }

    /// Puts what was found for some receivers in their places.
    fn put(&mut self, places: &[usize], part: Self) {
        places.iter().zip(part.sums.openness).for_each(|(&place, value)| self.sums.openness[place] = value);
        places.iter().zip(part.sums.bent).for_each(|(&place, bent)| self.sums.bent[place] = bent);
        self.traced.extend(part.traced.into_iter().map(|(place, ray)| (places[place], ray)));
        self.sums.rays += part.sums.rays;
        self.stats = self.stats.then(part.stats);
    }
}

/// What the engine says.
struct Asked {
    open: OpenRays,
    /// Where rays start that do not start at their receiver's own triangle; empty unless the rays are wanted.
    starts: HashMap<(usize, usize), Hemisphere>,
    stats: Stats,
}

impl Query<'_> {
    /// Receivers that share their directions.
    fn shared(&mut self, receivers: &BakeReceivers, samples: &[RaySample]) -> Result<Found, Error> {
        let BakeOptions { weighting, bent, .. } = self.bake.options;
        let Asked { open, starts, stats } = self.ask(receivers, RaySamples::Shared(samples))?;
        let sums = weigh_shared(&open, &receivers.normals, samples, weighting, bent);
        Ok(Found { sums, traced: self.traced(receivers, (&open, &starts), |_, ray| samples[ray]), stats })
    }

    /// Receivers with directions of their own.
    fn own(&mut self, receivers: &BakeReceivers) -> Result<Found, Error> {
        let BakeOptions { rays, weighting, reach, seed, bent, .. } = self.bake.options;
        let named = receivers.indices.iter().copied().zip(receivers.normals.iter().copied());
        let sets = OwnSets::new((rays, weighting, reach, seed), named);
        let of = |receiver, ray| sets.sample(receiver, ray);
        let Asked { open, starts, stats } =
            self.ask(receivers, RaySamples::Own { count: sets.count(), of: &of })?;
        let sums = weigh_own(&open, &receivers.normals, &sets, bent);
        Ok(Found { sums, traced: self.traced(receivers, (&open, &starts), of), stats })
    }

    /// Asks the engine, for what leaves a vertex by other faces than its owner's as well.
    fn ask(&mut self, receivers: &BakeReceivers, samples: RaySamples<'_>) -> Result<Asked, Error> {
        let BakeOptions { back_faces, traced, .. } = self.bake.options;
        let (mut open, stats) = self.ask_owners(receivers, samples)?;
        let corner_rays = CornerRays { occluders: self.occluders, receivers, samples, back_faces };
        let mut starts = HashMap::new();
        let further = corner_rays.put(&mut open, (self.frame, self.options), |ray: &CornerRay| {
            if traced {
                starts.insert((ray.place, ray.ray), ray.hemisphere);
            }
        })?;
        Ok(Asked { open, starts, stats: stats.then(further) })
    }

    /// Asks the engine for the rays from the receivers' own triangles.
    fn ask_owners(
        &mut self,
        receivers: &BakeReceivers,
        samples: RaySamples<'_>,
    ) -> Result<(OpenRays, Stats), Error> {
        let BakeOptions { back_faces, grouping, depth_maps, .. } = self.bake.options;
        if let (Some(maps), RaySamples::Shared(samples)) = (depth_maps, samples) {
            if !self.occluders.surfaces.is_empty() {
                let what = "depth maps are made of triangles: leave out surfaces on demand, or take rays";
                return Err(Error::Usage(what.into()));
            }
            return maps.open_rays(self.occluders.triangles, (receivers, samples), self.frame, self.options);
        }
        let occlusion = Occlusion { hemispheres: &receivers.hemispheres, samples, back_faces, grouping };
        self.occluders.open_rays(&occlusion, self.frame, self.options)
    }

    /// The rays above both the surface and the horizon of the normal, with what became of them.
    fn traced(
        &self,
        receivers: &BakeReceivers,
        (open, starts): (&OpenRays, &HashMap<(usize, usize), Hemisphere>),
        sample: impl Fn(usize, usize) -> RaySample,
    ) -> Vec<(usize, TracedRay)> {
        if !self.bake.options.traced {
            return Vec::new();
        }
        let ray = |(place, ray): (usize, usize)| {
            let RaySample { direction, t_max, .. } = sample(place, ray);
            let hemisphere = starts.get(&(place, ray)).unwrap_or(&receivers.hemispheres[place]);
            let d = direction.to_array().map(|x| x as f32);
            let is_above = dot(receivers.normals[place], d) > 0.0
                && hemisphere.is_above(self.occluders.triangles, direction);
            let [x, y, z] = hemisphere.receiver.point;
            let hit = if open.is_open(place, ray) { 0.0 } else { 1.0 };
            is_above.then_some((place, [x, y, z, d[0], d[1], d[2], t_max, hit]))
        };
        let all = (0..receivers.len()).flat_map(|place| (0..open.rays()).map(move |ray| (place, ray)));
        all.filter_map(ray).collect()
    }
}
