//! Groups of many patches: a hierarchy of boxes that the engine expands from the roots.
//!
//! Patches are put in the order of a Morton curve through the middles of their boxes; eight neighbours make a group, eight groups
//! the next, up to eight roots. A node is a level and an index, its parts are the nodes 8·index .. 8·index + 8 of the level below.
//! The tree is 28 bytes and a little per patch, whatever the patches are diced into.
//!
//! Based on: Guy Morton, "A Computer Oriented Geodetic Data Base", 1966.

use rayon::prelude::*;
use umbel_core::Aabb;

/// Parts of a group.
const FAN: usize = 8;

/// Levels of the Morton grid per axis: three of them fit 64 bits.
const MORTON_BITS: u32 = 21;

/// A patch (level 0) or a group of the tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    level: u8,
    index: u32,
}

/// The hierarchy.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PatchTree {
    /// The patches in the order of the tree.
    order: Vec<u32>,
    /// The boxes of each level; level 0 holds the patches' own, in the order of the tree.
    levels: Vec<Vec<Aabb>>,
}

impl PatchTree {
    /// The tree over patches with these boxes.
    pub(crate) fn new(boxes: &[Aabb]) -> Self {
        let all = boxes.iter().copied().fold(Aabb::EMPTY, Aabb::union);
        // In range: ids of patches are 32 bits wide.
        let mut keyed: Vec<(u64, u32)> =
            boxes.par_iter().enumerate().map(|(k, bounds)| (morton(bounds, &all), k as u32)).collect();
        keyed.par_sort_unstable();
        let order: Vec<u32> = keyed.into_iter().map(|(_, patch)| patch).collect();
        let mut levels = vec![order.iter().map(|&patch| boxes[patch as usize]).collect::<Vec<_>>()];
        while let Some(last) = levels.last()
            && last.len() > FAN
        {
            let union = |group: &[Aabb]| group.iter().copied().fold(Aabb::EMPTY, Aabb::union);
            levels.push(last.chunks(FAN).map(union).collect());
        }
        Self { order, levels }
    }

    /// The uppermost nodes.
    pub(crate) fn roots(&self) -> Vec<Node> {
        let top = self.levels.len() - 1;
        // In range: there are fewer nodes than patches, and at most 11 levels.
        (0..self.levels[top].len()).map(|index| Node { level: top as u8, index: index as u32 }).collect()
    }

    /// The patch that a node is, or `None` for a group.
    pub(crate) fn patch(&self, node: Node) -> Option<u32> {
        (node.level == 0).then(|| self.order[node.index as usize])
    }

    /// The box of a node.
    pub(crate) fn bounds(&self, node: Node) -> Aabb {
        self.levels[usize::from(node.level)][node.index as usize]
    }

    /// The nodes that a group consists of; none for a patch.
    pub(crate) fn parts(&self, node: Node) -> impl Iterator<Item = Node> {
        let below = node.level.saturating_sub(1);
        let count = if node.level == 0 { 0 } else { self.levels[usize::from(below)].len() };
        let first = node.index as usize * FAN;
        (first.min(count)..count.min(first + FAN))
            .map(move |index| Node { level: below, index: index as u32 })
    }
}

/// The place of a box's middle on the Morton curve through the box of all.
fn morton(bounds: &Aabb, all: &Aabb) -> u64 {
    let (middle, extent) = (bounds.centre(), all.extent());
    let cells = f64::from(1_u32 << MORTON_BITS);
    let of_axis = |k: usize| {
        let place = (middle[k] - f64::from(all.lo[k])) / extent[k] * cells;
        // The cast saturates; 0/0 becomes 0.
        spread((place as u64).min((1 << MORTON_BITS) - 1)) << k
    };
    of_axis(0) | of_axis(1) | of_axis(2)
}

/// The lower 21 bits with two zeros between each.
fn spread(bits: u64) -> u64 {
    let mut x = bits;
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249_u64),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}
