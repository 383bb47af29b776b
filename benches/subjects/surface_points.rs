//! Receivers on the surfaces of a model: points spread evenly by area, or the vertices.
//!
//! Point k lies in the triangle, and there at the place, that the k-th member of a sequence in three dimensions chooses, by
//! which any first so many are evenly spread.
//!
//! Based on: Martin Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018.

use std::fmt;
use std::str::FromStr;

use rayon::prelude::*;
use umbel::engine::{Above, Hemisphere, Receiver, Side};
use umbel::glam::DVec3;
use umbel::{TriangleId, Triangles};

use crate::subjects::Model;

/// The root of x⁴ = x + 1; its negative powers are the steps of the sequence.
const ROOT: f64 = 1.220_744_084_605_759_5;

/// Which receivers a model has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ReceiverSet {
    /// So many points, triangle by triangle and there in rows, as texels are.
    Texel(usize),
    /// The vertices that triangles have, in their order.
    Vertex,
    /// So many points, neighbours far apart.
    Random(usize),
}

impl FromStr for ReceiverSet {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, count) = text.split_once(':').unwrap_or((text, ""));
        let count = count.parse().ok().filter(|count| (1..=1 << 26).contains(count));
        match (kind, count) {
            ("texel", Some(count)) => Ok(Self::Texel(count)),
            ("random", Some(count)) => Ok(Self::Random(count)),
            ("vertex", None) if text == kind => Ok(Self::Vertex),
            _ => Err("expected texel:N, random:N with N from 1 to 67108864, or vertex".into()),
        }
    }
}

impl fmt::Display for ReceiverSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Texel(count) => write!(f, "texel:{count}"),
            Self::Vertex => write!(f, "vertex"),
            Self::Random(count) => write!(f, "random:{count}"),
        }
    }
}

/// A place on a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    triangle: u32,
    weights: [f64; 3],
}

/// The receivers of a model, above the fronts of its triangles.
pub(crate) fn hemispheres(model: &Model, triangles: &Triangles<'_>, set: ReceiverSet) -> Vec<Hemisphere> {
    let places = match set {
        ReceiverSet::Vertex => vertices(model),
        ReceiverSet::Random(count) => spread(triangles, count),
        ReceiverSet::Texel(count) => {
            let mut places = spread(triangles, count);
            in_rows(&mut places);
            places
        }
    };
    let receiver = |place: &Place| {
        let id = TriangleId(place.triangle);
        let point = triangles.leave(id, place.weights, Side::Front);
        Hemisphere { receiver: Receiver { point, triangle: id }, above: Above::Side(Side::Front) }
    };
    places.par_iter().map(receiver).collect()
}

/// Each vertex in the first of its triangles.
fn vertices(model: &Model) -> Vec<Place> {
    let mut places = vec![None; model.positions.len()];
    for (triangle, corners) in (0..).zip(&model.triangles) {
        for (corner, &vertex) in corners.iter().enumerate() {
            let weights = [0, 1, 2].map(|k| if k == corner { 1.0 } else { 0.0 });
            places[vertex as usize].get_or_insert(Place { triangle, weights });
        }
    }
    places.into_iter().flatten().collect()
}

/// Points with the same number on the same area.
fn spread(triangles: &Triangles<'_>, count: usize) -> Vec<Place> {
    let mut sum = 0.0;
    let ends: Vec<f64> = (0..triangles.len() as u32)
        .map(|id| {
            let corners = triangles.corners(TriangleId(id));
            let [a, b, c] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
            sum += (b - a).cross(c - a).length();
            sum
        })
        .collect();
    let member = |k: usize, dimension: i32| (0.5 + (k + 1) as f64 * ROOT.powi(-dimension)).fract();
    let place = |k: usize| {
        let triangle = ends.partition_point(|&end| end <= member(k, 1) * sum).min(ends.len() - 1) as u32;
        let (root, v) = (member(k, 2).sqrt(), member(k, 3));
        Place { triangle, weights: [1.0 - root, root * (1.0 - v), root * v] }
    };
    if ends.is_empty() { Vec::new() } else { (0..count).into_par_iter().map(place).collect() }
}

/// Puts places in order: triangle by triangle, in each by rows as high as its points are apart.
fn in_rows(places: &mut [Place]) {
    places.par_sort_by_key(|place| place.triangle);
    for of_triangle in places.chunk_by_mut(|a, b| a.triangle == b.triangle) {
        let rows = (2.0 * of_triangle.len() as f64).sqrt();
        of_triangle.sort_by(|a, b| {
            let row = |place: &Place| (place.weights[2] * rows).floor();
            row(a).total_cmp(&row(b)).then(a.weights[1].total_cmp(&b.weights[1]))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles, the second three times as large, and a vertex of none.
    fn model() -> Model {
        let positions =
            vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [9.0, 9.0, 9.0], [4.0, 0.0, 0.0]];
        let triangles = vec![[0, 1, 2], [1, 4, 2]];
        Model { name: "two".into(), positions, triangles, group_ends: vec![2], dropped: 0 }
    }

    fn owners(set: &str) -> Vec<u32> {
        let model = model();
        let triangles = Triangles::new(&model.positions, &model.triangles).expect("triangles");
        let receivers = hemispheres(&model, &triangles, set.parse().expect("a set"));
        receivers.iter().map(|hemisphere| hemisphere.receiver.triangle.0).collect()
    }

    #[test]
    fn points_are_spread_by_area() {
        let of_first = owners("random:1000").iter().filter(|&&id| id == 0).count();
        assert!((245..=255).contains(&of_first), "{of_first}");
        assert!(owners("texel:1000").is_sorted());
    }

    #[test]
    fn vertices_have_owners() {
        assert_eq!(owners("vertex"), [0, 0, 0, 1]);
    }

    #[test]
    fn sets_have_names() {
        for text in ["texel:1000000", "vertex", "random:20000"] {
            assert_eq!(text.parse::<ReceiverSet>().expect("a set").to_string(), text);
        }
        for text in ["texel", "texel:0", "vertex:3", "random:x", ""] {
            assert!(text.parse::<ReceiverSet>().is_err(), "{text}");
        }
    }
}
