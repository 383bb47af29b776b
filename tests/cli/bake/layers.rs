//! Layers in one plane, which rounding to f32 has put before or behind each other: counted, and left out by a least distance.

use common::command::Place;
use common::place;

use super::{CEILING, FLOOR};

/// A poster on a wall, both turned together: rounding put its corners up to 1.5e-7 behind the wall.
const POSTER: &str = "\
v 1.0383650064468384 -3.167771577835083 -1.302524209022522
v 4.784430980682373 6.104066848754883 -1.302524209022522
v 1.1616350412368774 7.5677714347839355 7.902524471282959
v -2.5844309329986572 -1.7040669918060303 7.902524471282959
v 1.8344208002090454 2.7661025524139404 2.195394277572632
v 2.2090272903442383 3.693286418914795 2.195394277572632
v 1.8467477560043335 3.8396568298339844 3.115899085998535
v 1.472141146659851 2.91247296333313 3.115899085998535
vt 0.05 0.05
vt 0.95 0.05
vt 0.95 0.95
vt 0.05 0.95
f 1 2 3
f 1 3 4
f 5/1 6/2 7/3
f 5/1 7/3 8/4
";

fn place() -> Place {
    let place = place!();
    place.put("floor.obj", FLOOR);
    place.put("ceiling.obj", CEILING);
    place
}

fn bake(place: &Place, line: &str) -> Vec<f32> {
    let run = place.run(&format!("bake {line} -o a.npy"));
    assert_eq!(run.code, Some(0), "{line}: {}", run.stderr);
    place.npy("a.npy").f32()
}

#[test]
fn layers_apart_by_rounding_are_counted_and_left_out_on_request() {
    let place = place();
    place.put("poster.obj", POSTER);
    let texels = "bake poster.obj --texels 64 --margin 0 -o a.npy --report r.json";
    let run = place.run(texels);
    let dark = place.npy("a.npy").f32().iter().filter(|&&value| value == 0.0).count();
    assert!(
        dark > 1000
            && run.stderr.contains(&format!("of another surface, which hides all from them: {dark} of")),
        "{dark}: {}",
        run.stderr
    );
    assert_eq!(place.json("r.json")["bake"]["receivers_near_surfaces"], dark);
    for least in ["0.00001", "0.001%"] {
        let run = place.run(&format!("{texels} --min-distance {least}"));
        assert!(!run.stderr.contains("rounding"), "{}", run.stderr);
        let values = place.npy("a.npy").f32();
        assert!(values.iter().all(|value| value.is_nan() || *value > 0.99), "{least}");
    }
    // Vertices, and rays of their own.
    for set in ["shared", "independent"] {
        let values = bake(&place, &format!("poster.obj --vertices --set {set} --min-distance 0.0001"));
        assert!(values[4..].iter().all(|&value| value > 0.99), "{values:?}");
    }
}

/// What is nearer than the least distance does not count, what is farther does, to the bit: a ceiling at 1 above a floor.
#[test]
fn a_least_distance_is_exact() {
    let place = place();
    let bake =
        |more: &str| bake(&place, &format!("floor.obj --vertices --occluders ceiling.obj --rays 500 {more}"));
    let (all, far) = (bake(""), bake("--min-distance 0.999"));
    assert_eq!(all, far);
    // Of the half space the rays that reach the ceiling within 2 lie in the cone of 60°: 3/4 by the cosine.
    let within = bake("--min-distance 2");
    assert!(within.iter().all(|value| (value - 0.75).abs() < 0.02), "{within:?}");
    assert_eq!(bake("--min-distance 2 --max-distance 2.000001"), [1.0; 5]);
    // With a falloff nothing lies between what ends before and the least distance.
    let falling = bake("--min-distance 3 --max-distance 4 --falloff linear");
    assert!(falling.iter().all(|&value| value > 0.9), "{falling:?}");
    for (line, named) in [
        ("--min-distance 2 --max-distance 1", "least distance"),
        ("--min-distance -1", "--min-distance"),
        ("--min-distance 1 --depth-maps 64", "--min-distance"),
        ("--min-distance 1 --group direction", "--min-distance"),
    ] {
        let run = place.run(&format!("bake floor.obj --vertices -o a.npy {line}"));
        assert!(run.code == Some(2) && run.stderr.contains(named), "{line}: {}", run.stderr);
    }
}
