//! From a glTF document to a scene: every primitive of every instance, transformed to the world once.
//!
//! World position = M·p in f64, rounded to f32 once; normals take the inverse transpose of M. Where det M < 0, the last two
//! corners of each triangle change places, so that what was the front stays the front. Vertices of primitives that share
//! their accessors are shared in the scene, too.
//!
//! Based on: Khronos Group, "glTF 2.0 Specification", version 2.0.1, 2021, section 3.7 "Concrete Geometry"; Kenneth
//! Turkowski, "Properties of Surface-Normal Transformations", Graphics Gems, 1990.

use umbel_core::glam::{DAffine3, DMat3, DVec3};

use crate::error::Problem;
use crate::formats::gltf::accessor::Data;
use crate::formats::gltf::document::{
    Primitive, Surface, TRIANGLE_FAN, TRIANGLE_STRIP, TRIANGLES, broken, named,
};
use crate::formats::gltf::extensions::{DRACO, compressed};
use crate::formats::gltf::nodes::{Instance, instances};
use crate::formats::gltf::optics::optics;
use crate::formats::gltf::options::{GltfOptions, GltfOrigin};
use crate::scene::{Material, NO_INDEX, Object, Scene};

/// Makes the scene, without a name, and tells where each part of it comes from.
pub(crate) fn build(data: Data<'_>, options: &GltfOptions) -> Result<(Scene, Vec<GltfOrigin>), Problem> {
    let scene = Scene { uv_v_down: true, materials: materials(data), ..Scene::default() };
    let mut builder =
        Builder { data, options, scene, origins: Vec::new(), vertices: Vec::new(), tally: Tally::default() };
    for instance in &instances(data.document)? {
        builder.vertices.clear();
        let place = format!("nodes[{}]", instance.node);
        let mesh = named(&data.document.meshes, instance.mesh, "meshes", &place)?;
        for index in 0..mesh.primitives.len() {
            builder.take_primitive(instance, index)?;
        }
    }
    let Builder { mut scene, origins, tally, .. } = builder;
    for indices in [&mut scene.uv_indices, &mut scene.normal_indices] {
        if indices.iter().flatten().all(|&index| index == NO_INDEX) {
            indices.clear();
        }
    }
    tally.warn(data, &mut scene);
    Ok((scene, origins))
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

/// What is left out or mended, to be counted in warnings.
#[derive(Debug, Default)]
struct Tally {
    not_triangles: usize,
    left_over: usize,
    spoilt: usize,
    dropped: usize,
    normals: usize,
    uvs: usize,
    morphed: usize,
}

impl Tally {
    fn warn(&self, data: Data<'_>, scene: &mut Scene) {
        let nodes = &data.document.nodes;
        let skinned = nodes.iter().filter(|node| node.mesh.is_some() && node.skin.is_some()).count();
        let gpu = nodes.iter().filter(|node| node.extensions.contains_key("EXT_mesh_gpu_instancing")).count();
        let counts = [
            (self.not_triangles, "primitives that are points, lines or without positions are left out"),
            (self.left_over, "indices behind the last whole triangle are left out"),
            (self.normals, "normals that are not finite become 0"),
            (self.uvs, "texture coordinates that are not finite become 0"),
            (skinned, "skinned meshes stand in their bind pose"),
            (self.morphed, "morph targets are ignored, their primitives stand as they are without weights"),
            (gpu, "nodes with EXT_mesh_gpu_instancing stand once each"),
        ];
        for (count, what) in counts.into_iter().filter(|&(count, _)| count > 0) {
            scene.warnings.push(format!("{what}: {count}"));
        }
        if self.spoilt > 0 {
            let Self { spoilt, dropped, .. } = self;
            scene.warnings.push(format!(
                "vertices that are not finite: {spoilt}; triangles left out with them: {dropped}"
            ));
        }
        if scene.triangles.is_empty() {
            let what = format!("the file has no triangles ({} vertices)", scene.positions.len());
            scene.warnings.push(what);
        }
    }
}

/// The vertices of one or several primitives of an instance, at their place in the scene.
#[derive(Debug, Clone)]
struct Vertices {
    /// The accessors of positions, normals and texture coordinates.
    key: [Option<usize>; 3],
    first: u32,
    count: u32,
    first_normal: Option<u32>,
    first_uv: Option<u32>,
    /// Which positions are not finite; empty where all are.
    spoilt: Vec<bool>,
}

struct Builder<'a> {
    data: Data<'a>,
    options: &'a GltfOptions,
    scene: Scene,
    origins: Vec<GltfOrigin>,
    /// Those of the instance that is being taken.
    vertices: Vec<Vertices>,
    tally: Tally,
}

impl Builder<'_> {
    /// Takes a primitive of an instance, with its vertices where no other primitive has brought them.
    fn take_primitive(&mut self, instance: &Instance, index: usize) -> Result<(), Problem> {
        let mesh = &self.data.document.meshes[instance.mesh];
        let primitive = &mesh.primitives[index];
        let place = format!("meshes[{}].primitives[{index}]", instance.mesh);
        let attribute = |name: &str| primitive.attributes.get(name).copied();
        let is_surface = matches!(primitive.mode, TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN);
        let Some(positions) = attribute("POSITION").filter(|_| is_surface) else {
            self.tally.not_triangles += 1;
            return Ok(());
        };
        if primitive.extensions.contains_key(DRACO) && !self.data.has_data(positions) {
            return Err(compressed(&format!("{place} is"), DRACO));
        }
        self.tally.morphed += usize::from(!primitive.targets.is_empty());
        let uvs = attribute(&format!("TEXCOORD_{}", self.options.uv_set));
        let key = [Some(positions), attribute("NORMAL"), uvs];
        let known = self.vertices.iter().position(|vertices| vertices.key == key);
        let vertices = match known {
            Some(known) => self.vertices[known].clone(),
            None => {
                let vertices = self.take_vertices(key, &instance.to_world, &place)?;
                self.vertices.push(vertices.clone());
                vertices
            }
        };
        let flip = instance.to_world.matrix3.determinant() < 0.0;
        let start = index_of(self.scene.triangles.len())?;
        self.take_triangles(primitive, &vertices, flip, &place)?;
        let triangles = start..index_of(self.scene.triangles.len())?;
        let node = &self.data.document.nodes[instance.node];
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
            mesh: instance.mesh,
            primitive: index,
            triangles,
            vertices: vertices.first..vertices.first + vertices.count,
            has_uvs: uvs.is_some(),
        });
        Ok(())
    }

    /// Transforms the vertices of some accessors to the world.
    fn take_vertices(
        &mut self,
        key: [Option<usize>; 3],
        to_world: &DAffine3,
        place: &str,
    ) -> Result<Vertices, Problem> {
        let [positions, normals, uvs] = key;
        let positions: Vec<[f64; 3]> = self.data.vectors(positions.unwrap_or(0), place)?;
        let first = self.scene.positions.len();
        index_of(first.saturating_add(positions.len()))?;
        reserve(&mut self.scene.positions, positions.len())?;
        let world = positions.iter().map(|&p| to_f32(to_world.transform_point3(DVec3::from_array(p))));
        self.scene.positions.extend(world);
        let spoilt = self.find_spoilt(first, place)?;
        let mut vertices = Vertices {
            key,
            first: index_of(first)?,
            count: index_of(positions.len())?,
            first_normal: None,
            first_uv: None,
            spoilt,
        };
        if let Some(accessor) = normals {
            let normals: Vec<[f64; 3]> = self.data.vectors(accessor, place)?;
            check_length(normals.len(), positions.len(), "NORMAL", place)?;
            vertices.first_normal = Some(index_of(self.scene.normals.len())?);
            reserve(&mut self.scene.normals, normals.len())?;
            let inverse_transpose = inverse_transpose(&to_world.matrix3);
            let world = |&n: &[f64; 3]| (inverse_transpose * DVec3::from_array(n)).normalize_or_zero();
            self.scene.normals.extend(normals.iter().map(|n| to_f32(world(n))));
            self.tally.normals += normals.iter().filter(|n| !n.iter().all(|x| x.is_finite())).count();
        }
        if let Some(accessor) = uvs {
            let uvs: Vec<[f64; 2]> = self.data.vectors(accessor, place)?;
            check_length(uvs.len(), positions.len(), "TEXCOORD", place)?;
            let first = self.scene.uvs.len();
            vertices.first_uv = Some(index_of(first)?);
            reserve(&mut self.scene.uvs, uvs.len())?;
            self.scene.uvs.extend(uvs.iter().map(|uv| uv.map(|x| x as f32)));
            let is_spoilt = |uv: &&mut [f32; 2]| !uv.iter().all(|x| x.is_finite());
            let spoilt = self.scene.uvs[first..].iter_mut().filter(is_spoilt);
            self.tally.uvs += spoilt.map(|uv| *uv = [0.0; 2]).count();
        }
        Ok(vertices)
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
        flip: bool,
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
        index_of(self.scene.triangles.len().saturating_add(triangles))?;
        for list in [&mut self.scene.triangles, &mut self.scene.normal_indices, &mut self.scene.uv_indices] {
            reserve(list, triangles)?;
        }
        for k in 0..triangles {
            let [a, b, c] = corners(primitive.mode, k)
                .map(|corner| indices.as_ref().map_or(corner as u32, |indices| indices[corner]));
            if [a, b, c].into_iter().any(|v| vertices.spoilt.get(v as usize) == Some(&true)) {
                self.tally.dropped += 1;
                continue;
            }
            let triangle = if flip { [a, c, b] } else { [a, b, c] };
            let from = |first: Option<u32>| first.map_or([NO_INDEX; 3], |first| triangle.map(|v| first + v));
            self.scene.triangles.push(triangle.map(|v| vertices.first + v));
            self.scene.normal_indices.push(from(vertices.first_normal));
            self.scene.uv_indices.push(from(vertices.first_uv));
        }
        Ok(())
    }
}

/// How many triangles some indices make.
fn triangle_count(mode: u32, indices: usize) -> usize {
    if mode == TRIANGLES { indices / 3 } else { indices.saturating_sub(2) }
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

/// Makes room. Few bytes of instances can stand for many triangles.
fn reserve<T>(list: &mut Vec<T>, more: usize) -> Result<(), Problem> {
    list.try_reserve(more).map_err(|_| Problem {
        line: None,
        what: format!("there is no memory for all instances, at {} elements", list.len()),
        remedy: "Split the file, or take out instances.",
    })
}
