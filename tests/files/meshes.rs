//! Meshes in PLY, STL and OFF, compressed files, and the standard input: each the same scene as its OBJ.

use std::io::Write as _;
use std::process::{Command, Stdio};

use flate2::Compression;
use flate2::write::GzEncoder;
use umbel::formats::{LoadOptions, load_bytes};
use umbel::{Error, Scene};

/// A cube with a concave face on top, as positions and polygons, with a texture coordinate and a normal at each vertex.
const POSITIONS: [[f32; 3]; 9] = [
    [0.0, 0.0, 0.0],
    [2.0, 0.0, 0.0],
    [2.0, 2.0, 0.0],
    [0.0, 2.0, 0.0],
    [0.0, 0.0, 2.5],
    [2.0, 0.0, 2.5],
    [1.25, 0.75, 2.5],
    [2.0, 2.0, 2.5],
    [0.0, 2.0, 2.5],
];
const FACES: [&[u32]; 3] = [&[0, 3, 2, 1], &[4, 5, 6, 7, 8], &[0, 1, 5]];

fn uv(k: usize) -> [f32; 2] {
    [k as f32 * 0.125, 0.5]
}

fn normal(k: usize) -> [f32; 3] {
    [0.0, k as f32, -0.1]
}

fn words<T: ToString>(numbers: &[T]) -> String {
    numbers.iter().map(T::to_string).collect::<Vec<_>>().join(" ")
}

fn obj() -> String {
    let mut text = String::new();
    for (k, p) in POSITIONS.iter().enumerate() {
        text += &format!("v {}\nvt {}\nvn {}\n", words(p), words(&uv(k)), words(&normal(k)));
    }
    for face in FACES {
        let corners: Vec<String> = face.iter().map(|k| format!("{0}/{0}/{0}", k + 1)).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

fn header(format: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\ncomment a cube\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty float s\nproperty float t\n\
         element face 4\nproperty list uchar int vertex_indices\nproperty uchar flags\nelement edge 1\nproperty int vertex1\nend_header\n"
    )
}

fn ply_text() -> Vec<u8> {
    let mut text = header("ascii");
    for (k, p) in POSITIONS.iter().enumerate() {
        text += &format!("{} {} 255 {}\n", words(p), words(&normal(k)), words(&uv(k)));
    }
    for face in FACES {
        text += &format!("{} {} 1\n", face.len(), words(face));
    }
    (text + "2 0 1 0\n7\n").into_bytes()
}

fn ply_binary(is_big: bool) -> Vec<u8> {
    let mut bytes = header(if is_big { "binary_big_endian" } else { "binary_little_endian" }).into_bytes();
    let put = |bytes: &mut Vec<u8>, bits: u32| {
        bytes.extend(if is_big { bits.to_be_bytes() } else { bits.to_le_bytes() });
    };
    for (k, p) in POSITIONS.iter().enumerate() {
        p.iter().chain(&normal(k)).for_each(|x| put(&mut bytes, x.to_bits()));
        bytes.push(255);
        uv(k).iter().for_each(|x| put(&mut bytes, x.to_bits()));
    }
    for face in FACES.iter().chain(&[&[0, 1][..]]) {
        bytes.push(face.len() as u8);
        face.iter().for_each(|&k| put(&mut bytes, k));
        bytes.push(1);
    }
    put(&mut bytes, 7);
    bytes
}

fn off(keyword: &str) -> String {
    let mut text = format!("# a cube\n{keyword}\n");
    text += if keyword.ends_with("OFF") { "9 4 0\n" } else { "" };
    for (k, p) in POSITIONS.iter().enumerate() {
        let normal = if keyword.contains('N') { words(&normal(k)) } else { String::new() };
        let uv = if keyword.starts_with("ST") { words(&uv(k)) } else { String::new() };
        text += &format!("{} {normal} {uv} # vertex {k}\n\n", words(p));
    }
    for face in FACES {
        text += &format!("{} {} 0.5 0.5 1\n", face.len(), words(face));
    }
    text + "2 0 1\n"
}

/// Triangles as they are cut from the cube, by their corners.
fn corners(scene: &Scene) -> Vec<[[f32; 3]; 3]> {
    scene.triangles.iter().map(|corners| corners.map(|k| scene.positions[k as usize])).collect()
}

fn stl(is_text: bool, header: &str) -> Vec<u8> {
    let triangles = corners(&read("a.obj", obj()));
    if is_text {
        let mut text = format!("{header}\r\n");
        for triangle in &triangles {
            let vertices: String = triangle.iter().map(|p| format!("  Vertex\t{}\r\n", words(p))).collect();
            text +=
                &format!(" facet NORMAL nan nan nan\r\n outer loop\r\n{vertices} endloop\r\n endfacet\r\n");
        }
        return (text + "endsolid\r\n").into_bytes();
    }
    let mut bytes = header.as_bytes().to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn try_read(name: &str, bytes: impl AsRef<[u8]>, options: LoadOptions) -> Result<Scene, Error> {
    load_bytes(name, bytes.as_ref().to_vec(), options, &mut |name| panic!("asks for {name}"))
}

fn read(name: &str, bytes: impl AsRef<[u8]>) -> Scene {
    try_read(name, bytes, LoadOptions::default()).unwrap()
}

/// The line and the problem of a refused file.
fn refusal(name: &str, bytes: impl AsRef<[u8]>) -> (Option<u64>, String) {
    match try_read(name, bytes, LoadOptions::default()) {
        Err(Error::Input { path, line, problem, remedy }) => {
            assert!(path.to_str() == Some(name) && remedy.len() > 10, "{remedy}");
            (line, problem)
        }
        other => panic!("{name}: {other:?}"),
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn zstandard(bytes: &[u8]) -> Vec<u8> {
    ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest)
}

#[test]
fn ply_and_off_are_the_same_scene_as_obj() {
    let expected = read("a.obj", obj());
    assert_eq!(expected.triangles.len(), 6);
    for (name, bytes) in [
        ("a.ply", ply_text()),
        ("a.ply", ply_binary(false)),
        ("a.ply", ply_binary(true)),
        ("a.off", off("STNOFF").into_bytes()),
    ] {
        let scene = read(name, bytes);
        assert!(
            scene.warnings.iter().any(|warning| warning.contains("fewer than three corners")),
            "{:?}",
            scene.warnings
        );
        let is_ply = name == "a.ply";
        assert_eq!(scene.warnings.iter().any(|warning| warning.contains("`edge`")), is_ply);
        assert_eq!(Scene { warnings: Vec::new(), ..scene }, expected);
    }
    for keyword in ["OFF", "NOFF", "STOFF", "COFF", "OFF 9 4 0", "9 4 0"] {
        let scene = read("b.off", off(keyword));
        assert_eq!(
            (scene.positions, scene.triangles),
            (expected.positions.clone(), expected.triangles.clone())
        );
        let has = |is: bool, list: &[[u32; 3]]| if is { list.to_vec() } else { Vec::new() };
        assert_eq!(scene.uv_indices, has(keyword == "STOFF", &expected.uv_indices));
        assert_eq!(scene.normal_indices, has(keyword == "NOFF", &expected.normal_indices));
    }
}

#[test]
fn stl_is_welded() {
    let expected = read("a.obj", obj());
    for bytes in [stl(true, "solid cube one"), stl(false, ""), stl(false, "solid of SolidWorks")] {
        let scene = read("a.stl", bytes);
        assert_eq!((scene.positions.len(), corners(&scene)), (9, corners(&expected)));
        assert!(scene.warnings.is_empty() && scene.objects.len() == 1);
    }
    let two = [stl(true, "solid A b"), stl(true, "SOLID")].concat();
    let scene = read("a.stl", two);
    let names: Vec<&str> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!((names, scene.triangles.len(), scene.positions.len()), (vec!["A b", ""], 12, 9));
    let zeros = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex -0 1 0\nvertex 1 -0 0\nendloop\nendfacet\nfacet\nvertex -0 -0 -0\nvertex 0 1 0\nvertex 1 0 0\nendfacet\nendsolid";
    assert_eq!(read("a.stl", zeros).positions.len(), 3);
}

#[test]
fn texture_coordinates_of_corners() {
    let text = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar uint vertex_index\nproperty list uchar float texcoord\n\
                element vertex 4\nproperty double x\nproperty double y\nproperty double z\nend_header\n\
                3 0 1 2 6 0 .5 1. 0 1 1\n3 0 2 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let scene = read("a.ply", text);
    assert_eq!(
        (scene.uv_indices, scene.uvs[..3].to_vec()),
        (vec![[0, 1, 2], [u32::MAX; 3]], vec![[0.0, 0.5], [1.0, 0.0], [1.0, 1.0]])
    );
}

#[test]
fn far_from_the_origin() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\nelement face 1\n\
               property list uchar int vertex_indices\nend_header\n5000000.125 4000000 0\n5000001.25 4000000 0\n5000000.125 4000000.5 0\n3 0 1 2\n";
    let off = "OFF 3 1 0\n5000000.125 4000000 0\n5000001.25 4000000 0\n5000000.125 4000000.5 0\n3 0 1 2\n";
    for scene in [read("a.ply", ply), read("a.off", off)] {
        let p = |k: usize| {
            (0..3).map(|axis| f64::from(scene.positions[k][axis]) + scene.offset[axis]).collect::<Vec<_>>()
        };
        assert_eq!(
            [p(0), p(1), p(2)],
            [vec![5000000.125, 4e6, 0.0], vec![5000001.25, 4e6, 0.0], vec![5000000.125, 4000000.5, 0.0]]
        );
    }
}

#[test]
fn the_content_tells_the_format() {
    for (bytes, named) in [
        (obj().into_bytes(), "x.obj"),
        (ply_text(), "x.ply"),
        (ply_binary(true), "x.ply"),
        (stl(true, "solid"), "x.stl"),
        (stl(false, "binary"), "x.stl"),
        (off("NOFF").into_bytes(), "x.off"),
        (b"# c\n\nusemtl a\nv 0 0 0\n".to_vec(), "x.obj"),
        (br#"{"asset": {"version": "2.0"}}"#.to_vec(), "x.gltf"),
    ] {
        let expected = read(named, &bytes);
        for packed in [bytes.clone(), gzip(&bytes), zstandard(&bytes)] {
            assert_eq!(read("x", &packed), expected);
            for ending in ["gz", "zst"] {
                assert_eq!(read(&format!("{named}.{ending}"), &packed), expected);
            }
        }
    }
    for nothing in ["", "hello\n", "<svg/>", "voff", "# OFF"] {
        assert!(refusal("x", nothing).1.contains("neither the name nor the content"));
    }
}

#[test]
fn packed_files_are_counted_and_checked() {
    let text = obj() + &"# padding padding padding\n".repeat(1_000_000);
    for packed in [gzip(text.as_bytes()), zstandard(text.as_bytes())] {
        assert!(packed.len() < 1_000_000);
        let limited = LoadOptions { max_memory: Some(10_000_000), ..LoadOptions::default() };
        assert!(
            matches!(try_read("x.obj.gz", &packed, limited), Err(Error::Limit(text)) if text.contains("unpacked"))
        );
        assert!(refusal("x.obj", &packed[..packed.len() / 2]).1.contains("cannot be unpacked"));
    }
    // Several members, as `cat a.gz b.gz` makes them; frames likewise.
    let text = obj();
    let (first, second) = text.as_bytes().split_at(100);
    for joined in [[gzip(first), gzip(second)].concat(), [zstandard(first), zstandard(second)].concat()] {
        assert_eq!(read("a.obj", joined), read("a.obj", obj()));
    }
}

#[test]
fn damaged_files_are_refused() {
    for whole in [ply_text(), ply_binary(false), stl(false, ""), stl(true, "solid"), off("OFF").into_bytes()]
    {
        let name = if whole.starts_with(b"ply") {
            "a.ply"
        } else if whole.starts_with(b"#") {
            "a.off"
        } else {
            "a.stl"
        };
        for end in (0..whole.len() - 20).step_by(7) {
            // It may be that what is left is a file. It is never a panic, and an error says where.
            match try_read(name, &whole[..end], LoadOptions::default()) {
                Ok(scene) => assert!(scene.triangles.len() < 6 || end + 60 > whole.len(), "{name} {end}"),
                Err(error) => assert!(error.to_string().starts_with(name), "{error}"),
            }
        }
    }
    let ply = |body: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{body}"
        )
    };
    let corners = "0 0 0\n1 0 0\n0 1 0\n";
    for (body, line, what) in [
        ("0 0 0\n1 x 0\n", Some(11), "`x` is no number"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", None, "vertex 3; there are 3"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", Some(13), "vertex -1"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 0.5\n", Some(13), "names the vertex"),
        ("0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n", Some(13), "-3 entries"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1\n", Some(14), "the file ends"),
        ("0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n", None, "vertex 2 has a coordinate that is NaN"),
    ] {
        let (at, problem) = refusal("a.ply", ply(body));
        assert!(at == line && problem.contains(what), "{body}: {at:?} {problem}");
    }
    let many = ply(corners).replace("vertex 3", "vertex 4000000000");
    assert!(refusal("a.ply", many).1.contains("too short"));
    assert!(refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n").1.contains("no `x`"));
    for (text, line, what) in [
        ("OFF 3 1 0\n0 0\n", 2, "three numbers"),
        ("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", 5, "`3` names no vertex"),
        ("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", 5, "as many indices"),
        ("OFF 3 1 0\n0 0 0\n1 0 0\n", 3, "the file ends"),
        ("OFF 4000000000 4000000000 0\n", 1, "there are no 4000000000 vertices"),
        ("4OFF\n1 0 0\n", 1, "three dimensions"),
        ("OFF BINARY\n", 1, "as text"),
        ("OFF x\n", 1, "begins with `OFF`"),
    ] {
        let (at, problem) = refusal("a.off", text);
        assert!(at == Some(line) && problem.contains(what), "{text}: {at:?} {problem}");
    }
    let (line, problem) = refusal("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n");
    assert!(line == Some(4) && problem.contains("three numbers"));
    assert!(refusal("a.stl", "hello").1.contains("no STL text"));
}

#[test]
fn what_is_not_finite_can_be_left_out() {
    let dropping = LoadOptions { drop_non_finite: true, ..LoadOptions::default() };
    let bytes = ply_text();
    let text = String::from_utf8(bytes).unwrap().replacen("2 2 0 ", "inf 2 0 ", 1);
    let scene = try_read("a.ply", text, dropping).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    assert!(
        scene
            .warnings
            .iter()
            .any(|warning| warning.contains("not finite: 1; triangles left out with them: 2"))
    );
}

#[test]
fn the_standard_input_is_read() {
    for bytes in [gzip(&ply_binary(false)), obj().into_bytes()] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_umbel"))
            .args(["info", "-", "--json"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(&bytes).unwrap();
        let output = child.wait_with_output().unwrap();
        let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&info["name"], &info["triangles"]), (&"stdin".into(), &6.into()));
    }
}
