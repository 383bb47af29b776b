//! What other programs write and other readers take; and what is left out, said with a count and the first line.

use common::place;
use umbel::scene::NO_INDEX;

use super::{assert_warned, read, refusal};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn blanks_behind_a_backslash_do_not_matter() {
    for blank in ["", " ", "\t", "  \t ", " \r", "\r"] {
        let scene = read(format!("{SQUARE}f 1 2 \\{blank}\n  3 4\n"));
        assert_eq!(scene.triangles, [[0, 1, 2], [0, 2, 3]], "{blank:?}");
        assert!(scene.warnings.is_empty());
    }
    // In the midst of numbers, several times, and at the end of the file.
    assert_eq!(read("v 0 \\ \n \\\t\n 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 \\ ").triangles, [[0, 1, 2]]);
    assert_eq!(refusal(format!("{SQUARE}f 1 \\ 2\n")).0, Some(5));
}

#[test]
fn the_index_0_stands_for_no_normal_and_no_texture_coordinate() {
    let text =
        format!("{SQUARE}vt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/3/1\nf 1/1/0 3/3/0 4/0/0\n");
    let scene = read(text);
    assert_eq!(scene.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(scene.normal_indices[1], [NO_INDEX; 3]);
    assert_eq!(scene.uv_indices[1], [0, 2, NO_INDEX]);
    assert_warned(&scene, &["index 0", ": 4, the first in line 10: `1/1/0`"]);
    let scene = read(format!("{SQUARE}vn 0 0 1\nf 1//0 2//00 3//-0\n"));
    assert!(scene.normal_indices.is_empty());
    assert_warned(&scene, &["index 0", ": 3"]);
    // Of a position it is an error in any case.
    assert!(refusal(format!("{SQUARE}f 0 1 2\n")).1.contains("position index 0"));
}

#[test]
fn curves_and_surfaces_are_told() {
    let surface = "cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nparm u 0 1\nparm v 0 1\nend\n";
    let scene = read(format!("{SQUARE}f 1 2 3\n{surface}"));
    assert_warned(&scene, &["curves and surfaces", ": 1, the first in line 8: `surf 0 1 0 1 1 2 3 4`"]);
    let scene = read(format!("{SQUARE}{surface}"));
    assert_warned(&scene, &["curves and surfaces"]);
    assert_warned(&scene, &["no triangles"]);
    let old = "curv 0 1 1 2\ncurv2 1 2\nbzp 1 2 3\nbsp 1 2 3\ncdc 1 2 3\ncdp 1 2\n";
    assert_warned(&read(format!("{SQUARE}f 1 2 3\n{old}")), &["curves and surfaces", ": 6"]);
}

#[test]
fn statements_that_are_not_known_are_counted() {
    let scene = read(format!("{SQUARE}f 1 2 3\nF 1 2 3\nV 1 1 1\nfoo\n"));
    assert_eq!((scene.triangles.len(), scene.positions.len()), (1, 4));
    assert_warned(&scene, &["not known", ": 3, the first in line 6: `F 1 2 3`"]);
    assert_warned(&read(format!("{SQUARE}f 1 2 3\ncall other.obj\ncsh ls\n")), &["call", ": 2"]);
    // The old way to write a face.
    let scene = read(format!("{SQUARE}fo 1 2 3 4\n"));
    assert_eq!(scene.triangles.len(), 2);
    assert_warned(&scene, &["`fo`", ": 1"]);
    // What makes no geometry is no news.
    let quiet = "s 1\ns off\nlod 2\nusemap x\nshadow_obj a\nvp 0 1\nmg 1 2\nbevel on\n#F\n\n";
    assert!(read(format!("{SQUARE}{quiet}f 1 2 3\n")).warnings.is_empty());
}

#[test]
fn weights_of_positions_are_left_out_and_told() {
    let scene = read("v 0 0 0 1\nv 2 0 0 1.0\nv 0 2 0 2\nv 1 1 1 0\nf 1 2 3\n");
    assert_eq!(scene.positions, [[0., 0., 0.], [2., 0., 0.], [0., 2., 0.], [1., 1., 1.]]);
    assert_warned(&scene, &["weight", ": 2, the first in line 3"]);
    // Colours are none.
    assert!(read("v 0 0 0 .5 .5 .5\nv 2 0 0 1 0 0\nv 0 2 0 0 0 0\nf 1 2 3\n").warnings.is_empty());
}

#[test]
fn looking_straight_down_needs_no_up() {
    let place = place!();
    // One triangle, whose corner towards -Z is alone: it is on top from above, and from below at the bottom.
    place.put("a.obj", "v -1 0 1\nv 1 0 1\nv 0 0 -1\nf 1 2 3\n");
    for (eye, is_below) in [("0,3,0", false), ("0,-3,0", true)] {
        place.quiet_run(&format!("render a.obj --eye {eye} --target 0,0,0 --size 33x33 --aov id=id.npy"));
        let ids = place.npy("id.npy").u32();
        let widths: Vec<usize> =
            ids.chunks(33).map(|row| row.iter().filter(|id| **id == 0).count()).filter(|n| *n > 0).collect();
        let (top, bottom) = (widths[0], widths[widths.len() - 1]);
        assert_eq!(top > bottom, is_below, "{eye}: {widths:?}");
    }
    let run = place.run("render a.obj --eye 0,3,0 --target 0,0,0 --up 0,2,0 --size 9x9 --aov id=id.npy");
    assert!(run.code == Some(2) && run.stderr.contains("parallel"), "{}", run.stderr);
}
