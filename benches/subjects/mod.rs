//! What all engines get: the same triangles and the same rays.

pub(crate) mod ambient;
pub(crate) mod ambient_rays;
pub(crate) mod answer;
pub(crate) mod bounce;
pub(crate) mod bounce_rays;
pub(crate) mod cliffs;
pub(crate) mod coincident;
pub(crate) mod directions;
pub(crate) mod icosphere;
pub(crate) mod mesh;
pub(crate) mod morton;
pub(crate) mod picture;
pub(crate) mod shadow;
pub(crate) mod shadow_rays;
pub(crate) mod sheets;
pub(crate) mod surface_points;
pub(crate) mod view_rays;
pub(crate) mod views;

use std::fmt;

use serde_json::{Value, json};
use umbel::Scene;
use umbel::glam::DVec3;

use crate::Result;
use crate::engines::Engines;
use crate::engines::engine::Engine;
use crate::subjects::answer::{Answer, Share};

/// Triangles, and rays that ask something of them.
pub(crate) trait Subject: Sized {
    /// What is found for all rays.
    type Answer: Answer;

    /// Whether rasterizers have an answer.
    const RASTERIZED: bool;

    /// The triangles.
    fn model(&self) -> &Model;

    /// How the rays are laid out, in a few characters such as 1920x1080.
    fn layout(&self) -> String;

    /// What the report tells of the rays besides their number: names and values.
    fn facts(&self) -> Vec<(&'static str, Value)>;

    /// The number of rays.
    fn rays(&self) -> usize;

    /// An answer with room for all rays.
    fn blank(&self) -> Self::Answer;

    /// Why an answer differs from umbel's, as shares of the rays, as far as that is looked into.
    fn explain(&self, _umbel: &Self::Answer, _other: &Self::Answer) -> Result<Vec<Share>> {
        Ok(Vec::new())
    }

    /// umbel first, then all others whose names are wanted.
    fn engines(&self, engines: &Engines, wanted: &dyn Fn(&str) -> bool)
    -> Result<Vec<Box<dyn Engine<Self>>>>;
}

/// The triangles of a scene.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) name: String,
    pub(crate) positions: Vec<[f32; 3]>,
    /// Without those that have no area; the index is the id.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Where the objects of the scene end.
    pub(crate) group_ends: Vec<u32>,
    /// How many triangles without area were left out.
    pub(crate) dropped: usize,
}

/// Pictures of the same size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shape {
    pub(crate) films: usize,
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl Model {
    /// The triangles that have an area.
    pub(crate) fn new(name: &str, scene: &Scene) -> Self {
        let positions = scene.positions.clone();
        let (mut triangles, mut group_ends) = (Vec::new(), Vec::new());
        for object in &scene.objects {
            let corners = &scene.triangles[object.triangles.start as usize..object.triangles.end as usize];
            triangles.extend(corners.iter().filter(|corners| has_area(&positions, corners)));
            group_ends.push(triangles.len() as u32);
        }
        group_ends.dedup();
        group_ends.retain(|&end| end > 0);
        let dropped = scene.triangles.len() - triangles.len();
        Self { name: name.to_owned(), positions, triangles, group_ends, dropped }
    }
}

impl Shape {
    /// What the report tells of pictures that are seen from a point.
    pub(crate) fn facts(self, origin: [f32; 3]) -> Vec<(&'static str, Value)> {
        let size = json!([self.width, self.height]);
        vec![("films", json!(self.films)), ("size", size), ("origin", json!(origin))]
    }
}

impl fmt::Display for Shape {
    /// WxH, or NxWxH.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.films > 1 {
            write!(f, "{}x", self.films)?;
        }
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Whether a triangle has an area, as f64 sees it.
fn has_area(positions: &[[f32; 3]], corners: &[u32; 3]) -> bool {
    let [a, b, c] = corners.map(|v| DVec3::from_array(positions[v as usize].map(f64::from)));
    (b - a).cross(c - a) != DVec3::ZERO
}
