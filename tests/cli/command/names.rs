//! Names of files: no output destroys another one, or a file that is read.

use super::SQUARES;
use common::place;

/// Runs a line that must be refused for its names, and checks that every file is what it was.
fn refuse(line: &str, named: &str) {
    let place = place!();
    place.put("squares.obj", SQUARES);
    place.put("points.npy", "points");
    place.put("old.npy", "old");
    std::fs::create_dir(place.path("sub")).expect("a directory");
    std::fs::write(place.path("sub/heights.png"), "heights").expect("written");
    #[cfg(unix)]
    std::os::unix::fs::symlink(place.path("points.npy"), place.path("link.npy")).expect("a link");
    let before = place.names();
    let run = place.run(line);
    assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "umbel {line}\n{}", run.stderr);
    assert!(run.stderr.contains(named), "umbel {line}: {named}?\n{}", run.stderr);
    assert_eq!(place.names(), before, "umbel {line}");
    assert_eq!(place.bytes("points.npy"), b"points", "umbel {line}");
    assert_eq!(place.bytes("old.npy"), b"old", "umbel {line}");
}

#[test]
fn two_outputs_in_one_place() {
    for line in [
        "render squares.obj -o q.png --report q.png",
        "render squares.obj -o q.png --report ./q.png",
        "render squares.obj -o q.png --report sub/../q.png",
        "render squares.obj --report umbel.png",
        "render squares.obj --aov id=a.npy --aov depth=./a.npy",
        "render squares.obj --aov id=a.npy --aov depth=a.npy",
        "render squares.obj --aov id=old.npy --aov depth=sub/../old.npy",
        "probe squares.obj --center 0,0,1 -o a.png --aov id=b.npy --report sub/../b.npy",
        "visible squares.obj -o a.npy --report a.npy",
        "shadow squares.obj --light 0,9,0 -o a.npy --mask ./a.npy",
        "shadow squares.obj --light 0,9,0 --light 1,9,0 -o a{light}.npy --mask ./a1.npy",
        "bake squares.obj --vertices -o a.npy --bent sub/../a.npy",
        "bake squares.obj --vertices -o a.npy --dump-rays ./a.npy",
        "verify squares.obj --difference a.png --report a.png",
        "trade squares.obj -o a.html --csv b.csv --report b.csv",
        "reyes squares.obj --subdivide -o a.png --aov id=./b.npy --report b.npy",
    ] {
        let is_spelled_alike = !line.contains("./");
        refuse(line, if is_spelled_alike { "two outputs have this name" } else { "are the same file" });
    }
}

#[test]
fn an_output_in_the_place_of_an_input() {
    for line in [
        "bake squares.obj --points points.npy -o points.npy",
        "bake squares.obj --points points.npy -o sub/../points.npy",
        "bake squares.obj --points old.npy --point-ids points.npy -o ./points.npy",
        "bake squares.obj --vertices -o a.npy --report squares.obj",
        "bake builtin:cornell --occluders squares.obj --vertices -o a.npy --report squares.obj",
        "probe squares.obj --center 0,0,1 --pattern points.npy --aov distance=points.npy",
        "visible squares.obj --views old.npy -o old.npy",
        "reyes squares.obj --displace sub/heights.png --height 1 -o sub/heights.png",
    ] {
        refuse(line, "which is read");
    }
    #[cfg(unix)]
    refuse("bake squares.obj --points link.npy -o points.npy", "which is read");
}

/// What holds nothing cannot be destroyed; and a number in a name is another name.
#[test]
fn devices_take_any_number_of_outputs() {
    let place = place!();
    place.put("squares.obj", SQUARES);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/dev/null", place.path("a.npy")).expect("a link");
        std::os::unix::fs::symlink("/dev/null", place.path("b.npy")).expect("a link");
        place.quiet_run("render squares.obj --size 9x9 --aov id=a.npy --aov depth=b.npy --report /dev/null");
    }
    place.quiet_run("shadow squares.obj --light 0,9,0 --size 9x9 --cube-size 8 -o a0.npy --mask a1.npy");
}

/// Bytes that are no UTF-8 are as good as others in the name of a scene and in that of every output.
#[cfg(target_os = "linux")]
#[test]
fn names_need_not_be_utf_8() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt as _;

    let place = place!();
    let odd = |name: &str| OsStr::from_bytes(&[b"\xff", name.as_bytes()].concat()).to_owned();
    std::fs::write(place.path("").join(odd("a.obj")), SQUARES).expect("written");
    std::fs::write(place.path("").join(odd("heights.png")), b"no picture").expect("written");
    let check = |words: &[&OsStr], outputs: &[OsString]| {
        let run = place.run_words(words);
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{words:?}");
        for output in outputs {
            assert!(place.path("").join(output).exists(), "{words:?}: {output:?}");
        }
    };
    let word = OsStr::new;
    let scene = odd("a.obj");
    let joined = |start: &str, name: &str| [OsString::from(start), odd(name)].join(OsStr::new(""));
    let (picture, depth, report) = (odd("a.png"), odd("d.npy"), odd("r.json"));
    check(
        &[
            word("render"),
            &scene,
            word("-o"),
            &picture,
            word("--aov"),
            &joined("depth=", "d.npy"),
            word("--report"),
            &report,
        ],
        &[picture.clone(), depth, report.clone()],
    );
    let (maps, both) = (odd("{light}.npy"), [odd("0.npy"), odd("1.npy")]);
    check(
        &[
            word("shadow"),
            &scene,
            word("--light"),
            word("1,2,3"),
            word("--light"),
            word("2,2,3"),
            word("--cube-size"),
            word("8"),
            word("-o"),
            &maps,
            word("--occluders"),
            &scene,
        ],
        &both,
    );
    let values = odd("v.npy");
    check(
        &[
            word("bake"),
            &scene,
            word("--vertices"),
            word("--rays"),
            word("1"),
            word("-o"),
            &values,
            word("--occluders"),
            &scene,
        ],
        std::slice::from_ref(&values),
    );
    let output = odd("p.npy");
    check(&[word("visible"), &scene, word("-o"), &output], std::slice::from_ref(&output));
    check(&[word("reyes"), &scene, word("--size"), word("8x8"), word("-o"), &picture], &[]);
    // What is wrong with such a file is said, and its name is shown as far as it can be.
    let heights = odd("heights.png");
    let run =
        place.run_words(&[word("reyes"), &scene, word("--displace"), &heights, word("--height"), word("1")]);
    assert!(run.code == Some(3) && run.stderr.contains("heights.png"), "{}", run.stderr);
    let run = place.run_words(&[
        word("probe"),
        &scene,
        word("--center"),
        word("0,0,0"),
        word("--pattern"),
        &odd("none.npy"),
        word("--aov"),
        &joined("depth=", "e.npy"),
    ]);
    assert!(run.code == Some(3) && run.stderr.contains("none.npy"), "{}", run.stderr);
    // Two spellings of one place are still found out.
    let run = place.run_words(&[
        word("render"),
        &scene,
        word("-o"),
        &picture,
        word("--aov"),
        &joined("depth=./", "d.npy"),
        word("--aov"),
        &joined("id=", "d.npy"),
    ]);
    assert!(run.code == Some(2) && run.stderr.contains("same file"), "{}", run.stderr);
}
