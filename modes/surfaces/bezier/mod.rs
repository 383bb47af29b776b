//! Surfaces of bicubic Bézier patches, to be made on demand.
//!
//! Patches that meet have the same control points along their border; `bicubic.rs` tells why their points are then equal to the
//! bit. A border may be collapsed to a point.
//!
//! Based on: Edwin Catmull, "A Subdivision Algorithm for Computer Display of Curved Surfaces", 1974.

pub(crate) mod bicubic;

use umbel_core::{Aabb, Detail, Domain, OnDemand};

use crate::surfaces::bezier::bicubic::Bicubic;
use crate::surfaces::extent::widened;
use crate::surfaces::lanes::map_points;
use crate::surfaces::patch_tree::{Node, PatchTree};

/// Bicubic Bézier patches. Hits report the index of the patch.
#[derive(Debug, Clone, PartialEq)]
pub struct BezierPatches {
    patches: Vec<[[f32; 3]; 16]>,
    tree: PatchTree,
}

impl BezierPatches {
    /// Patches with 16 control points each, P_ij at \[4·j + i\], i along u and j along v. There must be fewer than 2³² − 1, and all
    /// coordinates must be finite.
    #[must_use]
    pub fn new(patches: Vec<[[f32; 3]; 16]>) -> Self {
        let boxes: Vec<Aabb> =
            patches.iter().map(|patch| bicubic(patch).extent(Domain::UNIT).outward()).collect();
        Self { tree: PatchTree::new(&boxes), patches }
    }

    /// The control points of the patches.
    #[must_use]
    pub fn patches(&self) -> &[[[f32; 3]; 16]] {
        &self.patches
    }

    /// A patch in f64.
    fn bicubic(&self, node: &Node) -> Option<Bicubic> {
        self.tree.patch(*node).map(|patch| bicubic(&self.patches[patch as usize]))
    }
}

/// Control points in f64.
fn bicubic(points: &[[f32; 3]; 16]) -> Bicubic {
    Bicubic(points.map(widened))
}

impl OnDemand for BezierPatches {
    type Object = Node;

    fn roots(&self) -> Vec<Node> {
        self.tree.roots()
    }

    fn bounds(&self, object: &Node, domain: Domain, _detail: &Detail) -> Aabb {
        match self.bicubic(object) {
            Some(patch) if domain != Domain::UNIT => patch.extent(domain).outward(),
            _ => self.tree.bounds(*object),
        }
    }

    fn expand(&self, object: &Node, _spacing: f64, _detail: &Detail, parts: &mut Vec<Node>) -> bool {
        parts.extend(self.tree.parts(*object));
        self.tree.patch(*object).is_none()
    }

    fn evaluate(&self, patch: &Node, parameters: &[[f64; 2]], detail: &Detail, points: &mut Vec<[f32; 3]>) {
        if let Some(mut patch) = self.bicubic(patch) {
            map_points(&mut patch, parameters, detail.level(), points);
        }
    }

    fn id(&self, patch: &Node) -> u32 {
        self.tree.patch(*patch).unwrap_or_default()
    }
}
