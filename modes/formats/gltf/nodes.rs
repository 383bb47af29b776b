//! Which meshes stand where: the nodes of the default scene with their transforms to the world.
//!
//! A node's local transform is its matrix, or translation · rotation · scale; its world transform is its parent's times
//! that, all in f64. Nodes come parents first, children in the order of the file.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.5 "Scenes, Nodes and Hierarchy".

use umbel_core::glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::error::Problem;
use crate::formats::gltf::document::{Document, Node, broken, named};
use crate::formats::gltf::pose::affine;

/// A mesh at its place in the world.
#[derive(Debug)]
pub(crate) struct Instance {
    pub(crate) node: usize,
    pub(crate) mesh: usize,
    pub(crate) to_world: DAffine3,
}

/// All meshes of the default scene: `scene`, or the first, or all nodes where the file has no scenes.
pub(crate) fn instances(document: &Document) -> Result<Vec<Instance>, Problem> {
    let roots = match (document.scene, document.scenes.first()) {
        (Some(index), _) => named(&document.scenes, index, "scenes", "`scene`")?.nodes.clone(),
        (None, Some(first)) => first.nodes.clone(),
        (None, None) => parentless(document),
    };
    let mut found = Vec::new();
    let mut seen = vec![false; document.nodes.len()];
    let mut waiting: Vec<(usize, DAffine3)> =
        roots.into_iter().rev().map(|root| (root, DAffine3::IDENTITY)).collect();
    while let Some((index, parent)) = waiting.pop() {
        let node = named(&document.nodes, index, "nodes", "the hierarchy of nodes")?;
        // Without this, cycles would never end and shared children would multiply.
        if std::mem::replace(&mut seen[index], true) {
            return Err(broken(format!("nodes[{index}] has two parents or is its own ancestor")));
        }
        let to_world = parent * local(node);
        if let Some(mesh) = node.mesh {
            found.push(Instance { node: index, mesh, to_world });
        }
        waiting.extend(node.children.iter().rev().map(|&child| (child, to_world)));
    }
    Ok(found)
}

/// Where every node of the file stands, in the scene or not: joints may lie outside of it. `None` for those that no root
/// reaches, which are their own ancestors.
pub(crate) fn places(document: &Document) -> Vec<Option<DAffine3>> {
    let mut places = vec![None; document.nodes.len()];
    let roots = parentless(document).into_iter().rev();
    let mut waiting: Vec<(usize, DAffine3)> = roots.map(|root| (root, DAffine3::IDENTITY)).collect();
    while let Some((index, parent)) = waiting.pop() {
        let Some(node) = document.nodes.get(index).filter(|_| places[index].is_none()) else { continue };
        let to_world = parent * local(node);
        places[index] = Some(to_world);
        waiting.extend(node.children.iter().rev().map(|&child| (child, to_world)));
    }
    places
}

/// The nodes that are nobody's child.
fn parentless(document: &Document) -> Vec<usize> {
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(flag) = is_child.get_mut(child) {
            *flag = true;
        }
    }
    (0..document.nodes.len()).filter(|&node| !is_child[node]).collect()
}

/// From a node's space to its parent's.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return affine(matrix);
    }
    combine(node.translation, node.rotation, node.scale)
}

/// Translation · rotation (x, y, z, w) · scale.
pub(crate) fn combine(
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
) -> DAffine3 {
    let rotation = rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let scale = scale.map_or(DVec3::ONE, DVec3::from_array);
    let translation = translation.map_or(DVec3::ZERO, DVec3::from_array);
    // Not `from_scale_rotation_translation`: it may assert that the quaternion has length 1, which text rounds.
    let matrix3 = rotate(rotation) * DMat3::from_diagonal(scale);
    DAffine3 { matrix3, translation }
}

/// The matrix of a quaternion, which is brought to length 1; of the zero quaternion, the identity.
fn rotate(rotation: DQuat) -> DMat3 {
    let squared = rotation.length_squared();
    if !(squared > 0.0 && squared.is_finite()) {
        return DMat3::IDENTITY;
    }
    DMat3::from_quat(rotation / squared.sqrt())
}
