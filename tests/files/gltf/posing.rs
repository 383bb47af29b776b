//! Where meshes stand at rest: by skins, by morph targets at their default weights, by instances.

use common::place;
use serde_json::{Value, json};
use umbel::formats::{GltfFile, GltfOptions, VertexTarget};
use umbel::{Error, Scene};

use super::making::{BYTE, Folder, Making, SQUARE, UNSIGNED_BYTE, Written, png};

/// The square with all vertices bound to joints and weights, at a node that stands elsewhere. Joints are nodes 1, 2 ...
pub(crate) fn skinned(joints: &[Value], bound: [[u8; 4]; 4], weights: [[f32; 4]; 4]) -> Making {
    let mut making = Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        primitive["attributes"]["NORMAL"] = making.floats(&[[0., 0., 1.]; 4]).into();
        primitive["attributes"]["JOINTS_0"] =
            making.accessor(bound.as_flattened(), UNSIGNED_BYTE, "VEC4", 4).into();
        primitive["attributes"]["WEIGHTS_0"] = making.floats(&weights).into();
        primitive
    });
    making.json["nodes"][0]["translation"] = json!([100, 0, 0]);
    making.json["nodes"][0]["skin"] = 0.into();
    let nodes: Vec<usize> = joints.iter().map(|joint| making.node(joint.clone())).collect();
    making.push("skins", json!({ "joints": nodes }));
    making
}

/// Inverse bind matrices from their columns.
fn bind(making: &mut Making, matrices: &[[f32; 16]]) {
    let bytes: Vec<u8> = matrices.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let accessor = making.accessor(&bytes, 5126, "MAT4", matrices.len());
    making.json["skins"][0]["inverseBindMatrices"] = accessor.into();
}

fn scaling(x: f32, y: f32, z: f32) -> [f32; 16] {
    [x, 0., 0., 0., 0., y, 0., 0., 0., 0., z, 0., 0., 0., 0., 1.]
}

pub(crate) const FIRST: [[f32; 4]; 4] = [[1., 0., 0., 0.]; 4];

fn moved(by: [f32; 3]) -> Vec<[f32; 3]> {
    SQUARE.iter().map(|p| std::array::from_fn(|k| p[k] + by[k])).collect()
}

#[test]
fn joints_alone_place_a_skinned_mesh() {
    let making = skinned(&[json!({ "translation": [0, 5, 0] })], [[0; 4]; 4], FIRST);
    let scene = making.read();
    assert_eq!((scene.positions, scene.warnings.len()), (moved([0., 5., 0.]), 0));
    // The inverse bind matrix undoes what scaled the joint, and a child of the mesh's node does follow that.
    let mut making = skinned(&[json!({ "scale": [0.5, 0.5, 0.5] })], [[0; 4]; 4], FIRST);
    bind(&mut making, &[scaling(2., 2., 2.)]);
    let child = making.push("nodes", json!({ "mesh": 0 }));
    making.json["nodes"][0]["children"] = json!([child]);
    let scene = making.read();
    assert_eq!(scene.positions[..4], SQUARE);
    assert_eq!(scene.positions[4..], moved([100., 0., 0.]));
    // Two nodes that share a skin stand in one place.
    making.node(json!({ "mesh": 0, "skin": 0, "translation": [7, 7, 7] }));
    assert_eq!(making.read().positions[8..], SQUARE);
}

#[test]
fn vertices_stand_between_their_joints() {
    let joints = [json!({ "translation": [0, 0, 4] }), json!({ "translation": [0, 0, 8] })];
    let weights = [[1., 0., 0., 0.], [0., 1., 0., 0.], [0.5, 0.5, 0., 0.], [0.25, 0.25, 0., 0.]];
    let scene = skinned(&joints, [[0, 1, 0, 0]; 4], weights).read();
    let heights: Vec<f32> = scene.positions.iter().map(|p| p[2]).collect();
    // Weights whose sum is not 1 are divided by it.
    assert_eq!(heights, [4., 8., 6., 6.]);
    // Joints of weight 0 may name anything; vertices without weights follow their first joint.
    let weights = [[1., 0., 0., 0.], [1., 0., 0., 0.], [1., 0., 0., 0.], [0.; 4]];
    let scene = skinned(&joints, [[0, 77, 0, 0], [0, 77, 0, 0], [1, 77, 0, 0], [1, 0, 0, 0]], weights).read();
    assert_eq!(scene.positions.iter().map(|p| p[2]).collect::<Vec<_>>(), [4., 4., 8., 8.]);
    assert!(
        scene.warnings.iter().any(|warning| warning.contains("without weights") && warning.ends_with(": 1"))
    );
}

#[test]
fn joints_may_hang_below_others_and_outside_of_the_scene() {
    let mut making = skinned(&[json!({ "translation": [0, 1, 0] })], [[0; 4]; 4], FIRST);
    let root = making.push("nodes", json!({ "children": [1], "translation": [0, 0, 3] }));
    making.json["scenes"][0]["nodes"] = json!([0]);
    assert_eq!(making.read().positions, moved([0., 1., 3.]));
    making.json["scenes"][0]["nodes"] = json!([0, root]);
    assert_eq!(making.read().positions, moved([0., 1., 3.]));
}

#[test]
fn normals_and_fronts_follow_the_joints() {
    let turned =
        json!({ "rotation": [std::f64::consts::FRAC_1_SQRT_2, 0, 0, std::f64::consts::FRAC_1_SQRT_2] });
    let scene = skinned(&[turned], [[0; 4]; 4], FIRST).read();
    assert!((scene.normals[0][1] + 1.0).abs() < 1e-6, "{:?}", scene.normals[0]);
    let plain = skinned(&[json!({})], [[0; 4]; 4], FIRST).read();
    let mirrored = skinned(&[json!({ "scale": [-1, 1, 1] })], [[0; 4]; 4], FIRST).read();
    assert_eq!(plain.triangles[0], [0, 1, 2]);
    assert_eq!(mirrored.triangles[0], [0, 2, 1]);
    // The node's own mirror is none of theirs.
    let mut making = skinned(&[json!({})], [[0; 4]; 4], FIRST);
    making.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    assert_eq!(making.read().triangles, plain.triangles);
}

#[test]
fn further_sets_of_joints_count() {
    let mut making = skinned(&[json!({}), json!({ "translation": [0, 0, 8] })], [[0; 4]; 4], FIRST);
    let joints = making.accessor(&[1; 16], UNSIGNED_BYTE, "VEC4", 4);
    let weights = making.floats(&[[1., 0., 0., 0.]; 4]);
    let attributes = &mut making.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_1"] = joints.into();
    attributes["WEIGHTS_1"] = weights.into();
    assert_eq!(making.read().positions, moved([0., 0., 4.]));
}

#[test]
fn broken_skins_are_refused_and_missing_joints_told() {
    let good = || skinned(&[json!({})], [[0; 4]; 4], FIRST);
    let spoil = |change: &dyn Fn(&mut Making)| {
        let mut making = good();
        change(&mut making);
        making.refusal()
    };
    assert!(spoil(&|making| making.json["nodes"][0]["skin"] = 3.into()).contains("skins[3]"));
    assert!(spoil(&|making| making.json["skins"][0]["joints"] = json!([9])).contains("nodes[9]"));
    assert!(spoil(&|making| making.json["skins"][0]["joints"] = json!([])).contains("joint"));
    assert!(spoil(&|making| bind(making, &[])).contains("fewer inverse bind matrices"));
    assert!(
        skinned(&[json!({})], [[0, 5, 0, 0]; 4], [[0.5, 0.5, 0., 0.]; 4]).refusal().contains("a joint 5")
    );
    // A joint that is its own ancestor.
    assert!(
        spoil(&|making| {
            let own = making.push("nodes", json!({ "children": [2] }));
            making.json["skins"][0]["joints"] = json!([own]);
        })
        .contains("own ancestor")
    );
    let mut making = good();
    making.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("JOINTS_0");
    let scene = making.read();
    assert_eq!(scene.positions, moved([100., 0., 0.]));
    assert!(
        scene.warnings.iter().any(|warning| warning.contains("without joints") && warning.ends_with(": 1"))
    );
}

/// The square with a target that moves its vertices by these steps.
pub(crate) fn morphed(steps: &[[f32; 3]]) -> Making {
    Making::with_primitive(|making| {
        let mut primitive = making.square_primitive();
        let targets: Vec<Value> =
            steps.iter().map(|step| json!({ "POSITION": making.floats(&[*step; 4]) })).collect();
        primitive["targets"] = targets.into();
        primitive
    })
}

#[test]
fn morph_targets_stand_at_their_default_weights() {
    let mut making = morphed(&[[0., 4., 0.], [0., 0., 2.]]);
    let scene = making.read();
    assert_eq!((scene.positions, scene.warnings.len()), (SQUARE.to_vec(), 0));
    making.json["meshes"][0]["weights"] = json!([0.5, 0]);
    let scene = making.read();
    assert_eq!((scene.positions, scene.warnings.len()), (moved([0., 2., 0.]), 0));
    // Those of a node go before.
    making.json["nodes"][0]["weights"] = json!([1, -1]);
    making.node(json!({ "mesh": 0 }));
    let positions = making.read().positions;
    assert_eq!(positions[..4], moved([0., 4., -2.]));
    assert_eq!(positions[4..], moved([0., 2., 0.]));
    // Fewer weights than targets, and targets without positions.
    making.json["nodes"][0]["weights"] = json!([2]);
    making.json["meshes"][0]["primitives"][0]["targets"][1] = json!({ "NORMAL": 0 });
    assert_eq!(making.read().positions[..4], moved([0., 8., 0.]));
    making.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = 2.into();
    assert!(making.refusal().contains("VEC3"));
}

#[test]
fn primitives_share_vertices_only_if_they_are_moved_alike() {
    let mut making = morphed(&[[0., 4., 0.]]);
    let mut other = making.json["meshes"][0]["primitives"][0].clone();
    making.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other.clone());
    other.as_object_mut().unwrap().remove("targets");
    making.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(other);
    assert_eq!(making.read().positions.len(), 4);
    making.json["meshes"][0]["weights"] = json!([1]);
    let scene = making.read();
    assert_eq!(scene.positions, [moved([0., 4., 0.]), SQUARE.to_vec()].concat());
    assert_eq!(scene.triangles[4], [4, 5, 6]);
}

#[test]
fn a_morphed_mesh_is_then_skinned() {
    let mut making = skinned(&[json!({ "translation": [0, 5, 0] })], [[0; 4]; 4], FIRST);
    let step = making.floats(&[[1., 0., 0.]; 4]);
    making.json["meshes"][0]["primitives"][0]["targets"] = json!([{ "POSITION": step }]);
    making.json["meshes"][0]["weights"] = json!([3]);
    assert_eq!(making.read().positions, moved([3., 5., 0.]));
}

/// The square at a node with instances.
pub(crate) fn instanced(attributes: &dyn Fn(&mut Making) -> Value) -> Making {
    let mut making = Making::square();
    let attributes = attributes(&mut making);
    making.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    making.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    making
}

fn bounds(scene: &Scene) -> ([f32; 3], [f32; 3]) {
    let bounds = scene.bounds();
    (bounds.lo, bounds.hi)
}

#[test]
fn instances_stand_at_their_places() {
    let places = [[0., 0., 0.], [5., 0., 0.], [0., 7., 0.]];
    let mut making = instanced(&|making| json!({ "TRANSLATION": making.floats(&places) }));
    for required in [false, true] {
        if required {
            making.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
        }
        let scene = making.read();
        assert_eq!((scene.triangles.len(), scene.objects.len()), (6, 3));
        assert_eq!(bounds(&scene), ([0.; 3], [6., 8., 0.]));
        assert_eq!(scene.positions[4..8], moved([5., 0., 0.]));
        assert!(scene.warnings.is_empty());
    }
    // Behind the node's own transform; children stand once.
    making.json["nodes"][0]["scale"] = json!([2, 2, 2]);
    let child = making.push("nodes", json!({ "mesh": 0, "translation": [0, 0, 1] }));
    making.json["nodes"][0]["children"] = json!([child]);
    let scene = making.read();
    assert_eq!((scene.triangles.len(), bounds(&scene)), (8, ([0.; 3], [12., 16., 2.])));
}

#[test]
fn rotations_and_scales_of_instances_may_be_small_integers() {
    // A quarter turn about z is (0, 0, 1, 1)/√2, whatever its length; scales are not normalized.
    let making = instanced(&|making| {
        let rotation = making.accessor(&[0, 0, 90, 90], BYTE, "VEC4", 1);
        making.json["accessors"][rotation]["normalized"] = true.into();
        json!({ "ROTATION": rotation, "SCALE": making.floats(&[[2., 3., 1.]]) })
    });
    let (lo, hi) = bounds(&making.read());
    for (found, expected) in lo.into_iter().chain(hi).zip([-3., 0., 0., 0., 2., 0.]) {
        assert!((found - expected).abs() < 1e-6, "{lo:?} {hi:?}");
    }
    let uneven = instanced(
        &|making| json!({ "TRANSLATION": making.floats(&[[0.; 3]; 2]), "SCALE": making.floats(&[[1.; 3]; 3]) }),
    );
    assert!(uneven.refusal().contains("different counts"));
    assert_eq!(instanced(&|_| json!({})).read().triangles.len(), 2);
}

/// Writes openness at the vertices and reads what viewers would.
fn bake(making: &Making, openness: &dyn Fn(usize) -> f32) -> Result<Written, Error> {
    let folder = Folder::new(&[("in.glb", &making.glb())]);
    let (mut file, scene) = GltfFile::read(&folder.path("in.glb"), &GltfOptions::default())?;
    let values: Vec<f32> = (0..scene.positions.len()).map(openness).collect();
    file.add_vertex_occlusion(&values, VertexTarget::Ao)?;
    file.write(&folder.path("out.glb"))?;
    let again = folder.open("out.glb").1;
    assert_eq!((again.positions, again.triangles), (scene.positions, scene.triangles));
    Ok(Written::glb(&folder.path("out.glb")))
}

#[test]
fn openness_goes_into_meshes_that_are_moved() {
    let values = |vertex: usize| [0.25, 0.5, 0.75, 1.0][vertex % 4];
    let skinned = skinned(&[json!({ "translation": [0, 5, 0] })], [[0; 4]; 4], FIRST);
    assert_eq!(bake(&skinned, &values).unwrap().floats(0, 0, "_AO"), [0.25, 0.5, 0.75, 1.0]);
    let mut morphed = morphed(&[[0., 4., 0.]]);
    morphed.json["meshes"][0]["weights"] = json!([1]);
    morphed.node(json!({ "mesh": 0, "weights": [0] }));
    let written = bake(&morphed, &|vertex| vertex as f32 / 8.0).unwrap();
    assert_eq!(written.floats(0, 0, "_AO"), [0.0, 0.125, 0.25, 0.375]);
    assert_eq!(written.floats(1, 0, "_AO"), [0.5, 0.625, 0.75, 0.875]);
    assert_eq!(written.json["nodes"][1]["mesh"], 1);
    // Instances share one mesh: what is equal at all of them can be stored, else nothing is.
    let places = [[0., 0., 0.], [5., 0., 0.]];
    let instanced = instanced(&|making| json!({ "TRANSLATION": making.floats(&places) }));
    assert_eq!(bake(&instanced, &values).unwrap().floats(0, 0, "_AO"), [0.25, 0.5, 0.75, 1.0]);
    match bake(&instanced, &|vertex| vertex as f32 / 8.0) {
        Err(Error::Input { problem, .. }) => {
            assert!(problem.contains("EXT_mesh_gpu_instancing"), "{problem}")
        }
        other => panic!("{:?}", other.map(|written| written.json)),
    }
    // A texture is for all.
    let folder = Folder::new(&[("in.glb", &instanced.glb())]);
    folder.open("in.glb").0.add_occlusion_texture(&png()).unwrap();
}

#[test]
fn the_command_says_where_they_stand() {
    let place = place!();
    let making = skinned(&[json!({ "translation": [0, 5, 0] })], [[0; 4]; 4], FIRST);
    place.put("a.glb", making.glb());
    let run = place.run("info a.glb --json");
    let value: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(value["bounds"], json!({ "lo": [0.0, 5.0, 0.0], "hi": [1.0, 6.0, 0.0] }));
}
