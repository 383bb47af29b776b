//! From a glTF document to a scene: every primitive of every instance, transformed to the world once.
//!
//! World position = M·p in f64, rounded to f32 once; normals take the inverse transpose of M. Where
//! det M < 0, the last two corners of each triangle change places, so that what was the front stays the front. Vertices of
//! primitives that share their accessors are shared in the scene, too. M is the transform of the node, of an instance at it,
//! or of a vertex by its joints.
//!
//! How much there will be is counted first, from the counts of the accessors alone: then memory is asked for once.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.7 "Concrete Geometry"; Kenneth
//! Turkowski, "Properties of Surface-Normal Transformations", Graphics Gems, 1990.

use std::collections::HashMap;
use std::rc::Rc;

use umbel_core::glam::{DAffine3, DMat3, DVec3};

use crate::error::Problem;
use crate::files::budget::Budget;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{
    Node, Primitive, Surface, TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES, broken, named, triangle_count,
};
use crate::formats::gltf::instancing::Copies;
use crate::formats::gltf::nodes::{Instance, instances, places};
use crate::formats::gltf::optics::optics;
use crate::formats::gltf::options::{GltfOptions, GltfOrigin};
use crate::formats::gltf::plan::{Part, Plan};
use crate::formats::gltf::pose::{Joints, Place, joint_matrices};
use crate::formats::gltf::tally::Tally;
use crate::scene::{Material, NO_INDEX, Object, Scene};

/// Makes the scene, without a name, and tells where each part of it comes from. Positions are kept
/// in f64 as well if `is_wide`.
pub(crate) fn build(
    (data, options): (Data<'_>, &GltfOptions),
    budget: &Budget,
    is_wide: bool,
) -> Result<Built, Problem> {
    let instances = instances(data.document)?;
    let plan = Plan::of(&instances, data, options.uv_set)?;
    let bytes = plan.bytes(is_wide);
    budget.check(bytes, &format!("{} triangles and {} vertices", plan.triangles, plan.vertices))?;
    let scene = Scene { uv_v_down: true, materials: materials(data), ..Scene::default() };
    let mut builder = Builder {
        data,
        options,
        scene,
        is_wide,
        wide: Vec::new(),
        origins: Vec::new(),
        vertices: HashMap::new(),
        nodes: Vec::new(),
        has_normals: false,
        has_uvs: false,
        tally: Tally::default(),
    };
    builder.make_room(&plan)?;
    for instance in &instances {
        builder.take_node(instance)?;
    }
    let Builder { mut scene, origins, tally, wide, .. } = builder;
    for indices in [&mut scene.uv_indices, &mut scene.normal_indices] {
        if indices.iter().flatten().all(|&index| index == NO_INDEX) {
            *indices = Vec::new();
        }
    }
    tally.warn(&mut scene);
    Ok(Built { scene, origins, wide })
}

/// A scene, and what is known of it beside it.
pub(crate) struct Built {
    pub(crate) scene: Scene,
    pub(crate) origins: Vec<GltfOrigin>,
    /// The positions in the file's frame, if they were asked for.
    pub(crate) wide: Vec<DVec3>,
}

/// All materials of the file, in its order.
fn materials(data: Data<'_>) -> Vec<Material> {
    let material = |surface: &Surface| {
        let [diffuse @ .., _] = surface.pbr_metallic_roughness.base_color_factor.unwrap_or([1.0; 4]);
        let diffuse = diffuse.map(|part| part.clamp(0.0, 1.0));
        Material { name: surface.name.clone(), diffuse, optics: optics(surface, diffuse) }
    };
    data.document.materials.iter().map(material).collect()
}

/// The vertices of one or several primitives of an instance, at their place in the scene.
struct Vertices {
    first: u32,
    count: u32,
    first_normal: Option<u32>,
    first_uv: Option<u32>,
    /// Which positions are not finite; empty where all are.
    spoilt: Vec<bool>,
    /// Where space is mirrored; may be empty where it is nowhere.
    mirrored: Vec<bool>,
}

struct Builder<'a> {
    data: Data<'a>,
    options: &'a GltfOptions,
    scene: Scene,
    is_wide: bool,
    wide: Vec<DVec3>,
    origins: Vec<GltfOrigin>,
    /// Those of the instance that is being taken, by what they are made of.
    vertices: HashMap<Vec<usize>, Rc<Vertices>>,
    /// Where all nodes stand, once a skin has asked.
    nodes: Vec<Option<DAffine3>>,
    /// Whether any triangle has some.
    has_normals: bool,
    has_uvs: bool,
    tally: Tally,
}

/// One of the places of a mesh.
struct Standing<'a> {
    instance: &'a Instance,
    node: &'a Node,
    /// Which of the node's instances.
    copy: u32,
    to_world: DAffine3,
    /// The matrices of the joints, for a node with a skin.
    joints: Option<&'a [DAffine3]>,
}

impl<'a> Builder<'a> {
    /// Asks for all the memory that the scene will take.
    fn make_room(&mut self, plan: &Plan) -> Result<(), Problem> {
        let Scene { positions, normals, uvs, triangles, normal_indices, uv_indices, .. } = &mut self.scene;
        index_of(plan.vertices)?;
        index_of(plan.triangles)?;
        reserve(positions, plan.vertices)?;
        reserve(normals, plan.normals)?;
        reserve(uvs, plan.uvs)?;
        reserve(triangles, plan.triangles)?;
        reserve(normal_indices, if plan.normals > 0 { plan.triangles } else { 0 })?;
        reserve(uv_indices, if plan.uvs > 0 { plan.triangles } else { 0 })?;
        self.has_normals = plan.normals > 0;
        self.has_uvs = plan.uvs > 0;
        reserve(&mut self.wide, if self.is_wide { plan.vertices } else { 0 })?;
        reserve(&mut self.origins, plan.parts)?;
        reserve(&mut self.scene.objects, plan.parts)
    }

    /// Takes the mesh of a node, at each of its places.
    fn take_node(&mut self, instance: &Instance) -> Result<(), Problem> {
        let document = self.data.document;
        let (node, place) = (&document.nodes[instance.node], format!("nodes[{}]", instance.node));
        let joints = match node.skin {
            Some(skin) => {
                if self.nodes.is_empty() {
                    self.nodes = places(document);
                }
                Some(joint_matrices(self.data, (skin, &place), &self.nodes)?)
            }
            None => None,
        };
        let copies = Copies::of(node, self.data, &place)?;
        // Joints alone say where a skinned mesh stands, and they do so once.
        let copies = copies.filter(|_| {
            joints.is_none() || {
                self.tally.skinned_copies += 1;
                false
            }
        });
        let places = match copies {
            Some(copies) => copies.places(self.data, &place)?,
            None => vec![DAffine3::IDENTITY],
        };
        let mesh = named(&document.meshes, instance.mesh, "meshes", &place)?;
        for (copy, at) in (0_u32..).zip(places) {
            self.vertices.clear();
            let to_world = instance.to_world * at;
            let standing = Standing { instance, node, copy, to_world, joints: joints.as_deref() };
            for index in 0..mesh.primitives.len() {
                self.take_primitive(&standing, index)?;
            }
        }
        Ok(())
    }

    /// Takes a primitive of an instance, with its vertices where no other primitive has brought them.
    fn take_primitive(&mut self, standing: &Standing<'_>, index: usize) -> Result<(), Problem> {
        let Standing { instance, node, .. } = *standing;
        let mesh = &self.data.document.meshes[instance.mesh];
        let primitive = &mesh.primitives[index];
        let place = format!("meshes[{}].primitives[{index}]", instance.mesh);
        let Some(part) = Part::of((node, mesh, primitive), self.options.uv_set, (self.data, &place))? else {
            self.tally.not_triangles += 1;
            return Ok(());
        };
        let key = part.key();
        let vertices = match self.vertices.get(&key) {
            Some(known) => known.clone(),
            None => {
                let vertices = Rc::new(self.take_vertices(&part, standing, &place)?);
                self.vertices.insert(key, vertices.clone());
                vertices
            }
        };
        let start = index_of(self.scene.triangles.len())?;
        self.take_triangles(primitive, &vertices, &place)?;
        let triangles = start..index_of(self.scene.triangles.len())?;
        if !triangles.is_empty() {
            let name = if node.name.is_empty() { &mesh.name } else { &node.name };
            if let Some(material) = primitive.material {
                named(&self.data.document.materials, material, "materials", &place)?;
            }
            let material = primitive.material.map(index_of).transpose()?;
            self.scene.objects.push(Object { name: name.clone(), triangles: triangles.clone(), material });
        }
        self.origins.push(GltfOrigin {
            node: instance.node,
            instance: standing.copy,
            mesh: instance.mesh,
            primitive: index,
            triangles,
            vertices: vertices.first..vertices.first + vertices.count,
            has_uvs: part.uvs.is_some(),
        });
        Ok(())
    }

    /// What takes the vertices of a part to the world.
    fn place(&mut self, part: &Part<'_>, standing: &Standing<'_>, place: &str) -> Result<Place, Problem> {
        let Some(matrices) = standing.joints else {
            return Ok(Place::Rigid(standing.to_world));
        };
        if part.joints.is_empty() {
            self.tally.jointless += 1;
            return Ok(Place::Rigid(standing.to_world));
        }
        let joints = Joints::new(matrices.to_vec(), (part.primitive, part.count), (self.data, place))?;
        self.tally.unbound += joints.unbound;
        Ok(Place::Skinned(joints))
    }

    /// Takes vertices to the world.
    fn take_vertices(
        &mut self,
        part: &Part<'_>,
        standing: &Standing<'_>,
        place: &str,
    ) -> Result<Vertices, Problem> {
        let to_world = self.place(part, standing, place)?;
        let mut positions: Vec<[f64; 3]> = self.data.vectors(part.positions, place)?;
        part.morph.apply(("POSITION", &mut positions), (self.data, place))?;
        let first = self.scene.positions.len();
        index_of(first.saturating_add(positions.len()))?;
        for (vertex, &position) in positions.iter().enumerate() {
            let world = to_world.at(vertex).transform_point3(DVec3::from_array(position));
            self.scene.positions.push(to_f32(world));
            if self.is_wide {
                self.wide.push(world);
            }
        }
        let spoilt = self.find_spoilt(first, place)?;
        let is_mirrored = |vertex: usize| to_world.at(vertex).matrix3.determinant() < 0.0;
        let mirrored = match &to_world {
            Place::Rigid(_) => vec![true; if is_mirrored(0) { positions.len() } else { 0 }],
            Place::Skinned(_) => (0..positions.len()).map(is_mirrored).collect(),
        };
        let (first, count) = (index_of(first)?, index_of(positions.len())?);
        let first_normal = self.take_normals(part, &to_world, place)?;
        let first_uv = self.take_uvs(part, place)?;
        Ok(Vertices { first, count, first_normal, first_uv, spoilt, mirrored })
    }

    /// Takes the normals of a part, if it has any, and tells where they begin.
    fn take_normals(
        &mut self,
        part: &Part<'_>,
        to_world: &Place,
        place: &str,
    ) -> Result<Option<u32>, Problem> {
        let Some(accessor) = part.normals else { return Ok(None) };
        let mut normals: Vec<[f64; 3]> = self.data.vectors(accessor, place)?;
        check_length(normals.len(), part.count, "NORMAL", place)?;
        part.morph.apply(("NORMAL", &mut normals), (self.data, place))?;
        let first = index_of(self.scene.normals.len())?;
        let rigid = match to_world {
            Place::Rigid(to_world) => Some(inverse_transpose(&to_world.matrix3)),
            Place::Skinned(_) => None,
        };
        for (vertex, &normal) in normals.iter().enumerate() {
            let matrix = rigid.unwrap_or_else(|| inverse_transpose(&to_world.at(vertex).matrix3));
            let world = (matrix * DVec3::from_array(normal)).normalize_or_zero();
            self.scene.normals.push(to_f32(world));
        }
        self.tally.normals += normals.iter().filter(|n| !n.iter().all(|x| x.is_finite())).count();
        Ok(Some(first))
    }

    /// Takes the texture coordinates of a part, if it has any, and tells where they begin.
    fn take_uvs(&mut self, part: &Part<'_>, place: &str) -> Result<Option<u32>, Problem> {
        let Some(accessor) = part.uvs else { return Ok(None) };
        let uvs: Vec<[f64; 2]> = self.data.vectors(accessor, place)?;
        check_length(uvs.len(), part.count, "TEXCOORD", place)?;
        let first = self.scene.uvs.len();
        self.scene.uvs.extend(uvs.iter().map(|uv| uv.map(|x| x as f32)));
        let is_spoilt = |uv: &&mut [f32; 2]| !uv.iter().all(|x| x.is_finite());
        let spoilt = self.scene.uvs[first..].iter_mut().filter(is_spoilt);
        self.tally.uvs += spoilt.map(|uv| *uv = [0.0; 2]).count();
        self.tally.moved_uvs += usize::from(part.moves_uvs(self.options.uv_set));
        index_of(first).map(Some)
    }

    /// Refuses positions from `first` on that are not finite, or sets them to 0 and flags them.
    fn find_spoilt(&mut self, first: usize, place: &str) -> Result<Vec<bool>, Problem> {
        let positions = &mut self.scene.positions[first..];
        let is_spoilt = |position: &[f32; 3]| !position.iter().all(|x| x.is_finite());
        let Some(vertex) = positions.iter().position(is_spoilt) else {
            return Ok(Vec::new());
        };
        if !self.options.drop_non_finite {
            return Err(Problem {
                line: None,
                what: format!("vertex {vertex} of {place} is NaN or infinite in the world"),
                remedy: "Correct the file, or leave out such triangles: GltfOptions::drop_non_finite.",
            });
        }
        let spoilt: Vec<bool> = positions.iter().map(is_spoilt).collect();
        positions.iter_mut().filter(|position| is_spoilt(position)).for_each(|p| *p = [0.0; 3]);
        self.tally.spoilt += spoilt.iter().filter(|&&is_spoilt| is_spoilt).count();
        Ok(spoilt)
    }

    fn take_triangles(
        &mut self,
        primitive: &Primitive,
        vertices: &Vertices,
        place: &str,
    ) -> Result<(), Problem> {
        let indices = primitive.indices.map(|accessor| self.data.indices(accessor, place)).transpose()?;
        let count = indices.as_ref().map_or(vertices.count as usize, Vec::len);
        if let Some(&index) = indices.iter().flatten().find(|&&index| index >= vertices.count) {
            return Err(broken(format!(
                "{place} has the index {index}, but only {} vertices",
                vertices.count
            )));
        }
        let triangles = triangle_count(primitive.mode, count);
        self.tally.left_over += if primitive.mode == TRIANGLES { count % 3 } else { 0 };
        for k in 0..triangles {
            let [a, b, c] = corners(primitive.mode, k)
                .map(|corner| indices.as_ref().map_or(corner as u32, |indices| indices[corner]));
            if [a, b, c].into_iter().any(|v| vertices.spoilt.get(v as usize) == Some(&true)) {
                self.tally.dropped += 1;
                continue;
            }
            let is_mirrored = |&v: &u32| vertices.mirrored.get(v as usize) == Some(&true);
            let is_turned = [a, b, c].into_iter().filter(is_mirrored).count() > 1;
            let triangle = if is_turned { [a, c, b] } else { [a, b, c] };
            let from = |first: Option<u32>| first.map_or([NO_INDEX; 3], |first| triangle.map(|v| first + v));
            self.scene.triangles.push(triangle.map(|v| vertices.first + v));
            if self.has_normals {
                self.scene.normal_indices.push(from(vertices.first_normal));
            }
            if self.has_uvs {
                self.scene.uv_indices.push(from(vertices.first_uv));
            }
        }
        Ok(())
    }
}

/// The places of triangle k's corners among the indices: of lists, strips (every other one turned round) and fans.
fn corners(mode: u32, k: usize) -> [usize; 3] {
    match mode {
        TRIANGLE_STRIP => [k, k + 1 + k % 2, k + 2 - k % 2],
        TRIANGLE_FAN => [k + 1, k + 2, 0],
        _ => [3 * k, 3 * k + 1, 3 * k + 2],
    }
}

/// The inverse transpose but for a positive factor: the cofactors with the sign of the determinant. It exists for singular M, too.
fn inverse_transpose(m: &DMat3) -> DMat3 {
    let cofactors =
        DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}

fn to_f32(vector: DVec3) -> [f32; 3] {
    vector.to_array().map(|x| x as f32)
}

fn check_length(count: usize, vertices: usize, what: &str, place: &str) -> Result<(), Problem> {
    if count == vertices {
        return Ok(());
    }
    Err(broken(format!("{place} has {vertices} positions, but {count} elements of {what}")))
}

/// A number that fits an index; the greatest one stands for "none".
fn index_of(count: usize) -> Result<u32, Problem> {
    u32::try_from(count).ok().filter(|&index| index < NO_INDEX).ok_or_else(|| Problem {
        line: None,
        what: "the scene has more vertices or triangles than 32-bit ids can name".to_owned(),
        remedy: "Split it into several files.",
    })
}

/// Makes room. The system may have less than the budget allows.
fn reserve<T>(list: &mut Vec<T>, count: usize) -> Result<(), Problem> {
    list.try_reserve_exact(count).map_err(|_| Problem {
        line: None,
        what: format!("there is no memory for {count} elements of the scene"),
        remedy: "Split the file, or take out instances.",
    })
}
