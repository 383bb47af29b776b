//! Points of files: with and without ids, biases, types, numbers.

use common::command::Place;
use common::place;

use super::{CEILING, FLOOR, npy, npy_points};

const UP: [f32; 3] = [0.0, 1.0, 0.0];

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("ceiling.obj", CEILING);
    place
}

/// A row of a position and a normal.
fn row([x, y, z]: [f32; 3], [nx, ny, nz]: [f32; 3]) -> [f32; 6] {
    [x, y, z, nx, ny, nz]
}

/// Writes points, bakes them, and returns their values.
fn bake(place: &Place, rows: &[[f32; 6]], line: &str) -> Vec<f32> {
    place.put("p.npy", npy_points(rows));
    place.quiet_run(&format!("bake {line} --points p.npy -o a.npy"));
    let values = place.npy("a.npy");
    assert_eq!(values.shape, [rows.len()]);
    values.f32()
}

/// A point beneath its surface is in the dark, unless it knows its triangle or is moved.
#[test]
fn points_with_and_without_ids() {
    let place = place();
    // In the middle of triangle 0 of the floor, far from its edges; on it, above it, and a little beneath it.
    let rows = [0.0, 1e-4, -1e-4].map(|y| row([1.0, y, 6.0], UP));
    assert_eq!(bake(&place, &rows, "floor.obj"), [1.0, 1.0, 0.0]);
    let ids: Vec<u8> = [0_u32; 3].iter().flat_map(|id| id.to_le_bytes()).collect();
    place.put("ids.npy", npy("<u4", "3,", &ids));
    let known = bake(&place, &rows, "floor.obj --point-ids ids.npy");
    // Beneath a triangle of the floor, its neighbours still hide what lies near the horizon.
    assert!(known[..2] == [1.0, 1.0] && known[2] > 0.999, "{known:?}");
    assert_eq!(bake(&place, &rows, "floor.obj --bias 1e-3"), [1.0; 3]);
    assert_eq!(bake(&place, &rows, "floor.obj --bias=-1e-3"), [0.0; 3]);
}

#[test]
fn ids_of_any_integer_type() {
    let place = place();
    let rows = [row([1.0, -1e-4, 6.0], UP), row([1.0, -1e-4, 6.0], UP)];
    let id_files: [(&str, Vec<u8>); 4] = [
        ("<u4", [0_u32, u32::MAX].iter().flat_map(|id| id.to_le_bytes()).collect()),
        ("<i4", [0_i32, -1].iter().flat_map(|id| id.to_le_bytes()).collect()),
        ("<u8", [0_u64, u64::from(u32::MAX)].iter().flat_map(|id| id.to_le_bytes()).collect()),
        ("<i8", [0_i64, -1].iter().flat_map(|id| id.to_le_bytes()).collect()),
    ];
    for (dtype, data) in id_files {
        place.put("ids.npy", npy(dtype, "2,", &data));
        let values = bake(&place, &rows, "floor.obj --point-ids ids.npy");
        assert!(values[0] > 0.999 && values[1] == 0.0, "{dtype}: {values:?}");
    }
}

/// f8 is read as f4 is, and only the direction of a normal counts.
#[test]
fn types_and_lengths() {
    let place = place();
    let rows = [row([0.5, 0.0, 0.25], UP), row([0.5, 2.0, 0.25], [0.0, -1.0, 0.0])];
    let one = bake(&place, &rows, "ceiling.obj");
    assert!(one[0] < 0.01 && one[1] < 0.01, "{one:?}");
    let scaled = [row([0.5, 0.0, 0.25], [0.0, 1e-20, 0.0]), row([0.5, 2.0, 0.25], [0.0, -3e38, 0.0])];
    assert_eq!(bake(&place, &scaled, "ceiling.obj"), one);
    let data: Vec<u8> = rows.as_flattened().iter().flat_map(|&x| f64::from(x).to_le_bytes()).collect();
    place.put("p.npy", npy("<f8", "2, 6", &data));
    place.quiet_run("bake ceiling.obj --points p.npy -o a.npy");
    assert_eq!(place.npy("a.npy").f32(), one);
}

/// No points are fine; their PLY has no faces.
#[test]
fn none_and_a_few_as_ply() {
    let place = place();
    assert_eq!(bake(&place, &[], "floor.obj"), [0.0; 0]);
    place.put("p.npy", npy_points(&[row([1.0, 2.0, 3.0], UP), row([4.0, -5.0, 6.0], UP)]));
    place.quiet_run("bake floor.obj --points p.npy -o a.ply --bent b.npy");
    let bytes = place.bytes("a.ply");
    let text = String::from_utf8_lossy(&bytes);
    assert!(text.contains("element vertex 2") && text.contains("element face 0"));
    assert_eq!(place.npy("b.npy").shape, [2, 3]);
}
