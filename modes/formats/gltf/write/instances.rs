//! Meshes of their own for instances whose vertices have values of their own.
//!
//! Instances of a mesh lie at different places and so have different openness. Each set of values gets a copy of the
//! mesh, which is a few lines of JSON: indices, positions and all other data stay shared. Equal values keep sharing.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

use serde_json::Value;

use crate::error::Problem;
use crate::formats::gltf::GltfFile;
use crate::formats::gltf::document::{Document, broken};
use crate::formats::gltf::instancing::INSTANCING;
use crate::formats::gltf::write::{array, push};

impl GltfFile {
    /// Lets each node name a mesh that only nodes with the same values name. Returns the origins that stand for all
    /// (one instance for each mesh), and how many meshes were copied.
    pub(crate) fn separate_meshes(
        &mut self,
        document: &Document,
        values: &[f32],
    ) -> Result<(Vec<usize>, usize), Problem> {
        self.refuse_different_copies(values)?;
        let outside = self.meshes_outside(document);
        // For each mesh of the file: where its values are that have got a mesh, and which.
        let mut holders: HashMap<usize, Vec<(Range<usize>, usize)>> = HashMap::new();
        let (mut stored, mut copies) = (Vec::new(), 0);
        for instance in self.instances() {
            let (node, mesh) = (self.origins[instance.start].node, self.origins[instance.start].mesh);
            let own = self.vertices(&instance);
            let known = holders.entry(mesh).or_default();
            let same = known.iter().find(|(other, _)| values[other.clone()] == values[own.clone()]);
            let holder = match same {
                Some(&(_, holder)) => holder,
                None => {
                    // The file's own mesh goes to the first, unless a node outside the scene needs it as it is.
                    let is_free = known.is_empty() && !outside.contains(&mesh);
                    let holder = if is_free { mesh } else { self.copy_mesh(mesh)? };
                    copies += usize::from(!is_free);
                    known.push((own, holder));
                    stored.extend(instance.clone());
                    holder
                }
            };
            self.name_mesh(node, holder)?;
            self.origins[instance].iter_mut().for_each(|origin| origin.mesh = holder);
        }
        Ok((stored, copies))
    }

    /// The places that `EXT_mesh_gpu_instancing` gives a node share the node's mesh, which has one value for each vertex.
    fn refuse_different_copies(&self, values: &[f32]) -> Result<(), Problem> {
        for pair in self.instances().windows(2) {
            let [one, other] = [&pair[0], &pair[1]];
            let node = self.origins[one.start].node;
            if node == self.origins[other.start].node
                && values[self.vertices(one)] != values[self.vertices(other)]
            {
                return Err(Problem {
                    line: None,
                    what: format!(
                        "nodes[{node}] places its mesh by {INSTANCING}, and openness differs from place to place: the mesh \
                         cannot hold it"
                    ),
                    remedy: "Make a node of each instance first, or write openness as .npy or .ply.",
                });
            }
        }
        Ok(())
    }

    /// The origins of each instance. They follow each other.
    fn instances(&self) -> Vec<Range<usize>> {
        let mut start = 0;
        let runs = self.origins.chunk_by(|a, b| (a.node, a.instance) == (b.node, b.instance)).map(|run| {
            start += run.len();
            start - run.len()..start
        });
        runs.collect()
    }

    /// The vertices of an instance. They follow each other, too.
    fn vertices(&self, instance: &Range<usize>) -> Range<usize> {
        let origins = &self.origins[instance.clone()];
        let start = origins.iter().map(|origin| origin.vertices.start).min().unwrap_or(0);
        let end = origins.iter().map(|origin| origin.vertices.end).max().unwrap_or(0);
        start as usize..end as usize
    }

    /// The meshes that nodes outside the scene name.
    fn meshes_outside(&self, document: &Document) -> BTreeSet<usize> {
        let inside: BTreeSet<usize> = self.origins.iter().map(|origin| origin.node).collect();
        let outside = document.nodes.iter().enumerate().filter(|(node, _)| !inside.contains(node));
        outside.filter_map(|(_, node)| node.mesh).collect()
    }

    fn copy_mesh(&mut self, mesh: usize) -> Result<usize, Problem> {
        let copy = array(&mut self.json, "meshes")?.get(mesh).cloned();
        let copy = copy.ok_or_else(|| broken(format!("there is no meshes[{mesh}]")))?;
        push(&mut self.json, "meshes", copy)
    }

    fn name_mesh(&mut self, node: usize, mesh: usize) -> Result<(), Problem> {
        let fields = array(&mut self.json, "nodes")?.get_mut(node).and_then(Value::as_object_mut);
        let fields = fields.ok_or_else(|| broken(format!("nodes[{node}] is not an object")))?;
        fields.insert("mesh".to_owned(), mesh.into());
        Ok(())
    }
}
