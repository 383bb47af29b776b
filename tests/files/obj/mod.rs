//! Reading OBJ and MTL files, from outside: small files, each with what its format is known to go wrong on.

mod far;
mod hostile;
mod many_corners;
mod tolerance;

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use umbel::formats::{ObjOptions, read_obj};
use umbel::scene::NO_INDEX;
use umbel::{Error, Scene};

/// A triangle's vertices, for files that are about something else.
const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

/// A folder with the given files.
fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn try_read(text: impl AsRef<[u8]>, drop_non_finite: bool) -> Result<Scene, Error> {
    let folder = folder(&[("scene.obj", text.as_ref())]);
    read_obj(&folder.path().join("scene.obj"), &ObjOptions { drop_non_finite, ..ObjOptions::default() })
}

fn read(text: impl AsRef<[u8]>) -> Scene {
    try_read(text, false).unwrap()
}

fn read_with_mtl(text: &str, library: &str) -> Scene {
    let folder = folder(&[("scene.obj", text.as_bytes()), ("a.mtl", library.as_bytes())]);
    read_obj(&folder.path().join("scene.obj"), &ObjOptions::default()).unwrap()
}

/// The line and the problem of a refused file, whose remedy is checked to be a sentence.
fn refusal(text: impl AsRef<[u8]>) -> (Option<u64>, String) {
    match try_read(text, false) {
        Err(Error::Input { path, line, problem, remedy }) => {
            assert_eq!(path.file_name().unwrap(), "scene.obj");
            assert!(remedy.len() > 10 && remedy.ends_with('.'), "{remedy}");
            (line, problem)
        }
        other => panic!("not refused: {other:?}"),
    }
}

fn assert_warned(scene: &Scene, words: &[&str]) {
    let found = scene.warnings.iter().any(|warning| words.iter().all(|word| warning.contains(word)));
    assert!(found, "{words:?} in {:?}", scene.warnings);
}

/// The sum of the triangles' areas, for scenes in a plane z = constant; none may be flipped.
fn area(scene: &Scene) -> f64 {
    let doubled = scene.triangles.iter().map(|triangle| {
        let [p, q, r] = triangle.map(|index| scene.positions[index as usize].map(f64::from));
        let part = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        assert!(part >= 0.0, "flipped: {triangle:?}");
        part
    });
    doubled.sum::<f64>() / 2.0
}

#[test]
fn positions_are_those_of_the_file_in_its_order() {
    // Unused, repeated and later ones as well; colours and weights beside them.
    let text = "v 9 9 9\nv 0 0 0 1 0 0\nv 2 0 0\nf 4 2 3\nv 0 2 0 0.5 0.5\nv 2 4 6 2\nv 0 0 0\n";
    let scene = read(text);
    let expected = [[9., 9., 9.], [0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [2., 4., 6.], [0., 0., 0.]];
    assert_eq!(scene.positions, expected);
    assert_eq!(scene.triangles, [[3, 1, 2]]);
    assert_eq!(scene.name, "scene");
    // The weight is that of a point of a curve: the position stays where it is.
    assert_eq!(scene.warnings.len(), 1);
    assert_warned(&scene, &["weight", ": 1, the first in line 6"]);
}

#[test]
fn order_holds_beyond_one_polygon_of_the_preamble() {
    let mut text = String::new();
    for i in 0..2500 {
        text.push_str(&format!("v {i} 0 1\nvt 0.5 {i}\nvt 1 {i}\nvn {i} 1 0\n"));
    }
    text.push_str("f 2500/5000/1 1/1/2500 1001/2001/1000\n");
    let scene = read(text);
    assert_eq!((scene.positions.len(), scene.uvs.len(), scene.normals.len()), (2500, 5000, 2500));
    assert!((0u16..).zip(&scene.positions).all(|(i, position)| position[0] == f32::from(i)));
    assert!((0u16..).zip(&scene.uvs).all(|(i, uv)| uv[1] == f32::from(i / 2)));
    assert!((0u16..).zip(&scene.normals).all(|(i, normal)| normal[0] == f32::from(i)));
    assert_eq!(scene.triangles, [[2499, 0, 1000]]);
    assert_eq!(scene.uv_indices, [[4999, 0, 2000]]);
    assert_eq!(scene.normal_indices, [[0, 2499, 999]]);
}

#[test]
fn missing_normals_and_texture_coordinates_are_no_index() {
    let fields = "vt 0.25 0.5\nvt 0.75\nvn 0 0 1\n";
    let scene = read(format!("{CORNERS}{fields}f 1/2 2//1 3\nf 1/1/1 2/2/1 3/-1/-1\nf 1 2 3\n"));
    assert_eq!(scene.uvs, [[0.25, 0.5], [0.75, 0.0]]);
    assert_eq!(scene.normals, [[0.0, 0.0, 1.0]]);
    assert_eq!(scene.uv_indices, [[1, NO_INDEX, NO_INDEX], [0, 1, 1], [NO_INDEX; 3]]);
    assert_eq!(scene.normal_indices, [[NO_INDEX, 0, NO_INDEX], [0, 0, 0], [NO_INDEX; 3]]);
    let unused = read(format!("{CORNERS}{fields}f 1 2 3\n"));
    assert!(unused.uv_indices.is_empty() && unused.normal_indices.is_empty());
    let dangling = read(format!("{CORNERS}f 1//1 2//2 3//3\n"));
    assert!(dangling.normals.is_empty() && dangling.normal_indices.is_empty());
    assert_warned(&dangling, &["normal", "`vn`"]);
}

#[test]
fn polygons_are_cut_by_ear_clipping() {
    // A fan over this pentagon has area 14.
    let scene = read("v 0 0 3\nv 4 0 3\nv 4 4 3\nv 2 1 3\nv 0 4 3\nf 1 2 3 4 5\n");
    assert_eq!(scene.triangles.len(), 3);
    assert_eq!(area(&scene), 10.0);
    // Ids follow the file, and corners without area keep theirs.
    let scene = read(format!("{CORNERS}v 1 1 0\nf 1 2 4 3\nf 1 1 2\nf 2 4 3\n"));
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(scene.triangles[2..], [[0, 0, 1], [1, 3, 2]]);
}

#[test]
fn negative_indices_count_back_from_their_line() {
    let scene = read(format!("{CORNERS}f -3 -2 -1\n{CORNERS}f -3 -2 -1\nf 1 -1 +2\n"));
    assert_eq!(scene.triangles, [[0, 1, 2], [3, 4, 5], [0, 5, 1]]);
}

#[test]
fn lines_are_joined_and_comments_skipped() {
    let text =
        "\u{feff}# C:\\models\\\nv 0 0 \\\n  0 # corner\n\tv 1 0 0\r\nv 0 1 0\rf 1 \\\r\n 2 \\\n 3 #f\n";
    let scene = read(text);
    assert_eq!(scene.positions, [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(scene.triangles, [[0, 1, 2]]);
    // Line numbers count the file's lines, joined or not.
    assert_eq!(refusal("v 0 0 \\\n0\n\nv 1 0\n").0, Some(4));
    // Comments and names need not be UTF-8.
    let scene = read([b"# caf\xe9\no caf\xe9\n".as_slice(), CORNERS.as_bytes(), b"f 1 2 3"].concat());
    assert_eq!(scene.objects[0].name, "caf\u{fffd}");
}

#[test]
fn what_is_not_text_is_refused() {
    let utf16: Vec<u8> = "v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert!(refusal([b"\xff\xfe".as_slice(), &utf16].concat()).1.contains("UTF-16"));
    assert!(refusal(b"\xfe\xff\0v").1.contains("UTF-16"));
    assert!(refusal(b"glTF\x02\0\0\0").1.contains("binary"));
    let missing = read_obj(&PathBuf::from("no/such.obj"), &ObjOptions::default());
    assert!(matches!(missing, Err(Error::Input { .. })));
}

#[test]
fn what_cannot_be_parsed_is_refused_with_its_line() {
    for bad in ["v 1 2", "v 1 2 x", "v 0,5 1 2", "vt", "vn 1 2", "f 1 2 x", "f 1/1/1/1 2 3"] {
        let (line, problem) = refusal(format!("{CORNERS}\n{bad}\nf 1 2 3\n"));
        assert_eq!(line, Some(5), "{bad}: {problem}");
    }
}

#[test]
fn indices_out_of_range_are_refused_with_their_line() {
    let fields = "vt 0 0\nvn 0 0 1\n";
    let huge = "f 1 2 99999999999999999999";
    let wraps = "f 1/-9223372036854775808 2 3";
    for bad in
        ["f 0 1 2", "f 1 2 4", "f -4 1 2", "f 0/1 2 3", "f 1/2 2 3", "f 1//x 2 3", "f 1//-2 2 3", huge, wraps]
    {
        let (line, problem) = refusal(format!("{CORNERS}{fields}f 1 2 3\n{bad}\nf 1 2 3\no end\n"));
        assert_eq!(line, Some(7), "{bad}: {problem}");
        assert!(problem.contains("index"), "{problem}");
    }
    assert_eq!(refusal("f -4 -3 -2").0, Some(1));
    assert_eq!(refusal("vn 0 0 1\nvt 0 0\nf 1 2 3").0, Some(3));
}

#[test]
fn positions_that_are_not_finite_are_refused_or_dropped() {
    for bad in ["nan", "-inf", "1e39", "1.#QNAN", "-nan(ind)"] {
        let text = format!("{CORNERS}f 1 2 3\n# before\nv 1 \\\n 1 {bad}\nf 2 4 3\nf 3 1 2 4\nf 2 3 1\n");
        let (line, problem) = refusal(&text);
        assert_eq!(line, Some(6), "{bad}");
        assert!(problem.contains("vertex 4"), "{problem}");
        let scene = try_read(&text, true).unwrap();
        assert_eq!(scene.positions.len(), 4);
        assert_eq!(scene.positions[3], [0.0; 3]);
        assert_eq!(scene.triangles, [[0, 1, 2], [1, 2, 0]]);
        assert_warned(&scene, &["not finite: 1", "left out with them: 3"]);
    }
    let scene = read(format!("{CORNERS}vn nan 0 0\nvt 0 inf\nf 1/1/1 2/1/1 3/1/1\n"));
    assert_eq!((scene.normals[0], scene.uvs[0]), ([0.0; 3], [0.0; 2]));
    assert_warned(&scene, &["normals", "not finite"]);
}

#[test]
fn elements_without_area_are_left_out_and_counted() {
    let scene = read(format!("{CORNERS}l 1 2 3\np 1\nf 1 2 3\nf 1\nf\nf 1 2\n"));
    assert_eq!(scene.triangles, [[0, 1, 2]]);
    assert_warned(&scene, &["left out: 5"]);
}

#[test]
fn files_without_triangles_are_empty_scenes() {
    let scene = read("");
    assert_eq!((scene.positions.len(), scene.triangles.len(), scene.objects.len()), (0, 0, 0));
    assert_warned(&scene, &["empty"]);
    let cloud = read("vn 0 0 1\nv 1 2 3\nvn 0 1 0\nv 4 5 6\n");
    assert_eq!(cloud.positions, [[1., 2., 3.], [4., 5., 6.]]);
    assert_eq!(cloud.normals.len(), 2);
    assert_warned(&cloud, &["no triangles", "2 vertices"]);
    assert_warned(&read("vt 0 0\nvn 0 0 1\nusemtl x\n"), &["no triangles"]);
}

#[test]
fn objects_groups_and_materials_partition_the_triangles() {
    let text = format!(
        "mtllib a.mtl\n{CORNERS}v 1 1 0\nf 1 2 3\no Cube #1\nf 1 2 4 3\nusemtl red\nf 1 2 3\nusemtl red\n\
         f 1 2 3\ng empty\ng\tleft side\nf 2 4 3\nusemtl blue\ng left side\nusemtl red\nf 2 4 3\nusemtl none\nf 1 2 3\n"
    );
    let library = "newmtl blue\nKd 0 0 1\nnewmtl red\nKd 1 0.5 0\n";
    let scene = read_with_mtl(&text, library);
    let found: Vec<_> =
        scene.objects.iter().map(|o| (o.name.as_str(), o.triangles.clone(), o.material)).collect();
    let expected = [
        ("", 0..1, None),
        ("Cube #1", 1..3, None),
        ("Cube #1", 3..5, Some(0)),
        ("left side", 5..7, Some(0)),
        ("left side", 7..8, None),
    ];
    assert_eq!(found, expected);
    assert_eq!(scene.materials.len(), 1);
    assert_eq!((scene.materials[0].name.as_str(), scene.materials[0].diffuse), ("red", [1.0, 0.5, 0.0]));
    assert_eq!(scene.object_of(6), Some(3));
    assert_warned(&scene, &["no library", "`none`"]);
}

#[test]
fn a_missing_library_is_a_warning() {
    let scene = read(format!("mtllib gone.mtl\nusemtl red\n{CORNERS}f 1 2 3\n"));
    assert_eq!(scene.triangles.len(), 1);
    assert_eq!(scene.objects[0].material, None);
    assert_warned(&scene, &["gone.mtl", "cannot be read"]);
    assert_warned(&scene, &["no library", "`red`"]);
}

#[test]
fn a_malformed_library_is_a_warning() {
    // tobj alone panics on `Kd 0.5` and gives up the library at `illum` and `Ns`.
    let library = "Kd 1 1 1\nnewmtl\nnewmtl one\nillum x\nNs\nKd 0.5\nnewmtl two\nKd 1 x 0\n\
                   newmtl  three words # 3 \n\tKd 2 -1 .25 # bright\nnewmtl four\nKd spectral f.rfl\n";
    let uses = ["one", "two", "three words # 3", "four"];
    let mut text = format!("mtllib .\\a.mtl\n{CORNERS}");
    for name in uses {
        text.push_str(&format!("usemtl {name}\nf 1 2 3\n"));
    }
    let scene = read_with_mtl(&text, library);
    assert_eq!(scene.materials.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), uses);
    let diffuse: Vec<_> = scene.materials.iter().map(|m| m.diffuse).collect();
    assert_eq!(diffuse, [[0.5; 3], [0.8; 3], [1.0, 0.0, 0.25], [0.8; 3]]);
    assert_eq!(scene.warnings.len(), 4, "{:?}", scene.warnings);
    assert_warned(&scene, &["a.mtl:2:", "newmtl"]);
    assert_warned(&scene, &["a.mtl:8:", "Kd 1 x 0"]);
    // A library that is no text, or no file.
    let scene = read_with_mtl(&format!("mtllib a.mtl\n{CORNERS}f 1 2 3\n"), "P\0NG");
    assert_warned(&scene, &["a.mtl", "binary"]);
    assert_warned(&read(format!("mtllib .\n{CORNERS}f 1 2 3\n")), &["not a file"]);
}

#[test]
fn one_statement_may_name_several_libraries() {
    let red = "newmtl red\nKd 1 0 0\n".as_bytes();
    let blue = "newmtl blue\nKd 0 0 1\n".as_bytes();
    let text = format!(
        "mtllib a.mtl b.mtl\nmtllib my own.mtl\n{CORNERS}usemtl blue\nf 1 2 3\nusemtl own\nf 1 2 3\n"
    );
    let own = "newmtl own\nKd 0 1 0\n".as_bytes();
    let files = [("scene.obj", text.as_bytes()), ("a.mtl", red), ("b.mtl", blue), ("my own.mtl", own)];
    let folder = folder(&files);
    let scene = read_obj(&folder.path().join("scene.obj"), &ObjOptions::default()).unwrap();
    let diffuse: Vec<_> = scene.materials.iter().map(|material| material.diffuse).collect();
    assert_eq!(diffuse, [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}
