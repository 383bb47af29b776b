//! Point clouds: the PLY file holds what the arrays hold, without the misses.

use common::place;
use umbel::NO_TRIANGLE;

use super::directions;

/// The header, up to the numbers.
fn header(vertices: usize) -> String {
    let fields = ["x", "y", "z", "nx", "ny", "nz"].map(|name| format!("property float {name}\n")).concat();
    let vertex = format!("element vertex {vertices}\n{fields}property uint id\n");
    format!("ply\nformat binary_little_endian 1.0\n{vertex}end_header\n")
}

const ARRAYS: &str = "--aov id=id.npy --aov position=points.npy --aov normal=normals.npy";

#[test]
fn points_are_those_of_the_arrays() {
    let place = place!();
    place.put(
        "list.npy",
        directions(&[[0.3, -1.0, 0.1], [0.0, 1.0, 0.0], [-1.0, -0.2, 0.4], [9.0, 0.0, -1.0]]),
    );
    let probe = "probe builtin:umbel:3000 --center 0.2,1.5,0.3";
    for line in [
        format!("{probe} --pattern rings=20,columns=40,fov=-50..50"),
        format!("{probe} --pattern list.npy"),
        format!("{probe} --camera cube --cube-size 9"),
        format!("{probe} --camera fisheye --size 30x20"),
        "render builtin:umbel:3000 --size 50x40".to_owned(),
    ] {
        place.quiet_run(&format!("{line} -o cloud.ply {ARRAYS}"));
        let ids = place.npy("id.npy").u32();
        let (points, normals) = (place.npy("points.npy").data, place.npy("normals.npy").data);
        let hits = || (0..ids.len()).filter(|&pixel| ids[pixel] != NO_TRIANGLE);
        let mut expected = header(hits().count()).into_bytes();
        for pixel in hits() {
            expected.extend(&points[12 * pixel..12 * pixel + 12]);
            expected.extend(&normals[12 * pixel..12 * pixel + 12]);
            expected.extend(ids[pixel].to_le_bytes());
        }
        assert!(hits().count() > 0, "{line}");
        assert!(place.bytes("cloud.ply") == expected, "{line}");
        assert!(!place.names().contains(&"umbel.png".to_owned()));
    }
}

#[test]
fn nothing_seen_is_a_cloud_without_points() {
    let place = place!();
    place.put("empty.obj", "");
    place.quiet_run(
        "probe empty.obj -q --center 0,0,0 --pattern rings=3,columns=5 -o cloud.PLY --report r.json",
    );
    assert_eq!(place.bytes("cloud.PLY"), header(0).as_bytes());
    assert_eq!(place.json("r.json")["hash"], blake3::hash(b"").to_hex().as_str());
}
