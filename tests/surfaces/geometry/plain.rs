//! Catmull-Clark subdivision of a whole cage, step by step, as the textbook has it: what the surfaces are compared with.

use std::collections::{BTreeMap, BTreeSet};

use umbel::Scene;
use umbel::glam::DVec3;
use umbel::scene::Creases;

type Edge = (usize, usize);

/// A cage, refined as the textbook has it: with maps and sets, all of it at once.
#[derive(Clone, Default)]
pub(super) struct Plain {
    pub(super) points: Vec<DVec3>,
    pub(super) faces: Vec<Vec<usize>>,
    /// For each face of the quads that the cage began with: the face, and parameters of its corners.
    pub(super) places: Vec<(usize, Vec<[f64; 2]>)>,
    edges: BTreeMap<Edge, f64>,
    corners: BTreeMap<usize, f64>,
}

fn edge(a: usize, b: usize) -> Edge {
    (a.min(b), a.max(b))
}

impl Plain {
    pub(super) fn new(scene: &Scene, faces: &[Vec<usize>], creases: &Creases) -> Self {
        let wide = |p: &[f32; 3]| DVec3::from_array(p.map(f64::from));
        let unit = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let endless = |s: f32| if s >= 10.0 { f64::INFINITY } else { f64::from(s) };
        let mut plain = Self {
            points: scene.positions.iter().map(wide).collect(),
            faces: faces.to_vec(),
            places: (0..faces.len()).map(|face| (face, unit.clone())).collect(),
            edges: creases
                .edges
                .iter()
                .map(|&([a, b], s)| (edge(a as usize, b as usize), endless(s)))
                .collect(),
            corners: creases.corners.iter().map(|&(v, s)| (v as usize, endless(s))).collect(),
        };
        for (edge, around) in plain.edge_faces() {
            if around.len() == 1 {
                plain.edges.insert(edge, f64::INFINITY);
            }
        }
        for (vertex, around) in plain.vertex_faces() {
            let border = plain.spokes(vertex).iter().filter(|spoke| spoke.1 == f64::INFINITY).count();
            if around.len() == 1 && border == 2 {
                plain.corners.insert(vertex, f64::INFINITY);
            }
        }
        plain
    }

    fn edge_faces(&self) -> BTreeMap<Edge, Vec<usize>> {
        let mut around: BTreeMap<Edge, Vec<usize>> = BTreeMap::new();
        for (index, face) in self.faces.iter().enumerate() {
            for k in 0..face.len() {
                around.entry(edge(face[k], face[(k + 1) % face.len()])).or_default().push(index);
            }
        }
        around
    }

    fn vertex_faces(&self) -> BTreeMap<usize, Vec<usize>> {
        let mut around: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (index, face) in self.faces.iter().enumerate() {
            face.iter().for_each(|&vertex| around.entry(vertex).or_default().push(index));
        }
        around
    }

    /// The ends of the edges of a vertex, with sharpness.
    fn spokes(&self, vertex: usize) -> Vec<(usize, f64)> {
        let mut ends = BTreeSet::new();
        for face in self.faces.iter().filter(|face| face.contains(&vertex)) {
            let k = face.iter().position(|&v| v == vertex).expect("there");
            ends.extend([face[(k + 1) % face.len()], face[(k + face.len() - 1) % face.len()]]);
        }
        let sharp = |end: usize| self.edges.get(&edge(vertex, end)).copied().unwrap_or(0.0);
        ends.into_iter().map(|end| (end, sharp(end))).collect()
    }

    fn middle(&self, face: usize) -> DVec3 {
        let face = &self.faces[face];
        face.iter().map(|&v| self.points[v]).sum::<DVec3>() / face.len() as f64
    }

    /// A vertex under a rule: by how many of its spokes are sharp.
    fn moved(&self, vertex: usize, spokes: &[(usize, f64)], own: f64) -> DVec3 {
        let p = self.points[vertex];
        let sharp: Vec<usize> = spokes.iter().filter(|spoke| spoke.1 > 0.0).map(|spoke| spoke.0).collect();
        if own > 0.0 || sharp.len() > 2 {
            return p;
        }
        if let [a, b] = sharp[..] {
            return p * 0.75 + (self.points[a] + self.points[b]) * 0.125;
        }
        let n = spokes.len() as f64;
        let faces: Vec<usize> = (0..self.faces.len()).filter(|&f| self.faces[f].contains(&vertex)).collect();
        let middles = faces.iter().map(|&f| self.middle(f)).sum::<DVec3>();
        let ends = spokes.iter().map(|&(end, _)| self.points[end]).sum::<DVec3>();
        p * ((n - 2.0) / n) + (ends + middles) / (n * n)
    }

    pub(super) fn refined(&self) -> Self {
        let less = |s: f64| (s - 1.0).max(0.0);
        let around = self.edge_faces();
        let mut next = Self::default();
        for vertex in 0..self.points.len() {
            let (spokes, own) = (self.spokes(vertex), self.corners.get(&vertex).copied().unwrap_or(0.0));
            if spokes.is_empty() {
                next.points.push(self.points[vertex]);
                continue;
            }
            let later: Vec<(usize, f64)> = spokes.iter().map(|&(end, s)| (end, less(s))).collect();
            let ending: Vec<f64> =
                spokes.iter().map(|spoke| spoke.1).chain([own]).filter(|&s| s > 0.0 && s <= 1.0).collect();
            let kind =
                |spokes: &[(usize, f64)], own: f64| match spokes.iter().filter(|spoke| spoke.1 > 0.0).count()
                {
                    0 | 1 if own == 0.0 => 0,
                    2 if own == 0.0 => 1,
                    _ => 2,
                };
            let now = self.moved(vertex, &spokes, own);
            let same = ending.is_empty() || kind(&spokes, own) == kind(&later, less(own));
            let share = if same { 1.0 } else { ending.iter().sum::<f64>() / ending.len() as f64 };
            next.points.push(now * share + self.moved(vertex, &later, less(own)) * (1.0 - share));
            if less(own) > 0.0 {
                next.corners.insert(vertex, less(own));
            }
        }
        let mut middles = BTreeMap::new();
        for (&(a, b), faces) in &around {
            let sharp = self.edges.get(&(a, b)).copied().unwrap_or(0.0);
            let straight = (self.points[a] + self.points[b]) * 0.5;
            let point = match faces[..] {
                [f, g] => {
                    let smooth = (straight * 2.0 + self.middle(f) + self.middle(g)) * 0.25;
                    smooth + (straight - smooth) * sharp.min(1.0)
                }
                _ => straight,
            };
            let index = next.points.len();
            next.points.push(point);
            middles.insert((a, b), index);
            if less(sharp) > 0.0 {
                next.edges.extend([(edge(a, index), less(sharp)), (edge(b, index), less(sharp))]);
            }
        }
        for (face, corners) in self.faces.iter().enumerate() {
            let centre = next.points.len();
            next.points.push(self.middle(face));
            let (n, (parent, places)) = (corners.len(), &self.places[face]);
            for k in 0..n {
                let (after, before) = ((k + 1) % n, (k + n - 1) % n);
                let [e, d] = [after, before].map(|other| middles[&edge(corners[k], corners[other])]);
                next.faces.push(vec![corners[k], e, centre, d]);
                let place = |i: usize| places.get(i).copied().unwrap_or([0.0; 2]);
                let mean = |a: [f64; 2], b: [f64; 2]| [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5];
                let (here, far) = (place(k), mean(place(0), place(2)));
                next.places
                    .push((*parent, vec![here, mean(here, place(after)), far, mean(here, place(before))]));
            }
        }
        next
    }

    /// The limit of a vertex of quads where creases fade no more; `None` where one ends.
    pub(super) fn limit(&self, vertex: usize) -> Option<DVec3> {
        let (p, spokes) = (self.points[vertex], self.spokes(vertex));
        let sharp: Vec<usize> = spokes.iter().filter(|spoke| spoke.1 > 0.0).map(|spoke| spoke.0).collect();
        if self.corners.contains_key(&vertex) || sharp.len() > 2 {
            return Some(p);
        }
        if let [a, b] = sharp[..] {
            return Some((p * 4.0 + self.points[a] + self.points[b]) / 6.0);
        }
        if !sharp.is_empty() {
            return None;
        }
        let n = spokes.len() as f64;
        let ends = spokes.iter().map(|&(end, _)| self.points[end]).sum::<DVec3>();
        let far = |face: &Vec<usize>| {
            let k = face.iter().position(|&v| v == vertex)?;
            Some(self.points[face[(k + 2) % 4]])
        };
        let fars = self.faces.iter().filter_map(far).sum::<DVec3>();
        Some((p * (n * n) + ends * 4.0 + fars) / (n * (n + 5.0)))
    }
}
