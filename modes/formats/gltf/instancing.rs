//! Nodes whose mesh stands at many places: `EXT_mesh_gpu_instancing`.
//!
//! Instance k stands at (world matrix of the node) · T_k · R_k · S_k; what an accessor does not give is the identity. Children
//! of the node stand once.
//!
//! Based on: Microsoft and others, "EXT_mesh_gpu_instancing", extension of glTF 2.0, 2019.

use umbel_core::glam::DAffine3;

use crate::error::Problem;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{Node, broken, whole};
use crate::formats::gltf::nodes::combine;

/// The name of the extension.
pub(crate) const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// The places of a node's mesh, before they are read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Copies {
    /// Accessors of translations, rotations and scales.
    accessors: [Option<usize>; 3],
    /// How many there are.
    pub(crate) count: usize,
}

impl Copies {
    /// Those of a node that has the extension. `place` says whose they are.
    pub(crate) fn of(node: &Node, data: Data<'_>, place: &str) -> Result<Option<Self>, Problem> {
        let Some(extension) = node.extensions.get(INSTANCING) else {
            return Ok(None);
        };
        let mut accessors = [None; 3];
        let mut counts = Vec::new();
        for (accessor, name) in accessors.iter_mut().zip(["TRANSLATION", "ROTATION", "SCALE"]) {
            let Some(value) = extension.get("attributes").and_then(|attributes| attributes.get(name)) else {
                continue;
            };
            let index = whole(value).and_then(|index| usize::try_from(index).ok());
            let index =
                index.ok_or_else(|| broken(format!("{place}: {name} of its instances is no index")))?;
            *accessor = Some(index);
            counts.push(data.count(index, place)?);
        }
        match counts.first() {
            Some(&count) if counts.iter().all(|&other| other == count) => Ok(Some(Self { accessors, count })),
            Some(_) => Err(broken(format!("{place} has {INSTANCING} with different counts of elements"))),
            // Without attributes that place it, the mesh stands once.
            None => Ok(None),
        }
    }

    /// From the node's space to that of each instance.
    pub(crate) fn places(self, data: Data<'_>, place: &str) -> Result<Vec<DAffine3>, Problem> {
        let [translations, rotations, scales] = self.accessors;
        let translations: Option<Vec<[f64; 3]>> =
            translations.map(|index| data.vectors(index, place)).transpose()?;
        let rotations: Option<Vec<[f64; 4]>> =
            rotations.map(|index| data.vectors(index, place)).transpose()?;
        let scales: Option<Vec<[f64; 3]>> = scales.map(|index| data.vectors(index, place)).transpose()?;
        let at = |k: usize| {
            let of = |list: &Option<Vec<[f64; 3]>>| list.as_ref().map(|list| list[k]);
            combine(of(&translations), rotations.as_ref().map(|list| list[k]), of(&scales))
        };
        Ok((0..self.count).map(at).collect())
    }
}
