//! The shape of a primitive as the file leaves it at rest: moved by default weights of morph targets, then by its skin.
//!
//! Morph targets add Σ w_k · target_k; the weights are those of the node, or else of the mesh, or else 0. A skinned vertex
//! stands at Σ wᵢ · (world matrix of joint i) · (inverse bind matrix i) · p, whatever the transform of its node. Weights are
//! divided by their sum, since bytes cannot sum up to 1.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, sections 3.7.2.2 "Morph Targets" and 3.7.3
//! "Skins".

use umbel_core::glam::{DAffine3, DMat3, DVec3};

use crate::error::Problem;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{Node, Primitive, broken, named};

/// The morph targets of a primitive that have an effect, with their weights.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Morph<'a> {
    targets: Vec<(f64, &'a std::collections::BTreeMap<String, usize>)>,
}

impl<'a> Morph<'a> {
    pub(crate) fn new(node: &'a Node, mesh_weights: &'a [f64], primitive: &'a Primitive) -> Self {
        let weights = node.weights.as_deref().unwrap_or(mesh_weights);
        let targets = weights.iter().copied().zip(&primitive.targets);
        Self { targets: targets.filter(|&(weight, _)| weight != 0.0).collect() }
    }

    /// The accessors that it adds to an attribute.
    pub(crate) fn accessors<'b>(&'b self, attribute: &'b str) -> impl Iterator<Item = (f64, usize)> + 'b {
        self.targets
            .iter()
            .filter_map(move |&(weight, target)| target.get(attribute).map(|&accessor| (weight, accessor)))
    }

    /// Adds the targets to the vectors of an attribute.
    pub(crate) fn apply(
        &self,
        (attribute, vectors): (&str, &mut [[f64; 3]]),
        (data, place): (Data<'_>, &str),
    ) -> Result<(), Problem> {
        for (weight, accessor) in self.accessors(attribute) {
            let moves: Vec<[f64; 3]> = data.vectors(accessor, place)?;
            if moves.len() != vectors.len() {
                let (count, moves) = (vectors.len(), moves.len());
                return Err(broken(format!(
                    "{place} has {count} elements of {attribute}, but a morph target of {moves}"
                )));
            }
            for (vector, step) in vectors.iter_mut().zip(&moves) {
                for (sum, part) in vector.iter_mut().zip(step) {
                    *sum += weight * part;
                }
            }
        }
        Ok(())
    }
}

/// The accessors of joints and weights of a primitive, set by set.
pub(crate) fn joint_sets(primitive: &Primitive) -> impl Iterator<Item = [usize; 2]> + '_ {
    let of = |name: &str, set: u32| primitive.attributes.get(&format!("{name}_{set}")).copied();
    (0..).map_while(move |set| Some([of("JOINTS", set)?, of("WEIGHTS", set)?]))
}

/// What takes the vertices of a primitive to the world.
pub(crate) enum Place {
    /// The transform of its node.
    Rigid(DAffine3),
    /// The joints of its skin.
    Skinned(Joints),
}

/// For each joint its world matrix times its inverse bind matrix, and for each vertex joints and weights.
pub(crate) struct Joints {
    matrices: Vec<DAffine3>,
    sets: Vec<[Vec<[f64; 4]>; 2]>,
    /// Vertices without any weight.
    pub(crate) unbound: usize,
}

/// The matrices of a skin's joints, given where all nodes stand.
pub(crate) fn joint_matrices(
    data: Data<'_>,
    (skin, of): (usize, &str),
    places: &[Option<DAffine3>],
) -> Result<Vec<DAffine3>, Problem> {
    let joints = named(&data.document.skins, skin, "skins", of)?;
    let place = format!("skins[{skin}]");
    let inverse: Option<Vec<[f64; 16]>> =
        joints.inverse_bind_matrices.map(|accessor| data.vectors(accessor, &place)).transpose()?;
    let matrix = |(index, &joint): (usize, &usize)| {
        named(&data.document.nodes, joint, "nodes", &place)?;
        let to_world = places[joint]
            .ok_or_else(|| broken(format!("nodes[{joint}] has two parents or is its own ancestor")))?;
        match inverse.as_deref().map(|matrices| matrices.get(index)) {
            None => Ok(to_world),
            Some(Some(matrix)) => Ok(to_world * affine(matrix)),
            Some(None) => Err(broken(format!(
                "{place} has {} joints, but fewer inverse bind matrices",
                joints.joints.len()
            ))),
        }
    };
    joints.joints.iter().enumerate().map(matrix).collect()
}

/// A matrix from its columns; the last row is 0 0 0 1.
pub(crate) fn affine(m: &[f64; 16]) -> DAffine3 {
    let column = |k: usize| DVec3::new(m[4 * k], m[4 * k + 1], m[4 * k + 2]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

impl Joints {
    /// Reads the joints and weights of `count` vertices.
    pub(crate) fn new(
        matrices: Vec<DAffine3>,
        (primitive, count): (&Primitive, usize),
        (data, place): (Data<'_>, &str),
    ) -> Result<Self, Problem> {
        let mut sets = Vec::new();
        for [joints, weights] in joint_sets(primitive) {
            let set = [data.vectors(joints, place)?, data.vectors(weights, place)?];
            if set.iter().any(|list| list.len() != count) {
                return Err(broken(format!("{place} has {count} positions, but other counts of joints")));
            }
            sets.push(set);
        }
        let mut joints = Self { matrices, sets, unbound: 0 };
        for vertex in 0..count {
            let mut sum = 0.0;
            for (joint, weight) in joints.of(vertex) {
                sum += weight;
                if joint >= joints.matrices.len() as f64 && (weight != 0.0 || joints.matrices.is_empty()) {
                    let known = joints.matrices.len();
                    return Err(broken(format!(
                        "{place} has a joint {joint}, but its skin has only {known}"
                    )));
                }
            }
            joints.unbound += usize::from(!(sum > 0.0 && sum.is_finite()));
        }
        Ok(joints)
    }

    /// The joints of a vertex and their weights.
    fn of(&self, vertex: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.sets.iter().flat_map(move |[joints, weights]| joints[vertex].into_iter().zip(weights[vertex]))
    }

    /// What takes a vertex to the world. One without weights follows its first joint.
    fn at(&self, vertex: usize) -> DAffine3 {
        let sum: f64 = self.of(vertex).map(|(_, weight)| weight).sum();
        if !(sum > 0.0 && sum.is_finite()) {
            let first = self.of(vertex).next().map_or(0, |(joint, _)| joint as usize);
            return self.matrices.get(first).copied().unwrap_or(DAffine3::IDENTITY);
        }
        let mut blend = DAffine3::ZERO;
        for (joint, weight) in self.of(vertex).filter(|&(_, weight)| weight != 0.0) {
            // In range: it was checked.
            let matrix = &self.matrices[joint as usize];
            blend.matrix3 += matrix.matrix3 * (weight / sum);
            blend.translation += matrix.translation * (weight / sum);
        }
        blend
    }
}

impl Place {
    /// What takes a vertex to the world.
    pub(crate) fn at(&self, vertex: usize) -> DAffine3 {
        match self {
            Self::Rigid(to_world) => *to_world,
            Self::Skinned(joints) => joints.at(vertex),
        }
    }
}
