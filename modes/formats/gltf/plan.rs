//! What a scene will hold, counted before any of it is made.
//!
//! Few bytes of a file can stand for many triangles: instances of one mesh, accessors that many primitives share, or that
//! have no data at all. Counts of accessors are checked against their bytes, so the sums here are what will be made.

use std::collections::{BTreeMap, HashSet};
use std::mem::size_of;

use crate::error::Problem;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{
    Mesh, Node, Primitive, TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES, named, triangle_count,
};
use crate::formats::gltf::extensions::{DRACO, compressed};
use crate::formats::gltf::instancing::Copies;
use crate::formats::gltf::nodes::Instance;
use crate::formats::gltf::options::GltfOrigin;
use crate::formats::gltf::pose::{Morph, joint_sets};
use crate::scene::Object;

/// Bytes of a vertex while it is read: the position, or the normal and what a morph target adds, in f64.
const PASSING_BYTES: usize = 2 * 24;
/// More of a skinned vertex, for each set of joints: joints and weights in f64.
const JOINT_BYTES: usize = 2 * 32;
/// Bytes of an index while it is read: in f64, and as it is kept.
const INDEX_BYTES: usize = 8 + 4;

/// A primitive that is made of triangles, with what its vertices are made of.
pub(crate) struct Part<'a> {
    pub(crate) primitive: &'a Primitive,
    /// Accessors.
    pub(crate) positions: usize,
    pub(crate) normals: Option<usize>,
    pub(crate) uvs: Option<usize>,
    /// Of joints and weights, for a node that has a skin.
    pub(crate) joints: Vec<[usize; 2]>,
    pub(crate) morph: Morph<'a>,
    /// How many vertices there are.
    pub(crate) count: usize,
}

impl<'a> Part<'a> {
    /// That of a primitive, if it is made of triangles and has positions.
    pub(crate) fn of(
        (node, mesh, primitive): (&'a Node, &'a Mesh, &'a Primitive),
        uv_set: u32,
        (data, place): (Data<'_>, &str),
    ) -> Result<Option<Self>, Problem> {
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let is_surface = matches!(primitive.mode, TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN);
        let Some(positions) = attribute("POSITION").filter(|_| is_surface) else {
            return Ok(None);
        };
        if primitive.extensions.contains_key(DRACO) && !data.has_data(positions) {
            return Err(compressed(&format!("{place} is"), DRACO));
        }
        Ok(Some(Self {
            primitive,
            positions,
            normals: attribute("NORMAL"),
            uvs: attribute(&format!("TEXCOORD_{uv_set}")),
            joints: if node.skin.is_some() { joint_sets(primitive).collect() } else { Vec::new() },
            morph: Morph::new(node, &mesh.weights, primitive),
            count: data.count(positions, place)?,
        }))
    }

    /// What tells its vertices from others of the same instance: every accessor that has a part in them.
    pub(crate) fn key(&self) -> Vec<usize> {
        let optional = |accessor: Option<usize>| accessor.unwrap_or(usize::MAX);
        let mut key = vec![self.positions, optional(self.normals), optional(self.uvs)];
        key.extend(self.joints.iter().flatten());
        for attribute in ["POSITION", "NORMAL"] {
            key.push(usize::MAX);
            // The weights are those of the mesh, but targets of weight 0 are left out.
            for (weight, accessor) in self.morph.accessors(attribute) {
                key.extend([accessor, weight.to_bits() as usize]);
            }
        }
        key
    }

    /// Whether morph targets would move its texture coordinates.
    pub(crate) fn moves_uvs(&self, uv_set: u32) -> bool {
        self.morph.accessors(&format!("TEXCOORD_{uv_set}")).next().is_some()
    }
}

/// How much of everything a scene will have.
#[derive(Debug, Default)]
pub(crate) struct Plan {
    pub(crate) vertices: usize,
    pub(crate) normals: usize,
    pub(crate) uvs: usize,
    pub(crate) triangles: usize,
    /// Primitives of instances.
    pub(crate) parts: usize,
    /// Bytes of their names.
    names: usize,
    /// The most bytes that are needed for a while.
    passing: usize,
}

impl Plan {
    pub(crate) fn of(instances: &[Instance], data: Data<'_>, uv_set: u32) -> Result<Self, Problem> {
        let mut plan = Self::default();
        // Meshes that many nodes name are counted once.
        let mut known: BTreeMap<(usize, bool, Option<Vec<u64>>), Self> = BTreeMap::new();
        for instance in instances {
            let node = &data.document.nodes[instance.node];
            let place = format!("nodes[{}]", instance.node);
            let weights = node.weights.as_ref().map(|weights| weights.iter().map(|w| w.to_bits()).collect());
            let key = (instance.mesh, node.skin.is_some(), weights);
            if !known.contains_key(&key) {
                let mesh = named(&data.document.meshes, instance.mesh, "meshes", &place)?;
                known.insert(key.clone(), Self::of_mesh((node, mesh, instance.mesh), data, uv_set)?);
            }
            let copies = Copies::of(node, data, &place)?.filter(|_| node.skin.is_none());
            let copies = copies.map_or(1, |copies| copies.count);
            plan.add(&known[&key], copies);
            plan.names =
                plan.names.saturating_add(copies.saturating_mul(known[&key].parts * node.name.len()));
            plan.passing = plan.passing.max(copies.saturating_mul(96 + 96));
        }
        Ok(plan)
    }

    /// That of one instance of a mesh.
    fn of_mesh(
        (node, mesh, index): (&Node, &Mesh, usize),
        data: Data<'_>,
        uv_set: u32,
    ) -> Result<Self, Problem> {
        let mut plan = Self { names: mesh.name.len() * mesh.primitives.len(), ..Self::default() };
        let mut seen = HashSet::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("meshes[{index}].primitives[{number}]");
            let Some(part) = Part::of((node, mesh, primitive), uv_set, (data, &place))? else { continue };
            let indices = primitive.indices.map(|accessor| data.index_count(accessor, &place)).transpose()?;
            let sets = part.joints.len();
            if seen.insert(part.key()) {
                plan.vertices = plan.vertices.saturating_add(part.count);
                plan.normals = plan.normals.saturating_add(part.normals.map_or(0, |_| part.count));
                plan.uvs = plan.uvs.saturating_add(part.uvs.map_or(0, |_| part.count));
            }
            let triangles = triangle_count(primitive.mode, indices.unwrap_or(part.count));
            plan.triangles = plan.triangles.saturating_add(triangles);
            plan.parts += 1;
            let vertex = part.count.saturating_mul(PASSING_BYTES + sets * JOINT_BYTES);
            plan.passing = plan.passing.max(vertex).max(indices.unwrap_or(0).saturating_mul(INDEX_BYTES));
        }
        Ok(plan)
    }

    fn add(&mut self, other: &Self, times: usize) {
        let add = |sum: &mut usize, more: usize| *sum = sum.saturating_add(more.saturating_mul(times));
        add(&mut self.vertices, other.vertices);
        add(&mut self.normals, other.normals);
        add(&mut self.uvs, other.uvs);
        add(&mut self.triangles, other.triangles);
        add(&mut self.parts, other.parts);
        add(&mut self.names, other.names);
        self.passing = self.passing.max(other.passing);
    }

    /// The bytes that the scene takes, with what is needed on the way; with positions in f64 as well if `is_wide`.
    pub(crate) fn bytes(&self, is_wide: bool) -> u64 {
        let of = |count: usize, size: usize| (count as u64).saturating_mul(size as u64);
        let parts = [
            of(self.vertices, 12 + if is_wide { 24 } else { 0 }),
            of(self.normals, 12),
            of(self.uvs, 8),
            of(self.triangles, 12 * (1 + usize::from(self.normals > 0) + usize::from(self.uvs > 0))),
            of(self.parts, size_of::<Object>() + size_of::<GltfOrigin>()),
            self.names as u64,
            self.passing as u64,
        ];
        parts.into_iter().fold(0, u64::saturating_add)
    }
}
