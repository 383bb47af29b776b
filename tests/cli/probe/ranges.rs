//! What is seen: each range is a formula.

use common::command::Place;
use common::place;
use common::random::Random;
use umbel::NO_TRIANGLE;

use super::{BOX, directions, f8, npy};

/// The lower and the upper corner of the box, and a place in it.
const CORNERS: [[f64; 3]; 2] = [[-3.0, -1.0, -2.0], [5.0, 4.0, 7.0]];
const CENTER: [f64; 3] = [1.25, 0.5, -0.75];

fn place() -> Place {
    let place = place!();
    place.put("box.obj", BOX);
    place
}

/// The distance from the centre to the box along a direction, and the side that it meets.
fn expected(direction: [f64; 3]) -> (f64, usize) {
    let along = |axis: usize| {
        let up = direction[axis] > 0.0;
        let way = CORNERS[usize::from(up)][axis] - CENTER[axis];
        (way / direction[axis], 2 * axis + usize::from(up))
    };
    let ways = [0, 1, 2].map(along).into_iter().filter(|(t, _)| t.is_finite());
    let (t, side) = ways.min_by(|one, other| one.0.total_cmp(&other.0)).expect("a direction");
    let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
    (t * length, side)
}

/// Checks arrays of ranges, ids and points against the directions that they belong to.
fn check(place: &Place, directions: &[[f64; 3]]) {
    let (ranges, ids) = (place.npy("range.npy").f32(), place.npy("id.npy").u32());
    let points = place.npy("points.npy").f32();
    assert_eq!((ranges.len(), ids.len(), points.len()), (directions.len(), directions.len(), 3 * ids.len()));
    for (ray, &direction) in directions.iter().enumerate() {
        let (range, side) = expected(direction);
        let error = (f64::from(ranges[ray]) - range).abs();
        assert!(error <= 2.0 * f64::from(f32::EPSILON) * range, "{direction:?}: {} for {range}", ranges[ray]);
        assert_eq!(ids[ray] as usize / 2, side, "{direction:?}");
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        for axis in 0..3 {
            let point = CENTER[axis] + direction[axis] / length * range;
            let error = (f64::from(points[3 * ray + axis]) - point).abs();
            assert!(error < 1e-5, "{direction:?}: {error} beside");
        }
    }
}

const ARRAYS: &str = "--aov distance=range.npy --aov id=id.npy --aov position=points.npy";

/// The directions of `--pattern rings=,columns=,fov=` with −Z ahead and +Y up, by the formula of the README.
fn rings(rings: u32, columns: u32, [lower, upper]: [f64; 2]) -> Vec<[f64; 3]> {
    let ray = |k: u32| {
        let (column, ring) = (f64::from(k % columns), f64::from(k / columns));
        let azimuth = (360.0 * (column + 0.5) / f64::from(columns) - 180.0).to_radians();
        let down = if rings > 1 { ring / f64::from(rings - 1) } else { 0.5 };
        let elevation = (upper - (upper - lower) * down).to_radians();
        let level = elevation.cos();
        [level * azimuth.sin(), elevation.sin(), -level * azimuth.cos()]
    };
    (0..rings * columns).map(ray).collect()
}

#[test]
fn rings_measure_the_box() {
    let place = place();
    for (count, columns, fov, limits) in [
        (16, 90, "", [-15.0, 15.0]),
        (7, 33, ",fov=-24.9..2", [-24.9, 2.0]),
        (9, 8, ",fov=-90..90", [-90.0, 90.0]),
        (1, 12, ",fov=10..20", [10.0, 20.0]),
        (1, 1, ",fov=-4..-4", [-4.0, -4.0]),
    ] {
        let pattern = format!("--pattern rings={count},columns={columns}{fov}");
        place.quiet_run(&format!("probe box.obj --center 1.25,0.5,-0.75 {pattern} {ARRAYS}"));
        assert_eq!(place.npy("range.npy").shape, [count as usize, columns as usize]);
        assert_eq!(place.npy("points.npy").shape, [count as usize, columns as usize, 3]);
        check(&place, &rings(count, columns, limits));
    }
}

#[test]
fn a_file_measures_the_box() {
    let place = place();
    let mut random = Random(5);
    let mut list: Vec<[f64; 3]> = (0..500).map(|_| [(); 3].map(|()| random.unit() - 0.5)).collect();
    list.extend([
        [1.0, 0.0, 0.0],
        [0.0, -3.0, 0.0],
        [0.0, 0.0, 1e-70],
        [2e50, 1e50, -3e49],
        [1e-60, 2e-60, 0.0],
    ]);
    place.put("list.npy", directions(&list));
    let line = format!("probe box.obj --center 1.25,0.5,-0.75 {ARRAYS} --pattern");
    place.quiet_run(&format!("{line} list.npy"));
    assert_eq!(place.npy("range.npy").shape, [list.len()]);
    assert_eq!(place.npy("points.npy").shape, [list.len(), 3]);
    check(&place, &list);

    // f4 holds these directions as well; a list may have more extents.
    let short: Vec<[f64; 3]> = list[..12].iter().map(|d| d.map(|x| f64::from(x as f32))).collect();
    let bytes: Vec<u8> = short.as_flattened().iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
    place.put("short.npy", npy("<f4", false, "(4, 3, 3)", &bytes));
    place.quiet_run(&format!("{line} short.npy"));
    assert_eq!(place.npy("range.npy").shape, [4, 3]);
    check(&place, &short);
}

/// Rings and a file of the same directions see the same, on both paths and with any number of threads.
#[test]
fn a_file_of_rings_is_rings() {
    let place = place!();
    let line = format!("probe builtin:umbel:3000 --center 0.2,1.5,0.3 {ARRAYS}");
    place.put("rings.npy", directions(&rings(24, 200, [-40.0, 40.0])));
    place.quiet_run(&format!("{line} --pattern rings.npy"));
    let (ids, ranges) = (place.npy("id.npy").u32(), place.npy("range.npy").f32());
    let files = ["id.npy", "range.npy", "points.npy"];
    let bytes = files.map(|name| place.bytes(name));
    for more in ["--path general", "--threads 1", "--threads 3", "--isa sse2", "--path general --threads 3"] {
        if cfg!(not(target_arch = "x86_64")) && more.contains("--isa") {
            continue;
        }
        place.quiet_run(&format!("{line} --pattern rings.npy {more}"));
        assert!(files.map(|name| place.bytes(name)) == bytes, "{more}");
    }
    place.quiet_run(&format!("{line} --pattern rings=24,columns=200,fov=-40..40"));
    let same = place.npy("id.npy").u32();
    // The sines of the test are the platform's: a ray at an edge may differ.
    let differing = (0..ids.len()).filter(|&ray| ids[ray] != same[ray]).count();
    assert!(differing <= 2, "{differing} of {}", ids.len());
    assert!(ids.contains(&NO_TRIANGLE) && ids.iter().any(|&id| id != NO_TRIANGLE));
    for (id, range) in ids.iter().zip(ranges) {
        assert_eq!(*id == NO_TRIANGLE, range == f32::INFINITY);
    }
}

#[test]
fn rings_on_both_paths() {
    let place = place!();
    let line = "probe builtin:umbel:3000 --center 0.2,1.5,0.3 --pattern rings=40,columns=300,fov=-70..80";
    let hash = |more: &str| {
        place.quiet_run(&format!("{line} {ARRAYS} --report r.json {more}"));
        let report = place.json("r.json");
        assert_eq!((&report["command"], &report["rays"]), (&"probe".into(), &12000.into()));
        report["hash"].clone()
    };
    assert_eq!(hash(""), hash("--path general --threads 3"));
}

/// The axis of the rings is --up, whatever is level then; a target turns them.
#[test]
fn rings_turn_about_the_axis() {
    let place = place();
    let pattern = "--pattern rings=5,columns=36,fov=-30..20";
    let turned = |turn: fn([f64; 3]) -> [f64; 3]| -> Vec<[f64; 3]> {
        rings(5, 36, [-30.0, 20.0]).into_iter().map(turn).collect()
    };
    let line = format!("probe box.obj --center 1.25,0.5,-0.75 {ARRAYS} {pattern}");
    // +Z up and +X ahead: right is −Y.
    place.quiet_run(&format!("{line} --up 0,0,2"));
    check(&place, &turned(|[x, y, z]| [-z, -x, y]));
    place.quiet_run(&format!("{line} --up 0,-1,0"));
    check(&place, &turned(|[x, y, z]| [-x, -y, z]));
    // A target to the right.
    place.quiet_run(&format!("{line} --target 9.25,0.5,-0.75"));
    check(&place, &turned(|[x, y, z]| [-z, y, x]));
    // A tilted axis: ahead is what is level and nearest to −Z, (0, 0.28, −0.96).
    place.quiet_run(&format!("{line} --up 0,0.96,0.28"));
    check(&place, &turned(|[x, y, z]| [x, 0.96 * y - 0.28 * z, 0.28 * y + 0.96 * z]));
}

/// `probe --camera` is `render --camera` from the centre, whatever is written.
#[test]
fn lenses_are_those_of_render() {
    let place = place!();
    let files = "--aov id=id.npy --aov normal=n.npy --aov depth=t.npy --samples 3 -o a.exr --aov id";
    let names = ["id.npy", "n.npy", "t.npy", "a.exr"];
    for (lens, more) in [
        ("cube", "--cube-size 20"),
        ("equirect", "--size 40x20 --target 0.2,1.5,-2"),
        ("fisheye", "--size 31x30 --fov 220 --target 1,2,3 --up 0,0,1"),
    ] {
        place.quiet_run(&format!(
            "render builtin:umbel:3000 --eye 0.2,1.5,0.3 --camera {lens} {more} {files}"
        ));
        let rendered = names.map(|name| place.bytes(name));
        place.quiet_run(&format!(
            "probe builtin:umbel:3000 --center 0.2,1.5,0.3 --camera {lens} {more} {files}"
        ));
        assert!(names.map(|name| place.bytes(name)) == rendered, "{lens}");
    }
}

#[test]
fn a_probe_looks_level_all_around() {
    let place = place();
    place.quiet_run(
        "probe box.obj --center 1.25,0.5,-0.75 --size 4x3 --aov id=id.npy --aov distance=range.npy",
    );
    // The columns look at ±45 and ±135 degrees from −Z; the middle row is level.
    let sides: Vec<u32> = place.npy("id.npy").u32()[4..8].iter().map(|id| id / 2).collect();
    let expected = [[-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0]].map(expected);
    assert!(sides.iter().zip(expected).all(|(&side, (_, expected))| side as usize == expected), "{sides:?}");
    for (range, (expected, _)) in place.npy("range.npy").f32()[4..8].iter().zip(expected) {
        assert!((f64::from(*range) - expected).abs() < 1e-5);
    }
    place.quiet_run("probe box.obj --center 1.25,0.5,-0.75");
    let (width, height, _) = umbel::files::read_png_rgb8(&place.path("umbel.png")).expect("a picture");
    assert_eq!((width, height), (1024, 512));
}

/// Far from the origin the direction of the default view must not be lost in the sum with the centre.
#[test]
fn far_centres_look_the_same_way() {
    let place = place!();
    for (center, size) in
        [([0.0; 3], 1.0), ([1e9, -1e9, 1e9], 4e9), ([-1e30, 1e30, -1e30], 4e30), ([1e-40, 0.0, -1e-40], 1.0)]
    {
        let corner = |k: usize| [0, 1, 2].map(|bit| if k >> bit & 1 == 0 { -size } else { size });
        let vertices =
            (0..8).map(|k| format!("v {:e} {:e} {:e}\n", corner(k)[0], corner(k)[1], corner(k)[2]));
        let faces = BOX.split_once('f').expect("faces").1;
        place.put("far.obj", format!("{}f{faces}", vertices.collect::<String>()));
        let [x, y, z] = center;
        for lens in ["--pattern rings=1,columns=1,fov=0..0", "--camera fisheye --size 1x1"] {
            place.quiet_run(&format!("probe far.obj --center {x:e},{y:e},{z:e} {lens} {ARRAYS}"));
            assert_eq!(place.npy("range.npy").f32(), [(z - f64::from(-size as f32)) as f32]);
            for (point, expected) in place.npy("points.npy").f32().into_iter().zip([x, y, -size]) {
                assert!((f64::from(point) - expected).abs() <= 1e-6 * size, "{lens}: {point:e}");
            }
        }
    }
}

/// Neither is an error: there is nothing to see.
#[test]
fn no_rays_and_no_triangles() {
    let place = place();
    place.put("none.npy", npy("<f8", false, "(0, 3)", &f8(&[])));
    place.quiet_run(&format!("probe box.obj --center 0,0,0 --pattern none.npy {ARRAYS}"));
    assert_eq!(place.npy("range.npy").shape, [0]);
    assert_eq!(place.npy("points.npy").shape, [0, 3]);
    place.put("one.npy", directions(&[[0.0, 0.0, 1.0]]));
    place.put("empty.obj", "# nothing\n");
    place.quiet_run(&format!("probe empty.obj -q --center 0,0,0 --pattern one.npy {ARRAYS}"));
    assert_eq!(place.npy("id.npy").u32(), [NO_TRIANGLE]);
    assert!(place.npy("points.npy").f32().iter().all(|x| x.is_nan()));
}
